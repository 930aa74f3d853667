"""Lyapunov exponents with confidence intervals, from the exact tangent flow."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

BLOCKS = 20
"""Stretches of the motion whose means tell how sure the exponent is."""

_CONFIDENCE = 0.99


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
    blocks = growth[-length * BLOCKS :].reshape(BLOCKS, length, *growth.shape[1:]).mean(axis=1) / period
    value = blocks.mean(axis=0)
    half = stdtrit(BLOCKS - 1, 0.5 + _CONFIDENCE / 2) * blocks.std(axis=0, ddof=1) / np.sqrt(BLOCKS)
    return Exponents(value, value - half, value + half)


def from_multipliers(multipliers: np.ndarray, duration: np.ndarray) -> np.ndarray:
    """Exponents (L, d) of a periodic orbit, ln|μ| over its duration nT (L,): exact, no interval."""
    with np.errstate(divide="ignore"):
        return np.log(np.abs(multipliers)) / duration[:, None]
