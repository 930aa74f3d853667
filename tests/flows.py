"""The flow of a model, and where it starts."""

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
