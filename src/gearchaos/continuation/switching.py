"""Branches that begin at events of others: of twice the period at a flip, with cascades, and of asymmetric orbits at a
pitchfork."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from gearchaos.continuation.arclength import Point, Settings, Stopped, correct, length
from gearchaos.continuation.branch import HALVED, MIRRORED, Branch, End, follow_one_way
from gearchaos.continuation.events import FLIP, Event
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.shooting import Cycle, CycleEquations

_STEPS = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5)
"""Distances from an event at which an orbit of the other branch is tried, in half backlashes."""


def doubled_start(family: ParameterFamily, flip: Event, span: float) -> tuple[CycleEquations, Point]:
    """An orbit of twice the period next to a flip, and the equations of its branch.

    The tangent leads away from the flip.

    Raises
    ------
    Stopped
        If none is found.
    """
    cycle = flip.cycle
    direction = critical_direction(cycle, -1.0)
    equations = CycleEquations(family, 2 * cycle.period, span)
    return equations, _start(equations, np.tile(cycle.points, (2, 1)), cycle, np.concatenate([direction, -direction]))


def _start(equations: CycleEquations, points: np.ndarray, cycle: Cycle, direction: np.ndarray) -> Point:
    """The orbit of another branch next to points (n, d) of a cycle in a direction (n, d); raises `Stopped`."""
    tangent = np.append(direction.ravel(), 0.0)
    tangent /= length(equations.weights, tangent)
    base = np.append(points.ravel(), cycle.values)
    _, _, origin = equations.evaluate(base)
    cause = "no orbit of the other branch is found at the event"
    for step in _STEPS:
        try:
            start = correct(equations, base + step * tangent, tangent, tangent, step)
        except Stopped as stop:
            cause = str(stop)
            continue
        if equations.resolved(origin, start.data):
            return start
    raise Stopped(cause)


def critical_direction(cycle: Cycle, multiplier: float) -> np.ndarray:
    """The real eigenvector to a multiplier at all points of the orbit, (n, d), with the largest element 1."""
    values, vectors = np.linalg.eig(cycle.monodromy)
    vector = vectors[:, np.argmin(np.abs(values - multiplier))].real
    out = [vector]
    for matrix in cycle.result.monodromy[:-1]:
        out.append(matrix @ out[-1])
    directions = np.stack(out)
    return directions / np.abs(directions).max()


def follow_doubled(
    family: ParameterFamily, flip: Event, bounds: tuple[float, float], settings: Settings,
    until: Callable[[Branch], bool] | None = None,
) -> Branch:
    """The branch of orbits of twice the period that begins at a flip."""
    equations, start = doubled_start(family, flip, bounds[1] - bounds[0])
    branch = follow_one_way(family, equations, start, bounds, replace(settings, first=start.step), None, until)
    origin = End(float(flip.point.u[-1]), HALVED)
    branch.ends = [origin, *branch.ends]
    return branch


def follow_asymmetric(
    family: ParameterFamily, pitchfork: Event, bounds: tuple[float, float], settings: Settings
) -> Iterator[Branch]:
    """The two branches of asymmetric orbits that begin at a pitchfork, as far as they are found."""
    cycle = pitchfork.cycle
    equations = CycleEquations(family, cycle.period, bounds[1] - bounds[0])
    for sign in (1.0, -1.0):
        try:
            start = _start(equations, cycle.points, cycle, sign * critical_direction(cycle, 1.0))
        except Stopped:
            continue
        branch = follow_one_way(family, equations, start, bounds, replace(settings, first=start.step), None)
        branch.ends = [End(float(pitchfork.point.u[-1]), MIRRORED), *branch.ends]
        yield branch


def cascade(
    family: ParameterFamily, flip: Event, bounds: tuple[float, float], settings: Settings, count: int
) -> Iterator[tuple[Branch, Event | None]]:
    """The branches of a period-doubling cascade: each up to the flip at which it becomes unstable, and that flip.

    Parameters
    ----------
    flip : Event
        Where the first branch begins.
    count : int
        Number of doublings; there are fewer where no doubled orbit or no further flip is found.
    """

    def passed_flip(branch: Branch) -> bool:
        return any(e.kind == FLIP for e in branch.events)

    for _ in range(count):
        try:
            branch = follow_doubled(family, flip, bounds, settings, until=passed_flip)
        except Stopped:
            return
        next_flip = next((e for e in branch.events if e.kind == FLIP), None)
        yield branch, next_flip
        if next_flip is None:
            return
        flip = next_flip
