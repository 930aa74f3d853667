"""Curves of events in two parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from gearchaos.continuation.arclength import Point, Settings, Stopped, at_value, correct, follow, point_of
from gearchaos.continuation.branch import AXIS_END, CLOSED, LARGEST, POINT_LIMIT, UNBOUNDED, follow_branch
from gearchaos.continuation.codimension2 import SpecialPoint, find_special_points
from gearchaos.continuation.crossing import beyond_graze, beyond_kink
from gearchaos.continuation.defining import CRITICAL, EventEquations, EventSeed, EventState, event_equations
from gearchaos.continuation.events import FOLD, GRAZE, NEIMARK_SACKER, Event, locate
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.same_orbit import has_half_period, joins_half_period, returned_start
from gearchaos.continuation.shooting import Cycle
from gearchaos.errors import InputError

SETTINGS = Settings(first=5e-3, longest=2e-2, shortest=1e-6)
"""Steps along a curve, unless others are given."""

_TOUCHING = 1e-3
"""Distance of an extremum of z from a boundary up to which a curve that stops has met a graze."""

_AT_EVENT, _AT_GRAZE = 1e-4, 1e-7
"""Distance of a multiplier from its critical value, or of an extremum of z from a boundary, up to which an orbit is at
an event. At a fold, a multiplier changes by the square root of a rounding error."""

_SAME_PLACE = 1e-6
"""Distance of two points of codimension 2 of one kind, relative to the axes, below which they are one."""

_MAX_CORNERS = 8
"""Most corners at grazes that a curve is followed through."""

MERGED = "the extremum of z vanishes together with a neighbouring one"
_MERGING = 1e-2
"""Distance in mesh periods up to which two extrema of nearly the same z are about to merge."""

AT_FLIP = "joins the flip curve of half the period"

_JOINED = {FOLD: "generalised flip", GRAZE: "grazing-flip"}
"""The point of codimension 2 at which a curve joins the flip curve of half the period, by kind."""

_FINAL = (AXIS_END, CLOSED, POINT_LIMIT, UNBOUNDED, AT_FLIP, "1:1 resonance", "1:2 resonance")
"""Why a curve ends for good."""

Bounds = tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True)
class CurveEnd:
    """Where a curve ends, (x, y), and why."""

    x: float
    y: float
    why: str


@dataclass(eq=False)
class Curve:
    """A curve of an event in two parameters.

    Attributes
    ----------
    family : ParameterFamily
        The model along both parameters.
    kind : str
        The event.
    period : int
    points : list of Point
        In order along the curve; `Point.data` is an `EventState`.
    special : list of SpecialPoint
        Points of codimension 2, in order along the curve.
    ends : list of CurveEnd
        Of the first and the last point; empty for a closed curve.
    closed : bool
    boundary : int or None
        For a graze, the boundary of contact that z touches.
    """

    family: ParameterFamily
    kind: str
    period: int
    points: list[Point] = field(default_factory=list)
    special: list[SpecialPoint] = field(default_factory=list)
    ends: list[CurveEnd] = field(default_factory=list)
    closed: bool = False
    boundary: int | None = None

    @property
    def values(self) -> np.ndarray:
        """Both parameters at the points, (P, 2)."""
        return np.array([point.data.cycle.values for point in self.points])


def find_event(
    model_family: ParameterFamily, start: Cycle, kind: str, bounds: tuple[float, float], settings: Settings
) -> Event:
    """The event of this kind nearest to the start on the branch of an orbit along the first axis.

    Raises
    ------
    InputError
        If the branch has none.
    """
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
    """An orbit as a seed of a curve of this kind, if it is at such an event already up to rounding errors.

    Parameters
    ----------
    cycle : Cycle
    values : (2,)
        Both parameters.
    kind : str
        The event: fold, flip, neimark-sacker or graze.
    """
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


def follow_curve(
    family: ParameterFamily, seed: EventSeed, bounds: Bounds, settings: Settings = SETTINGS
) -> Curve:
    """Follow the curve of an event in both directions.

    Parameters
    ----------
    family : ParameterFamily
        The model along two parameters.
    seed : EventSeed
    bounds : two pairs of float
        Ends of both axes.
    settings : Settings

    Raises
    ------
    Stopped
        If the event is not found again along two parameters.
    """
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
    if ahead.closed:
        return replace(ahead, special=_distinct(ahead.special, spans), boundary=seed.boundary)
    equations.accept(first.data)
    back = _one_way(equations, replace(first, tangent=-first.tangent), bounds, settings)
    points = [replace(p, tangent=-p.tangent) for p in back.points[:0:-1]] + ahead.points
    return Curve(family, seed.kind, seed.period, points, _distinct(back.special[::-1] + ahead.special, spans),
                 back.ends + ahead.ends, False, seed.boundary)


def _distinct(special: list[SpecialPoint], spans: tuple[float, float]) -> list[SpecialPoint]:
    """The points of codimension 2 without those met twice, before a corner and at it."""
    out: list[SpecialPoint] = []
    for found in special:
        values = found.point.data.cycle.values
        same = (s for s in out if s.kind == found.kind)
        if not any(np.all(np.abs(s.point.data.cycle.values - values) < _SAME_PLACE * np.array(spans)) for s in same):
            out.append(found)
    return out


def _one_way(equations: EventEquations, start: Point, bounds: Bounds, settings: Settings) -> Curve:
    """Follow a curve from a point in the direction of its tangent to its end."""
    curve = Curve(equations.family, equations.kind, equations.period, [start])
    why = _follow_piece(curve, equations, bounds, settings)
    for _ in range(_MAX_CORNERS):
        beyond = None if why in _FINAL or equations.kind == GRAZE else _beyond_corner(curve, equations)
        if beyond is None:
            break
        curve.points.append(beyond)
        why = _follow_piece(curve, equations, bounds, replace(settings, first=beyond.step))
    if why not in _FINAL and _touches(equations, curve.points[-1]):
        curve.special.append(SpecialPoint(f"grazing-{equations.kind}", curve.points[-1]))
        why = f"grazing-{equations.kind}: meets a graze, where multipliers change with infinite slope"
    if equations.kind == GRAZE and why not in _FINAL and _extrema_merge(curve.points[-1].data):
        why = MERGED
    curve.closed = why == CLOSED
    x, y = map(float, equations.values(curve.points[-1].u))
    curve.ends = [] if curve.closed else [CurveEnd(x, y, why)]
    return curve


def _beyond_corner(curve: Curve, equations: EventEquations) -> Point | None:
    """The next point of a curve that ends at a corner; if that is a graze, it is added to the special points."""
    if not _touches(equations, curve.points[-1]):
        return beyond_kink(equations, curve.points)
    found = beyond_graze(equations, curve.points)
    if found is None:
        return None
    curve.special.append(found[0])
    return found[1]


def _follow_piece(curve: Curve, equations: EventEquations, bounds: Bounds, settings: Settings) -> str:
    """Follow a curve from its last point until it ends or turns too sharply, and return why."""
    try:
        for point in follow(equations, curve.points[-1], settings):
            last, why = _end_between(curve, equations, point, bounds) or (point, "")
            if last is not curve.points[-1]:  # a curve that starts at an end of an axis has no other point there
                curve.special += find_special_points(equations, curve.points[-1], last, equations.kind)
                curve.points.append(last)
            equations.accept(last.data)
            if why == AT_FLIP and equations.kind in _JOINED:
                curve.special.append(SpecialPoint(_JOINED[equations.kind], last))
            if why:
                return why
    except Stopped as stop:
        return _why_stopped(curve, equations, bounds, str(stop))
    return POINT_LIMIT


def _why_stopped(curve: Curve, equations: EventEquations, bounds: Bounds, cause: str) -> str:
    """Why a curve cannot be followed; next to a limit of the model's rules it is taken to the end of the axis."""
    last = curve.points[-1]
    for index, pair in enumerate(bounds):
        for bound in pair:
            landed = at_value(equations, last, equations.size + index, bound)
            if landed is not None:
                curve.points.append(landed)
                return AXIS_END
    return f"step too small: {cause}"


