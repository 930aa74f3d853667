"""Where the curve of an event meets a graze, and how it goes on beyond.

On one side of a graze multipliers change with the square root of the penetration, on the other side smoothly. So the
curve of a fold, a flip or a Neimark–Sacker point that reaches a graze has a corner there: it arrives at an angle and
leaves at a tangent to the graze curve, or the other way round. The corner is the root, along the graze curve, of the
test function of the event. The curve beyond is the root on a half circle about it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import brentq

from gearchaos.continuation.arclength import Point, Stopped, correct, length
from gearchaos.continuation.codimension2 import SpecialPoint
from gearchaos.continuation.defining import EventEquations, EventState, GrazeEquations
from gearchaos.continuation.events import FLIP, FOLD, flip_test, pair_test
from gearchaos.continuation.shooting import Cycle

_REACH = np.array([0.0, 1e-5, 1e-4, 1e-3, 3e-3, 1e-2, 3e-2])
"""Distances from the last point, along the graze curve, between which the corner is searched."""

_RADII = (1e-3, 3e-3, 3e-4, 1e-2)
"""Radii of the half circle."""

_ANGLES = np.concatenate([np.logspace(-7, -0.5, 14), np.linspace(0.4, np.pi - 0.4, 8), np.pi - np.logspace(-0.5, -7, 14)])
"""Angles on the half circle between which the curve is searched, dense near the graze curve."""


def test_function(kind: str, cycle: Cycle) -> float:
    """The function of the multipliers that vanishes at an event of this kind."""
    if kind == FOLD:
        return float(np.prod(cycle.multipliers - 1.0).real)
    return flip_test(cycle) if kind == FLIP else pair_test(cycle)


def beyond_graze(equations: EventEquations, before: Point, last: Point) -> tuple[SpecialPoint, Point | None] | None:
    """The corner of a curve at a graze, and the first point of the curve beyond it.

    Parameters
    ----------
    equations : EventEquations
        Those of the event, no graze.
    before, last : Point
        An earlier point of the curve, and the last one, at which z nearly touches a boundary.

    Returns
    -------
    SpecialPoint
    Point or None
        The tangent leads away from the corner; None if the curve is not found again.
    """
    try:
        grazes = _Grazes(equations, last)
        corner = grazes.corner()
        if corner is None:
            return None
        side = -np.sign(grazes.gap(before.data.cycle)) or 1.0
        return SpecialPoint(f"grazing-{equations.kind}", corner), grazes.beyond(corner, float(side), last)
    except Stopped:
        return None


class _Grazes:
    """Orbits near a graze: their extremum of z lies at a given distance beyond the boundary."""

    def __init__(self, equations: EventEquations, point: Point) -> None:
        self.equations, extrema = equations, point.data.cycle.extrema
        number = int(np.argmin(np.abs(np.abs(extrema[:, 1]) - 1.0)))
        self.boundary, self.instant = int(np.sign(extrema[number, 1])), float(extrema[number, 0])
        size = equations.size + 2
        self.weights = equations.weights[:size]
        normal = point.tangent[:size]
        self.origin = correct(self.at(0.0), point.u[:size], normal, normal)

    def at(self, gap: float) -> GrazeEquations:
        """The equations of orbits whose extremum lies this much above the boundary."""
        e = self.equations
        spans = tuple(1.0 / np.sqrt(e.weights[e.size : e.size + 2]))
        return GrazeEquations(e.family, e.period, (spans[0], spans[1]), self.boundary + gap, self.instant)

    def gap(self, cycle: Cycle) -> float:
        """How far the extremum of an orbit lies above the boundary."""
        lag = np.abs((cycle.extrema[:, 0] - self.instant + cycle.period / 2) % cycle.period - cycle.period / 2)
        near = np.argmin(lag + np.abs(cycle.extrema[:, 1] - self.boundary))
        return float(cycle.extrema[near, 1] - self.boundary)

    def point(self, origin: Point, distance: float, gap: float) -> Point:
        """The orbit at a distance from a graze along its curve, with a gap."""
        return correct(self.at(gap), origin.u + distance * origin.tangent, origin.tangent, origin.tangent)

    def test(self, point: Point) -> float:
        """The test function of the event at an orbit."""
        return test_function(self.equations.kind, point.data.cycle)

    def corner(self) -> Point | None:
        """The graze at which the event occurs too, nearest to the origin."""

        def value(distance: float) -> float:
            return self.test(self.point(self.origin, distance, 0.0))

        for inner, outer in zip(_REACH[:-1], _REACH[1:], strict=True):
            for sign in (1.0, -1.0):
                a, b = sign * float(inner), sign * float(outer)
                if value(a) * value(b) <= 0:
                    return self.point(self.origin, float(brentq(value, a, b, xtol=1e-14)), 0.0)
        return None

    def beyond(self, corner: Point, side: float, last: Point) -> Point | None:
        """The first point of the curve on one side of the graze: gap positive or negative."""
        for radius in _RADII:

            def on_circle(angle: float, radius: float = radius) -> Point:
                return self.point(corner, radius * float(np.cos(angle)), side * radius * float(np.sin(angle)))

            for start in self._roots(on_circle):
                found = self._start(corner, start, last, radius)
                if found is not None:
                    return found
        return None

    def _roots(self, on_circle) -> list[Point]:  # type: ignore[no-untyped-def]
        """The points of a half circle at which the test function changes its sign."""
        values, roots = [], []
        for angle in _ANGLES:
            try:
                values.append(self.test(on_circle(float(angle))))
            except Stopped:
                values.append(np.nan)
        for i in range(len(_ANGLES) - 1):
            if values[i] * values[i + 1] < 0:
                try:
                    a, b = float(_ANGLES[i]), float(_ANGLES[i + 1])
                    angle = brentq(lambda x: self.test(on_circle(x)), a, b, xtol=1e-13)
                    roots.append(on_circle(float(angle)))
                except Stopped:
                    continue
        return roots

    def _start(self, corner: Point, start: Point, last: Point, radius: float) -> Point | None:
        """A point of the event's curve next to an orbit on the half circle, with the tangent away from the corner."""
        e, size = self.equations, self.equations.size + 2
        u = np.append(start.u, last.u[size:])
        away = np.append(start.u - corner.u, np.zeros(len(u) - size))
        away /= length(e.weights, away)
        try:
            found = correct(e, u, away, away, radius)
        except Stopped:
            return None
        data: EventState = found.data
        near = length(self.weights, found.u[:size] - start.u) < 0.3 * radius
        return replace(found, step=radius) if near and data.cycle.residual < 1e-9 else None
