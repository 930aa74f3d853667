"""Time series of motions: sums, Lyapunov exponents with confidence intervals, weighted Birkhoff averages, spectra.

NumPy sums a contiguous axis pairwise and any other axis in sequence, which rounds differently. Therefore the time axis
is made contiguous before it is summed, and results do not depend, bit for bit, on the other trajectories of the batch.

Weighted Birkhoff averages converge fast on a smooth curve (an invariant torus) and slowly on a fractal set. S. Das,
C. B. Dock, Y. Saiki, M. Salgado-Flores, E. Sander, J. Wu, J. A. Yorke, *Measuring quasiperiodicity*, EPL 114 (2016)
40005. Amplitude spectra are taken over whole mesh periods, without leakage.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

BLOCKS = 20
"""Number of consecutive blocks of a run; the standard deviation of their means gives the confidence interval."""

_QUANTILE = 2.8609346064649794
"""Quantile 0.995 of Student's t with BLOCKS − 1 = 19 degrees of freedom: the half width of a 99 % interval in standard
errors. It is written out because importing scipy.special takes a tenth of a second."""

_NEWTON_STEPS = 8
_FREQUENCY_ROUNDING = 1e-15
"""Newton's method ends at a step of the frequency of at most this, its rounding error in cycles per mesh period."""

_REPEAT_TOLERANCE = 1e-6
"""Largest range of stroboscopic points that count as the same, relative to the largest coordinate (at least 1)."""

_LINE_POWER = 1 - 1e-5
_LINE_SHARE = 1 / 6
"""A spectrum is quasi-periodic if its strongest lines, a share `_LINE_SHARE` of all lines, contain at least the share
`_LINE_POWER` of the power."""

_FINER, _LENGTH = 4, 40
"""Of a signal at even instants: how many times as many are averaged, and half the length of filters in instants."""

KEPT = 0.47  # highest frequency that `resampled` keeps, over the fewer instants


def time_last(series: np.ndarray) -> np.ndarray:
    """A time series (N, ..., L) as a contiguous array (..., L, N)."""
    return np.ascontiguousarray(np.moveaxis(series, 0, -1))


def time_sum(series: np.ndarray) -> np.ndarray:
    """The sum (..., L) of a time series (N, ..., L) over time."""
    return time_last(series).sum(axis=-1)


@dataclass(frozen=True)
class Exponents:
    """Lyapunov exponents ``value`` per unit of τ, and the ends ``low`` and ``high`` of their intervals, all (K, L)."""

    value: np.ndarray
    low: np.ndarray
    high: np.ndarray


def exponents_from_growth(growth: np.ndarray, period: np.ndarray) -> Exponents:
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


def amplitudes(series: np.ndarray, periods: int) -> tuple[np.ndarray, np.ndarray]:
    """Amplitude spectrum of evenly spaced samples (N, ...) over a number of whole mesh periods.

    Returns the frequencies (N // 2 + 1,) in units of the mesh frequency, and the amplitudes (N // 2 + 1, ...) in units
    of the series; the first is the absolute mean.
    """
    n = len(series)
    spectrum = np.abs(np.fft.rfft(series, axis=0) / n)
    spectrum[1:] *= 2
    return np.arange(len(spectrum)) / periods, spectrum


def line_amplitudes(series: np.ndarray, length: int, repeats: bool) -> np.ndarray:
    """Amplitudes (length // 2 + 1,) of the lines of evenly spaced samples (N,) in windows of this many; the first is
    the absolute mean.

    Of a series that ``repeats`` with the window they are exact: the squares of all, halved, and that of the mean add up
    to the mean square. Otherwise they are root mean squares over Hann windows that overlap by half.
    """
    from scipy.signal import welch  # here, since it takes a third of a second to load

    window = "boxcar" if repeats else "hann"
    mean = series.mean()  # a Hann window would spread it over the first lines
    power = welch(series - mean, window=window, nperseg=length, detrend=False, scaling="spectrum")[1]
    return np.append(abs(mean), np.sqrt(2 * power[1:]))


def evenly(time: np.ndarray, values: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Even instants (N,), 1/``rate`` apart, and the signal at them.

    The signal has twice as many own instants by interpolation, is linear between these, is averaged over each of
    `_FINER` times as many even ones, and these are filtered: up to 0.4 ``rate`` it keeps its size to 3 %.
    """
    time = np.interp(np.arange(2 * len(time) - 1) / 2, np.arange(len(time)), time.astype(float))
    values = resampled(values.astype(float), 2, 1)[:-1]
    integral = np.concatenate([[0.0], np.cumsum(np.diff(time) * (values[1:] + values[:-1]) / 2)])
    edges = np.arange(time[0], time[-1], 1 / (_FINER * rate))
    before = np.searchsorted(time, edges, "right") - 1
    here = np.interp(edges, time, values)
    integral = integral[before] + (edges - time[before]) * (values[before] + here) / 2
    means = np.diff(integral) * _FINER * rate
    filtered = resampled(means, 1, _FINER)
    return edges[0] + (np.arange(len(filtered)) + 0.5 / _FINER) / rate, filtered


def resampled(values: np.ndarray, up: int, down: int) -> np.ndarray:
    """A signal (N,) at ``up``/``down`` times as many instants, filtered so that no frequency folds into another one.

    Frequencies up to `KEPT` of the fewer instants keep their size to 1e-4, but for some 40 instants at both ends.
    """
    from scipy.signal import firwin, resample_poly  # here, since they take a third of a second to load

    if (most := max(up, down)) == 1:
        return values
    low_pass = firwin(2 * _LENGTH * most + 1, 1 / most, window=("kaiser", 8.0))
    mean = values.mean()  # on which a filter leaves a ripple
    return resample_poly(values - mean, up, down, window=low_pass, padtype="line") + mean


def modulation(series: np.ndarray, windows: int, carrier: int, width: int, repeats: bool, power: int = 0) -> np.ndarray:
    """Amplitudes (width - 1,) of the lines 1, 2, … of the envelope of a series (N,) over its mean.

    The series is filtered to the lines of a window that are less than ``width`` from the line ``carrier``, each times
    this ``power`` of its frequency. For (1 + m cos Ωt) cos ωt the amplitude at Ω is m.
    """
    from scipy.signal import hilbert  # here, since it takes a third of a second to load

    line = np.fft.rfft(series)
    number = np.arange(len(line))
    line *= (np.abs(number - carrier * windows) < width * windows) * (number / (carrier * windows)) ** power
    found = line_amplitudes(np.abs(hilbert(np.fft.irfft(line, len(series)))), len(series) // windows, repeats)
    return found[1:width] / found[0]


def real_cepstrum(amplitude: np.ndarray, floor: float) -> np.ndarray:
    """The real cepstrum (N,) of the amplitudes of lines (N,), at quefrencies from 0 to half a window.

    Lines weaker than the share ``floor`` of the strongest one count as that. An echo a x(t − T) of x(t) has the value
    a/2 at T.
    """
    return np.fft.irfft(np.log(np.maximum(amplitude, floor * amplitude[1:].max())))[: len(amplitude)]


def spectral_class(sections: np.ndarray, longest: int = 64) -> tuple[str, int]:
    """The class of motion that the spectrum of stroboscopic points suggests, as the paper reads it from its spectra.

    From consecutive points (N, ...) it is "nT" for the smallest n up to ``longest`` mesh periods at which they repeat;
    otherwise "quasi-periodic" if a few spectral lines contain nearly the whole power, else "chaotic". Returns the label
    and n, or 0.
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
