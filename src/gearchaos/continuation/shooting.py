"""Periodic orbits as cycles of n stroboscopic points, x(k + 1) = P(x(k)) with P the map over one mesh period.

All n points are unknowns (multiple shooting), so that an orbit with large multipliers is found as precisely as a stable
one: rounding errors grow over one mesh period only.

Two tolerances decide when two orbits are the same, up to a shift by whole mesh periods. Cycles that `converge` has
found are known to nearly all digits: they are the same up to `SAME_POINT`. The attractor of a classification is
polished by the n-th iterate alone. Near the end of its stability it is known to no more than 1e-10/(1 − |μ|), so that
attractors are the same up to `SAME_ATTRACTOR`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from math import prod
from typing import Any

import numpy as np

from gearchaos.continuation.arclength import ACCEPTED, TOLERANCE, Equations, Point, along, between, length
from gearchaos.continuation.family import ParameterFamily
from gearchaos.dynamics.orbits import SAME_POINT, floquet_multipliers
from gearchaos.flow import OK, CorrectedOrbit, PeriodResult

_UNIT_CIRCLE = 1e-9  # distance from 1 up to which the modulus of a multiplier counts as 1

_ITERATIONS = 30
_MAX_CHANGE = 0.25  # largest change of `Cycle.positions` in a step

SAME_ATTRACTOR = 1e-4
"""An orbit is an attractor known already if one of its points is one of the attractor's, up to this distance."""

_RETURNED = 1e-3
"""A branch has returned to its start if it passes it at a distance of less than this fraction of a step."""

_LEAST_DIFFERENCE = 1e-6
"""Distance of the first point of an orbit from that half a period later, below which the orbit has half the period."""


