"""All events between two neighbouring points of a branch."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import combinations

import numpy as np

from gearchaos.continuation.arclength import Equations, Point
from gearchaos.continuation.events import (
    FLIP,
    FOLD,
    HALVINGS,
    MIN_DIVERGENCE,
    NEIMARK_SACKER,
    NEUTRAL_SADDLE,
    PITCHFORK,
    Event,
    branch_test,
    flip_test,
    locate,
    middle,
    pair_test,
)
from gearchaos.continuation.grazes import find_grazes
from gearchaos.continuation.orbit import count_unstable
from gearchaos.continuation.shooting import Cycle

_CHANGES = {FOLD: 1, FLIP: 1, PITCHFORK: 1, NEIMARK_SACKER: 2, NEUTRAL_SADDLE: 0}
"""By how many the number of multipliers outside the unit circle can change at an event."""


def find_events(
    equations: Equations, first: Point, last: Point, user: dict[str, Callable[[Cycle], float]] | None = None
) -> list[Event]:
    """All events between two neighbouring points, in order along the branch."""
    found = _changes_of_stability(equations, first, last) + find_grazes(equations, first, last)
    for name, function in (user or {}).items():
        found += _user_events(equations, first, last, name, function)
    return sorted(found, key=lambda e: float(np.sum(equations.weights * first.tangent * (e.point.u - first.u))))


def _changes_of_stability(equations: Equations, first: Point, last: Point, halvings: int = HALVINGS) -> list[Event]:
    """The events of multipliers between two points; those of both halves where they do not explain how the number of
    multipliers outside the unit circle changes, since two of them can hide each other."""
    found = [event for search in _SEARCHES for event in search(equations, first, last)]
    change = abs(count_unstable(last.data.multipliers) - count_unstable(first.data.multipliers))
    if halvings == 0 or change <= sum(_CHANGES[event.kind] for event in found):
        return found
    between = middle(equations, first, last)
    if between is None:
        return found
    halves = ((first, between), (between, last))
    return [event for a, b in halves for event in _changes_of_stability(equations, a, b, halvings - 1)]


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
            kind = NEIMARK_SACKER if abs(a.imag) > MIN_DIVERGENCE else NEUTRAL_SADDLE
            yield Event(kind, point, defect=float(abs(a * b - 1.0)))


def _user_events(
    equations: Equations, first: Point, last: Point, name: str, function: Callable[[Cycle], float]
) -> Iterator[Event]:
    if function(first.data) * function(last.data) < 0:
        point = locate(equations, first, last, lambda p: function(p.data))
        if point is not None:
            yield Event(name, point, defect=abs(function(point.data)))


_SEARCHES = (_folds, _branch_points, _flips, _pairs)
