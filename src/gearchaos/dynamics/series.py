"""Sums over time with results that do not depend, bit for bit, on the other trajectories of the batch.

NumPy sums a contiguous axis pairwise and any other axis in sequence, which rounds differently. Therefore the time axis
is made contiguous before it is summed.
"""

from __future__ import annotations

import numpy as np


def time_last(series: np.ndarray) -> np.ndarray:
    """A time series (N, ..., L) as a contiguous array (..., L, N)."""
    return np.ascontiguousarray(np.moveaxis(series, 0, -1))


def time_sum(series: np.ndarray) -> np.ndarray:
    """The sum (..., L) of a time series (N, ..., L) over time."""
    return time_last(series).sum(axis=-1)
