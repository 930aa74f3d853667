"""Contact lines: lengths counted in the zone of contact, and Fourier coefficients by numerical quadrature."""

import numpy as np
import pytest

from gearchaos.errors import InputError
from gearchaos.gears.stiffness.iso6336 import fourier_coefficients, relative_length

RATIOS = [(1.5491, 1.08337), (1.6, 0.3), (1.2, 2.5), (0.7, 0.6), (2.3, 0.0), (1.4, 0.0), (3.7, 1.9), (1.05, 1e-3)]


def length(position, contact_ratio, overlap_ratio, slices=100_000):
    """Relative length of the contact lines by counting slices of the face width that are in contact."""
    behind = (np.arange(slices) + 0.5) / slices * overlap_ratio  # how much later a slice enters than the first one
    progress = position + np.arange(10)[:, None] - behind
    return ((progress >= 0) & (progress < contact_ratio)).sum() / slices / contact_ratio


@pytest.mark.parametrize("ratios", RATIOS)
def test_lengths_are_those_counted_slice_by_slice(ratios):
    curve = relative_length(*ratios)
    for position in (0.0123, 0.123, 0.345, 0.567, 0.789, 0.9876):
        assert float(curve(np.array(position))) == pytest.approx(length(position, *ratios), abs=3e-5)
    assert curve.mean == pytest.approx(1, abs=2e-15)


@pytest.mark.parametrize("ratios", RATIOS)
def test_closed_form_of_the_fourier_coefficients_agrees_with_quadrature(ratios):
    curve, (nodes, weights) = relative_length(*ratios), np.polynomial.legendre.leggauss(64)
    half = curve.widths[:, None] / 2
    t = curve.knots[:-1, None] + half * (nodes + 1)
    values, amplitudes, phases = curve(t), *fourier_coefficients(*ratios, 12)
    assert np.all(amplitudes >= 0) and np.all((phases > -np.pi) & (phases <= np.pi))
    for j in range(1, 13):
        integral = 2 * (values * np.exp(-2j * np.pi * j * t) * weights * half).sum()
        assert amplitudes[j - 1] * np.exp(-1j * phases[j - 1]) == pytest.approx(integral, abs=1e-13)


@pytest.mark.parametrize("ratios", [(2.0, 0.4), (1.3, 1.0), (1.0, 0.0), (3.0, 0.0), (1.7, 2.0)])
def test_length_is_constant_if_a_ratio_is_a_whole_number(ratios):
    curve = relative_length(*ratios)
    assert np.allclose([curve.first, curve.last], 1, atol=1e-15)
    assert np.all(fourier_coefficients(*ratios, 20)[0] < 1e-15)


def test_a_pair_enters_contact_at_the_beginning_of_the_period():
    spur = relative_length(1.4, 0.0)
    assert spur.knots == pytest.approx([0, 0.4, 1]) and spur.first * 1.4 == pytest.approx([2, 1])
    helical = relative_length(1.4, 0.2)
    assert float(helical(np.array(0.1))) > float(helical(np.array(0.0)))


@pytest.mark.parametrize(("ratios", "field"), [
    ((0.9, 0.0), "contact_ratio"), ((0.5, 0.4), "contact_ratio"), ((0.0, 2.0), "contact_ratio"),
    ((np.nan, 1.0), "contact_ratio"), ((1.5, -0.1), "overlap_ratio"), ((1.5, np.inf), "overlap_ratio")])
def test_lost_contact_is_refused(ratios, field):
    for function in (lambda: relative_length(*ratios), lambda: fourier_coefficients(*ratios, 3)):
        with pytest.raises(InputError) as raised:
            function()
        assert raised.value.field == field
