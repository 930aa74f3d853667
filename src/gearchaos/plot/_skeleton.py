"""Curves of events in a plane of two parameters, alone or over a map."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from gearchaos.gears.results import unit_in
from gearchaos.plot._axes import axis_label, new_axes
from gearchaos.plot._checks import check
from gearchaos.plot._events import EVENT_COLOURS
from gearchaos.plot._legends import side_legend
from gearchaos.plot._phase import INK

_KINDS: dict[str, dict[str, Any]] = {
    "fold": {"color": EVENT_COLOURS["fold"], "linestyle": "-"},
    "flip": {"color": EVENT_COLOURS["flip"], "linestyle": "-"},
    "neimark-sacker": {"color": EVENT_COLOURS["neimark-sacker"], "linestyle": "-"},
    "graze": {"color": EVENT_COLOURS["graze"], "linestyle": (0, (1, 1.6))},
}
"""How the curves of each kind of event are drawn."""

_WORDS = {"fold": "fold", "flip": "flip", "neimark-sacker": "Neimark–Sacker", "graze": "graze"}

_WIDEST, _NARROWEST = 1.9, 0.6
"""Widths of lines for period 1, and the least one, in points."""

_SPECIAL: dict[str, Any] = {
    "linestyle": "none", "marker": "o", "markersize": 4, "markerfacecolor": "white", "markeredgewidth": 0.9,
    "color": INK, "zorder": 5,
}


def skeleton(
    ds: xr.Dataset, ax: Axes | None = None, *, grazes: bool = True, special: bool = False, legend: bool = True
) -> Axes:
    """Draw the curves of a skeleton, or a single curve, in the plane of their parameters.

    Folds, flips and Neimark-Sacker curves are solid lines of different colours, grazes dotted ones; the width decreases
    with the period of the orbit. In an Axes that has a map, the limits are kept.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.skeleton` or `gearchaos.curve`.
    ax : Axes, optional
        Where to draw, e.g. over a map of `zones` with the same parameters; a new figure if left out.
    grazes : bool
        Draw the curves on which orbits touch a boundary of contact.
    special : bool
        Mark the points of codimension 2.
    legend : bool
        Add a legend of kinds and periods to the right of the Axes.

    Returns
    -------
    Axes
    """
    single = getattr(ds, "attrs", {}).get("study") == "curve"
    ds = _as_skeleton(ds) if single else ds
    check(ds, "skeleton", curve=("point",), curve_kind=("number",), curve_period=("number",), special_kind=("special",))
    over_map = ax is not None and bool(ax.images)
    ax = new_axes(ax)
    x, y = _parameters(ds)
    shown = [i for i, kind in enumerate(ds["curve_kind"].values) if grazes or kind != "graze"]
    for number in shown:
        _draw(ds, ax, number, x, y)
    if special:
        kept = np.isin(ds["special_curve"].values, shown)
        ax.plot(ds[f"special_{x}"].values[kept], ds[f"special_{y}"].values[kept], **_SPECIAL)
    if not over_map:
        ax.set(xlabel=axis_label(ds[x], x), ylabel=axis_label(ds[y], y))
        _limit(ds, ax, x, y)
    if legend and shown:
        side_legend(ax, _handles(ds, shown, special and len(ds["special_kind"]) > 0))
    return ax


def _as_skeleton(ds: xr.Dataset) -> xr.Dataset:
    """A single curve as a skeleton of one curve."""
    kind, period, closed = ds.attrs.get("event", ""), ds.attrs.get("period", 0), ds.attrs.get("closed") == "true"
    zeros = {dim: np.zeros(ds.sizes.get(dim, 0), int) for dim in ("point", "special")}
    return ds.assign(
        curve=("point", zeros["point"]), special_curve=("special", zeros["special"]),
        curve_kind=("number", np.array([kind], dtype=object)), curve_period=("number", np.array([period], int)),
        curve_closed=("number", np.array([closed])))


def _parameters(ds: xr.Dataset) -> tuple[str, str]:
    """The names of the two parameters, x first."""
    settings = json.loads(ds.attrs["settings"])
    return settings["x"][0], settings["y"][0]


def _limit(ds: xr.Dataset, ax: Axes, x: str, y: str) -> None:
    """Limit the Axes to the window in which curves were searched."""
    settings = json.loads(ds.attrs["settings"])
    for name, key, limit in ((x, "x", ax.set_xlim), (y, "y", ax.set_ylim)):
        limit(*(end * unit_in(ds, name) for end in settings[key][1:3]))


def _draw(ds: xr.Dataset, ax: Axes, number: int, x: str, y: str) -> None:
    """Draw one curve with a white outline, by which it can be seen on every colour."""
    own = np.flatnonzero(ds["curve"].values == number)
    if ds["curve_closed"].values[number]:
        own = np.append(own, own[0])
    kind, period = str(ds["curve_kind"].values[number]), int(ds["curve_period"].values[number])
    style = _KINDS.get(kind, {"color": "0.2"})
    outline = [] if kind == "graze" else [withStroke(linewidth=_width(period) + 1.0, foreground="white", alpha=0.6)]
    ax.plot(ds[x].values[own], ds[y].values[own], linewidth=_width(period), zorder=3 if kind == "graze" else 4,
            path_effects=outline or None, **style)


def _width(period: int) -> float:
    """Width of the curves of orbits of this period, in points."""
    return max(_NARROWEST, _WIDEST / period**0.7)


def _handles(ds: xr.Dataset, shown: list[int], special: bool) -> list[Line2D]:
    """Legend handles of the kinds and periods that occur."""
    kinds = {str(kind) for kind in ds["curve_kind"].values[shown]}
    handles = [Line2D([], [], label=words, linewidth=1.5, **_KINDS[kind]) for kind, words in _WORDS.items()
               if kind in kinds]
    if special:
        handles.append(Line2D([], [], label="codimension 2", **_SPECIAL))
    for period in np.unique(ds["curve_period"].values[shown]).tolist():
        handles.append(Line2D([], [], color="0.35", linewidth=_width(period), label=f"{period}T"))
    return handles
