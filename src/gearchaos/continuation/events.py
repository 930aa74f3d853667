"""All events between two neighbouring points of a branch of periodic orbits: changes of stability, grazes, roots of a
user's functions.

Each kind has a test function that changes its sign there. Its root is found by bracketing (Brent's method or bisection)
on corrected orbits, never by extrapolation: next to a graze multipliers change with infinite slope.

At a graze an extremum of z touches a boundary of contact. Where contact ends with its force, tangent vectors jump as it
begins but not as it ends, so that multipliers differ on both sides: it is a border collision. Extrema appear and vanish
in pairs, a maximum and a minimum, and pass from the end of the cycle to its beginning; `match` says which is which on
neighbouring cycles.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import combinations, pairwise
from typing import Any, NamedTuple

import numpy as np

from gearchaos.continuation.arclength import Equations, Point, Stopped, along, between, root_between
from gearchaos.continuation.shooting import Cycle, count_unstable

FOLD, FLIP, NEIMARK_SACKER, PITCHFORK, NEUTRAL_SADDLE, GRAZE, BORDER_COLLISION = (
    "fold", "flip", "neimark-sacker", "pitchfork", "neutral-saddle", "graze", "border-collision")

_RELATIVE = 1e-14  # to this fraction of the distance of the two points an event is located

_ROUNDING = 1e-14
"""Largest value of a test function that is a rounding error, relative to the larger one at both points: a product over
many pairs of multipliers may be small everywhere."""

_NEAR_SINGULAR = 1e-3
"""A root next to which orbits cannot be corrected counts as located if it is bracketed to this fraction of the distance
of the two points."""

_MIN_DIVERGENCE = 1e-9  # imaginary part from which a critical pair of multipliers counts as complex
_CRITICAL, _COMPLEX = 1e-3, 1e-6
"""Largest distance of the modulus of a critical multiplier from 1 next to its event, and the imaginary part from which
it then counts as complex."""

_HALVINGS = 4  # times that the distance of two points is halved to follow what changes between them

_BISECTIONS = 60

_TOUCHING = 1e-9  # largest distance of an extremum of z from a boundary that it touches


@dataclass(frozen=True, eq=False)
class Event:
    """An event on a branch.

    The defect is how far the defining equation is from being satisfied: the distance of the critical multiplier from
    its value, or of the extremum of z from the boundary.
    """

    kind: str  # one of `KINDS`, or the name of a user's function
    point: Point
    boundary: int | None = None  # for a graze, the boundary of contact that z touches: 1 or −1
    extremum: int | None = None  # for a graze, the index of the extremum in `Cycle.extrema`
    defect: float = 0.0

    @property
    def cycle(self) -> Cycle:
        """The orbit."""
        return self.point.data


def critical_event(multipliers: np.ndarray, exists: bool) -> str:
    """The kind of event next to which a stable orbit has these multipliers (d,), "" where none of them is critical: at
    a fold it ends, at a pitchfork it ``exists`` beyond."""
    critical = multipliers[np.argmin(np.abs(np.abs(multipliers) - 1))]
    if abs(abs(critical) - 1) > _CRITICAL:
        return ""
    if abs(critical.imag) > _COMPLEX:
        return NEIMARK_SACKER
    return FLIP if critical.real < 0 else PITCHFORK if exists else FOLD


def branch_test(cycle: Cycle) -> float:
    """Π (μ − 1) over all multipliers: up to its sign the determinant of M − 1."""
    return float(math.prod([m - 1.0 for m in cycle.multipliers.tolist()]).real)


def flip_test(cycle: Cycle) -> float:
    """Of a period doubling: Π (μ + 1) over all multipliers, the determinant of M + 1."""
    return float(math.prod([m + 1.0 for m in cycle.multipliers.tolist()]).real)


def pair_test(cycle: Cycle) -> float:
    """Π (μ_i μ_j − 1) over all pairs of multipliers; it vanishes for a pair on the unit circle, and for a neutral
    saddle. It cannot vanish for d = 2, where the product is exp(tr A n T)."""
    return float(math.prod([a * b - 1.0 for a, b in combinations(cycle.multipliers.tolist(), 2)]).real)


class EventKind(NamedTuple):
    """What a kind of event says of itself, and how pictures show it.

    Its curve in two parameters is followed unless it is no bifurcation (neutral saddles), needs a symmetry that a
    second parameter breaks (pitchforks), or the derivatives of the flow jump there (border collisions).
    """

    colour: str  # on a light background
    marks: tuple[str, str, str]  # its mark for matplotlib, for Bokeh, and as a character
    changes: float = 0  # most multipliers that cross the unit circle; curves where none does are dotted
    ended: tuple[int, ...] = ()  # periods, in those of a curve, of motions that are born or lose stability there
    curve: bool = True  # whether its curve in two parameters is followed
    test: Callable[[Cycle], float] = lambda cycle: math.nan  # of the multipliers, which vanishes there


KINDS = {
    FOLD: EventKind("#111111", ("o", "circle", "●"), 1, (1,), test=branch_test),
    FLIP: EventKind("#2a7fff", ("s", "square", "■"), 1, (1, 2), test=flip_test),
    NEIMARK_SACKER: EventKind("#d18f00", ("^", "triangle", "▲"), 2, (1,), test=pair_test),
    PITCHFORK: EventKind("#3d5a00", ("D", "diamond", "◆"), 1, (1,), curve=False),
    NEUTRAL_SADDLE: EventKind("#9a9a9a", ("x", "x", "×"), curve=False),
    GRAZE: (_graze := EventKind("#a3158f", ("|", "inverted_triangle", "▼"))),
    BORDER_COLLISION: _graze._replace(changes=math.inf, curve=False)}  # no model has both
"""The kinds of events in the order of legends. Colours differ by at least 25 CIELAB units, also under protanopia,
deuteranopia and tritanopia."""

CHANGE_STABILITY = tuple(name for name, kind in KINDS.items() if kind.changes)


def of_data(test: Callable[[Any], float]) -> Callable[[Point], float]:
    """A test function of what belongs to a point, such as its cycle, as one of the point."""
    return lambda point: test(point.data)


def critical_pair(cycle: Cycle) -> tuple[complex, bool]:
    """The product nearest to 1 of two multipliers, and whether they are complex, not those of a neutral saddle."""
    a, b = min(combinations(cycle.multipliers, 2), key=lambda pair: abs(pair[0] * pair[1] - 1.0))
    return a * b, abs(a.imag) > _MIN_DIVERGENCE


def locate(equations: Equations, first: Point, last: Point, test: Callable[[Point], float]) -> Point | None:
    """The point between two others where a test function changes its sign; None where it does not, or where the orbits
    cannot be followed."""
    full = along(equations.weights, first, last.u)
    points, values = {0.0: first, full: last}, dict[float, float]()
    before, after = test(first), test(last)
    rounding = _ROUNDING * max(abs(before), abs(after))

    def value(distance: float) -> float:
        if distance not in points:
            below, above = max(d for d in points if d < distance), min(d for d in points if d > distance)
            points[distance] = between(equations, first, last, distance, (points[below], points[above]))
        found = test(points[distance])
        if np.isnan(found):
            raise Stopped("the test function is not defined everywhere between the points")
        values[distance] = found
        return 0.0 if abs(found) < rounding else found

    if before * after > 0:
        return None
    try:
        root = root_between(value, 0.0, full, _RELATIVE * full)
        return points[root] if root in points else between(equations, first, last, root)
    except Stopped:
        # at a branch point the equations are singular, so that no orbit can be corrected in the immediate neighbourhood
        for a, b in pairwise(sorted(values)):
            if values[a] * values[b] <= 0 and b - a <= _NEAR_SINGULAR * full:
                return points[a if abs(values[a]) <= abs(values[b]) else b]
        return None


def _middle(equations: Equations, first: Point, last: Point) -> Point | None:
    """The point halfway between two others, None where none is found."""
    try:
        return between(equations, first, last, 0.5 * along(equations.weights, first, last.u))
    except Stopped:
        return None


def find_events(equations: Equations, first: Point, last: Point,
                user: dict[str, Callable[[Cycle], float]] | None = None) -> list[Event]:
    """All events between two neighbouring points, in order along the branch."""
    found = _changes_of_stability(equations, first, last) + _grazes(equations, first, last)
    for name, function in (user or {}).items():
        if function(first.data) * function(last.data) < 0:
            point = locate(equations, first, last, of_data(function))
            if point is not None:
                found.append(Event(name, point, defect=abs(function(point.data))))
    return sorted(found, key=lambda e: along(equations.weights, first, e.point.u))


def _changes_of_stability(equations: Equations, first: Point, last: Point, halvings: int = _HALVINGS) -> list[Event]:
    """The events of multipliers between two points.

    Those of both halves where they do not explain how the number of multipliers outside the unit circle changes, since
    two of them can hide each other.
    """
    located = ((kind, locate(equations, first, last, test)) for kind, test in _tests(first, last))
    found = []
    for kind, point in ((kind, point) for kind, point in located if point is not None):
        if kind == NEIMARK_SACKER:  # a pair of real multipliers with the product 1 is that of a neutral saddle
            product, is_complex = critical_pair(point.data)
            found.append(Event(kind if is_complex else NEUTRAL_SADDLE, point, defect=float(abs(product - 1.0))))
        else:
            defect = np.abs(point.data.multipliers - (-1.0 if kind == FLIP else 1.0)).min()
            found.append(Event(kind, point, defect=float(defect)))
    change = abs(count_unstable(last.data.multipliers) - count_unstable(first.data.multipliers))
    if halvings == 0 or change <= sum(KINDS[event.kind].changes for event in found):
        return found
    middle = _middle(equations, first, last)
    if middle is None:
        return found
    halves = ((first, middle), (middle, last))
    return [event for a, b in halves for event in _changes_of_stability(equations, a, b, halvings - 1)]


def _tests(first: Point, last: Point) -> Iterator[tuple[str, Callable[[Point], float]]]:
    """The kinds of events of multipliers between two points, and the functions that change their signs there."""
    if turns_at_branch_point(first, last):
        yield PITCHFORK, _parameter_slope
    elif _parameter_slope(first) * _parameter_slope(last) < 0:
        yield FOLD, _parameter_slope
    elif first.orientation * last.orientation < 0:
        crosses = branch_test(first.data) * branch_test(last.data) < 0
        yield PITCHFORK, of_data(branch_test) if crosses else lambda p: float(p.orientation)
    if flip_test(first.data) * flip_test(last.data) < 0:
        yield FLIP, of_data(flip_test)
    if len(first.data.multipliers) > 2 and pair_test(first.data) * pair_test(last.data) < 0:
        yield NEIMARK_SACKER, of_data(pair_test)


def _parameter_slope(point: Point) -> float:
    """Change of the parameter along the branch, which changes its sign at a fold."""
    return float(point.tangent[-1])


def turns_at_branch_point(first: Point, last: Point) -> bool:
    """Whether a branch turns back between two points where it meets another one: from a branch of asymmetric orbits to
    that of their mirror images, at a pitchfork of the symmetric one."""
    return first.orientation * last.orientation < 0 and _parameter_slope(first) * _parameter_slope(last) < 0


def _grazes(equations: Equations, first: Point, last: Point, halvings: int = _HALVINGS) -> list[Event]:
    """The grazes between two points.

    Those of both halves where extrema cannot be followed so far, or one may touch a boundary twice.
    """
    full = along(equations.weights, first, last.u)
    if stay_away(first.data.extrema, last.data.extrema, *(
            full * point.data.extremum_slopes(point.tangent) for point in (first, last))):
        return []
    index, new = match(first.data.extrema, last.data.extrema, first.data.period)
    if not (halvings and _may_touch_twice(equations, first, last, index)):
        found = list[Event | None]()
        for event in _touched(equations, first, last, index, new):
            found.append(event)
            if event is None and halvings:
                break
        else:
            return [event for event in found if event is not None]
    middle = _middle(equations, first, last)
    if middle is None:
        return []
    return _grazes(equations, first, middle, halvings - 1) + _grazes(equations, middle, last, halvings - 1)


def stay_away(before: np.ndarray, after: np.ndarray, *moves: np.ndarray) -> bool:
    """Whether the extrema (E, 3) of two neighbouring cycles are the same in order, and each is farther from both
    boundaries than it moves, also by further ``moves`` (E,): most often, so that they need not be matched."""
    if before.shape != after.shape or before[:, 2].tolist() != after[:, 2].tolist():
        return False
    z, z_after = before[:, 1].tolist(), after[:, 1].tolist()
    largest = [max(abs(m) for m in each) for each in zip((after - before)[:, 1].tolist(), *(
        m.tolist() for m in moves), strict=True)]
    return all(move < min(abs(abs(a) - 1.0), abs(abs(b) - 1.0)) for move, a, b in zip(largest, z, z_after, strict=True))


def _touched(equations: Equations, first: Point, last: Point, index: np.ndarray,
             new: list[tuple[int, int]]) -> Iterator[Event | None]:
    """The graze, None if it is not found, of each extremum and each pair of them that appears or vanishes, that must
    touch a boundary."""
    for number, other in enumerate(index):
        for boundary in (1, -1) if other >= 0 else ():
            gap = first.data.extrema[number, 1] - boundary
            if gap * (last.data.extrema[other, 1] - boundary) < 0:
                point = locate(equations, first, last, of_data(gap_above(boundary, first.data, number)))
                yield None if point is None else _graze_at(point, _matched(first.data, point.data, number), boundary)
    vanished = np.flatnonzero(index < 0).tolist()
    for place, pairs in ((last, new), (first, zip(vanished[::2], vanished[1::2], strict=False))):
        for pair in pairs:
            for boundary in (1, -1):
                low, high = sorted(place.data.extrema[list(pair), 1])
                if low < boundary < high:
                    yield _graze_of_new_pair(equations, first, last, place is last, boundary, pair)


def _may_touch_twice(equations: Equations, first: Point, last: Point, index: np.ndarray) -> bool:
    """Whether an extremum is on one side of a boundary at both points, but perhaps on the other side between them.

    The values of the extrema between the points are interpolated by cubic polynomials in Bernstein form, whose values
    lie between the least and the largest coefficient.
    """
    kept = np.flatnonzero(index >= 0)
    before, after = first.data.extrema[kept, 1], last.data.extrema[index[kept], 1]
    full = along(equations.weights, first, last.u)
    turned = max(float(np.sum(equations.weights * last.tangent * first.tangent)), 1e-3)
    slopes = (first.data.extremum_slopes(first.tangent)[kept] * full / 3,
              last.data.extremum_slopes(last.tangent)[index[kept]] * full / (3 * turned))
    coefficients = np.array([before, before + slopes[0], after - slopes[1], after])
    least, largest = coefficients.min(axis=0), coefficients.max(axis=0)
    return any(((least <= boundary) & (boundary < largest) & ((before > boundary) == (after > boundary))).any()
               for boundary in (1, -1))


def _graze_at(point: Point, number: int, boundary: int) -> Event | None:
    """The graze of an extremum, −1 for none, at a point; None unless it touches the boundary."""
    defect = abs(float(point.data.extrema[number, 1] - boundary)) if number >= 0 else np.inf
    return Event(GRAZE, point, boundary, number, defect) if defect < _TOUCHING else None


def _matched(first: Cycle, cycle: Cycle, number: int) -> int:
    """Index at another cycle of an extremum of the first one, −1 if it is not there."""
    return number if cycle is first else int(match(first.extrema, cycle.extrema, first.period)[0][number])


def gap_above(boundary: int, first: Cycle, number: int) -> Callable[[Cycle], float]:
    """How far an extremum of a cycle lies above a boundary on neighbouring cycles; NaN where it cannot be followed."""
    def gap(cycle: Cycle) -> float:
        at = _matched(first, cycle, number)
        return float("nan") if at < 0 else float(cycle.extrema[at, 1] - boundary)

    return gap


def _graze_of_new_pair(equations: Equations, first: Point, last: Point, forward: bool, boundary: int,
                       pair: tuple[int, int]) -> Event | None:
    """The graze of one of two extrema that exist only at the last point (``forward``), or only at the first one.

    Between, they are born with one value of z; from there on one of them passes the boundary. None if the pair cannot
    be followed to that place.
    """
    full = along(equations.weights, first, last.u)
    here, there = (full, 0.0) if forward else (0.0, full)
    own = (last if forward else first).data.extrema[list(pair), 0].mean()
    nearest: tuple[Point, int] | None = None
    try:
        for _ in range(_BISECTIONS):
            halfway = 0.5 * (here + there)
            point = between(equations, first, last, halfway)
            extrema, straddling, least = point.data.extrema, None, 0.1
            for i in range(len(extrema)):  # the neighbours nearest to the pair between which the boundary lies
                j = (i + 1) % len(extrema)
                a, b = extrema[i], extrema[j]
                lag = abs(point.data.lag(0.5 * (a[0] + b[0]), own))
                if (a[1] - boundary) * (b[1] - boundary) < 0 and lag < least:
                    straddling, least = i if abs(a[1] - boundary) < abs(b[1] - boundary) else j, lag
            if straddling is None:
                there = halfway
            else:
                here, nearest = halfway, (point, straddling)
    except Stopped:
        return None
    return None if nearest is None else _graze_at(*nearest, boundary)


def match(before: np.ndarray, after: np.ndarray, period: int) -> tuple[np.ndarray, list[tuple[int, int]]]:
    """Match the extrema of two neighbouring cycles, (E, 3) and (F, 3) as in `Cycle.extrema`.

    Returns the index (E,) in ``after`` of each extremum of ``before``, −1 if it has vanished, and the pairs of extrema
    of ``after`` that are new, by their indices.
    """
    kept, left, new = np.arange(len(before)), np.arange(len(after)), []
    while len(kept) > len(left):
        kept, _ = _without_pair(before, kept, after, left, period)
    while len(left) > len(kept):
        left, pair = _without_pair(after, left, before, kept, period)
        new.append(pair)
    found = np.full(len(before), -1)
    if len(kept):
        shift, cost = _best_rotation(before[kept], after[left], period)
        if np.isfinite(cost):
            found[kept] = left[(np.arange(len(left)) + shift) % len(left)]
    return found, new


def _best_rotation(before: np.ndarray, after: np.ndarray, period: int) -> tuple[int, float]:
    """By how many places equally many extrema are rotated, and the sum of the differences that then remain.

    The cost is infinite if maxima and minima do not alternate alike.
    """
    count = len(before)
    if count == 0:
        return 0, 0.0
    shifts = np.arange(-min(count, 4), min(count, 4) + 1)
    rolled = after[(np.arange(count) + shifts[:, None]) % count]
    lag = rolled[:, :, 0] - before[:, 0]
    lag -= period * np.round(lag / period)
    cost = (np.abs(lag) + np.abs(rolled[:, :, 1] - before[:, 1])).sum(axis=1)
    cost[np.any(rolled[:, :, 2] != before[:, 2], axis=1)] = np.inf
    best = int(np.argmin(cost))
    return int(shifts[best]), float(cost[best])


def _without_pair(many: np.ndarray, index: np.ndarray, few: np.ndarray, others: np.ndarray,
                  period: int) -> tuple[np.ndarray, tuple[int, int]]:
    """Leave out the neighbouring pair of ``many[index]`` whose absence makes it most like ``few[others]``.

    Returns the indices that remain, and the pair.
    """
    if len(index) - len(others) == 1:  # one extremum lies at the seam of the cycle, where it may be lost to rounding
        costs = [_best_rotation(many[np.delete(index, i)], few[others], period)[1] for i in range(len(index))]
        i = int(np.argmin(costs))
        return np.delete(index, i), (int(index[i]), int(index[i]))
    pairs, costs = [(i, (i + 1) % len(index)) for i in range(len(index))], [np.inf]
    if len(index) - len(others) == 2:
        costs = [_best_rotation(many[np.delete(index, pair)], few[others], period)[1] for pair in pairs]
    if not np.any(np.isfinite(costs)):  # or too many to try all combinations: the flattest pairs go first
        costs = [abs(many[index[i], 1] - many[index[j], 1]) for i, j in pairs]
    pair = pairs[int(np.argmin(costs))]
    return np.delete(index, pair), (int(index[pair[0]]), int(index[pair[1]]))
