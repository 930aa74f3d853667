"""Harmonics of the transmission error: definitions, parabola, tip relief by brute force."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gearchaos.errors import InputError
from gearchaos.gears.transmission_error import Quality, tolerances
from gearchaos.gears.transmission_error.harmonics import evaluate, from_quality
from gearchaos.gears.transmission_error.iso1328_1995 import ISO_1995
from gearchaos.gears.transmission_error.iso1328_2013 import ISO_2013
from gearchaos.gears.transmission_error.tip_relief import TipRelief, from_tip_relief, relief_error
from tests.gear_examples import ISO_TR_EXAMPLE_1, SPUR_62, spur

TAU = np.arange(4000) / 4000


def test_series_is_that_of_the_model():
    # (2.4): e(t) = Σ e_j cos(jω_z t − θ_j)
    assert evaluate((2.0, 0.5), (0.3, -1.0), 0.2) == pytest.approx(
        2 * math.cos(0.4 * math.pi - 0.3) + 0.5 * math.cos(0.8 * math.pi + 1.0), rel=1e-12)
    assert evaluate((), (), np.zeros((2, 3))).shape == (2, 3)


def quality_error(grade=5, orders: int = 3, pair=ISO_TR_EXAMPLE_1, standard: str = ISO_1995):
    """Harmonics of a pair from its grade."""
    quality = Quality(standard, grade)
    return from_quality(pair, quality, tolerances(quality, pair), orders)


def test_error_from_the_accuracy_grade_by_hand():
    found = quality_error()
    ratio = ISO_TR_EXAMPLE_1.total_contact_ratio
    factor = 0.2 * (ratio + 4) / ratio
    first, second = factor * (4.3 + 8 + 13), factor * (4.3 + 9.5 + 16)  # µm, with f_pt and F_α of both wheels
    assert np.array(found.tooth_to_tooth) * 1e6 == pytest.approx((first, second), rel=1e-9)
    total = math.hypot(first, second)
    assert found.peak_to_peak * 1e6 == pytest.approx(total, rel=1e-9)
    series = [4 * total / math.pi**2 / j**2 for j in (1, 2, 3)]
    assert np.array(found.amplitudes) * 1e6 == pytest.approx(series, rel=1e-9)
    assert found.assumptions and "assumption" in found.source


def test_a_typical_error_is_the_root_mean_square_of_normal_deviations_within_the_grade():
    """Each wheel has a deviation that is normal, the permissible one being three times its standard deviation."""
    bound, quality = quality_error(), Quality(ISO_1995, 5)
    permitted = tolerances(quality, ISO_TR_EXAMPLE_1)
    typical = from_quality(ISO_TR_EXAMPLE_1, quality, permitted, 3, "from quality (typical)")
    both = math.hypot(*bound.tooth_to_tooth) / 3
    assert typical.amplitudes == pytest.approx(4 / np.pi**2 * both / np.array([1, 4, 9]), rel=1e-9)
    assert typical.phases == bound.phases and typical.tooth_to_tooth == bound.tooth_to_tooth
    assert "typical of the grade" in typical.source and "third" in typical.assumptions[0]


def test_deviations_of_two_wheels_add_up_with_their_signs():
    def error(*deviations):
        quality = Quality(ISO_1995, 5, deviations)
        return from_quality(ISO_TR_EXAMPLE_1, quality, tolerances(quality, ISO_TR_EXAMPLE_1))

    each, bound = [error(1, 0), error(0, 1)], quality_error()
    assert [found.peak_to_peak for found in each] == pytest.approx(bound.tooth_to_tooth, rel=1e-12)
    np.testing.assert_allclose(each[0].at(TAU), bound.at(TAU) * bound.tooth_to_tooth[0] / bound.peak_to_peak)
    for first, second in ((0.4, 0.5), (0.9, -0.2), (-0.8, 0.1), (-1, -1), (0, 0)):
        found = error(first, second)
        np.testing.assert_allclose(
            found.at(TAU), first * each[0].at(TAU) + second * each[1].at(TAU), atol=1e-12 * bound.peak_to_peak)
        assert min(found.amplitudes) >= 0 and found.peak_to_peak >= 0
        assert f"{first:g} and {second:g} of the permissible" in found.source
        assert found.tooth_to_tooth == bound.tooth_to_tooth  # what is permissible


def test_error_of_a_grade_is_a_parabola_that_is_greatest_at_the_change_of_teeth():
    found = quality_error(orders=64)
    place = np.mod(TAU - ISO_TR_EXAMPLE_1.contact_ratio / 2 + 0.5, 1) - 0.5  # from the middle of the path of contact
    parabola = found.peak_to_peak * (4 * place**2 - 1 / 3)
    assert found.at(TAU) == pytest.approx(parabola, abs=0.007 * found.peak_to_peak)
    assert TAU[np.argmax(found.at(TAU))] == pytest.approx((ISO_TR_EXAMPLE_1.contact_ratio - 1) / 2, abs=1e-3)
    three = quality_error().at(TAU)
    assert np.ptp(three) == pytest.approx(0.9 * found.peak_to_peak, rel=2e-3)


def test_error_of_a_grade_doubles_every_second_grade_and_falls_with_overlap():
    coarse, fine = quality_error(9), quality_error(5)
    assert coarse.peak_to_peak == pytest.approx(4 * fine.peak_to_peak, rel=0.05)
    mixed = quality_error((5, 9))
    assert mixed.tooth_to_tooth == (fine.tooth_to_tooth[0], coarse.tooth_to_tooth[1])
    wide = replace(ISO_TR_EXAMPLE_1, face_width=(0.24, 0.24))
    for pair in (wide, replace(wide, face_width=(0.3, 0.3))):
        assert pair.total_contact_ratio > 4
        first = tolerances(Quality(ISO_1995, 5), pair)[0]
        assert quality_error(pair=pair).tooth_to_tooth[0] == pytest.approx(
            0.4 * (4.3e-6 + first.single_pitch + first.profile), rel=1e-12)
    assert quality_error(standard=ISO_2013).source.startswith("ISO 1328-1:2013, grade 5")


@pytest.mark.parametrize("orders", [0, 65, 2.0, True])
def test_number_of_harmonics(orders):
    with pytest.raises(InputError, match="orders must be"):
        quality_error(orders=orders)


def relief(pair, share: float, amount=(20e-6, 20e-6), shape: str = "linear") -> TipRelief:
    """Equal tip reliefs of a length that is a share of the double contact."""
    return TipRelief(amount, ((share * (pair.contact_ratio - 1) * pair.base_pitch),) * 2, shape)


def brute_force(pair, given: TipRelief, tau: float) -> float:
    """Least removed depth over 400 sections of the face width and all tooth pairs."""
    pitch, path = pair.base_pitch, pair.contact_ratio * pair.base_pitch
    power = {"linear": 1, "parabolic": 2}[given.shape]
    best = math.inf
    for section in np.linspace(0, pair.overlap_ratio, 400) if pair.overlap_ratio else [0.0]:
        for k in range(-4, 8):
            s = (tau + k - section) * pitch
            if 0 <= s <= path:
                depth = given.amount[1] * max(1 - s / given.length[1], 0) ** power if given.length[1] else 0.0
                if given.length[0]:
                    depth += given.amount[0] * max(1 - (path - s) / given.length[0], 0) ** power
                best = min(best, depth)
    return best


@pytest.mark.parametrize(("pair", "shape"), [
    (SPUR_62, "linear"), (replace(ISO_TR_EXAMPLE_1, face_width=(0.02, 0.02)), "parabolic"),
    (spur(teeth=(30, 62), addendum=1.35), "parabolic")])
def test_tip_relief_by_brute_force(pair, shape: str):
    given = TipRelief((30e-6, 12e-6), (0.4 * pair.path_of_contact, 0.55 * pair.path_of_contact), shape)
    for tau in np.linspace(0, 1, 23):
        assert relief_error(pair, given, np.array(tau)) == pytest.approx(brute_force(pair, given, tau), abs=3e-7)


def test_relief_that_leaves_a_base_pitch_makes_no_error():
    assert relief_error(SPUR_62, relief(SPUR_62, 0.5), TAU).max() < 1e-18 and ISO_TR_EXAMPLE_1.overlap_ratio > 1
    assert relief_error(ISO_TR_EXAMPLE_1, relief(ISO_TR_EXAMPLE_1, 1.0), TAU).max() == 0
    none = from_tip_relief(SPUR_62, TipRelief((0.0, 0.0), (0.0, 0.0)))
    assert len(none.amplitudes) == 8 and max(none.amplitudes) == none.residual_peak == 0


def test_long_relief_of_spur_gears_in_closed_form():
    """As long as the double contact: half of the amount is missing where the next pair takes over. A triangle of height
    h on a share w of the period has e_j = 2 h/(w (π j)²) (1 − cos(π j w)), greatest at its middle."""
    curve = relief_error(SPUR_62, relief(SPUR_62, 1.0), TAU)
    share, height = SPUR_62.contact_ratio - 1, 10e-6
    assert curve.max() == pytest.approx(height, rel=1e-3)
    assert TAU[np.argmax(curve)] == pytest.approx(share / 2, abs=3e-4)
    assert curve[math.ceil(share * len(TAU)) :].max() < 1e-12  # in single contact
    parabolic = relief_error(SPUR_62, relief(SPUR_62, 1.0, shape="parabolic"), TAU)
    assert parabolic.max() == pytest.approx(height / 2, rel=1e-3)
    found = from_tip_relief(SPUR_62, relief(SPUR_62, 1.0), 20)
    j = np.arange(1, 21)
    expected = 2 * height / share / (np.pi * j) ** 2 * (1 - np.cos(np.pi * j * share))
    assert found.amplitudes == pytest.approx(expected.tolist(), abs=1e-6 * height)
    assert found.phases[0] == pytest.approx(np.pi * share, abs=1e-4)
    assert found.residual_rms < found.residual_peak < 0.03 * height
    assert found.at(TAU) == pytest.approx(curve - curve.mean(), abs=0.03 * height)


@pytest.mark.parametrize(("amount", "lengths", "pair", "words"), [
    ((1e-6, 1e-6), (0.6, 0.5), SPUR_62, r"tip_relief\.length must have a sum of at most the path of contact"),
    ((0.0, -1e-6), (0.0, 0.0), SPUR_62, r"tip_relief\.amount\[1\]"),
    ((0.0, 0.0), (math.inf, 0.0), SPUR_62, r"tip_relief\.length\[0\]"),
    ((0.0, 0.0), (0.0, 0.0), spur(centre_distance=SPUR_62.centre_distance + 3e-3), "contact_ratio must be at least 1")])
def test_wrong_tip_relief_is_refused(amount, lengths, pair, words):
    with pytest.raises(InputError, match=words):
        from_tip_relief(pair, TipRelief(amount, tuple(length * SPUR_62.path_of_contact for length in lengths)))
    with pytest.raises(InputError, match="linear, parabolic"):
        TipRelief(amount, (0.0, 0.0), "circular")
