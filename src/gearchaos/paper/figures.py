"""The figures of the paper, one function per layout, and what each shows in sentences computed from its Datasets."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from io import BytesIO
from typing import Any

import matplotlib
import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from scipy.ndimage import binary_dilation

from gearchaos import plot
from gearchaos.dynamics.time_series import spectral_class
from gearchaos.paper.cache import ComputationCache
from gearchaos.paper.settings import FigureSettings, FigureStudy, symbol
from gearchaos.studies import motions

WIDTH = 7.2
"""Width of every figure, in inches."""

STYLE: Any = {
    "font.family": "STIXGeneral", "mathtext.fontset": "stix", "font.size": 10, "axes.labelsize": 10,
    "axes.titlesize": 10, "legend.fontsize": 9, "xtick.labelsize": 9, "ytick.labelsize": 9, "axes.linewidth": 0.7,
    "xtick.major.width": 0.7, "ytick.major.width": 0.7, "xtick.direction": "out", "ytick.direction": "out",
    "axes.formatter.limits": (-3, 4), "axes.formatter.use_mathtext": True, "path.simplify_threshold": 0.5,
}


def letter(ax: Axes, name: str, text: str = "") -> None:
    """The panel's letter and a short text above its upper left corner (above the strip and legend if there are any)."""
    ax.annotate(f"({name})" + (f"  {text}" if text else ""), (0, 1), (0, 4), xycoords="axes fraction",
                textcoords="offset points", ha="left", va="bottom", fontsize=10)


def system(figure: Figure, setting: FigureSettings, data: Mapping[str, xr.Dataset]) -> None:
    """(a) the gear pair at left, (b) c(t) above F(u) at right."""
    figure.set_size_inches(WIDTH, 5.4)
    grid = figure.add_gridspec(2, 2, width_ratios=(1.05, 1))
    left = figure.add_subplot(grid[:, 0])
    plot.schematic(left)
    letter(left, "a")
    top, bottom = figure.add_subplot(grid[0, 1]), figure.add_subplot(grid[1, 1])
    plot.stiffness(ax=top)
    plot.backlash(ax=bottom)
    letter(top, "b")


def maps(figure: Figure, setting: FigureSettings, data: Mapping[str, xr.Dataset]) -> None:
    """(a) the kinds of motion, (b) V_RMS, side by side; the legend below."""
    figure.set_size_inches(WIDTH, 3.75)
    left, right = figure.subplots(1, 2, width_ratios=(1, 1.13))
    ds = data["a"]
    plot.zones(ds, left, legend=False)
    plot.level(ds, "v_rms", right)
    right.set_ylabel("")
    right.tick_params(labelleft=False)
    letter(left, "a", "kind of motion")
    letter(right, "b", "quality index")
    classes = plot.motion_class(ds["label"], ds["period"])
    plot.class_legend(figure, classes, loc="outside lower center", ncols=9, bbox_to_anchor=None)


def basins(figure: Figure, setting: FigureSettings, data: Mapping[str, xr.Dataset]) -> None:
    """One panel per operating point, each with the legend of its own attractors below it."""
    figure.set_size_inches(WIDTH, 3.5)
    row = figure.subplots(1, len(data), sharey=True)
    for ax, (name, ds) in zip(row, data.items(), strict=True):
        plot.basins(ds, ax, legend=False)
        plot.attractor_legend(ax, ds, loc="upper left", bbox_to_anchor=(0, -0.2), ncols=2)
        model = setting.studies[name].model
        letter(ax, name, rf"$\omega={model['omega']}$, $\varepsilon_1={model['eps1']}$")
        ax.set_ylabel(ax.get_ylabel() if ax is row[0] else "")


