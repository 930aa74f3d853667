"""Which stroboscopic sections of a motion come close to its last one."""

from __future__ import annotations

import numpy as np

from gearchaos.flow.kernels.returns import BLOCK, search_returns


def near_returns(sections: np.ndarray, longest: int, near: float, before: float, count: int) -> np.ndarray:
    """The smallest numbers of periods n after which each motion returned to its present state, twice in succession.

    Distances are the largest difference of a coordinate, in units of the larger of 1 and its spread over all sections.

    Parameters
    ----------
    sections : (S, d, L)
        States of L motions after S successive mesh periods, S > 2 ``longest``.
    longest : int
        Largest n considered.
    near : float
        Largest distance between the last section and the one n periods before.
    before : float
        Largest distance between the sections n and 2 n periods before the last one.
    count : int
        How many numbers are reported for each motion.

    Returns
    -------
    (count, L)
        The numbers in ascending order, filled up with zeros.
    """
    found = np.zeros((count, sections.shape[2]), dtype=np.int64)
    if longest < 1:
        return found
    scale, close = np.empty((sections.shape[1] + 1, BLOCK)), np.empty(BLOCK, bool)
    search_returns(sections, longest, near, before, scale, close, found)
    return found
