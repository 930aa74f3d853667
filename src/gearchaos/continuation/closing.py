"""Whether a branch or a curve returns to its start or to a copy of it shifted by whole mesh periods, or meets orbits of
half the period."""

from __future__ import annotations

from typing import Any

import numpy as np

from gearchaos.continuation.arclength import Point, between, length
from gearchaos.continuation.shooting import Cycle

_RETURNED = 1e-3
"""A branch has returned to its start if it passes it at a distance of less than this fraction of a step."""


_LEAST_DIFFERENCE = 1e-8
"""Distance of the first point of an orbit from that half a period later, below which the orbit has half the period."""


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

    Parameters
    ----------
    equations : CycleEquations or EventEquations
        Their first ``size`` unknowns are the n points of the orbit.
    start, last, point : Point
        The first point of the branch, and two neighbouring ones.
    """
    weights, n = equations.weights, equations.period
    size = length(weights, point.u - last.u)
    for shift in range(n):
        u, tangent = (_shifted(v, equations.size, n, shift) for v in (start.u, start.tangent))
        before, after = (float(np.sum(weights * tangent * (v - u))) for v in (last.u, point.u))
        near = max(length(weights, point.u - u), length(weights, last.u - u)) < 2 * size
        if near and before < 0 <= after and float(np.sum(weights * tangent * point.tangent)) > 0:
            at = between(equations, last, point, float(np.sum(weights * last.tangent * (u - last.u))))
            if length(weights, at.u - u) < _RETURNED * size:
                return at
    return None


def _shifted(u: np.ndarray, size: int, period: int, shift: int) -> np.ndarray:
    """Unknowns whose first ``size`` are the points of a cycle, with these shifted by whole mesh periods."""
    return np.append(np.roll(u[:size].reshape(period, -1), -shift, axis=0).ravel(), u[size:])
