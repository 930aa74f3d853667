"""Sums over time that do not depend on company: a lane's result is the same bit for bit whatever lanes are beside it.

NumPy sums a contiguous series pairwise, and others in the order they come; so a series is made contiguous first.
"""

from __future__ import annotations

import numpy as np


def by_lane(series: np.ndarray) -> np.ndarray:
    """A series (N, ..., L) as (..., L, N), the numbers of each lane side by side."""
    return np.ascontiguousarray(np.moveaxis(series, 0, -1))


def total(series: np.ndarray) -> np.ndarray:
    """The sum over time of a series (N, ..., L), (..., L)."""
    return by_lane(series).sum(axis=-1)