@dataclass(frozen=True)
class Cycle:
    """A candidate for a periodic orbit: n points and their images under the stroboscopic map."""

    points: np.ndarray  # (n, d)
    values: np.ndarray  # (Q,) of the parameters
    result: PeriodResult  # one mesh period from each point

    @property
    def period(self) -> int:
        """Number n of mesh periods."""
        return len(self.points)

    @cached_property
    def defect(self) -> np.ndarray:
        """Images of the points less the next points, (n, d)."""
        return self.result.w - np.concatenate([self.points[1:], self.points[:1]])

    @cached_property
    def residual(self) -> float:
        """Largest defect of a coordinate; infinite if the flow failed."""
        if np.any(self.result.status != OK) or not np.all(np.isfinite(self.result.w)):
            return np.inf
        return float(np.abs(self.defect).max())

    @property
    def converged(self) -> bool:
        """Whether P takes every point to the next one, as far as rounding errors let Newton's method come."""
        return self.residual <= ACCEPTED

    @property
    def half_period_difference(self) -> np.ndarray:
        """First point less that half an even period later, (d,); it is 0 for an orbit of half the period."""
        return self.points[0] - self.points[self.period // 2]

    @cached_property
    def jacobian(self) -> np.ndarray:
        """Derivatives (n d, n d + Q) of the defect by the points and the parameters."""
        (n, d), q = self.points.shape, len(self.values)
        out = np.zeros((n * d, n * d + q))
        blocks, number = out[:, : n * d].reshape(n, d, n, d), np.arange(n)
        blocks[number, :, number] = self.result.monodromy
        blocks[number, :, number - n + 1] -= np.eye(d)
        out[:, n * d :] = self.result.sensitivity.reshape(n * d, q)
        return out

    def monodromy_at(self, number: int) -> np.ndarray:
        """Derivative (d, d) of Pⁿ at a point."""
        product = self.result.monodromy[number]
        for k in range(number + 1, number + self.period):
            product = self.result.monodromy[k % self.period] @ product
        return product

    @cached_property
    def monodromy(self) -> np.ndarray:
        """Derivative (d, d) of Pⁿ at the first point."""
        return self.monodromy_at(0)

    @cached_property
    def multipliers(self) -> np.ndarray:
        """Floquet multipliers, complex (d,), largest modulus first."""
        return floquet_multipliers(self.monodromy)

    @cached_property
    def positions(self) -> tuple[float, float, float]:
        """Where the multipliers lie relative to 1, −1 and the unit circle: three numbers from −1 to 1.

        They are Π (μ − 1), Π (μ + 1) and Π (μ_i μ_j − 1), each factor divided by its largest value for this modulus.
        """
        multipliers = self.multipliers.tolist()
        products = [a * b for a, b in combinations(multipliers, 2)]
        return (
            prod([(m - 1.0) / (1.0 + abs(m)) for m in multipliers]).real,
            prod([(m + 1.0) / (1.0 + abs(m)) for m in multipliers]).real,
            prod([(p - 1.0) / (1.0 + abs(p)) for p in products]).real,
        )

    @cached_property
    def extrema(self) -> np.ndarray:
        """Extrema of z over all n periods, (E, 3): instant in mesh periods from 0 to n, z, 1 maximum or −1 minimum."""
        out = self._extrema[:, :3].copy()
        out[:, 0] += self._period_of_extremum
        return out

    @cached_property
    def switches(self) -> np.ndarray:
        """Contact switches over all n periods, (S, 3): instant in mesh periods, boundary 1 or −1, 1 into contact."""
        counted = zip(self.result.switches, self.result.switch_count, strict=True)
        return np.concatenate(
            [np.column_stack([k + rows[:count, 0], rows[:count, 1:3]]) for k, (rows, count) in enumerate(counted)])

    @cached_property
    def _extrema(self) -> np.ndarray:
        """The records (E, 3 + d + Q) of the extrema in all mesh periods, see `PeriodResult`."""
        return np.concatenate([r[:count] for r, count in zip(
            self.result.extrema, self.result.extremum_count.tolist(), strict=True)])

    @cached_property
    def _period_of_extremum(self) -> np.ndarray:
        """The mesh period of each extremum, (E,) from 0."""
        return np.repeat(np.arange(self.period), self.result.extremum_count)

    def lag(self, instant: Any, reference: float) -> Any:
        """By how much instants are later than another one, in mesh periods from −n/2 to n/2."""
        return (instant - reference + self.period / 2) % self.period - self.period / 2

    def nearest_extremum(self, instant: float, boundary: float) -> int:
        """Index of the extremum of z that is nearest to an instant and a value of z."""
        return int(np.argmin(np.abs(self.lag(self.extrema[:, 0], instant)) + np.abs(self.extrema[:, 1] - boundary)))

    def extremum_derivatives(self, number: int) -> np.ndarray:
        """Derivatives (n d + Q,) of z at an extremum by the points and the parameters."""
        (n, d), row, period = self.points.shape, self._extrema[number, 3:], self._period_of_extremum[number]
        out = np.zeros(n * d + len(self.values))
        out[period * d : (period + 1) * d], out[n * d :] = row[:d], row[d:]
        return out

    def extremum_slopes(self, direction: np.ndarray) -> np.ndarray:
        """Derivatives (E,) of z at the extrema in a direction (n d + Q,) of points and parameters."""
        (n, d), derivatives = self.points.shape, self._extrema[:, 3:]
        if n == 1:
            return derivatives @ direction
        states = direction[: n * d].reshape(n, d)[self._period_of_extremum]
        return (derivatives[:, :d] * states).sum(axis=1) + derivatives[:, d:] @ direction[n * d :]


def count_unstable(multipliers: np.ndarray) -> int:
    """Number of multipliers outside the unit circle."""
    return sum(abs(m) > 1.0 + _UNIT_CIRCLE for m in multipliers.tolist())


def is_neutral(multipliers: np.ndarray) -> bool:
    """Whether the largest multiplier lies on the unit circle: neighbours neither approach the orbit nor leave it."""
    return bool(abs(float(np.abs(multipliers).max()) - 1.0) < _UNIT_CIRCLE)


def cycle_of(found: CorrectedOrbit) -> Cycle:
    """The cycle of a corrected orbit."""
    images = found.result.w
    return Cycle(found.u[: images.size].reshape(images.shape), found.u[images.size :], found.result)


def evaluate(family: ParameterFamily, points: np.ndarray, values: np.ndarray) -> Cycle:
    """The cycle of these points (n, d) at parameter values (Q,)."""
    result = family.flow(values[None]).advance(points, np.zeros(len(points), np.int64))
    return Cycle(np.array(points), np.array(values), result)


def converge(family: ParameterFamily, points: np.ndarray, values: np.ndarray) -> Cycle:
    """The cycle that Newton's method with halved steps reaches from points (n, d) at fixed parameter values (Q,).

    The best cycle found is returned whether it has converged or not: see its ``residual``.
    """
    flow, index = family.flow(values[None]), np.zeros(len(points), np.int64)
    best = Cycle(np.array(points, dtype=float), np.array(values, dtype=float), flow.advance(points, index))
    for _ in range(_ITERATIONS):
        if best.residual <= TOLERANCE or not np.isfinite(best.residual):
            break
        try:
            step = np.linalg.solve(best.jacobian[:, : points.size], -best.defect.ravel())
        except np.linalg.LinAlgError:
            break
        if not np.all(np.isfinite(step)):
            break
        for halving in range(6):
            moved = best.points + step.reshape(points.shape) / 2**halving
            trial = Cycle(moved, best.values, flow.advance(moved, index))
            if trial.residual < best.residual:
                best = trial
                break
        else:
            break
    return best


def unknowns(cycle: Cycle) -> np.ndarray:
    """The points and parameter values of a cycle as one vector (n d + Q,)."""
    return np.append(cycle.points.ravel(), cycle.values)


class CycleEquations(Equations):
    """Orbits of period n along one parameter (Q = 1): n d equations for n points and the parameter.

    A change of the parameter by ``span`` counts as much as a change of all points by one half backlash.
    """

    def __init__(self, family: ParameterFamily, period: int, span: float) -> None:
        self.family, self.period, self.size = family, period, period * family.dimension
        self.weights = np.append(np.full(self.size, 1.0 / period), 1.0 / span**2)

    def evaluate(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, Cycle]:
        """The defects of the cycle u, their derivatives, and the cycle."""
        self.family.check(u[None, -1:])
        cycle = evaluate(self.family, u[:-1].reshape(self.period, -1), u[-1:])
        return cycle.defect.ravel(), cycle.jacobian, cycle

    def corrected(self, guess: np.ndarray, rows: np.ndarray) -> tuple[CorrectedOrbit, Cycle] | None:
        """The orbit nearest to a guess."""
        found = self.family.corrected(guess, rows, self.period)
        return None if found is None else (found, cycle_of(found))

    def resolved(self, first: Cycle, last: Cycle) -> bool:
        """Whether the multipliers of two cycles differ so little that no event between them can be overlooked."""
        return max(abs(a - b) for a, b in zip(first.positions, last.positions, strict=True)) < _MAX_CHANGE


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

    The start may be shifted by whole mesh periods. The first ``size`` unknowns are the n points of the orbit.
    """

    def shifted(u: np.ndarray, shift: int) -> np.ndarray:
        points = u[: equations.size].reshape(equations.period, -1)
        return np.append(np.roll(points, -shift, axis=0).ravel(), u[equations.size :])

    weights, other = equations.weights, equations.size
    size = length(weights, point.u - last.u)
    if length(weights[other:], point.u[other:] - start.u[other:]) >= 2 * size:
        return None
    for shift in range(equations.period):
        u = shifted(start.u, shift)
        if max(length(weights, point.u - u), length(weights, last.u - u)) >= 2 * size:
            continue
        tangent = shifted(start.tangent, shift)
        before, after = (float(np.sum(weights * tangent * (v - u))) for v in (last.u, point.u))
        if before < 0 <= after and float(np.sum(weights * tangent * point.tangent)) > 0:
            at = between(equations, last, point, along(weights, last, u))
            if length(weights, at.u - u) < _RETURNED * size:
                return at
    return None
