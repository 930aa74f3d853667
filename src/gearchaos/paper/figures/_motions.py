"""Figures of single motions: coexisting orbits, portraits, and one motion seen four ways."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from gearchaos import plot
from gearchaos.paper.figures._style import WIDTH, letter
from gearchaos.paper.settings import FigureSettings

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
    for row in axes:
        _share_limits(row)


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


def _share_limits(axes) -> None:
    """Give all Axes the same vertical limits, so that they can be compared."""
    low = min(ax.get_ylim()[0] for ax in axes)
    high = max(ax.get_ylim()[1] for ax in axes)
    for ax in axes:
        ax.set_ylim(low, high)
