"""Periodic curves: exact integrals, and waveforms whose errors are what they are said to be."""

import numpy as np
import pytest

from gearchaos.errors import InputError
from gearchaos.gears.stiffness import from_curve
from gearchaos.gears.stiffness.periodic_curves import PeriodicCurve, approximate, periodic_curve, truncated_series
from gearchaos.model import HarmonicStiffness, SteppedStiffness

GRID = (np.arange(200_000) + 0.5) / 200_000


def sawtooth():
    """2 at 0, falls to 1 at 0.25, jumps to 3, falls to 2 at 1."""
    return periodic_curve(np.array([0, 0.25, 0.25, 1]), np.array([2.0, 1.0, 3.0, 2.0]))


def wave(points=401, harmonics=((0.3, 0.4), (0.1, -1.0), (0.0, 0.0), (0.05, 2.0))):
    """1 + Σ c_j cos(2πjt − α_j) at equally spaced points."""
    t = np.linspace(0, 1, points)
    values = 1 + sum(c * np.cos(2 * np.pi * j * t - a) for j, (c, a) in enumerate(harmonics, 1))
    return periodic_curve(t, values)


def test_mean_and_values_of_the_sawtooth():
    curve = sawtooth()
    assert curve.mean == pytest.approx(0.25 * 1.5 + 0.75 * 2.5, abs=1e-15)
    assert curve.mean_square() == pytest.approx(0.25 * 7 / 3 + 0.75 * 19 / 3, abs=1e-14)
    assert curve.jumps.tolist() == [1] and not curve.stepped
    # those after a jump, and periodic
    assert curve(np.array([0, 0.125, 0.25, 0.625, 1, 1.125, -0.375])) == pytest.approx([2, 1.5, 3, 2.5, 2, 1.5, 2.5])
    means = curve.interval_means(np.array([0.125, 0.25, 0.5]))  # also across the end of the period
    assert means == pytest.approx([1.25, 3 - 1 / 6, (0.5 * (3 - 1 / 3 + 2) / 2 + 0.125 * 1.75) / 0.625], abs=1e-14)


@pytest.mark.parametrize("curve", [sawtooth(), wave(37)])
def test_fourier_coefficients_agree_with_quadrature(curve):
    amplitudes, phases = curve.fourier(6)
    for j, (amplitude, phase) in enumerate(zip(amplitudes, phases, strict=True), 1):
        integral = 2 * np.mean(curve(GRID) * np.exp(-2j * np.pi * j * GRID))
        assert amplitude * np.exp(-1j * phase) == pytest.approx(integral, abs=1e-9)


def test_table_of_a_series_gives_the_series_back():
    """A curve through 401 points of a series has its harmonics but for the factor of linear interpolation."""
    amplitudes, phases = wave().fourier(5)
    sinc = np.sinc(np.arange(1, 6) / 400) ** 2
    assert amplitudes / sinc == pytest.approx([0.3, 0.1, 0, 0.05, 0], abs=1e-14)
    assert phases[[0, 1, 3]] == pytest.approx([0.4, -1.0, 2.0], abs=1e-12)


def test_equal_steps_are_one_step_also_across_the_end_of_the_period():
    levels = np.array([3.0, 1.0, 1.0, 3.0])
    waveform, error = approximate(PeriodicCurve(np.array([0, 0.2, 0.4, 0.6, 1]), levels, levels), 1e-3)
    assert waveform.starts == (0.2, 0.6) and waveform.levels == pytest.approx((1 / 2.2, 3 / 2.2)) and error == 0
    waveform, error = approximate(PeriodicCurve(np.array([0, 0.5, 1]), np.ones(2), np.ones(2)), 1e-3)
    assert waveform == SteppedStiffness((1.0,), (0.0,)) and error == 0


def test_sixty_four_steps_are_kept_and_more_are_approximated():
    for count, exact in ((64, True), (66, False)):
        levels = np.where(np.arange(count) % 2, 1.2, 0.8)
        waveform, error = approximate(PeriodicCurve(np.arange(count + 1) / count, levels, levels), 1e-3)
        assert (error == 0) is exact and isinstance(waveform, SteppedStiffness) is exact


