"""Branches of periodic orbits along one parameter, with their events."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import brentq

from gearchaos.continuation.arclength import (
    Equations,
    Point,
    Settings,
    Stopped,
    at_value,
    correct,
    follow,
    point_of,
)
from gearchaos.continuation.event_search import find_events, turns_at_branch_point
from gearchaos.continuation.events import FLIP, FOLD, NEIMARK_SACKER, PITCHFORK, Event, flip_test, locate
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.orbit import count_unstable
from gearchaos.continuation.same_orbit import joins_half_period, returned_start
from gearchaos.continuation.shooting import Cycle, CycleEquations, converge, unknowns
from gearchaos.errors import InputError

AXIS_END, CLOSED, POINT_LIMIT = "end of the axis", "returns to its start", "point limit"
UNBOUNDED = "amplitude above 1000 half backlashes"
LARGEST = 1e3
"""Largest coordinate of a stroboscopic point that a branch is followed to."""

MIRRORED = "joins a branch at a pitchfork"
HALVED = "joins a branch of half the period"
JOINS = (MIRRORED, HALVED)
"""The ends at branches of other orbits."""

_REACHES = (1e-9, 1e-7, 1e-5, 1e-3)
"""Half widths of intervals about the end of a branch in which the flip is searched at which it ends."""

_SEPARATE = 1e-2
"""An orbit nearer to one of half the period than this fraction of the last point's distance is no orbit of its own."""

_MOVED = 1e-6
"""Largest change of a coordinate between the orbits near an end of the axis and at it."""

