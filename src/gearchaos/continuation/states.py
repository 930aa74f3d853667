"""Dynamic states of orbits as initial values of a model."""

from __future__ import annotations

import numpy as np

from gearchaos.continuation.family import ParameterFamily
from gearchaos.model import COORDINATES
from gearchaos.model.coordinates import to_physical, transmission_error_at_start


def as_initial_values(family: ParameterFamily, values: np.ndarray, states: np.ndarray) -> dict[str, np.ndarray]:
    """The initial values of the model with which motions begin in dynamic states at phase 0.

    Parameters
    ----------
    family : ParameterFamily
    values : (P, Q)
        Values of the parameters.
    states : (P, n, d)
        n states at each parameter point.

    Returns
    -------
    dict of str to (P, n)
        By the names of the coordinates that the model has.
    """
    batch = family.batch(values)
    error, error_dot = (e[:, None] for e in transmission_error_at_start(batch))
    found = to_physical(batch, family.names, states, np.zeros(states.shape[:2]), error, error_dot)
    return {name: found[name] for name in COORDINATES[batch.model.kind]}
