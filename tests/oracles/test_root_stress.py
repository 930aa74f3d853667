"""Nominal root stress against a tooth that is cut numerically, values of own and public codes, and limits."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

import gearchaos as gc
from gearchaos.datasheet.quantities import datasheet
from gearchaos.errors import InputError
from gearchaos.gears.geometry.dimensions import mating_geometry
from gearchaos.gears.geometry.root_stress import root_factors, root_section, root_stress


def pair(teeth, shifts=(0.0, 0.0), degrees=20.0, helix=0.0, rack=(1.0, 1.25, 0.38), module=3e-3, distance=None):
    addendum, dedendum, radius = rack
    return mating_geometry({
        "teeth": teeth, "normal_module": module, "pressure_angle": math.radians(degrees), "addendum": addendum,
        "helix_angle": math.radians(helix), "face_width": (0.02, 0.024), "dedendum": dedendum, "root_radius": radius,
    }, distance, shifts, (0.0, 0.0))


class CutTooth:
    """A tooth of a spur wheel with z teeth of module 1, cut by the rounding of a rack that rolls on it.

    Coordinates have the axis of the tooth as y; its left fillet is the envelope of circles along the path of the centre
    of the rounding, found by differences.
    """

    def __init__(self, z, alpha, shift, dedendum, rounding):
        self.z, self.alpha, self.shift, self.rounding = z, alpha, shift, rounding
        flank = math.pi / 4 - dedendum * math.tan(alpha)  # half the width of the rack's tooth at its tip, if sharp
        self.across = flank - rounding * math.tan(math.pi / 4 - alpha / 2)
        self.depth = dedendum - rounding - shift

    def centre(self, turn):
        """The centre of the rounding when the wheel has turned by an angle, seen from the wheel."""
        x, y, by = self.z / 2 * turn + self.across, self.z / 2 - self.depth, turn + math.pi / self.z
        return np.array([x * math.cos(by) - y * math.sin(by), x * math.sin(by) + y * math.cos(by)])

    def along(self, turn, step=1e-5):
        """The direction of the path of the centre, and so of the fillet."""
        return self.centre(turn + step) - self.centre(turn - step)

    def fillet(self, turn):
        along = self.along(turn)
        normal = np.array([-along[1], along[0]]) / np.hypot(*along)
        inwards = normal if normal @ self.centre(turn) < 0 else -normal
        return self.centre(turn) + self.rounding * inwards

    def slope(self, turn):
        """The angle of the fillet with the axis of the tooth."""
        return math.atan2(*np.abs(self.along(turn)))

    def section(self, step=1e-3):
        """Chord and height of the 30° section, and the radius of curvature of the fillet there."""
        deepest = -self.across / (self.z / 2)
        last = next(turn for turn in deepest + np.linspace(0.01, 1.5, 3000) / math.sqrt(self.z)
                    if self.slope(turn) < math.radians(25))
        turn = brentq(lambda turn: self.slope(turn) - math.pi / 6, deepest, last, xtol=1e-14)
        a, b, c = (self.fillet(turn + k * step) for k in (-1, 0, 1))
        area = abs((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))
        radius = np.hypot(*(a - b)) * np.hypot(*(b - c)) * np.hypot(*(c - a)) / (2 * area)
        return -2 * b[0], b[1], radius

    def load(self, along):
        """Where a force at a length along the tangent of the base circle meets the axis, and its angle."""
        base = self.z / 2 * math.cos(self.alpha)
        thickness = (math.pi / 2 + 2 * self.shift * math.tan(self.alpha)) / self.z + math.tan(self.alpha) - self.alpha
        angle = along / base - thickness  # the tangent turns by the length that unrolls
        return base / math.cos(angle), angle


def normal_section(geometry, wheel):
    """The virtual spur wheel of a wheel, cut, and where the outer point of single pair contact is."""
    base_helix = math.asin(math.sin(geometry.helix_angle) * math.cos(geometry.pressure_angle))
    z = geometry.teeth[wheel] / (math.cos(base_helix) ** 2 * math.cos(geometry.helix_angle))
    tooth = CutTooth(z, geometry.pressure_angle, geometry.profile_shift[wheel], geometry.dedendum, geometry.root_radius)
    over = (geometry.tip_diameter[wheel] - geometry.reference_diameter[wheel]) / geometry.normal_module
    base, pitch = z / 2 * math.cos(geometry.pressure_angle), math.pi * math.cos(geometry.pressure_angle)
    ratio = geometry.contact_ratio / math.cos(base_helix) ** 2
    return tooth, math.sqrt((z / 2 + over / 2) ** 2 - base**2) - (ratio - 1) * pitch


@pytest.mark.parametrize("geometry", [
    pair((27, 35)), pair((50, 50)), pair((17, 103), (0.3, -0.1)),
    pair((30, 45), (0.0, 0.2), 25.0, rack=(0.9, 1.1, 0.25)), pair((22, 61), (0.2, 0.0), 17.5, rack=(1.0, 1.3, 0.3)),
    pair((25, 40), helix=15.8), pair((31, 33), (0.1, 0.1), helix=28), pair((50, 50), rack=(1.3, 1.5, 0.25)),
    pair((40, 40), distance=0.1205)],
    ids=["27/35", "50/50", "shifted", "25°", "17.5°", "helical", "steep", "high contact ratio", "apart"])
@pytest.mark.parametrize("wheel", [0, 1])
def test_the_critical_section_is_that_of_a_tooth_that_is_cut(geometry, wheel):
    tooth, along = normal_section(geometry, wheel)
    chord, height, radius = tooth.section()
    apex, angle = tooth.load(along)
    found = root_section(geometry, wheel)
    assert found.chord == pytest.approx(chord, abs=1e-8) and found.lever == pytest.approx(apex - height, abs=1e-8)
    assert found.load_angle == pytest.approx(angle, abs=1e-12)
    assert found.fillet_radius == pytest.approx(radius, rel=2e-4)
    factors, ratio = root_factors(geometry), chord / (apex - height)
    form = 6 * (apex - height) * math.cos(angle) / (chord**2 * math.cos(geometry.pressure_angle))
    assert factors.root_form_factor[wheel] == pytest.approx(form, rel=1e-6)
    assert factors.root_stress_correction[wheel] == pytest.approx(
        (1.2 + 0.13 * ratio) * (chord / 2 / radius) ** (1 / (1.21 + 2.3 / ratio)), rel=2e-4)


@pytest.mark.parametrize("wheel", [0, 1])
def test_the_outer_point_of_single_contact_is_a_base_pitch_from_where_the_next_pair_enters(wheel):
    geometry = pair((27, 35), (0.1, 0.05))
    _, along = normal_section(geometry, wheel)
    enters = geometry.tangent_length - geometry.tip_tangents[1 - wheel]
    assert along * geometry.normal_module == pytest.approx(enters + geometry.base_pitch, rel=1e-12)


def test_values_of_own_and_public_computations():
    for teeth, form, correction in (((27, 35), 1.4393, 1.9051), ((50, 50), 1.1916, 2.1132)):
        found = root_factors(pair(teeth))
        assert found.root_form_factor[0] == pytest.approx(form, abs=5e-5)
        assert found.root_stress_correction[0] == pytest.approx(correction, abs=5e-5)
    geometry = pair((19, 104), (0.5, 0.15), rack=(1.0, 1.25, 0.25), module=4e-3)  # by DIN 3990-11, package din3990
    for wheel, chord, radius in ((0, 8.748743355951145, 1.3161477577049423), (1, 9.239504610725831, 1.325999192893118)):
        found = root_section(geometry, wheel)  # that package stops after five iterations
        assert (4 * found.chord, 4 * found.fillet_radius) == pytest.approx((chord, radius), rel=1e-4)


def test_a_rack_has_the_section_of_its_own_fillet():
    found, alpha = root_section(pair((30, 200_000)), 1), math.radians(20)
    across = math.pi / 4 - 1.25 * math.tan(alpha) - 0.38 * math.tan(math.pi / 4 - alpha / 2)
    assert found.chord == pytest.approx(math.pi - 2 * across - math.sqrt(3) * 0.38, abs=1e-4)
    assert found.fillet_radius == pytest.approx(0.38, abs=1e-4) and found.load_angle == pytest.approx(alpha, abs=1e-4)


def test_the_stress_is_that_of_the_tangential_force_over_the_common_face_width():
    geometry = pair((27, 35))
    found = root_factors(geometry)
    for torque in (300.0, -300.0):
        expected = 600 / 0.081 / (0.020 * 0.003) * np.multiply(found.root_form_factor, found.root_stress_correction)
        np.testing.assert_allclose(root_stress(geometry, torque), expected, rtol=1e-12)
    assert found.root_helix_factor == 1 and root_stress(geometry, 0.0) == (0.0, 0.0)


@pytest.mark.parametrize(("width", "helix", "counted"), [(0.02, 15.0, 15.0), (0.2, 15.0, 15.0), (0.2, 35.0, 30.0)])
def test_helical_teeth_have_a_helix_factor_with_limits(width, helix, counted):
    geometry = replace(pair((25, 40), helix=helix), face_width=(width, width))
    overlap = min(width * math.sin(math.radians(helix)) / (math.pi * 0.003), 1.0)
    factors = root_factors(geometry)
    assert factors.root_helix_factor == pytest.approx(1 - overlap * counted / 120, rel=1e-12)
    nominal = 2 * 100 / geometry.reference_diameter[0] / (width * 0.003)
    assert root_stress(geometry, 100.0)[0] == pytest.approx(nominal * factors.root_helix_factor * (
        factors.root_form_factor[0] * factors.root_stress_correction[0]), rel=1e-12)


@pytest.mark.parametrize(("geometry", "field", "words"), [
    (pair((28, 60), (1.0, 0.0), rack=(1.0, 1.25, 0.05)), "rack.root_radius",
     r"q_s from 1 to 8 .*got 0\.05\. .* of wheel 1 is 19.*\. Give a larger root_radius or less profile_shift"),
    (pair((80, 30), (1.0, 0.0), 32.0, rack=(0.8, 1.0, 0.2)), "pressure_angle",
     "30° tangent .*got .32 deg.* smaller angle"),
    (pair((6, 60), (-0.5, 0.0), rack=(0.5, 1.25, 0.1)), "rack.root_radius",
     r"q_s from 1 to 8 .*\. Without undercut profile_shift\[0\] is at least 0\.[0-9]*\. Give a smaller root_radius")])
def test_a_tooth_beyond_the_standard_is_refused(geometry, field, words):
    with pytest.raises(InputError, match=words) as refusal:
        root_stress(geometry, 100.0)
    assert refusal.value.field == field


DESIGN = gc.GearDesign(teeth=(27, 35), module="3 mm", face_width="20 mm", torque=300)


def test_the_datasheet_has_the_stress_or_says_why_not():
    found, geometry = datasheet(DESIGN), DESIGN.geometry
    stress, factors = found["root_stress"], root_factors(geometry)
    assert (stress.unit, stress.symbol, stress.group) == ("N/mm²", "σ_F0", "Tooth root")
    assert stress.value == pytest.approx([1e-6 * v for v in root_stress(geometry, 300.0)], rel=1e-14)
    assert stress.source == "ISO 6336-3:2006, 5.2, method B"
    assert "no factors of load, life, size or surface" in stress.formula
    assert found["root_form_factor"].value == factors.root_form_factor
    without = datasheet(replace(DESIGN, torque=None))
    assert without["root_stress"].reason.startswith("torque must be given")
    assert without["root_stress_correction"].value == factors.root_stress_correction
    sharp = datasheet(replace(DESIGN, profile_shift=(1.0, 0.0), rack={"dedendum": 1.25, "root_radius": 0.02}))
    for name in ("root_stress", "root_form_factor"):
        assert sharp[name].value is None and "notch parameter q_s from 1 to 8" in sharp[name].reason
