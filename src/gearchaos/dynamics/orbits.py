"""Periodic orbits to rounding, by Newton's method on the n-th iterate of the stroboscopic map with its derivative."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearchaos.flow import RESIDUAL, ExactFlow, Measure, newton_search, next_round

ON_ORBIT = 1e-8
"""A state within this distance of an orbit, in every coordinate, is on it."""

_NEWTON_ROUNDS = 12
_SAME_POINT = 1e-6
"""Largest distance at which an orbit has returned to a point."""

_DEFECTIVE = 1e8
"""Condition number from which a matrix of eigenvectors is taken as singular."""

_NEUTRAL = 1e-9
"""Largest distance of the largest multiplier of a neutral orbit from the unit circle."""

_WEAK_BRAKING = 1e-5
"""Share of the mean rotation's velocity lost in one period of the orbit, below which Newton's method does not find
that velocity to better than 1e-11."""

_MULTIPLIER_ERROR = 1e-14
"""Error of the modulus of a multiplier per mesh period, from rounding. The largest found was half of it, on 28 000
undamped orbits of one or 16 periods."""


@dataclass(frozen=True)
class Orbits:
    """Periodic orbits of L trajectories, as Newton's method left them.

    Attributes
    ----------
    w : (d, L)
        A point of the orbit at phase 0.
    period : (L,)
        Period n in mesh periods.
    residual : (L,)
        Largest change of a coordinate over one period of the orbit; infinite where Newton's method failed.
    monodromy : (L, d, d)
        Derivative at w of the map over one period of the orbit.
    multipliers : (L, d)
        Floquet multipliers, complex, largest modulus first.
    """

    w: np.ndarray
    period: np.ndarray
    residual: np.ndarray
    monodromy: np.ndarray
    multipliers: np.ndarray

    def take(self, which: np.ndarray) -> Orbits:
        """The chosen orbits."""
        return Orbits(
            self.w[:, which], self.period[which], self.residual[which], self.monodromy[which], self.multipliers[which]
        )

    def put(self, which: np.ndarray, other: Orbits) -> None:
        """Replace the chosen orbits by others."""
        self.w[:, which], self.period[which], self.residual[which] = other.w, other.period, other.residual
        self.monodromy[which], self.multipliers[which] = other.monodromy, other.multipliers

    @property
    def converged(self) -> np.ndarray:
        """Whether Newton's method converged, (L,)."""
        return self.residual <= RESIDUAL

    @property
    def stable(self) -> np.ndarray:
        """Whether all multipliers lie inside the unit circle by more than their rounding errors, (L,)."""
        bound = 1.0 - _MULTIPLIER_ERROR * self.period
        return self.converged & (np.abs(self.multipliers).max(axis=1, initial=0.0) < bound)

    @property
    def neutral(self) -> np.ndarray:
        """Whether the largest multiplier lies on the unit circle, so that neighbours neither approach nor leave."""
        return self.converged & (np.abs(np.abs(self.multipliers).max(axis=1, initial=0.0) - 1.0) < _NEUTRAL)


def polish(
    flow: ExactFlow, w: np.ndarray, points: np.ndarray, period: np.ndarray, *, reach: float = 10.0,
    expansion: float = np.inf,
) -> Orbits:
    """Converge guesses to periodic orbits by Newton's method.

    Parameters
    ----------
    flow : ExactFlow
    w : (d, L)
        Guesses at phase 0.
    points : (L,)
        Parameter point of each.
    period : (L,)
        Period of each in mesh periods.
    reach : float
        Give up farther than this from the guess in some coordinate.
    expansion : float
        Give up where a multiplier has this modulus or more.

    Returns
    -------
    Orbits
        Not converged where Newton's method gave up, or stagnated twice.
    """
    search, active = newton_search(w), np.arange(w.shape[1])
    unit = np.repeat(np.eye(flow.dimension)[:, :, None], len(active), axis=2)  # they become the monodromy matrices
    for _ in range(_NEWTON_ROUNDS):
        if len(active) == 0:
            break
        run = flow.advance(search.at[:, active], period[active], points=points[active],
                           tangent=unit[:, :, : len(active)])
        active = active[: next_round(search, active, run.w, run.tangent, run.status, reach, expansion)]
    multipliers = np.zeros((len(period), flow.dimension), complex)
    converged = search.residual <= RESIDUAL
    multipliers[converged] = _multipliers(search.monodromy[converged])
    return Orbits(search.w, period.copy(), search.residual, search.monodromy, multipliers)


