"""What a figure shows, in numbers: sentences computed from its Datasets."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import xarray as xr
from scipy.ndimage import binary_dilation

from gearchaos.dynamics.time_series import spectral_class
from gearchaos.paper.cache import ComputationCache
from gearchaos.paper.settings import FigureSettings, FigureStudy, symbol
from gearchaos.plot import MOTION_CLASSES, attractor_names, motion_class
from gearchaos.studies import motions


def findings(cache: ComputationCache, figure: FigureSettings, data: Mapping[str, xr.Dataset]) -> list[str]:
    """The sentences about a figure: one text for each of its panels whose kind of study is in `_SENTENCES`."""
    if figure.layout == "coexisting":
        return [_coexisting(data)]
    out = []
    panels = [(name, study) for name, study in figure.studies.items() if study.kind in _SENTENCES]
    for name, study in panels:
        letter = f"({name[0]}) " if len(panels) > 1 else ""
        out.append(letter + _SENTENCES[study.kind](cache, study, data[name]))
    return out


def percent(share: float) -> str:
    """A share in percent with one digit after the point below 10 %."""
    return f"{100 * share:.0f} %" if share >= 0.1 else f"{100 * share:.1f} %" if share >= 0.001 else "below 0.1 %"


def shares(ds: xr.Dataset) -> str:
    """The shares of the classes of motion, largest first."""
    counts = np.bincount(motion_class(ds["label"], ds["period"]).ravel(), minlength=len(MOTION_CLASSES))
    order = [i for i in np.argsort(-counts) if counts[i]]
    return ", ".join(f"{MOTION_CLASSES[i].name} {percent(counts[i] / counts.sum())}" for i in order)


def _zones(cache: ComputationCache, study: FigureStudy, ds: xr.Dataset) -> str:
    v_rms = ds["v_rms"].values
    y, x = (int(i) for i in np.unravel_index(np.nanargmax(v_rms), v_rms.shape))
    (x_name, y_name) = study.axes
    where = f"{symbol(x_name)} = {float(ds[x_name][x]):.3g}, {symbol(y_name)} = {float(ds[y_name][y]):.3g}"
    separated = float((ds["contact"].values > 0).mean())
    return (
        f"Shares of the {ds.sizes[x_name]} × {ds.sizes[y_name]} cells: {shares(ds)}. V_RMS runs from "
        f"{np.nanmin(v_rms):.3g} to {np.nanmax(v_rms):.3g} (at {where}), its median is {np.nanmedian(v_rms):.3g}. "
        f"Teeth lose contact in {percent(separated)} of the cells.{_locked(ds)}"
    )


def _locked(ds: xr.Dataset) -> str:
    """The share of cells next to quasi-periodic ones that are periodic with a high order; empty without tori."""
    kinds = motion_class(ds["label"], ds["period"])
    tori, higher = kinds == _TORUS, kinds == _HIGHER
    if not tori.any():
        return ""
    beside = binary_dilation(tori, np.ones((3, 3))) & ~tori
    locked = beside & higher
    longest = int(ds["period"].values[locked].max(initial=0))
    orbits = f", on orbits of up to {longest}T" if longest else ""
    share = percent(locked.sum() / beside.sum())
    return f" Of the {beside.sum()} cells beside quasi-periodic ones {share} are locked at a higher order{orbits}."


def _basins(cache: ComputationCache, study: FigureStudy, ds: xr.Dataset) -> str:
    parts = [
        f"{n} {percent(float(s))}" for n, s in zip(attractor_names(ds), ds["attractor_fraction"].values, strict=True)
    ]
    return f"{ds['attractor'].size} initial states lead to {len(parts)} attractors: {', '.join(parts)}."


def _bifurcation(cache: ComputationCache, study: FigureStudy, ds: xr.Dataset) -> str:
    (axis,) = study.axes
    values = ds[axis].values[motion_class(ds["label"], ds["period"]) == _CHAOTIC]
    text = f"Shares of the {ds.sizes[axis]} columns: {shares(ds)}."
    if values.size:
        text += (
            f" Chaos occurs between {symbol(axis)} = {values[0]:.4g} and {values[-1]:.4g}, with exponents up to "
            f"{float(ds['lyapunov'].max()):.3f}.{_onset(ds, axis)}"
        )
    return f"{text} {spectral_comparison(ds, axis)}"


def _onset(ds: xr.Dataset, axis: str) -> str:
    """The two columns between which chaos first sets in, with their largest exponents."""
    first = int(np.argmax(motion_class(ds["label"], ds["period"]) == _CHAOTIC))
    if first == 0:
        return ""
    before, after = ds.isel({axis: first - 1}), ds.isel({axis: first})
    (name,) = motions(before["label"], before["period"])
    return (
        f" Going up, it first sets in between {float(before[axis]):.5g} ({name}, largest exponent "
        f"{float(before['lyapunov']):+.4f}) and {float(after[axis]):.5g} ({float(after['lyapunov']):+.4f})."
    )


_COLUMNS_COMPARED = 120
_COLUMNS_LISTED = 4
"""Largest number of columns that are compared, and of those that differ and are listed."""


def spectral_comparison(ds: xr.Dataset, axis: str) -> str:
    """The columns whose class by the spectrum of stroboscopic points, as in the paper, differs from the verdict."""
    columns = np.unique(np.linspace(0, ds.sizes[axis] - 1, _COLUMNS_COMPARED).astype(int))
    names, differing = motions(ds["label"], ds["period"]), []
    for i in columns:
        points = np.stack([ds[f"section_{n}"].values[i] for n in ("z", "z_dot")], axis=1)
        found = spectral_class(points, longest=len(points) // 2)[0]
        if found != names[i]:
            differing.append(f"{float(ds[axis][i]):.4g} ({found}, not {names[i]})")
    if not differing:
        return f"The spectrum of the stroboscopic points says the same in all of {len(columns)} columns compared."
    listed = ", ".join(differing[:_COLUMNS_LISTED]) + (", …" if len(differing) > _COLUMNS_LISTED else "")
    return (
        f"The spectrum of the stroboscopic points says the same in {len(columns) - len(differing)} of {len(columns)} "
        f"columns compared; not at {symbol(axis)} = {listed}."
    )


_CHAOTIC, _TORUS, _HIGHER = (
    [c.name for c in MOTION_CLASSES].index(n) for n in ("chaotic", "quasi-periodic", "other sub-harmonic")
)


def _point(cache: ComputationCache, study: FigureStudy, ds: xr.Dataset) -> str:
    found = cache.regime(**study.model)
    (low, high), value = found.lyapunov_ci[0], found.lyapunov[0]
    interval = f" (99 % interval {low:.4f} to {high:.4f})" if high > low else ""
    return f"{found.label}, largest exponent {value:.4f}{interval}, V_RMS {found.v_rms:.4f}."


def _coexisting(data: Mapping[str, xr.Dataset]) -> str:
    parts = [
        f"{key.split('_')[0]} (reached from {percent(ds.attrs['share_of_starts'])} of the initial states, "
        f"smallest stroboscopic z {ds['section_z'].values.min():.4f})"
        for key, ds in data.items()
    ]
    return f"{len(parts)} of the motions shown were found: {', '.join(parts)}."


_SENTENCES: dict[str, Callable[[ComputationCache, FigureStudy, xr.Dataset], str]] = {
    "zones": _zones,
    "basins": _basins,
    "bifurcation": _bifurcation,
    "portrait": _point,
}
