"""Does a motion fill a smooth curve or a fractal? Weighted Birkhoff averages settle fast only on the curve.

S. Das, C. B. Dock, Y. Saiki, M. Salgado-Flores, E. Sander, J. Wu, J. A. Yorke, *Measuring quasiperiodicity*, EPL 114
(2016) 40005.
"""

from __future__ import annotations

import numpy as np

from gearchaos.dynamics.series import by_lane

_NEWTON = 8
_SETTLED = 1e-15
"""A step of the frequency, in cycles per mesh period, that is no more than rounding."""


def _weights(n: int) -> np.ndarray:
    t = np.arange(1, n + 1) / (n + 1)
    bump = np.exp(-1 / (t * (1 - t)))
    return bump / bump.sum()


def halves(series: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Weighted Birkhoff averages (...) of the first and of the second half of a series (N, ...)."""
    n = len(series) // 2
    series, weight = by_lane(series), _weights(n)
    first, second = ((weight * part).sum(axis=-1) for part in (series[..., -2 * n : -n], series[..., -n:]))
    return first, second


def digits(series: np.ndarray) -> np.ndarray:
    """Decimal digits (L,) to which the weighted averages of both halves of a series (N, L) agree.

    Measured in units of the series' standard deviation; the least over the series itself and its square, so that a
    symmetric motion is not taken for a smooth one. Quasi-periodic motions reach many, chaotic ones one or two.
    """
    lanes = by_lane(series)
    centred = (series - lanes.mean(axis=-1)) / np.maximum(lanes.std(axis=-1), 1e-300)
    gaps = [np.abs(np.subtract(*halves(f))) for f in (centred, centred**2)]
    return -np.log10(np.maximum(np.maximum(*gaps), 1e-16))


def rotation(series: np.ndarray) -> np.ndarray:
    """The frequency (L,) of the strongest line of stroboscopic series (N, L), in cycles per mesh period, 0 to 1/2.

    On an invariant curve it is the rotation number or one of its multiples, refined from the line of the windowed
    spectrum to where the weighted amplitude is largest (J. Laskar, *Frequency analysis for multi-dimensional
    systems*, Physica D 67 (1993) 257).
    """
    n, series = len(series), by_lane(series)
    weighted = _weights(n) * (series - series.mean(axis=-1, keepdims=True))
    spectrum = np.abs(np.fft.rfft(weighted, axis=-1))
    spectrum[:, :2] = 0.0
    frequency, k = np.argmax(spectrum, axis=-1) / n, np.arange(n) - n / 2
    busy = np.arange(len(series))
    for _ in range(_NEWTON):
        turned = weighted[busy] * np.exp(-2j * np.pi * frequency[busy, None] * k)
        a, b, c = ((turned * (-2j * np.pi * k) ** m).sum(axis=-1) for m in range(3))
        slope = 2 * (a.conj() * b).real
        bend = 2 * (np.abs(b) ** 2 + (a.conj() * c).real)
        step = np.clip(np.divide(slope, bend, out=np.zeros(len(slope)), where=bend < 0), -0.5 / n, 0.5 / n)
        frequency[busy] -= step
        busy = busy[np.abs(step) > _SETTLED]
    return frequency
