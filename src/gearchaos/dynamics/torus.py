"""Weighted Birkhoff averages: a test of whether the stroboscopic points of a motion fill a smooth curve.

The averages converge fast on a smooth curve (an invariant torus) and slowly on a fractal set. S. Das, C. B. Dock,
Y. Saiki, M. Salgado-Flores, E. Sander, J. Wu, J. A. Yorke, *Measuring quasiperiodicity*, EPL 114 (2016) 40005.
"""

from __future__ import annotations

import numpy as np

from gearchaos.dynamics.series import time_last

_NEWTON_STEPS = 8
_FREQUENCY_ROUNDING = 1e-15
"""Newton's method ends at a step of the frequency of at most this, its rounding error in cycles per mesh period."""


def _weights(n: int) -> np.ndarray:
    """Weights (n,) of a Birkhoff average: exp(−1/(t(1 − t))) at t = k/(n + 1), normalised to the sum 1."""
    t = np.arange(1, n + 1) / (n + 1)
    bump = np.exp(-1 / (t * (1 - t)))
    return bump / bump.sum()


def half_averages(series: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Weighted Birkhoff averages (...) of the first and of the second half of a series (N, ...)."""
    n = len(series) // 2
    series, weight = time_last(series), _weights(n)
    first, second = ((weight * part).sum(axis=-1) for part in (series[..., -2 * n : -n], series[..., -n:]))
    return first, second


def agreeing_digits(series: np.ndarray) -> np.ndarray:
    """Decimal digits (L,) to which the weighted Birkhoff averages of both halves of a series (N, L) agree.

    The difference is measured in standard deviations of the series. The result is the smaller of the digits for the
    series and for its square: the mean of a symmetric motion is zero whether the motion is smooth or not.
    Quasi-periodic motions reach many digits, chaotic ones one or two.
    """
    by_motion = time_last(series)
    centred = (series - by_motion.mean(axis=-1)) / np.maximum(by_motion.std(axis=-1), 1e-300)
    differences = [np.abs(np.subtract(*half_averages(f))) for f in (centred, centred**2)]
    return -np.log10(np.maximum(np.maximum(*differences), 1e-16))


def dominant_frequency(series: np.ndarray) -> np.ndarray:
    """The frequency (L,) of the strongest spectral line of series (N, L), in cycles per sample, from 0 to 1/2.

    Of the stroboscopic series of an invariant curve it is the rotation number or a multiple of it (modulo 1). The line
    of the windowed discrete spectrum is refined by Newton's method to the maximum of the weighted amplitude (J. Laskar,
    *Frequency analysis for multi-dimensional systems*, Physica D 67 (1993) 257).
    """
    n, series = len(series), time_last(series)
    weighted = _weights(n) * (series - series.mean(axis=-1, keepdims=True))
    spectrum = np.abs(np.fft.rfft(weighted, axis=-1))
    spectrum[:, :2] = 0.0
    frequency, k = np.argmax(spectrum, axis=-1) / n, np.arange(n) - n / 2
    active = np.arange(len(series))
    for _ in range(_NEWTON_STEPS):
        demodulated = weighted[active] * np.exp(-2j * np.pi * frequency[active, None] * k)
        # the weighted amplitude at the frequency, and its first and second derivatives
        a, b, c = ((demodulated * (-2j * np.pi * k) ** m).sum(axis=-1) for m in range(3))
        first = 2 * (a.conj() * b).real
        second = 2 * (np.abs(b) ** 2 + (a.conj() * c).real)
        step = np.clip(np.divide(first, second, out=np.zeros(len(first)), where=second < 0), -0.5 / n, 0.5 / n)
        frequency[active] -= step
        active = active[np.abs(step) > _FREQUENCY_ROUNDING]
    return frequency
