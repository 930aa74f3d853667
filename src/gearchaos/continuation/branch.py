"""Branches of periodic orbits along one parameter, with their events."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from gearchaos.continuation.arclength import Equations, Point, Settings, Stopped, between, correct, follow, length
from gearchaos.continuation.cycles import CycleEquations, unknowns
from gearchaos.continuation.events import FLIP, Event, find_events
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.orbit import count_unstable
from gearchaos.continuation.shooting import Cycle
from gearchaos.errors import InputError

AXIS_END, CLOSED, POINT_LIMIT = "end of the axis", "returns to its start", "point limit"
HALVED = "joins a branch of half the period"
_RETURNED = 1e-3
"""A branch has returned to its start if it passes it at a distance of less than this fraction of a step."""

_DOUBLING_STEPS = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5)
"""Distances from a flip at which a doubled orbit is tried, in half backlashes."""


@dataclass(frozen=True)
class End:
    """Where a branch ends, and why."""

    value: float
    why: str


@dataclass(eq=False)
class Branch:
    """A branch of periodic orbits.

    Attributes
    ----------
    family : ParameterFamily
        The model along the parameter.
    period : int
        Minimal period in mesh periods, except where the branch joins one of half the period.
    points : list of Point
        In order along the branch; `Point.data` is the `Cycle`.
    events : list of Event
        In order along the branch.
    event_positions : list of int
        Index of the point before each event.
    ends : list of End
        Of the first and the last point; empty for a closed branch.
    closed : bool
        Whether the last point is the first one: an isola.
    """

    family: ParameterFamily
    period: int
    points: list[Point] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    event_positions: list[int] = field(default_factory=list)
    ends: list[End] = field(default_factory=list)
    closed: bool = False

    @property
    def values(self) -> np.ndarray:
        """The parameter at the points, (P,)."""
        return np.array([point.u[-1] for point in self.points])

    @property
    def unstable(self) -> np.ndarray:
        """Number of multipliers outside the unit circle at the points, (P,)."""
        return np.array([count_unstable(point.data.multipliers) for point in self.points])

    def stable_intervals(self) -> list[list[float]]:
        """Intervals [low, high] of the parameter in which orbits of the branch are stable.

        They end at events or at ends of the branch.
        """
        nodes: list[tuple[int, float]] = []  # stability of the orbits before, and the parameter
        intervals, order = [], sorted(zip(self.event_positions, self.events, strict=True), key=lambda pair: pair[0])
        current: list[float] = []
        positions = iter(order)
        pending = next(positions, None)
        unstable, values = self.unstable, self.values
        del nodes
        for i, (count, value) in enumerate(zip(unstable, values, strict=True)):
            if count == 0:
                current.append(float(value))
            crossed = []
            while pending is not None and pending[0] == i:
                crossed.append(pending[1])
                pending = next(positions, None)
            after = unstable[i + 1] if i + 1 < len(unstable) else None
            changing = [e for e in crossed if e.kind != "graze"]
            if after is not None and (count == 0) != (after == 0) and changing:
                edge = float((changing[0] if count == 0 else changing[-1]).point.u[-1])
                current.append(edge)
            if count == 0 and (after is None or after > 0):
                intervals.append([min(current), max(current)])
                current = []
        return intervals


def follow_branch(
    family: ParameterFamily, start: Cycle, bounds: tuple[float, float], settings: Settings,
    user: dict[str, Callable[[Cycle], float]] | None = None,
) -> Branch:
    """Follow the branch of a periodic orbit in both directions.

    Parameters
    ----------
    family : ParameterFamily
        A model along one parameter.
    start : Cycle
        An orbit on the branch, converged.
    bounds : (float, float)
        Ends of the axis.
    settings : Settings
    user : dict of str to function, optional
        Further test functions of a cycle, by name; each root is an event.
    """
    equations = CycleEquations(family, start.period, bounds[1] - bounds[0])
    upwards = np.append(np.zeros(start.points.size), 1.0)
    first = correct(equations, unknowns(start), upwards, upwards)
    ahead = _one_way(family, equations, first, bounds, settings, user)
    if ahead.closed:
        return ahead
    back = _one_way(family, equations, reversed_point(first), bounds, settings, user)
    return _joined(back, ahead)


def reversed_point(point: Point) -> Point:
    """The point with the opposite direction."""
    return Point(point.u, -point.tangent, -point.orientation, point.residual, point.data, point.step)


def _one_way(
    family: ParameterFamily, equations: CycleEquations, start: Point, bounds: tuple[float, float], settings: Settings,
    user: dict[str, Callable[[Cycle], float]] | None, until: Callable[[Branch], bool] | None = None,
) -> Branch:
    """Follow a branch from a point in the direction of its tangent, to its end or until a condition holds."""
    branch = Branch(family, equations.period, [start])
    try:
        for point in follow(equations, start, settings):
            why = _end_between(branch, equations, point, bounds)
            last = point if why is None else why[0]
            _append(branch, equations, last, user)
            if why is not None:
                branch.ends, branch.closed = [End(float(last.u[-1]), why[1])], why[1] == CLOSED
                return branch
            if until is not None and until(branch):
                return branch
        branch.ends = [End(float(branch.values[-1]), POINT_LIMIT)]
    except Stopped as stop:
        branch.ends = [End(float(branch.values[-1]), f"step too small: {stop}")]
    return branch


def _append(
    branch: Branch, equations: CycleEquations, point: Point, user: dict[str, Callable[[Cycle], float]] | None
) -> None:
    """Add a point, and the events between the last one and it."""
    found = find_events(equations, branch.points[-1], point, user)
    branch.event_positions += [len(branch.points) - 1] * len(found)
    branch.events += found
    branch.points.append(point)


def _end_between(
    branch: Branch, equations: CycleEquations, point: Point, bounds: tuple[float, float]
) -> tuple[Point, str] | None:
    """The point at which the branch ends between its last point and this one, and why; None if it goes on."""
    last = branch.points[-1]
    for bound, side in zip(bounds, (-1.0, 1.0), strict=True):
        if side * (point.u[-1] - bound) > 0:
            begins_there = side * (last.u[-1] - bound) >= 0
            end = last if begins_there else _cross(equations, last, point, lambda p, b=bound: float(p.u[-1] - b))
            return (end, AXIS_END)
    returned = _returned(equations, branch.points[0], last, point) if len(branch.points) > 3 else None
    if returned is not None:
        return returned, CLOSED
    if equations.period % 2 == 0:
        before = _half_period_difference(last)
        if float(np.dot(before, _half_period_difference(point))) < 0:
            end = _cross(equations, last, point, lambda p: float(np.dot(before, _half_period_difference(p))))
            return (end, HALVED)
    return None


def _cross(equations: Equations, first: Point, last: Point, test: Callable[[Point], float]) -> Point:
    """The point between two others where a function vanishes; the first one where that cannot be found."""
    from gearchaos.continuation.events import locate

    return locate(equations, first, last, test) or first


def _half_period_difference(point: Point) -> np.ndarray:
    """First point of an orbit less the point half a period later, (d,)."""
    points = point.data.points
    return points[0] - points[len(points) // 2]


def _returned(equations: CycleEquations, start: Point, last: Point, point: Point) -> Point | None:
    """The start as the next point of the branch if the branch passes it, or a copy of it shifted by mesh periods."""
    n, size = equations.period, length(equations.weights, point.u - last.u)
    for shift in range(n):
        u, tangent = (_shifted(v, n, shift) for v in (start.u, start.tangent))
        before, after = (float(np.sum(equations.weights * tangent * (v - u))) for v in (last.u, point.u))
        near = length(equations.weights, point.u - u) < 2 * size and length(equations.weights, last.u - u) < 2 * size
        if near and before < 0 <= after and float(np.sum(equations.weights * tangent * point.tangent)) > 0:
            at = between(equations, last, point, float(np.sum(equations.weights * last.tangent * (u - last.u))))
            if length(equations.weights, at.u - u) < _RETURNED * size:
                return at
    return None


def _shifted(u: np.ndarray, period: int, shift: int) -> np.ndarray:
    """A vector (n d + 1,) of points and parameter with the points shifted by whole mesh periods."""
    points = np.roll(u[:-1].reshape(period, -1), -shift, axis=0)
    return np.append(points.ravel(), u[-1])


def _joined(back: Branch, ahead: Branch) -> Branch:
    """One branch from the two halves on both sides of a common start."""
    points = [reversed_point(p) for p in back.points[:0:-1]] + ahead.points
    offset, before = len(back.points) - 1, len(back.points) - 2
    positions = [before - i for i in back.event_positions[::-1]] + [offset + i for i in ahead.event_positions]
    events = back.events[::-1] + ahead.events
    return Branch(ahead.family, ahead.period, points, events, positions, back.ends + ahead.ends)


def doubled_start(family: ParameterFamily, flip: Event, span: float) -> tuple[CycleEquations, Point]:
    """An orbit of twice the period next to a flip, and the equations of its branch; the tangent leads away from the flip.

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
    branch = _one_way(family, equations, start, bounds, replace(settings, first=start.step), None, until)
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
        Number of doublings.
    """
    for _ in range(count):
        branch = follow_doubled(family, flip, bounds, settings, until=_lost_by_flip)
        next_flip = next((e for e in branch.events if e.kind == FLIP), None)
        yield branch, next_flip
        if next_flip is None:
            return
        flip = next_flip


def _lost_by_flip(branch: Branch) -> bool:
    """Whether the branch has passed a flip."""
    return any(e.kind == FLIP for e in branch.events)


def outside(family: ParameterFamily, value: float, bounds: tuple[float, float]) -> InputError | None:
    """The error for a start outside the axis, None for one inside."""
    if bounds[0] <= value <= bounds[1]:
        return None
    name = family.axes[0]
    return InputError(f"axis {name}", "must contain the model's own value", f"{bounds[0]:g}:{bounds[1]:g}",
                      f"The model has {name} = {value:g}: set it, or choose another axis.")
