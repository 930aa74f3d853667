"""When two orbits are the same: up to a shift by whole mesh periods, over a shorter period, at the return of a branch.

Two tolerances decide that. Cycles that `shooting.converge` has found are known to nearly all digits: they are the same
up to `SAME_POINT`. The attractor of a classification is polished by the n-th iterate alone. Near the end of its
stability it is known to no more than 1e-10/(1 − |μ|), so that attractors are the same up to `SAME_ATTRACTOR`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from gearchaos.continuation.arclength import Point, along, between, length
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.shooting import Cycle, converge
from gearchaos.dynamics.orbits import SAME_POINT

SAME_ATTRACTOR = 1e-4
"""An orbit is an attractor known already if one of its points is one of the attractor's, up to this distance."""

_RETURNED = 1e-3
"""A branch has returned to its start if it passes it at a distance of less than this fraction of a step."""

_LEAST_DIFFERENCE = 1e-8
"""Distance of the first point of an orbit from that half a period later, below which the orbit has half the period."""


def passes(points: np.ndarray, state: np.ndarray) -> bool:
    """Whether a state (d,) is one of the points (n, d) of an orbit."""
    return bool(np.abs(points - state).max(axis=1).min() < SAME_POINT)


def shift_difference(first: np.ndarray, second: np.ndarray) -> float:
    """Largest difference of a coordinate of two orbits (n, d), at the shift by whole mesh periods where it is least."""
    return min(float(np.abs(np.roll(first, -k, axis=0) - second).max()) for k in range(len(first)))


def same_cycle(first: Cycle, second: Cycle) -> bool:
    """Whether two cycles are one orbit, up to a shift of phase by whole mesh periods."""
    return first.period == second.period and shift_difference(first.points, second.points) < SAME_POINT


def minimal(family: ParameterFamily, cycle: Cycle) -> Cycle:
    """The cycle over its minimal period."""
    n = cycle.period
    for k in (k for k in range(1, n) if n % k == 0):
        if np.abs(np.roll(cycle.points, -k, axis=0) - cycle.points).max() < SAME_POINT:
            return converge(family, cycle.points[:k], cycle.values)
    return cycle


def has_half_period(cycle: Cycle) -> bool:
    """Whether an orbit with an even number of points is one of half the period."""
    return cycle.period % 2 == 0 and float(np.linalg.norm(cycle.half_period_difference)) < _LEAST_DIFFERENCE


def joins_half_period(last: Cycle, cycle: Cycle) -> bool:
    """Whether orbits pass one of half the period between two neighbouring ones, beyond which both halves are exchanged,
    or reach it."""
    if cycle.period % 2:
        return False
    before, after = last.half_period_difference, cycle.half_period_difference
    opposite = float(before @ after) < -0.5 * float(np.linalg.norm(before) * np.linalg.norm(after))
    return opposite or has_half_period(cycle)


def returned_start(equations: Any, start: Point, last: Point, point: Point) -> Point | None:
    """The point at the start, between two neighbouring points, if the branch passes it there; else None.

    The start may be shifted by whole mesh periods.

    Parameters
    ----------
    equations : CycleEquations or EventEquations
        Their first ``size`` unknowns are the n points of the orbit.
    start, last, point : Point
        The first point of the branch, and two neighbouring ones.
    """

    def shifted(u: np.ndarray, shift: int) -> np.ndarray:
        points = u[: equations.size].reshape(equations.period, -1)
        return np.append(np.roll(points, -shift, axis=0).ravel(), u[equations.size :])

    weights = equations.weights
    size = length(weights, point.u - last.u)
    for shift in range(equations.period):
        u, tangent = shifted(start.u, shift), shifted(start.tangent, shift)
        before, after = (float(np.sum(weights * tangent * (v - u))) for v in (last.u, point.u))
        near = max(length(weights, point.u - u), length(weights, last.u - u)) < 2 * size
        if near and before < 0 <= after and float(np.sum(weights * tangent * point.tangent)) > 0:
            at = between(equations, last, point, along(weights, last, u))
            if length(weights, at.u - u) < _RETURNED * size:
                return at
    return None
