"""The response of a branch of periodic orbits over its parameter, with its events and jumps."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from gearchaos.errors import unknown_name
from gearchaos.plot._axes import axis_label, new_axes
from gearchaos.plot._branch_lines import check_branch, draw_lines, stability_handles
from gearchaos.plot._data import keeps_data
from gearchaos.plot._events import EVENT_COLOURS, event_words
from gearchaos.plot._legends import legend as draw_legend
from gearchaos.plot._theme import BACKGROUND, STROBE, adapt, adapt_style
from gearchaos.studies.branch_lines import axis_of, positions

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
    jumps = [_arrow(ax, *jump) for jump in _jumps(ds, y)]
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


def _arrow(ax: Axes, value: float, start: float, end: float) -> Any:
    """Draw the arrow of a jump."""
    return ax.annotate("", (value, end), (value, start), arrowprops=adapt_style(_JUMP), zorder=3)
