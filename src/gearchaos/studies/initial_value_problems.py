"""The exact flow of a model with varied parameters, and its initial states."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from gearchaos.flow import ExactFlow
from gearchaos.model import Batch, MeshModel, vary
from gearchaos.model.coordinates import initial_state
from gearchaos.model.switched import switched_system


@dataclass(frozen=True)
class Motions:
    """L motions of one flow.

    Attributes
    ----------
    flow : ExactFlow
        The exact flow of their parameter points.
    w : (d, L)
        Their states at phase 0.
    points : (L,)
        Numbers of their parameter points in the flow.
    """

    flow: ExactFlow
    w: np.ndarray
    points: np.ndarray

    @classmethod
    def at(cls, flow: ExactFlow, w: np.ndarray, point: int = 0) -> Motions:
        """The motions from states w (d, L) at one parameter point of a flow."""
        return Motions(flow, w, np.full(w.shape[1], point))

    def take(self, which: np.ndarray) -> Self:
        """Those with these indices."""
        return replace(self, w=self.w[:, which].copy(), points=self.points[which])


@dataclass(frozen=True)
class InitialValueProblems(Motions):
    """Motions from initial values; ``batch`` is the model with the parameters and initial values of each of them."""

    batch: Batch

    def take(self, which: np.ndarray) -> Self:
        return replace(super().take(which), batch=self.batch.take(which))


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
    return InitialValueProblems(ExactFlow(system, samples), w, np.arange(batch.size), batch)
