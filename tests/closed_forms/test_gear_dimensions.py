"""Dimensions, backlash and masses of gear pairs: published pairs, values by hand, and identities."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gearchaos.datasheet.quantities import datasheet
from gearchaos.errors import InputError
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.geometry.backlash import OF, Backlash, ThicknessAllowances, base_tangent_length
from gearchaos.gears.geometry.dimensions import Geometry, shift_sum
from gearchaos.gears.geometry.tooth_root import inverse_involute, involute
from gearchaos.gears.mesh.pair import GearPair

EXAMPLE_1 = GearDesign(
    teeth=(17, 103), module="8 mm", helix_angle="15.8 deg", face_width="100 mm", centre_distance="500 mm",
    profile_shift=(0.145, 0.0), rack={"dedendum": 1.4, "root_radius": 0.39}, tip_diameter=("159.66 mm", "872.35 mm"),
    speed="360 rpm", torque="9000 N*m", bore="0 mm")
"""ISO/TR 6336-30:2017, example 1, with the tip diameters of its drawing, which are rounded to 0.01 mm."""


def test_example_1_of_iso_tr_6336_30_to_the_digits_printed():
    geometry = EXAMPLE_1.geometry
    assert round(math.degrees(geometry.working_pressure_angle), 4) == 21.0661
    assert geometry.tip_diameter == pytest.approx((0.15966, 0.87235), rel=1e-15)
    assert round(geometry.contact_ratio, 4) == 1.5491 and round(geometry.overlap_ratio, 5) == 1.08337
    assert [round(z, 3) for z in geometry.virtual_teeth] == [18.905, 114.543]
    assert round(EXAMPLE_1.load.tangential_force) == 127352 and round(EXAMPLE_1.load.velocity, 3) == 2.664
    nominal = replace(EXAMPLE_1, tip_diameter=None).geometry  # with tip diameters that are not rounded
    assert nominal.tip_diameter == pytest.approx((0.15966011, 0.8723548), abs=1e-8)
    assert round(nominal.contact_ratio, 4) == 1.5493


def test_a_spur_gear_pair_by_hand():
    geometry = GearDesign(teeth=(20, 40), module=3e-3, face_width=(0.03, 0.025)).geometry
    assert geometry == Geometry(
        teeth=(20, 40), normal_module=3e-3, pressure_angle=math.radians(20), helix_angle=0.0, profile_shift=(0.0, 0.0),
        centre_distance=geometry.centre_distance, face_width=(0.03, 0.025))
    assert geometry.centre_distance == pytest.approx(0.09, rel=1e-15)
    assert geometry.root_diameter == pytest.approx((0.0525, 0.1125))
    assert geometry.tip_clearance == pytest.approx((0.75e-3, 0.75e-3))
    assert geometry.virtual_teeth == pytest.approx((20, 40)) and geometry.gear_ratio == 2
    assert geometry.common_face_width == 0.025 and geometry.overlap_ratio == 0.0
    assert geometry.total_contact_ratio == geometry.contact_ratio
    assert geometry.undercut_shift[0] == pytest.approx(1.25 - 0.38 * (1 - math.sin(math.pi / 9)) - 10 * math.sin(
        math.pi / 9) ** 2)


def test_the_inverse_of_the_involute_to_rounding():
    for angle in np.concatenate([np.geomspace(1e-3, 0.1, 40), np.linspace(0.1, 1.5, 200)]):
        # tan α is rounded to some 1e-16 of itself, and the derivative of the involute is tan² α
        assert abs(inverse_involute(involute(angle)) - angle) <= 3e-16 * (angle + 2 / math.tan(angle))
    assert inverse_involute(0.0) == 0.0 and involute(inverse_involute(1e6)) == pytest.approx(1e6, rel=1e-9)


def test_keeping_the_clearance_shortens_the_teeth_until_it_is_that_of_the_rack():
    shifted = GearDesign(teeth=(20, 40), module=3e-3, face_width=0.03, profile_shift=(0.5, 0.4))
    kept = replace(shifted, tip_alteration="keep clearance")
    assert min(shifted.geometry.tip_clearance) < 0.7e-3
    assert kept.geometry.tip_clearance == pytest.approx((0.75e-3, 0.75e-3), rel=1e-12)
    assert kept.geometry.tip_alteration[0] == kept.geometry.tip_alteration[1] < 0
    # a centre distance that leaves more clearance than the rack does not lengthen the teeth
    loose = replace(kept, centre_distance="90.2 mm", profile_shift=(0, 0))
    assert loose.geometry.tip_alteration == (0.0, 0.0)


def test_the_sum_of_shifts_that_a_refusal_asks_for_leaves_no_backlash():
    given = GearDesign(teeth=(20, 40), module=3e-3, face_width=0.03, centre_distance="91 mm", profile_shift=(0.2, 0.1))
    needed = shift_sum(given.geometry)
    assert 0.3 < needed < 0.4
    fitting = replace(given, profile_shift=(0.2, needed - 0.2))
    assert fitting.geometry.theoretical_backlash == pytest.approx(0, abs=1e-16)
    assert replace(fitting, centre_distance=None).geometry.centre_distance == pytest.approx(0.091, rel=1e-14)


def test_shifts_left_out_beside_the_reference_centre_distance_are_zero():
    rounded = GearDesign(teeth=(17, 103), module="8 mm", helix_angle="15.8 deg", face_width="0.1 m",
                         centre_distance="498.85 mm")
    assert rounded.geometry.profile_shift == (0.0, 0.0) and rounded.geometry.centre_distance == 0.49885


HELICAL = GearDesign(teeth=(23, 51), module="4 mm", helix_angle="20 deg", face_width="40 mm", centre_distance="160 mm",
                     profile_shift=(0.3, 0.28))


def measured(kind):
    """A backlash of 10 µm of one kind, turned into j_bt by moving the wheels."""
    geometry, value = HELICAL.geometry, 1e-5
    if kind == "line of action":
        return value
    if kind == "radial":  # the wheels move apart
        apart, together = (replace(geometry, centre_distance=geometry.centre_distance + s * value / 2) for s in (1, -1))
        return apart.theoretical_backlash - together.theoretical_backlash
    if kind == "normal":  # the component of a displacement of the flank around the base cylinder
        lead = math.pi * geometry.reference_diameter[0] / math.tan(geometry.helix_angle)
        # a tooth, developed on the base cylinder, runs along (π d_b, lead)
        return value * math.hypot(math.pi * geometry.base_diameter[0], lead) / lead
    if kind.startswith("angle"):
        return value * geometry.base_diameter[int(kind[-1]) - 1] / 2  # the taut string leaves the turned base circle
    diameters = {"circumferential": geometry.working_diameter, "reference circle": geometry.reference_diameter}[kind]
    angle = 2 * value / diameters[0]  # wheel 2 is held, wheel 1 turns
    assert angle / (2 * value / diameters[1]) == pytest.approx(51 / 23)
    return angle * geometry.base_diameter[0] / 2


KINDS = ("line of action", "circumferential", "reference circle", "normal", "radial", "angle of wheel 1",
         "angle of wheel 2")


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_of_backlash_by_moving_the_wheels(kind):
    assert base_tangent_length(HELICAL.geometry, kind) == pytest.approx(measured(kind) / 1e-5, rel=1e-7)
    value = 5e-3 if kind.startswith("angle") else 5e-4  # more than the shifts leave at this centre distance
    assert replace(HELICAL, backlash={"value": value, "of": kind}).backlash_line_of_action == pytest.approx(
        measured(kind) / 1e-5 * value, rel=1e-7)


@pytest.mark.parametrize("kind", KINDS)
def test_a_direction_alone_means_the_total_and_half_a_backlash_is_half_of_it(kind):
    whole, half = ("20 arcmin", "10'") if kind.startswith("angle") else ("0.3 mm", "0.15 mm")
    assert Backlash(value=whole, of=kind) == Backlash(value=whole, of=f"{kind}, total")
    along = {replace(HELICAL, backlash={"value": value, "of": of}).backlash_line_of_action
             for value, of in ((whole, kind), (whole, f"{kind}, total"), (half, f"{kind}, half"))}
    assert len(along) == 1


@pytest.mark.parametrize("of", OF)
def test_a_backlash_of_more_than_half_a_module_along_the_line_of_action_is_refused(of):
    kind, part = of.split(", ")
    most = 2e-3 / base_tangent_length(HELICAL.geometry, kind) / (2 if part == "half" else 1)
    assert replace(HELICAL, backlash={"value": 0.999 * most, "of": of}).backlash_line_of_action < 2e-3
    limit = f"{most:.4g} rad" if kind.startswith("angle") else f"{1e3 * most:.4g} mm"
    with pytest.raises(InputError, match=rf"^backlash\.value must lie between 0 and {limit}") as refusal:
        replace(HELICAL, backlash={"value": 1.001 * most, "of": of})
    assert "Did you mean" in refusal.value.advice and refusal.value.value == 1.001 * most


@pytest.mark.parametrize("plane", ["normal", "transverse"])
@pytest.mark.parametrize(("at", "thickness", "distance"), [("minimum", 0, 1), ("maximum", 1, 0)])
def test_allowances_of_the_tooth_thickness_are_shifts_of_the_rack(plane, at, thickness, distance):
    """A tooth whose rack is shifted by Δx is thicker by 2 Δx m_n tan α_n in the normal section, ISO 21771:2007."""
    teeth, centre, geometry = ((-60e-6, -110e-6), (-90e-6, -150e-6)), (30e-6, -20e-6), HELICAL.geometry
    given = ThicknessAllowances(tooth_thickness_allowances=teeth, centre_distance_allowance=centre, plane=plane, at=at)
    to_normal = 1 if plane == "normal" else math.cos(geometry.helix_angle)
    per_module = 2 * geometry.normal_module * math.tan(geometry.pressure_angle) / to_normal
    shifts = tuple(x + t[thickness] / per_module for x, t in zip(geometry.profile_shift, teeth, strict=True))
    moved = replace(geometry, profile_shift=shifts, centre_distance=geometry.centre_distance + centre[distance])
    assert replace(HELICAL, backlash=given).backlash_line_of_action == pytest.approx(
        moved.theoretical_backlash, rel=1e-12)


def test_the_mean_backlash_is_the_mean_of_its_limits():
    given = ThicknessAllowances(tooth_thickness_allowances=(-60e-6, -110e-6), centre_distance_allowance="20 um")
    least, mean, greatest = (replace(given, at=at).along_line_of_action(HELICAL.geometry)
                             for at in ("minimum", "mean", "maximum"))
    assert given.at == "mean" and least < mean < greatest
    assert mean == pytest.approx((least + greatest) / 2, rel=1e-15)


def test_a_backlash_below_the_theoretical_one_by_no_more_than_rounded_shifts_is_taken():
    loose = replace(HELICAL, profile_shift=(0.3, 0.27))
    theoretical = loose.geometry.theoretical_backlash
    assert theoretical > 0
    small = Backlash(value=theoretical - 0.009 * 4e-3, of="line of action, total")
    assert replace(loose, backlash=small).backlash_line_of_action == small.value


def test_the_disc_of_a_wheel_by_hand():
    spur = GearDesign(teeth=(20, 40), module=3e-3, face_width=(0.03, 0.025), bore=("10 mm", "20 mm"),
                      material=["steel", {"E": "118 GPa", "poisson": 0.3, "density": 7200}])
    inner, outer, widths, densities = (0.01, 0.02), (0.05925, 0.11925), (0.03, 0.025), (7830, 7200)
    for wheel in (0, 1):
        rings = np.linspace(inner[wheel] / 2, outer[wheel] / 2, 20001)
        radius, step = (rings[1:] + rings[:-1]) / 2, rings[1] - rings[0]
        ring = 2 * math.pi * radius * step * widths[wheel] * densities[wheel]
        assert spur.masses[wheel] == pytest.approx(ring.sum(), rel=1e-7)
        assert spur.inertias[wheel] == pytest.approx((ring * radius**2).sum(), rel=1e-7)


@pytest.mark.parametrize(("material", "factor"), [
    ("steel", 189.8), ("nodular cast iron", 181.4), ("grey cast iron", 162.0), ("bronze", 155.0)])
def test_materials_have_the_elasticity_factor_of_the_standard_beside_steel(material, factor):
    """Z_E² = 1/(π ((1 − ν1²)/E1 + (1 − ν2²)/E2)), printed in ISO 6336-2:2006, Table 1, in √(N/mm²)."""
    pair = GearDesign(teeth=(20, 40), module=3e-3, face_width=0.03, material=["steel", material]).material
    assert 1e-3 / math.sqrt(math.pi * sum((1 - m.poisson**2) / m.E for m in pair)) == pytest.approx(factor, abs=0.06)


def test_a_name_in_another_case_is_hinted_at():
    with pytest.raises(InputError, match="Did you mean 'POM'"):
        GearDesign(teeth=(20, 40), module=3e-3, face_width=0.03, material="pom")


def test_a_plastic_has_its_strength_and_a_warning_of_what_its_values_mean():
    design = GearDesign(teeth=(20, 40), module=3e-3, face_width=0.03, material=["steel", "POM"])
    assert design.material[1].root_strength == 64 and design.material[0].root_strength is None
    assert any(text.startswith("Plastic of wheel 2: E is that of a short load") for text in design.warnings)
    assert not any("Plastic" in text for text in replace(design, material="aluminium").warnings)


def test_given_masses_and_inertias_replace_those_of_the_disc():
    disc = GearDesign(teeth=(20, 40), module=3e-3, face_width=0.03, bore="10 mm")
    heavier = replace(disc, mass=[2 * m for m in disc.masses])
    assert heavier.inertias == pytest.approx([2 * inertia for inertia in disc.inertias], rel=1e-14)
    assert replace(disc, bore=None, mass=(0.6, 2.5)).inertias[0] == pytest.approx(0.6 * 0.05925**2 / 8, rel=1e-14)
    turned = replace(disc, inertia=(1e-3, 2e-3))
    assert turned.inertias == (1e-3, 2e-3) and turned.masses == disc.masses


def test_the_equivalent_mass_is_that_of_the_pair_and_of_iso_6336():
    disc = GearDesign(teeth=(20, 40), module=3e-3, face_width=0.03, bore=("10 mm", "20 mm"))
    (inertia1, inertia2), (radius1, radius2) = disc.inertias, [d / 2 for d in disc.geometry.base_diameter]
    pair = GearPair(n1=20, n2=40, I1=inertia1, I2=inertia2, R1=radius1, R2=radius2, c0=4e8, k=500.0, backlash=1e-4,
                    M10=100.0, speed=3000.0)
    assert disc.equivalent_mass == pytest.approx(pair.mass, rel=1e-15)
    mean = [(a + f) / 2 for a, f in zip(disc.geometry.tip_diameter, disc.geometry.root_diameter, strict=True)]
    each = [math.pi / 8 * 7830.0 * (d * d / (2 * radius)) ** 2 * (1 - (bore / d) ** 4)  # ISO 6336-1:2006, (30)-(32)
            for d, radius, bore in zip(mean, (radius1, radius2), (0.01, 0.02), strict=True)]
    assert disc.equivalent_mass / 0.03 == pytest.approx(1 / (1 / each[0] + 1 / each[1]), rel=1e-13)


def test_eccentricity_changes_error_and_backlash_once_per_turn():
    turning = replace(EXAMPLE_1, eccentricity=(10e-6, 30e-6))
    found = datasheet(turning)
    assert found["eccentricity_error_amplitude"].value == pytest.approx((10.0, 30.0), rel=1e-14)
    # the opening of the centre distance by 30 µm opens the backlash along the line of action
    opened = replace(EXAMPLE_1.geometry, centre_distance=0.5 + 30e-6)
    change = 1e6 * (opened.theoretical_backlash - EXAMPLE_1.geometry.theoretical_backlash)
    backlash = found["eccentricity_backlash_amplitude"]
    assert backlash.value == pytest.approx((change / 3, change), rel=1e-3)
    assert "not part of the model" in backlash.formula
    (warning,) = (w for w in turning.warnings if "the backlash" in w)
    assert f"backlash by ±{backlash.value[1]:.4g} µm is left out." in warning
    one = datasheet(replace(EXAMPLE_1, eccentricity=(0.0, 1e-6)))
    assert one["eccentricity_error_amplitude"].value[0] == one["eccentricity_backlash_amplitude"].value[0] == 0.0
    for bad in (-1e-6, math.nan, math.inf):
        with pytest.raises(InputError, match=r"eccentricity\[1\]"):
            replace(EXAMPLE_1, eccentricity=(0.0, bad))


@pytest.mark.parametrize(("torque", "warns"), [(0.5, True), (0.05, False)])
def test_teeth_that_give_way_beyond_what_corner_contact_follows_make_a_warning(torque, warns):
    """F_b/c0 at 0.5 N m is 0.12 modules, of which 0.03 are followed."""
    design = GearDesign(teeth=(17, 34), module="1 mm", face_width="8 mm", material="PA66", bore="5 mm", torque=torque,
                        speed=100.0, damping_ratio=0.05, profile_shift=(0.2, 0.0))
    share = 2 * torque / design.geometry.base_diameter[0] / design.mesh_stiffness.reference / 1e-3
    assert (share > 0.03) == warns
    assert any(f"give way by {share:.2g} modules" in text for text in design.warnings) == warns
