"""Pseudo-arclength continuation of the solutions u of N equations F(u) = 0 in N + 1 unknowns.

Source: H. B. Keller, Numerical solution of bifurcation and nonlinear eigenvalue problems, 1977; E. L. Allgower,
K. Georg, Introduction to Numerical Continuation Methods, SIAM 2003.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from gearchaos.errors import InputError
from gearchaos.flow import CorrectedOrbit, Limits, NotConvergedError

TOLERANCE = 1e-12  # Newton's method ends at a residual of at most this: no equation is violated by more
ACCEPTED = 1e-10  # largest residual of a point whose residual Newton's method cannot lower any more

LIMITS = Limits(TOLERANCE, ACCEPTED, growth=1e3, alternates=0.1, iterations=8)
"""When Newton's method ends; across a corner of the equations it goes to and fro."""

_LANDING = 1e-6
"""Distance from which a curve is taken to an end of an axis where points beyond it would break the model's rules."""

_NO_CONVERGENCE = "Newton's method does not converge"
_FAR = 0.1  # distance from the guess at which Newton's method has left its neighbourhood
_LEAST_COSINE = 0.97  # least cosine of the angle between the tangents of neighbouring points

_CORNER, _LEAST_AT_CORNER = 1e-4, 0.5
"""Steps up to this length may turn more, by this cosine at most: where a contact switch falls on a jump of the
stiffness, the derivatives of P have a kink, and curves a corner."""

_STRAIGHT = 0.995  # from this cosine on the next step may be longer
_MAX_CORRECTION = 0.3  # largest distance of a point from its prediction, relative to the step
_LARGE = 1.5  # orbits of a larger amplitude are followed in steps that are longer in proportion


class Equations(Protocol):
    """N equations in N + 1 unknowns."""

    weights: np.ndarray  # (N + 1,) of the squares of the unknowns in the length of a vector

    def evaluate(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, Any]:
        """F(u) (N,), its derivatives (N, N + 1), and what else belongs to the point.

        Raises `InputError` where the equations do not exist.
        """

    def corrected(self, guess: np.ndarray, rows: np.ndarray) -> tuple[CorrectedOrbit, Any] | None:
        """The solution and what else belongs to it in one call, see `PolynomialEquations.correct`; None without one."""
        return None


class Curve(Equations, Protocol):
    """Equations whose solutions are followed along their curve."""

    size: int  # number of the first unknowns, which are the coordinates of the orbit

    def resolved(self, first: Any, last: Any) -> bool:
        """Whether two neighbouring points, given by what else belongs to them, are near enough to each other."""


@dataclass(frozen=True)
class Settings:
    """Lengths of steps: of the first one, the longest, the shortest, and the shortest with which more resolution is
    sought; and the largest number of points."""

    first: float = 1e-2
    longest: float = 3e-2
    shortest: float = 1e-9
    finest: float = 1e-5
    points: int = 10_000


@dataclass(frozen=True, eq=False)
class Point:
    """A point of a curve of solutions.

    The orientation, the sign of the determinant of the Jacobian with the tangent as last row, changes where another
    curve crosses.
    """

    u: np.ndarray  # (N + 1,) the unknowns
    tangent: np.ndarray  # (N + 1,) of length 1, in the direction in which the curve is followed
    orientation: int
    residual: float  # largest |F| of an equation
    data: Any  # what `Equations.evaluate` returned
    step: float  # distance from the point before

    def reversed(self) -> Point:
        """The point with the opposite direction."""
        return replace(self, tangent=-self.tangent, orientation=-self.orientation)


class Stopped(Exception):  # noqa: N818  (the end of a branch is no error)
    """Newton's method did not find a point of the curve; the message says why."""


def length(weights: np.ndarray, vector: np.ndarray) -> float:
    """Length of a vector (N + 1,) of unknowns."""
    return math.sqrt((weights * vector) @ vector)


def along(weights: np.ndarray, origin: Point, u: np.ndarray) -> float:
    """Distance of unknowns u (N + 1,) from a point along its tangent."""
    return float((weights * origin.tangent) @ (u - origin.u))