def bifurcations(figure: Figure, setting: FigureSettings, data: Mapping[str, xr.Dataset]) -> None:
    """Diagrams one below the other, each with its strip of verdicts."""
    figure.set_size_inches(WIDTH, 3.5 * len(data) + 0.3)
    column = figure.subplots(len(data), 1, squeeze=False)[:, 0]
    for ax, (name, ds) in zip(column, data.items(), strict=True):
        plot.bifurcation(ds, "x1", ax)
        if len(data) > 1:
            model = setting.studies[name].model
            _letter_inside(ax, name, rf"$\kappa={model['kappa']}$, $\omega={model['omega']}$")


def bifurcation_and_exponent(figure: Figure, setting: FigureSettings, data: Mapping[str, xr.Dataset]) -> None:
    """(a) the diagram, (b) the largest exponent over the same axis."""
    figure.set_size_inches(WIDTH, 6.0)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(1.5, 1))
    plot.bifurcation(data["a"], "x1", top)
    plot.lyapunov(data["a"], bottom)
    top.set_xlabel("")
    _letter_inside(top, "a")
    _letter_inside(bottom, "b")


def _letter_inside(ax, name: str, text: str = "") -> None:
    """Write the letter of a panel inside the Axes, if there are a strip and a legend above it."""
    label = f"({name})" + (f"  {text}" if text else "")
    ax.text(0.012, 0.97, label, transform=ax.transAxes, ha="left", va="top",
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.5})


_HISTORY_PERIODS, _TRAJECTORY_PERIODS = 40, 120
"""Mesh periods in a time history, and in a phase trajectory."""

_THIN_LINE_WIDTH = 0.25
"""Width of the line of a long trajectory, in points."""

_COEXISTING = (
    ("1T_1", "phase"), ("3T_1", "phase"), ("4T_1", "phase"), ("4T_2", "phase"),
    ("4T_1", "history"), ("4T_2", "history"), ("5T_1", "phase"), ("5T_1", "history"),
)
"""The panels of figure 4: name of the orbit, and how it is drawn."""


def coexisting(figure: Figure, setting: FigureSettings, data: Mapping[str, xr.Dataset]) -> None:
    """Phase trajectories of the five motions, and the time histories of the two 4T and of the 5T motion."""
    figure.set_size_inches(WIDTH, 8.6)
    axes = figure.subplots(4, 2)
    for ax, name, (key, picture) in zip(axes.flat, "abcdefgh", _COEXISTING, strict=True):
        period, index = key.split("_")
        letter(ax, name, f"{period}-periodic" + ", second" * (index == "2"))
        if key not in data:
            ax.text(0.5, 0.5, "not found in this run", transform=ax.transAxes, ha="center")
        elif picture == "phase":
            plot.phase(data[key], "z", ax=ax)
        else:
            plot.history(data[key], "z_dot", ax)


def portraits(figure: Figure, setting: FigureSettings, data: Mapping[str, xr.Dataset]) -> None:
    """Stroboscopic portraits, two in a row."""
    rows = (len(data) + 1) // 2
    figure.set_size_inches(WIDTH, 3.1 * rows)
    axes = figure.subplots(rows, 2, squeeze=False)
    for ax, (name, ds) in zip(axes.flat, data.items(), strict=True):
        plot.portrait(ds, "x1", ax=ax)
        letter(ax, name, rf"$q_0={setting.studies[name].model['q0']}$")


def views(figure: Figure, setting: FigureSettings, data: Mapping[str, xr.Dataset]) -> None:
    """Two motions in two columns; rows: time history, spectrum, phase trajectory, portrait."""
    figure.set_size_inches(WIDTH, 9.4)
    axes = figure.subplots(4, 2, height_ratios=(0.8, 0.9, 1.15, 1.15))
    for column, name in enumerate(("a", "b")):
        ds = data[name]
        plot.history(ds, "x1_dot", axes[0, column], periods=_HISTORY_PERIODS)
        plot.spectrum(ds, "x1_dot", axes[1, column])
        plot.phase(_first_part(ds), "x1", ax=axes[2, column], section=False, linewidth=_THIN_LINE_WIDTH)
        plot.portrait(data[f"{name}_section"], "x1", ax=axes[3, column])
        letter(axes[0, column], name, rf"$\varepsilon_1={setting.studies[name].model['eps1']}$")
    for row in axes:  # with the same vertical limits, so that the motions can be compared
        limits = [ax.get_ylim() for ax in row]
        for ax in row:
            ax.set_ylim(min(low for low, _ in limits), max(high for _, high in limits))


