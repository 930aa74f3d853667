"""How the motion changes along one parameter: stroboscopic sections, verdicts and exponents."""

from __future__ import annotations

from typing import Literal

import numpy as np
import xarray as xr

from gearchaos.axis import Axis
from gearchaos.errors import unknown_name
from gearchaos.flow import ExactFlow
from gearchaos.model import Batch, MeshModel, vary
from gearchaos.motion import Budget, classify
from gearchaos.studies import tiles
from gearchaos.studies.dataset import provenance, variable
from gearchaos.studies.evidence import evidence
from gearchaos.studies.sections import steady_sections
from gearchaos.studies.simulate import whole_number
from gearchaos.switched import error_at_start, from_physical, start, switched, to_physical

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
        Stroboscopic points per column.
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
    points = whole_number("points", points, 1)
    if mode not in MODES:
        raise unknown_name("mode", mode, MODES)
    values = axis.values
    varied: dict[str, np.ndarray] = {axis.name: values}
    batch = vary(model, varied)
    if mode != "fixed":
        varied.update(_carried(batch, mode, model))
    sections: dict[str, np.ndarray] = {}
    out: dict[str, np.ndarray] = {}

    def work(tile: np.ndarray) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
        part = vary(model, {k: v[tile] for k, v in varied.items()})
        system = switched(part)
        found = classify(ExactFlow(system), start(part, system).T.copy(), budget=budget or PER_COLUMN)
        return evidence(found), steady_sections(part, found, points)

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


def _carried(batch: Batch, mode: str, model: MeshModel) -> dict[str, np.ndarray]:
    """Initial values of every column: the physical state that a sweep reaches it with."""
    system = switched(batch, whole=True)
    flow, w = ExactFlow(system), start(batch, system)
    error, error_dot = error_at_start(batch)
    order = np.arange(batch.size) if mode == "up" else np.arange(batch.size)[::-1]
    physical = {k: np.empty(batch.size) for k in to_physical(system.names, w, error, error_dot)}
    state = w[order[0]]
    for column in order:
        here = to_physical(system.names, state, error[column], error_dot[column])
        for k, v in here.items():
            physical[k][column] = v
        state = flow.advance(state[:, None], _CARRY, points=np.array([column])).w[:, 0]
        after = {k: np.atleast_1d(v) for k, v in to_physical(
            system.names, state, error[column], error_dot[column]).items()}
        following = column + (1 if mode == "up" else -1)
        if 0 <= following < batch.size and "x1" in after:
            full = {**{n: np.zeros(1) for n in ("y1", "y1_dot", "y2", "y2_dot")}, **after}
            state = from_physical(system, full, error[following], error_dot[following])[0]
    keep = ("z", "z_dot") if model.kind == "single" else tuple(k for k in physical if not k.startswith("z"))
    return {k: physical[k] for k in keep}
