"""Periodic orbits of a batch of trajectories: candidates for the period from near returns, and Newton's method.

Each Newton iteration needs one call of the flow: the caller advances states and unit tangent vectors by the period of
the orbit, and hands the result to `newton_iteration`.
"""

from __future__ import annotations

import numpy as np

from gearchaos.flow.kernels.newton import NewtonSearch
from gearchaos.flow.kernels.returns import BLOCK, search_returns


def near_returns(
    sections: np.ndarray, longest: int, tolerance: float, previous_tolerance: float, count: int
) -> np.ndarray:
    """The smallest numbers of periods n after which each motion returned close to its state, twice in succession.

    The distance of two sections is the largest difference of a coordinate, divided by its range over all sections or by
    1, whichever is larger.

    Parameters
    ----------
    sections : (S, d, L)
        States of L motions after S successive mesh periods, S > 2 ``longest``.
    longest : int
        Largest n considered.
    tolerance : float
        Largest distance between the last section and the one n periods before it.
    previous_tolerance : float
        Largest distance between the sections n and 2 n periods before the last one.
    count : int
        Largest number of values n reported for each motion.

    Returns
    -------
    (count, L)
        The values n in ascending order, padded with zeros.

    Examples
    --------
    >>> import numpy as np
    >>> from gearchaos.flow import near_returns
    >>> sections = np.tile([[0.0], [1.0], [2.0]], (4, 2))[:, :, None]  # three points again and again
    >>> near_returns(sections, 5, 1e-6, 1e-6, 1).tolist()
    [[3]]
    """
    found = np.zeros((count, sections.shape[2]), dtype=np.int64)
    if longest < 1:
        return found
    scale, close = np.empty((sections.shape[1] + 1, BLOCK)), np.empty(BLOCK, bool)
    search_returns(sections, longest, tolerance, previous_tolerance, scale, close, found)
    return found


def start_newton_search(w: np.ndarray) -> NewtonSearch:
    """Begin a search for periodic orbits, to be continued with `newton_iteration`.

    Parameters
    ----------
    w : (d, L)
        Guesses of a point on each orbit.

    Returns
    -------
    NewtonSearch

    Examples
    --------
    >>> import numpy as np
    >>> from gearchaos.flow import start_newton_search
    >>> start_newton_search(np.zeros((2, 3))).monodromy.shape
    (3, 2, 2)
    """
    d, count = w.shape
    return NewtonSearch(w.copy(), w.copy(), w.copy(), np.full(count, np.inf), np.zeros((count, d, d)),
                        np.zeros(count, np.int64), np.zeros((2, d, d + 1)))
