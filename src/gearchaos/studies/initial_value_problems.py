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
    """Equations and initial states of L trajectories.

    Attributes
    ----------
    batch : Batch
        The model with the parameters and initial values of each of them.
    flow : ExactFlow
        The exact flow of their parameter points.
    w : (d, L)
        Initial states at phase 0.
    points : (L,)
        Numbers of their parameter points in the flow.
    """

    batch: Batch
    flow: ExactFlow
    w: np.ndarray
    points: np.ndarray

    @property
    def motions(self) -> tuple[ExactFlow, np.ndarray, np.ndarray]:
        """Flow, initial states and parameter points, as `batch_classification.InitialStates` returns them."""
        return self.flow, self.w, self.points

    def take(self, which: np.ndarray) -> InitialValueProblems:
        """Those of the trajectories with these indices."""
        return InitialValueProblems(self.batch.take(which), self.flow, self.w[:, which], self.points[which])


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
    w = initial_state(batch, system).T.copy()
    return InitialValueProblems(batch, ExactFlow(system, samples), w, np.arange(batch.size))
