"""Corners of the curves of events, at which they are followed beyond.

On one side of a graze multipliers change with the square root of the penetration, on the other side smoothly. So the
curve of a fold, a flip or a Neimark–Sacker point that reaches a graze has a corner there: it arrives at an angle and
leaves at a tangent to the graze curve, or the other way round. The corner is the root, along the graze curve, of the
test function of the event. The curve beyond is the root on a half circle about it.

Where a contact switch falls on a jump of the stiffness, the derivatives of P have a kink, and curves a corner too. The
curve beyond is then searched on a whole circle about the last point, in the surface of orbits over both parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from functools import lru_cache, partial
from itertools import pairwise

import numpy as np

from gearchaos.continuation.arclength import Equations, Point, Stopped, correct, from_polyline, length, root_between
from gearchaos.continuation.defining import EventEquations, EventState, GrazeEquations
from gearchaos.continuation.events import KINDS, of_data
from gearchaos.continuation.shooting import Cycle, evaluate

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


def beyond_graze(equations: EventEquations, points: Sequence[Point]) -> tuple[Point, Point | None] | None:
    """The corner of a curve, not of a graze, at a graze, and the first point of the curve beyond it, None if it is not
    found again.

    At the last of the points, the curve so far, z nearly touches a boundary. The tangent leads away from the corner.
    """
    try:
        grazes = Grazes(equations, points[-1])
        corner = grazes.corner()
        if corner is None:
            return None
        gaps = [grazes.gap(point.data.cycle) for point in points[: -_RECENT - 1 : -1]]
        side = -float(np.sign(next((gap for gap in gaps if abs(gap) > _CLEAR), max(gaps, key=abs)))) or 1.0
        found = grazes.beyond(corner, side, points, True) or grazes.beyond(corner, -side, points, False)
        return corner, found
    except Stopped:
        return None


class Grazes:
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

        return nearest_root(of_data(lambda state: KINDS[self.equations.kind].test(state.cycle)), at, reach)

    def beyond(self, corner: Point, side: float, points: Sequence[Point], other: bool) -> Point | None:
        """The first point of the curve on one side of the graze: gap positive or negative; ``other`` than that from
        which the points lead to the corner."""

        def on_circle(radius: float, angle: float) -> Point:
            return self.point(corner, radius * float(np.cos(angle)), side * radius * float(np.sin(angle)))

        return _first_on_circles(self.equations, corner.u, on_circle, _RADII, _ANGLES, points, other)


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
    """The first point of a curve beyond a corner (n d + 2,), with a tangent that leads away from it.

    It is next to an orbit on one of the circles about the corner of these radii and angles, which may lie on the
    ``other`` side of a graze than the points of the curve so far. None where Newton's method leads elsewhere.
    """
    test, size = of_data(lambda state: KINDS[equations.kind].test(state.cycle)), len(corner)
    rest, weights = points[-1].u[size:], equations.weights[:size]
    scale = np.sqrt(weights)
    line = scale * np.stack([p.u[:size] for p in points])
    for radius in radii:
        for root in roots_on_circle(test, partial(on_circle, radius), angles):
            place = scale * root.u
            to_curve = from_polyline(line, place)[0].min(initial=float(np.linalg.norm(line[0] - place)))
            if not other and to_curve < _SEPARATE * radius:
                continue  # the curve so far passes it
            away = np.append(root.u - corner, np.zeros(len(rest)))
            away /= length(equations.weights, away)
            with suppress(Stopped):
                found = correct(equations, np.append(root.u, rest), away, away, radius)
                if length(weights, found.u[:size] - root.u) < _SEPARATE * radius:
                    return found
    return None


def nearest_root(test: Callable[[Point], float], at: Callable[[float], Point], reach: float) -> Point | None:
    """The point of a curve, given by its distance from an origin, nearest to this at which a test function changes its
    sign; None if there is none in reach."""
    test_at = lru_cache(maxsize=None)(lambda distance: test(at(distance)))
    for inner, outer in ((a, b) for a, b in pairwise(_REACH) if a < reach):
        for a, b in ((inner, outer), (-inner, -outer)):
            if test_at(a) * test_at(b) <= 0:
                return at(root_between(test_at, a, b, 1e-14))
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
                yield on_circle(root_between(value, first, last, 1e-13))
            except (Stopped, RuntimeError, ValueError):  # ValueError: no orbit at an angle between both
                continue
