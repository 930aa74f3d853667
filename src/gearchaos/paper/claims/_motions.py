"""Statements about single motions: the verdict at one operating point, and the shape of its portrait."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from gearchaos.model import MeshModel
from gearchaos.paper.cache import ComputationCache
from gearchaos.paper.claims._outcome import CheckResult, PeriodicMotion, check, graded
from gearchaos.paper.claims._read import summary
from gearchaos.paper.text import symbol
from gearchaos.studies import Verdict

_VARIED_LOAD = {"omega": 1.0, "eps1": 0.1}
_VARIED_AMPLITUDE = {"omega": 1.0, "q0": 0.1}
_SOFT_SUPPORTS = {"kind": "full", "kappa": 0.5, "omega": 1.05, "q0": 0.1}
"""Fixed parameters of figures 6 and 7, in which the load q0 varies; of figures 8 and 9, and of figures 12 and 13, in
which the amplitude ε1 varies."""

_CHAOTIC: dict[str, dict[str, Any]] = {
    "7a": {**_VARIED_LOAD, "q0": 0.014},
    "7b": {**_VARIED_LOAD, "q0": 0.02},
    "7c": {**_VARIED_LOAD, "q0": 0.04},
    "7d": {**_VARIED_LOAD, "q0": 0.05},
    "9a": {**_VARIED_AMPLITUDE, "eps1": 0.23},
    "9c": {"kind": "single", "q0": 0.12, "omega": 1.7, "eps1": 0.09},
    "15a": {"kind": "full", "kappa": 0.5, "omega": 0.9, "eps1": 0.1, "q0": 0.128},
}
_VERDICT = "The verdict at this point from the paper's start, with the largest Lyapunov exponent."


@check(*_CHAOTIC)
def chaotic(cache: ComputationCache, name: str) -> CheckResult:
    """Whether the motion at the point of the statement is chaotic."""
    found = cache.regime(**_CHAOTIC[name])
    return CheckResult(graded(found.label == "chaotic"), _VERDICT, summary(found))


@check("15b")
def quasi_periodic(cache: ComputationCache) -> CheckResult:
    """Whether the motion of Fig. 15b is quasi-periodic."""
    found = cache.regime(kind="full", kappa=0.5, omega=0.9, eps1=0.1, q0=0.135)
    return CheckResult(graded(found.label == "quasi-periodic"), _VERDICT, summary(found))


@check("9b")
def sub_harmonic(cache: ComputationCache) -> CheckResult:
    """Whether the motion of Fig. 9b is periodic with a period of more than one mesh period."""
    found = cache.regime(**_VARIED_AMPLITUDE, eps1=0.231)
    return CheckResult(graded((found.period or 0) > 1), _VERDICT, summary(found),
                       motions=_periodic({0.231: found}, "eps1", _VARIED_AMPLITUDE))


@check("6b")
def doublings_over_load(cache: ComputationCache) -> CheckResult:
    """Whether the periods at three values of q0 are 4T, 8T and 12T."""
    return _exact_labels(cache, "q0", {0.0164: "4T", 0.01645: "8T", 0.0165: "12T"}, _VARIED_LOAD)


@check("8a")
def doublings_over_amplitude(cache: ComputationCache) -> CheckResult:
    """Whether the periods at three values of ε1 are 8T, 16T and 32T."""
    return _exact_labels(cache, "eps1", {0.206: "8T", 0.208: "16T", 0.209: "32T"}, _VARIED_AMPLITUDE)


def _exact_labels(cache: ComputationCache, name: str, wanted: dict[float, str], fixed: dict[str, Any]) -> CheckResult:
    """Whether the motions at these values of a parameter have these labels, with the other parameters fixed."""
    found = {value: cache.regime(**fixed, **{name: value}) for value in wanted}
    same = all(found[value].label == label for value, label in wanted.items())
    evidence = {f"{symbol(name)} = {v}": summary(r) for v, r in found.items()}
    return CheckResult(graded(same), "The verdict at each value.", evidence, motions=_periodic(found, name, fixed))


def _periodic(found: dict[float, Verdict], name: str, fixed: dict[str, Any]) -> list[PeriodicMotion]:
    """The periodic motions among those found at values of a parameter, with the other parameters fixed."""
    return [
        PeriodicMotion(verdict.period, MeshModel.of(**{**fixed, name: value}), {name: value})
        for value, verdict in found.items() if verdict.period
    ]


@check("8b")
def chaos_after_the_cascade(cache: ComputationCache) -> CheckResult:
    """Whether there is chaos just above the period doublings over ε1."""
    found = {value: cache.regime(**_VARIED_AMPLITUDE, eps1=value) for value in (0.2095, 0.21)}
    chaos = any(r.label == "chaotic" for r in found.values())
    return CheckResult(graded(chaos), "The verdict at two values.", {f"ε1 = {v}": summary(r) for v, r in found.items()})


@check("13a", "13b")
def closed_curves(cache: ComputationCache, name: str) -> CheckResult:
    """Whether the portrait consists of one (13a) or two (13b) closed curves."""
    eps1, wanted = {"13a": (0.04, 1), "13b": (0.205, 2)}[name]
    found = cache.regime(**_SOFT_SUPPORTS, eps1=eps1)
    components, dimension = curves(cache.study(13, f"{name[2]}_section"))
    holds = found.label == "quasi-periodic" and components == wanted and abs(dimension - 1) < 0.15
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


_LARGER_LOADS = np.round(np.linspace(0.068, 0.079, 12), 4)


@check("7e")
def similar_fractals(cache: ComputationCache) -> CheckResult:
    """Whether the chaotic attractors at larger loads q0 have the shape of that in Fig. 7d."""
    found = {float(q0): cache.regime(**_VARIED_LOAD, q0=float(q0)) for q0 in _LARGER_LOADS}
    chaos = [q0 for q0, regime in found.items() if regime.label == "chaotic"]
    panels = {panel: cache.study(7, panel) for panel in "abcd"}
    portraits = {q0: cache.portrait(_POINTS, **_VARIED_LOAD, q0=q0) for q0 in chaos[::2]}
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
