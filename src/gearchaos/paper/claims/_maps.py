"""Statements about maps and basins: resonances, zones, whether a change of the model changes them, and attractors.

Figures 3 and 4 are checked by the attractors that many initial states lead to, which texts and evidence call starts.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr
from scipy import ndimage
from scipy.signal import find_peaks, peak_widths
from scipy.stats import spearmanr

from gearchaos.model import HarmonicStiffness, MeshModel, TwoLevelStiffness
from gearchaos.paper.cache import ComputationCache
from gearchaos.paper.claims._claim import CheckResult, PeriodicMotion, graded, is_kind, on_torus
from gearchaos.paper.settings import study_of
from gearchaos.plot import attractor_names, motion_class
from gearchaos.studies import Axis

_OMEGA, _EPS1 = Axis("omega", 0.2, 3.0, 60), Axis("eps1", 0.0, 0.3, 40)


def _reference(**values: Any) -> MeshModel:
    """The torsional model of Fig. 2, to whose map those of other models are compared, with other values."""
    return MeshModel.of(**study_of("2a").model, **values)


def resonances(cache: ComputationCache) -> CheckResult:
    """Whether V_RMS over ω has peaks near 2, 1, 1/2 and 1/4."""
    ds = cache.scan(Axis("omega", 0.2, 3.0, 401), q0=0.1, eps1=0.005)
    omega, v_rms = ds["omega"].values, ds["v_rms"].values
    peaks, _ = find_peaks(v_rms, prominence=0.02 * v_rms.max())
    left, right = (np.interp(edge, np.arange(len(omega)), omega) for edge in peak_widths(v_rms, peaks, 0.5)[2:])
    found = [{"peak": round(float(omega[p]), 4), "from": round(float(a), 4), "to": round(float(b), 4),
              "v_rms": round(float(v_rms[p]), 5)} for p, a, b in zip(peaks, left, right, strict=True)]
    reached = {str(w): any(0.9 * f["from"] <= w <= 1.1 * f["to"] for f in found) for w in (2.0, 1.0, 0.5, 0.25)}
    return CheckResult(graded(all(reached.values())), "V_RMS over ω at ε1 = 0.005 with its peaks and their widths.",
                       {"raised_levels": found, "reached": reached})


def v_rms_in_chaos(cache: ComputationCache) -> CheckResult:
    """Whether V_RMS is higher in chaotic cells than in others, in the median but not everywhere."""
    ds = cache.study("2a")
    low = ds.sel(omega=slice(None, 2.0))
    chaos, v_rms = is_kind(low, "chaotic"), low["v_rms"].values
    inside, outside = float(np.median(v_rms[chaos])), float(np.median(v_rms[~chaos]))
    lower = float((v_rms[chaos] < outside).mean())
    evidence = {"median_v_rms_chaotic": round(inside, 5), "median_v_rms_other": round(outside, 5),
                "share_of_chaotic_cells_below_the_other_median": round(lower, 4)}
    return CheckResult(graded(inside > outside and lower > 0), "Levels of the cells of Fig. 2 at ω < 2.", evidence)


def bearing_friction(cache: ComputationCache) -> CheckResult:
    """Whether the map without bearing friction is similar to the reference map."""
    other = cache.map(_reference(beta=0.0), _OMEGA, _EPS1)
    fine = {str(q0): cache.regime(omega=1.0, eps1=0.1, beta=0.0, q0=q0).label for q0 in (0.0164, 0.01645, 0.0165)}
    remark = f"fine windows do move: the three values of 6b then give {', '.join(fine.values())}"
    return _compared(cache, other, {"labels_of_6b_with_beta_0": fine}, remark)


def sine_stiffness(cache: ComputationCache) -> CheckResult:
    """Whether the map with a sinusoidal mesh stiffness is similar to the reference map."""
    sine = first_harmonic(TwoLevelStiffness())
    other = cache.map(replace(_reference(), stiffness=sine), _OMEGA, _EPS1)
    return _compared(cache, other, {"amplitude": round(sine.amplitudes[0], 6)})


def first_harmonic(wave: TwoLevelStiffness) -> HarmonicStiffness:
    """The first Fourier harmonic of (2.16) about a mean of 1, which is its mean if χ1 (α − 1) = χ2 (2 − α)."""
    share = wave.contact_ratio - 1
    amplitude = 2 / np.pi * (wave.chi1 + wave.chi2) * np.sin(np.pi * share)
    return HarmonicStiffness((float(amplitude),), (float(np.pi * share),))


def _compared(cache: ComputationCache, other: xr.Dataset, extra: dict, remark: str = "") -> CheckResult:
    """Whether a map is as similar to the reference map as that of the same model from another initial state."""
    reference, baseline = cache.map(_reference(), _OMEGA, _EPS1), _from_another_state(cache)
    found = similarity(reference, other)
    chaotic = [round(float(is_kind(ds, "chaotic").mean()), 4) for ds in (reference, other)]
    evidence = {**found, **extra, "chaotic_share": chaotic, "same_model_from_x1_0.5": baseline}
    return CheckResult(graded(_similar(found, baseline, reference.label.size)),
                       "Two maps of 60 × 40 cells over (ω, ε1), compared cell by cell.", evidence, remark)


def similarity(a: xr.Dataset, b: xr.Dataset) -> dict[str, float]:
    """Similarity of two maps with the same cells: the share of those with the same class in both, and Pearson's
    correlation of V_RMS over all cells."""
    one, other = (motion_class(ds["label"], ds["period"]) for ds in (a, b))
    va, vb = a["v_rms"].values.ravel(), b["v_rms"].values.ravel()
    good = np.isfinite(va) & np.isfinite(vb)
    return {"same_class": round(float((one == other).mean()), 4),
            "v_rms_correlation": round(float(np.corrcoef(va[good], vb[good])[0, 1]), 4)}


def _from_another_state(cache: ComputationCache) -> dict[str, float]:
    """Similarity of the reference map to that of the same model from x1 = 0.5: the baseline for other changes, since
    these maps differ only by coexisting motions."""
    return similarity(*(cache.map(model, _OMEGA, _EPS1) for model in (_reference(), _reference(x1=0.5))))


def _similar(found: dict[str, float], baseline: dict[str, float], cells: int) -> bool:
    """Whether no fewer cells keep their class than in the baseline, up to two standard errors."""
    share = baseline["same_class"]
    return found["same_class"] >= share - 2 * np.sqrt(2 * share * (1 - share) / cells)


def stiff_supports(cache: ComputationCache) -> CheckResult:
    """Whether stiff supports give the same verdicts as rigid ones, in the setting of Fig. 10.

    The evidence also has the same comparison over the whole plane of Fig. 2.
    """
    omega, fixed = Axis("omega", 0.2, 3.0, 281), {"eps1": 0.05, **study_of("2a").model}
    rigid = cache.scan(omega, **fixed)
    baseline = similarity(rigid, cache.scan(omega, **fixed, x1=0.5))
    found = {kappa: similarity(rigid, cache.scan(omega, **{**fixed, "kind": "full", "kappa": kappa}))
             for kappa in (10.0, 20.0, 30.0, 50.0)}
    differing = [kappa for kappa, f in found.items() if not _similar(f, baseline, omega.count)]
    supported = MeshModel.of(**{**study_of("2a").model, "kind": "full", "kappa": 20.0})
    plane = similarity(*(cache.map(model, _OMEGA, _EPS1) for model in (_reference(), supported)))
    other_start = _from_another_state(cache)
    evidence = {"by_kappa": {f"{k:g}": v for k, v in found.items()}, "same_model_from_x1_0.5": baseline,
                "whole_plane_of_fig_2_at_kappa_20": plane, "there_same_model_from_x1_0.5": other_start}
    return CheckResult(
        graded(differing == [10.0]), "Verdicts on 281 frequencies for every κ, compared with the torsional model.",
        evidence,
        f"over amplitudes up to 0.3 differences remain at κ = 20: {plane['same_class']:.0%} of the cells keep their "
        f"class, {other_start['same_class']:.0%} would if only the start differed",
    )


def chaos_at_small_load(cache: ComputationCache) -> CheckResult:
    """Whether chaos is confined to q0 < 0.15 in the map of Fig. 5."""
    ds = cache.study("5a")
    chaos, q0 = is_kind(ds, "chaotic"), ds["q0"].values
    below = {limit: float(chaos[q0 < limit].sum() / chaos.sum()) for limit in (0.15, 0.155)}
    last = float(q0[chaos.mean(axis=1) >= 0.02].max())
    evidence = {"share_of_chaotic_cells_below": {str(k): round(v, 4) for k, v in below.items()},
                "last_row_with_2_percent_of_chaos": round(last, 4),
                "last_chaotic_cell": round(float(q0[chaos.any(axis=1)].max()), 4)}
    return CheckResult(graded(last > 0.14 and below[0.15] >= 0.99, last > 0.14 and below[0.155] >= 0.99),
                       "The chaotic cells of Fig. 5.", evidence, f"chaos takes 2 % of a row up to q0 = {last:.3f}")


def small_v_rms_at_high_frequency(cache: ComputationCache) -> CheckResult:
    """Whether V_RMS at ω > 2 is less than half of that at lower ω, for all q0."""
    ds = cache.study("5a")
    v_rms, high = ds["v_rms"].values, ds["omega"].values > 2
    tenths = np.array_split(np.arange(len(v_rms)), 10)
    pairs = [(float(np.nanmedian(v_rms[t][:, high])), float(np.nanmedian(v_rms[t][:, ~high]))) for t in tenths]
    evidence = {"median_v_rms_above_and_below_omega_2_by_tenth_of_q0": [[round(a, 4), round(b, 4)] for a, b in pairs]}
    return CheckResult(graded(all(a < 0.5 * b for a, b in pairs)), "Levels of the cells of Fig. 5.", evidence)


def chaos_moves_to_higher_frequencies(cache: ComputationCache) -> CheckResult:
    """Whether ω increases with κ along every band of chaotic cells in Fig. 10."""
    ds = cache.study("10a")
    chaos = is_kind(ds, "chaotic")
    bands, count = ndimage.label(ndimage.binary_dilation(chaos, np.ones((3, 3))))
    large = [k for k in range(1, count + 1) if (chaos & (bands == k)).sum() >= 0.05 * chaos.sum()]
    found = []
    for cells in (chaos & (bands == k) for k in large):
        rows = cells.any(axis=1)
        kappa, mean = ds["kappa"].values[rows], (cells @ ds["omega"].values)[rows] / cells.sum(axis=1)[rows]
        found.append({
            "share_of_chaotic_cells": round(float(cells.sum() / chaos.sum()), 4),
            "kappa_from": round(float(kappa[0]), 3), "kappa_to": round(float(kappa[-1]), 3),
            "mean_omega_from": round(float(mean[0]), 3), "mean_omega_to": round(float(mean[-1]), 3),
            "rank_correlation": round(float(spearmanr(kappa, mean).statistic), 4),
        })
    rising = len(found) > 0 and all(f["rank_correlation"] > 0.5 for f in found)
    return CheckResult(graded(rising), "The connected bands of chaotic cells in Fig. 10, one row after the other.",
                       {"bands": found})


def quasi_periodic_cells(cache: ComputationCache) -> CheckResult:
    """Whether the map of Fig. 10 has quasi-periodic cells."""
    share = float(is_kind(cache.study("10a"), "quasi_periodic").mean())
    evidence = {"share_of_quasi_periodic_cells": round(share, 4)}
    return CheckResult(graded(share >= 0.01), "The cells of Fig. 10.", evidence)


def chaos_bordered_by_tori(cache: ComputationCache) -> CheckResult:
    """Whether cells next to the chaotic ones near ω = 1 in Fig. 11 are quasi-periodic or periodic with a long
    period."""
    ds = cache.study("11a").sel(omega=slice(0.9, 1.2), eps1=slice(0.0, 0.1))
    chaos = is_kind(ds, "chaotic")
    beside = ndimage.binary_dilation(chaos) & ~chaos  # cells with a chaotic one among their four neighbours
    share = float(on_torus(ds, 5)[beside].mean()) if beside.any() else 0.0
    evidence = {"share_of_chaotic_cells": round(float(chaos.mean()), 4), "cells_beside_chaos": int(beside.sum()),
                "share_of_them_quasi_periodic_or_high_order": round(share, 4),
                "share_over_the_whole_plane": round(float(on_torus(cache.study("11a"), 5).mean()), 4)}
    return CheckResult(graded(chaos.mean() >= 0.01 and share >= 0.1), "The cells of Fig. 11 around ω = 1.", evidence)


_COMPUTED = "The motion that every start of the plane ends on, and the attractors told apart."


def _shares(ds: xr.Dataset) -> dict[str, float]:
    """Share of the initial states that lead to each attractor, by its name."""
    return {n: round(float(s), 4) for n, s in zip(attractor_names(ds), ds["attractor_fraction"].values, strict=True)}


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


def many_attractors_at_high_frequency(cache: ComputationCache) -> CheckResult:
    """Whether Fig. 3c has more attractors than Figs. 3a and 3b, at lower frequencies."""
    counts = {panel: len(_shares(cache.study(f"3{panel}"))) for panel in "abc"}
    evidence = {"attractors": counts, "share_by_attractor_3c": _shares(cache.study("3c"))}
    return CheckResult(graded(counts["c"] > max(counts["a"], counts["b"])), _COMPUTED, evidence)


def orbit_of_period(cache: ComputationCache, period: int, number: int = 1) -> CheckResult:
    """Whether there is a stable orbit of this period among the attractors, or as many of them as ``number``."""
    ds, indices = _of_period(cache, period)
    motions = _motions(ds, indices[number - 1 : number])
    return CheckResult(graded(len(indices) >= number), _COMPUTED, _orbits(ds, indices), motions=motions)


def orbit_of_2t_or_3t(cache: ComputationCache) -> CheckResult:
    """Whether there is a stable 2T orbit, as the caption of Fig. 4b says; the text says 3T."""
    ds, of_2t = _of_period(cache, 2)
    _, of_3t = _of_period(cache, 3)
    evidence = {"2T": _orbits(ds, of_2t), "3T": _orbits(ds, of_3t)}
    return CheckResult(graded(len(of_2t), misprint=len(of_3t)), _COMPUTED, evidence,
                       "" if len(of_2t) else "3T, as the text says", _motions(ds, (of_2t if len(of_2t) else of_3t)[:1]))


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


CHECKS = (
    resonances, v_rms_in_chaos, bearing_friction, sine_stiffness, stiff_supports, chaos_at_small_load,
    small_v_rms_at_high_frequency, chaos_moves_to_higher_frequencies, quasi_periodic_cells, chaos_bordered_by_tori,
    two_kinds_of_motion, many_attractors_at_high_frequency, orbit_of_period, orbit_of_2t_or_3t,
)
