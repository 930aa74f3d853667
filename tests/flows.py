"""The flow of a model, and where it starts."""

from collections.abc import Callable

import numpy as np

from gearchaos.flow import ExactFlow
from gearchaos.model import MeshModel, vary
from gearchaos.model.coordinates import initial_state
from gearchaos.model.switched import switched_system


def flow_of(model: MeshModel, values: dict | None = None) -> tuple[ExactFlow, np.ndarray]:
    """The flow at every point of the values, if any, and the initial states (d, L)."""
    batch = vary(model, values or {})
    system = switched_system(batch)
    return ExactFlow(system), initial_state(batch, system).T.copy()


def unit_vectors(w: np.ndarray) -> np.ndarray:
    """Unit tangent vectors (d, d, L) for states (d, L)."""
    return np.repeat(np.eye(len(w))[:, :, None], w.shape[1], axis=2)


def central_difference(function: Callable[[float], np.ndarray], step: float) -> np.ndarray:
    """The derivative at 0, of sixth order."""
    terms = zip((-3, -2, -1, 1, 2, 3), (-1, 9, -45, 45, -9, 1), strict=True)
    return sum(weight * function(k * step) for k, weight in terms) / (60 * step)
