"""Statements about motions: at one operating point, their portraits, and where along a parameter they change."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import xarray as xr
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from gearchaos.model import MeshModel
from gearchaos.paper.cache import ComputationCache
from gearchaos.paper.claims._claim import LOCKED_FROM, CheckResult, PeriodicMotion, graded, is_kind, number, on_torus
from gearchaos.paper.settings import study_of, symbol
from gearchaos.studies import Axis, Verdict, motions


def motion(
    cache: ComputationCache, label: str, panel: str = "", model: Mapping[str, Any] | None = None, varied: str = ""
) -> CheckResult:
    """Whether the motion of a panel, or of a model, has this label; "sub-harmonic" stands for any period above 1T.

    A periodic one is told apart by the value of the parameter ``varied``.
    """
    values = model or study_of(panel).model
    found = cache.regime(**values)
    holds = (found.period or 0) > 1 if label == "sub-harmonic" else found.label == label
    computed = "The verdict at this point from the paper's start, with the largest Lyapunov exponent."
    motions = _periodic([(values[varied], found.period)], varied, values) if varied else []
    return CheckResult(graded(holds), computed, summary(found), motions=motions)


def summary(regime: Verdict) -> dict[str, Any]:
    """The verdict at one point as evidence: label, largest exponent and its interval, V_RMS."""
    return {"label": regime.label, "largest_exponent": number(regime.lyapunov[0]),
            "interval": [number(end) for end in regime.lyapunov_ci[0]], "v_rms": number(regime.v_rms)}


def motions_along(cache: ComputationCache, diagram: str, values: list[float], labels: list[str]) -> CheckResult:
    """Whether the motions at these values of the parameter of a diagram have these labels."""
    study = study_of(diagram)
    (name,) = study.axes
    found = {value: cache.regime(**study.model, **{name: value}) for value in values}
    same = [verdict.label for verdict in found.values()] == labels
    evidence = {f"{symbol(name)} = {value}": summary(verdict) for value, verdict in found.items()}
    motions = _periodic([(value, verdict.period) for value, verdict in found.items()], name, study.model)
    return CheckResult(graded(same), "The verdict at each value.", evidence, motions=motions)


def _periodic(found: Iterable[tuple[float, int | None]], name: str, fixed: Mapping[str, Any]) -> list[PeriodicMotion]:
    """The periodic motions among those of which value of a parameter and period are given; others have period 0."""
    return [PeriodicMotion(int(period), MeshModel.of(**{**fixed, name: float(value)}), {name: float(value)})
            for value, period in found if period]


def chaos_after_the_cascade(cache: ComputationCache) -> CheckResult:
    """Whether there is chaos just above the period doublings over ε1."""
    found = {value: cache.regime(**study_of("8a").model, eps1=value) for value in (0.2095, 0.21)}
    chaos = any(r.label == "chaotic" for r in found.values())
    return CheckResult(graded(chaos), "The verdict at two values.", {f"ε1 = {v}": summary(r) for v, r in found.items()})


def closed_curves(cache: ComputationCache, panel: str, count: int) -> CheckResult:
    """Whether a portrait consists of so many closed curves."""
    found = cache.regime(**study_of(panel).model)
    components, dimension = curves(cache.study(panel))
    holds = found.label == "quasi-periodic" and components == count and abs(dimension - 1) < 0.15
    evidence = {**summary(found), "closed_curves": components, "correlation_dimension": round(dimension, 3)}
    computed = "The verdict, the pieces of the portrait and its correlation dimension."
    return CheckResult(graded(holds), computed, evidence)


_POINTS = 4000
"""Number of points of a portrait that are used."""

_GAP = 0.03
"""Points at most this far apart belong to the same component: many times the spacing of points along a curve."""

_SCALES = np.array([0.005, 0.05])
"""Distances between which the correlation dimension is estimated."""


def curves(ds: xr.Dataset) -> tuple[int, float]:
    """Number of connected components of a stroboscopic portrait in all its coordinates, and its correlation dimension.

    Lengths are relative to the extent of the portrait in each coordinate.
    """
    points = np.stack([ds[n].values[:_POINTS] for n in ds.data_vars if str(n).startswith("section_")], axis=1)
    points = points[:, np.ptp(points, axis=0) > 1e-6]
    tree = cKDTree((points - points.mean(axis=0)) / np.ptp(points, axis=0))
    components = connected_components(tree.sparse_distance_matrix(tree, _GAP), directed=False)[0]
    pairs = tree.count_neighbors(tree, _SCALES) - len(points)
    return int(components), float(np.log(pairs[1] / pairs[0]) / np.log(_SCALES[1] / _SCALES[0]))


def similar_fractals(cache: ComputationCache) -> CheckResult:
    """Whether the chaotic attractors at larger loads q0 have the shape of that in Fig. 7d."""
    fixed, loads = study_of("6a").model, np.round(np.linspace(0.068, 0.079, 12), 4)
    found = {float(q0): cache.regime(**fixed, q0=float(q0)) for q0 in loads}
    chaos = [q0 for q0, regime in found.items() if regime.label == "chaotic"]
    panels = {panel: cache.study(f"7{panel}") for panel in "abcd"}
    portraits = {q0: cache.portrait(_POINTS, **fixed, q0=q0) for q0 in chaos[::2]}
    distances = {
        q0: {f"7{p}": distance(portrait, ds, panels["d"]) for p, ds in panels.items()}
        for q0, portrait in portraits.items()
    }
    nearest = {str(q0): min(d, key=lambda p: d[p]) for q0, d in distances.items()}
    evidence = {"labels": {str(q0): r.label for q0, r in found.items()},
                "distance": {str(q0): d for q0, d in distances.items()}, "nearest": nearest}
    alike = len(nearest) > 0 and set(nearest.values()) == {"7d"}
    computed = "Verdicts at twelve values; mean distance between nearest points of portraits, both ways."
    return CheckResult(graded(alike and len(chaos) >= 0.75 * len(found)), computed, evidence,
                       "" if len(chaos) == len(found) else "chaotic but for a window of 3T and its doublings within")


def distance(a: xr.Dataset, b: xr.Dataset, unit: xr.Dataset) -> float:
    """Distance of the portraits ``a`` and ``b`` in the plane of x1 and x1'.

    The mean distance of a point of one from the nearest point of the other, averaged over both directions. Coordinates
    are in units of their standard deviation in the portrait ``unit``.
    """
    spread = _plane(unit).std(axis=0)
    one, two = _plane(a) / spread, _plane(b) / spread
    return round(float(cKDTree(one).query(two)[0].mean() + cKDTree(two).query(one)[0].mean()) / 2, 4)


def _plane(ds: xr.Dataset) -> np.ndarray:
    """The points (N, 2) of a portrait in the plane of x1 and x1'."""
    return np.stack([ds[f"section_{n}"].values[:_POINTS] for n in ("x1", "x1_dot")], axis=1)


