"""Lyapunov exponents with confidence intervals, from the exact tangent flow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearchaos.dynamics.orbits import Orbits
from gearchaos.dynamics.time_series import time_last, time_sum
from gearchaos.flow import ExactFlow

BLOCKS = 20
"""Number of consecutive blocks of a run; the standard deviation of their means gives the confidence interval."""

_QUANTILE = 2.8609346064649794
"""Quantile 0.995 of Student's t with BLOCKS − 1 = 19 degrees of freedom: the half width of a 99 % interval in standard
errors. It is written out because importing scipy.special takes a tenth of a second."""

_MAX_LOG_DETERMINANT_ERROR = 1e-6
"""Largest |Σ ln|μ| − tr A · nT| at which all multipliers of an orbit count as resolved."""

_SMALLEST_RESOLVED = 1e-6
"""Where they do not: the smallest multiplier that still counts as resolved, relative to the Frobenius norm of the
monodromy matrix."""


@dataclass(frozen=True)
class Exponents:
    """Lyapunov exponents ``value`` per unit of τ, and the ends ``low`` and ``high`` of their intervals, all (K, L)."""

    value: np.ndarray
    low: np.ndarray
    high: np.ndarray


def from_growth(growth: np.ndarray, period: np.ndarray) -> Exponents:
    """Lyapunov exponents of a run with mesh periods (L,), from ``growth`` (N, K, L).

    This is the logarithm of the growth of K orthogonal tangent vectors in each mesh period. The 99 % intervals are
    Student's from the means of `BLOCKS` consecutive blocks: successive periods are correlated, means of long blocks
    much less. The first N mod `BLOCKS` periods are dropped.
    """
    length = len(growth) // BLOCKS
    series = time_last(growth[-length * BLOCKS :])
    blocks = np.moveaxis(series.reshape(*series.shape[:-1], BLOCKS, length).mean(axis=-1), -1, 0) / period
    value = blocks.mean(axis=0)
    half = _QUANTILE * blocks.std(axis=0, ddof=1) / np.sqrt(BLOCKS)
    return Exponents(value, value - half, value + half)


def of_orbits(flow: ExactFlow, points: np.ndarray, orbits: Orbits) -> np.ndarray:
    """Exact Lyapunov exponents (d, L) of periodic orbits, ln|μ|/(nT), per unit of τ.

    The product of the multipliers is det(monodromy) = exp(tr A · nT). Where the computed multipliers violate this, the
    smallest are below the rounding errors of the monodromy matrix. Exponents of multipliers that are small against its
    norm are then taken from the growth of orthonormalised tangent vectors, and the last exponent is the trace minus the
    sum of the others.
    """
    duration = orbits.period * flow.system.period[points]
    modulus = np.abs(orbits.multipliers)
    with np.errstate(divide="ignore"):
        exponents = np.log(modulus).T / duration
    error = np.abs(exponents.sum(axis=0) - flow.system.trace[points]) * duration
    inexact = np.flatnonzero(~(error < _MAX_LOG_DETERMINANT_ERROR))
    if len(inexact) == 0:
        return exponents
    norm = np.linalg.norm(orbits.monodromy[inexact], axis=(1, 2))
    growth = _aligned_growth(flow, points[inexact], orbits.take(inexact)) / duration[inexact]
    exponents[:, inexact] = np.where(_SMALLEST_RESOLVED * norm < modulus[inexact].T, exponents[:, inexact], growth)
    exponents[-1, inexact] = growth.sum(axis=0) - exponents[:-1, inexact].sum(axis=0)
    return exponents


def _aligned_growth(flow: ExactFlow, points: np.ndarray, orbits: Orbits) -> np.ndarray:
    """Logarithms (d, L) of the growth of orthonormal tangent vectors over one period of each orbit.

    The vectors align with the Lyapunov vectors in the first period; the growth is that of the second.
    """
    w, tangent = orbits.w, tangent_frame(flow.dimension, len(points))
    for _ in range(2):
        run = flow.advance(w, orbits.period, points=points, tangent=tangent, growth=True)
        tangent = run.tangent
    out = np.zeros((flow.dimension, len(points)))
    for n in np.unique(orbits.period):
        same = np.flatnonzero(orbits.period == n)
        out[:, same] = time_sum(run.growth[:n, :, same])
    return out


def tangent_frame(d: int, count: int) -> np.ndarray:
    """Orthonormal tangent vectors in general position, the same for all motions, (d vectors, d coordinates, count)."""
    vectors = np.linalg.qr(np.ones((d, d)) + np.diag(np.arange(1.0, d + 1)))[0].T
    return np.repeat(vectors[:, :, None], count, axis=2)
