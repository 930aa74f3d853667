"""After how many mesh periods does a motion come back? A first guess, for `orbit` to prove or refute."""

from __future__ import annotations

import numpy as np

NEAR = 1e-3
"""Distance, over the size of the motion, at which a return is worth a closer look."""

_BEFORE = 0.01


def size(sections: np.ndarray) -> np.ndarray:
    """How large each motion is in each coordinate, (d, L): its spread over the sections, but not below 1e-3."""
    return np.maximum(np.ptp(sections, axis=0), 1e-3)


def returns(sections: np.ndarray, longest: int) -> np.ndarray:
    """Distance (longest, L) of the last section from the one 1, 2, ..., ``longest`` periods before.

    Parameters
    ----------
    sections : (S, d, L)
        Stroboscopic sections, newest last; S > longest.

    Distances are the largest over the coordinates, each in units of the larger of 1 and the motion's size in it.
    """
    scale = np.maximum(size(sections), 1.0)
    back = sections[-2 : -2 - longest : -1]
    return np.abs((back - sections[-1]) / scale).max(axis=1)


def candidates(sections: np.ndarray, longest: int, count: int) -> np.ndarray:
    """The ``count`` shortest periods (count, L) at which each motion nearly returns; 0 where there is none.

    The return before must have been a near one too: a chaotic motion passes close to where it was now and then, but
    seldom twice running. So the record must hold two rounds of a period.
    """
    longest = min(longest, (len(sections) - 1) // 2)
    near, scale = returns(sections, longest) < NEAR, np.maximum(size(sections), 1.0)
    for n in range(1, longest + 1):
        before = np.abs(sections[-1 - n] - sections[-1 - 2 * n]) / scale
        near[n - 1] &= before.max(axis=0) < _BEFORE
    found = np.zeros((count, sections.shape[2]), dtype=np.int64)
    for i in range(count):
        first = np.argmax(near, axis=0)
        some = near.any(axis=0)
        found[i] = np.where(some, first + 1, 0)
        near[first, np.arange(near.shape[1])] = False
    return found