_SCAN = "Verdicts on a fine scan of the range, each from the paper's start."


def _over_load(cache: ComputationCache, start: float, stop: float, count: int) -> xr.Dataset:
    """A fine scan of part of Fig. 6."""
    return cache.scan(Axis("q0", start, stop, count), long_transients=True, **study_of("6a").model)


def end_of_chaos(cache: ComputationCache) -> CheckResult:
    """Whether chaos ends at q0 = 0.0508 and nearly all columns below are chaotic."""
    fine = _over_load(cache, 0.0495, 0.052, 51)
    q0 = fine["q0"].values
    end = float(q0[is_kind(fine, "chaotic")].max())
    whole = cache.study("6a")
    below = whole["q0"].values < end
    share = float(is_kind(whole, "chaotic")[below].mean())
    after = motions(fine["label"], fine["period"])[int(np.searchsorted(q0, end)) + 1]
    evidence = {"last_chaotic": round(end, 6), "after_it": after,
                "share_of_chaotic_columns_below": round(share, 4), "columns_below": int(below.sum())}
    enough = share >= 0.9
    return CheckResult(
        graded(enough and abs(end - 0.0508) < 1e-4, enough and abs(end - 0.0508) < 5e-4),
        f"{_SCAN} The share of chaotic columns is that of Fig. 6.", evidence,
        f"chaos ends at {end:.5f}, where the motion becomes {after}",
    )


