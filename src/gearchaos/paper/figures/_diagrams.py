"""Figures along one parameter: bifurcation diagrams, and the Lyapunov exponent below one."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from gearchaos import plot
from gearchaos.paper.figures._style import WIDTH
from gearchaos.paper.settings import FigureSettings


def bifurcations(figure: Figure, setting: FigureSettings, data: Mapping[str, xr.Dataset]) -> None:
    """Diagrams one below the other, each with its strip of verdicts."""
    figure.set_size_inches(WIDTH, 3.5 * len(data) + 0.3)
    column = figure.subplots(len(data), 1, squeeze=False)[:, 0]
    for ax, (name, ds) in zip(column, data.items(), strict=True):
        plot.bifurcation(ds, "x1", ax)
        if len(data) > 1:
            _letter_inside(ax, name, _point(setting.studies[name].model))


def bifurcation_and_exponent(figure: Figure, setting: FigureSettings, data: Mapping[str, xr.Dataset]) -> None:
    """(a) the diagram, (b) the largest exponent over the same axis."""
    figure.set_size_inches(WIDTH, 6.0)
    top, bottom = figure.subplots(2, 1, sharex=True, height_ratios=(1.5, 1))
    plot.bifurcation(data["a"], "x1", top)
    plot.lyapunov(data["a"], bottom)
    top.set_xlabel("")
    _letter_inside(top, "a")
    _letter_inside(bottom, "b")


def _point(model: Mapping) -> str:
    return rf"$\kappa={model['kappa']}$, $\omega={model['omega']}$"


def _letter_inside(ax, name: str, text: str = "") -> None:
    """Write the letter of a panel inside the Axes, if there are a strip and a legend above it."""
    label = f"({name})" + (f"  {text}" if text else "")
    ax.text(0.012, 0.97, label, transform=ax.transAxes, ha="left", va="top",
            bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.5})
