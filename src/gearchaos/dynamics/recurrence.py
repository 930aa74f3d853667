"""Near returns: candidates for the period of a motion, which Newton's method then confirms or rejects."""

from __future__ import annotations

import numpy as np

from gearchaos.flow import near_returns

_TOLERANCE = 1e-3
"""Largest distance of a near return, relative to the size of the motion."""

_PREVIOUS_TOLERANCE = 0.01
"""Largest distance of the near return one period earlier, relative to the size of the motion."""

EXACT = 1e-6
"""Largest distance of the returns of a motion that is on an orbit, relative to the size of the motion."""


def candidates(
    sections: np.ndarray, longest: int, count: int, tolerance: float = _TOLERANCE,
    previous_tolerance: float = _PREVIOUS_TOLERANCE,
) -> np.ndarray:
    """The shortest periods at which motions nearly return.

    Parameters
    ----------
    sections : (S, d, L)
        Consecutive stroboscopic states, newest last.
    longest : int
        Longest period considered, in mesh periods. At most (S − 1)/2 is searched, since two periods must be recorded.
    count : int
        Number of periods returned for each motion.
    tolerance, previous_tolerance : float
        Largest distance of a near return and of the one a period earlier, relative to the size of the motion.

    Returns
    -------
    (count, L) of int
        Periods in mesh periods, shortest first; 0 where there are fewer.

    Notes
    -----
    The return one period earlier must be a near return too: a chaotic motion sometimes passes close to its present
    state, but seldom twice in a row.
    """
    return near_returns(sections, min(longest, (len(sections) - 1) // 2), tolerance, previous_tolerance, count)