def _touches(equations: EventEquations, point: Point) -> bool:
    """Whether z touches a boundary of contact besides the event itself."""
    if equations.kind == GRAZE:
        return False
    gaps = np.abs(np.abs(point.data.cycle.extrema[:, 1]) - 1.0)
    return len(gaps) > 0 and float(gaps.min()) < _TOUCHING


def _extrema_merge(state: EventState) -> bool:
    """Whether the extremum of z that touches a boundary is about to vanish together with a neighbouring one."""
    extrema, number = state.cycle.extrema, state.extremum
    assert number is not None
    lags, heights = np.abs(np.delete(extrema, number, axis=0)[:, :2] - extrema[number, :2]).T
    return bool(np.any((lags < _MERGING) & (heights < _MERGING**2)))


def _end_between(
    curve: Curve, equations: EventEquations, point: Point, bounds: Bounds
) -> tuple[Point, str] | None:
    """The point at which the curve ends between its last point and this one, and why; None if it goes on."""
    last, tests = curve.points[-1], _end_tests(equations, bounds)
    for test, why, bound in tests:
        if test(point) < 0:
            found = locate(equations, last, point, test) if test(last) > 0 else None
            return (last if found is None else _moved_to(equations, found, bound)), why
    if equations.amplitude(point.u) > LARGEST:
        return point, UNBOUNDED
    if joins_half_period(last.data.cycle, point.data.cycle):
        before = last.data.cycle.half_period_difference
        found = locate(equations, last, point, lambda p: float(before @ p.data.cycle.half_period_difference))
        return found or last, AT_FLIP
    returned = returned_start(equations, curve.points[0], last, point) if len(curve.points) > 3 else None
    if returned is not None:
        return returned, CLOSED
    return None


def _moved_to(equations: EventEquations, point: Point, bound: tuple[int, float] | None) -> Point:
    """A point next to the end of an axis, moved so that the unknown of this index has exactly this value."""
    if bound is None:
        return point
    u = point.u.copy()
    u[bound[0]] = bound[1]
    return point_of(equations, u, point.tangent, point.step)


_EndTest = tuple[Callable[[Point], float], str, "tuple[int, float] | None"]


def _end_tests(equations: EventEquations, bounds: Bounds) -> list[_EndTest]:
    """Functions of a point that become negative where a curve ends, why it ends there, and at which value of which
    unknown if that is the end of an axis."""
    tests: list[_EndTest] = []
    for i in (0, 1):
        for bound, inwards in zip(bounds[i], (1.0, -1.0), strict=True):
            index = equations.size + i
            tests.append((partial(_inside, index, bound, inwards), AXIS_END, (index, bound)))
    if equations.kind == NEIMARK_SACKER:
        tests.append((lambda p: float(p.u[-1]), "1:1 resonance", None))
        tests.append((lambda p: float(np.pi - p.u[-1]), "1:2 resonance", None))
    return tests


def _inside(index: int, bound: float, inwards: float, point: Point) -> float:
    """How far an unknown lies inside a bound."""
    return inwards * float(point.u[index] - bound)
