"""Periodic curves, linear between knots with jumps at some of them, and their approximation as waveforms of a model.

Means, Fourier coefficients and errors are exact integrals of the curve.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gearchaos.errors import InputError
from gearchaos.model import MAX_LEVELS, HarmonicStiffness, SteppedStiffness
from gearchaos.validation import MAX_HARMONICS

_CONSTANT_SHARE = 0.05  # share of the steps that is distributed evenly over the period
# steps of the flow per period for each order of the highest harmonic, 2π/0.45 (``docs/method.md``). A level takes at
# least one step.
_STEPS_PER_HARMONIC = 14


@dataclass(frozen=True, eq=False)
class PeriodicCurve:
    """A function of period 1, linear between knots (pieces + 1,) from 0 to 1; where two pieces do not meet, it jumps.
    """

    knots: np.ndarray
    first: np.ndarray  # (pieces,): the values at the beginning of each piece, and at its end
    last: np.ndarray

    @property
    def widths(self) -> np.ndarray:
        return np.diff(self.knots)

    @property
    def mean(self) -> float:
        return float(self.widths @ (self.first + self.last)) / 2

    @property
    def jumps(self) -> np.ndarray:
        """Indices of the pieces at whose beginning the curve jumps."""
        return np.flatnonzero(self.first != np.roll(self.last, 1))

    @property
    def stepped(self) -> bool:
        return bool(np.all(self.first == self.last))

    def __call__(self, positions: np.ndarray) -> np.ndarray:
        """Values at positions of any shape; at a jump, the value after it."""
        t = np.mod(positions, 1.0)
        i = np.clip(np.searchsorted(self.knots, t, side="right") - 1, 0, len(self.first) - 1)
        return self.first[i] + (t - self.knots[i]) / self.widths[i] * (self.last[i] - self.first[i])

    def scaled(self, factor: float) -> PeriodicCurve:
        return PeriodicCurve(self.knots, self.first * factor, self.last * factor)

    def mean_square(self) -> float:
        return float(self.widths @ (self.first**2 + self.first * self.last + self.last**2)) / 3

    def interval_means(self, starts: np.ndarray) -> np.ndarray:
        """Means from each start (intervals,), increasing in [0, 1), to the next; the last ends at the first plus 1."""
        ends = np.append(starts[1:], 1 + starts[0])
        in_period = self._integral(np.minimum(ends, 1)) - self._integral(starts)
        return (in_period + self._integral(np.maximum(ends - 1, 0))) / (ends - starts)

    def _integral(self, positions: np.ndarray) -> np.ndarray:
        """Integral from 0 to positions in [0, 1]."""
        sums = np.concatenate([[0.0], np.cumsum(self.widths * (self.first + self.last) / 2)])
        i = np.clip(np.searchsorted(self.knots, positions, side="right") - 1, 0, len(self.first) - 1)
        x = positions - self.knots[i]
        slope = (self.last[i] - self.first[i]) / self.widths[i]
        return sums[i] + x * (self.first[i] + slope * x / 2)

    def fourier(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Amplitudes c_j ≥ 0 and phases α_j of Σ c_j cos(2πjt − α_j), each (count,), from harmonic 1 on."""
        omega = 2 * np.pi * np.arange(1, count + 1)[:, None]
        before, after = np.exp(-1j * omega * self.knots[:-1]), np.exp(-1j * omega * self.knots[1:])
        slope = (self.last - self.first) / self.widths
        terms = 1j * (self.last * after - self.first * before) / omega + slope * (after - before) / omega**2
        coefficients = 2 * terms.sum(axis=1)
        return np.abs(coefficients), -np.angle(coefficients)


def periodic_curve(positions: np.ndarray, values: np.ndarray) -> PeriodicCurve:
    """The curve through points in order from position 0 to 1, where two points at the same one are a jump."""
    rising = np.flatnonzero(np.diff(positions) > 0)
    return PeriodicCurve(np.append(positions[rising], 1.0), values[rising], values[rising + 1])


def folded(curve: PeriodicCurve, cycles: int, tolerance: float) -> tuple[PeriodicCurve, float] | None:
    """The mean over the equal parts of a curve, as a curve of period 1, and how far the parts differ from it, rms at
    knots.

    None for a curve with jumps whose pieces are not the same in all cycles. ``tolerance`` is the largest difference of
    knots, in cycles, that the rounding of positions explains.
    """
    edges, count = curve.knots * cycles, np.arange(cycles)[:, None]
    shape = (cycles, -1) if len(curve.first) % cycles == 0 else (1, -1)
    starts = edges[:-1].reshape(shape) - count[: shape[0]]
    if len(starts) == cycles and np.ptp(starts, axis=0).max() <= tolerance:
        knots = np.append(starts.mean(axis=0), 1.0)
        knots[0] = 0.0
        first, last = curve.first.reshape(shape), curve.last.reshape(shape)
    elif len(curve.jumps) == 0:
        knots = np.unique(np.append(np.round(np.mod(edges, 1.0), 12), (0.0, 1.0)))
        values = np.interp(knots + count, edges, np.append(curve.first, curve.last[-1]))
        first, last = values[:, :-1], values[:, 1:]
    else:
        return None
    mean = PeriodicCurve(knots, first.mean(axis=0), last.mean(axis=0))
    return mean, float(np.sqrt(np.mean((first - mean.first) ** 2 + (last - mean.last) ** 2) / 2))


