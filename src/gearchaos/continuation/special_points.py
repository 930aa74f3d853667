"""Points of codimension 2 on the curve of an event: where a second condition holds.

Names as in Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory, 2004, and for grazing as in M. di Bernardo et al.,
Piecewise-smooth Dynamical Systems, 2008.

Where a curve has a corner, it is followed beyond. On one side of a graze multipliers change with the square root of the
penetration, on the other side smoothly. So the curve of a fold, a flip or a Neimark–Sacker point that reaches a graze
has a corner there: it arrives at an angle and leaves at a tangent to the graze curve, or the other way round. The
corner is the root, along the graze curve, of the test function of the event. The curve beyond is the root on a half
circle about it.

Where a contact switch falls on a jump of the stiffness, the derivatives of P have a kink, and curves a corner too. The
curve beyond is then searched on a whole circle about the last point, in the surface of orbits over both parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from itertools import combinations, pairwise
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from gearchaos.continuation.arclength import Equations, Point, Stopped, along, correct, from_polyline, length
from gearchaos.continuation.defining import EventEquations, EventState, GrazeEquations
from gearchaos.continuation.events import (
    FLIP,
    FOLD,
    GRAZE,
    NEIMARK_SACKER,
    TESTS,
    branch_test,
    critical_pair,
    flip_test,
    gap_above,
    locate,
    match,
    of_data,
    pair_test,
    stay_away,
)
from gearchaos.continuation.shooting import Cycle, evaluate

_RESONANCES = {"1:1": 0.0, "1:4": np.pi / 2, "1:3": 2 * np.pi / 3, "1:2": np.pi}
"""Arguments of the multipliers at the strong resonances of a Neimark–Sacker curve."""

_NOISE = {"generalised flip": 1e-3, "grazing-fold": 1e-10}
"""Least magnitude of a test function that counts. In permanent contact or free flight the equations are linear: the
coefficient of a flip is 0, and on the graze curve of motions periodic with any amplitude the multiplier is 1."""

_STEP = 4e-4  # longer step of the differences for the normal form of a flip, in half backlashes
_KINK = 1e-2  # relative change of a derivative with the step from which one of the steps reaches across a kink

_REACH = (0.0, 1e-5, 1e-4, 1e-3, 3e-3, 1e-2, 3e-2)
"""Distances from an orbit, along a curve through it, between which a point of codimension 2 is searched."""

_RADII = (1e-3, 3e-3, 3e-4, 1e-2)  # radii of the half circle

_STEEP = np.logspace(-7, -0.5, 14)
_ANGLES = np.concatenate([_STEEP, np.linspace(0.4, np.pi - 0.4, 8), np.pi - _STEEP[::-1]])
"""Angles on the half circle between which the curve is searched, dense near the graze curve."""

_WHOLE_CIRCLE = np.linspace(0.1, 0.1 + 2 * np.pi, 49)  # angles on the circle about a corner that is no graze
_RECENT = 40  # number of the last points of a curve that tell from which side of a graze it comes
_CLEAR = 1e-6  # distance from the boundary that does: farther away another extremum may be the nearest one
_SEPARATE = 0.3  # least distance of a point beyond a corner from the curve so far, relative to the radius


class SpecialPoint(NamedTuple):
    """A point of codimension 2."""

    kind: str  # such as "cusp" or "grazing-fold"
    point: Point  # of the curve; its data is an `EventState`


def find_special_points(equations: EventEquations, first: Point, last: Point, kind: str) -> list[SpecialPoint] | None:
    """All points of codimension 2 between two neighbouring points of the curve of an event, in order along it; None if
    a graze between them is not found, as where the curve has a corner there."""
    found = []
    for name, test in _tests(kind, first.data, equations):
        before, after = test(first.data), test(last.data)
        if before * after < 0 and min(abs(before), abs(after)) > _NOISE.get(name, 0.0):
            point = locate(equations, first, last, of_data(test))
            if point is None or (name.endswith("neimark-sacker") and not critical_pair(point.data.cycle)[1]):
                continue
            found.append(SpecialPoint(name, point))
    grazes = _second_grazes(equations, first, last, kind)
    return None if grazes is None else sorted(found + grazes, key=lambda s: along(equations.weights, first, s.point.u))


def _tests(kind: str, reference: EventState,
           equations: EventEquations) -> Iterator[tuple[str, Callable[[EventState], float]]]:
    """Names and test functions of the points that a curve of this kind can have."""
    if kind == FOLD:
        yield "cusp", lambda s: _aligned_curvature(s, reference)
        yield "1:1 resonance", lambda s: _others(s, 1.0)
        yield "fold-flip", lambda s: flip_test(s.cycle)
        yield "fold-neimark-sacker", lambda s: _pairs(s, 1.0)
    elif kind == FLIP:
        yield "generalised flip", lambda s: _known_coefficient(s, equations)
        yield "1:2 resonance", lambda s: _others(s, -1.0)
        yield "fold-flip", lambda s: branch_test(s.cycle)
        yield "flip-neimark-sacker", lambda s: _pairs(s, -1.0)
    elif kind == NEIMARK_SACKER:
        for name, angle in _RESONANCES.items():
            yield f"{name} resonance", partial(lambda angle, s: float(s.angle or 0.0) - angle, angle)
    elif kind == GRAZE:
        yield "grazing-fold", lambda s: branch_test(s.cycle)
        yield "grazing-flip", lambda s: flip_test(s.cycle)
        if len(reference.cycle.multipliers) > 2:
            yield "grazing-neimark-sacker", lambda s: pair_test(s.cycle)


def _others(state: EventState, value: float) -> float:
    """Π (μ − value) over all multipliers but the nearest one."""
    m = state.cycle.multipliers
    return float(np.prod(np.delete(m, np.argmin(np.abs(m - value))) - value).real)


def _pairs(state: EventState, critical: float) -> float:
    """Π (μ_i μ_j − 1) over the pairs of multipliers other than the critical one."""
    m = state.cycle.multipliers
    m = np.delete(m, np.argmin(np.abs(m - critical)))
    return float(np.prod([a * b - 1.0 for a, b in combinations(m, 2)]).real) if len(m) > 1 else 1.0


def _aligned_curvature(state: EventState, reference: EventState) -> float:
    """w* D²P[v, v] with the sign of w chosen as at the reference."""
    assert state.covector is not None and reference.covector is not None and state.curvature is not None
    return float(np.sign(np.sum(state.covector * reference.covector)) * state.curvature)


def flip_coefficient(state: EventState, equations: EventEquations) -> float:
    """Cubic coefficient of the normal form of a flip; the doubled orbits are stable where it is positive.

    From differences in the critical direction v of the monodromy matrix A, which is exact (Kuznetsov 2004, (5.49)):
    w* C(v, v, v)/6 + w* B(v, (1 − A)⁻¹ B(v, v))/2 with w* v = 1, B and C the second and third derivatives. NaN where
    another multiplier is 1, or the differences reach across a graze or a kink of P.
    """
    cycle, family = state.cycle, equations.family
    flow, a = family.flow(cycle.values[None]), cycle.monodromy
    values, vectors = np.linalg.eig(a)
    adjoint_values, adjoint = np.linalg.eig(a.T)
    v = vectors[:, np.argmin(np.abs(values + 1.0))].real
    w = adjoint[:, np.argmin(np.abs(adjoint_values + 1.0))].real
    w = w / (w @ v)
    steps = np.array([_STEP, 0.5 * _STEP])
    x, switches, around = cycle.points[0] + np.outer([*steps, *-steps], v), np.zeros(4, np.int64), np.eye(len(v))
    for _ in range(cycle.period):
        result = flow.advance(x, np.zeros(4, np.int64))
        x, around, switches = result.w, result.monodromy @ around, switches + result.switch_count
    if np.any(switches != len(cycle.switches)):
        return float("nan")
    ahead, back = around[:2], around[2:]
    seconds = (ahead - back) / (2 * steps[:, None, None])  # B(v, ·)
    thirds = (ahead - 2 * a + back) @ v / steps[:, None] ** 2
    if any(np.abs(d[1] - d[0]).max() > _KINK * np.abs(d[1]).max() for d in (seconds, thirds)):
        return float("nan")
    second, third = ((4 * d[1] - d[0]) / 3 for d in (seconds, thirds))  # with an error O(step⁴)
    try:
        y = np.linalg.solve(np.eye(len(v)) - a, second @ v)
    except np.linalg.LinAlgError:
        return float("nan")
    return float(w @ third / 6 + w @ second @ y / 2)


_known_coefficient = lru_cache(maxsize=8)(flip_coefficient)
"""Every point is the last one of a step and the first of the next."""


def _second_grazes(equations: EventEquations, first: Point, last: Point, kind: str) -> list[SpecialPoint] | None:
    """Where another extremum of z touches a boundary; None if one of these points is not found."""
    before, after, found = first.data.cycle.extrema, last.data.cycle.extrema, []
    others = [np.delete(e, [] if s.extremum is None else s.extremum, axis=0) for e, s in (
        (before, first.data), (after, last.data))]
    if stay_away(*others):
        return []
    index, _ = match(before, after, first.data.cycle.period)
    name = "double graze" if kind == GRAZE else f"grazing-{kind}"
    for number, other in enumerate(index):
        if other < 0 or number == first.data.extremum or other == last.data.extremum:
            continue
        for boundary in (1, -1):
            if (before[number, 1] - boundary) * (after[other, 1] - boundary) < 0:
                gap = gap_above(boundary, first.data.cycle, number)
                point = locate(equations, first, last, of_data(partial(lambda gap, s: gap(s.cycle), gap)))
                if point is None and kind != GRAZE:
                    point = _corner_between(equations, first, last, boundary, number, int(other))
                if point is None:
                    return None
                found.append(SpecialPoint(name, point))
    return found


def _corner_between(equations: EventEquations, first: Point, last: Point, boundary: int, number: int,
                    other: int) -> Point | None:
    """The corner at the graze of an extremum, by its indices at two neighbouring points, that the step between them
    passes; None if it is not found there."""
    near, index = min(((first, number), (last, other)), key=lambda c: abs(c[0].data.cycle.extrema[c[1], 1] - boundary))
    size = equations.size + 2
    weights, reach = equations.weights[:size], length(equations.weights, last.u - first.u)
    try:
        corner = _Grazes(equations, near, index).corner(reach)
    except (Stopped, ValueError):
        return None
    return None if corner is None or length(weights, corner.u - near.u[:size]) > reach else corner


def beyond_graze(equations: EventEquations, points: Sequence[Point]) -> tuple[SpecialPoint, Point | None] | None:
    """The corner of a curve, not of a graze, at a graze, and the first point of the curve beyond it, None if it is not
    found again.

    At the last of the points, the curve so far, z nearly touches a boundary. The tangent leads away from the corner.
    """
    try:
        grazes = _Grazes(equations, points[-1])
        corner = grazes.corner()
        if corner is None:
            return None
        gaps = [grazes.gap(point.data.cycle) for point in points[: -_RECENT - 1 : -1]]
        side = -float(np.sign(next((gap for gap in gaps if abs(gap) > _CLEAR), max(gaps, key=abs)))) or 1.0
        found = grazes.beyond(corner, side, points, True) or grazes.beyond(corner, -side, points, False)
        return SpecialPoint(f"grazing-{equations.kind}", corner), found
    except Stopped:
        return None


class _Grazes:
    """Orbits near a graze: an extremum of z, the nearest to a boundary unless its number is given, lies at a given
    distance beyond this."""

    def __init__(self, equations: EventEquations, point: Point, number: int | None = None) -> None:
        self.equations, extrema = equations, point.data.cycle.extrema
        if number is None:
            number = int(np.argmin(np.abs(np.abs(extrema[:, 1]) - 1.0)))
        self.boundary, self.instant = int(np.sign(extrema[number, 1])), float(extrema[number, 0])
        normal = point.tangent[: equations.size + 2]
        self.origin = correct(self.at(0.0), point.u[: equations.size + 2], normal, normal)

    def at(self, gap: float) -> GrazeEquations:
        """The equations of orbits whose extremum lies this much above the boundary."""
        e = self.equations
        x, y = 1.0 / np.sqrt(e.weights[e.size : e.size + 2])
        return GrazeEquations(e.family, e.period, (x, y), self.boundary + gap, self.instant)

    def gap(self, cycle: Cycle) -> float:
        """How far the extremum of an orbit lies above the boundary."""
        return float(cycle.extrema[cycle.nearest_extremum(self.instant, self.boundary), 1] - self.boundary)

    def point(self, origin: Point, distance: float, gap: float) -> Point:
        """The orbit at a distance from a graze along its curve, with a gap."""
        return correct(self.at(gap), origin.u + distance * origin.tangent, origin.tangent, origin.tangent)

    def corner(self, reach: float = _REACH[-1]) -> Point | None:
        """The graze at which the event occurs too, nearest to the origin."""

        def at(distance: float) -> Point:
            return self.point(self.origin, distance, 0.0)

        return _nearest_root(of_data(lambda state: TESTS[self.equations.kind](state.cycle)), at, reach)

    def beyond(self, corner: Point, side: float, points: Sequence[Point], other: bool) -> Point | None:
        """The first point of the curve on one side of the graze: gap positive or negative; ``other`` than that from
        which the points lead to the corner."""

        def on_circle(radius: float, angle: float) -> Point:
            return self.point(corner, radius * float(np.cos(angle)), side * radius * float(np.sin(angle)))

        return _first_on_circles(self.equations, corner.u, on_circle, _RADII, _ANGLES, points, other)


def joint(equations: EventEquations, near: Point, reach: float) -> SpecialPoint | None:
    """Where a curve of folds or grazes joins the flip curve of half the period, at a distance of at most ``reach`` from
    one of its points; None if it is not found.

    The curve's own equations are singular there. So it is located by those of half the period: on the curve of grazes
    where the multiplier is −1, or for folds, if that is nearer, on the flip curve where the coefficient vanishes.
    """
    if equations.kind not in (FOLD, GRAZE) or equations.period % 2:
        return None
    n, size, spans = equations.period // 2, equations.size, 1.0 / np.sqrt(equations.weights[-2:])
    guess, normal = (np.append(u[:size].reshape(2, -1).mean(axis=0), u[size:]) for u in (near.u, near.tangent))
    if length(equations.weights, _twice(guess) - near.u) > reach:
        return None
    flips = EventEquations(equations.family, FLIP, n, (float(spans[0]), float(spans[1])))
    start = replace(near, u=guess, tangent=normal, data=EventState(
        evaluate(equations.family, guess[:-2].reshape(n, -1), guess[-2:])))
    searches: dict[str, Callable[[], Point | None]] = {"grazing-flip": lambda: _Grazes(flips, start).corner(reach)}
    if equations.kind == FOLD:
        searches["generalised flip"] = lambda: _degenerate_flip(flips, start, reach)
    found = None
    for name, search in searches.items():
        try:
            point = search()
        except (Stopped, ValueError):  # ValueError: no extremum, or no coefficient at a point of the curve
            continue
        distance = reach if point is None else length(equations.weights, _twice(point.u) - near.u)
        if point is not None and distance < reach:
            reach, u = distance, _twice(point.u)
            defect, _, data = equations.evaluate(u)
            found = SpecialPoint(name, replace(near, u=u, residual=float(np.abs(defect).max()), data=data))
    return found


def _twice(u: np.ndarray) -> np.ndarray:
    """The unknowns of an orbit over twice its period."""
    return np.append(np.tile(u[:-2], 2), u[-2:])


def _degenerate_flip(flips: EventEquations, near: Point, reach: float) -> Point | None:
    """The flip nearest to a point, and in reach, at which the coefficient of the normal form vanishes."""
    origin = correct(flips, near.u, near.tangent, near.tangent)

    def at(distance: float) -> Point:
        return correct(flips, origin.u + distance * origin.tangent, origin.tangent, origin.tangent)

    return _nearest_root(of_data(lambda state: flip_coefficient(state, flips)), at, reach)


class _Slice(Equations):
    """Orbits along the two parameters of an event's equations, in the plane through ``origin`` (n d + 2,) at a right
    angle to ``across`` (n d + 2,)."""

    def __init__(self, equations: EventEquations, origin: np.ndarray, across: np.ndarray) -> None:
        self.family, self.period = equations.family, equations.period
        self.weights = equations.weights[: len(origin)]
        self.origin, self.row = origin, self.weights * across

    def evaluate(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, EventState]:
        """Defects and the distance from the plane, their derivatives, and the orbit."""
        cycle = evaluate(self.family, u[:-2].reshape(self.period, -1), u[-2:])
        defect = np.append(cycle.defect.ravel(), float(self.row @ (u - self.origin)))
        return defect, np.vstack([cycle.jacobian, self.row]), EventState(cycle)


def beyond_kink(equations: EventEquations, points: Sequence[Point]) -> Point | None:
    """The first point of a curve beyond the last one, where it has a corner that is no graze; None if there is none."""
    size = equations.size + 2
    origin, weights = points[-1].u[:size], equations.weights[:size]
    _, _, right = np.linalg.svd(points[-1].data.cycle.jacobian / np.sqrt(weights))
    first, second = (v / np.sqrt(weights) for v in right[-2:])

    def on_circle(radius: float, angle: float) -> Point:
        along = np.cos(angle) * first + np.sin(angle) * second
        across = -np.sin(angle) * first + np.cos(angle) * second
        return correct(_Slice(equations, origin, across), origin + radius * along, along, along)

    return _first_on_circles(equations, origin, on_circle, _RADII[:2], _WHOLE_CIRCLE, points)


def _first_on_circles(equations: EventEquations, corner: np.ndarray, on_circle: Callable[[float, float], Point],
                      radii: Sequence[float], angles: np.ndarray, points: Sequence[Point],
                      other: bool = False) -> Point | None:
    """The first point of a curve beyond a corner (n d + 2,), from circles about it of these radii and angles, which
    may lie on the ``other`` side of a graze than the points of the curve so far."""
    test = of_data(lambda state: TESTS[equations.kind](state.cycle))
    for radius in radii:
        for root in roots_on_circle(test, partial(on_circle, radius), angles):
            known = not other and _passes(equations, points, root.u, radius)
            found = None if known else _first_point(equations, corner, root.u, points[-1], radius)
            if found is not None:
                return found
    return None


def _nearest_root(test: Callable[[Point], float], at: Callable[[float], Point], reach: float) -> Point | None:
    """The point of a curve, given by its distance from an origin, nearest to this at which a test function changes its
    sign; None if there is none in reach."""
    test_at = lru_cache(maxsize=None)(lambda distance: test(at(distance)))
    for inner, outer in ((a, b) for a, b in pairwise(_REACH) if a < reach):
        for a, b in ((inner, outer), (-inner, -outer)):
            if test_at(a) * test_at(b) <= 0:
                return at(float(brentq(test_at, a, b, xtol=1e-14)))
    return None


def roots_on_circle(test: Callable[[Point], float], on_circle: Callable[[float], Point],
                    angles: np.ndarray) -> Iterator[Point]:
    """The points of a circle at which a test function changes its sign between two of these angles."""

    def value(angle: float) -> float:
        try:
            return test(on_circle(angle))
        except Stopped:
            return float("nan")

    for (first, before), (last, after) in pairwise((angle, value(angle)) for angle in angles.tolist()):
        if before * after < 0:
            try:
                yield on_circle(float(brentq(value, first, last, xtol=1e-13)))
            except (Stopped, RuntimeError, ValueError):  # ValueError: no orbit at an angle between both
                continue


def _passes(equations: EventEquations, points: Sequence[Point], u: np.ndarray, radius: float) -> bool:
    """Whether the curve so far passes an orbit ``u`` (n d + 2,), at a distance that is small beside a radius."""
    scale = np.sqrt(equations.weights[: len(u)])
    line, place = scale * np.stack([p.u[: len(u)] for p in points]), scale * u
    distance, _ = from_polyline(line, place)
    return float(distance.min(initial=float(np.linalg.norm(line[0] - place)))) < _SEPARATE * radius


def _first_point(equations: EventEquations, corner: np.ndarray, u: np.ndarray, last: Point,
                 radius: float) -> Point | None:
    """The point of the event's curve next to an orbit ``u`` (n d + 2,) at a distance from a corner (n d + 2,) beyond
    the last point.

    Its tangent leads away from the corner. None if Newton's method leads elsewhere.
    """
    size, weights = len(u), equations.weights[: len(u)]
    rest = last.u[size:]
    away = np.append(u - corner, np.zeros(len(rest)))
    away /= length(equations.weights, away)
    try:
        found = correct(equations, np.append(u, rest), away, away, radius)
    except Stopped:
        return None
    near = length(weights, found.u[:size] - u) < _SEPARATE * radius
    return found if near else None
