"""What all pictures of branches of periodic orbits share: checks, lines by stability, legend handles."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from gearchaos.plot._checks import check
from gearchaos.plot._phase import INK

_STABLE: dict[str, Any] = {"linestyle": "-", "linewidth": 1.5}
_UNSTABLE: dict[str, Any] = {"linestyle": (0, (4, 2.5)), "linewidth": 1.0}


_CHANGE_STABILITY = ("fold", "flip", "neimark-sacker", "pitchfork")
"""Kinds of events at which stability may change."""


def check_branch(ds: xr.Dataset) -> None:
    """Raise `InputError` unless a Dataset is a result of `gearchaos.branch`."""
    points = dict.fromkeys(("branch", "unstable"), ("point",))
    events = dict.fromkeys(("event_value", "event_kind", "event_point", "event_branch"), ("event",))
    check(ds, "branch", **points, **events)


def axis_of(ds: xr.Dataset) -> str:
    """The name of the parameter of a branch: the coordinate of its points."""
    return next(str(name) for name, array in ds.coords.items() if array.dims == ("point",))


def draw_lines(ds: xr.Dataset, ax: Axes, y: np.ndarray, at_events: np.ndarray | None = None) -> None:
    """Draw values along all branches, stable parts solid and unstable ones dashed.

    Parameters
    ----------
    y : (P,) or (P, N)
        Values at the points: one line, or N lines.
    at_events : (E,), optional
        The values at the events, which are then points of the lines, too.
    """
    order, stable = line_nodes(ds) if at_events is not None else (np.arange(len(y)), ds["unstable"].values == 0)
    events = np.zeros(0) if at_events is None else at_events
    x = np.concatenate([ds[axis_of(ds)].values, ds["event_value"].values])[order]
    values = np.concatenate([y.reshape(len(y), -1), events.reshape(len(events), -1)] if len(events) else
                            [y.reshape(len(y), -1)])[order]
    branch = np.concatenate([ds["branch"].values, ds["event_branch"].values])[order]
    for first, end, is_stable in line_parts(branch, stable):
        ax.plot(x[first:end], values[first:end], color=INK, zorder=2, **(_STABLE if is_stable else _UNSTABLE))


def line_nodes(ds: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Points and events in order along the branches, by their indices among both, and whether each is stable.

    The event at which stability changes counts as stable.
    """
    stable = (ds["unstable"].values == 0).tolist()
    order: list[int] = []
    flags: list[bool] = []
    before, kinds = ds["event_point"].values, ds["event_kind"].values
    for i in range(len(stable)):
        order.append(i)
        flags.append(stable[i])
        events = np.flatnonzero(before == i)
        after = stable[min(i + 1, len(stable) - 1)]
        changing = np.flatnonzero(np.isin(kinds[events], _CHANGE_STABILITY))
        border = len(events) - 1 if not len(changing) else changing[0] if stable[i] else changing[-1]
        for k, event in enumerate(events):
            order.append(len(stable) + int(event))
            flags.append((stable[i] and k <= border) or (after and k >= border))
    return np.array(order), np.array(flags)


def line_parts(branch: np.ndarray, stable: np.ndarray) -> Iterator[tuple[int, int, bool]]:
    """First node, the one after the last, and stability of the parts of all branches between changes of stability.

    Unstable parts include the stable nodes before and after them, so that lines have no gaps.
    """
    new = np.flatnonzero((np.diff(branch) != 0) | np.diff(stable)) + 1
    for first, end in pairwise([0, *new.tolist(), len(branch)]):
        if stable[first]:
            yield first, end, True
        else:
            before = first > 0 and branch[first - 1] == branch[first]
            after = end < len(branch) and branch[end] == branch[first]
            yield first - int(before), end + int(after), False


def stability_handles(ds: xr.Dataset) -> list[Line2D]:
    """Legend handles of the lines that occur."""
    stable = ds["unstable"].values == 0
    lines = [(stable.any(), _STABLE, "stable"), ((~stable).any(), _UNSTABLE, "unstable")]
    return [Line2D([], [], color=INK, label=name, **style) for occurs, style, name in lines if occurs]
