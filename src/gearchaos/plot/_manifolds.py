"""Stable and unstable manifolds of saddles, alone or over basins of attraction."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D

from gearchaos.gears.results import unit_in
from gearchaos.plot._axes import axis_label, new_axes
from gearchaos.plot._checks import check
from gearchaos.plot._legends import side_legend

_STABLE: dict[str, Any] = {"color": "black", "linewidth": 0.5}
_UNSTABLE: dict[str, Any] = {"color": "#c8102e", "linewidth": 0.5}
_SADDLE: dict[str, Any] = {
    "linestyle": "none", "marker": "X", "markersize": 6, "color": "#ffd21f", "markeredgecolor": "black",
    "markeredgewidth": 0.7,
}


def manifolds(
    ds: xr.Dataset, ax: Axes | None = None, *, stable: bool = True, unstable: bool = True, legend: bool = True
) -> Axes:
    """Draw the manifolds of saddles in the plane of z and z_dot.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.manifolds`.
    ax : Axes, optional
        Where to draw, e.g. over the `basins` of the same model; a new figure if left out. In an Axes that has a map,
        the limits are kept.
    stable, unstable : bool
        Draw these manifolds.
    legend : bool
        Add a legend to the right of the Axes.

    Returns
    -------
    Axes
    """
    check(ds, "manifolds", z=("point",), z_dot=("point",), manifold=("point",), manifold_stable=("number",))
    over_map = ax is not None and bool(ax.images)
    ax = new_axes(ax)
    handles = []
    for wanted, is_stable, style in ((stable, True, _STABLE), (unstable, False, _UNSTABLE)):
        if wanted:
            ax.add_collection(LineCollection(_lines(ds, is_stable), zorder=3, **style), autolim=not over_map)
            label = "stable manifold" if is_stable else "unstable manifold"
            handles.append(Line2D([], [], label=label, **{**style, "linewidth": 1.2}))
    ax.plot(ds["saddle_section_z"].values.ravel(), ds["saddle_section_z_dot"].values.ravel(), zorder=6, **_SADDLE)
    handles.append(Line2D([], [], label="saddle", **_SADDLE))
    if not over_map:
        ax.set(xlabel=axis_label(ds["z"], "z"), ylabel=axis_label(ds["z_dot"], "z_dot"))
        _limit(ds, ax)
    if legend:
        side_legend(ax, handles)
    return ax


def _lines(ds: xr.Dataset, stable: bool) -> list[np.ndarray]:
    """The branches of the stable or the unstable manifolds, each (P, 2)."""
    points = np.column_stack([ds["z"].values, ds["z_dot"].values])
    ends = np.flatnonzero(np.diff(ds["manifold"].values)) + 1
    chosen = ds["manifold_stable"].values == stable
    return [part for part, kept in zip(np.split(points, ends), chosen, strict=True) if kept] if len(points) else []


def _limit(ds: xr.Dataset, ax: Axes) -> None:
    """Limit the Axes to the region in which the manifolds were followed."""
    region = json.loads(ds.attrs["settings"])["region"]
    for name, ends, limit in (("z", region[0], ax.set_xlim), ("z_dot", region[1], ax.set_ylim)):
        limit(*(end * unit_in(ds, name) for end in ends))
