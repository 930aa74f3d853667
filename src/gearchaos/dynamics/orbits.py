"""Periodic orbits converged to rounding errors, by Newton's method on the n-th iterate of the stroboscopic map.

Near returns of a motion are the candidates for its period, which Newton's method then confirms or rejects.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from gearchaos.dynamics.time_series import time_sum
from gearchaos.flow import (
    RESIDUAL,
    ExactFlow,
    Measure,
    SwitchedSystem,
    near_returns,
    newton_iteration,
    of_meshes,
    start_newton_search,
)

ON_ORBIT = 1e-8
"""A state counts as on an orbit if no coordinate differs by more than this."""

_MAX_NEWTON_ITERATIONS = 12
SAME_POINT = 1e-6
"""Points of converged orbits are the same if no coordinate differs by more than this.

It leaves room for a residual of 1e-10, of which multipliers near 1 make a larger difference of points.
"""

_DEFECTIVE = 1e8
"""Condition number from which a matrix of eigenvectors counts as singular."""

_NEUTRAL = 1e-9
"""The largest multiplier μ of a neutral orbit satisfies ||μ| − 1| < this."""

_WEAK_DAMPING = 1e-5
"""Share of the mean rotation's velocity lost to bearing damping in one period of the orbit, below which Newton's method
does not find that velocity to better than 1e-11."""

_MULTIPLIER_ERROR = 1e-14
"""Bound of the rounding error of the modulus of a multiplier, per mesh period of the orbit. The largest error found was
half of it, on 28 000 undamped orbits of period 1 or 16 of pairs."""

_MATRIX_ERROR = 1e-13
"""Bound of that error over the Frobenius norm of the monodromy matrix, where this is larger. The largest found was
0.6 of it, on 496 undamped orbits of trains of up to 2600 steps."""

_NEAR_RETURN = 1e-3
"""Largest distance of a near return, relative to the size of the motion."""

_PREVIOUS_RETURN = 0.01
"""Largest distance of the near return one period earlier, relative to the size of the motion."""

EXACT = 1e-6
"""Largest distance of the returns of a motion that is on an orbit, relative to the size of the motion."""


_MAX_LOG_DETERMINANT_ERROR = 1e-6
"""Largest |Σ ln|μ| − tr A · nT| at which all multipliers of an orbit count as resolved."""

_SMALLEST_RESOLVED = 1e-6
"""Where they do not: the smallest multiplier that still counts as resolved, relative to the Frobenius norm of the
monodromy matrix."""


@dataclass(frozen=True)
class Orbits:
    """Results of Newton's method for periodic orbits, one for each of L trajectories."""

    w: np.ndarray  # (d, L), a point of the orbit at phase 0
    period: np.ndarray  # (L,), in mesh periods
    residual: np.ndarray  # (L,), largest change of a coordinate over one period; infinite where the method failed
    monodromy: np.ndarray  # (L, d, d), derivative at w of the map over one period of the orbit
    multipliers: np.ndarray  # (L, d), complex, largest modulus first

    def take(self, which: np.ndarray) -> Orbits:
        """The orbits selected by the index ``which``."""
        return Orbits(self.w[:, which], self.period[which], self.residual[which], self.monodromy[which],
                      self.multipliers[which])

    def put(self, which: np.ndarray, other: Orbits) -> None:
        """Replace the orbits selected by the index ``which``."""
        self.w[:, which], self.period[which], self.residual[which] = other.w, other.period, other.residual
        self.monodromy[which], self.multipliers[which] = other.monodromy, other.multipliers

    @property
    def converged(self) -> np.ndarray:
        """Whether Newton's method converged, (L,)."""
        return self.residual <= RESIDUAL

    @property
    def stable(self) -> np.ndarray:
        """Whether all multipliers lie inside the unit circle by more than their rounding errors, (L,)."""
        error = np.maximum(_MULTIPLIER_ERROR * self.period, _MATRIX_ERROR * np.linalg.norm(self.monodromy, axis=(1, 2)))
        return self.converged & (np.abs(self.multipliers).max(axis=1, initial=0.0) < 1.0 - error)

    @property
    def neutral(self) -> np.ndarray:
        """Whether the largest multiplier lies on the unit circle, (L,): neighbours neither approach nor leave."""
        return self.converged & (np.abs(np.abs(self.multipliers).max(axis=1, initial=0.0) - 1.0) < _NEUTRAL)


