"""Branches of periodic orbits over their parameter: stroboscopic points, and the response with events and jumps."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from gearchaos.errors import unknown_name
from gearchaos.plot._axes import axis_label, new_axes
from gearchaos.plot._checks import check, check_name
from gearchaos.plot._data import keeps_data
from gearchaos.plot._legends import legend as draw_legend
from gearchaos.plot._motions import first_coordinate
from gearchaos.plot._theme import BACKGROUND, EVENT_COLOURS, INK, STROBE, adapt, adapt_style, event_words
from gearchaos.studies.branch_lines import axis_of, line_nodes, line_parts, positions

_STABLE: dict[str, Any] = {"linestyle": "-", "linewidth": 1.5}
_UNSTABLE: dict[str, Any] = {"linestyle": (0, (4, 2.5)), "linewidth": 1.0}


def check_branch(ds: xr.Dataset) -> None:
    """Raise `InputError` unless a Dataset is a result of `gearchaos.branch`."""
    points = dict.fromkeys(("branch", "unstable"), ("point",))
    events = dict.fromkeys(("event_value", "event_kind", "event_point", "event_branch"), ("event",))
    check(ds, "branch", **points, **events)


def draw_lines(ds: xr.Dataset, ax: Axes, y: np.ndarray, at_events: np.ndarray) -> None:
    """Draw values along all branches, stable parts solid and unstable ones dashed.

    Points that are no neighbours on their branch, because others were left out, are not connected.

    Parameters
    ----------
    y : (P,) or (P, N)
        Values at the points: one line, or N lines.
    at_events : (E,) or (E, N)
        The values at the events, which are points of the lines, too.
    """
    nodes = line_nodes(ds)
    x = np.concatenate([ds[axis_of(ds)].values, ds["event_value"].values])[nodes.order]
    values = np.concatenate([y, at_events])[nodes.order]
    for first, end, is_stable in line_parts(nodes):
        if end - first > 1:
            ax.plot(x[first:end], values[first:end],
                    color=adapt(INK), zorder=2, **(_STABLE if is_stable else _UNSTABLE))


def stability_handles(ds: xr.Dataset) -> list[Line2D]:
    """Legend handles of the lines that occur."""
    stable = ds["unstable"].values == 0
    lines = [(stable.any(), _STABLE, "stable"), ((~stable).any(), _UNSTABLE, "unstable")]
    return [Line2D([], [], color=adapt(INK), label=name, **style) for occurs, style, name in lines if occurs]


@keeps_data
def branch(ds: xr.Dataset, name: str | None = None, ax: Axes | None = None, *, legend: bool = True) -> Axes:
    """Draw the stroboscopic points of a branch: n lines for orbits of period n, solid if stable, dashed if not.

    In an Axes that `bifurcation` has drawn, the lines lie over the diagram, whose limits are kept.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.branch`: ``section_<name>`` with dims (point, cycle).
    name : str
        Coordinate to show; x1, or z of a single model, if left out.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    legend : bool
        Add a legend of the lines, unless the Axes has a diagram.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.branch`, or has no coordinate ``name``.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> ax = gc.plot.branch(gc.branch(model, "omega=0.5:0.9"), "z")
    >>> ax.get_ylabel()
    'displacement $z$'
    """
    check_branch(ds)
    name = name or first_coordinate(ds)
    check_name(ds, "name", name, ("point", "cycle"), "section_")
    ax, section, axis = new_axes(ax), ds[f"section_{name}"], axis_of(ds)
    over_diagram = bool(ax.images)
    limits = ax.get_xlim(), ax.get_ylim()
    draw_lines(ds, ax, section.values, _at_events(ds, name))
    if over_diagram:
        ax.set(xlim=limits[0], ylim=limits[1])
        return ax
    ax.set(xlabel=axis_label(ds[axis], axis), ylabel=axis_label(section, name, beside=ds[axis]))
    if legend:
        draw_legend(ax, stability_handles(ds))
    return ax


def _at_events(ds: xr.Dataset, name: str) -> np.ndarray:
    """The stroboscopic points of the orbits at events, (E, n).

    A result has the first one of each; the others are interpolated between the points before and after the event, at
    the share of the step at which the first one is.
    """
    section, first = ds[f"section_{name}"].values, ds[f"event_section_{name}"].values
    row = {position: i for i, position in enumerate(positions(ds).tolist())}
    out = np.full((len(first), section.shape[1]), np.nan)
    for i, before in enumerate(ds["event_point"].values.tolist()):
        ends = [section[row[position]] for position in (before, before + 1) if position in row]
        if ends:
            a, b = ends[0], ends[-1]
            step = b[0] - a[0]
            out[i] = a + (np.clip((first[i] - a[0]) / step, 0, 1) * (b - a) if step else 0)
            out[i, 0] = first[i]
    return out


_EVENTS: dict[str, dict[str, Any]] = {
    "fold": {"marker": "o", "color": EVENT_COLOURS["fold"]},
    "flip": {"marker": "s", "color": EVENT_COLOURS["flip"]},
    "neimark-sacker": {"marker": "^", "color": EVENT_COLOURS["neimark-sacker"]},
    "pitchfork": {"marker": "D", "color": EVENT_COLOURS["pitchfork"]},
    "neutral-saddle": {"marker": "x", "color": EVENT_COLOURS["neutral-saddle"]},
    "graze": {"marker": "|", "color": EVENT_COLOURS["graze"], "markersize": 8, "markeredgewidth": 1.4},
}
"""How each kind of event is marked; a graze is no bifurcation in general, and is marked by a stroke."""

_OTHER: dict[str, Any] = {"marker": "*", "color": "0.2"}
"""How the events of a user's function are marked."""

