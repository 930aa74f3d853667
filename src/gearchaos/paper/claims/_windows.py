"""Statements about ranges of one parameter: where a kind of motion begins and ends."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from gearchaos.paper.cache import ComputationCache
from gearchaos.paper.claims._outcome import (
    CONTRADICTED,
    HOLDS,
    MISPRINT,
    CheckResult,
    check,
    graded,
)
from gearchaos.paper.claims._read import (
    LOCKED_FROM,
    intervals,
    is_chaotic,
    is_periodic,
    is_quasi_periodic,
    motions_of_scan,
    on_torus,
    summary,
)
from gearchaos.studies import Axis, motions

_VARIED_LOAD = {"omega": 1.0, "eps1": 0.1}
"""Fixed parameters of figure 6, in which the load q0 varies."""

_SCAN = "Verdicts on a fine scan of the range, each from the paper's start."


@check("6a")
def end_of_chaos(cache: ComputationCache) -> CheckResult:
    """Whether chaos ends at q0 = 0.0508 and nearly all columns below are chaotic."""
    fine = cache.scan(Axis("q0", 0.0495, 0.052, 51), long_transients=True, **_VARIED_LOAD)
    q0 = fine["q0"].values
    end = float(q0[is_chaotic(fine)].max())
    whole = cache.study(6, "a")
    below = whole["q0"].values < end
    share = float(is_chaotic(whole)[below].mean())
    evidence = {"last_chaotic": round(end, 6), "after_it": _labels(fine)[int(np.searchsorted(q0, end)) + 1],
                "share_of_chaotic_columns_below": round(share, 4), "columns_below": int(below.sum())}
    enough = share >= 0.9
    return CheckResult(
        graded(enough and abs(end - 0.0508) < 1e-4, enough and abs(end - 0.0508) < 5e-4),
        f"{_SCAN} The share of chaotic columns is that of Fig. 6.", evidence,
        f"chaos ends at {end:.5f}, where the motion becomes {evidence['after_it']}",
    )


@check("6c")
def window_of_3t(cache: ComputationCache) -> CheckResult:
    """Whether the motion is 3T throughout the range of q0 in the statement."""
    printed = cache.scan(Axis("q0", 0.02486, 0.02499, 14), long_transients=True, **_VARIED_LOAD)
    inside = _labels(printed)
    around = cache.scan(Axis("q0", 0.0247, 0.0252, 101), long_transients=True, **_VARIED_LOAD)
    window = intervals(around["q0"].values, around["period"].values == 3)
    evidence = {"inside": dict(Counter(inside)), "windows_of_3T": [[round(a, 6), round(b, 6)] for a, b in window]}
    motions_3t = motions_of_scan(printed, "q0", printed["period"].values == 3, _VARIED_LOAD)
    return CheckResult(graded(set(inside) == {"3T"}), _SCAN, evidence, motions=motions_3t)


@check("6d")
def window_of_6t_after_3t(cache: ComputationCache) -> CheckResult:
    """Whether the motion at q0 = 0.0255 is 6T; otherwise, whether it is 6T nearby."""
    printed = cache.regime(**_VARIED_LOAD, q0=0.0255)
    around = cache.scan(Axis("q0", 0.02505, 0.0256, 111), long_transients=True, **_VARIED_LOAD)
    window = intervals(around["q0"].values, around["period"].values == 6)
    evidence = {"at_0.0255": summary(printed), "windows_of_6T": [[round(a, 6), round(b, 6)] for a, b in window]}
    motions_6t = motions_of_scan(around, "q0", around["period"].values == 6, _VARIED_LOAD)
    if printed.label == "6T":
        return CheckResult(HOLDS, _SCAN, evidence, motions=motions_6t)
    where = f"{printed.label} at 0.0255; 6T from {window[0][0]:.5g} to {window[-1][1]:.5g}" if window else ""
    return CheckResult(MISPRINT if window else CONTRADICTED, _SCAN, evidence, where, motions_6t)


@check("6e")
def separate_window_of_6t(cache: ComputationCache) -> CheckResult:
    """Whether the motion at q0 = 0.047, or at a value that rounds to it, is 6T."""
    printed = cache.regime(**_VARIED_LOAD, q0=0.047)
    around = cache.scan(Axis("q0", 0.04695, 0.04705, 101), long_transients=True, **_VARIED_LOAD)
    window = intervals(around["q0"].values, around["period"].values == 6)
    near = [(a, b) for a, b in window if b > 0.04695 and a < 0.04705]
    evidence = {"at_0.047": summary(printed), "windows_of_6T": [[round(a, 6), round(b, 6)] for a, b in window]}
    return CheckResult(graded(printed.label == "6T", bool(near)), _SCAN, evidence,
                       f"6T at values from {near[0][0]:.6f} to {near[-1][1]:.6f}" if near else "",
                       motions_of_scan(around, "q0", around["period"].values == 6, _VARIED_LOAD))


_SOFT_SUPPORTS: dict[str, Any] = {"kind": "full", "kappa": 0.5, "omega": 1.05, "q0": 0.1}
"""Fixed parameters of figure 12, in which the amplitude ε1 varies."""


@check("12a")
def first_torus(cache: ComputationCache) -> CheckResult:
    """Whether the motion is on a torus for ε1 from 0.033 to 0.048."""
    return _torus(cache.scan(Axis("eps1", 0.030, 0.050, 61), **_SOFT_SUPPORTS), "eps1", 0.033, 0.048, 0.0025)


@check("12b")
def second_torus(cache: ComputationCache) -> CheckResult:
    """Whether 2T motions change into motions on a torus at ε1 = 0.2."""
    ds = cache.scan(Axis("eps1", 0.19, 0.22, 61), **_SOFT_SUPPORTS)
    eps1, names = ds["eps1"].values, np.array(_labels(ds))
    begin = next((a for a, b in intervals(eps1, on_torus(ds)) if a <= 0.205 <= b), np.nan)
    from_doubled = set(names[eps1 < begin]) == {"2T"}
    return CheckResult(
        graded(from_doubled and abs(begin - 0.2) < 1e-3, from_doubled and abs(begin - 0.2) <= 0.01), _SCAN,
        _ranges(ds, "eps1"), _in_words(ds, eps1),
        motions_of_scan(ds, "eps1", (eps1 < begin) & (names == "2T"), _SOFT_SUPPORTS),
    )


@check("14a")
def torus_over_load(cache: ComputationCache) -> CheckResult:
    """Whether the motion is on a torus for q0 from 0.13 to 0.17."""
    ds = cache.scan(Axis("q0", 0.125, 0.175, 101), kind="full", kappa=0.5, omega=0.9, eps1=0.1)
    return _torus(ds, "q0", 0.13, 0.17, 0.005)


@check("14b")
def locked_torus(cache: ComputationCache) -> CheckResult:
    """Whether the motion is on a torus for q0 from 0.16 to 0.18."""
    fixed: dict[str, Any] = {"kind": "full", "kappa": 1.0, "omega": 1.0, "eps1": 0.1}
    ds = cache.scan(Axis("q0", 0.155, 0.185, 61), **fixed)
    locked = ds["period"].values >= LOCKED_FROM
    return replace(_torus(ds, "q0", 0.16, 0.18, 0.005), motions=motions_of_scan(ds, "q0", locked, fixed))


def _torus(ds: xr.Dataset, axis: str, low: float, high: float, tolerance: float) -> CheckResult:
    """Whether the motion is on a torus throughout a range: as printed, or with each end shifted by the tolerance."""
    values, close = ds[axis].values, 1e-9
    torus, strict = on_torus(ds), is_quasi_periodic(ds)
    printed = (values > low + close) & (values < high - close)
    core = (values > low + tolerance - close) & (values < high - tolerance + close)
    wide = (values > low - tolerance) & (values < high + tolerance)
    exact = torus[printed].all() and strict[printed].any()
    near = torus[core].all() and strict[wide].any()
    evidence = {
        **_ranges(ds, axis), "share_of_the_printed_range_on_the_torus": round(float(torus[printed].mean()), 4),
        "share_strictly_quasi_periodic": round(float(strict[printed].mean()), 4),
    }
    return CheckResult(graded(bool(exact), bool(near)), _SCAN, evidence, _in_words(ds, values))


@check("14c")
def wider_chaos(cache: ComputationCache) -> CheckResult:
    """Whether chaos reaches to larger q0 with elastic supports (Fig. 14) than with rigid ones (Fig. 6)."""
    ends = {}
    for name, number, panel in (("6", 6, "a"), ("14a", 14, "a"), ("14b", 14, "b")):
        ds = cache.study(number, panel)
        ends[name] = round(float(ds["q0"].values[is_chaotic(ds)].max()), 5)
    return CheckResult(graded(min(ends["14a"], ends["14b"]) > ends["6"]), "The last chaotic column of each diagram.",
                       {"chaos_reaches_q0": ends})


def _labels(ds: xr.Dataset) -> list[str]:
    """The labels of the columns, such as "3T"."""
    return motions(ds["label"], ds["period"])


def _in_words(ds: xr.Dataset, values: np.ndarray) -> str:
    """The ranges of each label as text."""
    return "; ".join(f"{name} from {a:.5g} to {b:.5g}" for name, a, b in _label_ranges(ds, values))


def _label_ranges(ds: xr.Dataset, values: np.ndarray) -> list[tuple[str, float, float]]:
    """Ranges of at least three columns with one label: label, first and last value; sorted by the first value."""
    names = np.array(_labels(ds))
    out = [(name, a, b) for name in dict.fromkeys(names) for a, b in intervals(values, names == name)]
    step = values[1] - values[0]
    return sorted((s for s in out if s[2] - s[1] > 1.5 * step), key=lambda s: s[1])


def _ranges(ds: xr.Dataset, axis: str) -> dict[str, Any]:
    """Summary of a scan as evidence: the ranges of each label, and the long periods that occur."""
    return {
        "columns": int(ds.sizes[axis]),
        "stretches": [[name, round(a, 6), round(b, 6)] for name, a, b in _label_ranges(ds, ds[axis].values)],
        "locked_periods": sorted({int(p) for p in ds["period"].values[is_periodic(ds)] if p > 8}),
    }
