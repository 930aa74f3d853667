"""The paper's own way: the spectrum over whole mesh periods, lines without leakage."""

from __future__ import annotations

import numpy as np

_LINE = 1e-6
_CARRIED = 1 - 1e-5
_FEW = 1 / 6


def amplitudes(series: np.ndarray, periods: int) -> tuple[np.ndarray, np.ndarray]:
    """Orders of the mesh frequency and amplitudes of a series sampled evenly over whole mesh periods (N, ...)."""
    n = len(series)
    spectrum = np.abs(np.fft.rfft(series, axis=0)) / n
    spectrum[1:] *= 2
    return np.arange(len(spectrum)) / periods, spectrum


def spectral_class(sections: np.ndarray, longest: int = 64) -> tuple[str, int]:
    """Label and period that the spectrum of the stroboscopic section (N, ...) suggests.

    A motion is nT-periodic if the smallest n carries the whole power of the section in lines at multiples of 1/n of
    the mesh frequency; quasi-periodic if few lines elsewhere do; else chaotic. The period is 0 where there is none.
    """
    for n in range(1, longest + 1):
        if len(sections) // n < 2:
            break
        whole = sections[-(len(sections) // n) * n :]
        folded = whole.reshape(-1, n, *whole.shape[1:])
        if np.all(np.ptp(folded, axis=0) <= _LINE * np.maximum(np.abs(whole).max(), 1.0)):
            return f"{n}T", n
    window = _blackman_harris(len(sections))[:, None]
    centred = sections.reshape(len(sections), -1) - sections.reshape(len(sections), -1).mean(axis=0)
    power = (np.abs(np.fft.rfft(window * centred, axis=0)) ** 2).sum(axis=1)
    strongest = np.sort(power)[::-1]
    few = int(_FEW * len(power))
    return ("quasi-periodic", 0) if strongest[:few].sum() >= _CARRIED * power.sum() else ("chaotic", 0)


def _blackman_harris(n: int) -> np.ndarray:
    """The four-term Blackman-Harris window (F. J. Harris, Proc. IEEE 66 (1978) 51); SciPy's takes a second to load."""
    angle = 2 * np.pi * np.arange(n) / (n - 1)
    return 0.35875 - 0.48829 * np.cos(angle) + 0.14128 * np.cos(2 * angle) - 0.01168 * np.cos(3 * angle)