def approximate(curve: PeriodicCurve, tolerance: float) -> tuple[SteppedStiffness | HarmonicStiffness, float]:
    """The waveform, of mean 1, that approximates a positive curve over its mean, and the root mean square of the
    difference.

    A curve of at most `MAX_LEVELS` constant pieces is taken over exactly. Any other is approximated twice: by steps of
    the mean of the curve over intervals, and by its Fourier series. Each has as few levels or harmonics as an error of
    at most ``tolerance`` needs; the error is larger if `MAX_LEVELS` levels and `MAX_HARMONICS` harmonics are too few.
    The one that the flow advances with fewer steps is chosen, or the more exact one if neither is that exact.
    """
    curve = curve.scaled(1 / curve.mean)
    if curve.stepped and max(len(curve.jumps), 1) <= MAX_LEVELS:
        jumps = curve.jumps if len(curve.jumps) else np.array([0])
        return SteppedStiffness(tuple(curve.first[jumps].tolist()), tuple(curve.knots[jumps].tolist())), 0.0
    results = (_steps(curve, tolerance), truncated_series(curve, *curve.fourier(MAX_HARMONICS), tolerance))
    found = [result for result in results if result]
    if not found:
        raise InputError("stiffness", f"must have at most {MAX_LEVELS} jumps", len(curve.jumps))
    precise = [result for result in found if result[1] <= tolerance]
    if precise:  # the one for which the flow needs fewer steps per period
        return min(precise, key=lambda result: len(result[0].jumps) or (
            _STEPS_PER_HARMONIC * len(result[0].harmonics()[0])))
    return min(found, key=lambda result: result[1])


def _steps(curve: PeriodicCurve, tolerance: float) -> tuple[SteppedStiffness, float] | None:
    """The approximation by steps and its error; None if the curve has more jumps than there may be levels."""
    starts = np.unique(np.append(curve.jumps, 0))
    if len(starts) > MAX_LEVELS:
        return None
    low, high = len(starts), MAX_LEVELS
    while low < high:  # the error falls with the number of levels
        middle = (low + high) // 2
        low, high = (low, middle) if _step_error(curve, _step_edges(curve, starts, middle)) <= tolerance else (
            middle + 1, high)
    edges = _step_edges(curve, starts, low)
    waveform = SteppedStiffness(tuple(curve.interval_means(edges).tolist()), tuple(edges.tolist()))
    return waveform, _step_error(curve, edges)


def _step_edges(curve: PeriodicCurve, starts: np.ndarray, count: int) -> np.ndarray:
    """Where ``count`` steps begin, (count,): at the smooth parts, whose first pieces are given, and within them.

    The error is least where each step of a smooth part has the same share of ∫ |k′|^(2/3) dt. A small constant is added
    to |k′|^(2/3), so that steps also end where a constant part does.
    """
    pieces = curve.widths ** (1 / 3) * np.abs(curve.last - curve.first) ** (2 / 3)
    weight = np.append(0.0, np.cumsum(pieces + _CONSTANT_SHARE * pieces.sum() * curve.widths))
    ends = np.append(starts[1:], len(curve.first))
    shares = weight[ends] - weight[starts]
    counts = np.ones(len(starts), dtype=int)
    for _ in range(count - len(starts)):  # one more step for the part whose steps have the largest share
        counts[np.argmax(shares / counts)] += 1
    return np.unique(np.concatenate([
        np.interp(np.linspace(weight[a], weight[b], n, endpoint=False), weight[a : b + 1], curve.knots[a : b + 1])
        for a, b, n in zip(starts, ends, counts, strict=True)]))


def _step_error(curve: PeriodicCurve, edges: np.ndarray) -> float:
    """Root mean square of a curve less its means over the intervals between edges, of which the first is 0."""
    knots = np.union1d(curve.knots, edges)
    i = np.searchsorted(curve.knots, knots[:-1], side="right") - 1
    slope = (curve.last[i] - curve.first[i]) / curve.widths[i]
    at_knot = curve.first[i] - curve.interval_means(edges)[np.searchsorted(edges, knots[:-1], side="right") - 1]
    first, last = (at_knot + slope * (ends - curve.knots[i]) for ends in (knots[:-1], knots[1:]))
    return float(np.sqrt(PeriodicCurve(knots, first, last).mean_square()))


def truncated_series(
    curve: PeriodicCurve, amplitudes: np.ndarray, phases: np.ndarray, tolerance: float,
) -> tuple[HarmonicStiffness, float] | None:
    """The first harmonics of a curve of mean 1, as many as a tolerance needs or all given, and the rms of the rest;
    None if they are not positive everywhere. ``amplitudes`` and ``phases`` are arrays from harmonic 1 on.
    """
    variance = PeriodicCurve(curve.knots, curve.first - 1, curve.last - 1).mean_square()
    errors = np.sqrt(np.maximum(variance - np.cumsum(amplitudes**2) / 2, 0.0))
    precise = np.flatnonzero(errors <= tolerance)
    count = int(precise[0]) + 1 if len(precise) else len(errors)
    try:
        waveform = HarmonicStiffness(tuple(amplitudes[:count].tolist()), tuple(phases[:count].tolist()))
    except InputError:  # a part of a series may be negative next to a large jump
        return None
    return waveform, float(errors[count - 1])
