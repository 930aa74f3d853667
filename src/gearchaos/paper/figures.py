"""The figures of the paper: one function per layout, which draws Datasets according to the settings of a figure."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from io import BytesIO
from typing import Any

import matplotlib
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from gearchaos import plot
from gearchaos.paper.settings import FigureSettings

WIDTH = 7.2
"""Width of every figure, in inches."""

STYLE: Any = {
    "font.family": "STIXGeneral",
    "mathtext.fontset": "stix",
    "font.size": 10,
    "axes.labelsize": 10,
    "axes.titlesize": 10,
    "legend.fontsize": 9,
    "xtick.labelsize": 9,
    "ytick.labelsize": 9,
    "axes.linewidth": 0.7,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "xtick.direction": "out",
    "ytick.direction": "out",
    "axes.formatter.limits": (-3, 4),
    "axes.formatter.use_mathtext": True,
    "path.simplify_threshold": 0.5,
}


def letter(ax: Axes, name: str, text: str = "") -> None:
    """The panel's letter and a short text above its upper left corner (above the strip and legend if there are any)."""
    ax.annotate(
        f"({name})" + (f"  {text}" if text else ""), (0, 1), (0, 4), xycoords="axes fraction",
        textcoords="offset points", ha="left", va="bottom", fontsize=10,
    )


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


_HISTORY_PERIODS = 40
"""Mesh periods in a time history."""

_TRAJECTORY_PERIODS = 120
"""Mesh periods in a phase trajectory."""

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


def dossiers(figure: Figure, setting: FigureSettings, data: Mapping[str, xr.Dataset]) -> None:
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


Layout = Callable[[Figure, FigureSettings, Mapping[str, xr.Dataset]], None]
LAYOUTS: dict[str, Layout] = {
    "system": system,
    "maps": maps,
    "basins": basins,
    "bifurcations": bifurcations,
    "bifurcation_and_exponent": bifurcation_and_exponent,
    "coexisting": coexisting,
    "portraits": portraits,
    "dossiers": dossiers,
    "trajectories_and_portraits": trajectories_and_portraits,
}
"""A layout draws on an empty figure; add one here and name it in `settings.toml`."""


def draw(setting: FigureSettings, data: Mapping[str, xr.Dataset], dpi: int = 300) -> bytes:
    """The figure as PNG, 7.2 inches wide, from the Datasets by the names of its studies."""
    with matplotlib.rc_context(STYLE):
        figure = Figure(layout="constrained", dpi=dpi)
        LAYOUTS[setting.layout](figure, setting, data)
        return png(figure, dpi)


def png(figure: Figure, dpi: int) -> bytes:
    """A figure as the bytes of a PNG file."""
    buffer = BytesIO()
    FigureCanvasAgg(figure)
    layout = figure.get_layout_engine()
    assert layout is not None
    layout.execute(figure)  # a second pass beside that of savefig: sizes of Axes and tick labels depend on each other
    figure.savefig(
        buffer, format="png", dpi=dpi, facecolor="white", metadata={"Software": "gearchaos"},
        pil_kwargs={"compress_level": 3},  # faster than the default 6, and smaller files for these pictures
    )
    return buffer.getvalue()
