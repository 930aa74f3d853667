"""Whether the curves of a skeleton explain where the periodic motions of a map end."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.continuation.agreement import BASIN, CURVE, UNEXPLAINED, Sides, explain_sides
from gearchaos.continuation.curve import CurveData
from gearchaos.continuation.family import ParameterFamily
from gearchaos.datasets import flag_attributes, model_from_json, new_dataset, provenance, variables
from gearchaos.dynamics import Classification, Label
from gearchaos.errors import InputError
from gearchaos.gears.operation.operating import gears_from_json, with_gears

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
    for study, dataset in (("skeleton", skeleton), ("zones", zones)):
        found = getattr(dataset, "attrs", {}).get("study", f"a {type(dataset).__name__}")
        if found != study:
            raise InputError(study, f"must be a result of gearchaos.{study}", found)
        if "pair" in dataset.attrs:
            raise InputError(study, "must be dimensionless", "physical units",
                             "Use the result before gearchaos.physical.")
    y_name, x_name = map(str, zones["label"].dims)
    names = (x_name, y_name)
    if set(names) != {str(name) for name in skeleton.coords}:
        raise InputError("zones", "must be over the parameters of the skeleton", ", ".join(names),
                         f"Those are {', '.join(map(str, skeleton.coords))}.")
    first, model = (model_from_json(ds.attrs["model"]) for ds in (skeleton, zones))
    if {"speed", "torque"} & set(names):  # over these the model is that of its gears
        first, model = (with_gears(each, gears_from_json(ds.attrs["gears"]))
                        for each, ds in ((first, skeleton), (model, zones)))
    varied = {single for name in names for single in first.set_by(name)}
    own, other = first.parameters(), model.parameters()
    if (first.kind, own.keys()) != (model.kind, other.keys()) or any(own[n] != other[n] for n in own.keys() - varied):
        raise InputError("zones", "must be of the model of the skeleton", "another one")
    settings = json.loads(skeleton.attrs["settings"])
    common, longest = _common(settings, zones, names), settings["period"]
    points = np.stack([skeleton[name].values for name in names], axis=1)
    number, none = skeleton["curve"].values, np.zeros(0)
    curves = [
        CurveData(str(kind), int(period), points[number == i], none, none, none, none, [], [], bool(closed),
                  int(boundary) or None)
        for i, (kind, period, closed, boundary) in enumerate(zip(
            *(skeleton[f"curve_{n}"].values for n in ("kind", "period", "closed", "boundary")), strict=True))
    ]
    sides = explain_sides(
        ParameterFamily(model, names), common[x_name].values, common[y_name].values, common["label"].values,
        common["period"].values, curves, longest,
        Classification(**json.loads(zones.attrs["settings"])["classification"]))
    window = {n: [float(common[n].min()), float(common[n].max())] for n in names}
    x, y = ([name, *window[name], common.sizes[name]] for name in names)
    return _dataset(common, sides, longest, names, {
        **provenance("agreement", model, x=x, y=y, period=longest), "window": json.dumps(window),
        "cells_left_out": zones["label"].size - common["label"].size})


def _common(settings: dict[str, Any], zones: xr.Dataset, names: tuple[str, str]) -> xr.Dataset:
    """The cells of a map in the window of a skeleton; raises `InputError` unless there are two along each parameter."""
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


def _dataset(
    zones: xr.Dataset, sides: Sides, longest: int, names: tuple[str, str], attributes: dict[str, Any]
) -> xr.Dataset:
    """The Dataset that `agreement` returns, with numbers of cells and sides by period of the motion."""
    motion = np.where(zones["label"].values == Label.PERIODIC, zones["period"].values, 0)
    bad = np.zeros(motion.shape, bool)
    bad[tuple(sides.cell[sides.cause == UNEXPLAINED].T)] = True
    periods = np.arange(1, longest + 1)
    cells = np.array([(motion == n).sum() for n in periods])
    unexplained = np.array([(bad & (motion == n)).sum() for n in periods])
    data = {
        **variables(("side",), {
            f"{prefix}_{name}": zones[name].values[places[:, column]]
            for prefix, places in (("cell", sides.cell), ("neighbour", sides.neighbour))
            for name, column in zip(names, (1, 0), strict=True)} | {
            "period": sides.period, "cause": sides.cause.astype(np.int8), "curve": sides.curve}),
        **variables(("number",), {"curve_seen": sides.seen}),
        **variables(("orbit_period", "cause_name"), {
            "orbit_cells": cells, "orbit_explained": 1.0 - unexplained / np.where(cells > 0, cells, np.nan),
            "orbit_sides": np.array([[((sides.period == n) & (sides.cause == c)).sum() for c in _CAUSES]
                                     for n in periods])}),
    }
    data["cause"].attrs.update(flag_attributes(_CAUSES))
    coordinates = {"cause_name": ("cause_name", np.array(list(_CAUSES.values()), dtype=object)),
                   **variables(("orbit_period",), {"orbit_period": periods})}
    return new_dataset(data, coordinates, attributes).assign_attrs(
        explained=float(1.0 - unexplained.sum() / max(cells.sum(), 1)))
