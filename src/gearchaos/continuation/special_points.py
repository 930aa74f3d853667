"""Points of codimension 2 on the curve of an event: where a second condition holds.

Names as in Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory, 2004, and for grazing as in M. di Bernardo et al.,
Piecewise-smooth Dynamical Systems, 2008.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import lru_cache, partial
from itertools import combinations
from typing import NamedTuple

import numpy as np

from gearchaos.continuation.arclength import Point, Stopped, along, correct, length
from gearchaos.continuation.corners import Grazes, nearest_root
from gearchaos.continuation.defining import EventEquations, EventState
from gearchaos.continuation.events import (
    FLIP,
    FOLD,
    GRAZE,
    NEIMARK_SACKER,
    branch_test,
    critical_pair,
    flip_test,
    gap_above,
    locate,
    match,
    of_data,
    pair_test,
    stay_away,
)
from gearchaos.continuation.shooting import evaluate

_RESONANCES = {"1:1": 0.0, "1:4": np.pi / 2, "1:3": 2 * np.pi / 3, "1:2": np.pi}
"""Arguments of the multipliers at the strong resonances of a Neimark–Sacker curve."""

_NOISE = {"generalised flip": 1e-3, "grazing-fold": 1e-10}
"""Least magnitude of a test function that counts. In permanent contact or free flight the equations are linear: the
coefficient of a flip is 0, and on the graze curve of motions periodic with any amplitude the multiplier is 1."""

_STEP = 4e-4  # longer step of the differences for the normal form of a flip, in half backlashes
_KINK = 1e-2  # relative change of a derivative with the step from which one of the steps reaches across a kink


class SpecialPoint(NamedTuple):
    """A point of codimension 2."""

    kind: str  # such as "cusp" or "grazing-fold"
    point: Point  # of the curve; its data is an `EventState`


def find_special_points(equations: EventEquations, first: Point, last: Point, kind: str) -> list[SpecialPoint] | None:
    """All points of codimension 2 between two neighbouring points of the curve of an event, in order along it; None if
    a graze between them is not found, as where the curve has a corner there."""
    found = []
    for name, test in _tests(kind, first.data, equations):
        before, after = test(first.data), test(last.data)
        if before * after < 0 and min(abs(before), abs(after)) > _NOISE.get(name, 0.0):
            point = locate(equations, first, last, of_data(test))
            if point is None or (name.endswith("neimark-sacker") and not critical_pair(point.data.cycle)[1]):
                continue
            found.append(SpecialPoint(name, point))
    grazes = _second_grazes(equations, first, last, kind)
    return None if grazes is None else sorted(found + grazes, key=lambda s: along(equations.weights, first, s.point.u))


def _tests(kind: str, reference: EventState,
           equations: EventEquations) -> Iterator[tuple[str, Callable[[EventState], float]]]:
    """Names and test functions of the points that a curve of this kind can have."""
    if kind == FOLD:
        def curvature(state: EventState) -> float:  # w* D²P[v, v] with the sign of w chosen as at the reference
            assert state.covector is not None and reference.covector is not None and state.curvature is not None
            return float(np.sign(np.sum(state.covector * reference.covector)) * state.curvature)

        yield "cusp", curvature
        yield "1:1 resonance", lambda s: _others(s, 1.0)
        yield "fold-flip", lambda s: flip_test(s.cycle)
        yield "fold-neimark-sacker", lambda s: _pairs(s, 1.0)
    elif kind == FLIP:
        yield "generalised flip", lambda s: _known_coefficient(s, equations)
        yield "1:2 resonance", lambda s: _others(s, -1.0)
        yield "fold-flip", lambda s: branch_test(s.cycle)
        yield "flip-neimark-sacker", lambda s: _pairs(s, -1.0)
    elif kind == NEIMARK_SACKER:
        for name, angle in _RESONANCES.items():
            yield f"{name} resonance", partial(lambda angle, s: float(s.angle or 0.0) - angle, angle)
    elif kind == GRAZE:
        yield "grazing-fold", lambda s: branch_test(s.cycle)
        yield "grazing-flip", lambda s: flip_test(s.cycle)
        if len(reference.cycle.multipliers) > 2:
            yield "grazing-neimark-sacker", lambda s: pair_test(s.cycle)


def _others(state: EventState, value: float) -> float:
    """Π (μ − value) over all multipliers but the nearest one."""
    m = state.cycle.multipliers
    return float(np.prod(np.delete(m, np.argmin(np.abs(m - value))) - value).real)


def _pairs(state: EventState, critical: float) -> float:
    """Π (μ_i μ_j − 1) over the pairs of multipliers other than the critical one."""
    m = state.cycle.multipliers
    m = np.delete(m, np.argmin(np.abs(m - critical)))
    return float(np.prod([a * b - 1.0 for a, b in combinations(m, 2)]).real) if len(m) > 1 else 1.0


def flip_coefficient(state: EventState, equations: EventEquations) -> float:
    """Cubic coefficient of the normal form of a flip; the doubled orbits are stable where it is positive.

    From differences in the critical direction v of the monodromy matrix A, which is exact (Kuznetsov 2004, (5.49)):
    w* C(v, v, v)/6 + w* B(v, (1 − A)⁻¹ B(v, v))/2 with w* v = 1, B and C the second and third derivatives. NaN where
    another multiplier is 1, or the differences reach across a graze or a kink of P.
    """
    cycle, family = state.cycle, equations.family
    flow, a = family.flow(cycle.values[None]), cycle.monodromy
    values, vectors = np.linalg.eig(a)
    adjoint_values, adjoint = np.linalg.eig(a.T)
    v = vectors[:, np.argmin(np.abs(values + 1.0))].real
    w = adjoint[:, np.argmin(np.abs(adjoint_values + 1.0))].real
    w = w / (w @ v)
    steps = np.array([_STEP, 0.5 * _STEP])
    x, switches, around = cycle.points[0] + np.outer([*steps, *-steps], v), np.zeros(4, np.int64), np.eye(len(v))
    for _ in range(cycle.period):
        result = flow.advance(x, np.zeros(4, np.int64))
        x, around, switches = result.w, result.monodromy @ around, switches + result.switch_count
    if np.any(switches != len(cycle.switches)):
        return float("nan")
    ahead, back = around[:2], around[2:]
    seconds = (ahead - back) / (2 * steps[:, None, None])  # B(v, ·)
    thirds = (ahead - 2 * a + back) @ v / steps[:, None] ** 2
    if any(np.abs(d[1] - d[0]).max() > _KINK * np.abs(d[1]).max() for d in (seconds, thirds)):
        return float("nan")
    second, third = ((4 * d[1] - d[0]) / 3 for d in (seconds, thirds))  # with an error O(step⁴)
    try:
        y = np.linalg.solve(np.eye(len(v)) - a, second @ v)
    except np.linalg.LinAlgError:
        return float("nan")
    return float(w @ third / 6 + w @ second @ y / 2)


_known_coefficient = lru_cache(maxsize=8)(flip_coefficient)
"""Every point is the last one of a step and the first of the next."""


def _second_grazes(equations: EventEquations, first: Point, last: Point, kind: str) -> list[SpecialPoint] | None:
    """Where another extremum of z touches a boundary; None if one of these points is not found."""
    before, after, found = first.data.cycle.extrema, last.data.cycle.extrema, []
    others = [np.delete(e, [] if s.extremum is None else s.extremum, axis=0) for e, s in (
        (before, first.data), (after, last.data))]
    if stay_away(*others):
        return []
    index, _ = match(before, after, first.data.cycle.period)
    name = "double graze" if kind == GRAZE else f"grazing-{kind}"
    for number, other in enumerate(index):
        if other < 0 or number == first.data.extremum or other == last.data.extremum:
            continue
        for boundary in (1, -1):
            if (before[number, 1] - boundary) * (after[other, 1] - boundary) < 0:
                gap = gap_above(boundary, first.data.cycle, number)
                point = locate(equations, first, last, of_data(partial(lambda gap, s: gap(s.cycle), gap)))
                if point is None and kind != GRAZE:
                    point = _corner_between(equations, first, last, boundary, number, int(other))
                if point is None:
                    return None
                found.append(SpecialPoint(name, point))
    return found


def _corner_between(equations: EventEquations, first: Point, last: Point, boundary: int, number: int,
                    other: int) -> Point | None:
    """The corner at the graze of an extremum, by its indices at two neighbouring points, that the step between them
    passes; None if it is not found there."""
    near, index = min(((first, number), (last, other)), key=lambda c: abs(c[0].data.cycle.extrema[c[1], 1] - boundary))
    size = equations.size + 2
    weights, reach = equations.weights[:size], length(equations.weights, last.u - first.u)
    try:
        corner = Grazes(equations, near, index).corner(reach)
    except (Stopped, ValueError):
        return None
    return None if corner is None or length(weights, corner.u - near.u[:size]) > reach else corner


def joint(equations: EventEquations, near: Point, reach: float) -> SpecialPoint | None:
    """Where a curve of folds or grazes joins the flip curve of half the period, at a distance of at most ``reach`` from
    one of its points; None if it is not found.

    The curve's own equations are singular there. So it is located by those of half the period: on the curve of grazes
    where the multiplier is −1, or for folds, if that is nearer, on the flip curve where the coefficient vanishes.
    """
    if equations.kind not in (FOLD, GRAZE) or equations.period % 2:
        return None
    n, size, spans = equations.period // 2, equations.size, 1.0 / np.sqrt(equations.weights[-2:])
    guess, normal = (np.append(u[:size].reshape(2, -1).mean(axis=0), u[size:]) for u in (near.u, near.tangent))
    if length(equations.weights, _twice(guess) - near.u) > reach:
        return None
    flips = EventEquations(equations.family, FLIP, n, (float(spans[0]), float(spans[1])))
    start = replace(near, u=guess, tangent=normal, data=EventState(
        evaluate(equations.family, guess[:-2].reshape(n, -1), guess[-2:])))
    def degenerate_flip() -> Point | None:  # the nearest flip at which the coefficient of the normal form vanishes
        origin = correct(flips, start.u, start.tangent, start.tangent)
        return nearest_root(
            of_data(lambda state: flip_coefficient(state, flips)), lambda distance: correct(
                flips, origin.u + distance * origin.tangent, origin.tangent, origin.tangent), reach)

    searches: dict[str, Callable[[], Point | None]] = {"grazing-flip": lambda: Grazes(flips, start).corner(reach)}
    if equations.kind == FOLD:
        searches["generalised flip"] = degenerate_flip
    found = None
    for name, search in searches.items():
        try:
            point = search()
        except (Stopped, ValueError):  # ValueError: no extremum, or no coefficient at a point of the curve
            continue
        distance = reach if point is None else length(equations.weights, _twice(point.u) - near.u)
        if point is not None and distance < reach:
            reach, u = distance, _twice(point.u)
            defect, _, data = equations.evaluate(u)
            found = SpecialPoint(name, replace(near, u=u, residual=float(np.abs(defect).max()), data=data))
    return found


def _twice(u: np.ndarray) -> np.ndarray:
    """The unknowns of an orbit over twice its period."""
    return np.append(np.tile(u[:-2], 2), u[-2:])
