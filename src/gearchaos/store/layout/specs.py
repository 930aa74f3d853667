"""What the arrays of a store hold: dtypes and shapes of results, and the values of what is not computed."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import prod
from typing import Any

import numpy as np

from gearchaos.studies.refine import fill_value

FORMAT = 2
"""Version of the layout of new stores."""

FORMATS = (1, FORMAT)
"""Versions of the layout that can be read and resumed: in format 1 every group is a tile, and a group file a chunk."""

ITEMS = "pieces"
"""Folder of the results of work items, which stores call pieces, for a study whose Dataset is computed from them at the
end."""


@dataclass(frozen=True)
class ArraySpec:
    """The dtype of an array of results, and its shape for one work item."""

    dtype: str
    shape: tuple[int, ...]

    @cached_property
    def item_bytes(self) -> int:
        """Size of the result of one work item in bytes."""
        return prod(self.shape) * np.dtype(self.dtype).itemsize


def not_computed(name: str, dtype: np.dtype, layout: int) -> Any:
    """The value of an array where nothing is computed, in a store of format ``layout``.

    NaN for floats and complex numbers, −1 for signed integers, the largest value for unsigned ones. It is no label, no
    period and no code, so that a missing file never looks like a result. In format 1 it is 0 for most integers.
    """
    if layout == 1:
        return fill_value(name, dtype)
    if dtype.kind in "iu":
        return -1 if dtype.kind == "i" else np.iinfo(dtype).max
    return np.nan if dtype.kind in "fc" else True
