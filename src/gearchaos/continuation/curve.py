"""Curves of events in two parameters."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from gearchaos.continuation.arclength import Point, Settings, Stopped, along, at_value, correct, crossing, follow
from gearchaos.continuation.branch import AXIS_END, CLOSED, LARGEST, POINT_LIMIT, UNBOUNDED, follow_branch
from gearchaos.continuation.corners import beyond_graze, beyond_kink
from gearchaos.continuation.defining import CRITICAL, EventEquations, EventSeed, event_equations
from gearchaos.continuation.events import GRAZE, NEIMARK_SACKER, Event, locate
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.shooting import Cycle, has_half_period, joins_half_period, returned_start
from gearchaos.continuation.special_points import SpecialPoint, find_special_points, joint
from gearchaos.errors import InputError

SETTINGS = Settings(first=5e-3, longest=2e-2, shortest=1e-6)  # steps along a curve, unless others are given
_TOUCHING = 1e-3  # distance of an extremum of z from a boundary up to which a curve that stops has met a graze

_NEAR_JOINT = 1e-3  # distance up to which a curve that stops next to a flip curve of half the period has joined it

_AT_EVENT, _AT_GRAZE = 1e-4, 1e-7
"""Distance of a multiplier from its critical value, or of an extremum of z from a boundary, up to which an orbit is at
an event. At a fold, a multiplier changes by the square root of a rounding error."""

_SAME_PLACE = 1e-6
"""Distance of two points of codimension 2 of one kind, relative to the axes, below which they are one."""

_SAME_CORNER = 1e-5  # likewise of two corners of one curve at grazes

_MAX_CORNERS = 8  # most corners at grazes that a curve is followed through

MERGED = "the extremum of z vanishes together with a neighbouring one"
_MERGING = 1e-2  # distance in mesh periods up to which two extrema of nearly the same z are about to merge

AT_FLIP = "joins the flip curve of half the period"

_FINAL = (AXIS_END, CLOSED, POINT_LIMIT, UNBOUNDED, AT_FLIP, "1:1 resonance", "1:2 resonance")
"""Why a curve ends for good."""

Bounds = tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True, eq=False)
class CurveData:
    """The curve of an event in two parameters as plain arrays, P points in order along it."""

    kind: str
    period: int
    values: np.ndarray  # (P, 2) of both parameters
    points: np.ndarray  # (P, n, d) of the orbits
    multipliers: np.ndarray  # (P, d)
    residual: np.ndarray  # (P,)
    angle: np.ndarray  # (P,) argument of the critical multiplier of a Neimark–Sacker point in radians, else NaN
    special: list[tuple[str, np.ndarray]]  # points of codimension 2, in order along the curve, and their values (2,)
    ends: list[tuple[float, float, str]]  # where it ends, and why; none if it is closed
    closed: bool
    boundary: int | None  # for a graze, the boundary of contact that z touches


@dataclass(eq=False)
class _Piece:
    """A curve followed one way: its points, whose data are `EventState`s, and those of codimension 2."""

    points: list[Point]
    special: list[SpecialPoint] = field(default_factory=list)
    why: str = ""  # it ends

    @property
    def end(self) -> tuple[float, float, str]:
        """Where it ends, and why."""
        x, y = map(float, self.points[-1].data.cycle.values)
        return x, y, self.why


def find_event(model_family: ParameterFamily, start: Cycle, kind: str, bounds: tuple[float, float],
               settings: Settings) -> Event:
    """The event of this kind nearest to the start on the branch of an orbit along the first axis; raises `InputError`
    if the branch has none."""
    branch = follow_branch(model_family, start, bounds, settings)
    found = [e for e in branch.events if e.kind == kind]
    if not found:
        kinds = ", ".join(sorted({e.kind for e in branch.events})) or "none"
        name = model_family.axes[0]
        raise InputError(
            "event", f"must be one on the branch of the start along {name} from {bounds[0]:g} to {bounds[1]:g}", kind,
            f"The branch of period {start.period} has these: {kinds}. {'Choose one of them. ' if branch.events else ''}"
            "With the axes exchanged, a wider axis or another start there may be one.")
    own = start.values[0]
    return min(found, key=lambda e: abs(float(e.cycle.values[0]) - own))


def event_at(cycle: Cycle, values: np.ndarray, kind: str) -> EventSeed | None:
    """An orbit at both parameters (2,) as a seed of a curve of this kind, if it is at such an event already up to
    rounding errors."""
    seed = EventSeed(kind, cycle.points, np.asarray(values, float))
    multipliers = cycle.multipliers
    if kind == GRAZE:
        gaps = np.abs(np.abs(cycle.extrema[:, 1]) - 1.0) if len(cycle.extrema) else np.full(1, np.inf)
        number = int(np.argmin(gaps))
        if gaps[number] > _AT_GRAZE:
            return None
        instant, z = cycle.extrema[number, :2]
        return replace(seed, boundary=1 if z > 0 else -1, instant=float(instant))
    if kind == NEIMARK_SACKER:
        upper = multipliers[multipliers.imag > 0]
        critical = min(upper, key=lambda m: abs(abs(m) - 1.0), default=0.0)
        return replace(seed, angle=float(np.angle(critical))) if abs(abs(critical) - 1.0) < _AT_EVENT else None
    return seed if np.abs(multipliers - CRITICAL[kind]).min() < _AT_EVENT else None


def follow_curve(family: ParameterFamily, seed: EventSeed, bounds: Bounds, settings: Settings = SETTINGS) -> CurveData:
    """Follow the curve of an event in both directions, between the ends of both axes; raises `Stopped` if the event is
    not found again along the two parameters."""
    spans = (bounds[0][1] - bounds[0][0], bounds[1][1] - bounds[1][0])
    equations = event_equations(family, seed, spans)
    u = equations.unknowns(seed)
    normal = np.zeros(len(u))
    normal[equations.size : equations.size + 2] = 1.0  # any direction in which the curve can be left
    first = correct(equations, u, normal, normal)
    if has_half_period(first.data.cycle):
        raise Stopped("the orbit has a smaller period")
    equations.accept(first.data)
    ahead = _one_way(equations, first, bounds, settings)
    points, special, pieces = ahead.points, ahead.special, [ahead]
    if ahead.why != CLOSED:
        equations.accept(first.data)
        back = _one_way(equations, first.reversed(), bounds, settings)
        points, special, pieces = back.points[:0:-1] + points, back.special[::-1] + special, [back, ahead]
    states, distinct = [point.data for point in points], list[tuple[str, np.ndarray]]()
    for kind, point in special:  # without those met twice, before a corner and at it
        values = point.data.cycle.values
        if not any(k == kind and np.all(np.abs(v - values) < _SAME_PLACE * np.array(spans)) for k, v in distinct):
            distinct.append((kind, values))
    return CurveData(
        seed.kind, seed.period, np.array([s.cycle.values for s in states]), np.stack([s.cycle.points for s in states]),
        np.stack([s.cycle.multipliers for s in states]), np.array([p.residual for p in points]),
        np.array([np.nan if s.angle is None else s.angle for s in states]), distinct,
        [piece.end for piece in pieces if piece.why != CLOSED], ahead.why == CLOSED, seed.boundary,
    )


def _one_way(equations: EventEquations, start: Point, bounds: Bounds, settings: Settings) -> _Piece:
    """Follow a curve from a point in the direction of its tangent to its end."""
    curve, corners = _Piece([start]), list[np.ndarray]()
    spans = np.array([high - low for low, high in bounds])
    why = _follow_piece(curve, equations, bounds, settings)
    for _ in range(_MAX_CORNERS):
        met = None if why in _FINAL else joint(equations, curve.points[-1], _NEAR_JOINT)
        if met is not None:
            curve.points.append(met.point)
            curve.special.append(met)
            why = AT_FLIP
        if why in _FINAL or equations.kind == GRAZE:
            break
        if _touches(equations, curve.points[-1]):
            corner, beyond = beyond_graze(equations, curve.points) or (None, None)
            if corner is not None:
                curve.special.append(SpecialPoint(f"grazing-{equations.kind}", corner))
                values = corner.data.cycle.values
                if any(np.all(np.abs(values - known) < _SAME_CORNER * spans) for known in corners):
                    break  # it would go back along itself
                corners.append(values)
        else:
            beyond = beyond_kink(equations, curve.points)
        if beyond is None:
            break
        curve.points.append(beyond)
        why = _follow_piece(curve, equations, bounds, replace(settings, first=beyond.step))
    if why not in _FINAL and _touches(equations, curve.points[-1]):
        curve.special.append(SpecialPoint(f"grazing-{equations.kind}", curve.points[-1]))
        change = "jump" if equations.family.model.law.releases else "change with infinite slope"
        why = f"grazing-{equations.kind}: meets a graze, where multipliers {change}"
    if equations.kind == GRAZE and why not in _FINAL:  # is the touching extremum about to vanish with its neighbour?
        state = curve.points[-1].data
        extrema, number = state.cycle.extrema, state.extremum
        lags, heights = np.abs(np.delete(extrema, number, axis=0)[:, :2] - extrema[number, :2]).T
        why = MERGED if np.any((lags < _MERGING) & (heights < _MERGING**2)) else why
    curve.why = why
    return curve


def _follow_piece(curve: _Piece, equations: EventEquations, bounds: Bounds, settings: Settings) -> str:
    """Follow a curve from its last point until it ends or turns too sharply, and return why."""
    try:
        for count, point in enumerate(follow(equations, curve.points[-1], settings)):
            last = curve.points[-1]
            end, why = _end_between(curve, equations, point, bounds) or (point, "")
            met = joint(equations, end, max(2 * point.step, _NEAR_JOINT)) if why == AT_FLIP else None
            end = end if met is None else met.point
            ahead = along(equations.weights, last, end.u) > 0  # not at the start, at an end of an axis
            special = find_special_points(equations, last, end, equations.kind) if ahead else []
            if point.step > settings.finest and (special is None or (why == AT_FLIP and end is last)):
                shorter = replace(settings, first=0.5 * point.step, points=settings.points - count)
                return _follow_piece(curve, equations, bounds, shorter)
            if why == AT_FLIP:  # where further conditions hold, since both halves of the orbit are the same
                special = [s for s in special or [] if np.abs(s.point.u - end.u).max() > _SAME_PLACE]
            curve.special += (special or []) + ([] if met is None else [met])
            if end is not last:
                curve.points.append(end)
            equations.accept(end.data)
            if why:
                return why
    except Stopped as stop:
        for index, pair in enumerate(bounds):
            for bound in pair:  # next to a limit of the model's rules the curve is taken to the end of the axis
                landed = at_value(equations, curve.points[-1], equations.size + index, bound)
                if landed is not None:
                    curve.points.append(landed)
                    return AXIS_END
        return f"step too small: {stop}"
    return POINT_LIMIT


def _touches(equations: EventEquations, point: Point) -> bool:
    """Whether z touches a boundary of contact besides the event itself."""
    if equations.kind == GRAZE:
        return False
    gaps = np.abs(np.abs(point.data.cycle.extrema[:, 1]) - 1.0)
    return len(gaps) > 0 and float(gaps.min()) < _TOUCHING


def _end_between(curve: _Piece, equations: EventEquations, point: Point, bounds: Bounds) -> tuple[Point, str] | None:
    """The point at which the curve ends between its last point and this one, and why; None if it goes on."""
    last = curve.points[-1]
    limits = [  # index of an unknown, its limit, on which side of it the curve lies, why it ends there
        (equations.size + i, bound, inwards, AXIS_END)
        for i, pair in enumerate(bounds) for bound, inwards in zip(pair, (1.0, -1.0), strict=True)]
    if equations.kind == NEIMARK_SACKER:
        limits += [(-1, 0.0, 1.0, "1:1 resonance"), (-1, np.pi, -1.0, "1:2 resonance")]
    passed = []  # of two limits passed in one step, the curve ends at the first
    for index, limit, inwards, why in limits:
        before, after = (inwards * float(p.u[index] - limit) for p in (last, point))
        if after < 0:
            passed.append((max(before, 0.0) / (max(before, 0.0) - after), index, limit, why))
    if passed:
        share, index, limit, why = min(passed)
        end = crossing(equations, last, point, index, limit) if share > 0 else None
        return end or locate(equations, last, point, lambda p: float(p.u[index] - limit)) or last, why
    if np.abs(point.u[: equations.size]).max() > LARGEST:
        return point, UNBOUNDED
    if joins_half_period(last.data.cycle, point.data.cycle):
        before = last.data.cycle.half_period_difference
        found = locate(equations, last, point, lambda p: float(before @ p.data.cycle.half_period_difference))
        return found or last, AT_FLIP
    returned = returned_start(equations, curve.points[0], last, point) if len(curve.points) > 3 else None
    return None if returned is None else (returned, CLOSED)
