"""Newton's method for periodic orbits, on a batch of trajectories.

Each iteration needs one call of the flow: the caller advances states and unit tangent vectors by the period of the
orbit, and hands the result to `newton_iteration`.
"""

from __future__ import annotations

import numpy as np

from gearchaos.flow.kernels.newton import RESIDUAL, NewtonSearch, newton_iteration

__all__ = ["RESIDUAL", "NewtonSearch", "newton_iteration", "start_newton_search"]


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