def trajectories_and_portraits(figure: Figure, setting: FigureSettings, data: Mapping[str, xr.Dataset]) -> None:
    """One row per motion: phase trajectory at left, portrait at right."""
    figure.set_size_inches(WIDTH, 6.0)
    axes = figure.subplots(2, 2)
    for row, name in enumerate(("a", "b")):
        plot.phase(_first_part(data[name]), "x1", ax=axes[row, 0], section=False, linewidth=_THIN_LINE_WIDTH)
        plot.portrait(data[f"{name}_section"], "x1", ax=axes[row, 1])
        letter(axes[row, 0], name, rf"$\varepsilon_1={setting.studies[name].model['eps1']}$, phase trajectory")
        letter(axes[row, 1], name, "stroboscopic portrait")


def _first_part(ds: xr.Dataset) -> xr.Dataset:
    """The first `_TRAJECTORY_PERIODS` of a motion; all of a long one would fill the plane."""
    samples = ds.sizes["tau"] // ds.sizes["period"]
    return ds.isel(tau=slice(0, _TRAJECTORY_PERIODS * samples))


LAYOUTS: dict[str, Callable[[Figure, FigureSettings, Mapping[str, xr.Dataset]], None]] = {
    layout.__name__: layout for layout in (system, maps, basins, bifurcations, bifurcation_and_exponent, coexisting,
                                           portraits, views, trajectories_and_portraits)
}
"""A layout draws on an empty figure; add one here and name it in `settings.toml`."""


