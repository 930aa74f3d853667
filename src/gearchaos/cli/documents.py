"""The JSON documents of what studies find, from their Datasets."""

from __future__ import annotations

import json
import math
from collections import Counter
from typing import TYPE_CHECKING, Any

from gearchaos.datasets import motions
from gearchaos.dynamics.response import CONTACTS
from gearchaos.gears.results import is_physical
from gearchaos.quantities import parse, quantity
from gearchaos.studies.proved_cells import proof_counts

if TYPE_CHECKING:
    import xarray as xr


def attractor_list(dataset: xr.Dataset) -> dict[str, Any]:
    """The JSON document of the attractors of one operating point.

    It has an entry for each attractor, the fraction of initial states that diverge or stay undecided, the number of
    initial states, and the index of the attractor in which each sweep ends.
    """
    rows = []
    for i, label in enumerate(motions(dataset["attractor_label"], dataset["attractor_period"])):
        one = {n: dataset[f"attractor_{n}"].values[i].item() for n in _ATTRACTOR_FIELDS}
        period, contact = int(dataset["attractor_period"][i]), CONTACTS[int(dataset["attractor_contact"][i])]
        rows.append({"label": label, "period": period or None, "contact": contact, **one, **_kick(dataset, i)})
    undecided = float((dataset["attractor"] < 0).mean())
    ends = {n: int(dataset[f"attractor_{n}"]) for n in ("up", "down") if f"attractor_{n}" in dataset}
    swept = {f"swept_{n}": i if i >= 0 else None for n, i in ends.items()}
    return {"attractors": rows, "undecided_fraction": undecided, "starts": int(dataset.sizes["start"]), **swept}


def _kick(dataset: xr.Dataset, number: int) -> dict[str, Any]:
    """The smallest destabilising perturbation of one attractor; empty if it was not computed."""
    if "attractor_kick" not in dataset:
        return {}
    parts = ("attractor_kick_change", "attractor_kick_point")
    names = dataset["coordinate"].values.tolist()
    change, point = (dict(zip(names, dataset[n].values[number].tolist(), strict=True)) for n in parts)
    return {"kick": dataset["attractor_kick"].values[number].item(), "kick_change": change, "kick_point": point}


_ATTRACTOR_FIELDS = (
    "fraction", "fraction_lo", "fraction_hi", "v_rms", "contact_fraction", "dynamic_factor", "lyapunov",
    "lyapunov_lo", "lyapunov_hi", "multiplier", "residual",
)
"""The variables ``attractor_<name>`` that are keys of the JSON of an attractor."""


def attractor_units(dataset: xr.Dataset) -> dict[str, str]:
    """The physical units in `attractor_list`, by key; empty for a dimensionless result."""
    units = {name: dataset[f"attractor_{name}"].attrs["units"] for name in _ATTRACTOR_FIELDS}
    return {name: unit for name, unit in units.items() if unit != quantity(name).unit}


def section(dataset: xr.Dataset) -> dict[str, list[float]]:
    """The stroboscopic section of a simulation: τ and every coordinate by name, one value per mesh period."""
    return {short: dataset[name].values.tolist() for short, name in _section_names(dataset).items()}


def section_units(dataset: xr.Dataset) -> dict[str, str]:
    """The units of `section`, by the same names."""
    return {short: dataset[name].attrs["units"] for short, name in _section_names(dataset).items()}


def _section_names(dataset: xr.Dataset) -> dict[str, str]:
    """The names of the variables of a stroboscopic section, by the names of their coordinates."""
    parts = map(parse, map(str, dataset.data_vars))
    return {"tau": "tau_section", **{name.base: str(name) for name in parts if name.prefix == "section_"}}


def map_document(dataset: xr.Dataset) -> dict[str, Any]:
    """The JSON summary of a map: the numbers of cells with each motion and each contact state, and the largest dynamic
    factor; for basins, the attractors and their shares, and how finely the basins are mixed."""
    if "basin_entropy" in dataset:
        shares = dataset["attractor_fraction"].values.tolist()
        names = motions(dataset["attractor_label"], dataset["attractor_period"])
        measures = {name: dataset[name].item() for name in ("basin_entropy", "uncertainty_exponent")}
        return {"attractors": [{"label": n, "fraction": s} for n, s in zip(names, shares, strict=True)], **measures}
    names = motions(dataset["label"], dataset["period"])
    codes = dataset["contact_worst" if "contact_worst" in dataset else "contact"].values.ravel().tolist()
    return {
        "cells": {name: names.count(name) for name in sorted(set(names))},
        "contact": {CONTACTS[code]: codes.count(code) for code in sorted({code for code in codes if code >= 0})},
        "largest": _largest(dataset), **({"proofs": proof_counts([dataset])} if "proved" in dataset else {}),
    }