def from_polyline(polyline: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances (P − 1,) of a place (N,) from the pieces of a polyline (P, N), and the share of each at which it is
    nearest."""
    direction, offset = np.diff(polyline, axis=0), place - polyline[:-1]
    share = np.clip((offset * direction).sum(1) / np.maximum((direction**2).sum(1), 1e-300), 0.0, 1.0)
    return np.linalg.norm(offset - share[:, None] * direction, axis=1), share


def correct(equations: Equations, guess: np.ndarray, normal: np.ndarray, tangent: np.ndarray,
            step: float = 0.0) -> Point:
    """The solution nearest to a guess in the plane through it with this normal, by Newton's method.

    Its tangent does not turn against ``tangent``; all vectors are (N + 1,). Raises `Stopped` if Newton's method does
    not converge, or leaves the domain of the equations.
    """
    u, row = guess.copy(), equations.weights * normal
    try:
        quick = equations.corrected(guess, np.array([row, equations.weights * tangent]))
    except NotConvergedError:
        raise Stopped(_NO_CONVERGENCE) from None
    if quick is not None:
        found, data = quick
        along = found.tangent / length(equations.weights, found.tangent)
        return Point(found.u, along, found.orientation, found.residual, data, step)
    best: tuple[float, np.ndarray, np.ndarray, Any] | None = None
    before, last = np.inf, np.inf  # residuals
    for _ in range(LIMITS.iterations):
        try:
            f, jacobian, data = equations.evaluate(u)
        except InputError as error:
            far = length(equations.weights, u - guess) > _FAR
            raise Stopped("Newton's method diverges" if far else str(error)) from None
        residual = float(np.abs(f).max())
        if not np.isfinite(residual):
            raise Stopped("the motion diverges")
        stalled = best is not None and not residual < best[0]
        if best is None or not stalled:
            best = residual, u, jacobian, data
        if best[0] <= TOLERANCE or (stalled and best[0] <= ACCEPTED):
            break
        if stalled and residual > LIMITS.growth * best[0]:
            raise Stopped("Newton's method diverges")
        if abs(residual - before) < LIMITS.alternates * residual:
            break
        before, last = last, residual
        change, _ = _solve(np.vstack([jacobian, row]), np.append(-f, -np.dot(row, u - guess)))
        u = u + change
    assert best is not None
    if best[0] > ACCEPTED:
        raise Stopped(_NO_CONVERGENCE)
    residual, u, jacobian, data = best
    # with the tangent as last row the determinant of the Jacobian has the same sign as with the one before
    along, sign = _solve(np.vstack([jacobian, equations.weights * tangent]), np.append(np.zeros(len(jacobian)), 1.0))
    return Point(u, along / length(equations.weights, along), sign, residual, data, step)


def _solve(matrix: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, int]:
    """The solution of a linear system, and the sign of its determinant; raises `Stopped` if it is singular."""
    from scipy.linalg.lapack import dgesv  # here: a verdict needs no such part of scipy

    factors, pivots, found, failed = dgesv(matrix, right)
    if failed or not np.all(np.isfinite(found)):
        raise Stopped("the Jacobian is singular")
    swaps = np.count_nonzero(pivots != np.arange(len(pivots)))
    negative = np.count_nonzero(factors.diagonal() < 0)
    return found, -1 if (swaps + negative) % 2 else 1


def follow(equations: Curve, start: Point, settings: Settings) -> Iterator[Point]:
    """The points of the curve after the start, one at a time.

    Each is expected on the cubic through the last two points with their tangents; for the first step, and after a turn,
    on the tangent. Raises `Stopped`, with the cause, if the step would have to be shorter than the shortest one.
    """
    before, point, size = start, start, settings.first
    for _ in range(settings.points):
        turned = before is point or float((equations.weights * before.tangent) @ point.tangent) < _STRAIGHT
        while True:
            try:
                guess = point.u + size * point.tangent
                if not turned:
                    guess = _hermite(equations.weights, point, (before, point), size)
                after = correct(equations, guess, point.tangent, point.tangent, size)
                cosine = float((equations.weights * after.tangent) @ point.tangent)
                correction = length(equations.weights, after.u - point.u - size * point.tangent)
                fine = size <= settings.finest or equations.resolved(point.data, after.data)
                least = _LEAST_COSINE if size > _CORNER else _LEAST_AT_CORNER
                cause = "" if cosine > least and correction < _MAX_CORRECTION * size else "the branch turns sharply"
                cause = cause if fine else "the multipliers change fast"
            except Stopped as stop:
                cause = str(stop)
            if not cause:
                break
            if size <= settings.shortest:
                raise Stopped(cause)
            size = max(settings.shortest, 0.5 * size)
        straight = cosine > _STRAIGHT and correction < 0.3 * _MAX_CORRECTION * size
        longest = settings.longest * max(1.0, float(np.abs(after.u[: equations.size]).max()) / _LARGE)
        before, point, size = point, after, min(longest, size * (1.6 if straight else 1.0))
        yield point


def _hermite(weights: np.ndarray, origin: Point, pair: tuple[Point, Point], distance: float) -> np.ndarray:
    """The cubic through two points with their tangents, at a distance from an origin along its tangent.

    The tangent of the first one, if both are equal to rounding.
    """
    first, last = pair
    normal = weights * origin.tangent
    full = float(normal @ (last.u - first.u))
    passed = distance - along(weights, origin, first.u)
    share = passed / full if full else 0.0
    start, end = (p.tangent * (full / max(float(normal @ p.tangent), 1e-3)) for p in pair)
    a, b = share * share * (3 - 2 * share), share * (1 - share)
    guess = first.u + a * (last.u - first.u) + b * ((1 - share) * start - share * end)
    return guess + (distance - along(weights, origin, guess)) * origin.tangent


def at_value(equations: Equations, point: Point, index: int, value: float) -> Point | None:
    """The solution with this value of the unknown ``index``, reached from a point whose value is near; None without
    one."""
    distance, slope = value - point.u[index], point.tangent[index]
    if abs(distance) * np.sqrt(equations.weights[index]) > _LANDING or distance * slope < 0:
        return None
    normal = np.zeros(len(point.u))
    normal[index] = 1.0
    guess = point.u + (distance / slope if slope else 0.0) * point.tangent
    guess[index] = value
    try:
        found = correct(equations, guess, normal, point.tangent, point.step)
    except Stopped:
        return None
    return found if length(equations.weights, found.u - guess) < _LANDING else None


def root_between(function: Callable[[float], float], first: float, last: float, xtol: float) -> float:
    """Where a function changes its sign between two places, to ``xtol``, by Brent's method."""
    from scipy.optimize import brentq  # here, since it takes a third of a second to load

    return float(brentq(function, first, last, xtol=xtol, rtol=1e-15))


def crossing(equations: Equations, first: Point, last: Point, index: int, value: float) -> Point | None:
    """The solution with this value of the unknown ``index`` between two neighbouring points; None if it is not near the
    cubic through them."""
    def guess(distance: float) -> np.ndarray:
        return _hermite(equations.weights, first, (first, last), distance)

    full = along(equations.weights, first, last.u)
    if (guess(0.0)[index] - value) * (guess(full)[index] - value) > 0:
        return None
    distance = root_between(lambda s: guess(s)[index] - value, 0.0, full, max(1e-4 * abs(full), 1e-300))
    at, normal = guess(distance), np.zeros(len(first.u))
    at[index], normal[index] = value, 1.0
    try:
        found = correct(equations, at, normal, first.tangent, distance)
    except Stopped:
        return None
    return found if length(equations.weights, found.u - at) < _MAX_CORRECTION * full else None


def between(equations: Equations, first: Point, last: Point, distance: float,
            near: tuple[Point, Point] | None = None) -> Point:
    """The point of the curve between two neighbouring ones, at a distance from the first along its tangent.

    Nearer points on both sides of it, if there are such, save iterations.
    """
    guess = _hermite(equations.weights, first, near or (first, last), distance)
    return correct(equations, guess, first.tangent, first.tangent, distance)
