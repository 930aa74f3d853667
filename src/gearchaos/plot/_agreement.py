"""The sides of the cells of a map at which periodic motions end, by cause."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from gearchaos.gears.results import unit_in
from gearchaos.plot._axes import axis_label, cell_extent, new_axes
from gearchaos.plot._checks import check, flags
from gearchaos.plot._data import keeps_data
from gearchaos.plot._legends import side_legend
from gearchaos.plot._theme import BACKGROUND, EVENT_COLOURS, adapt, legend_style, style_on

_STYLES: dict[str, dict[str, Any]] = {
    "curve": {"color": EVENT_COLOURS["fold"], "linewidth": 1.4},
    "basin_boundary": {"color": EVENT_COLOURS["flip"], "linewidth": 1.4},
    "unexplained": {"color": "#e6007e", "linewidth": 2.6},
}
"""How the sides of each cause are drawn."""

_INWARDS = 0.12
"""Distance of the line of a side from the side, towards the cell whose motion ends there, in widths of a cell."""


@keeps_data
def agreement(ds: xr.Dataset, ax: Axes | None = None, *, legend: bool = True) -> Axes:
    r"""Draw the sides of cells at which periodic motions end, in colours by cause.

    Each line lies just inside the cell whose motion ends there.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.agreement`.
    ax : Axes, optional
        Where to draw, e.g. over the map of `zones`, whose limits are kept; a new figure if left out.
    legend : bool
        Add a legend of the causes, with the number of sides of each, to the right of the Axes.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.agreement`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model, x, y = gc.MeshModel.of(q0=0.1), "omega=1.7:2.3:8", "eps1=0.03:0.09:4"
    >>> curves = gc.skeleton(model, x, y, period=1, lines=(1, 1), starts=0, workers=1)
    >>> found = gc.agreement(curves, gc.zones(model, "omega=1.7:2.3:12", "eps1=0.03:0.09:8"))
    >>> gc.plot.agreement(found, legend=False).get_ylabel()
    'error amplitude $\\varepsilon_{1}$'
    """
    check(ds, "agreement", cause=("side",))
    over_map = ax is not None and bool(ax.images)
    ax, settings, names = new_axes(ax), json.loads(ds.attrs["settings"]), flags(ds["cause"])
    axes = [(name, *(end * unit_in(ds, name) for end in (low, high)), count)
            for name, low, high, count in (settings["x"], settings["y"])]
    lines, handles = _sides(ds, axes), []
    background = BACKGROUND if over_map else adapt(BACKGROUND)
    for code, name in names.items():
        own = ds["cause"].values == code
        if own.any():
            style = style_on(over_map, _STYLES[name])
            outline = [withStroke(linewidth=style["linewidth"] + 1.0, foreground=background)]
            ax.add_collection(LineCollection(lines[own], zorder=5, path_effects=outline, **style), autolim=False)
            handles.append(Line2D([], [], label=f"{name.replace('_', ' ')} ({own.sum()})",
                                  **legend_style(over_map, _STYLES[name])))
    if not over_map:
        _label(ds, ax, axes)
    if legend:
        side_legend(ax, handles)
    return ax


def _sides(ds: xr.Dataset, axes: list[tuple[str, float, float, int]]) -> np.ndarray:
    """The lines (S, 2, 2) along the sides, with the coordinates x and y of both ends."""
    cell, beyond = (np.column_stack([ds[f"{prefix}_{name}"].values for name, *_ in axes])
                    for prefix in ("cell", "neighbour"))
    size = np.array([(high - low) / (count - 1) for _, low, high, count in axes])
    step = np.round((beyond - cell) / size)
    middle = cell + step * size * (0.5 - _INWARDS)
    along = step[:, ::-1] * size * 0.5
    return np.stack([middle - along, middle + along], axis=1)


def _label(ds: xr.Dataset, ax: Axes, axes: list[tuple[str, float, float, int]]) -> None:
    """Label both axes, and limit them to the cells of the window."""
    (x, *_), (y, *_) = axes
    ax.set(xlabel=axis_label(ds[f"cell_{x}"], x), ylabel=axis_label(ds[f"cell_{y}"], y))
    left, right, bottom, top = cell_extent(*(np.linspace(low, high, count) for _, low, high, count in axes))
    ax.set(xlim=(left, right), ylim=(bottom, top))