CHANGE_STABILITY = (FOLD, FLIP, NEIMARK_SACKER, PITCHFORK)
"""The kinds of events at which stability may change."""


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
    start : int
        Index of the point from which the branch was followed in both directions.
    """

    family: ParameterFamily
    period: int
    points: list[Point] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    event_positions: list[int] = field(default_factory=list)
    ends: list[End] = field(default_factory=list)
    closed: bool = False
    start: int = 0

    @property
    def values(self) -> np.ndarray:
        """The parameter at the points, (P,)."""
        return np.array([point.u[-1] for point in self.points])

    @property
    def unstable(self) -> np.ndarray:
        """Number of multipliers outside the unit circle at the points, (P,).

        A point at which the branch joins another one has a multiplier 1; it counts like its neighbour.
        """
        out = np.array([count_unstable(point.data.multipliers) for point in self.points])
        for end, at, neighbour in zip(self.ends, (0, -1), (1, -2), strict=False):
            if end.why in JOINS and len(out) > 1 and self.points[at].u[-1] == end.value:
                out[at] = out[neighbour]
        return out

    def stable_intervals(self) -> list[list[float]]:
        """Intervals [low, high] of the parameter in which orbits of the branch are stable.

        They are in ascending order, overlap where the branch turns, and end at events or at ends of the branch. One
        that passes the first point of a closed branch is not divided.
        """
        stable, values = self.unstable == 0, self.values
        found: list[list[float]] = []
        for i, value in enumerate(values):
            before = i > 0 and stable[i - 1]
            if stable[i] and not before:
                found.append([value, *self._changes(i - 1, last=True)])
            elif stable[i]:
                found[-1].append(value)
            elif before:
                found[-1] += self._changes(i - 1, last=False)
        if self.ends and stable[0] and not self.closed:  # a doubled branch begins at a flip, not at its first point
            found[0].append(self.ends[0].value)
        if self.closed and len(found) > 1 and stable[0] and stable[-1]:
            found[0] += found.pop()
        return sorted([float(min(part)), float(max(part))] for part in found)

    def _changes(self, position: int, last: bool) -> list[float]:
        """The parameter at the first or last event after a point at which stability may change; empty without one."""
        event = self._change(position, last)
        return [] if event is None else [float(event.point.u[-1])]

    def _change(self, position: int, last: bool) -> Event | None:
        """The first or last event after the point at a position at which stability may change."""
        found = [e for i, e in zip(self.event_positions, self.events, strict=True)
                 if i == position and e.kind in CHANGE_STABILITY]
        return found[-1 if last else 0] if found else None

    def first_change_of_stability(self, kind: str) -> Event | None:
        """The event of a kind at which stability first changes on leaving the start, in one direction or the other.

        Of two such events that with the parameter nearer to the start is taken; None if there is none.
        """
        stable, found = self.unstable == 0, []
        ahead, back = range(self.start, len(stable) - 1), range(self.start - 1, -1, -1)
        for positions, last in ((ahead, False), (back, True)):
            changed = next((i for i in positions if stable[i] != stable[i + 1]), None)
            found.append(None if changed is None else self._change(changed, last))
        value = self.points[self.start].u[-1]
        wanted = [e for e in found if e is not None and e.kind == kind]
        return min(wanted, key=lambda e: abs(e.point.u[-1] - value), default=None)


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
    try:
        first = correct(equations, unknowns(start), upwards, upwards)
    except Stopped as stop:
        raise InputError(
            "start", "must be an orbit from which a branch can be followed", f"{family.axes[0]}={start.values[0]:.10g}",
            f"{str(stop)[:1].upper()}{str(stop)[1:]}: without load and contact, orbits are not isolated. "
            "Give another start.") from None
    ahead = follow_one_way(family, equations, first, bounds, settings, user)
    if ahead.closed:
        return ahead
    back = follow_one_way(family, equations, reversed_point(first), bounds, settings, user)
    return _joined(back, ahead)


def reversed_point(point: Point) -> Point:
    """The point with the opposite direction."""
    return Point(point.u, -point.tangent, -point.orientation, point.residual, point.data, point.step)


def follow_one_way(
    family: ParameterFamily, equations: CycleEquations, start: Point, bounds: tuple[float, float], settings: Settings,
    user: dict[str, Callable[[Cycle], float]] | None, until: Callable[[Branch], bool] | None = None,
) -> Branch:
    """Follow a branch from a point in the direction of its tangent, to its end or until a condition holds."""
    branch = Branch(family, equations.period, [start])
    try:
        for point in follow(equations, start, settings):
            why = _end_between(branch, equations, point, bounds)
            last = point if why is None else why[0]
            if last is not branch.points[-1]:  # a branch that starts at an end of the axis has no other point there
                _append(branch, equations, last, user, halved=why is not None and why[1] == HALVED)
            if why is not None:
                branch.ends, branch.closed = [End(float(last.u[-1]), why[1])], why[1] == CLOSED
                return branch
            if until is not None and until(branch):
                return branch
        branch.ends = [End(float(branch.values[-1]), POINT_LIMIT)]
    except Stopped as stop:
        branch.ends = [_end_at_limit(branch, equations, bounds, user, str(stop))]
    return branch


def _end_at_limit(
    branch: Branch, equations: CycleEquations, bounds: tuple[float, float],
    user: dict[str, Callable[[Cycle], float]] | None, cause: str,
) -> End:
    """The end of a branch that cannot be followed: that of the axis if it is a limit of the model's rules, and near."""
    last = branch.points[-1]
    for bound in bounds:
        landed = at_value(equations, last, equations.size, bound)
        if landed is not None:
            if last.u[-1] != bound:
                _append(branch, equations, landed, user, halved=False)
            return End(bound, AXIS_END)
    return End(float(last.u[-1]), f"step too small: {cause}")


def _append(
    branch: Branch, equations: CycleEquations, point: Point, user: dict[str, Callable[[Cycle], float]] | None,
    halved: bool,
) -> None:
    """Add a point, and the events between the last one and it.

    Where the branch joins one of half the period (``halved``) it turns back, and its equations are singular; this is
    the flip of the other branch, no fold or pitchfork of this one.
    """
    found = find_events(equations, branch.points[-1], point, user)
    if halved:
        full = np.abs(branch.points[-1].data.half_period_difference).max()
        found = [e for e in found if e.kind not in (FOLD, PITCHFORK)
                 or np.abs(e.cycle.half_period_difference).max() > _SEPARATE * full]
    branch.event_positions += [len(branch.points) - 1] * len(found)
    branch.events += found
    branch.points.append(point)


