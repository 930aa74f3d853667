"""From a model and varied values to the exact flow and its initial states: the one way into the flow."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from gearchaos.flow import ExactFlow
from gearchaos.model import Batch, MeshModel, vary
from gearchaos.model.coordinates import initial_state
from gearchaos.model.switched import switched_system


class InitialValueProblems(NamedTuple):
    """Equations and initial states of P trajectories, one per parameter point.

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
    """The flow of a model with parameters and initial values varied, and where its trajectories start.

    Parameters
    ----------
    model : MeshModel
    values : mapping of str to (P,), optional
        Parameters and initial values by name; without them there is one point, the model's own.
    names : tuple of str, optional
        Coordinates of the dynamic state; by default the fewest that will do for these points.
    samples : int
        Instants of the mesh period that the flow can record, as of `ExactFlow`.
    """
    batch = vary(model, values or {})
    system = switched_system(batch, names)
    return InitialValueProblems(batch, ExactFlow(system, samples), initial_state(batch, system).T.copy())