@pytest.mark.parametrize("tolerance", [0.1, 0.01, 3e-3])
@pytest.mark.parametrize("curve", [sawtooth(), wave(), PeriodicCurve(
    np.array([0, 0.3, 0.5, 1]), np.array([1.0, 1.0, 2.0]), np.array([1.0, 2.0, 2.0]))])
def test_error_is_the_root_mean_square_and_within_the_tolerance(curve, tolerance):
    stiffness = from_curve(curve, "test", tolerance=tolerance)
    found = stiffness(GRID)
    rms = np.sqrt(np.mean((found - curve(GRID)) ** 2)) / curve.mean
    assert stiffness.truncation == pytest.approx(rms, rel=2e-3)
    assert np.mean(found) == pytest.approx(curve.mean, rel=1e-5)
    bound_met = stiffness.truncation <= tolerance
    assert bound_met == (stiffness.notes == ())
    assert bound_met or tolerance < 0.01


def test_error_of_a_linear_part_is_least_with_equal_steps():
    """n equal steps of a line that rises by d have the root mean square error d/(n √12)."""
    line = periodic_curve(np.array([0, 1.0, 1.0]), np.array([0.8, 1.2, 0.8]))
    waveform, error = approximate(line, 0.0116)
    assert isinstance(waveform, SteppedStiffness) and len(waveform.levels) == 10
    assert error == pytest.approx(0.4 / 10 / np.sqrt(12), rel=1e-12)
    assert np.diff(waveform.starts) == pytest.approx(np.full(9, 0.1), abs=1e-12)


def test_steps_are_narrow_where_the_curve_is_steep():
    """n steps of k(t) have at best the root mean square error (∫ |k′|^(2/3) dt)^(3/2)/(n √12)."""
    t = np.linspace(0, 1, 2001)
    curve = periodic_curve(np.append(t, 1.0), np.append(1 + t**6, 1.0))
    waveform, error = approximate(curve, 0.006)
    best = (6 ** (2 / 3) / (1 + 10 / 3)) ** 1.5 / (len(waveform.levels) * np.sqrt(12)) / curve.mean
    assert isinstance(waveform, SteppedStiffness) and best < error < 1.02 * best


@pytest.mark.parametrize(("curve", "kind"), [(wave(), HarmonicStiffness), (sawtooth(), SteppedStiffness)])
def test_the_more_exact_approximation_is_taken_if_neither_is_exact_enough(curve, kind):
    found = from_curve(curve, "test", tolerance=1e-9)
    assert isinstance(found.waveform, kind) and len(found.notes) == 1


def test_of_two_exact_approximations_the_one_with_fewer_steps_of_the_flow_is_taken():
    """At an error of 2 % one harmonic, 14 steps, or 11 levels; at 1 % still one harmonic, but more levels than 14."""
    curve = wave(harmonics=((0.2, 0.0),))
    assert isinstance(approximate(curve, 0.02)[0], SteppedStiffness)
    waveform, error = approximate(curve, 0.01)
    assert isinstance(waveform, HarmonicStiffness) and len(waveform.amplitudes) == 1 and error < 1e-4


def test_a_series_that_is_negative_next_to_a_jump_is_not_used():
    curve = PeriodicCurve(np.array([0, 0.5, 1]), np.array([1.99, 0.01]), np.array([1.99, 0.01]))
    assert truncated_series(curve, *curve.fourier(9), 1e-6) is None


def test_too_many_jumps_with_a_series_that_is_not_positive_are_refused():
    levels = np.where(np.arange(80) < 40, 1.999, 0.001) * np.where(np.arange(80) % 2, 1.0, 1.0001)
    with pytest.raises(InputError, match="at most 64 jumps"):
        approximate(PeriodicCurve(np.arange(81) / 80, levels, levels), 1e-6)


def test_a_tolerance_that_is_not_positive_is_refused():
    with pytest.raises(InputError, match="tolerance must be"):
        from_curve(sawtooth(), "test", tolerance=0.0)
