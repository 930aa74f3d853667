"""Statements about single motions: the verdict at one operating point, and the shape of its portrait."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from gearchaos.model import MeshModel
from gearchaos.paper.cache import ComputationCache
from gearchaos.paper.claims._claim import CheckResult, PeriodicMotion, check, graded
from gearchaos.paper.claims._read import summary
from gearchaos.paper.settings import study_of, symbol
from gearchaos.studies import Verdict


@check
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
    motions = _periodic({values[varied]: found}, varied, values) if varied else []
    return CheckResult(graded(holds), computed, summary(found), motions=motions)


@check
def motions_along(cache: ComputationCache, diagram: str, values: list[float], labels: list[str]) -> CheckResult:
    """Whether the motions at these values of the parameter of a diagram have these labels."""
    study = study_of(diagram)
    (name,) = study.axes
    found = {value: cache.regime(**study.model, **{name: value}) for value in values}
    same = [verdict.label for verdict in found.values()] == labels
    evidence = {f"{symbol(name)} = {value}": summary(verdict) for value, verdict in found.items()}
    motions = _periodic(found, name, study.model)
    return CheckResult(graded(same), "The verdict at each value.", evidence, motions=motions)


def _periodic(found: dict[float, Verdict], name: str, fixed: Mapping[str, Any]) -> list[PeriodicMotion]:
    """The periodic motions among those found at values of a parameter, with the other parameters fixed."""
    return [
        PeriodicMotion(verdict.period, MeshModel.of(**{**fixed, name: value}), {name: value})
        for value, verdict in found.items() if verdict.period
    ]


@check
def chaos_after_the_cascade(cache: ComputationCache) -> CheckResult:
    """Whether there is chaos just above the period doublings over ε1."""
    found = {value: cache.regime(**study_of("8a").model, eps1=value) for value in (0.2095, 0.21)}
    chaos = any(r.label == "chaotic" for r in found.values())
    return CheckResult(graded(chaos), "The verdict at two values.", {f"ε1 = {v}": summary(r) for v, r in found.items()})


@check
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


@check
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
