"""The points and events of branches of periodic orbits as lines, in parts between changes of stability."""

from __future__ import annotations

import json
from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gearchaos.continuation.events import CHANGE_STABILITY

if TYPE_CHECKING:
    import xarray as xr


class Nodes(NamedTuple):
    """The P points and E events of branches in order along them, N = P + E.

    A node is joined if it follows the one before on the same branch, with no point between that is missing. The event
    at which stability changes counts as stable.
    """

    order: np.ndarray  # indices (N,) of the points, 0 … P − 1, and of the events, P … P + E − 1
    joined: np.ndarray  # (N,) of bool
    stable: np.ndarray  # (N,) of bool


def axis_of(ds: xr.Dataset) -> str:
    """The name of the parameter of a branch: the coordinate of its points."""
    return next(str(name) for name, array in ds.coords.items() if array.dims == ("point",))


def stability_word(ds: xr.Dataset) -> str:
    """What the solid parts of its lines are: "stable", or "neutral" without damping."""
    return "neutral" if json.loads(ds.attrs["neutral"]) else "stable"


def positions(ds: xr.Dataset) -> np.ndarray:
    """The index of each point among all points of the branches, (P,), of which some may have been selected."""
    return ds["position"].values if "position" in ds else np.arange(ds.sizes["point"])


def line_nodes(ds: xr.Dataset) -> Nodes:
    """The points and events of branches in order, also where the Dataset has only some of them."""
    before = np.concatenate([positions(ds), ds["event_point"].values]).astype(int)
    is_event = np.repeat([False, True], [ds.sizes["point"], ds.sizes["event"]])
    order = np.lexsort((is_event, before))
    branch = np.concatenate([ds["branch"].values, ds["event_branch"].values])[order]
    step = np.diff(before[order])
    joined = (step == ~is_event[order][1:]) & (np.diff(branch) == 0)
    stable = dict(zip(positions(ds).tolist(), (ds["unstable"].values == 0).tolist(), strict=True))
    changes, at_event = np.isin(ds["event_kind"].values, CHANGE_STABILITY), np.zeros(ds.sizes["event"], bool)
    for position in np.unique(ds["event_point"].values).tolist():
        events = np.flatnonzero(ds["event_point"].values == position)
        changing = np.flatnonzero(changes[events])
        known = [stable[p] for p in (position, position + 1) if p in stable]
        if not known:
            continue
        here, after = known[0], known[-1]
        if len(known) == 1 and len(changing):  # the other point was left out
            here, after = (here, not here) if position in stable else (not after, after)
        border = len(events) - 1 if not len(changing) else changing[0] if here else changing[-1]
        for k, event in enumerate(events):  # whether it is on a stable part, or at its end
            at_event[event] = (here and k <= border) or (after and k >= border)
    both = np.concatenate([ds["unstable"].values == 0, at_event])
    return Nodes(order, np.concatenate([[False], joined])[: len(order)], both[order])


def line_parts(nodes: Nodes) -> Iterator[tuple[int, int, bool]]:
    """First node, the one after the last, and stability of the parts of all branches between changes of stability.

    Unstable parts include the stable nodes before and after them, so that lines have no gaps.
    """
    joined, stable, count = nodes.joined, nodes.stable, len(nodes.order)
    new = np.flatnonzero(~joined[1:] | np.diff(stable)) + 1
    for first, end in pairwise([0, *new.tolist(), count] if count else []):
        if stable[first]:
            yield first, end, True
        else:
            yield first - int(joined[first]), end + int(end < count and joined[end]), False


class StablePart(NamedTuple):
    """A stable part of the first branch, in order along it: the parameter, and the index of the event, at both ends.

    There is no event at an end of the branch.
    """

    first: float
    last: float
    first_event: int | None
    last_event: int | None


def stable_parts(ds: xr.Dataset, closed: bool) -> list[StablePart]:
    """The stable parts of the first branch in order; one that passes the start of a closed branch is not divided."""
    events = np.flatnonzero(ds["event_branch"].values == 0)
    own = ds.isel(point=ds["branch"].values == 0, event=events)
    nodes, count = line_nodes(own), own.sizes["point"]
    x = np.concatenate([own[axis_of(own)].values, own["event_value"].values])[nodes.order].tolist()
    at = [int(events[i - count]) if i >= count else None for i in nodes.order.tolist()]
    parts = [(first, end - 1) for first, end, stable in line_parts(nodes) if stable]
    if closed and len(parts) > 1 and parts[0][0] == 0 and parts[-1][1] == len(x) - 1:
        parts[0] = (parts.pop()[0], parts[0][1])
    return [StablePart(x[first], x[last], at[first], at[last]) for first, last in parts]
