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
from gearchaos.plot._data import keeps_data
from gearchaos.plot._legends import side_legend
from gearchaos.plot._theme import (
    EVENT_COLOURS,
    INK,
    SPECIAL_MARKERS,
    adapt,
    adapt_style,
    event_words,
    legend_style,
    style_on,
)

_KINDS = ("fold", "flip", "neimark-sacker", "graze")
"""The kinds of events that have curves, in the order of the legend."""

_DOTTED = (0, (1, 1.6))
"""Line style of grazes, which are no bifurcations in general."""

_PERIODS: dict[int, dict[str, Any]] = {
    1: {"linewidth": 1.9, "linestyle": "-"}, 2: {"linewidth": 1.6, "linestyle": (0, (4, 1.8))},
    3: {"linewidth": 1.4, "linestyle": (0, (5, 1.2, 1, 1.2))}, 4: {"linewidth": 1.3, "linestyle": (0, (2, 1))},
}
"""Width, in points, and style of the curves by the period of the orbit."""

_LONGER: dict[str, Any] = {"linewidth": 0.7, "linestyle": "-"}
"""Those of longer periods."""

_SPECIAL: dict[str, Any] = {
    "linestyle": "none", "markersize": 5, "markerfacecolor": "white", "markeredgewidth": 0.9, "color": INK, "zorder": 5,
}


@keeps_data
def skeleton(
    ds: xr.Dataset, ax: Axes | None = None, *, grazes: bool = True, special: bool = False, legend: bool = True
) -> Axes:
    r"""Draw the curves of a skeleton, or a single curve, in the plane of their parameters.

    The kinds of events have different colours; grazes are dotted. The width decreases with the period of the orbit, and
    the curves of 2T, 3T and 4T orbits are dashed. In an Axes that has a map, the limits are kept.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.skeleton` or `gearchaos.curve`.
    ax : Axes, optional
        Where to draw, e.g. over a map of `zones` with the same parameters; a new figure if left out.
    grazes : bool
        Draw the curves on which orbits touch a boundary of contact.
    special : bool
        Mark the points of codimension 2, each kind by a marker of its own.
    legend : bool
        Add a legend of kinds and periods to the right of the Axes.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.skeleton` or `gearchaos.curve`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", q0=0.1, eps1=0.05)
    >>> folds = gc.curve(model, "fold", "omega=0.5:1.2", "eps1=0.04:0.06", period=1)
    >>> ax = gc.plot.skeleton(folds)
    >>> ax.get_xlabel()
    'frequency $\\omega$'
    """
    single = getattr(ds, "attrs", {}).get("study") == "curve"
    ds = _as_skeleton(ds) if single else ds
    check(ds, "skeleton", curve=("point",), curve_kind=("number",), curve_period=("number",), special_kind=("special",))
    over_map = ax is not None and bool(ax.images)
    ax = new_axes(ax)
    x, y = _parameters(ds)
    shown = [i for i, kind in enumerate(ds["curve_kind"].values) if grazes or kind != "graze"]
    for number in shown:
        _draw(ds, ax, number, x, y, over_map)
    markers = _mark_special(ds, ax, shown, x, y, over_map) if special else []
    if not over_map:
        ax.set(xlabel=axis_label(ds[x], x), ylabel=axis_label(ds[y], y))
        _limit(ds, ax, x, y)
    if legend and shown:
        side_legend(ax, [*_handles(ds, shown, over_map), *markers])
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


def _draw(ds: xr.Dataset, ax: Axes, number: int, x: str, y: str, over_map: bool) -> None:
    """Draw one curve with an outline, by which it can be seen on every colour."""
    own = np.flatnonzero(ds["curve"].values == number)
    if ds["curve_closed"].values[number]:
        own = np.append(own, own[0])
    kind, period = str(ds["curve_kind"].values[number]), int(ds["curve_period"].values[number])
    style, around = style_on(over_map, _style(kind, period)), "white" if over_map else adapt("white")
    outline = [] if kind == "graze" else [withStroke(linewidth=style["linewidth"] + 1.0, foreground=around, alpha=0.6)]
    ax.plot(ds[x].values[own], ds[y].values[own], zorder=3 if kind == "graze" else 4, path_effects=outline or None,
            **style)


def _style(kind: str, period: int) -> dict[str, Any]:
    """How the curves of a kind of event and a period are drawn."""
    style = {"color": EVENT_COLOURS.get(kind, "0.2"), **_PERIODS.get(period, _LONGER)}
    return {**style, "linestyle": _DOTTED} if kind == "graze" else style


def _mark_special(
    ds: xr.Dataset, ax: Axes, shown: list[int], x: str, y: str, over_map: bool
) -> list[Line2D]:
    """Mark the points of codimension 2 of the curves shown, and return the legend handles of the kinds that occur."""
    kinds, handles = np.where(np.isin(ds["special_curve"].values, shown), ds["special_kind"].values, ""), []
    for kind, marker in SPECIAL_MARKERS.items():
        if (own := kinds == kind).any():
            handles += ax.plot(ds[f"special_{x}"].values[own], ds[f"special_{y}"].values[own], marker=marker,
                               label=kind.replace("neimark-sacker", event_words("neimark-sacker")),
                               **style_on(over_map, _SPECIAL))
    return handles


def _handles(ds: xr.Dataset, shown: list[int], over_map: bool) -> list[Line2D]:
    """Legend handles of the kinds and periods that occur."""
    kinds = {str(kind) for kind in ds["curve_kind"].values[shown]}
    handles = [Line2D([], [], label=event_words(kind), **legend_style(over_map, _style(kind, 1)))
               for kind in _KINDS if kind in kinds]
    for period in np.unique(ds["curve_period"].values[shown]).tolist():
        handles.append(Line2D([], [], label=f"{period}T", **adapt_style({**_style("", period), "color": "0.35"})))
    return handles
