"""Potential-energy method: limits with closed forms, symmetries, and the phase of the curve."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gearchaos.errors import InputError
from gearchaos.gears.mechanics import STEEL, Material
from gearchaos.gears.stiffness.potential_energy import (
    Load,
    Stations,
    ToothPairs,
    beam_compliance,
    foundation_compliance,
    from_energy,
    hertz_stiffness,
    tooth_compliance,
    tooth_profile,
)
from tests.gear_examples import ISO_TR_EXAMPLE_1, spur

BORE = (0.035, 0.035)
PAIRS = {
    "62/62": spur(), "17/45 shifted": spur(teeth=(17, 45), profile_shift=(0.4, 0.1), centre_distance=2e-3 * 31.45),
    "undercut 13/60": spur(teeth=(13, 60)), "sharp rack": spur(teeth=(30, 50), root_radius=0.0),
}


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
    assert shear == pytest.approx(1.2 * length / (STEEL.E / (2 * 1.3) * area), rel=1e-13)
    assert axial == 0
    assert shear / bending == pytest.approx(0.6 * 1.3 * (2 * half / length) ** 2, rel=1e-12)


def test_a_straight_tooth_loaded_along_its_axis_is_a_bar():
    load = Load(np.array(0.01), np.array(0.0), np.array(math.pi / 2))
    compliance = beam_compliance(straight_beam(0.01, 1e-3), load, STEEL, 0.02)
    assert compliance.total == pytest.approx(0.01 / (STEEL.E * 0.02 * 2e-3), rel=1e-12)


def test_an_eccentric_axial_load_bends_the_tooth_by_its_moment():
    load = Load(np.array(0.01), np.array(7e-4), np.array(math.pi / 2))
    bending = beam_compliance(straight_beam(0.01, 1e-3), load, STEEL, 0.02).bending
    assert bending == pytest.approx(7e-4**2 * 0.01 / (STEEL.E * 0.02 * 8e-9 / 12), rel=1e-12)


def test_hertz_stiffness_of_equal_and_of_different_materials():
    assert hertz_stiffness((STEEL, STEEL), 0.02) == pytest.approx(
        math.pi * STEEL.E * 0.02 / (4 * (1 - 0.3**2)), rel=1e-15)
    assert hertz_stiffness((STEEL, STEEL), 0.02) == pytest.approx(3.5558686e9, rel=1e-8)
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


@pytest.mark.parametrize("name", PAIRS)
def test_the_flank_has_the_thickness_of_the_involute(name):
    geometry = PAIRS[name]
    for wheel in (0, 1):
        profile = tooth_profile(geometry, wheel)
        angles = np.linspace(profile.form_angle, 0.5, 7)
        x, y = profile.flank(profile.slope(angles))
        assert np.hypot(x, y) == pytest.approx(profile.base_radius / np.cos(angles), rel=1e-14)
        alpha = geometry.pressure_angle
        half = (math.pi / 2 + 2 * geometry.profile_shift[wheel] * math.tan(alpha)) / geometry.teeth[wheel]
        involute = (math.tan(alpha) - alpha) - (np.tan(angles) - angles)
        assert np.arctan2(x, y) == pytest.approx(half + involute, abs=1e-14)


@pytest.mark.parametrize("name", PAIRS)
def test_the_fillet_runs_from_the_root_circle_to_the_involute(name):
    for wheel in (0, 1):
        profile = tooth_profile(PAIRS[name], wheel)
        root = np.array(profile.rack.fillet(np.array(math.pi / 2)))
        assert np.hypot(*root) == pytest.approx(profile.root_radius, rel=1e-14)
        assert np.arctan2(*root) == pytest.approx(profile.root_half_angle, rel=1e-13)
        end = profile.rack.fillet(np.array(profile.rack.flank_normal(profile)))
        assert end == pytest.approx(profile.flank(profile.slope(np.array(profile.form_angle))), rel=1e-9)


@pytest.mark.parametrize("name", PAIRS)
def test_the_heights_of_the_stations_add_up_to_that_of_the_tooth(name):
    profile = tooth_profile(PAIRS[name], 0)
    angle = np.array([0.35, 0.45])
    total = profile.fillet_stations().weight.sum() + profile.flank_stations(angle).weight.sum(-1)
    start = profile.root_radius * math.cos(profile.root_half_angle)
    assert total == pytest.approx(profile.flank(profile.slope(angle))[1] - start, rel=1e-9)


def test_base_circles_smaller_and_larger_than_the_root_circle_are_covered():
    profiles = [tooth_profile(spur(teeth=(z, z)), 0) for z in (20, 41, 42, 80)]
    assert [p.base_radius > p.root_radius for p in profiles] == [True, True, False, False]
    compliances = [tooth_compliance(p, p.root_radius, STEEL, 0.02, np.array(0.36)).total for p in profiles]
    assert np.all(np.diff(compliances) != 0) and max(compliances) < 1.5 * min(compliances)


def test_double_face_width_is_double_stiffness():
    narrow = ToothPairs(spur(), (STEEL, STEEL), BORE).curve()
    wide = ToothPairs(spur(face_width=(0.04, 0.04)), (STEEL, STEEL), BORE).curve()
    assert wide.first == pytest.approx(2 * narrow.first, rel=1e-13)


def test_double_modulus_is_double_stiffness():
    stiff = replace(STEEL, E=2 * STEEL.E)
    curves = [ToothPairs(spur(), (material, material), BORE).curve() for material in (STEEL, stiff)]
    assert curves[1].first == pytest.approx(2 * curves[0].first, rel=1e-13)


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
    first, second = pairs.pressure_angles(np.array([0.0, pair.contact_ratio]))
    assert pair.base_diameter[0] / np.cos(first[0]) == pytest.approx(pair.start_of_active_profile[0], rel=1e-12)
    assert pair.base_diameter[1] / np.cos(second[0]) == pytest.approx(pair.tip_diameter[1], rel=1e-12)
    assert pair.base_diameter[0] / np.cos(first[1]) == pytest.approx(pair.tip_diameter[0], rel=1e-12)
    assert pair.base_diameter[1] / np.cos(second[1]) == pytest.approx(pair.start_of_active_profile[1], rel=1e-12)
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


def test_quadrature_has_converged(monkeypatch):
    reference = ToothPairs(PAIRS["17/45 shifted"], (STEEL, STEEL), (0.01, 0.03)).curve()
    monkeypatch.setattr("gearchaos.gears.stiffness.potential_energy._FILLET_NODES", 96)
    monkeypatch.setattr("gearchaos.gears.stiffness.potential_energy._FLANK_NODES", 48)
    finer = ToothPairs(PAIRS["17/45 shifted"], (STEEL, STEEL), (0.01, 0.03)).curve()
    assert reference.first == pytest.approx(finer.first, rel=1e-10)


def test_waveform_by_energy_has_the_mean_of_the_curve():
    stiffness = from_energy(spur(), (STEEL, STEEL), BORE)
    curve = ToothPairs(spur(), (STEEL, STEEL), BORE).curve()
    assert stiffness.reference == curve.mean
    assert stiffness.truncation <= 2e-3 and stiffness.method == "potential energy" and stiffness.notes == ()


@pytest.mark.parametrize(("geometry", "bore", "field"), [
    (ISO_TR_EXAMPLE_1, (0.03, 0.2), "helix_angle"),
    (spur(), (0.016, 0.035), "bore[0]"),
    (spur(), (0.035, 0.09), "bore[1]"),
    (spur(teeth=(350, 350)), (0.3, 0.3), "teeth[0]"),
    (spur(centre_distance=0.1262), BORE, "contact_ratio"),
    (spur(teeth=(12, 90)), (0.005, 0.05), "start_of_active_profile[0]"),
    (spur(teeth=(60, 10), profile_shift=(0.0, 0.95), centre_distance=0.0719), (0.03, 0.007), "tip_thickness[1]"),
    (spur(dedendum=1.6), BORE, "root_radius"),
    (spur(teeth=(14, 20)), (0.006, 0.01), "start_of_active_profile[0]"),
])
def test_pairs_beyond_the_method_are_refused(geometry, bore, field):
    with pytest.raises(InputError) as raised:
        ToothPairs(geometry, (STEEL, STEEL), bore)
    assert raised.value.field == field


def test_extrapolated_foundation_is_noted():
    pairs = ToothPairs(PAIRS["17/45 shifted"], (STEEL, STEEL), (0.01, 0.03))
    assert len(pairs.notes) == 1 and pairs.notes[0].startswith("wheel 1")
