"""The evidence for a statement: multipliers, exponents and their intervals of all motions that its check used."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr

from gearchaos.dynamics import Label
from gearchaos.paper.cache import ComputationCache
from gearchaos.studies import Verdict, motions


def evidence_of(cache: ComputationCache, keys: Iterable[str]) -> dict[str, Any]:
    """The evidence in the results with these keys, by key; results without verdicts are left out."""
    found = {key: _of_result(cache.known(key)) for key in dict.fromkeys(keys)}
    return {key: value for key, value in found.items() if value}


def _of_result(result: Any) -> dict[str, Any]:
    """The evidence in one result, empty if it has no verdicts."""
    if isinstance(result, Verdict):
        return _regime(result)
    if isinstance(result, xr.Dataset) and "lyapunov_lo" in result:
        return _cells(result)
    if isinstance(result, xr.Dataset) and "attractor_multiplier" in result:
        return _attractors(result)
    return {}


def _regime(verdict: Verdict) -> dict[str, Any]:
    """Of one motion: its label, largest multiplier, largest exponent and interval."""
    out: dict[str, Any] = {"label": verdict.label}
    if verdict.multipliers:
        out["largest_multiplier"] = _number(max(map(abs, verdict.multipliers)))
    if verdict.lyapunov:
        out["largest_exponent"] = _number(verdict.lyapunov[0])
        out["interval"] = [_number(end) for end in verdict.lyapunov_ci[0]]
    return out


def _cells(ds: xr.Dataset) -> dict[str, Any]:
    """Of a map or scan: for each kind of motion its largest multiplier, or the union of its confidence intervals."""
    label = ds["label"].values
    return {kind.name.lower(): _kind(ds, kind, label == kind) for kind in Label if np.any(label == kind)}


def _kind(ds: xr.Dataset, kind: Label, cells: np.ndarray) -> dict[str, Any]:
    """Of the motions of one kind, in those cells where ``cells`` is true, bool of the shape of ``label``."""
    out: dict[str, Any] = {"cells": int(cells.sum())}
    if kind == Label.PERIODIC:
        out["largest_multiplier"] = _number(np.nanmax(ds["multiplier"].values[cells]))
    elif kind != Label.DIVERGED:
        ends = np.nanmin(ds["lyapunov_lo"].values[cells]), np.nanmax(ds["lyapunov_hi"].values[cells])
        out["exponents_between"] = [_number(end) for end in ends]
    return out


def _attractors(ds: xr.Dataset) -> dict[str, Any]:
    """Of each attractor: its largest multiplier and largest exponent."""
    names = motions(ds["attractor_label"], ds["attractor_period"])
    facts = zip(names, ds["attractor_multiplier"].values, ds["attractor_lyapunov"].values, strict=True)
    return {
        f"{i}: {name}": {"largest_multiplier": _number(multiplier), "largest_exponent": _number(exponent)}
        for i, (name, multiplier, exponent) in enumerate(facts, start=1)
    }


def _number(value: float) -> float | None:
    return round(float(value), 6) if np.isfinite(value) else None
