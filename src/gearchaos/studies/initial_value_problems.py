"""The exact flow of a model with varied parameters, and its initial states."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from gearchaos.flow import ExactFlow
from gearchaos.model import Batch, MeshModel, vary
from gearchaos.model.coordinates import initial_state
from gearchaos.model.switched import switched_system


class InitialValueProblems(NamedTuple):
    """Equations and initial states of P trajectories, one at each parameter point.

    Attributes
    ----------
    batch : Batch
        The model at P parameter points.
    flow : ExactFlow
        The exact flow of these points.
    w : (d, P)
        Initial states at phase 0.
    """

    batch: Batch
    flow: ExactFlow
    w: np.ndarray

    @property
    def points(self) -> np.ndarray:
        """Numbers (P,) of the parameter points of the trajectories."""
        return np.arange(self.batch.size)


def initial_value_problems(
    model: MeshModel, values: Mapping[str, Any] | None = None, names: tuple[str, ...] | None = None, samples: int = 0
) -> InitialValueProblems:
    """The flow of a model with varied parameters, and initial states of its trajectories.

    Parameters
    ----------
    model : MeshModel
    values : mapping of str to (P,), optional
        Values of parameters and initial values by name; without them there is one point, that of the model.
    names : tuple of str, optional
        Coordinates of the dynamic state; by default the smallest set that describes the motion at all these points.
    samples : int
        Number of equidistant instants of the mesh period that the flow can record; see `ExactFlow`.
    """
    batch = vary(model, values or {})
    system = switched_system(batch, names)
    return InitialValueProblems(batch, ExactFlow(system, samples), initial_state(batch, system).T.copy())
