"""Quantities that checks read from results: kinds of motion, intervals of a kind, likeness of two maps, evidence."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr

from gearchaos.dynamics import Label
from gearchaos.paper.cache import ComputationCache
from gearchaos.plot import motion_class
from gearchaos.studies import Verdict, motions

LOCKED_FROM = 9
"""A periodic motion in a range of quasi-periodic ones counts as locked on the torus from this period on."""


def is_chaotic(ds: xr.Dataset) -> np.ndarray:
    """Whether each cell is chaotic; an array of bool with the shape of ``label``."""
    return ds["label"].values == Label.CHAOTIC


def is_periodic(ds: xr.Dataset) -> np.ndarray:
    """Whether each cell is periodic."""
    return ds["label"].values == Label.PERIODIC


def is_quasi_periodic(ds: xr.Dataset) -> np.ndarray:
    """Whether each cell is quasi-periodic."""
    return ds["label"].values == Label.QUASI_PERIODIC


def on_torus(ds: xr.Dataset) -> np.ndarray:
    """Whether each cell is quasi-periodic, or periodic with a period of at least `LOCKED_FROM`."""
    return is_quasi_periodic(ds) | (is_periodic(ds) & (ds["period"].values >= LOCKED_FROM))


def summary(regime: Any) -> dict[str, Any]:
    """The verdict at one point as evidence: label, largest exponent and its interval, V_RMS."""
    low, high = regime.lyapunov_ci[0]
    return {"label": regime.label, "largest_exponent": number(regime.lyapunov[0]),
            "interval": [number(low), number(high)], "v_rms": number(regime.v_rms)}


def number(value: float | None) -> float | None:
    """A value ready for JSON: rounded to six digits, None if it is not finite."""
    return None if value is None or not np.isfinite(value) else round(float(value), 6)


def intervals(values: np.ndarray, flags: np.ndarray) -> list[tuple[float, float]]:
    """First and last value of every unbroken interval of ``values`` (N,) in which ``flags`` (N,) are true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], np.asarray(flags, dtype=int), [0]])))
    return [(float(values[a]), float(values[b - 1])) for a, b in edges.reshape(-1, 2)]


def similarity(a: xr.Dataset, b: xr.Dataset) -> dict[str, float]:
    """Similarity of two maps with the same cells.

    ``same_class`` is the share of cells with the same class in both maps, ``v_rms_correlation`` Pearson's correlation
    of V_RMS over all cells.
    """
    one, other = (motion_class(ds["label"], ds["period"]) for ds in (a, b))
    va, vb = a["v_rms"].values.ravel(), b["v_rms"].values.ravel()
    good = np.isfinite(va) & np.isfinite(vb)
    return {
        "same_class": round(float((one == other).mean()), 4),
        "v_rms_correlation": round(float(np.corrcoef(va[good], vb[good])[0, 1]), 4),
    }


def evidence_of(cache: ComputationCache, keys: Iterable[str]) -> dict[str, Any]:
    """Multipliers and exponents of all motions in the results with these keys; those without verdicts are left out."""
    found = {key: _of_result(cache.known(key)) for key in dict.fromkeys(keys)}
    return {key: value for key, value in found.items() if value}


def _of_result(result: Any) -> dict[str, Any]:
    """The evidence in one result, empty if it has no verdicts."""
    if isinstance(result, Verdict):
        return _of_motion(result)
    if isinstance(result, xr.Dataset) and "lyapunov_lo" in result:
        return _of_cells(result)
    if not isinstance(result, xr.Dataset) or "attractor_multiplier" not in result:
        return {}
    names = motions(result["attractor_label"], result["attractor_period"])
    facts = zip(names, result["attractor_multiplier"].values, result["attractor_lyapunov"].values, strict=True)
    return {
        f"{i}: {name}": {"largest_multiplier": number(multiplier), "largest_exponent": number(exponent)}
        for i, (name, multiplier, exponent) in enumerate(facts, start=1)
    }


def _of_motion(verdict: Verdict) -> dict[str, Any]:
    """Of one motion: its label, largest multiplier, largest exponent and interval."""
    out: dict[str, Any] = {"label": verdict.label}
    if verdict.multipliers:
        out["largest_multiplier"] = number(max(map(abs, verdict.multipliers)))
    if verdict.lyapunov:
        out["largest_exponent"] = number(verdict.lyapunov[0])
        out["interval"] = [number(end) for end in verdict.lyapunov_ci[0]]
    return out


def _of_cells(ds: xr.Dataset) -> dict[str, Any]:
    """Of a map or scan: for each kind of motion its largest multiplier, or the union of its confidence intervals."""
    label, out = ds["label"].values, {}
    for kind in Label:
        cells = label == kind
        if not cells.any():
            continue
        found: dict[str, Any] = {"cells": int(cells.sum())}
        if kind == Label.PERIODIC:
            found["largest_multiplier"] = number(np.nanmax(ds["multiplier"].values[cells]))
        elif kind != Label.DIVERGED:
            ends = np.nanmin(ds["lyapunov_lo"].values[cells]), np.nanmax(ds["lyapunov_hi"].values[cells])
            found["exponents_between"] = [number(end) for end in ends]
        out[kind.name.lower()] = found
    return out
