"""Which extremum of z on one cycle is which on a neighbouring one.

Extrema appear and vanish in pairs, a maximum and a minimum, and pass from the end of the cycle to its beginning.
"""

from __future__ import annotations

import numpy as np


def match(before: np.ndarray, after: np.ndarray, period: int) -> tuple[np.ndarray, list[tuple[int, int]]]:
    """Match the extrema of two neighbouring cycles.

    Parameters
    ----------
    before, after : (E, 3), (F, 3)
        Instants in mesh periods, values of z, and 1 for maxima or −1 for minima, in order of time.
    period : int
        Length of the cycles in mesh periods.

    Returns
    -------
    (E,)
        Index in ``after`` of each extremum of ``before``, −1 if it has vanished.
    list of (int, int)
        The pairs of extrema of ``after`` that are new, by their indices.
    """
    kept, lost = np.arange(len(before)), []
    left, new = np.arange(len(after)), []
    while len(kept) > len(left):
        kept, pair = _without_pair(before, kept, after, left, period)
        lost.append(pair)
    while len(left) > len(kept):
        left, pair = _without_pair(after, left, before, kept, period)
        new.append(pair)
    found = np.full(len(before), -1)
    if len(kept):
        shift, cost = _best_rotation(before[kept], after[left], period)
        if np.isfinite(cost):
            found[kept] = np.roll(left, -shift)
    return found, new


def _best_rotation(before: np.ndarray, after: np.ndarray, period: int) -> tuple[int, float]:
    """By how many places equally many extrema are rotated, and the sum of the differences that then remain.

    The cost is infinite if maxima and minima do not alternate alike.
    """
    count, best = len(before), (0, np.inf)
    if count == 0:
        return 0, 0.0
    for shift in range(-min(count, 4), min(count, 4) + 1):
        rolled = np.roll(after, -shift, axis=0)
        if np.any(rolled[:, 2] != before[:, 2]):
            continue
        lag = rolled[:, 0] - before[:, 0]
        lag -= period * np.round(lag / period)
        cost = float(np.abs(lag).sum() + np.abs(rolled[:, 1] - before[:, 1]).sum())
        if cost < best[1]:
            best = (shift, cost)
    return best


def _without_pair(
    many: np.ndarray, index: np.ndarray, few: np.ndarray, others: np.ndarray, period: int
) -> tuple[np.ndarray, tuple[int, int]]:
    """Leave out the neighbouring pair of ``many[index]`` whose absence makes it most like ``few[others]``.

    Returns the indices that remain, and the pair.
    """
    if len(index) - len(others) == 1:  # one extremum lies at the seam of the cycle, where it may be lost to rounding
        costs = [_best_rotation(many[np.delete(index, i)], few[others], period)[1] for i in range(len(index))]
        i = int(np.argmin(costs))
        return np.delete(index, i), (int(index[i]), int(index[i]))
    pairs = [(i, (i + 1) % len(index)) for i in range(len(index))]
    if len(index) - len(others) > 2:  # too many to try all combinations: the flattest pairs go first
        costs = [abs(many[index[i], 1] - many[index[j], 1]) for i, j in pairs]
    else:
        costs = [_best_rotation(many[np.delete(index, pair)], few[others], period)[1] for pair in pairs]
        if not np.any(np.isfinite(costs)):
            costs = [abs(many[index[i], 1] - many[index[j], 1]) for i, j in pairs]
    pair = pairs[int(np.argmin(costs))]
    return np.delete(index, pair), (int(index[pair[0]]), int(index[pair[1]]))
