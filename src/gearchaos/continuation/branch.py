"""Branches of periodic orbits along one parameter, with their events, and the branches that begin at these: of twice
the period at a flip, with cascades, and of asymmetric orbits at a pitchfork."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from gearchaos.continuation.arclength import (
    Point,
    Settings,
    Stopped,
    at_value,
    correct,
    crossing,
    follow,
    length,
    root_between,
)
from gearchaos.continuation.events import (
    BORDER_COLLISION,
    CHANGE_STABILITY,
    FLIP,
    FOLD,
    GRAZE,
    PITCHFORK,
    Event,
    find_events,
    flip_test,
    locate,
    turns_at_branch_point,
)
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.shooting import (
    Cycle,
    CycleEquations,
    converge,
    count_unstable,
    is_neutral,
    joins_half_period,
    returned_start,
    unknowns,
)
from gearchaos.errors import InputError

AXIS_END, CLOSED, POINT_LIMIT = "end of the axis", "returns to its start", "point limit"
UNBOUNDED = "amplitude above 1000 half backlashes"
LARGEST = 1e3  # largest coordinate of a stroboscopic point that a branch is followed to

MIRRORED = "joins a branch at a pitchfork"
HALVED = "joins a branch of half the period"
JOINS = (MIRRORED, HALVED)  # the ends at branches of other orbits

_REACHES = (1e-9, 1e-7, 1e-5, 1e-3)
"""Half widths of intervals about the end of a branch in which the flip is searched at which it ends."""

_SEPARATE = 1e-2
"""An orbit nearer to one of half the period than this fraction of the last point's distance is no orbit of its own."""

_STEPS = (1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 3e-5, 1e-5)
"""Distances from an event at which an orbit of the other branch is tried, in half backlashes."""

Tests = dict[str, Callable[[Cycle], float]]  # further test functions of a cycle, by name; each root is an event


class BranchEnd(NamedTuple):
    """Where a branch ends, and why."""

    value: float
    why: str


@dataclass(eq=False)
class Branch:
    """A branch of periodic orbits, with points and events in order along it."""

    family: ParameterFamily
    period: int  # minimal one in mesh periods, except where the branch joins one of half the period
    points: list[Point] = field(default_factory=list)  # `Point.data` is the `Cycle`
    events: list[Event] = field(default_factory=list)
    event_positions: list[int] = field(default_factory=list)  # index of the point before each event
    ends: list[BranchEnd] = field(default_factory=list)  # of the first and the last point; empty for a closed branch
    closed: bool = False  # the last point is the first one: an isola
    start: int = 0  # index of the point from which the branch was followed in both directions

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

    @property
    def neutral(self) -> bool:
        """Whether all its orbits without a multiplier outside the unit circle have one on it: without damping none is
        asymptotically stable."""
        return all(is_neutral(point.data.multipliers) for point, count in zip(self.points, self.unstable, strict=True)
                   if count == 0)

    def stable_intervals(self) -> list[list[float]]:
        """Intervals [low, high] of the parameter in which orbits of the branch are stable, or neutral if it is that.

        They are in ascending order, overlap where the branch turns, and end at events or at ends of the branch. One
        that passes the first point of a closed branch is not divided.
        """
        stable, values = self.unstable == 0, self.values
        found: list[list[float]] = []
        for i, value in enumerate(values):
            before = i > 0 and stable[i - 1]
            event = self._change(i - 1, last=not before)
            changed = [] if event is None else [float(event.point.u[-1])]
            if stable[i] and not before:
                found.append([value, *changed])
            elif stable[i]:
                found[-1].append(value)
            elif before:
                found[-1] += changed
        if self.ends and stable[0] and not self.closed:  # a doubled branch begins at a flip, not at its first point
            found[0].append(self.ends[0].value)
        if self.closed and len(found) > 1 and stable[0] and stable[-1]:
            found[0] += found.pop()
        return sorted([float(min(part)), float(max(part))] for part in found)

    def _change(self, position: int, last: bool) -> Event | None:
        """The first or last event after the point at a position at which stability may change."""
        found = [e for i, e in zip(self.event_positions, self.events, strict=True)
                 if i == position and e.kind in CHANGE_STABILITY]
        return found[-1 if last else 0] if found else None

    def ends_of_stability(self) -> tuple[Event | None, Event | None]:
        """The events at which stability first changes on leaving the start, with the parameter rising there and with
        it falling; None where there is none.

        Where no event that changes stability is located, it is the graze at which it does.
        """
        stable, found = self.unstable == 0, list[Event | None]()
        for positions, last in ((range(self.start, len(stable) - 1), False), (range(self.start - 1, -1, -1), True)):
            changed = next((i for i in positions if stable[i] != stable[i + 1]), None)
            grazes = (e for i, e in zip(self.event_positions, self.events, strict=True) if i == changed)
            found.append(None if changed is None else self._change(changed, last) or next(grazes, None))
        return found[0], found[1]

    def first_change_of_stability(self, kind: str) -> Event | None:
        """The event of a kind at which stability first changes on leaving the start, in one direction or the other.

        Of two such events that with the parameter nearer to the start is taken; None if there is none.
        """
        value = self.points[self.start].u[-1]
        wanted = [e for e in self.ends_of_stability() if e is not None and e.kind == kind]
        return min(wanted, key=lambda e: abs(e.point.u[-1] - value), default=None)