_JUMP: dict[str, Any] = {"arrowstyle": "-|>", "color": STROBE, "linewidth": 1.1, "shrinkA": 2, "shrinkB": 1,
                         "mutation_scale": 10}


@keeps_data
def backbone(ds: xr.Dataset, y: str = "z_peak_to_peak", ax: Axes | None = None, *, legend: bool = True) -> Axes:
    r"""Draw the response along a branch of periodic orbits: stable parts solid, unstable ones dashed.

    Every kind of event has a marker of its own. Where a fold ends a stable part, a slow change of the parameter makes
    the motion jump: an arrow leads to the orbit that the motion reaches, if it is one of the branches. Where
    points have been left out of the Dataset, the lines have gaps.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.branch`.
    y : str
        The variable to show: a response measure, ``z_max`` or ``z_min``.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    legend : bool
        Add a legend of the lines, the events and the jumps.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not a branch, or has no variable of this name along its points and events.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> ax = gc.plot.backbone(gc.branch(model, "omega=0.5:0.9"))
    >>> ax.get_xlabel()
    'frequency $\\omega$'
    """
    check_branch(ds)
    names = [str(n)[6:] for n in ds.data_vars if str(n).startswith("event_") and ds[n].dims == ("event",)]
    known = [n for n in names if n in ds and ds[n].dims == ("point",) and ds[n].dtype.kind == "f"]
    if y not in known:
        raise unknown_name("y", str(y), known)
    ax, axis = new_axes(ax), axis_of(ds)
    draw_lines(ds, ax, ds[y].values, ds[f"event_{y}"].values)
    found = _mark_events(ds, ax, y)
    jumps = _jumps(ds, y)
    for value, start, end in jumps:
        ax.annotate("", (value, end), (value, start), arrowprops=adapt_style(_JUMP), zorder=3)
    ax.set(xlabel=axis_label(ds[axis], axis), ylabel=axis_label(ds[y], y, beside=ds[axis]))
    ax.margins(0.03, 0.06)
    if legend:
        jump = Line2D([], [], color=adapt(STROBE), marker=">", markersize=5, linewidth=1.1, label="jump")
        draw_legend(ax, [*stability_handles(ds), *found, *([jump] if jumps else [])])
    return ax


def _mark_events(ds: xr.Dataset, ax: Axes, y: str) -> list[Line2D]:
    """Mark the events, and return the legend handles of the kinds that occur."""
    kinds, handles = ds["event_kind"].values, []
    for kind in [*(k for k in _EVENTS if k in kinds), *(k for k in dict.fromkeys(kinds) if k not in _EVENTS)]:
        own = kinds == kind
        style = {"markersize": 5, "markeredgewidth": 1.2, "markerfacecolor": BACKGROUND, **_EVENTS.get(kind, _OTHER)}
        (line,) = ax.plot(ds["event_value"].values[own], ds[f"event_{y}"].values[own], linestyle="none", zorder=4,
                          label=event_words(kind), **adapt_style(style))
        handles.append(line)
    return handles


def _jumps(ds: xr.Dataset, y: str) -> list[tuple[float, float, float]]:
    """The parameter, and the response before and after, of the jumps that lead to an orbit of the branches."""
    if "jump_value" not in ds:
        return []
    row = {position: i for i, position in enumerate(positions(ds).tolist())}
    x, found = ds[axis_of(ds)].values, []
    for value, after in zip(ds["jump_value"].values.tolist(), ds["jump_point"].values.tolist(), strict=True):
        (events,) = np.nonzero((ds["event_value"].values == value) & (ds["event_kind"].values == "fold"))
        if len(events) and after in row and after + 1 in row:
            ends = [row[after], row[after + 1]]
            share = (value - x[ends[0]]) / (x[ends[1]] - x[ends[0]])
            low, high = ds[y].values[ends]
            found.append((value, float(ds[f"event_{y}"][events[0]]), float(low + share * (high - low))))
    return found
