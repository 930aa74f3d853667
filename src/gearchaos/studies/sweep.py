"""A slow sweep of one parameter: where it arrives at every value, the state carried along."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from gearchaos.flow import OK, ExactFlow
from gearchaos.model import COORDINATES, Batch, MeshModel, vary
from gearchaos.model.coordinates import (
    initial_state,
    reset_mean_rotation,
    rotation_drifts,
    to_physical,
    transmission_error_at_start,
)
from gearchaos.model.switched import switched_system
from gearchaos.studies.axis import Axis

CARRY = 400
"""Mesh periods at every value."""


def carried(
    model: MeshModel, axis: Axis, up: bool, across: Mapping[str, np.ndarray] | None = None
) -> dict[str, np.ndarray]:
    """Initial values by name, (rows, columns), with which a sweep along the axis reaches each of its values.

    Parameters
    ----------
    model : MeshModel
        With the initial values of the first column; a motion that diverged starts from them anew.
    axis : Axis
    up : bool
        From the first value to the last, or from the last to the first.
    across : mapping of str to (rows,), optional
        Other values, which differ from sweep to sweep; by default there is one sweep.
    """
    across = across or {}
    rows = len(next(iter(across.values()), [0]))
    kept = {n: np.empty((rows, axis.count)) for n in COORDINATES[model.kind]}
    state: dict[str, np.ndarray] = {}
    for column in range(axis.count) if up else range(axis.count)[::-1]:
        values = {**across, axis.name: np.full(rows, axis.values[column])}
        first = _at(vary(model, values))
        state = {n: np.where(np.isfinite(x), x, first[n]) for n, x in state.items()} or first
        for name, value in state.items():
            kept[name][:, column] = value
        state = _after(vary(replace(model, initial={}), {**values, **state}))
    return kept


def _at(batch: Batch) -> dict[str, np.ndarray]:
    """The physical initial state by name, each (P,)."""
    system = switched_system(batch)
    return _physical(batch, system.names, initial_state(batch, system), np.zeros(batch.size))


def _after(batch: Batch) -> dict[str, np.ndarray]:
    """The physical state after the time of one column, each (P,); NaN where the motion diverged.

    A mean rotation that drifts is put back to where it was: after many columns z could no longer be had from x1 − x2.
    """
    system = switched_system(batch)
    out = ExactFlow(system).advance(initial_state(batch, system).T.copy(), CARRY)
    w = np.where(out.status == OK, out.w, np.nan).T
    values, away = _physical(batch, system.names, w, CARRY * system.period), rotation_drifts(batch, system.names)
    if not np.any(away):
        return values
    kept = reset_mean_rotation(batch, system.names, w, *transmission_error_at_start(batch))
    return {n: np.where(away, kept[n], v) if n in kept else v for n, v in values.items()}


def _physical(batch: Batch, names: tuple[str, ...], w: np.ndarray, tau: np.ndarray) -> dict[str, np.ndarray]:
    error, error_dot = (e[:, None] for e in transmission_error_at_start(batch))
    values = to_physical(batch, names, w[:, None], tau[:, None], error, error_dot)
    return {n: values[n][:, 0] for n in COORDINATES[batch.model.kind]}
