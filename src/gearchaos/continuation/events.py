"""Events on a branch of periodic orbits: where they are, located between two neighbouring points of the branch.

Each kind has a test function that changes its sign there. Its root is found by bracketing (Brent's method or bisection)
on corrected orbits, never by extrapolation: next to a graze multipliers change with infinite slope.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np
from scipy.optimize import brentq

from gearchaos.continuation.arclength import Equations, Point, Stopped, between
from gearchaos.continuation.extrema import match
from gearchaos.continuation.shooting import Cycle

FOLD, FLIP, NEIMARK_SACKER, PITCHFORK, NEUTRAL_SADDLE, GRAZE = KINDS = (
    "fold", "flip", "neimark-sacker", "pitchfork", "neutral-saddle", "graze")
"""The kinds of events."""

_RELATIVE = 1e-14
"""To this fraction of the distance of the two points an event is located."""

_NEAR_SINGULAR = 1e-3
"""A root next to which orbits cannot be corrected counts as located if it is bracketed to this fraction of the distance
of the two points."""

_BISECTIONS = 60
_HALVINGS = 4
"""Times that a step is halved to follow a pair of extrema of z that exists at one of its ends only."""

_TOUCHING = 1e-9
"""Largest distance of an extremum of z from a boundary that it touches."""

_MIN_DIVERGENCE = 1e-9
"""Imaginary part from which a critical pair of multipliers counts as complex."""


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


def find_events(
    equations: Equations, first: Point, last: Point, user: dict[str, Callable[[Cycle], float]] | None = None
) -> list[Event]:
    """All events between two neighbouring points, in order along the branch."""
    found = [event for search in _SEARCHES for event in search(equations, first, last)]
    for name, function in (user or {}).items():
        found += _user_events(equations, first, last, name, function)
    return sorted(found, key=lambda e: float(np.sum(equations.weights * first.tangent * (e.point.u - first.u))))


def locate(
    equations: Equations, first: Point, last: Point, test: Callable[[Point], float]
) -> Point | None:
    """The point between two others where a test function changes its sign; None where the orbits cannot be followed."""
    full = float(np.sum(equations.weights * first.tangent * (last.u - first.u)))
    points, values = {0.0: first, full: last}, dict[float, float]()

    def value(distance: float) -> float:
        if distance not in points:
            points[distance] = between(equations, first, last, distance)
        found = test(points[distance])
        if np.isnan(found):
            raise Stopped("the test function is not defined everywhere between the points")
        values[distance] = found
        return found

    try:
        root = brentq(value, 0.0, full, xtol=_RELATIVE * full, rtol=1e-15)
        return points[root] if root in points else between(equations, first, last, root)
    except Stopped:
        return _bracketed(points, values, _NEAR_SINGULAR * full)


def _bracketed(points: dict[float, Point], values: dict[float, float], gap: float) -> Point | None:
    """The known point nearest to the root if it is bracketed by two points with a gap of at most this; else None.

    At a branch point the equations are singular, so that no orbit can be corrected in the immediate neighbourhood.
    """
    for a, b in pairwise(sorted(values)):
        if values[a] * values[b] <= 0 and b - a <= gap:
            return points[a if abs(values[a]) <= abs(values[b]) else b]
    return None


def _parameter_slope(point: Point) -> float:
    """Change of the parameter along the branch, which changes its sign at a fold."""
    return float(point.tangent[-1])


def turns_at_branch_point(first: Point, last: Point) -> bool:
    """Whether a branch turns back between two points where it meets another one: from a branch of asymmetric orbits to
    that of their mirror images, at a pitchfork of the symmetric one."""
    return first.orientation * last.orientation < 0 and _parameter_slope(first) * _parameter_slope(last) < 0


def _folds(equations: Equations, first: Point, last: Point) -> Iterator[Event]:
    if _parameter_slope(first) * _parameter_slope(last) < 0 and not turns_at_branch_point(first, last):
        point = locate(equations, first, last, _parameter_slope)
        if point is not None:
            yield Event(FOLD, point, defect=float(np.abs(point.data.multipliers - 1.0).min()))


def _branch_points(equations: Equations, first: Point, last: Point) -> Iterator[Event]:
    if first.orientation * last.orientation < 0:
        point = locate(equations, first, last, _branch_point_test(first, last))
        if point is not None:
            yield Event(PITCHFORK, point, defect=float(np.abs(point.data.multipliers - 1.0).min()))


def _branch_point_test(first: Point, last: Point) -> Callable[[Point], float]:
    """A function of a point that changes its sign at the branch point between two others."""
    if turns_at_branch_point(first, last):
        return _parameter_slope
    if branch_test(first.data) * branch_test(last.data) < 0:
        return lambda p: branch_test(p.data)
    return lambda p: float(p.orientation)


def _flips(equations: Equations, first: Point, last: Point) -> Iterator[Event]:
    if flip_test(first.data) * flip_test(last.data) < 0:
        point = locate(equations, first, last, lambda p: flip_test(p.data))
        if point is not None:
            yield Event(FLIP, point, defect=float(np.abs(point.data.multipliers + 1.0).min()))


def _pairs(equations: Equations, first: Point, last: Point) -> Iterator[Event]:
    if len(first.data.multipliers) > 2 and pair_test(first.data) * pair_test(last.data) < 0:
        point = locate(equations, first, last, lambda p: pair_test(p.data))
        if point is not None:
            a, b = min(combinations(point.data.multipliers, 2), key=lambda pair: abs(pair[0] * pair[1] - 1.0))
            kind = NEIMARK_SACKER if abs(a.imag) > _MIN_DIVERGENCE else NEUTRAL_SADDLE
            yield Event(kind, point, defect=float(abs(a * b - 1.0)))


def _grazes(equations: Equations, first: Point, last: Point, halvings: int = _HALVINGS) -> list[Event]:
    """The grazes between two points; those of both halves where a new pair of extrema cannot be followed so far, or an
    extremum may touch a boundary twice."""
    period, found = first.data.period, list[Event]()
    index, new = match(first.data.extrema, last.data.extrema, period)
    if halvings and _may_touch_twice(equations, first, last, index):
        return _grazes_of_halves(equations, first, last, halvings - 1)
    for number, other in enumerate(index):
        if other < 0:
            continue
        for boundary in (1, -1):
            gap = first.data.extrema[number, 1] - boundary
            if gap * (last.data.extrema[other, 1] - boundary) < 0:
                found += _graze(equations, first, last, number, boundary)
    vanished = [i for i in range(len(index)) if index[i] < 0]
    for point, pairs in ((last, new), (first, _pairs_of(vanished))):
        for pair in pairs:
            for boundary in (1, -1):
                low, high = sorted(point.data.extrema[list(pair), 1])
                if low < boundary < high:
                    event = _graze_of_new_pair(equations, first, last, point is last, boundary, pair)
                    if event is None and halvings:
                        return _grazes_of_halves(equations, first, last, halvings - 1)
                    found += [] if event is None else [event]
    return found


def _grazes_of_halves(equations: Equations, first: Point, last: Point, halvings: int) -> list[Event]:
    """The grazes between two points, searched before and after the point in the middle."""
    full = float(np.sum(equations.weights * first.tangent * (last.u - first.u)))
    try:
        middle = between(equations, first, last, 0.5 * full)
    except Stopped:
        return []
    return _grazes(equations, first, middle, halvings) + _grazes(equations, middle, last, halvings)


def _may_touch_twice(equations: Equations, first: Point, last: Point, index: np.ndarray) -> bool:
    """Whether an extremum is on one side of a boundary at both points, but perhaps on the other side between them.

    The values of the extrema between the points are interpolated by cubic polynomials in Bernstein form, whose values
    lie between the least and the largest coefficient.
    """
    kept = np.flatnonzero(index >= 0)
    before, after = first.data.extrema[kept, 1], last.data.extrema[index[kept], 1]
    full = float(np.sum(equations.weights * first.tangent * (last.u - first.u)))
    turned = max(float(np.sum(equations.weights * last.tangent * first.tangent)), 1e-3)
    slopes = (first.data.extremum_slopes(first.tangent)[kept] * full / 3,
              last.data.extremum_slopes(last.tangent)[index[kept]] * full / (3 * turned))
    coefficients = np.stack([before, before + slopes[0], after - slopes[1], after])
    for boundary in (1, -1):
        beyond = coefficients > boundary
        if np.any((beyond[0] == beyond[3]) & (np.any(beyond, axis=0) != np.all(beyond, axis=0))):
            return True
    return False


def _pairs_of(indices: list[int]) -> list[tuple[int, int]]:
    """Neighbouring indices in pairs."""
    return list(zip(indices[::2], indices[1::2], strict=False))


def _graze(equations: Equations, first: Point, last: Point, number: int, boundary: int) -> Iterator[Event]:
    """The graze of an extremum of the first point that is also one of the last."""

    def gap(point: Point) -> float:
        other = number if point is first else _matched(first, point, number)
        return float("nan") if other < 0 else float(point.data.extrema[other, 1] - boundary)

    point = locate(equations, first, last, gap)
    if point is not None:
        other = _matched(first, point, number)
        if other >= 0:
            yield Event(GRAZE, point, boundary, other, abs(float(point.data.extrema[other, 1] - boundary)))


def _matched(first: Point, point: Point, number: int) -> int:
    """Index at another point of an extremum of the first one, −1 if it is not there."""
    if point is first:
        return number
    return int(match(first.data.extrema, point.data.extrema, first.data.period)[0][number])


def _graze_of_new_pair(
    equations: Equations, first: Point, last: Point, forward: bool, boundary: int, pair: tuple[int, int]
) -> Event | None:
    """The graze of one of two extrema that exist only at the last point (``forward``), or only at the first one.

    Between, they are born with one value of z; from there on one of them passes the boundary. None if the pair cannot
    be followed to that place.
    """
    full = float(np.sum(equations.weights * first.tangent * (last.u - first.u)))
    here, there = (full, 0.0) if forward else (0.0, full)
    own = (last if forward else first).data.extrema[list(pair), 0].mean()
    nearest: tuple[Point, int] | None = None
    try:
        for _ in range(_BISECTIONS):
            middle = 0.5 * (here + there)
            point = between(equations, first, last, middle)
            straddling = _straddling_pair(point.data, own, boundary)
            if straddling is None:
                there = middle
            else:
                here, nearest = middle, (point, straddling)
    except Stopped:
        return None
    if nearest is None:
        return None
    point, number = nearest
    defect = abs(float(point.data.extrema[number, 1] - boundary))
    return Event(GRAZE, point, boundary, number, defect) if defect < _TOUCHING else None


def _straddling_pair(cycle: Cycle, instant: float, boundary: int) -> int | None:
    """The index of that extremum, of the neighbouring pair nearest to an instant, that is nearer to the boundary, if
    the boundary lies between both."""
    extrema, count = cycle.extrema, len(cycle.extrema)
    best = None
    for i in range(count):
        j = (i + 1) % count
        a, b = extrema[i], extrema[j]
        lag = abs((0.5 * (a[0] + b[0]) - instant + cycle.period / 2) % cycle.period - cycle.period / 2)
        if (a[1] - boundary) * (b[1] - boundary) < 0 and lag < 0.1:
            nearer = i if abs(a[1] - boundary) < abs(b[1] - boundary) else j
            if best is None or lag < best[0]:
                best = (lag, nearer)
    return None if best is None else best[1]


def _user_events(
    equations: Equations, first: Point, last: Point, name: str, function: Callable[[Cycle], float]
) -> Iterator[Event]:
    if function(first.data) * function(last.data) < 0:
        point = locate(equations, first, last, lambda p: function(p.data))
        if point is not None:
            yield Event(name, point, defect=abs(function(point.data)))


_SEARCHES = (_folds, _branch_points, _flips, _pairs, _grazes)
