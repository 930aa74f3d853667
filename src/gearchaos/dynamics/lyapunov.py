"""Lyapunov exponents with confidence intervals, from the exact tangent flow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from gearchaos.dynamics.orbits import Orbits
from gearchaos.dynamics.series import by_lane, total
from gearchaos.flow import ExactFlow

BLOCKS = 20
"""Stretches of the motion whose means tell how sure the exponent is."""

_CONFIDENCE = 0.99
_RESOLVED = 1e-6
_CLEAR = 1e-6


@dataclass(frozen=True)
class Exponents:
    """Lyapunov exponents per unit τ, (K, L), with the ends of their confidence intervals."""

    value: np.ndarray
    low: np.ndarray
    high: np.ndarray


def from_growth(growth: np.ndarray, period: np.ndarray) -> Exponents:
    """Exponents from the logarithms of growth per mesh period (N, K, L); ``period`` (L,) is T.

    The interval is Student's for the means of `BLOCKS` consecutive blocks, at 99 %: neighbouring periods are
    correlated, blocks hardly.
    """
    length = len(growth) // BLOCKS
    series = by_lane(growth[-length * BLOCKS :])
    blocks = np.moveaxis(series.reshape(*series.shape[:-1], BLOCKS, length).mean(axis=-1), -1, 0) / period
    value = blocks.mean(axis=0)
    half = stdtrit(BLOCKS - 1, 0.5 + _CONFIDENCE / 2) * blocks.std(axis=0, ddof=1) / np.sqrt(BLOCKS)
    return Exponents(value, value - half, value + half)


def of_orbits(flow: ExactFlow, points: np.ndarray, found: Orbits) -> np.ndarray:
    """Exponents (d, L) of periodic orbits, ln|μ| over the duration nT: exact, no interval.

    Multipliers far below the norm of the monodromy matrix drown in its rounding. Where their product shows it they are
    had from the growth of tangent vectors instead, orthonormalised on the way, in the second round of the orbit: the
    sum of their growths is exact, and the smallest exponent is what it leaves.
    """
    duration = found.period * flow.system.period[points]
    modulus = np.abs(found.multipliers)
    with np.errstate(divide="ignore"):
        out = np.log(modulus).T / duration
    off = np.abs(out.sum(axis=0) - flow.system.trace[points]) * duration
    drowned = np.flatnonzero(~(off < _RESOLVED))
    if len(drowned) == 0:
        return out
    norm = np.linalg.norm(found.monodromy[drowned], axis=(1, 2))
    grown = _second_round(flow, points[drowned], found.take(drowned)) / duration[drowned]
    out[:, drowned] = np.where(_CLEAR * norm < modulus[drowned].T, out[:, drowned], grown)
    out[-1, drowned] = grown.sum(axis=0) - out[:-1, drowned].sum(axis=0)
    return out


def _second_round(flow: ExactFlow, points: np.ndarray, found: Orbits) -> np.ndarray:
    """Logarithms (d, L) of the growth of orthonormal tangent vectors over one round, once they are aligned."""
    w, tangent = found.w, frame(flow.dimension, len(points))
    for _ in range(2):
        run = flow.advance(w, found.period, points=points, tangent=tangent, growth=True)
        tangent = run.tangent
    out = np.zeros((flow.dimension, len(points)))
    for n in np.unique(found.period):
        mine = np.flatnonzero(found.period == n)
        out[:, mine] = total(run.growth[:n, :, mine])
    return out


def frame(d: int, lanes: int) -> np.ndarray:
    """Orthonormal tangent vectors (d, d, lanes) in general position."""
    vectors = np.linalg.qr(np.ones((d, d)) + np.diag(np.arange(1.0, d + 1)))[0].T
    return np.repeat(vectors[:, :, None], lanes, axis=2)
