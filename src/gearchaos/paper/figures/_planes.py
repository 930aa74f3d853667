"""Figures over a plane: zones beside V_RMS, which the paper calls the quality index, and basins of attraction."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from gearchaos import plot
from gearchaos.paper.figures._style import WIDTH, letter
from gearchaos.paper.settings import FigureSettings


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
