"""Potential-energy method: limits with closed forms, symmetries, and the phase of the curve."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gearchaos.errors import InputError
from gearchaos.gears.geometry.mechanics import STEEL, Material
from gearchaos.gears.stiffness.potential_energy import (
    Load,
    Stations,
    ToothPairs,
    beam_compliance,
    foundation_compliance,
    hertz_stiffness,
    tooth_profile,
)
from tests.gear_examples import ISO_TR_EXAMPLE_1, spur

BORE = (0.035, 0.035)
PAIRS = {
    "62/62": spur(), "17/45 shifted": spur(teeth=(17, 45), profile_shift=(0.4, 0.1), centre_distance=2e-3 * 31.45),
    "undercut 13/60": spur(teeth=(13, 60)), "sharp rack": spur(teeth=(30, 50), root_radius=0.0)}


def straight_beam(length, half_thickness, nodes=8):
    """Stations of a prismatic beam."""
    x, w = np.polynomial.legendre.leggauss(nodes)
    return Stations(length * (x + 1) / 2, np.full(nodes, half_thickness), length * w / 2)


@pytest.mark.parametrize("length", [1e-3, 1e-2, 0.1])
def test_a_straight_tooth_is_the_cantilever_of_timoshenko(length):
    """F L³/(3 E I) by bending and 1.2 F L/(G A) by shear; slender, bending alone remains."""
    half, width = 1e-3, 0.02
    load = Load(np.array(length), np.array(0.0), np.array(0.0))
    bending, shear, axial, _ = beam_compliance(straight_beam(length, half), load, STEEL, width)
    inertia, area = width * (2 * half) ** 3 / 12, width * 2 * half
    assert bending == pytest.approx(length**3 / (3 * STEEL.E * inertia), rel=1e-13)
    assert shear == pytest.approx(1.2 * length / (STEEL.E / (2 * 1.3) * area), rel=1e-13) and axial == 0
    assert shear / bending == pytest.approx(0.6 * 1.3 * (2 * half / length) ** 2, rel=1e-12)


def test_a_straight_tooth_loaded_along_its_axis_is_a_bar_that_an_eccentric_load_bends_by_its_moment():
    for off in (0.0, 7e-4):
        load = Load(np.array(0.01), np.array(off), np.array(math.pi / 2))
        found = beam_compliance(straight_beam(0.01, 1e-3), load, STEEL, 0.02)
        bar = 0.01 / (STEEL.E * 0.02 * 2e-3)
        assert found.bending == pytest.approx(off**2 * 0.01 / (STEEL.E * 0.02 * 8e-9 / 12), rel=1e-12, abs=1e-9 * bar)
        assert found.total - found.bending == pytest.approx(bar, rel=1e-12)


def test_hertz_stiffness_of_equal_and_of_different_materials():
    assert hertz_stiffness((STEEL, STEEL), 0.02) == pytest.approx(math.pi * STEEL.E * 0.02 / 3.64, rel=1e-15)
    stiff = replace(STEEL, E=1e12)
    assert hertz_stiffness((STEEL, stiff), 0.02) == pytest.approx(2 * 3.5558686e9 / (1 + 0.206), rel=1e-8)


def test_foundation_of_a_load_at_the_root_depends_on_its_direction_alone():
    """E b/k_f = P* (cos² β + Q* sin² β) for u = 0."""
    angles = (0.0, 0.3, 0.6)
    values = [float(foundation_compliance(0.05, 0.05, 0.03, np.array(0.0), np.array(angle))) for angle in angles]
    ratios = [(values[i] / values[0] - math.cos(angles[i]) ** 2) / math.sin(angles[i]) ** 2 for i in (1, 2)]
    assert ratios[0] == pytest.approx(ratios[1], rel=1e-12)
    assert 0.141 < ratios[0] < 0.62  # range of Q*, Sainsot et al. (2004), Table 1
    assert 2.56 < values[0] < 13.47  # range of P*


@pytest.mark.parametrize("wheel", [0, 1])
@pytest.mark.parametrize("name", PAIRS)
def test_the_outline_of_a_tooth_is_its_fillet_from_the_root_circle_and_the_involute(name, wheel):
    geometry = PAIRS[name]
    profile = tooth_profile(geometry, wheel)
    root = np.array(profile.rack.fillet(np.array(math.pi / 2)))
    assert np.hypot(*root) == pytest.approx(profile.root_radius, rel=1e-14)
    assert np.arctan2(*root) == pytest.approx(profile.root_half_angle, rel=1e-13)
    end = profile.rack.fillet(np.array(profile.rack.flank_normal(profile)))
    assert end == pytest.approx(profile.flank(profile.slope(np.array(profile.form_angle))), rel=1e-9)
    angles = np.linspace(profile.form_angle, 0.5, 7)
    x, y = profile.flank(profile.slope(angles))
    assert np.hypot(x, y) == pytest.approx(profile.base_radius / np.cos(angles), rel=1e-14)
    alpha = geometry.pressure_angle
    half = (math.pi / 2 + 2 * geometry.profile_shift[wheel] * math.tan(alpha)) / geometry.teeth[wheel]
    involute = (math.tan(alpha) - alpha) - (np.tan(angles) - angles)
    assert np.arctan2(x, y) == pytest.approx(half + involute, abs=1e-14)
    angle = np.array([0.35, 0.45])  # the heights of the stations add up to that of the tooth
    total = profile.fillet_stations().weight.sum() + profile.flank_stations(angle).weight.sum(-1)
    start = profile.root_radius * math.cos(profile.root_half_angle)
    assert total == pytest.approx(profile.flank(profile.slope(angle))[1] - start, rel=1e-9)


def test_double_face_width_or_modulus_is_double_stiffness():
    stiff = replace(STEEL, E=2 * STEEL.E)
    one, wide, stiffer = (ToothPairs(spur(**width), (material, material), BORE).curve().first for width, material in (
        ({}, STEEL), ({"face_width": (0.04, 0.04)}, STEEL), ({}, stiff)))
    assert wide == pytest.approx(2 * one, rel=1e-13) and stiffer == pytest.approx(2 * one, rel=1e-13)


def test_exchanging_the_wheels_reverses_the_curve():
    """The pair that enters at the tip of wheel 2 leaves at the tip of wheel 1."""
    soft = Material(E=100e9, poisson=0.34, density=7000.0)
    pair = spur(teeth=(23, 45), profile_shift=(0.3, -0.1), centre_distance=2e-3 * 34.2)
    swapped = replace(pair, teeth=(45, 23), profile_shift=(-0.1, 0.3))
    one = ToothPairs(pair, (STEEL, soft), (0.012, 0.03)).curve(2000)
    other = ToothPairs(swapped, (soft, STEEL), (0.03, 0.012)).curve(2000)
    t = np.linspace(0.005, 0.995, 200)
    mirrored = one(np.mod(pair.contact_ratio - t, 1))
    near_jump = np.minimum(np.abs(t - pair.contact_ratio % 1), np.minimum(t, 1 - t)) < 2e-3
    assert other(t)[~near_jump] == pytest.approx(mirrored[~near_jump], rel=1e-5)


def test_at_the_beginning_of_the_period_a_pair_enters_at_the_root_of_wheel_1():
    pair = spur()
    pairs = ToothPairs(pair, (STEEL, STEEL), BORE)
    angles = pairs.pressure_angles(np.array([0.0, pair.contact_ratio]))
    (root1, tip1), (tip2, root2) = (diameter / np.cos(angle) for diameter, angle in zip(
        pair.base_diameter, angles, strict=True))
    assert (root1, root2) == pytest.approx(pair.start_of_active_profile, rel=1e-12)
    assert (tip1, tip2) == pytest.approx(pair.tip_diameter, rel=1e-12)
    curve = pairs.curve()
    assert curve.jumps.tolist() == [0, int(np.searchsorted(curve.knots, pair.contact_ratio - 1))]
    assert curve.first[0] > 1.5 * curve.last[-1]


def test_stiffness_with_several_pairs_is_the_sum_over_the_pairs():
    pair = spur(teeth=(60, 60), addendum=1.35, dedendum=1.6, root_radius=0.25)
    assert 2 < pair.contact_ratio < 3
    pairs = ToothPairs(pair, (STEEL, STEEL), BORE)
    t = 0.5 * (pair.contact_ratio - 2)
    expected = sum(float(pairs.stiffness(*pairs.pressure_angles(np.array(t + i)))) for i in range(3))
    assert float(pairs.curve(4000)(np.array(t))) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize(("geometry", "bore", "field"), [
    (ISO_TR_EXAMPLE_1, (0.03, 0.2), "helix_angle"),
    (spur(), (0.035, 0.09), "bore[1]"),
    (spur(teeth=(350, 350)), (0.3, 0.3), "teeth[0]"),
    (spur(centre_distance=0.1262), BORE, "contact_ratio"),
    (spur(teeth=(12, 90)), (0.005, 0.05), "start_of_active_profile[0]"),
    (spur(teeth=(60, 10), profile_shift=(0.0, 0.95), centre_distance=0.0719), (0.03, 0.007), "tip_thickness[1]"),
    (spur(dedendum=1.6), BORE, "root_radius"),
    (spur(teeth=(14, 20)), (0.006, 0.01), "start_of_active_profile[0]")])
def test_pairs_beyond_the_method_are_refused(geometry, bore, field):
    with pytest.raises(InputError) as raised:
        ToothPairs(geometry, (STEEL, STEEL), bore)
    assert raised.value.field == field