def follow_branch(family: ParameterFamily, start: Cycle, bounds: tuple[float, float], settings: Settings,
                  user: Tests | None = None) -> Branch:
    """Follow the branch of a periodic orbit that has converged in both directions, to the ends of the axis at most."""
    equations = CycleEquations(family, start.period, bounds[1] - bounds[0])
    upwards = np.append(np.zeros(start.points.size), 1.0)
    try:
        first = correct(equations, unknowns(start), upwards, upwards)
    except Stopped as stop:
        raise InputError(
            "start", "must be an orbit from which a branch can be followed", f"{family.axes[0]}={start.values[0]:.10g}",
            f"{str(stop)[:1].upper()}{str(stop)[1:]}: without load and contact, orbits are not isolated. "
            "Give another start.") from None
    ahead = _follow_one_way(equations, first, bounds, settings, user)
    if ahead.closed:
        return ahead
    back = _follow_one_way(equations, first.reversed(), bounds, settings, user)
    offset = len(back.points) - 1
    return Branch(
        family, ahead.period, [p.reversed() for p in back.points[:0:-1]] + ahead.points,
        back.events[::-1] + ahead.events,
        [offset - 1 - i for i in back.event_positions[::-1]] + [offset + i for i in ahead.event_positions],
        back.ends + ahead.ends, start=offset)


def _follow_one_way(equations: CycleEquations, start: Point, bounds: tuple[float, float], settings: Settings,
                    user: Tests | None = None, until: Callable[[Branch], bool] | None = None) -> Branch:
    """Follow a branch from a point in the direction of its tangent, to its end or until a condition holds."""
    branch, why = Branch(equations.family, equations.period, [start]), ""
    try:
        for point in follow(equations, start, settings):
            last, why = _end_between(branch, equations, point, bounds) or (point, "")
            if last is not branch.points[-1]:  # a branch that starts at an end of the axis has no other point there
                _append(branch, equations, last, user, halved=why == HALVED)
            if not why and until is not None and until(branch):
                return branch
            if why:
                break
        end = BranchEnd(float(branch.points[-1].u[-1]), why or POINT_LIMIT)
    except Stopped as stop:
        end = BranchEnd(float(branch.points[-1].u[-1]), f"step too small: {stop}")
        for bound in bounds:  # next to a limit of the model's rules the branch is taken to the end of the axis
            landed = at_value(equations, branch.points[-1], equations.size, bound)
            if landed is not None:
                if branch.points[-1].u[-1] != bound:
                    _append(branch, equations, landed, user, halved=False)
                end = BranchEnd(bound, AXIS_END)
                break
    branch.ends, branch.closed = [end], why == CLOSED
    return branch


def _append(branch: Branch, equations: CycleEquations, point: Point, user: Tests | None, halved: bool) -> None:
    """Add a point, and the events between the last one and it.

    Where the branch joins one of half the period (``halved``) it turns back, and its equations are singular; this is
    the flip of the other branch, no fold or pitchfork of this one.
    """
    found = find_events(equations, branch.points[-1], point, user)
    if halved:
        full = np.abs(branch.points[-1].data.half_period_difference).max()
        found = [e for e in found if e.kind not in (FOLD, PITCHFORK)
                 or np.abs(e.cycle.half_period_difference).max() > _SEPARATE * full]
    if branch.family.model.law.releases:
        found = [replace(e, kind=BORDER_COLLISION) if e.kind == GRAZE else e for e in found]
    branch.event_positions += [len(branch.points) - 1] * len(found)
    branch.events += found
    branch.points.append(point)


def _end_between(branch: Branch, equations: CycleEquations, point: Point,
                 bounds: tuple[float, float]) -> tuple[Point, str] | None:
    """The point at which the branch ends between its last point and this one, and why; None if it goes on."""
    last = branch.points[-1]
    for bound, outwards in zip(bounds, (-1.0, 1.0), strict=True):
        if (point.u[-1] - bound) * outwards <= 0:
            continue
        if last.u[-1] == bound:
            return last, AXIS_END
        end = crossing(equations, last, point, equations.size, bound)
        return end or locate(equations, last, point, partial(lambda b, p: float(p.u[-1] - b), bound)) or last, AXIS_END
    if np.abs(point.u[:-1]).max() > LARGEST:
        return point, UNBOUNDED
    returned = returned_start(equations, branch.points[0], last, point) if len(branch.points) > 3 else None
    if returned is not None:
        return returned, CLOSED
    if joins_half_period(last.data, point.data):
        return _half_period_end(equations, last, point), HALVED
    if turns_at_branch_point(last, point):
        return locate(equations, last, point, lambda p: float(p.tangent[-1])) or last, MIRRORED
    return None


