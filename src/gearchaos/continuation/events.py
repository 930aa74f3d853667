"""Events on a branch of periodic orbits: where they are, located between two neighbouring points of the branch.

Each kind has a test function that changes its sign there. Its root is found by bracketing (Brent's method or bisection)
on corrected orbits, never by extrapolation: next to a graze multipliers change with infinite slope.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import Any

import numpy as np
from scipy.optimize import brentq

from gearchaos.continuation.arclength import Equations, Point, Stopped, along, between
from gearchaos.continuation.shooting import Cycle

FOLD, FLIP, NEIMARK_SACKER, PITCHFORK, NEUTRAL_SADDLE, GRAZE = KINDS = (
    "fold", "flip", "neimark-sacker", "pitchfork", "neutral-saddle", "graze")
"""The kinds of events."""

_RELATIVE = 1e-14
"""To this fraction of the distance of the two points an event is located."""

_NEAR_SINGULAR = 1e-3
"""A root next to which orbits cannot be corrected counts as located if it is bracketed to this fraction of the distance
of the two points."""

MIN_DIVERGENCE = 1e-9
"""Imaginary part from which a critical pair of multipliers counts as complex."""

HALVINGS = 4
"""Times that the distance of two points is halved to follow what changes between them."""


@dataclass(frozen=True, eq=False)
class Event:
    """An event on a branch.

    Attributes
    ----------
    kind : str
        One of `KINDS`, or the name of a user's function.
    point : Point
        The point of the branch.
    boundary : int or None
        For a graze, the boundary of contact that z touches: 1 or −1.
    extremum : int or None
        For a graze, the index of the extremum in `Cycle.extrema`.
    defect : float
        How far the defining equation is from being satisfied: the distance of the critical multiplier from its value,
        or of the extremum of z from the boundary.
    """

    kind: str
    point: Point
    boundary: int | None = None
    extremum: int | None = None
    defect: float = 0.0

    @property
    def cycle(self) -> Cycle:
        """The orbit."""
        return self.point.data


def branch_test(cycle: Cycle) -> float:
    """Π (μ − 1) over all multipliers: up to its sign the determinant of M − 1."""
    return float(np.prod(cycle.multipliers - 1.0).real)


def flip_test(cycle: Cycle) -> float:
    """Π (μ + 1) over all multipliers: the determinant of M + 1."""
    return float(np.prod(cycle.multipliers + 1.0).real)


def pair_test(cycle: Cycle) -> float:
    """Π (μ_i μ_j − 1) over all pairs of multipliers; it vanishes for a pair on the unit circle, and for a neutral
    saddle. It cannot vanish for d = 2, where the product is exp(tr A n T)."""
    return float(np.prod([a * b - 1.0 for a, b in combinations(cycle.multipliers, 2)]).real)


def of_data(test: Callable[[Any], float]) -> Callable[[Point], float]:
    """A test function of what belongs to a point, such as its cycle, as one of the point."""
    return lambda point: test(point.data)


def critical_pair(cycle: Cycle) -> tuple[complex, complex]:
    """The two multipliers whose product is nearest to 1."""
    return min(combinations(cycle.multipliers, 2), key=lambda pair: abs(pair[0] * pair[1] - 1.0))


def locate(
    equations: Equations, first: Point, last: Point, test: Callable[[Point], float]
) -> Point | None:
    """The point between two others where a test function changes its sign; None where it does not, or where the orbits
    cannot be followed."""
    full = along(equations.weights, first, last.u)
    points, values = {0.0: first, full: last}, dict[float, float]()

    def value(distance: float) -> float:
        if distance not in points:
            below, above = max(d for d in points if d < distance), min(d for d in points if d > distance)
            points[distance] = between(equations, first, last, distance, (points[below], points[above]))
        found = test(points[distance])
        if np.isnan(found):
            raise Stopped("the test function is not defined everywhere between the points")
        values[distance] = found
        return found

    if test(first) * test(last) > 0:
        return None
    try:
        root = brentq(value, 0.0, full, xtol=_RELATIVE * full, rtol=1e-15)
        return points[root] if root in points else between(equations, first, last, root)
    except Stopped:
        # at a branch point the equations are singular, so that no orbit can be corrected in the immediate neighbourhood
        for a, b in pairwise(sorted(values)):
            if values[a] * values[b] <= 0 and b - a <= _NEAR_SINGULAR * full:
                return points[a if abs(values[a]) <= abs(values[b]) else b]
        return None


def middle(equations: Equations, first: Point, last: Point) -> Point | None:
    """The point halfway between two others, None where none is found."""
    try:
        return between(equations, first, last, 0.5 * along(equations.weights, first, last.u))
    except Stopped:
        return None
