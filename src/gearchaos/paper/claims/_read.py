"""Quantities that checks read from results: kinds of motion, intervals of a kind, similarity of two maps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from gearchaos.dynamics import Label
from gearchaos.model import MeshModel
from gearchaos.paper.claims._outcome import PeriodicMotion
from gearchaos.plot import motion_class

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
    return {"label": regime.label, "largest_exponent": _round(regime.lyapunov[0]),
            "interval": [_round(low), _round(high)], "v_rms": _round(regime.v_rms)}


def _round(value: float | None, digits: int = 6) -> float | None:
    return None if value is None or not np.isfinite(value) else round(float(value), digits)


def motions_of_scan(
    ds: xr.Dataset, axis: str, chosen: np.ndarray, fixed: Mapping[str, Any]
) -> list[PeriodicMotion]:
    """The periodic motions of those columns of a scan where ``chosen`` (N,) is true; other parameters are ``fixed``."""
    columns = zip(ds[axis].values[chosen], ds["period"].values[chosen], strict=True)
    return [
        PeriodicMotion(int(period), MeshModel.of(**{**fixed, axis: float(value)}), {axis: float(value)})
        for value, period in columns if period > 0
    ]


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
