"""Points of codimension 2 on the curve of an event: where a second condition holds.

Names as in Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory, 2004, and for grazing as in M. di Bernardo et al.,
Piecewise-smooth Dynamical Systems, 2008.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from itertools import combinations
from typing import NamedTuple

import numpy as np

from gearchaos.continuation.arclength import Equations, Point, along
from gearchaos.continuation.defining import EventState
from gearchaos.continuation.events import (
    FLIP,
    FOLD,
    GRAZE,
    NEIMARK_SACKER,
    branch_test,
    critical_pair,
    flip_test,
    locate,
    match,
    of_data,
    pair_test,
)

_RESONANCES = {"1:1": 0.0, "1:4": np.pi / 2, "1:3": 2 * np.pi / 3, "1:2": np.pi}
"""Arguments of the multipliers at the strong resonances of a Neimark–Sacker curve."""

_NOISE = {"generalised flip": 1e-3}
"""Least magnitude of a test function that counts; the coefficient of a flip is 0 in permanent contact or free flight,
where the equations are linear."""

_STEP = 1e-3
"""Step of the differences for the normal form of a flip, in half backlashes."""


class SpecialPoint(NamedTuple):
    """A point of codimension 2."""

    kind: str  # such as "cusp" or "grazing-fold"
    point: Point  # of the curve; its data is an `EventState`


def find_special_points(equations: Equations, first: Point, last: Point, kind: str) -> list[SpecialPoint]:
    """All points of codimension 2 between two neighbouring points of the curve of an event, in order along it."""
    found = []
    for name, test in _tests(kind, first.data, equations):
        before, after = test(first.data), test(last.data)
        if before * after < 0 and min(abs(before), abs(after)) > _NOISE.get(name, 0.0):
            point = locate(equations, first, last, of_data(test))
            if point is None or (name.endswith("neimark-sacker") and not critical_pair(point.data.cycle)[1]):
                continue
            found.append(SpecialPoint(name, point))
    found += _second_grazes(equations, first, last, kind)
    return sorted(found, key=lambda s: along(equations.weights, first, s.point.u))


def _tests(
    kind: str, reference: EventState, equations: Equations
) -> Iterator[tuple[str, Callable[[EventState], float]]]:
    """Names and test functions of the points that a curve of this kind can have."""
    if kind == FOLD:
        yield "cusp", lambda s: _aligned_curvature(s, reference)
        yield "1:1 resonance", lambda s: _others(s, 1.0)
        yield "fold-flip", lambda s: flip_test(s.cycle)
        yield "fold-neimark-sacker", lambda s: _pairs(s, 1.0)
    elif kind == FLIP:
        yield "generalised flip", lambda s: flip_coefficient(s, equations)
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


def _aligned_curvature(state: EventState, reference: EventState) -> float:
    """w* D²P[v, v] with the sign of w chosen as at the reference."""
    assert state.covector is not None and reference.covector is not None and state.curvature is not None
    return float(np.sign(np.sum(state.covector * reference.covector)) * state.curvature)


def flip_coefficient(state: EventState, equations: Equations) -> float:
    """Cubic coefficient of the normal form of a flip; the doubled orbits are stable where it is positive.

    From differences of Pⁿ in the critical direction (Kuznetsov 2004, (5.49)): w* C(v, v, v)/6 +
    w* B(v, (1 − A)⁻¹ B(v, v))/2 with w* v = 1, A the monodromy matrix, B and C the second and third derivatives. NaN
    where another multiplier is 1, or a graze is so near that the differences reach across it.
    """
    cycle, family = state.cycle, equations.family  # type: ignore[attr-defined]
    flow = family.flow(cycle.values[None])
    a = cycle.monodromy
    values, vectors = np.linalg.eig(a)
    adjoint_values, adjoint = np.linalg.eig(a.T)
    v = vectors[:, np.argmin(np.abs(values + 1.0))].real
    w = adjoint[:, np.argmin(np.abs(adjoint_values + 1.0))].real
    w = w / (w @ v)

    switches = set[int]()

    def image(offset: np.ndarray) -> np.ndarray:
        x, count = (cycle.points[0] + offset)[None], 0
        for _ in range(cycle.period):
            result = flow.advance(x, np.zeros(1, np.int64))
            x, count = result.w, count + int(result.switch_count[0])
        switches.add(count)
        return x[0]

    h, base = _STEP, image(np.zeros(len(v)))
    one, minus, two, minus_two = (image(k * h * v) for k in (1, -1, 2, -2))
    b = (one + minus - 2 * base) / h**2
    c = (two - 2 * one + 2 * minus - minus_two) / (2 * h**3)
    try:
        y = np.linalg.solve(np.eye(len(v)) - a, b)
    except np.linalg.LinAlgError:
        return float("nan")
    size = np.linalg.norm(y) or 1.0
    y = y / size
    mixed = (image(h * (v + y)) - image(h * (v - y)) - image(h * (y - v)) + image(-h * (v + y))) / (4 * h**2) * size
    return float(w @ c / 6 + w @ mixed / 2) if len(switches) == 1 else float("nan")


def _second_grazes(equations: Equations, first: Point, last: Point, kind: str) -> list[SpecialPoint]:
    """Where another extremum of z touches a boundary."""
    period, found = first.data.cycle.period, []
    before, after = first.data.cycle.extrema, last.data.cycle.extrema
    index, _ = match(before, after, period)
    name = "double graze" if kind == GRAZE else f"grazing-{kind}"
    for number, other in enumerate(index):
        if other < 0 or number == first.data.extremum or other == last.data.extremum:
            continue
        for boundary in (1, -1):
            if (before[number, 1] - boundary) * (after[other, 1] - boundary) < 0:

                def gap(p: Point, number: int = number, boundary: int = boundary) -> float:
                    at = int(match(before, p.data.cycle.extrema, period)[0][number])
                    return float("nan") if at < 0 else float(p.data.cycle.extrema[at, 1] - boundary)

                point = locate(equations, first, last, gap)
                if point is not None:
                    found.append(SpecialPoint(name, point))
    return found
