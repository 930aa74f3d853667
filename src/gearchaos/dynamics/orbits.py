"""Periodic orbits converged to rounding: Newton on the n-fold stroboscopic map with its exact monodromy matrix."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearchaos.flow import RESIDUAL, ExactFlow, Measure, newton_search, next_round

AT_ORBIT = 1e-8
"""A motion this close to an orbit is on it."""

_DEFECTIVE = 1e8
_ROUNDS = 12
_SAME = 1e-6
_BARELY_BRAKED = 1e-5
"""Of the mean rotation's speed so small a share is lost in a round that rounding moves the orbit by 1e-11 along it."""
_ROUNDING = 1e-14
"""Error of a multiplier's modulus a mesh period: of 28 000 undamped orbits of one or 16 periods the largest was half of
it."""


@dataclass(frozen=True)
class Orbits:
    """Polished orbits of L trajectories.

    Attributes
    ----------
    w : (d, L)
        A point of the orbit, at phase 0.
    period : (L,)
        Minimal period in mesh periods.
    residual : (L,)
        Largest change of a coordinate over one round; infinite where Newton failed.
    monodromy : (L, d, d)
        Derivative of one round at w.
    multipliers : (L, d)
        Floquet multipliers of one round, complex, largest modulus first.
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
        return self.residual <= RESIDUAL

    @property
    def stable(self) -> np.ndarray:
        """Whether all multipliers lie inside the unit circle, by more than rounding could put them there."""
        return self.converged & (np.abs(self.multipliers).max(axis=1, initial=0.0) < 1.0 - _ROUNDING * self.period)

    @property
    def neutral(self) -> np.ndarray:
        """Whether the largest multiplier lies on the unit circle: neighbours neither approach nor leave."""
        return self.converged & (np.abs(np.abs(self.multipliers).max(axis=1, initial=0.0) - 1.0) < 1e-9)


def polish(
    flow: ExactFlow, w: np.ndarray, points: np.ndarray, period: np.ndarray, *, reach: float = 10.0,
    expansion: float = np.inf,
) -> Orbits:
    """Newton from guesses w (d, L) with periods (L,) in mesh periods; see `Orbits`.

    Each goes on until it converges, halts twice, is farther than ``reach`` from its guess in some coordinate, or has a
    multiplier of ``expansion`` or more.
    """
    search, busy = newton_search(w), np.arange(w.shape[1])
    unit = np.repeat(np.eye(flow.dimension)[:, :, None], len(busy), axis=2)  # they become the monodromy matrices
    for _ in range(_ROUNDS):
        if len(busy) == 0:
            break
        run = flow.advance(search.at[:, busy], period[busy], points=points[busy], tangent=unit[:, :, : len(busy)])
        busy = busy[: next_round(search, busy, run.w, run.tangent, run.status, reach, expansion)]
    multipliers, good = np.zeros((len(period), flow.dimension), complex), search.residual <= RESIDUAL
    multipliers[good] = _multipliers(search.monodromy[good])
    return Orbits(search.w, period.copy(), search.residual, search.monodromy, multipliers)


def with_mean_velocity(flow: ExactFlow, w: np.ndarray, points: np.ndarray, period: np.ndarray) -> np.ndarray:
    """Orbits w (d, L) of some periods (L,) with the mean rotation at its exact velocity.

    Where the bearings hardly brake it, Newton's method finds that velocity with the error of rounding over the share
    that is lost in a round; the torques give it exactly.
    """
    system = flow.system
    duration = period * system.period[points]
    loss = system.rotation_decay[points] * duration
    barely = np.flatnonzero((loss > 0) & (loss < _BARELY_BRAKED))
    if len(barely):
        out = flow.advance(w[:, barely], period[barely], points=points[barely], measured=True)
        excess = out.measures[Measure.VELOCITY] / duration[barely] - system.mean_velocity[points[barely]]
        w = w.copy()
        w[system.names.index("x2_dot"), barely] -= excess
    return w


def approaching(
    flow: ExactFlow, w: np.ndarray, points: np.ndarray, found: Orbits, most: int
) -> np.ndarray:
    """Whether motions at w (d, L), beside their stable orbits, approach them as the multipliers say; (L,).

    Each is followed for the rounds in which its distance from the orbit should halve, though not for more than
    ``most`` periods. The distance is taken in the directions of the eigenvectors, in which it falls steadily even
    where multipliers are complex; it must fall by at least half of what they predict.
    """
    modulus = np.abs(found.multipliers).max(axis=1)
    rounds = np.ceil(np.log(0.5) / np.log(np.clip(modulus, 1e-3, 1 - 1e-9)))
    rounds = np.clip(rounds, 1, np.maximum(most // found.period, 1)).astype(int)
    after = flow.advance(w, rounds * found.period, points=points).w
    before, now = _eigendistances(found, w, after)
    return (now <= AT_ORBIT) | (now <= before * (1 + modulus**rounds) / 2)


def _eigendistances(found: Orbits, *states: np.ndarray) -> np.ndarray:
    """Distances (S, L) of some states (d, L) from the orbits, along the eigenvectors of the monodromy matrices."""
    _, vectors = np.linalg.eig(found.monodromy)
    defective = np.linalg.cond(vectors, "fro") > _DEFECTIVE
    vectors[defective] = np.eye(len(found.w))
    away = np.stack([(w - found.w).T for w in states], axis=2)
    return np.linalg.norm(np.linalg.solve(vectors, away.astype(complex)), axis=1).T


def _multipliers(matrix: np.ndarray) -> np.ndarray:
    values = np.linalg.eigvals(matrix).astype(complex)
    return np.take_along_axis(values, np.argsort(-np.abs(values), axis=1), axis=1)


def sections(flow: ExactFlow, w: np.ndarray, points: np.ndarray, period: np.ndarray) -> list[np.ndarray]:
    """The points (n, d) of each orbit, starting with the one given."""
    after = flow.advance(w, period, points=points, sections=int(period.max(initial=0))).sections
    firsts = len(after) - period
    return [np.concatenate([w[None, :, lane], after[first:-1, :, lane]]) for lane, first in enumerate(firsts)]


def shortest_round(flow: ExactFlow, w: np.ndarray, points: np.ndarray, period: np.ndarray) -> np.ndarray:
    """The minimal period (L,) of converged orbits: the first return among the divisors of the period given."""
    shortest = period.copy()
    after = flow.advance(w, period, points=points, sections=int(period.max(initial=0))).sections
    for n in np.unique(period[period > 1]).tolist():
        mine = np.flatnonzero(period == n)
        for k in [k for k in range(n - 1, 0, -1) if n % k == 0]:
            back = np.abs(after[len(after) - n + k - 1, :, mine] - w[:, mine].T).max(axis=1) < _SAME
            shortest[mine[back]] = k
    return shortest
