"""How the motion changes along one parameter: stroboscopic sections, verdicts and exponents."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import xarray as xr

from gearchaos.axis import Axis
from gearchaos.coordinates import error_at_start, start, to_physical
from gearchaos.errors import InputError, unknown_name
from gearchaos.flow import OK, ExactFlow
from gearchaos.model import COORDINATES, MeshModel, state_names, vary
from gearchaos.motion import Budget, classify
from gearchaos.studies import tiles
from gearchaos.studies.dataset import provenance, variable
from gearchaos.studies.evidence import evidence
from gearchaos.studies.sections import steady_sections
from gearchaos.studies.simulate import whole_number
from gearchaos.switched import switched

MODES = ("fixed", "up", "down")
_CARRY = 400
_TILE = 256
PER_COLUMN = Budget(exponent=1000, extensions=2)
"""Columns are few: each is worth an exponent that draws a clean curve."""


def bifurcation(
    model: MeshModel, axis: Axis, *, points: int = 128, mode: Literal["fixed", "up", "down"] = "fixed",
    budget: Budget | None = None, progress: bool = False, threads: int | None = None,
) -> xr.Dataset:
    """A bifurcation diagram.

    Parameters
    ----------
    model : MeshModel
        Everything but the parameter that varies.
    axis : Axis
        The parameter and its range.
    points : int
        Stroboscopic points per column; 0 for the verdicts alone.
    mode : {"fixed", "up", "down"}
        Start every column from the model's initial values, or carry the state from column to column upwards or
        downwards, as a slow sweep of the machine would; both directions together show hysteresis.
    budget, progress, threads
        As in `zones`.

    Returns
    -------
    xarray.Dataset
        ``section_<coordinate>(axis, point)``, and per column what `zones` tells of a cell.
    """
    points = whole_number("points", points, 0)
    if mode not in MODES:
        raise unknown_name("mode", mode, MODES)
    values = axis.values
    varied: dict[str, np.ndarray] = {axis.name: values}
    vary(model, varied)  # checked before any work
    if mode != "fixed":
        varied.update(_carried(model, axis, mode))
    base = model if mode == "fixed" else replace(model, initial={})
    sections: dict[str, np.ndarray] = {}
    out: dict[str, np.ndarray] = {}

    def work(tile: np.ndarray) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
        part = vary(base, {k: v[tile] for k, v in varied.items()})
        system = switched(part)
        flow = ExactFlow(system)
        found = classify(flow, start(part, system).T.copy(), budget=budget or PER_COLUMN)
        return evidence(found), steady_sections(part, flow, found, points) if points else {}

    pieces = tiles.split(np.arange(axis.count), _TILE)
    for tile, (facts, places) in tiles.run(work, pieces, progress="bifurcation" if progress else None, threads=threads):
        for name, value in facts.items():
            out.setdefault(name, np.zeros(axis.count, value.dtype))[tile] = value
        for name, value in places.items():
            sections.setdefault(f"section_{name}", np.zeros((axis.count, points)))[tile] = value
    data = {n: variable(n, (axis.name,), v) for n, v in out.items()}
    data.update({n: variable(n, (axis.name, "point"), v) for n, v in sections.items()})
    coords = {axis.name: variable(axis.name, (axis.name,), values)}
    return xr.Dataset(data, coords, provenance("bifurcation", model, points=points, mode=mode))


def _carried(model: MeshModel, axis: Axis, mode: str) -> dict[str, np.ndarray]:
    """Initial values of every column: the physical state that a sweep reaches it with; anew after a divergence."""
    if axis.name in state_names(model.kind):
        raise InputError("mode", "must be fixed where the axis is an initial value", mode)
    columns = range(axis.count) if mode == "up" else range(axis.count)[::-1]
    kept: dict[str, np.ndarray] = {n: np.empty(axis.count) for n in COORDINATES[model.kind]}
    bare = replace(model, initial={})
    state: dict[str, np.ndarray] = {}
    for column in columns:
        batch = vary(bare if state else model, {axis.name: axis.values[[column]], **state})
        system = switched(batch)
        w = start(batch, system).T.copy()
        here = to_physical(batch, system.names, w.T[:, None], np.zeros((1, 1)), *error_at_start(batch))
        after = ExactFlow(system).advance(w, _CARRY)
        time = np.full((1, 1), _CARRY * system.period[0])
        there = to_physical(batch, system.names, after.w.T[:, None], time, *error_at_start(batch))
        state = {n: there[n][0] for n in kept} if after.status[0] == OK else {}
        for n in kept:
            kept[n][column] = here[n].item()
    return kept