def window_of_3t(cache: ComputationCache) -> CheckResult:
    """Whether the motion is 3T throughout the range of q0 in the statement."""
    printed = _over_load(cache, 0.02486, 0.02499, 14)
    inside = motions(printed["label"], printed["period"])
    windows = _windows(_over_load(cache, 0.0247, 0.0252, 101), 3)
    evidence = {"inside": dict(Counter(inside)), "windows_of_3T": [[round(a, 6), round(b, 6)] for a, b in windows]}
    return CheckResult(graded(set(inside) == {"3T"}), _SCAN, evidence, motions=_of_period(printed, 3))


def window_of_6t_after_3t(cache: ComputationCache) -> CheckResult:
    """Whether the motion at q0 = 0.0255 is 6T; otherwise, whether it is 6T nearby."""
    printed = cache.regime(**study_of("6a").model, q0=0.0255)
    around = _over_load(cache, 0.02505, 0.0256, 111)
    windows, motions_6t = _windows(around, 6), _of_period(around, 6)
    evidence = {"at_0.0255": summary(printed), "windows_of_6T": [[round(a, 6), round(b, 6)] for a, b in windows]}
    holds, where = printed.label == "6T", ""
    if windows and not holds:
        where = f"{printed.label} at 0.0255; 6T from {windows[0][0]:.5g} to {windows[-1][1]:.5g}"
    return CheckResult(graded(holds, misprint=windows), _SCAN, evidence, where, motions_6t)


def separate_window_of_6t(cache: ComputationCache) -> CheckResult:
    """Whether the motion at q0 = 0.047, or at a value that rounds to it, is 6T."""
    printed = cache.regime(**study_of("6a").model, q0=0.047)
    around = _over_load(cache, 0.04695, 0.04705, 101)
    windows = _windows(around, 6)
    near = [(a, b) for a, b in windows if b > 0.04695 and a < 0.04705]
    evidence = {"at_0.047": summary(printed), "windows_of_6T": [[round(a, 6), round(b, 6)] for a, b in windows]}
    where = f"6T at values from {near[0][0]:.6f} to {near[-1][1]:.6f}" if near else ""
    return CheckResult(graded(printed.label == "6T", near), _SCAN, evidence, where, _of_period(around, 6))


def _windows(ds: xr.Dataset, period: int) -> list[tuple[float, float]]:
    """The first and last q0 of every unbroken run of columns of this period."""
    return intervals(ds["q0"].values, ds["period"].values == period)


def _of_period(ds: xr.Dataset, period: int) -> list[PeriodicMotion]:
    """The motions of this period in a scan of part of Fig. 6."""
    return _motions_of_scan(ds, "q0", ds["period"].values == period, study_of("6a").model)


def _motions_of_scan(
    ds: xr.Dataset, axis: str, chosen: np.ndarray, fixed: Mapping[str, Any],
) -> list[PeriodicMotion]:
    """The periodic motions of those columns of a scan where ``chosen`` (N,) is true; other parameters are ``fixed``."""
    return _periodic(zip(ds[axis].values[chosen], ds["period"].values[chosen], strict=True), axis, fixed)


def intervals(values: np.ndarray, flags: np.ndarray) -> list[tuple[float, float]]:
    """First and last value of every unbroken interval of ``values`` (N,) in which ``flags`` (N,) are true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], np.asarray(flags, dtype=int), [0]])))
    return [(float(values[a]), float(values[b - 1])) for a, b in edges.reshape(-1, 2)]


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
    flags, strict = on_torus(ds), is_kind(ds, "quasi_periodic")
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
    return CheckResult(graded(exact, near), _SCAN, evidence, _in_words(ds, axis), found)


def wider_chaos(cache: ComputationCache) -> CheckResult:
    """Whether chaos reaches to larger q0 with elastic supports (Fig. 14) than with rigid ones (Fig. 6)."""
    diagrams = {name: cache.study(panel) for name, panel in (("6", "6a"), ("14a", "14a"), ("14b", "14b"))}
    ends = {name: round(float(ds["q0"].values[is_kind(ds, "chaotic")].max()), 5) for name, ds in diagrams.items()}
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
        "locked_periods": sorted({int(p) for p in ds["period"].values[is_kind(ds, "periodic")] if p > 8}),
    }


CHECKS = (
    motion, motions_along, chaos_after_the_cascade, closed_curves, similar_fractals, end_of_chaos, window_of_3t,
    window_of_6t_after_3t, separate_window_of_6t, second_torus, torus, wider_chaos,
)
