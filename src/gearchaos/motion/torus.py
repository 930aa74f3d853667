"""Does a motion fill a smooth curve or a fractal? Weighted Birkhoff averages settle fast only on the curve.

S. Das, C. B. Dock, Y. Saiki, M. Salgado-Flores, E. Sander, J. Wu, J. A. Yorke, *Measuring quasiperiodicity*, EPL 114
(2016) 40005.
"""

from __future__ import annotations

import numpy as np


def _weights(n: int) -> np.ndarray:
    t = np.arange(1, n + 1) / (n + 1)
    bump = np.exp(-1 / (t * (1 - t)))
    return bump / bump.sum()


def digits(series: np.ndarray) -> np.ndarray:
    """Decimal digits (L,) to which the weighted averages of both halves of a series (N, L) agree.

    Measured in units of the series' standard deviation; the least over the series itself and its square, so that a
    symmetric motion is not taken for a smooth one. Quasi-periodic motions reach many, chaotic ones one or two.
    """
    n = len(series) // 2
    weight = _weights(n)
    spread = np.maximum(series.std(axis=0), 1e-300)
    centred = (series - series.mean(axis=0)) / spread
    least = np.full(series.shape[1], 16.0)
    for f in (centred, centred**2):
        gap = np.abs(np.tensordot(weight, f[:n] - f[-n:], axes=1))
        least = np.minimum(least, -np.log10(np.maximum(gap, 1e-16)))
    return least
