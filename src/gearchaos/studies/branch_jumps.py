"""Where a slow change of the parameter makes a motion leave a branch of periodic orbits, and what it leads to."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gearchaos.continuation.branch import Branch
from gearchaos.continuation.events import FOLD, Event
from gearchaos.continuation.shooting import Cycle
from gearchaos.datasets import describe, variable
from gearchaos.dynamics import Label, classify, orbits
from gearchaos.studies.axis import Axis

if TYPE_CHECKING:
    import xarray as xr

_BEYOND = 1e-4
"""Distance beyond a fold at which motions are followed, relative to the range of the parameter."""

_SAME_ORBIT = 0.05
"""Largest distance of the motion reached from an orbit interpolated between two points of a branch, relative to the
larger of 1 and the largest coordinate."""

_WORDS = {"event": "index of the fold", "point": "index of the point before the orbit reached; -1 for none",
          "label": "kind of motion reached", "period": "its period in mesh periods; 0 for none"}


class _Jump(NamedTuple):
    """A fold that ends a stable part."""

    event: int  # index among all events
    value: float
    direction: int  # 1 if the parameter rises, -1 if it falls
    state: np.ndarray  # first stroboscopic point of the orbit at the fold, (d,)


def jump_variables(branches: Sequence[Branch], axis: Axis) -> dict[str, xr.Variable]:
    """The variables over ``jump`` by name: the folds that end a stable part, and the motions to which they lead.

    Parameters
    ----------
    branches : sequence of Branch
    axis : Axis
        The parameter and its range.
    """
    jumps = _jumps(branches)
    beyond = np.array([jump.value + jump.direction * _BEYOND * (axis.stop - axis.start) for jump in jumps])
    beyond = np.clip(beyond, axis.start, axis.stop)
    label, period, point = _reached(branches, jumps, beyond)
    found = {
        "value": np.array([jump.value for jump in jumps], float),
        "direction": np.array([jump.direction for jump in jumps], int),
        "event": np.array([jump.event for jump in jumps], int), "label": label, "period": period, "point": point,
    }
    out = {f"jump_{name}": variable(f"jump_{name}", ("jump",), values) for name, values in found.items()}
    out["jump_value"].attrs.update(describe(axis.name), quantity=axis.name)
    for name, words in _WORDS.items():
        out[f"jump_{name}"].attrs["long_name"] = words
    return out


def _jumps(branches: Sequence[Branch]) -> list[_Jump]:
    """The folds that end a stable part of a branch, in order."""
    found: list[_Jump] = []
    events: list[tuple[Branch, int, Event]] = [
        (branch, position, event) for branch in branches
        for position, event in zip(branch.event_positions, branch.events, strict=True)]
    for index, (branch, before, event) in enumerate(events):
        if event.kind == FOLD and np.any(branch.unstable[before : before + 2] == 0):
            value = float(event.point.u[-1])
            direction = 1 if value > branch.values[before : before + 2].mean() else -1
            found.append(_Jump(index, value, direction, event.cycle.points[0]))
    return found


def _reached(
    branches: Sequence[Branch], jumps: list[_Jump], beyond: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Label, period, and index of the point of a branch before the orbit reached, −1 for none, of each jump, (J,)."""
    if not jumps:
        return np.zeros(0, np.int8), np.zeros(0, int), np.zeros(0, int)
    flow = branches[0].family.exact_flow(beyond[:, None])
    found = classify(flow, np.stack([jump.state for jump in jumps], axis=1), response=False)
    period = np.where(found.label == Label.PERIODIC, found.period, 0)
    sections = orbits.sections(flow, found.w, np.arange(len(jumps)), np.maximum(period, 1))
    at = zip(beyond, sections, period, strict=True)
    point = [_point_before(branches, value, section) if n else -1 for value, section, n in at]
    return found.label, period, np.array(point)


def _point_before(branches: Sequence[Branch], value: float, section: np.ndarray) -> int:
    """Index of the point before the place of an orbit (n, d) on the branches at a value; −1 if it is on none."""
    first, nearest, index = 0, _SAME_ORBIT * max(1.0, float(np.abs(section).max())), -1
    for branch in branches:
        cycles: list[Cycle] = [point.data for point in branch.points]
        x = branch.values
        if branch.period == len(section):
            for i in np.flatnonzero((x[1:] - value) * (x[:-1] - value) <= 0).tolist():
                share = (value - x[i]) / (x[i + 1] - x[i])
                between = cycles[i].points + share * (cycles[i + 1].points - cycles[i].points)
                distance = float(np.linalg.norm(section[0] - between, axis=1).min())
                if distance < nearest:
                    nearest, index = distance, first + i
        first += len(cycles)
    return index
