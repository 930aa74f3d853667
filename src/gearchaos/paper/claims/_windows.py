"""Statements about ranges of one parameter: where a kind of motion begins and ends."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from gearchaos.model import MeshModel
from gearchaos.paper.cache import ComputationCache
from gearchaos.paper.claims._claim import CONTRADICTED, HOLDS, MISPRINT, CheckResult, PeriodicMotion, check, graded
from gearchaos.paper.claims._read import (
    LOCKED_FROM,
    intervals,
    is_chaotic,
    is_periodic,
    is_quasi_periodic,
    on_torus,
    summary,
)
from gearchaos.paper.settings import study_of
from gearchaos.studies import Axis, motions

_SCAN = "Verdicts on a fine scan of the range, each from the paper's start."


def _over_load(cache: ComputationCache, start: float, stop: float, count: int) -> xr.Dataset:
    """A fine scan of part of Fig. 6."""
    return cache.scan(Axis("q0", start, stop, count), long_transients=True, **study_of("6a").model)


@check
def end_of_chaos(cache: ComputationCache) -> CheckResult:
    """Whether chaos ends at q0 = 0.0508 and nearly all columns below are chaotic."""
    fine = _over_load(cache, 0.0495, 0.052, 51)
    q0 = fine["q0"].values
    end = float(q0[is_chaotic(fine)].max())
    whole = cache.study("6a")
    below = whole["q0"].values < end
    share = float(is_chaotic(whole)[below].mean())
    after = motions(fine["label"], fine["period"])[int(np.searchsorted(q0, end)) + 1]
    evidence = {"last_chaotic": round(end, 6), "after_it": after,
                "share_of_chaotic_columns_below": round(share, 4), "columns_below": int(below.sum())}
    enough = share >= 0.9
    return CheckResult(
        graded(enough and abs(end - 0.0508) < 1e-4, enough and abs(end - 0.0508) < 5e-4),
        f"{_SCAN} The share of chaotic columns is that of Fig. 6.", evidence,
        f"chaos ends at {end:.5f}, where the motion becomes {after}",
    )


@check
def window_of_3t(cache: ComputationCache) -> CheckResult:
    """Whether the motion is 3T throughout the range of q0 in the statement."""
    printed = _over_load(cache, 0.02486, 0.02499, 14)
    inside = motions(printed["label"], printed["period"])
    windows = _windows(_over_load(cache, 0.0247, 0.0252, 101), 3)
    evidence = {"inside": dict(Counter(inside)), "windows_of_3T": [[round(a, 6), round(b, 6)] for a, b in windows]}
    return CheckResult(graded(set(inside) == {"3T"}), _SCAN, evidence, motions=_of_period(printed, 3))


@check
def window_of_6t_after_3t(cache: ComputationCache) -> CheckResult:
    """Whether the motion at q0 = 0.0255 is 6T; otherwise, whether it is 6T nearby."""
    printed = cache.regime(**study_of("6a").model, q0=0.0255)
    around = _over_load(cache, 0.02505, 0.0256, 111)
    windows, motions_6t = _windows(around, 6), _of_period(around, 6)
    evidence = {"at_0.0255": summary(printed), "windows_of_6T": [[round(a, 6), round(b, 6)] for a, b in windows]}
    if printed.label == "6T":
        return CheckResult(HOLDS, _SCAN, evidence, motions=motions_6t)
    where = f"{printed.label} at 0.0255; 6T from {windows[0][0]:.5g} to {windows[-1][1]:.5g}" if windows else ""
    return CheckResult(MISPRINT if windows else CONTRADICTED, _SCAN, evidence, where, motions_6t)


@check
def separate_window_of_6t(cache: ComputationCache) -> CheckResult:
    """Whether the motion at q0 = 0.047, or at a value that rounds to it, is 6T."""
    printed = cache.regime(**study_of("6a").model, q0=0.047)
    around = _over_load(cache, 0.04695, 0.04705, 101)
    windows = _windows(around, 6)
    near = [(a, b) for a, b in windows if b > 0.04695 and a < 0.04705]
    evidence = {"at_0.047": summary(printed), "windows_of_6T": [[round(a, 6), round(b, 6)] for a, b in windows]}
    where = f"6T at values from {near[0][0]:.6f} to {near[-1][1]:.6f}" if near else ""
    return CheckResult(graded(printed.label == "6T", bool(near)), _SCAN, evidence, where, _of_period(around, 6))


def _windows(ds: xr.Dataset, period: int) -> list[tuple[float, float]]:
    """The first and last q0 of every unbroken run of columns of this period."""
    return intervals(ds["q0"].values, ds["period"].values == period)


def _of_period(ds: xr.Dataset, period: int) -> list[PeriodicMotion]:
    """The motions of this period in a scan of part of Fig. 6."""
    return _motions_of_scan(ds, "q0", ds["period"].values == period, study_of("6a").model)


def _motions_of_scan(
    ds: xr.Dataset, axis: str, chosen: np.ndarray, fixed: Mapping[str, Any]
) -> list[PeriodicMotion]:
    """The periodic motions of those columns of a scan where ``chosen`` (N,) is true; other parameters are ``fixed``."""
    columns = zip(ds[axis].values[chosen], ds["period"].values[chosen], strict=True)
    return [
        PeriodicMotion(int(period), MeshModel.of(**{**fixed, axis: float(value)}), {axis: float(value)})
        for value, period in columns if period > 0
    ]


@check
def second_torus(cache: ComputationCache) -> CheckResult:
    """Whether 2T motions change into motions on a torus at ε1 = 0.2."""
    fixed = study_of("12a").model
    ds = cache.scan(Axis("eps1", 0.19, 0.22, 61), **fixed)
    eps1, names = ds["eps1"].values, np.array(motions(ds["label"], ds["period"]))
    begin = next((a for a, b in intervals(eps1, on_torus(ds)) if a <= 0.205 <= b), np.nan)
    from_doubled = set(names[eps1 < begin]) == {"2T"}
    return CheckResult(
        graded(from_doubled and abs(begin - 0.2) < 1e-3, from_doubled and abs(begin - 0.2) <= 0.01), _SCAN,
        _ranges(ds, "eps1"), _in_words(ds, "eps1"),
        _motions_of_scan(ds, "eps1", (eps1 < begin) & (names == "2T"), fixed),
    )


@check
def torus(
    cache: ComputationCache, diagram: str, scan: tuple[float, float, int], printed: tuple[float, float],
    tolerance: float, locked: bool = False,
) -> CheckResult:
    """Whether the motion is on a torus throughout a range: as printed, or with each end shifted by the tolerance.

    The ``scan`` of the parameter of a diagram is given by start, stop and count. With ``locked`` the motions that are
    locked on the torus are those of the statement.
    """
    study = study_of(diagram)
    (axis,) = study.axes
    ds = cache.scan(Axis(axis, *scan), **study.model)
    values, (low, high), close = ds[axis].values, printed, 1e-9
    flags, strict = on_torus(ds), is_quasi_periodic(ds)
    range_ = (values > low + close) & (values < high - close)
    core = (values > low + tolerance - close) & (values < high - tolerance + close)
    wide = (values > low - tolerance) & (values < high + tolerance)
    exact = flags[range_].all() and strict[range_].any()
    near = flags[core].all() and strict[wide].any()
    evidence = {
        **_ranges(ds, axis), "share_of_the_printed_range_on_the_torus": round(float(flags[range_].mean()), 4),
        "share_strictly_quasi_periodic": round(float(strict[range_].mean()), 4),
    }
    found = _motions_of_scan(ds, axis, ds["period"].values >= LOCKED_FROM, study.model) if locked else []
    return CheckResult(graded(bool(exact), bool(near)), _SCAN, evidence, _in_words(ds, axis), found)


@check
def wider_chaos(cache: ComputationCache) -> CheckResult:
    """Whether chaos reaches to larger q0 with elastic supports (Fig. 14) than with rigid ones (Fig. 6)."""
    diagrams = {name: cache.study(panel) for name, panel in (("6", "6a"), ("14a", "14a"), ("14b", "14b"))}
    ends = {name: round(float(ds["q0"].values[is_chaotic(ds)].max()), 5) for name, ds in diagrams.items()}
    return CheckResult(graded(min(ends["14a"], ends["14b"]) > ends["6"]), "The last chaotic column of each diagram.",
                       {"chaos_reaches_q0": ends})


def _in_words(ds: xr.Dataset, axis: str) -> str:
    """The ranges of each label as text."""
    return "; ".join(f"{name} from {a:.5g} to {b:.5g}" for name, a, b in _label_ranges(ds, axis))


def _label_ranges(ds: xr.Dataset, axis: str) -> list[tuple[str, float, float]]:
    """Ranges of at least three columns with one label: label, first and last value; sorted by the first value."""
    values, names = ds[axis].values, np.array(motions(ds["label"], ds["period"]))
    out = [(name, a, b) for name in dict.fromkeys(names) for a, b in intervals(values, names == name)]
    step = values[1] - values[0]
    return sorted((s for s in out if s[2] - s[1] > 1.5 * step), key=lambda s: s[1])


def _ranges(ds: xr.Dataset, axis: str) -> dict[str, Any]:
    """Summary of a scan as evidence: the ranges of each label, and the long periods that occur."""
    return {
        "columns": int(ds.sizes[axis]),
        "stretches": [[name, round(a, 6), round(b, 6)] for name, a, b in _label_ranges(ds, axis)],
        "locked_periods": sorted({int(p) for p in ds["period"].values[is_periodic(ds)] if p > 8}),
    }
