"""The spectral class of the paper and weighted Birkhoff averages, on series of known class."""

import numpy as np
import pytest
from scipy.signal.windows import blackmanharris

from gearchaos.dynamics import time_series
from gearchaos.dynamics.time_series import _blackman_harris, amplitudes, spectral_class


@pytest.mark.parametrize("n", [64, 511, 512])
def test_the_window_is_scipys(n):
    np.testing.assert_allclose(_blackman_harris(n), blackmanharris(n), atol=1e-15)


@pytest.mark.parametrize("period", [1, 2, 7, 64])
def test_a_section_that_repeats_to_a_millionth_has_that_period(period):
    rng = np.random.default_rng(period)
    once = rng.normal(size=(period, 2))
    series = np.tile(once, (-(-512 // period), 1))[-512:]
    scatter = rng.uniform(-0.4, 0.4, series.shape)
    assert spectral_class(series + 1e-6 * scatter) == (f"{period}T", period)
    assert spectral_class(series + 1e-4 * scatter)[1] == 0
    assert spectral_class(1e4 * (series + 1e-6 * scatter)) == (f"{period}T", period)


def test_a_period_beyond_the_longest_is_none():
    series = np.tile(np.random.default_rng(0).normal(size=(65, 1)), (8, 1))[:512]
    assert spectral_class(series)[1] == 0 and spectral_class(series, longest=65) == ("65T", 65)


@pytest.mark.parametrize(("rest", "label"), [(1e-7, "quasi-periodic"), (1e-4, "chaotic")])
def test_quasi_periodic_is_all_but_a_hundred_thousandth_of_the_power_in_a_sixth_of_the_lines(rest, label):
    """White noise of this share of the power has five sixths of itself in the other lines."""
    n = np.arange(512)[:, None]
    noise = np.random.default_rng(3).normal(size=(512, 1)) * np.sqrt(rest / 2)
    assert spectral_class(np.cos(n) + noise + 5.0) == (label, 0)


def test_the_mean_has_no_weight_in_the_spectral_class():
    rng = np.random.default_rng(4)
    assert spectral_class(1e6 + rng.normal(size=(512, 2))) == ("chaotic", 0)


def test_amplitudes_are_those_of_the_cosines():
    t = np.arange(96) / 32
    series = np.stack([0.7 + 0.2 * np.cos(2 * np.pi * 4 * t), np.sin(2 * np.pi * t / 3)], axis=1)
    orders, found = amplitudes(series, 3)
    np.testing.assert_allclose(orders, np.arange(49) / 3)
    expected = np.zeros((49, 2))
    expected[0, 0], expected[12, 0], expected[1, 1] = 0.7, 0.2, 1.0
    np.testing.assert_allclose(found, expected, atol=1e-14)


def test_weighted_averages_are_of_either_half():
    """The weights exp(−1/t(1 − t)) are even about the middle, so a line has its mean there."""
    n = np.arange(2001)[:, None] * np.array([[1.0, -2.0]])
    first, second = time_series.half_averages(n)
    np.testing.assert_allclose(first, [500.5, -1001.0])
    np.testing.assert_allclose(second, [1500.5, -3001.0])
    t = np.arange(1, 1001) / 1001
    weight = np.exp(-1 / (t * (1 - t)))
    np.testing.assert_allclose(time_series.half_averages(n**2)[0], weight @ n[1:1001] ** 2 / weight.sum())


@pytest.mark.parametrize("rho", [0.0123, 0.1234567, 0.25 - 1e-3, 0.4877, (np.sqrt(5) - 1) / 4])
def test_a_frequency_is_found_with_either_phase_far_beyond_the_resolution_of_the_spectrum(rho):
    turns = 2 * np.pi * rho * np.arange(2000)[:, None]
    series = 3.0 + np.cos(turns + np.array([0.0, 1.0, 2.0])) + 0.2 * np.cos(2 * turns + 1.0)
    np.testing.assert_allclose(time_series.dominant_frequency(series), rho, atol=1e-10)


def logistic():
    found = [0.3]
    for _ in range(999):
        found.append(3.9 * found[-1] * (1 - found[-1]))
    return np.array(found)


N = np.arange(1000)


@pytest.mark.parametrize(("series", "least", "most"), [
    (np.cos(N), 6, 30), (np.cos(np.sqrt(2) * N) + 0.3 * np.cos(2 * np.sqrt(2) * N), 6, 30),
    (1e6 + 1e-3 * np.cos(N), 6, 30), (np.cos(N) + N / 1000, 0, 1), ((1 + N / 1000) * np.cos(N), 0, 1),
    (logistic(), 0, 3)], ids=["circle", "curve", "far from 0", "drift", "growing", "fractal"])
def test_digits_are_of_the_series_and_its_square_in_standard_deviations(series, least, most):
    """A symmetric motion whose size grows has the mean of its square in doubt, not its own."""
    assert least < time_series.agreeing_digits(series[:, None])[0] < most
