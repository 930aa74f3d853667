"""The exact flow of a model with varied parameters, and its initial states: those given, or those of slow sweeps.

In a slow sweep of a parameter each value starts from the state in which the previous one ended.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from gearchaos.flow import OK, ExactFlow
from gearchaos.model import Batch, MeshModel, vary
from gearchaos.model.coordinates import (
    initial_state,
    reset_mean_rotation,
    rotation_drifts,
    to_physical,
    transmission_error_at_start,
)
from gearchaos.model.switched import switched_system
from gearchaos.studies.core.axis import Axis

PERIODS_PER_VALUE = 400
"""Mesh periods for which the motion is followed at each value of a swept parameter."""


@dataclass(frozen=True)
class Motions:
    """L motions of one flow: their states w (d, L) at phase 0, and the numbers (L,) of their parameter points in it."""

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

    ``values`` (P,) are those of parameters and initial values by name; without them there is one point, that of the
    model. ``names`` are the coordinates of the dynamic state, by default the smallest set that describes the motion at
    all these points. ``samples`` is as of `ExactFlow`.
    """
    batch = vary(model, values or {})
    system = switched_system(batch, names)
    w = initial_state(batch, system).T.copy()
    return InitialValueProblems(ExactFlow(system, samples), w, np.arange(batch.size), batch)


def initial_states(model: MeshModel, values: Mapping[str, Any], names: tuple[str, ...]) -> np.ndarray:
    """The states (d, P) of `initial_value_problems` without the flow, whose tables take longer."""
    batch = vary(model, values)
    return initial_state(batch, switched_system(batch, names)).T.copy()


def swept_initial_values(
    model: MeshModel, axis: Axis, up: bool, others: Mapping[str, np.ndarray] | None = None
) -> dict[str, np.ndarray]:
    """Initial values by name, (rows, columns), with which a sweep along the axis reaches each of its values.

    The initial values of the model are those at the first value of the sweep: the first of the axis with ``up``, else
    the last. A motion that diverged continues from them. ``others`` (rows,) are values of other parameters, one for
    each of several simultaneous sweeps; without them there is one sweep.
    """
    others = others or {}
    rows = len(next(iter(others.values()), [0]))
    out = {n: np.empty((rows, axis.count)) for n in model.coordinate_names}
    state: dict[str, np.ndarray] = {}
    for column in range(axis.count) if up else range(axis.count)[::-1]:
        values = {**others, axis.name: np.full(rows, axis.values[column])}
        batch = vary(model, values)
        system = switched_system(batch)
        initial = _physical(batch, system.names, initial_state(batch, system), np.zeros(rows))
        state = {n: np.where(np.isfinite(x), x, initial[n]) for n, x in state.items()} or initial
        for name, value in state.items():
            out[name][:, column] = value
        batch = vary(replace(model, initial={}), {**values, **state})
        system = switched_system(batch)
        run = ExactFlow(system).advance(initial_state(batch, system).T.copy(), PERIODS_PER_VALUE)
        w = np.where(run.status == OK, run.w, np.nan).T
        state = _physical(batch, system.names, w, PERIODS_PER_VALUE * system.period)
        drifting = rotation_drifts(batch, system.names)
        if np.any(drifting):  # reset to the initial rotation: z loses digits as the difference of large x1 and x2
            reset = reset_mean_rotation(batch, system.names, w, *transmission_error_at_start(batch))
            state = {n: np.where(drifting, reset[n], v) if n in reset else v for n, v in state.items()}
    return out


def _physical(batch: Batch, names: tuple[str, ...], w: np.ndarray, tau: np.ndarray) -> dict[str, np.ndarray]:
    """Physical coordinates by name, each (P,), of states w (P, d) at the times τ (P,)."""
    error, error_dot = (e[:, None] for e in transmission_error_at_start(batch))
    values = to_physical(batch, names, w[:, None], tau[:, None], error, error_dot)
    return {n: values[n][:, 0] for n in batch.model.coordinate_names}
