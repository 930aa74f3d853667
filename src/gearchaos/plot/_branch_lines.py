"""What all pictures of branches of periodic orbits share: checks, lines by stability, legend handles."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from gearchaos.plot._checks import check
from gearchaos.plot._theme import INK, adapt
from gearchaos.studies.branch_lines import axis_of, line_nodes, line_parts

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