def _end_between(
    branch: Branch, equations: CycleEquations, point: Point, bounds: tuple[float, float]
) -> tuple[Point, str] | None:
    """The point at which the branch ends between its last point and this one, and why; None if it goes on."""
    last = branch.points[-1]
    for bound, outwards in zip(bounds, (-1.0, 1.0), strict=True):
        if (point.u[-1] - bound) * outwards > 0:
            return _at_bound(equations, last, point, bound), AXIS_END
    if np.abs(point.u[:-1]).max() > LARGEST:
        return point, UNBOUNDED
    returned = returned_start(equations, branch.points[0], last, point) if len(branch.points) > 3 else None
    if returned is not None:
        return returned, CLOSED
    if joins_half_period(last.data, point.data):
        return _half_period_end(equations, last, point), HALVED
    if turns_at_branch_point(last, point):
        end = _cross(equations, last, point, lambda p: float(p.tangent[-1]))
        return end, MIRRORED
    return None


def _half_period_end(equations: CycleEquations, last: Point, point: Point) -> Point:
    """The orbit of half the period that is passed between two points, at its flip, as the last point of the branch."""
    before = last.data.half_period_difference
    end = _cross(equations, last, point, lambda p: float(np.dot(before, p.data.half_period_difference)))
    family, points = equations.family, end.data.points
    guess = 0.5 * (points[: len(points) // 2] + points[len(points) // 2 :])

    def half(value: float) -> Cycle:
        return converge(family, guess, np.array([value]))

    value = _root_near(lambda v: flip_test(half(v)), float(end.u[-1]))
    if value is None or not half(value).converged:
        return end
    u = np.append(np.tile(half(value).points, (2, 1)).ravel(), value)
    f, _, data = equations.evaluate(u)
    return replace(end, u=u, residual=float(np.abs(f).max()), data=data)


def _root_near(function: Callable[[float], float], value: float) -> float | None:
    """The root of a function next to a value; None without a change of sign near it."""
    for reach in _REACHES:
        low, high = value - reach, value + reach
        if function(low) * function(high) < 0:
            return float(brentq(function, low, high, xtol=1e-15, rtol=1e-15))
    return None


def _at_bound(equations: CycleEquations, last: Point, point: Point, bound: float) -> Point:
    """The point between two others at which the parameter has a given value, exactly."""
    if last.u[-1] == bound:
        return last

    def beyond(p: Point) -> float:
        return float(p.u[-1] - bound)

    crossing = _cross(equations, last, point, beyond)
    points = crossing.u[:-1].reshape(equations.period, -1)
    cycle = converge(equations.family, points, np.array([bound]))
    if not cycle.converged or np.abs(cycle.points - points).max() > _MOVED:
        return crossing
    return point_of(equations, unknowns(cycle), crossing.tangent, crossing.step)


def _cross(equations: Equations, first: Point, last: Point, test: Callable[[Point], float]) -> Point:
    """The point between two others where a function vanishes; the first one where that cannot be found."""
    return locate(equations, first, last, test) or first


def _joined(back: Branch, ahead: Branch) -> Branch:
    """One branch from the two halves on both sides of a common start."""
    points = [reversed_point(p) for p in back.points[:0:-1]] + ahead.points
    offset, before = len(back.points) - 1, len(back.points) - 2
    positions = [before - i for i in back.event_positions[::-1]] + [offset + i for i in ahead.event_positions]
    events = back.events[::-1] + ahead.events
    return Branch(ahead.family, ahead.period, points, events, positions, back.ends + ahead.ends, start=offset)


def outside(family: ParameterFamily, value: float, bounds: tuple[float, float]) -> InputError | None:
    """The error for a start outside the axis, None for one inside."""
    if bounds[0] <= value <= bounds[1]:
        return None
    name = family.axes[0]
    return InputError(f"axis {name}", "must contain the model's own value", f"{bounds[0]:g}:{bounds[1]:g}",
                      f"The model has {name} = {value:g}: set it, or choose another axis.")