def _half_period_end(equations: CycleEquations, last: Point, point: Point) -> Point:
    """The orbit of half the period that is passed between two points, at its flip, as the last point of the branch."""
    before = last.data.half_period_difference
    end = locate(equations, last, point, lambda p: float(np.dot(before, p.data.half_period_difference))) or last
    family, points = equations.family, end.data.points
    guess = 0.5 * (points[: len(points) // 2] + points[len(points) // 2 :])

    def half(value: float) -> Cycle:
        return converge(family, guess, np.array([value]))

    def test(value: float) -> float:
        return flip_test(half(value))

    for low, high in ((float(end.u[-1]) - reach, float(end.u[-1]) + reach) for reach in _REACHES):
        if test(low) * test(high) < 0:
            value = root_between(test, low, high, 1e-15)
            found = half(value)
            if not found.converged:
                break
            u = np.append(np.tile(found.points, (2, 1)).ravel(), value)
            f, _, data = equations.evaluate(u)
            return replace(end, u=u, residual=float(np.abs(f).max()), data=data)
    return end


def doubled_start(family: ParameterFamily, flip: Event, span: float) -> tuple[CycleEquations, Point]:
    """An orbit of twice the period next to a flip, and the equations of its branch; raises `Stopped` if none is found.

    The tangent leads away from the flip.
    """
    direction, base = _critical_direction(flip.cycle, -1.0), np.tile(flip.cycle.points, (2, 1))
    equations = CycleEquations(family, 2 * flip.cycle.period, span)
    return equations, _start(equations, np.append(base, flip.cycle.values), np.concatenate([direction, -direction]))


def _start(equations: CycleEquations, base: np.ndarray, direction: np.ndarray) -> Point:
    """The orbit of another branch next to an orbit (n d + 1,) in a direction (n, d); raises `Stopped`."""
    tangent = np.append(direction.ravel(), 0.0)
    tangent /= length(equations.weights, tangent)
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


def _critical_direction(cycle: Cycle, multiplier: float) -> np.ndarray:
    """The real eigenvector to a multiplier at all points of the orbit, (n, d), with the largest element 1."""
    values, vectors = np.linalg.eig(cycle.monodromy)
    out = [vectors[:, np.argmin(np.abs(values - multiplier))].real]
    for matrix in cycle.result.monodromy[:-1]:
        out.append(matrix @ out[-1])
    directions = np.stack(out)
    return directions / np.abs(directions).max()


def follow_doubled(family: ParameterFamily, flip: Event, bounds: tuple[float, float], settings: Settings,
                   until: Callable[[Branch], bool] | None = None) -> Branch:
    """The branch of orbits of twice the period that begins at a flip."""
    equations, start = doubled_start(family, flip, bounds[1] - bounds[0])
    branch = _follow_one_way(equations, start, bounds, replace(settings, first=start.step), until=until)
    branch.ends = [BranchEnd(float(flip.point.u[-1]), HALVED), *branch.ends]
    return branch


def follow_asymmetric(family: ParameterFamily, pitchfork: Event, bounds: tuple[float, float],
                      settings: Settings) -> Iterator[Branch]:
    """The two branches of asymmetric orbits that begin at a pitchfork, as far as they are found."""
    cycle = pitchfork.cycle
    equations = CycleEquations(family, cycle.period, bounds[1] - bounds[0])
    for sign in (1.0, -1.0):
        try:
            start = _start(equations, unknowns(cycle), sign * _critical_direction(cycle, 1.0))
        except Stopped:
            continue
        branch = _follow_one_way(equations, start, bounds, replace(settings, first=start.step))
        branch.ends = [BranchEnd(float(pitchfork.point.u[-1]), MIRRORED), *branch.ends]
        yield branch


def cascade(family: ParameterFamily, flip: Event, bounds: tuple[float, float], settings: Settings,
            count: int) -> Iterator[tuple[Branch, Event | None]]:
    """The branches of a period-doubling cascade from a flip on: each up to the flip at which it becomes unstable, and
    that flip. There are fewer than ``count`` where no doubled orbit or no further flip is found."""

    def next_flip(branch: Branch) -> Event | None:
        return next((e for e in branch.events if e.kind == FLIP), None)

    following: Event | None = flip
    for _ in range(count):
        if following is None:
            return
        try:
            branch = follow_doubled(
                family, following, bounds, settings, until=lambda branch: next_flip(branch) is not None)
        except Stopped:
            return
        following = next_flip(branch)
        yield branch, following


def outside(family: ParameterFamily, value: float, bounds: tuple[float, float]) -> InputError | None:
    """The error for a start outside the axis, None for one inside."""
    if bounds[0] <= value <= bounds[1]:
        return None
    name = family.axes[0]
    return InputError(f"axis {name}", "must contain the model's own value", f"{bounds[0]:g}:{bounds[1]:g}",
                      f"The model has {name} = {value:g}: set it, or choose another axis.")
