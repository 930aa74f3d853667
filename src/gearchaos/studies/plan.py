"""A study in independent pieces: cells, columns or starts that can be computed anywhere, and what they come to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import xarray as xr

from gearchaos.studies.cost import Effort


class Compute(Protocol):
    """From the numbers (L,) of some pieces what is found of them, arrays (L, ...) by name."""

    def __call__(
        self, numbers: np.ndarray, /, *, progress: bool = False, threads: int | None = None
    ) -> dict[str, np.ndarray]: ...


class Finish(Protocol):
    """From the arrays (N, ...) of all pieces to the Dataset."""

    def __call__(
        self, found: dict[str, np.ndarray], /, *, progress: bool = False, threads: int | None = None
    ) -> xr.Dataset: ...


@dataclass(frozen=True)
class Plan:
    """A study, checked and ready to be computed: all at once here, or piece by piece anywhere.

    What is found of a piece does not depend, bit for bit, on which others are computed beside it.

    Attributes
    ----------
    shape : dict of str to int
        The grid of pieces: its dims and their sizes. Pieces are numbered along rows.
    block : dict of str to int
        Fewest along each dim that are computed together: a sweep takes a whole row.
    compute : Compute
    finish : Finish
    effort : Effort
        What it takes at most.
    labelled : bool
        Whether the Dataset holds just those arrays over the grid, so that it can be had of some pieces before others.
    motions : float
        About how many motions are followed for each piece.
    """

    shape: dict[str, int]
    block: dict[str, int]
    compute: Compute
    finish: Finish
    effort: Effort
    labelled: bool
    motions: float = 1

    @property
    def count(self) -> int:
        """How many pieces there are."""
        return int(np.prod(list(self.shape.values())))

    def run(self, *, progress: bool = False, **options: Any) -> xr.Dataset:
        """The Dataset of the whole study; options as of `Compute`."""
        self.effort.announce(progress, options.get("threads"))
        numbers = np.arange(self.count, dtype=np.int32 if self.count < 2**31 else np.int64)
        return self.finish(self.compute(numbers, progress=progress, **options), progress=progress, **options)
