"""Whether the curves of a skeleton explain where the periodic motions of a map end."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.continuation.agreement import BASIN, CURVE, UNEXPLAINED, Sides, explain_sides
from gearchaos.continuation.curve import CurveData
from gearchaos.continuation.family import ParameterFamily
from gearchaos.datasets import flag_attributes, model_from_json, new_dataset, provenance, variable
from gearchaos.dynamics import Classification, Label
from gearchaos.errors import InputError
from gearchaos.gears.operating import as_model, gears_from_json
from gearchaos.model import MeshModel

if TYPE_CHECKING:
    import xarray as xr

_ROUNDING = 1e-9
"""Distance of a cell from the window up to which it counts as inside, relative to the range of the parameter."""

_CAUSES = {CURVE: "curve", BASIN: "basin boundary", UNEXPLAINED: "unexplained"}


def agreement(skeleton: xr.Dataset, zones: xr.Dataset) -> xr.Dataset:
    """Why periodic motions end at the sides of the cells of a map: at a curve, or at a basin boundary.

    Parameters
    ----------
    skeleton : Dataset
        From `skeleton`.
    zones : Dataset
        From `zones`, over the same two parameters, with at least two values of each in the window of the skeleton.
        Cells outside this window are left out.

    Returns
    -------
    xarray.Dataset
        Over ``side``, the sides between a cell with a periodic motion and a neighbour with another kind of motion or
        period: both parameters of the cell and the neighbour, ``cell_<parameter>`` and ``neighbour_<parameter>``, the
        ``period``, the ``cause``, and ``curve``, the number of the curve, −1 for none. Over ``orbit_period``, the
        periods up to the largest one of the skeleton: ``orbit_cells``, the number of cells with an orbit of this
        period, ``orbit_explained``, the share of these without unexplained side, and ``orbit_sides`` (orbit_period,
        cause_name). ``curve_seen`` (number): whether a curve passes such a side. A curve that is not seen belongs to
        motions that coexist with those of the map. Attributes: ``explained``, the share of the cells of all periods
        without unexplained side; ``window``, the ranges [low, high] of both parameters that map and skeleton have in
        common, as JSON; ``cells_left_out``, the number of cells of the map outside the window of the skeleton.

    Raises
    ------
    InputError
        If an argument is another kind of Dataset, the two are not of the same model and parameters, or have no
        window in common.

    Notes
    -----
    A side is on a basin boundary if the orbit of the cell is stable in the neighbour, too. Otherwise a curve explains
    it that passes within one cell and is a fold or Neimark-Sacker curve of this period, or a flip curve of this period
    or of half of it.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(q0=0.1)
    >>> curves = gc.skeleton(
    ...     model, "omega=1.7:2.3:8", "eps1=0.03:0.09:4", period=1, lines=(1, 1), starts=0, workers=1)
    >>> zones = gc.zones(model, "omega=1.7:2.3:12", "eps1=0.03:0.09:8")
    >>> found = gc.agreement(curves, zones)
    >>> 0 < found.attrs["explained"] <= 1
    True
    """
    _check("skeleton", skeleton, "skeleton")
    _check("zones", zones, "zones")
    y_name, x_name = map(str, zones["label"].dims)
    if {x_name, y_name} != {str(name) for name in skeleton.coords}:
        raise InputError("zones", "must be over the parameters of the skeleton", f"{x_name}, {y_name}",
                         f"Those are {', '.join(map(str, skeleton.coords))}.")
    if not _same_model(skeleton, zones, (x_name, y_name)):
        raise InputError("zones", "must be of the model of the skeleton", "another one")
    whole, zones = zones, _common(skeleton, zones, (x_name, y_name))
    settings = json.loads(zones.attrs["settings"])
    longest = json.loads(skeleton.attrs["settings"])["period"]
    family = ParameterFamily(_model(zones, (x_name, y_name)), (x_name, y_name))
    sides = explain_sides(
        family, zones[x_name].values, zones[y_name].values, zones["label"].values, zones["period"].values,
        _curves(skeleton, (x_name, y_name)), longest, Classification(**settings["classification"]))
    window = {n: [float(zones[n].min()), float(zones[n].max())] for n in (x_name, y_name)}
    x, y = ([name, *window[name], zones.sizes[name]] for name in (x_name, y_name))
    attributes = provenance("agreement", family.model, x=x, y=y, period=longest)
    attributes |= {"window": json.dumps(window), "cells_left_out": whole["label"].size - zones["label"].size}
    return _dataset(zones, sides, longest, (x_name, y_name), attributes)


def _check(field: str, dataset: Any, study: str) -> None:
    """Raise `InputError` unless this is a dimensionless result of a study."""
    found = getattr(dataset, "attrs", {}).get("study", f"a {type(dataset).__name__}")
    if found != study:
        raise InputError(field, f"must be a result of gearchaos.{study}", found)
    if "pair" in dataset.attrs:
        raise InputError(field, "must be dimensionless", "physical units", "Use the result before gearchaos.physical.")


def _common(skeleton: xr.Dataset, zones: xr.Dataset, names: tuple[str, str]) -> xr.Dataset:
    """The cells of a map in the window of a skeleton; raises `InputError` unless there are two along each parameter."""
    settings = json.loads(skeleton.attrs["settings"])
    window = {name: (start, stop) for name, start, stop, *_ in (settings["x"], settings["y"])}
    inside = {}
    for name in names:
        (start, stop), values = window[name], zones[name].values
        margin = _ROUNDING * (stop - start)
        inside[name] = np.flatnonzero((values >= start - margin) & (values <= stop + margin))
        if len(inside[name]) < 2:
            raise InputError("zones", f"must have at least two values of {name} in the window of the skeleton, from "
                             f"{start:g} to {stop:g}", f"{values.min():g} to {values.max():g}, {len(values)} values")
    return zones.isel(inside)


def _same_model(skeleton: xr.Dataset, zones: xr.Dataset, names: tuple[str, str]) -> bool:
    """Whether two results are of the same model, but for the parameters of their axes and the initial values."""
    first, second = (_model(ds, names) for ds in (skeleton, zones))
    varied = {single for name in names for single in first.set_by(name)}
    own, other = first.parameters(), second.parameters()
    return first.kind == second.kind and own.keys() == other.keys() and all(
        own[n] == other[n] for n in own.keys() - varied)


def _model(dataset: xr.Dataset, names: tuple[str, str]) -> MeshModel:
    """The model of a result; over speed or torque that of its gears, with the same parameters and initial values."""
    model = model_from_json(dataset.attrs["model"])
    if not {"speed", "torque"} & set(names):
        return model
    of_gears = as_model(gears_from_json(dataset.attrs["gears"]))
    own = of_gears.parameters()
    changed = {name: value for name, value in model.parameters().items() if value != own[name]}
    return of_gears.with_values({**changed, **model.initial})


def _curves(skeleton: xr.Dataset, names: tuple[str, str]) -> list[CurveData]:
    """The curves of a skeleton, without their orbits."""
    values = np.stack([skeleton[name].values for name in names], axis=1)
    number, none = skeleton["curve"].values, np.zeros(0)
    return [
        CurveData(str(kind), int(period), values[number == i], none, none, none, none, [], [], bool(closed),
                  int(boundary) or None)
        for i, (kind, period, closed, boundary) in enumerate(zip(
            *(skeleton[f"curve_{n}"].values for n in ("kind", "period", "closed", "boundary")), strict=True))
    ]


def _dataset(
    zones: xr.Dataset, sides: Sides, longest: int, names: tuple[str, str], attributes: dict[str, Any]
) -> xr.Dataset:
    """The Dataset that `agreement` returns."""
    data = {
        f"{prefix}_{name}": variable(f"{prefix}_{name}", ("side",), zones[name].values[cells[:, column]])
        for prefix, cells in (("cell", sides.cell), ("neighbour", sides.neighbour))
        for name, column in zip(names, (1, 0), strict=True)
    }
    data |= {
        "period": variable("period", ("side",), sides.period),
        "cause": variable("cause", ("side",), sides.cause.astype(np.int8)),
        "curve": variable("curve", ("side",), sides.curve),
        "curve_seen": variable("curve_seen", ("number",), sides.seen),
    }
    data["cause"].attrs.update(flag_attributes(_CAUSES))
    periods = {"orbit_period": variable("orbit_period", ("orbit_period",), np.arange(1, longest + 1))}
    counts, explained = _by_period(zones, sides, longest)
    coordinates = {"cause_name": ("cause_name", np.array(list(_CAUSES.values()), dtype=object))}
    found = new_dataset({**data, **counts}, {**coordinates, **periods}, attributes)
    return found.assign_attrs(explained=explained)


def _by_period(zones: xr.Dataset, sides: Sides, longest: int) -> tuple[dict[str, xr.Variable], float]:
    """Numbers of cells and sides by period of the motion, and the share of all cells without unexplained side."""
    motion = np.where(zones["label"].values == Label.PERIODIC, zones["period"].values, 0)
    bad = np.zeros(motion.shape, bool)
    bad[tuple(sides.cell[sides.cause == UNEXPLAINED].T)] = True
    periods = np.arange(1, longest + 1)
    cells = np.array([(motion == n).sum() for n in periods])
    unexplained = np.array([(bad & (motion == n)).sum() for n in periods])
    counts = np.array([[((sides.period == n) & (sides.cause == c)).sum() for c in _CAUSES] for n in periods])
    share = 1.0 - unexplained / np.where(cells > 0, cells, np.nan)
    data = {
        "orbit_cells": variable("orbit_cells", ("orbit_period",), cells),
        "orbit_explained": variable("orbit_explained", ("orbit_period",), share),
        "orbit_sides": variable("orbit_sides", ("orbit_period", "cause_name"), counts),
    }
    return data, float(1.0 - unexplained.sum() / max(cells.sum(), 1))
