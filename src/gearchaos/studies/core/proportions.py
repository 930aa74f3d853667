"""Shares of random draws, with the intervals of Clopper and Pearson."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

CONFIDENCE = 0.95


def proportion(number: ArrayLike, total: ArrayLike) -> np.ndarray:
    """The share (3, ...) of a number of draws among all of them, with the ends of its 95 % interval; NaN of no draws.

    The draws are independent. Neither number need be whole: draws of unequal weight count as fewer of equal weight.
    """
    from scipy.stats import beta  # here, since scipy.stats takes a second to load

    number, total = np.broadcast_arrays(np.asarray(number, float), np.asarray(total, float))
    tail, drawn = (1 - CONFIDENCE) / 2, total > 0
    share = np.divide(number, total, out=np.full(total.shape, np.nan), where=drawn)
    low = np.where(number > 0, beta.ppf(tail, number, total - number + 1), 0.0)
    high = np.where(number < total, beta.ppf(1 - tail, number + 1, total - number), 1.0)
    return np.stack([share, *np.where(drawn, [low, high], np.nan)])
