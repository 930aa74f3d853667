"""How the motion changes along one parameter: stroboscopic sections, verdicts and exponents."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Literal

import numpy as np
import xarray as xr

from gearchaos.datasets import provenance, variable
from gearchaos.dynamics import Classification, Verdicts
from gearchaos.dynamics.settings import as_settings
from gearchaos.errors import InputError, unknown_name, whole_number
from gearchaos.execute import tiles
from gearchaos.flow import ExactFlow
from gearchaos.gears.pair import GearPair, as_model
from gearchaos.model import COORDINATES, MeshModel, state_names, vary
from gearchaos.model.coordinates import start
from gearchaos.model.switched import switched
from gearchaos.studies.axis import Axis, as_axis
from gearchaos.studies.batch_classification import classify_batch
from gearchaos.studies.cost import Effort, effort
from gearchaos.studies.plan import Plan
from gearchaos.studies.plane import corners, shared_coordinates
from gearchaos.studies.sections import steady_sections
from gearchaos.studies.sweep import CARRY, carried

MODES = ("fixed", "up", "down")
_KEPT = 4_000_000
"""Numbers of stroboscopic sections that a tile of columns records at once, at most, but for 64 columns."""
_POINT = 24
"""Bytes that each coordinate of a stroboscopic point takes, until it is saved."""
PER_COLUMN = Classification(exponent_run=1000, doublings=2)
"""Columns are few: each is worth an exponent that draws a clean curve."""


def bifurcation(
    model: MeshModel | GearPair, axis: Axis | str, *, points: int = 128, mode: Literal["fixed", "up", "down"] = "fixed",
    settings: Classification | None = None, progress: bool = False, threads: int | None = None,
) -> xr.Dataset:
    """A bifurcation diagram.

    Parameters
    ----------
    model : MeshModel or GearPair
        Everything but the parameter that varies.
    axis : Axis or str
        The parameter and its range, as a text "eps1=0:0.3:400".
    points : int
        Stroboscopic points per column; 0 for the verdicts alone.
    mode : {"fixed", "up", "down"}
        Start every column from the model's initial values, or carry the state from column to column upwards or
        downwards, as a slow sweep of the machine would; both directions together show hysteresis.
    settings, progress, threads
        As in `zones`.

    Returns
    -------
    xarray.Dataset
        ``section_<coordinate>(axis, point)``, and per column what `zones` tells of a cell.
    """
    return plan(model, axis, points=points, mode=mode, settings=settings).run(progress=progress, threads=threads)


def plan(
    model: MeshModel | GearPair, axis: Axis | str, *, points: int = 128, mode: str = "fixed",
    settings: Classification | None = None,
) -> Plan:
    """The columns of `bifurcation`, checked and ready to be computed."""
    model, axis, settings = as_model(model), as_axis(axis), as_settings(settings)
    points = whole_number("points", points, 0)
    if mode not in MODES:
        raise unknown_name("mode", mode, MODES)
    if mode != "fixed" and axis.name in state_names(model.kind):
        raise InputError("mode", "must be fixed where the axis is an initial value", mode)
    tiles.check_memory("columns", axis.count)
    vary(model, {axis.name: axis.values})  # checked before any work
    names = shared_coordinates(model, axis)
    tiles.check_memory("columns times points", axis.count * points, _POINT * (2 + len(COORDINATES[model.kind])))
    sequential = axis.count * CARRY if mode != "fixed" else 0
    cost = effort(switched(corners(model, axis), names), axis.count, (settings or PER_COLUMN).most, sequential)

    def compute(
        columns: np.ndarray, *, progress: bool = False, threads: int | None = None
    ) -> dict[str, np.ndarray]:
        values = {axis.name: axis.values}
        if mode != "fixed":
            values.update({n: v[0] for n, v in carried(model, axis, mode == "up").items()})
        base = model if mode == "fixed" else replace(model, initial={})
        chosen = {n: v[columns] for n, v in values.items()}
        return _columns(base, chosen, names, points, cost, settings, progress, threads)

    def finish(found: dict[str, np.ndarray], **_: Any) -> xr.Dataset:
        data = {n: variable(n, (axis.name, "point")[: v.ndim], v) for n, v in found.items()}
        coords = {axis.name: variable(axis.name, (axis.name,), axis.values)}
        return xr.Dataset(data, coords, provenance("bifurcation", model, points=points, mode=mode))

    whole = {axis.name: 1 if mode == "fixed" else axis.count}
    return Plan({axis.name: axis.count}, whole, compute, finish, cost, labelled=True)


def _columns(
    model: MeshModel, values: dict[str, np.ndarray], names: tuple[str, ...], points: int, cost: Effort,
    settings: Classification | None, progress: bool, threads: int | None,
) -> dict[str, np.ndarray]:
    """What is found of the columns with these values (N,) by name."""

    def initial_states(tile: np.ndarray) -> tuple[ExactFlow, np.ndarray, np.ndarray]:
        part = vary(model, {k: v[tile] for k, v in values.items()})
        system = switched(part, names)
        return ExactFlow(system), start(part, system).T.copy(), np.arange(len(tile))

    def keep(tile: np.ndarray, flow: ExactFlow, at: np.ndarray, found: Verdicts) -> dict[str, np.ndarray]:
        part = vary(model, {k: v[tile] for k, v in values.items()})
        begin = start(part, flow.system).T.copy()
        places = steady_sections(part, flow, at, begin, found, points) if points else {}
        return found.variables() | {f"section_{name}": value for name, value in places.items()}

    (count,) = {len(v) for v in values.values()}
    return classify_batch(
        initial_states, keep, tiles.dealt(count, threads), settings=settings or PER_COLUMN,
        largest=min(cost.largest(threads), max(64, _KEPT // max(1, points * len(names)))),
        progress="bifurcation" if progress else None, threads=threads,
    )
