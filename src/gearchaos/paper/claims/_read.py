"""Response verdicts: kinds, shares, and how much two maps or two portraits are alike."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from gearchaos.dynamics import Label
from gearchaos.plot import motion_class

LOCKED_FROM = 9
"""Periods from here on, within a range of quasi-periodic motion, count as locked on the torus."""


def is_chaotic(ds: xr.Dataset) -> np.ndarray:
    return ds["label"].values == Label.CHAOTIC


def is_periodic(ds: xr.Dataset) -> np.ndarray:
    return ds["label"].values == Label.PERIODIC


def is_quasi_periodic(ds: xr.Dataset) -> np.ndarray:
    return ds["label"].values == Label.QUASI_PERIODIC


def on_torus(ds: xr.Dataset) -> np.ndarray:
    """Quasi-periodic, or locked on the torus: a long period among quasi-periodic neighbours."""
    return is_quasi_periodic(ds) | (is_periodic(ds) & (ds["period"].values >= LOCKED_FROM))


def summary(regime: Any) -> dict[str, Any]:
    """What a verdict at one point says, for the evidence: label, largest exponent and its interval, V_RMS."""
    low, high = regime.lyapunov_ci[0]
    return {"label": regime.label, "largest_exponent": _round(regime.lyapunov[0]),
            "interval": [_round(low), _round(high)], "v_rms": _round(regime.v_rms)}


def _round(value: float | None, digits: int = 6) -> float | None:
    return None if value is None or not np.isfinite(value) else round(float(value), digits)


def runs(values: np.ndarray, flags: np.ndarray) -> list[tuple[float, float]]:
    """First and last value of every unbroken run of true flags."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], np.asarray(flags, dtype=int), [0]])))
    return [(float(values[a]), float(values[b - 1])) for a, b in edges.reshape(-1, 2)]


def map_classes(ds: xr.Dataset) -> np.ndarray:
    """The class of every cell, as the legend of the zones tells them apart."""
    return motion_class(ds["label"], ds["period"])


def likeness(a: xr.Dataset, b: xr.Dataset) -> dict[str, float]:
    """How much two maps on the same cells are alike.

    ``same_class`` is the share of cells of one class in both, ``v_rms_correlation`` Pearson's over all cells.
    """
    va, vb = a["v_rms"].values.ravel(), b["v_rms"].values.ravel()
    good = np.isfinite(va) & np.isfinite(vb)
    return {
        "same_class": round(float((map_classes(a) == map_classes(b)).mean()), 4),
        "v_rms_correlation": round(float(np.corrcoef(va[good], vb[good])[0, 1]), 4),
    }