def _multipliers(matrix: np.ndarray) -> np.ndarray:
    """Eigenvalues (L, d) of matrices (L, d, d), largest modulus first."""
    values = np.linalg.eigvals(matrix).astype(complex)
    return np.take_along_axis(values, np.argsort(-np.abs(values), axis=1), axis=1)


def with_mean_velocity(flow: ExactFlow, w: np.ndarray, points: np.ndarray, period: np.ndarray) -> np.ndarray:
    """Points w (d, L) of orbits of the given periods (L,), with the exact velocity of the mean rotation.

    Where the bearings hardly brake the mean rotation, Newton's method finds its velocity with the rounding error
    divided by the share of it that is lost in a period. The balance of torques gives it exactly.
    """
    system = flow.system
    duration = period * system.period[points]
    loss = system.rotation_decay[points] * duration
    weak = np.flatnonzero((loss > 0) & (loss < _WEAK_BRAKING))
    if len(weak):
        out = flow.advance(w[:, weak], period[weak], points=points[weak], measured=True)
        excess = out.measures[Measure.VELOCITY] / duration[weak] - system.mean_velocity[points[weak]]
        w = w.copy()
        w[system.names.index("x2_dot"), weak] -= excess
    return w


def approaching(
    flow: ExactFlow, w: np.ndarray, points: np.ndarray, orbits: Orbits, max_periods: int
) -> np.ndarray:
    """Whether motions approach their stable orbits as the multipliers predict.

    Parameters
    ----------
    flow : ExactFlow
    w : (d, L)
        States of the motions near their orbits, at phase 0.
    points : (L,)
        Parameter point of each.
    orbits : Orbits
        The orbit of each.
    max_periods : int
        Each motion is followed until its distance should have halved, but not for longer than this, in mesh periods,
        and at least for one period of its orbit.

    Returns
    -------
    (L,) of bool
        Whether the distance fell by at least half of what the largest multiplier predicts, or the motion is on the
        orbit. The distance is taken in the basis of the eigenvectors of the monodromy matrix, in which it falls
        monotonically even where multipliers are complex.
    """
    modulus = np.abs(orbits.multipliers).max(axis=1)
    rounds = np.ceil(np.log(0.5) / np.log(np.clip(modulus, 1e-3, 1 - 1e-9)))
    rounds = np.clip(rounds, 1, np.maximum(max_periods // orbits.period, 1)).astype(int)
    after = flow.advance(w, rounds * orbits.period, points=points).w
    before, now = _eigenvector_distances(orbits, w, after)
    return (now <= ON_ORBIT) | (now <= before * (1 + modulus**rounds) / 2)


def _eigenvector_distances(orbits: Orbits, *states: np.ndarray) -> np.ndarray:
    """Distances (S, L) of S states (d, L) from the orbits, in the basis of the eigenvectors of the monodromy matrix."""
    _, vectors = np.linalg.eig(orbits.monodromy)
    defective = np.linalg.cond(vectors, "fro") > _DEFECTIVE
    vectors[defective] = np.eye(len(orbits.w))
    offsets = np.stack([(w - orbits.w).T for w in states], axis=2)
    return np.linalg.norm(np.linalg.solve(vectors, offsets.astype(complex)), axis=1).T


def sections(flow: ExactFlow, w: np.ndarray, points: np.ndarray, period: np.ndarray) -> list[np.ndarray]:
    """The stroboscopic points (n, d) of each orbit through w (d, L), with periods (L,); w comes first."""
    after = flow.advance(w, period, points=points, sections=int(period.max(initial=0))).sections
    firsts = len(after) - period
    return [np.concatenate([w[None, :, lane], after[first:-1, :, lane]]) for lane, first in enumerate(firsts)]


def minimal_period(flow: ExactFlow, w: np.ndarray, points: np.ndarray, period: np.ndarray) -> np.ndarray:
    """The minimal periods (L,) of orbits through w (d, L): the smallest divisors of ``period`` (L,) that return."""
    minimal = period.copy()
    after = flow.advance(w, period, points=points, sections=int(period.max(initial=0))).sections
    for n in np.unique(period[period > 1]).tolist():
        same = np.flatnonzero(period == n)
        for k in [k for k in range(n - 1, 0, -1) if n % k == 0]:
            returned = np.abs(after[len(after) - n + k - 1, :, same] - w[:, same].T).max(axis=1) < _SAME_POINT
            minimal[same[returned]] = k
    return minimal
