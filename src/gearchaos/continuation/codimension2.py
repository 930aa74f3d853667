"""Points of codimension 2 on the curve of an event: where a second condition holds.

Names as in Yu. A. Kuznetsov, Elements of Applied Bifurcation Theory, 2004, and for grazing as in M. di Bernardo et al.,
Piecewise-smooth Dynamical Systems, 2008.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import combinations

import numpy as np

from gearchaos.continuation.arclength import Equations, Point, along
from gearchaos.continuation.defining import EventState
from gearchaos.continuation.event_search import match
from gearchaos.continuation.events import (
    FLIP,
    FOLD,
    GRAZE,
    MIN_DIVERGENCE,
    NEIMARK_SACKER,
    critical_pair,
    locate,
    of_data,
)
from gearchaos.continuation.shooting import Cycle

_RESONANCES = {"1:1": 0.0, "1:4": np.pi / 2, "1:3": 2 * np.pi / 3, "1:2": np.pi}
"""Arguments of the multipliers at the strong resonances of a Neimark–Sacker curve."""

_NOISE = {"generalised flip": 1e-3}
"""Least magnitude of a test function that counts; the coefficient of a flip is 0 in permanent contact or free flight,
where the equations are linear."""

_STEP = 1e-3
"""Step of the differences for the normal form of a flip, in half backlashes."""


@dataclass(frozen=True, eq=False)
class SpecialPoint:
    """A point of codimension 2.

    Attributes
    ----------
    kind : str
        Such as "cusp" or "grazing-fold".
    point : Point
        The point of the curve; its data is an `EventState`.
    """

    kind: str
    point: Point


def find_special_points(equations: Equations, first: Point, last: Point, kind: str) -> list[SpecialPoint]:
    """All points of codimension 2 between two neighbouring points of the curve of an event, in order along it."""
    found = []
    for name, test in _tests(kind, first.data, equations):
        before, after = test(first.data), test(last.data)
        if before * after < 0 and min(abs(before), abs(after)) > _NOISE.get(name, 0.0):
            point = locate(equations, first, last, of_data(test))
            if point is not None and _belongs(name, point.data.cycle):
                found.append(SpecialPoint(name, point))
    found += _second_grazes(equations, first, last, kind)
    return sorted(found, key=lambda s: along(equations.weights, first, s.point.u))


def _belongs(name: str, cycle: Cycle) -> bool:
    """Whether an orbit is a point of this kind: two real multipliers with the product 1 belong to a neutral saddle."""
    return not name.endswith("neimark-sacker") or abs(critical_pair(cycle)[0].imag) > MIN_DIVERGENCE


def _tests(
    kind: str, reference: EventState, equations: Equations
) -> Iterator[tuple[str, Callable[[EventState], float]]]:
    """Names and test functions of the points that a curve of this kind can have."""
    if kind == FOLD:
        yield "cusp", lambda s: _aligned_curvature(s, reference)
        yield "1:1 resonance", lambda s: _others(s, 1.0)
        yield "fold-flip", lambda s: _all(s, -1.0)
        yield "fold-neimark-sacker", lambda s: _pairs(s, 1.0)
    elif kind == FLIP:
        yield "generalised flip", lambda s: flip_coefficient(s, equations)
        yield "1:2 resonance", lambda s: _others(s, -1.0)
        yield "fold-flip", lambda s: _all(s, 1.0)
        yield "flip-neimark-sacker", lambda s: _pairs(s, -1.0)
    elif kind == NEIMARK_SACKER:
        for name, angle in _RESONANCES.items():
            yield f"{name} resonance", partial(_from_angle, angle)
    elif kind == GRAZE:
        yield "grazing-fold", lambda s: _all(s, 1.0)
        yield "grazing-flip", lambda s: _all(s, -1.0)
        if len(reference.cycle.multipliers) > 2:
            yield "grazing-neimark-sacker", lambda s: _pairs(s, None)


def _from_angle(angle: float, state: EventState) -> float:
    """Argument of the critical multiplier less an angle."""
    return float(state.angle or 0.0) - angle


def _all(state: EventState, value: float) -> float:
    """Π (μ − value) over all multipliers."""
    return float(np.prod(state.cycle.multipliers - value).real)


def _others(state: EventState, value: float) -> float:
    """Π (μ − value) over all multipliers but the nearest one."""
    m = state.cycle.multipliers
    return float(np.prod(np.delete(m, np.argmin(np.abs(m - value))) - value).real)


def _pairs(state: EventState, critical: float | None) -> float:
    """Π (μ_i μ_j − 1) over the pairs of multipliers other than the critical one."""
    m = state.cycle.multipliers
    if critical is not None:
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