def polish(
    flow: ExactFlow, w: np.ndarray, points: np.ndarray, period: np.ndarray, *, reach: float = 10.0,
    expansion: float = np.inf,
) -> Orbits:
    """Converge guesses w (d, L) at phase 0 to orbits with periods (L,) by Newton's method.

    It stops where a coordinate differs by more than ``reach`` from the guess, or a multiplier has the modulus
    ``expansion`` or more. Orbits are not converged there, and where it failed twice to halve the residual.
    """
    search, active = start_newton_search(w), np.arange(w.shape[1])
    unit = np.repeat(np.eye(flow.dimension)[:, :, None], len(active), axis=2)  # advanced to the monodromy matrices
    for _ in range(_MAX_NEWTON_ITERATIONS):
        if len(active) == 0:
            break
        run = flow.advance(search.at[:, active], period[active], points=points[active],
                           tangent=unit[:, :, : len(active)])
        active = active[: newton_iteration(search, active, run.w, run.tangent, run.status, reach, expansion)]
    multipliers = np.zeros((len(period), flow.dimension), complex)
    converged = search.residual <= RESIDUAL
    multipliers[converged] = floquet_multipliers(search.monodromy[converged])
    return Orbits(search.w, period.copy(), search.residual, search.monodromy, multipliers)


def floquet_multipliers(monodromy: np.ndarray) -> np.ndarray:
    """Eigenvalues (…, d) of monodromy matrices (…, d, d), complex, largest modulus first.

    Those of equal modulus stay in the order of LAPACK for a single matrix, and in any order for many. A single matrix
    with d = 2 has them from its trace and determinant, in a fifth of the time; of a complex pair the one with the
    positive imaginary part is first.
    """
    if monodromy.shape == (2, 2):
        a, b, c, d = monodromy.ravel().tolist()
        middle, half = 0.5 * (a + d), 0.5 * (a - d)
        square = half * half + b * c
        if square < 0:
            return np.array([complex(middle, math.sqrt(-square)), complex(middle, -math.sqrt(-square))])
        first = middle + math.copysign(math.sqrt(square), middle)
        return np.array([first, (a * d - b * c) / first if first else 0.0], complex)
    values = np.linalg.eigvals(monodromy).astype(complex)
    if monodromy.ndim == 2:
        return values[np.argsort(-np.abs(values), kind="stable")]
    return np.take_along_axis(values, np.argsort(-np.abs(values), axis=-1), axis=-1)


def with_mean_velocity(flow: ExactFlow, w: np.ndarray, points: np.ndarray, period: np.ndarray) -> np.ndarray:
    """Points w (d, L) of orbits with periods (L,), corrected to the exact velocity of the mean rotation.

    Where bearing damping is weak, Newton's method amplifies the rounding error of that velocity by the inverse of the
    share that is lost in a period. The balance of torques gives the velocity exactly.
    """
    system = flow.system
    duration = period * system.period[points]
    loss = system.rotation_decay[points] * duration
    weak = np.flatnonzero((loss > 0) & (loss < _WEAK_DAMPING))
    if len(weak):
        out = flow.advance(w[:, weak], period[weak], points=points[weak], measured=True)
        excess = out.measures[Measure.VELOCITY] / duration[weak] - system.mean_velocity[points[weak]]
        w = w.copy()
        w[system.names.index("x2_dot"), weak] -= excess
    return w