def draw(setting: FigureSettings, data: Mapping[str, xr.Dataset], dpi: int = 300) -> bytes:
    """The figure as PNG, 7.2 inches wide, from the Datasets by the names of its studies."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(layout="constrained", dpi=dpi)
        LAYOUTS[setting.layout](figure, setting, data)
        FigureCanvasAgg(figure)
        layout, buffer = figure.get_layout_engine(), BytesIO()
        assert layout is not None
        layout.execute(figure)  # a second pass beside that of savefig: sizes of Axes and tick labels depend on another
        figure.savefig(
            buffer, format="png", dpi=dpi, facecolor="white", metadata={"Software": "gearchaos"},
            pil_kwargs={"compress_level": 3},  # faster than the default 6, and smaller files for these pictures
        )
        return buffer.getvalue()


def findings(cache: ComputationCache, figure: FigureSettings, data: Mapping[str, xr.Dataset]) -> list[str]:
    """The sentences about a figure: one text for each of its panels whose kind of study is in `_SENTENCES`."""
    if figure.layout == "coexisting":
        parts = [
            f"{key.split('_')[0]} (reached from {percent(ds.attrs['share_of_starts'])} of the initial states, "
            f"smallest stroboscopic z {ds['section_z'].values.min():.4f})" for key, ds in data.items()]
        return [f"{len(parts)} of the motions shown were found: {', '.join(parts)}."]
    panels = [(name, study) for name, study in figure.studies.items() if study.kind in _SENTENCES]
    return [(f"({name[0]}) " if len(panels) > 1 else "") + _SENTENCES[study.kind](cache, study, data[name])
            for name, study in panels]


def percent(share: float) -> str:
    """A share in percent with one digit after the point below 10 %."""
    return f"{100 * share:.0f} %" if share >= 0.1 else f"{100 * share:.1f} %" if share >= 0.001 else "below 0.1 %"


def shares(ds: xr.Dataset) -> str:
    """The shares of the classes of motion, largest first."""
    counts = np.bincount(plot.motion_class(ds["label"], ds["period"]).ravel(), minlength=len(plot.MOTION_CLASSES))
    order = [i for i in np.argsort(-counts) if counts[i]]
    return ", ".join(f"{plot.MOTION_CLASSES[i].name} {percent(counts[i] / counts.sum())}" for i in order)


def _zones(cache: ComputationCache, study: FigureStudy, ds: xr.Dataset) -> str:
    v_rms = ds["v_rms"].values
    y, x = (int(i) for i in np.unravel_index(np.nanargmax(v_rms), v_rms.shape))
    (x_name, y_name) = study.axes
    where = f"{symbol(x_name)} = {float(ds[x_name][x]):.3g}, {symbol(y_name)} = {float(ds[y_name][y]):.3g}"
    separated = float((ds["contact"].values > 0).mean())
    kinds, locking = plot.motion_class(ds["label"], ds["period"]), ""
    if (tori := kinds == _TORUS).any():  # the share of cells next to them that are periodic with a high order
        beside = binary_dilation(tori, np.ones((3, 3))) & ~tori
        locked = beside & (kinds == _HIGHER)
        longest = int(ds["period"].values[locked].max(initial=0))
        share = percent(locked.sum() / beside.sum())
        locking = (f" Of the {beside.sum()} cells beside quasi-periodic ones {share} are "
                   f"locked at a higher order{f', on orbits of up to {longest}T' if longest else ''}.")
    return (
        f"Shares of the {ds.sizes[x_name]} × {ds.sizes[y_name]} cells: {shares(ds)}. V_RMS runs from "
        f"{np.nanmin(v_rms):.3g} to {np.nanmax(v_rms):.3g} (at {where}), its median is {np.nanmedian(v_rms):.3g}. "
        f"Teeth lose contact in {percent(separated)} of the cells.{locking}"
    )


def _basins(cache: ComputationCache, study: FigureStudy, ds: xr.Dataset) -> str:
    shared = zip(plot.attractor_names(ds), ds["attractor_fraction"].values, strict=True)
    parts = [f"{name} {percent(float(share))}" for name, share in shared]
    return f"{ds['attractor'].size} initial states lead to {len(parts)} attractors: {', '.join(parts)}."


def _bifurcation(cache: ComputationCache, study: FigureStudy, ds: xr.Dataset) -> str:
    (axis,) = study.axes
    chaotic = plot.motion_class(ds["label"], ds["period"]) == _CHAOTIC
    values, first = ds[axis].values[chaotic], int(np.argmax(chaotic))
    text = f"Shares of the {ds.sizes[axis]} columns: {shares(ds)}."
    if values.size:
        text += (
            f" Chaos occurs between {symbol(axis)} = {values[0]:.4g} and {values[-1]:.4g}, with exponents up to "
            f"{float(ds['lyapunov'].max()):.3f}."
        )
    if values.size and first > 0:
        before, after = ds.isel({axis: first - 1}), ds.isel({axis: first})
        (name,) = motions(before["label"], before["period"])
        text += (
            f" Going up, it first sets in between {float(before[axis]):.5g} ({name}, largest exponent "
            f"{float(before['lyapunov']):+.4f}) and {float(after[axis]):.5g} ({float(after['lyapunov']):+.4f})."
        )
    return f"{text} {spectral_comparison(ds, axis)}"


_COLUMNS_COMPARED, _COLUMNS_LISTED = 120, 4
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
    [c.name for c in plot.MOTION_CLASSES].index(n) for n in ("chaotic", "quasi-periodic", "other sub-harmonic")
)


def _point(cache: ComputationCache, study: FigureStudy, ds: xr.Dataset) -> str:
    found = cache.regime(**study.model)
    (low, high), value = found.lyapunov_ci[0], found.lyapunov[0]
    interval = f" (99 % interval {low:.4f} to {high:.4f})" if high > low else ""
    return f"{found.label}, largest exponent {value:.4f}{interval}, V_RMS {found.v_rms:.4f}."


_SENTENCES: dict[str, Callable[[ComputationCache, FigureStudy, xr.Dataset], str]] = {
    "zones": _zones, "basins": _basins, "bifurcation": _bifurcation, "portrait": _point,
}
