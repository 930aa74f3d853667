"""Statements about coexisting motions: figures 3 and 4, checked by the attractors that many initial states lead to.

In texts and evidence the initial states are called starts.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from gearchaos.paper.cache import ComputationCache
from gearchaos.paper.claims._claim import CONTRADICTED, HOLDS, MISPRINT, CheckResult, PeriodicMotion, check, graded
from gearchaos.paper.settings import study_of
from gearchaos.plot import attractor_names

_COMPUTED = "The motion that every start of the plane ends on, and the attractors told apart."


def _shares(ds: xr.Dataset) -> dict[str, float]:
    """Share of the initial states that lead to each attractor, by its name."""
    return {n: round(float(s), 4) for n, s in zip(attractor_names(ds), ds["attractor_fraction"].values, strict=True)}


@check
def two_kinds_of_motion(cache: ComputationCache, panel: str) -> CheckResult:
    """Whether two kinds of motion attract nearly all initial states."""
    ds = cache.study(panel)
    kinds: dict[str, float] = {}
    for attractor, share in _shares(ds).items():
        kinds[attractor.rstrip("′")] = kinds.get(attractor.rstrip("′"), 0.0) + share
    ranked = sorted(kinds.items(), key=lambda item: -item[1])
    leading = ranked[:2]
    enough = sum(s for _, s in leading) >= 0.9 and leading[-1][1] >= 0.05 and len(leading) == 2
    evidence = {"share_by_kind": {k: round(s, 4) for k, s in ranked}, "share_by_attractor": _shares(ds),
                "starts": int(ds["attractor"].size)}
    return CheckResult(graded(enough), _COMPUTED, evidence)


@check
def many_attractors_at_high_frequency(cache: ComputationCache) -> CheckResult:
    """Whether Fig. 3c has more attractors than Figs. 3a and 3b, at lower frequencies."""
    counts = {panel: len(_shares(cache.study(f"3{panel}"))) for panel in "abc"}
    evidence = {"attractors": counts, "share_by_attractor_3c": _shares(cache.study("3c"))}
    return CheckResult(graded(counts["c"] > max(counts["a"], counts["b"])), _COMPUTED, evidence)


@check
def orbit_of_period(cache: ComputationCache, period: int, number: int = 1) -> CheckResult:
    """Whether there is a stable orbit of this period among the attractors, or as many of them as ``number``."""
    ds, indices = _of_period(cache, period)
    motions = _motions(ds, indices[number - 1 : number])
    return CheckResult(graded(len(indices) >= number), _COMPUTED, _orbits(ds, indices), motions=motions)


@check
def orbit_of_2t_or_3t(cache: ComputationCache) -> CheckResult:
    """Whether there is a stable 2T orbit, as the caption of Fig. 4b says; the text says 3T."""
    ds, of_2t = _of_period(cache, 2)
    _, of_3t = _of_period(cache, 3)
    verdict = HOLDS if len(of_2t) else MISPRINT if len(of_3t) else CONTRADICTED
    return CheckResult(verdict, _COMPUTED, {"2T": _orbits(ds, of_2t), "3T": _orbits(ds, of_3t)},
                       "" if len(of_2t) else "3T, as the text says",
                       _motions(ds, of_2t[:1] if len(of_2t) else of_3t[:1]))


def _of_period(cache: ComputationCache, period: int) -> tuple[xr.Dataset, np.ndarray]:
    """The basins of figure 3c, and the indices of the attractors with this period."""
    ds = cache.study("3c")
    return ds, np.flatnonzero(ds["attractor_period"].values == period)


def _motions(ds: xr.Dataset, indices: np.ndarray) -> list[PeriodicMotion]:
    """The motions on these attractors of figure 3c, each from one of its stroboscopic points."""
    model, found = study_of("3c").mesh_model, []
    for i in indices:
        start = {name: float(ds[f"attractor_section_{name}"].values[i, 0]) for name in ("z", "z_dot")}
        found.append(PeriodicMotion(int(ds["attractor_period"].values[i]), model.with_values(start)))
    return found


def _orbits(ds: xr.Dataset, indices: np.ndarray) -> dict:
    """Number of initial states, and of each attractor its share of them and its stroboscopic point of smallest z."""
    z, z_dot = (ds[f"attractor_section_{n}"].values for n in ("z", "z_dot"))
    found = []
    for i in indices:
        point = int(np.nanargmin(z[i]))
        found.append({"share_of_starts": round(float(ds["attractor_fraction"][i]), 5),
                      "z": round(float(z[i, point]), 6), "z_dot": round(float(z_dot[i, point]), 6)})
    return {"starts": int(ds["attractor"].size), "orbits": found}
