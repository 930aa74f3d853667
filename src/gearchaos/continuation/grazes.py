"""Grazes between two neighbouring points of a branch: where an extremum of z touches a boundary of contact."""

from __future__ import annotations

import numpy as np

from gearchaos.continuation.arclength import Equations, Point, Stopped, between
from gearchaos.continuation.events import GRAZE, HALVINGS, Event, locate, middle
from gearchaos.continuation.extrema import match
from gearchaos.continuation.shooting import Cycle

_BISECTIONS = 60

_TOUCHING = 1e-9
"""Largest distance of an extremum of z from a boundary that it touches."""


def find_grazes(equations: Equations, first: Point, last: Point, halvings: int = HALVINGS) -> list[Event]:
    """The grazes between two points; those of both halves where extrema cannot be followed so far, or one may touch a
    boundary twice."""
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
                event = _graze(equations, first, last, number, boundary)
                if event is None and halvings:
                    return _grazes_of_halves(equations, first, last, halvings - 1)
                found += [] if event is None else [event]
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
    point = middle(equations, first, last)
    if point is None:
        return []
    return find_grazes(equations, first, point, halvings) + find_grazes(equations, point, last, halvings)


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


def _graze(equations: Equations, first: Point, last: Point, number: int, boundary: int) -> Event | None:
    """The graze of an extremum of the first point that is also one of the last; None if it cannot be followed there."""

    def gap(point: Point) -> float:
        other = number if point is first else _matched(first, point, number)
        return float("nan") if other < 0 else float(point.data.extrema[other, 1] - boundary)

    point = locate(equations, first, last, gap)
    other = -1 if point is None else _matched(first, point, number)
    if point is None or other < 0:
        return None
    defect = abs(float(point.data.extrema[other, 1] - boundary))
    return Event(GRAZE, point, boundary, other, defect) if defect < _TOUCHING else None


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