def approaching(flow: ExactFlow, w: np.ndarray, points: np.ndarray, orbits: Orbits, max_periods: int) -> np.ndarray:
    """Whether motions from states w (d, L) near their stable orbits approach them as the multipliers predict, (L,).

    The distance must fall by at least half of what the largest multiplier predicts, or the motion be on the orbit. It
    is taken in the basis of the eigenvectors of the monodromy matrix, in which it falls monotonically even where
    multipliers are complex. Each motion is followed until its distance should have halved, for ``max_periods`` mesh
    periods at most, but at least for one period of its orbit.
    """
    modulus = np.abs(orbits.multipliers).max(axis=1)
    cycles = np.ceil(np.log(0.5) / np.log(np.clip(modulus, 1e-3, 1 - 1e-9)))  # periods of the orbit followed
    cycles = np.clip(cycles, 1, np.maximum(max_periods // orbits.period, 1)).astype(int)
    after = flow.advance(w, cycles * orbits.period, points=points).w
    _, vectors = np.linalg.eig(orbits.monodromy)
    vectors[np.linalg.cond(vectors, "fro") > _DEFECTIVE] = np.eye(len(orbits.w))
    offsets = np.stack([(w - orbits.w).T, (after - orbits.w).T], axis=2)
    before, now = np.linalg.norm(np.linalg.solve(vectors, offsets.astype(complex)), axis=1).T
    return (now <= ON_ORBIT) | (now <= before * (1 + modulus**cycles) / 2)


def sections(flow: ExactFlow, w: np.ndarray, points: np.ndarray, period: np.ndarray) -> list[np.ndarray]:
    """The stroboscopic points (n, d) of each orbit through w (d, L), with periods (L,); w comes first."""
    after = flow.advance(w, period, points=points, sections=int(period.max(initial=0))).sections
    firsts = len(after) - period
    return [np.concatenate([w[None, :, motion], after[first:-1, :, motion]]) for motion, first in enumerate(firsts)]


def minimal_period(flow: ExactFlow, w: np.ndarray, points: np.ndarray, period: np.ndarray) -> np.ndarray:
    """The minimal periods (L,) of orbits through w (d, L): the smallest divisors of ``period`` (L,) that return."""
    minimal = period.copy()
    for n in np.unique(period[period > 1]).tolist():
        same = np.flatnonzero(period == n)
        after = flow.advance(w[:, same], n, points=points[same], sections=n).sections
        for k in [k for k in range(n - 1, 0, -1) if n % k == 0]:
            returned = np.abs(after[k - 1] - w[:, same]).max(axis=0) < SAME_POINT
            minimal[same[returned]] = k
    return minimal


def candidates(
    sections: np.ndarray, longest: int, count: int, tolerance: float = _NEAR_RETURN,
    previous_tolerance: float = _PREVIOUS_RETURN,
) -> np.ndarray:
    """The shortest periods at which motions nearly return, (count, L), shortest first; 0 where there are fewer.

    ``sections`` (S, d, L) are consecutive stroboscopic states, newest last. Periods up to ``longest`` are searched, and
    up to (S − 1)/2, since two periods must be recorded. The tolerances are the largest distances of a near return, and
    of the one a period earlier, relative to the size of the motion. This must be a near return too: a chaotic motion
    sometimes passes close to its present state, but seldom twice in a row.
    """
    return near_returns(sections, min(longest, (len(sections) - 1) // 2), tolerance, previous_tolerance, count)


def lyapunov_exponents(flow: ExactFlow, points: np.ndarray, orbits: Orbits) -> tuple[np.ndarray, np.ndarray]:
    """Exact Lyapunov exponents (d, L) of periodic orbits, ln|μ|/(nT), per unit of τ, and their `mean_trace` (L,).

    The product of the multipliers is det(monodromy) = exp(∫ tr A dτ). Where the computed multipliers violate this, the
    smallest are below the rounding errors of the monodromy matrix. Exponents of multipliers that are small against its
    norm are then taken from the growth of orthonormalised tangent vectors, and the last exponent is the trace minus the
    sum of the others.
    """
    duration = orbits.period * flow.system.period[points]
    modulus = np.abs(orbits.multipliers)
    with np.errstate(divide="ignore"):
        exponents = np.log(modulus).T / duration
    measured = flow.system.law.in_contact
    measures = flow.advance(orbits.w, orbits.period, points=points, measured=True).measures if measured else None
    trace = mean_trace(flow.system, points, measures, duration)
    error = np.abs(exponents.sum(axis=0) - trace) * duration
    inexact = np.flatnonzero(~(error < _MAX_LOG_DETERMINANT_ERROR))
    if len(inexact) == 0:
        return exponents, trace
    norm = np.linalg.norm(orbits.monodromy[inexact], axis=(1, 2))
    w, tangent = orbits.w[:, inexact], tangent_frame(flow.dimension, len(inexact))
    for _ in range(2):  # the vectors align with the Lyapunov vectors in the first period; the growth is of the second
        run = flow.advance(w, orbits.period[inexact], points=points[inexact], tangent=tangent, growth=True)
        tangent = run.tangent
    growth = np.zeros((flow.dimension, len(inexact)))
    for n in np.unique(orbits.period[inexact]):
        same = np.flatnonzero(orbits.period[inexact] == n)
        growth[:, same] = time_sum(run.growth[:n, :, same])
    growth /= duration[inexact]
    exponents[:, inexact] = np.where(_SMALLEST_RESOLVED * norm < modulus[inexact].T, exponents[:, inexact], growth)
    exponents[-1, inexact] = growth.sum(axis=0) - exponents[:-1, inexact].sum(axis=0)
    return exponents, trace


def mean_trace(
    system: SwitchedSystem, points: np.ndarray, measures: np.ndarray | None, duration: np.ndarray
) -> np.ndarray:
    """Mean over time of the trace of the linear part along motions (L,), which is the sum of their exponents.

    ``measures`` (K len(Measure), L) over the ``duration`` are needed only where damping acts in contact alone.
    """
    if measures is None or not system.law.in_contact:
        return system.trace[points]
    meshes = of_meshes(measures)
    share = (meshes[:, Measure.FRONT_TIME] + meshes[:, Measure.BACK_TIME]) / duration
    return system.trace[points] + (system.contact_trace[points].T * share).sum(axis=0)


def tangent_frame(d: int, count: int) -> np.ndarray:
    """Orthonormal tangent vectors in general position, the same for all motions, (d vectors, d coordinates, count)."""
    vectors = np.linalg.qr(np.ones((d, d)) + np.diag(np.arange(1.0, d + 1)))[0].T
    return np.repeat(vectors[:, :, None], count, axis=2)
