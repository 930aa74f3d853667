"""Piecewise constant mesh stiffness."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from gearchaos.errors import InputError
from gearchaos.model.stiffness.base import Stiffness
from gearchaos.quantities import Rule
from gearchaos.validation import check_rule, to_floats

MAX_LEVELS = 64  # most levels of a `SteppedStiffness`
_POSITIVE_LEVEL = Rule(lambda v: v > 0, "must be greater than 0", "A level is the mesh stiffness over c0.")
_IN_PERIOD = Rule(
    lambda v: (v >= 0) & (v < 1), "must lie in [0, 1)", "A start is a fraction of the mesh period, τ/T.")


@dataclass(frozen=True)
class SteppedStiffness(Stiffness):
    """Piecewise constant mesh stiffness over the reference stiffness c0.

    χ(τ) = ``levels[i]`` for ``starts[i]`` <= τ/T < ``starts[i + 1]``, with the mesh period T. The last level lasts
    until the first start of the next period, so that it also covers 0 <= τ/T < ``starts[0]``. The time mean of χ, the
    sum of the levels weighted with their durations, may differ from 1: ω0 and ζ refer to the reference stiffness c0,
    where χ = 1, and not to the mean.

    Attributes
    ----------
    levels : tuple of float
        1 to 64 values of χ, each greater than 0.
    starts : tuple of float
        Where each level begins, as a fraction of the mesh period; they increase strictly, and lie in [0, 1).

    Raises
    ------
    InputError
        For a value that breaks a rule.

    Examples
    --------
    Two pairs of teeth in contact for 0.4 of the mesh period, one pair for the rest:

    >>> SteppedStiffness(levels=(1.25, 0.75), starts=(0.0, 0.4))
    SteppedStiffness(levels=(1.25, 0.75), starts=(0.0, 0.4))
    """

    levels: tuple[float, ...]
    starts: tuple[float, ...]

    kind, form = "steps", "stepped"
    noun, predicate = "a stepped stiffness", "has steps"
    keys = "levels and starts"
    pair_fields = {"levels": "stiffness_levels", "starts": "stiffness_starts"}  # noqa: RUF012 -- never changed
    stiffness_fields = ("levels",)

    def __post_init__(self) -> None:
        levels = to_floats("stiffness.levels", self.levels, MAX_LEVELS, "levels")
        starts = to_floats("stiffness.starts", self.starts, MAX_LEVELS, "levels")
        if not levels:
            raise InputError("stiffness.levels", f"must have 1 to {MAX_LEVELS} levels", len(levels))
        if len(starts) != len(levels):
            raise InputError("stiffness.starts", f"must have as many values as levels ({len(levels)})", len(starts),
                             "Give the start of each level as a fraction of the mesh period.")
        check_rule("stiffness.levels", np.array(levels), _POSITIVE_LEVEL)
        check_rule("stiffness.starts", np.array(starts), _IN_PERIOD)
        if np.any(np.diff(starts) <= 0):
            raise InputError("stiffness.starts", "must increase strictly", starts,
                             "Sort the levels by their starts, and give each start once.")
        object.__setattr__(self, "levels", levels)
        object.__setattr__(self, "starts", starts)

    @classmethod
    def parts(cls, values: Mapping[str, Any]) -> tuple[tuple[Any, Any], ...]:
        return tuple(zip(values["starts"], values["levels"], strict=True))

    def describe(self) -> str:
        return f"{self.outline}, {min(self.levels):.4g} to {max(self.levels):.4g}"

    @property
    def outline(self) -> str:
        return f"{len(self.levels)} levels"

    @classmethod
    def example(cls) -> Self:
        return cls((1.25, 0.75), (0.0, 0.5))
