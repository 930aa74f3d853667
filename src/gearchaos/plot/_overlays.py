"""Curves in a plane of two parameters, alone or over a map: events, ends of periodic motions, loss of contact."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D

from gearchaos.continuation.events import KINDS
from gearchaos.errors import InputError
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.operation.results import unit_in
from gearchaos.gears.operation.separation import separation_margin
from gearchaos.plot._datasets import check, check_design, flags, keeps_data
from gearchaos.plot.axes import Overlay, cell_extent, side_legend, width_in_inches, wrapped
from gearchaos.plot.theme import EVENT_COLOURS, INK, SPECIAL_MARKERS, adapt_style, event_words
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.core.operating_ranges import operating_axis
from gearchaos.studies.core.options import RANGE

_DOTTED = (0, (1, 1.6))  # line style of grazes, which are no bifurcations in general
_PERIODS: dict[int, dict[str, Any]] = {
    1: {"linewidth": 1.9, "linestyle": "-"}, 2: {"linewidth": 1.6, "linestyle": (0, (4, 1.8))},
    3: {"linewidth": 1.4, "linestyle": (0, (5, 1.2, 1, 1.2))}, 4: {"linewidth": 1.3, "linestyle": (0, (2, 1))},
}
"""Width, in points, and style of the curves by the period of the orbit."""

_LONGER: dict[str, Any] = {"linewidth": 0.7, "linestyle": "-"}  # those of longer periods
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
    if getattr(ds, "attrs", {}).get("study") == "curve":
        # a single curve is a skeleton of one curve
        kind, period, closed = ds.attrs.get("event", ""), ds.attrs.get("period", 0), ds.attrs.get("closed") == "true"
        zeros = {dim: np.zeros(ds.sizes.get(dim, 0), int) for dim in ("point", "special")}
        ds = ds.assign(
            curve=("point", zeros["point"]), special_curve=("special", zeros["special"]),
            curve_kind=("number", np.array([kind], dtype=object)), curve_period=("number", np.array([period], int)),
            curve_closed=("number", np.array([closed])))
    check(ds, "skeleton", curve=("point",), curve_kind=("number",), curve_period=("number",), special_kind=("special",))
    over, settings = Overlay(ax), json.loads(ds.attrs["settings"])
    x, y = settings["x"][0], settings["y"][0]
    kinds, periods = (ds[f"curve_{name}"].values for name in ("kind", "period"))
    shown = [i for i, kind in enumerate(kinds) if grazes or kind != "graze"]
    for number in shown:
        own = np.flatnonzero(ds["curve"].values == number)
        if ds["curve_closed"].values[number]:
            own = np.append(own, own[0])
        style, graze = over.style(_style(str(kinds[number]), int(periods[number]))), kinds[number] == "graze"
        over.ax.plot(ds[x].values[own], ds[y].values[own], zorder=3 if graze else 4,
                     path_effects=None if graze else [over.outline(style["linewidth"] + 1.0, alpha=0.6)], **style)
    markers: list[Line2D] = []
    marked = np.where(np.isin(ds["special_curve"].values, shown), ds["special_kind"].values, "") if special else None
    for kind, marker in SPECIAL_MARKERS.items():
        if marked is not None and (own := marked == kind).any():
            markers += over.ax.plot(ds[f"special_{x}"].values[own], ds[f"special_{y}"].values[own], marker=marker,
                                    label=kind.replace("neimark-sacker", event_words("neimark-sacker")),
                                    **over.style(_SPECIAL))
    over.frame({name: ds[name] for name in (x, y)},
               [[end * unit_in(ds, name) for end in settings[key][1:3]] for name, key in ((x, "x"), (y, "y"))])
    if legend and shown:
        found = {str(kind) for kind in kinds[shown]}
        lines = [over.handle(event_words(kind), _style(kind, 1)) for kind in KINDS if kind in found]
        lines += [Line2D([], [], label=f"{period}T", **adapt_style({**_style("", period), "color": "0.35"}))
                  for period in np.unique(periods[shown]).tolist()]
        side_legend(over.ax, [*lines, *markers])
    return over.ax


def _style(kind: str, period: int) -> dict[str, Any]:
    """How the curves of a kind of event and a period are drawn."""
    style = {"color": EVENT_COLOURS.get(kind, "0.2"), **_PERIODS.get(period, _LONGER)}
    return {**style, "linestyle": _DOTTED} if kind in KINDS and not KINDS[kind].changes else style


_CAUSES: dict[str, dict[str, Any]] = {
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
    over, settings = Overlay(ax), json.loads(ds.attrs["settings"])
    axes = [(name, *(end * unit_in(ds, name) for end in (low, high)), count)
            for name, low, high, count in (settings["x"], settings["y"])]
    cell, beyond = (np.column_stack([ds[f"{prefix}_{name}"].values for name, *_ in axes])
                    for prefix in ("cell", "neighbour"))
    size = np.array([(high - low) / (count - 1) for _, low, high, count in axes])
    step = np.round((beyond - cell) / size)
    middle, along = cell + step * size * (0.5 - _INWARDS), step[:, ::-1] * size * 0.5
    lines, handles = np.stack([middle - along, middle + along], axis=1), []  # lines (S, 2, 2) along the sides
    for code, name in flags(ds["cause"]).items():
        own = ds["cause"].values == code
        if own.any():
            style = over.style(_CAUSES[name])
            style["path_effects"] = [over.outline(style["linewidth"] + 1.0)]
            over.ax.add_collection(LineCollection(lines[own], zorder=5, **style), autolim=False)
            handles.append(over.handle(f"{name.replace('_', ' ')} ({own.sum()})", _CAUSES[name]))
    extent = cell_extent(*(np.linspace(low, high, count) for _, low, high, count in axes))
    over.frame({name: ds[f"cell_{name}"] for name, *_ in axes}, [extent[:2], extent[2:]])
    if legend:
        side_legend(over.ax, handles)
    return over.ax


_SPEEDS, _TORQUES = 801, 121  # points of the grid on which the line is found
_LEAST_TORQUE = 1e-4
"""Least torque of the grid, relative to the largest one: with none there is no stiffness by ISO 6336-1."""

_LABEL_WIDTH = 0.8
"""Greatest width of the label of an axis over that of the Axes, which a layout engine may make narrower."""

_NOTE = "line: permanent contact ends, at mean stiffness"


def separation_line(
    design: GearDesign, ax: Axes | None = None, *, speed: Axis | str | None = None, torque: Axis | str | None = None,
    note: bool = True,
) -> Axes:
    """Draw where permanent contact ends at constant mesh stiffness, over speed in rpm and torque in N m of wheel 1.

    Parameters
    ----------
    design : GearDesign
        The gear pair, with transmission error, damping ratio and inertia.
    ax : Axes
        A map over speed and torque, e.g. of `zones` for a result of `gearchaos.operating_map`. It keeps its limits.
    speed, torque : Axis or str, optional
        Ranges in rpm and N m, such as "500:6000:200", of which only the ends matter; by default those of ``ax``.
    note : bool
        Say below the label of the speed what the line is.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the ranges are neither given nor those of ``ax``, or an input that the line needs is missing.

    Notes
    -----
    The line is that of `gearchaos.gears.operation.separation.separation_torque`, with the time mean of the mesh
    stiffness. With varying stiffness it is a first estimate; a motion with impacts may exist above it, too.

    Examples
    --------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(
    ...     teeth=(50, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05,
    ...     transmission_error="from quality", quality={"standard": "ISO 1328-1:1995", "grade": 6})
    >>> ax = gc.plot.separation_line(design, speed="3000:6000:2", torque="20:400:2")
    >>> ax.get_ylabel()
    'torque [N m]'
    """
    check_design(design)
    ends = {}
    for name, given in (("speed", speed), ("torque", torque)):
        if given is not None:
            axis = operating_axis(name, given, count=RANGE)
            ends[name] = axis.start, axis.stop
        elif ax is not None and ax.has_data():
            ends[name] = ax.get_xlim() if name == "speed" else ax.get_ylim()
        else:
            raise InputError(name, "must be given without a map", None, "E.g. 500:6000:200, or ax= with a map.")
    speeds = np.linspace(*ends["speed"], _SPEEDS)
    torques = np.linspace(max(ends["torque"][0], _LEAST_TORQUE * ends["torque"][1]), ends["torque"][1], _TORQUES)
    margin = separation_margin(design, speeds, torques)
    drawn, over = ax is not None and ax.has_data(), Overlay(ax)
    contours = over.ax.contour(speeds, torques, np.clip(margin, -1e3 * torques[-1], None), levels=[0.0])
    contours.remove()  # only its points are of use: a line can have an outline
    style = over.style({"color": INK, "linewidth": 1.5, "path_effects": [over.outline(3.2)]})
    for points in contours.allsegs[0]:
        if len(points) > 1:
            over.ax.plot(*points.T, zorder=5, label="end of permanent contact", **style)
    over.ax.set(xlim=ends["speed"], ylim=ends["torque"])
    if not drawn:
        over.ax.set(xlabel="speed [rpm]", ylabel="torque [N m]")
    if note:
        note_lines = wrapped(_NOTE, _LABEL_WIDTH * width_in_inches(over.ax))
        over.ax.set_xlabel(f"{over.ax.get_xlabel()}\n{note_lines}")
    return over.ax
