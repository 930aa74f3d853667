"""Periodic orbits converged to rounding: Newton on the n-fold stroboscopic map with its exact monodromy matrix."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearchaos.flow import OK, ExactFlow

RESIDUAL = 1e-10
"""An orbit counts as converged when one round changes no coordinate by more than this."""

AT_ORBIT = 1e-8
"""A motion this close to an orbit is on it."""

_DEFECTIVE = 1e8
_ROUNDS = 12
_PATIENCE = 2
_SAME = 1e-6


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
        """Whether all multipliers lie inside the unit circle."""
        return self.converged & (np.abs(self.multipliers).max(axis=1, initial=0.0) < 1.0)

    @property
    def neutral(self) -> np.ndarray:
        """Whether the largest multiplier lies on the unit circle: neighbours neither approach nor leave."""
        return self.converged & (np.abs(np.abs(self.multipliers).max(axis=1, initial=0.0) - 1.0) < 1e-9)


def monodromy(
    flow: ExactFlow, w: np.ndarray, points: np.ndarray, n: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The state after n (L,) periods (d, L), the monodromy matrices (L, d, d) and where both are valid (L,)."""
    d = flow.dimension
    identity = np.repeat(np.eye(d)[:, :, None], w.shape[1], axis=2)
    out = flow.advance(w, n, points=points, tangent=identity)
    return out.w, out.tangent.transpose(2, 1, 0), out.status == OK


def polish(
    flow: ExactFlow, w: np.ndarray, points: np.ndarray, period: np.ndarray, *, reach: float = 10.0,
    expansion: float = np.inf,
) -> Orbits:
    """Newton from guesses w (d, L) with periods (L,) in mesh periods; see `Orbits`.

    Each goes on until it converges, halts twice, is farther than ``reach`` from its guess in some coordinate, or has a
    multiplier of ``expansion`` or more.
    """
    lanes, d = w.shape[1], flow.dimension
    out = Orbits(
        w.copy(), period.copy(), np.full(lanes, np.inf), np.zeros((lanes, d, d)), np.zeros((lanes, d), complex)
    )
    busy, stuck, at = np.arange(lanes), np.zeros(lanes, dtype=np.int64), w.copy()
    for _ in range(_ROUNDS):
        if len(busy) == 0:
            break
        end, matrix, valid = monodromy(flow, at[:, busy], points[busy], period[busy])
        change = end - at[:, busy]
        residual = np.where(valid, np.abs(change).max(axis=0), np.inf)
        better = residual < out.residual[busy]
        halting = residual > 0.5 * out.residual[busy]
        out.residual[busy] = np.where(better, residual, out.residual[busy])
        out.w[:, busy[better]] = at[:, busy[better]]
        done = (residual <= 1e-13) | (~better & (out.residual[busy] <= RESIDUAL)) | ~np.isfinite(residual)
        settled = better & (residual <= RESIDUAL)
        out.monodromy[busy[settled]] = matrix[settled]
        step = _newton_step(matrix, change)
        stuck[busy] += halting
        after = at[:, busy] + step
        go = ~done & (stuck[busy] < _PATIENCE) & (np.abs(after - w[:, busy]).max(axis=0) < reach)
        if np.isfinite(expansion):
            go[go] = ~_expands(matrix[go], expansion)
        at[:, busy[go]] = after[:, go]
        busy = busy[go]
    out.multipliers[out.converged] = _multipliers(out.monodromy[out.converged])
    return out


def _expands(matrix: np.ndarray, most: float) -> np.ndarray:
    """Which matrices (L, d, d) have an eigenvalue of that modulus or more; none does whose norm is less."""
    out = ~(np.abs(matrix).sum(axis=2).max(axis=1) < most)
    out[out] = ~(np.abs(np.linalg.eigvals(matrix[out])).max(axis=1) < most)
    return out


def _newton_step(matrix: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Solve (I − M) δ = P(w) − w for each lane; NaN where I − M is singular."""
    eye = np.eye(len(change))
    try:
        return np.linalg.solve(eye - matrix, change.T[:, :, None])[:, :, 0].T
    except np.linalg.LinAlgError:
        return np.stack([_solve_one(eye - m, c) for m, c in zip(matrix, change.T, strict=True)], axis=1)


def _solve_one(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    try:
        return np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        return np.full(len(right), np.nan)


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
