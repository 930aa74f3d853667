"""Branches of orbits of twice the period that begin at a flip, and cascades of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from gearchaos.continuation.arclength import Point, Settings, Stopped, correct, length
from gearchaos.continuation.branch import HALVED, Branch, End, follow_one_way
from gearchaos.continuation.cycles import CycleEquations
from gearchaos.continuation.events import FLIP, Event
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.shooting import Cycle

_DOUBLING_STEPS = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5)
"""Distances from a flip at which a doubled orbit is tried, in half backlashes."""


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
    doubled = np.concatenate([direction, -direction])
    equations = CycleEquations(family, 2 * cycle.period, span)
    tangent = np.append(doubled.ravel(), 0.0)
    tangent /= length(equations.weights, tangent)
    base = np.append(np.tile(cycle.points, (2, 1)).ravel(), cycle.values)
    _, _, twice = equations.evaluate(base)
    cause = "no doubled orbit is found at the flip"
    for step in _DOUBLING_STEPS:
        try:
            start = correct(equations, base + step * tangent, tangent, tangent, step)
        except Stopped as stop:
            cause = str(stop)
            continue
        if equations.resolved(twice, start.data):
            return equations, start
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
    for _ in range(count):
        try:
            branch = follow_doubled(family, flip, bounds, settings, until=_lost_by_flip)
        except Stopped:
            return
        next_flip = next((e for e in branch.events if e.kind == FLIP), None)
        yield branch, next_flip
        if next_flip is None:
            return
        flip = next_flip


def _lost_by_flip(branch: Branch) -> bool:
    """Whether the branch has passed a flip."""
    return any(e.kind == FLIP for e in branch.events)
