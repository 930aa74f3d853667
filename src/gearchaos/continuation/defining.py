"""Orbits at an event along two parameters: the equations of fold, flip, Neimark–Sacker and graze curves.

A multiplier μ of a cycle x(k + 1) = P(x(k)) is critical where the matrix A of the linear equations
Φ(k) v(k) − v(k + 1) = 0 for k < n − 1 and Φ(n − 1) v(n − 1) − μ v(0) = 0, with Φ(k) the derivative of P at x(k), is
singular. Its least singular value σ = w* A v is the function that vanishes along the curve; its derivatives w* (dA) v
follow from central differences of the exact Φ and ∂P/∂p in the direction v, since D²P[v, ·] is the derivative of Φ in
that direction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearchaos.continuation.arclength import Equations
from gearchaos.continuation.events import FLIP, FOLD, GRAZE, NEIMARK_SACKER, Event
from gearchaos.continuation.family import ParameterFamily, PeriodFlow
from gearchaos.continuation.shooting import Cycle, cycle_of
from gearchaos.flow import CorrectedOrbit, CriticalMultiplier, TouchingExtremum

_STEP = 1e-8  # step of the central differences, in half backlashes
_ANGLE_WEIGHT = 1e-2  # weight of the argument of a multiplier in the arclength
CRITICAL = {FOLD: 1.0, FLIP: -1.0}  # the critical multiplier by kind of event


@dataclass(frozen=True, eq=False)
class EventState:
    """An orbit at an event."""

    cycle: Cycle
    extremum: int | None = None  # for a graze, its index in `Cycle.extrema`
    angle: float | None = None  # for a Neimark–Sacker point, the argument of the critical multiplier, in radians
    covector: np.ndarray | None = None  # (n, d) w at the points of the orbit; complex for a Neimark–Sacker point
    curvature: float | None = None  # for a fold, w* D²P[v, v], which vanishes at a cusp; its sign is that of w


@dataclass(frozen=True, eq=False)
class EventSeed:
    """An event from which its curve can be followed."""

    kind: str
    points: np.ndarray  # (n, d) of the orbit
    values: np.ndarray  # (2,) of the parameters
    boundary: int | None = None  # for a graze: 1 or −1
    instant: float | None = None  # for a graze, that of the extremum of z, in mesh periods
    angle: float | None = None  # for a Neimark–Sacker point, the argument of the critical multiplier, in radians

    @property
    def period(self) -> int:
        """n."""
        return len(self.points)


def seed_of(event: Event, values: np.ndarray) -> EventSeed:
    """The seed of an event that a branch has at these parameters (2,)."""
    instant = float(event.cycle.extrema[event.extremum, 0]) if event.extremum is not None else None
    angle = None
    if event.kind == NEIMARK_SACKER:
        critical = min(event.cycle.multipliers, key=lambda m: abs(abs(m) - 1.0) + (m.imag < 0))
        angle = float(np.angle(critical))
    return EventSeed(event.kind, event.cycle.points, np.asarray(values, float), event.boundary, instant, angle)


class EventEquations(Equations):
    """The equations of an orbit of period n at an event, along two parameters (Q = 2).

    Changes of the parameters by ``spans`` count as much as a change of all points by one half backlash.
    """

    def __init__(self, family: ParameterFamily, kind: str, period: int, spans: tuple[float, float]) -> None:
        self.family, self.kind, self.period = family, kind, period
        self.size = period * family.dimension
        angle = [_ANGLE_WEIGHT] if kind == NEIMARK_SACKER else []
        self.weights = np.concatenate([np.full(self.size, 1.0 / period), 1.0 / np.array(spans) ** 2, angle])
        self._vectors: np.ndarray | None = None  # (2, n, d) v and w of the last orbit, unless they are complex

    def values(self, u: np.ndarray) -> np.ndarray:
        """The two parameters among the unknowns, (2,)."""
        return u[self.size : self.size + 2]

    def unknowns(self, seed: EventSeed) -> np.ndarray:
        """The unknowns of an event."""
        return np.concatenate([seed.points.ravel(), seed.values, [] if seed.angle is None else [seed.angle]])

    def evaluate(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, EventState]:
        """The defects of cycle and event, their derivatives, and the orbit."""
        values = self.values(u)
        self.family.check(values[None])
        flow, points = self.family.flow(values[None]), u[: self.size].reshape(self.period, -1)
        cycle = Cycle(points.copy(), values.copy(), flow.advance(points, np.zeros(self.period, np.int64)))
        test, slopes, state = self._event(flow, cycle, u)
        jacobian = np.zeros((self.size + len(test), len(u)))
        jacobian[: self.size, : self.size + 2] = cycle.jacobian
        jacobian[self.size :, : slopes.shape[1]] = slopes
        return np.append(cycle.defect.ravel(), test), jacobian, state

    def corrected(self, guess: np.ndarray, rows: np.ndarray) -> tuple[CorrectedOrbit, EventState] | None:
        """The orbit at the event nearest to a guess."""
        event = self._equation
        found = None if event is None else self.family.corrected(guess, rows, self.period, event)
        return None if found is None else (found, self._state(found, cycle_of(found)))

    @property
    def _equation(self) -> CriticalMultiplier | TouchingExtremum | None:
        """The equation of the event; None if it is of no form that orbits are corrected with in one call."""
        return None if self._vectors is None else CriticalMultiplier(CRITICAL[self.kind], self._vectors, _STEP)

    def _state(self, found: CorrectedOrbit, cycle: Cycle) -> EventState:
        """The state at a corrected orbit."""
        self._vectors = found.vectors
        v, w = found.vectors
        curvature = float(found.slope[: self.size] @ v.ravel()) if self.kind == FOLD else None
        return EventState(cycle, None, None, w, curvature)

    def resolved(self, first: EventState, last: EventState) -> bool:
        """Whether the event is the same one at two neighbouring points."""
        if self.kind != GRAZE:
            return True
        before, after = (s.cycle.extrema[s.extremum] for s in (first, last))
        return bool(abs(last.cycle.lag(after[0], before[0])) < 0.05 and abs(before[1] - after[1]) < 1e-6)

    def accept(self, state: EventState) -> None:
        """Note that the curve has reached this orbit."""

    def _event(self, flow: PeriodFlow, cycle: Cycle, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, EventState]:
        """The functions that vanish at the event, their derivatives (…, unknowns), and the state."""
        if not np.all(np.isfinite(cycle.result.w)):
            return np.full(1, np.nan), np.zeros((1, len(u))), EventState(cycle)
        if self.kind == NEIMARK_SACKER:
            angle = float(u[-1])
            sigma, slope, v, w = self._singular(flow, cycle, np.exp(1j * angle))
            slope = np.append(slope, -1j * np.exp(1j * angle) * np.conj(w[-1]) @ v[0])
            return np.array([sigma, 0.0]), np.stack([slope.real, slope.imag]), EventState(cycle, None, angle, w)
        sigma, slope, v, w = self._singular(flow, cycle, CRITICAL[self.kind])
        self._vectors = np.stack([v, w])
        curvature = float(slope.real[: self.size] @ v.real.ravel()) if self.kind == FOLD else None
        return np.array([sigma]), slope.real[None], EventState(cycle, None, None, w.real, curvature)

    def _singular(self, flow: PeriodFlow, cycle: Cycle,
                  multiplier: complex) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
        """Least singular value σ, its derivatives (n d + 2,) by points and parameters, and v and w (n, d)."""
        (n, d), identity = cycle.points.shape, np.eye(cycle.points.shape[1])
        critical = np.zeros((n, d, n, d), dtype=type(multiplier))  # singular where the cycle has this multiplier
        for k in range(n):
            critical[k, :, k] = cycle.result.monodromy[k]
            critical[k, :, (k + 1) % n] -= identity * (multiplier if k == n - 1 else 1.0)
        left, sigma, right = np.linalg.svd(critical.reshape(n * d, n * d))
        v, w = right[-1].conj().reshape(n, d), left[:, -1].reshape(n, d)
        slope = self._directional(flow, cycle, w, v.real)
        if np.iscomplexobj(v):
            slope = slope + 1j * self._directional(flow, cycle, w, v.imag)
        return float(sigma[-1]), slope, v, w

    def _directional(self, flow: PeriodFlow, cycle: Cycle, w: np.ndarray, v: np.ndarray) -> np.ndarray:
        """w* times the derivative in the direction v of the Jacobian of the cycle, (n d + 2,)."""
        n = cycle.period
        ahead, back = cycle.points + _STEP * v, cycle.points - _STEP * v
        result = flow.advance(np.concatenate([ahead, back]), np.zeros(2 * n, np.int64))
        phi = (result.monodromy[:n] - result.monodromy[n:]) / (2 * _STEP)
        by_parameter = (result.sensitivity[:n] - result.sensitivity[n:]) / (2 * _STEP)
        conjugate = w.conj()
        return np.append(np.einsum("ki,kij->kj", conjugate, phi), np.einsum("ki,kiq->q", conjugate, by_parameter))


class GrazeEquations(EventEquations):
    """The equations of an orbit on which an extremum of z lies on a boundary of contact: at 1 or −1, or a gap beyond.

    The instant is that of the extremum on the first orbit, in mesh periods.
    """

    def __init__(self, family: ParameterFamily, period: int, spans: tuple[float, float], boundary: float,
                 instant: float) -> None:
        super().__init__(family, GRAZE, period, spans)
        self.boundary, self.instant = boundary, instant

    def accept(self, state: EventState) -> None:
        """Follow the extremum to this orbit."""
        if state.extremum is not None:
            self.instant = float(state.cycle.extrema[state.extremum, 0])

    @property
    def _equation(self) -> TouchingExtremum:
        return TouchingExtremum(self.boundary, self.instant)

    def _state(self, found: CorrectedOrbit, cycle: Cycle) -> EventState:
        return EventState(cycle, found.extremum)

    def _event(self, flow: PeriodFlow, cycle: Cycle, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, EventState]:
        extrema = cycle.extrema
        if not np.all(np.isfinite(cycle.result.w)) or len(extrema) == 0:
            return np.full(1, np.nan), np.zeros((1, len(u))), EventState(cycle)
        number = cycle.nearest_extremum(self.instant, self.boundary)
        return extrema[[number], 1] - self.boundary, cycle.extremum_derivatives(number)[None], EventState(cycle, number)


def event_equations(family: ParameterFamily, seed: EventSeed, spans: tuple[float, float]) -> EventEquations:
    """The equations of the curve of an event."""
    if seed.kind == GRAZE:
        assert seed.boundary is not None and seed.instant is not None
        return GrazeEquations(family, seed.period, spans, seed.boundary, seed.instant)
    return EventEquations(family, seed.kind, seed.period, spans)