def _largest(dataset: xr.Dataset) -> dict[str, Any] | None:
    """The largest dynamic factor, or without static load V_RMS, of a map, and where; None if all diverge."""
    for name in ("dynamic_factor", "v_rms"):
        known = dataset[name].where(abs(dataset[name]) < math.inf)
        if known.notnull().any():
            at, names = dataset[name].isel(known.argmax(...)), reversed(dataset[name].dims)
            return {"quantity": name, "value": at.item(), "at": {str(n): at[n].item() for n in names}}
    return None


def branch_document(dataset: xr.Dataset, found: xr.Dataset) -> dict[str, Any]:
    """The JSON document of a branch: number of points, range, ends, events in order, stable intervals, jumps.

    After a cascade it also has the branches of doubled periods and the ratios of successive intervals between flips,
    with ``--pitchforks`` the branches of asymmetric orbits, and in physical units the unit of the
    parameter.

    Parameters
    ----------
    dataset : Dataset
        The branch, in physical units if these are wanted.
    found : Dataset
        The dimensionless branch: states are initial values, as ``--start`` takes them.
    """
    whole = {name: json.loads(dataset.attrs[name]) for name in ("closed", "range", "ends", "stable")}
    events = [_event(dataset, found, i) for i in range(dataset.sizes["event"])]
    out = {"points": dataset.sizes["point"], "closed": whole.pop("closed"), "range": whole["range"],
           "ends": whole["ends"], "events": events, "stable": whole["stable"],
           "jumps": [_jump(dataset, i) for i in range(dataset.sizes["jump"])]}
    settings = json.loads(dataset.attrs["settings"])
    if settings["pitchforks"]:
        out["asymmetric"] = json.loads(dataset.attrs["asymmetric"])
    if settings["cascade"]:
        out |= {name: json.loads(dataset.attrs[name]) for name in ("cascade", "feigenbaum")}
    if is_physical(dataset):
        out["units"] = {"value": dataset["event_value"].attrs["units"]}
    return out


def _event(dataset: xr.Dataset, found: xr.Dataset, number: int) -> dict[str, Any]:
    """One event of a branch as JSON."""
    at, start = dataset.isel(event=number), found.isel(event=number)
    prefix = "event_section_"
    parts = (at[f"event_multipliers_{part}"].values.tolist() for part in ("real", "imag"))
    return {
        "kind": str(at["event_kind"].item()), "value": at["event_value"].item(), "period": at["event_period"].item(),
        "multipliers": [list(pair) for pair in zip(*parts, strict=True)],
        "boundary": at["event_boundary"].item() or None,
        "state": {str(n).removeprefix(prefix): start[n].item() for n in start.data_vars if str(n).startswith(prefix)},
        "residual": at["event_residual"].item(),
    }


def _jump(dataset: xr.Dataset, number: int) -> dict[str, Any]:
    """One jump from a branch as JSON."""
    at = dataset.isel(jump=[number])
    return {
        "value": at["jump_value"].item(), "direction": {1: "up", -1: "down"}[at["jump_direction"].item()],
        "event": at["jump_event"].item(), "to": motions(at["jump_label"], at["jump_period"])[0],
        "on_branch": at["jump_point"].item() >= 0,
    }


def curve_document(dataset: xr.Dataset, x: str, y: str) -> dict[str, Any]:
    """The JSON document of a curve: its points, its points of codimension 2, and its ends, none if it is closed.

    It has the units of both parameters if the curve is in physical ones.
    """
    points = zip(dataset[x].values.tolist(), dataset[y].values.tolist(), strict=True)
    special = zip(*(dataset[f"special_{name}"].values.tolist() for name in ("kind", x, y)), strict=True)
    out = {
        "points": [{x: a, y: b} for a, b in points],
        "codimension2": [{"kind": kind, x: a, y: b} for kind, a, b in special],
        "ends": json.loads(dataset.attrs["ends"]),
    }
    if is_physical(dataset):
        out["units"] = {name: dataset[name].attrs["units"] for name in (x, y)}
    return out


def skeleton_document(dataset: xr.Dataset) -> dict[str, Any]:
    """The JSON document of a skeleton: numbers of curves by kind and period, of points, of events without curve."""
    kinds = zip(dataset["curve_kind"].values.tolist(), dataset["curve_period"].values.tolist(), strict=True)
    counts = sorted(Counter(kinds).items(), key=lambda item: (item[0][1], item[0][0]))
    return {
        "curves": [{"kind": kind, "period": period, "count": count} for (kind, period), count in counts],
        "points": dataset.sizes["point"], "codimension2": dict(Counter(dataset["special_kind"].values.tolist())),
        "failed": json.loads(dataset.attrs["failed"]),
    }


def result_document(dataset: xr.Dataset) -> dict[str, Any]:
    """The JSON document of any result: its dimensions, and smallest and largest value and unit of each variable."""
    known = {str(n): v for n, v in dataset.data_vars.items() if v.dtype.kind in "fiub" and v.notnull().any()}
    ranges = {n: {"least": v.min().item(), "most": v.max().item(), "units": v.attrs.get("units", "")}
              for n, v in known.items()}
    return {"sizes": {str(n): size for n, size in dataset.sizes.items()}, "variables": ranges}
