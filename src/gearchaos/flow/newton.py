"""Newton's method for the periodic orbits of many trajectories, each round of which is one call of the flow."""

from __future__ import annotations

import numpy as np

from gearchaos.flow.kernels.newton import RESIDUAL, NewtonSearch, next_round

__all__ = ["RESIDUAL", "NewtonSearch", "newton_search", "next_round"]


def newton_search(w: np.ndarray) -> NewtonSearch:
    """A search that begins at guesses w (d, L); `next_round` continues it."""
    d, lanes = w.shape
    return NewtonSearch(w.copy(), w.copy(), w.copy(), np.full(lanes, np.inf), np.zeros((lanes, d, d)),
                        np.zeros(lanes, np.int64), np.zeros((2, d, d + 1)))
