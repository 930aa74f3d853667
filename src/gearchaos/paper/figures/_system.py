"""Figure 1: the schematic and the characteristics."""

from __future__ import annotations

from collections.abc import Mapping

import xarray as xr
from matplotlib.figure import Figure

from gearchaos import plot
from gearchaos.paper.figures._style import WIDTH, letter
from gearchaos.paper.settings import FigureSettings


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
