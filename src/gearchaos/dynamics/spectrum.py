"""Amplitude spectra over whole mesh periods, without leakage, and the class of motion that they suggest."""

from __future__ import annotations

import numpy as np

_REPEAT_TOLERANCE = 1e-6
"""Largest range of stroboscopic points that count as the same, relative to the largest coordinate (at least 1)."""

_LINE_POWER = 1 - 1e-5
_LINE_SHARE = 1 / 6
"""A spectrum is quasi-periodic if its strongest lines, a share `_LINE_SHARE` of all lines, contain at least the share
`_LINE_POWER` of the power."""


def amplitudes(series: np.ndarray, periods: int) -> tuple[np.ndarray, np.ndarray]:
    """Amplitude spectrum of a series over whole mesh periods.

    Parameters
    ----------
    series : (N, ...)
        Evenly spaced samples.
    periods : int
        Number of mesh periods that the samples cover.

    Returns
    -------
    orders : (N // 2 + 1,)
        Frequencies in units of the mesh frequency.
    amplitudes : (N // 2 + 1, ...)
        In units of the series; the first is the absolute mean.
    """
    n = len(series)
    spectrum = np.abs(np.fft.rfft(series, axis=0) / n)
    spectrum[1:] *= 2
    return np.arange(len(spectrum)) / periods, spectrum


def spectral_class(sections: np.ndarray, longest: int = 64) -> tuple[str, int]:
    """The class of motion that the spectrum of stroboscopic points suggests, as the paper reads it from its spectra.

    Parameters
    ----------
    sections : (N, ...)
        Consecutive stroboscopic points.
    longest : int
        Longest period considered, in mesh periods.

    Returns
    -------
    label : str
        "nT" for the smallest n at which the points repeat; otherwise "quasi-periodic" if a few spectral lines contain
        nearly the whole power, else "chaotic".
    period : int
        n, or 0.
    """
    for n in range(1, longest + 1):
        if len(sections) // n < 2:
            break
        whole = sections[-(len(sections) // n) * n :]
        folded = whole.reshape(-1, n, *whole.shape[1:])
        if np.all(np.ptp(folded, axis=0) <= _REPEAT_TOLERANCE * np.maximum(np.abs(whole).max(), 1.0)):
            return f"{n}T", n
    window = _blackman_harris(len(sections))[:, None]
    centred = sections.reshape(len(sections), -1) - sections.reshape(len(sections), -1).mean(axis=0)
    power = (np.abs(np.fft.rfft(window * centred, axis=0)) ** 2).sum(axis=1)
    strongest = np.sort(power)[::-1][: int(_LINE_SHARE * len(power))]
    return ("quasi-periodic", 0) if strongest.sum() >= _LINE_POWER * power.sum() else ("chaotic", 0)


def _blackman_harris(n: int) -> np.ndarray:
    """The four-term Blackman-Harris window (F. J. Harris, Proc. IEEE 66 (1978) 51).

    Written out because importing SciPy's takes a second.
    """
    angle = 2 * np.pi * np.arange(n) / (n - 1)
    return 0.35875 - 0.48829 * np.cos(angle) + 0.14128 * np.cos(2 * angle) - 0.01168 * np.cos(3 * angle)
