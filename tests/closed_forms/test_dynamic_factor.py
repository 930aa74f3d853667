"""Dynamic factors by ISO 6336-1, methods B and C, and AGMA: published values, limits, jumps and refusals."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from gearchaos.errors import InputError
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.dynamic_factor import Refused, SpeedRange, resonance, standards
from gearchaos.gears.dynamic_factor.agma import DynamicFactorAGMA, dynamic_factor_agma, quality_number
from gearchaos.gears.dynamic_factor.iso_method_b import (
    Deviations,
    DynamicFactorB,
    FlankMaterial,
    constants,
    deviations,
    dynamic_factor_b,
    of_design,
    relief_from_running_in,
    running_in_allowance,
)
from gearchaos.gears.dynamic_factor.iso_method_c import DynamicFactorC, dynamic_factor_c
from gearchaos.gears.mechanics import MeshLoad, disc_diameter, disc_inertia, disc_mass, equivalent_mass, mesh_load
from gearchaos.gears.stiffness.iso6336 import tooth_stiffness
from gearchaos.gears.transmission_error import Quality, tolerances
from gearchaos.gears.transmission_error.iso1328_1995 import ISO_1995
from tests.gear_examples import ISO_TR_EXAMPLE_1, SPUR_62, spur

RPM = math.pi / 30
DENSITY = 7830.0
HARDENED = FlankMaterial("surface hardened", 1500e6)


def example(flanks=None) -> DynamicFactorB:
    """ISO/TR 6336-30, example 1, by method B."""
    load = mesh_load(ISO_TR_EXAMPLE_1, 360 * RPM, 9000.0, 1.0)
    given = deviations(
        ISO_TR_EXAMPLE_1, tolerances(Quality(ISO_1995, 5), ISO_TR_EXAMPLE_1), 5, velocity=load.velocity,
        tip_relief=(70e-6, 70e-6), flanks=flanks)
    mass = reduced_mass(ISO_TR_EXAMPLE_1)
    stiffness = tooth_stiffness(ISO_TR_EXAMPLE_1, line_load=load.line_load)
    found = dynamic_factor_b(ISO_TR_EXAMPLE_1, load, 360 * RPM, stiffness, mass, given)
    assert isinstance(found, DynamicFactorB)
    return found


def test_published_example():
    load = mesh_load(ISO_TR_EXAMPLE_1, 360 * RPM, 9000.0, 1.0)
    assert load.tangential_force == pytest.approx(127352, abs=1)
    assert load.velocity == pytest.approx(2.664, abs=5e-4)
    for flanks in (None, (HARDENED, HARDENED)):
        assert example(flanks).value == pytest.approx(1.003, abs=5e-4)
    assert example().speed_range is SpeedRange.SUBCRITICAL


def test_load_of_a_mesh():
    load = mesh_load(SPUR_62, -100.0, -62.0, 1.5)
    assert (load.tangential_force, load.line_load, load.velocity) == pytest.approx((1000.0, 75e3, 6.2), rel=1e-14)
    for name, options in (("speed", (math.nan, 1.0, 1.0)), ("torque", (1.0, math.inf, 1.0)),
                          ("application_factor", (1.0, 1.0, 0.0))):
        with pytest.raises(InputError) as error:
            mesh_load(SPUR_62, *options)
        assert error.value.field == name


def reduced_mass(pair, bores=(0.0, 0.0)) -> float:
    """m_red of steel discs, kg/m."""
    diameters, base = disc_diameter(pair), pair.base_diameter
    inertias = [disc_inertia(d, bore, disc_mass(d, bore, width, DENSITY))
                for d, bore, width in zip(diameters, bores, pair.face_width, strict=True)]
    return equivalent_mass((inertias[0], inertias[1]), (base[0] / 2, base[1] / 2)) / pair.common_face_width


def test_reduced_mass_of_discs_is_that_of_the_standard():
    # ISO 6336-1:2006, (30), which takes d_m2 = u d_m1
    for bores in ((0.0, 0.0), (30e-3, 40e-3)):
        pair, mean = SPUR_62, (SPUR_62.tip_diameter[0] + SPUR_62.root_diameter[0]) / 2
        first, second = (DENSITY * (1 - (bore / mean) ** 4) for bore in bores)
        expected = math.pi / 8 * (mean / pair.base_diameter[0]) ** 2 * mean**2 / (1 / first + 1 / second)
        assert reduced_mass(pair, bores) == pytest.approx(expected, rel=1e-12)


def test_resonance_speed_is_that_of_an_oscillator():
    stiffness, mass = 20e9, 50.0  # per metre of face width
    found = resonance(25, stiffness, mass, 200e3)
    assert found.resonance_speed * 25 == pytest.approx(math.sqrt(stiffness / mass), rel=1e-14)
    # the standard's own form, with 20 N/(mm µm) and 0.05 kg/mm
    assert found.resonance_speed / RPM == pytest.approx(30000 / (math.pi * 25) * math.sqrt(20 / 0.05), rel=1e-12)
    assert (found.main_start, found.main_end, found.supercritical_start) == pytest.approx(
        (0.85 * found.resonance_speed, 1.15 * found.resonance_speed, 1.5 * found.resonance_speed), rel=1e-14)


def test_start_of_the_main_resonance_range():
    ratios = [resonance(25, 20e9, 50.0, w).lower_limit_ratio for w in (1e3, 25e3, 100e3 * (1 - 1e-12), 100e3, 1e6)]
    assert ratios == pytest.approx([0.535, 0.675, 0.85, 0.85, 0.85], rel=1e-9)


def test_speed_ranges():
    found = resonance(25, 20e9, 50.0, 200e3)
    ranges = [found.range_at(n * found.resonance_speed) for n in (0.2, 0.8499, 0.8501, 1.1499, 1.1501, 1.4999, 1.5001)]
    names = [r.value for r in ranges]
    assert names == ["subcritical"] * 2 + ["main resonance"] * 2 + ["intermediate"] * 2 + ["supercritical"]


def factor_at(ratio: float, given: Deviations, line_load: float = 200e3, pair=SPUR_62) -> DynamicFactorB:
    """Method B at a resonance ratio, for a reduced mass of 50 kg/m."""
    load = MeshLoad(tangential_force=4e3, line_load=line_load, velocity=50.0)
    stiffness = tooth_stiffness(pair, line_load=line_load)
    speed = ratio * resonance(pair.teeth[0], stiffness.mesh_stiffness, 50.0, line_load).resonance_speed
    found = dynamic_factor_b(pair, load, speed, stiffness, 50.0, given)
    assert isinstance(found, DynamicFactorB)
    return found


GIVEN = Deviations(
    base_pitch=8e-6, profile_form=10e-6, base_pitch_allowance=0.6e-6, profile_allowance=0.75e-6, tip_relief=20e-6)


def test_method_b_by_hand():
    stiffness = tooth_stiffness(SPUR_62).single_stiffness / 1e9  # N/(mm µm)
    pitch, profile = stiffness * 7.4 / 200, stiffness * 9.25 / 200
    relief = abs(1 - stiffness * 20 / 200)
    found = factor_at(0.5, GIVEN)
    assert (found.pitch_parameter, found.profile_parameter, found.relief_parameter) == pytest.approx(
        (pitch, profile, relief), rel=1e-12)
    assert 1.5 < SPUR_62.contact_ratio < 2
    seventh = 0.125 * math.sin(math.pi * (SPUR_62.contact_ratio - 2)) + 0.875
    subcritical = 0.32 * pitch + 0.34 * profile + 0.23 * relief
    main = 0.32 * pitch + 0.34 * profile + 0.90 * relief + 1
    above = 0.47 * pitch + 0.47 * profile + seventh
    for ratio, expected in (
        (0.5, 1 + 0.5 * subcritical), (0.85 - 1e-12, 1 + 0.85 * subcritical), (1.0, main), (2.0, above),
        (1.325, (main + above) / 2), (5.0, above),
    ):
        assert factor_at(ratio, GIVEN).value == pytest.approx(expected, rel=1e-9)


def test_method_b_is_continuous_but_at_the_start_of_main_resonance():
    for border in (1.15, 1.5):
        below, above = (factor_at(border + step, GIVEN).value for step in (-1e-9, 1e-9))
        assert below == pytest.approx(above, abs=1e-7)
    assert factor_at(0.85 + 1e-9, GIVEN).value - factor_at(0.85 - 1e-9, GIVEN).value > 0.1
    assert factor_at(1e-9, GIVEN).value == pytest.approx(1.0, abs=1e-8)


def test_method_b_above_the_main_resonance_may_be_below_one():
    exact = Deviations(
        base_pitch=0.0, profile_form=0.0, base_pitch_allowance=0.0, profile_allowance=0.0, tip_relief=0.0)
    expected = 0.125 * math.sin(math.pi * (SPUR_62.contact_ratio - 2)) + 0.875
    assert factor_at(2.0, exact).value == pytest.approx(expected, rel=1e-12)
    assert expected < 1


def test_tip_relief_counts_up_to_grade_5_only():
    both = tolerances(Quality(ISO_1995, 5), SPUR_62)
    fine, coarse = (deviations(SPUR_62, both, grade, tip_relief=(10e-6, 30e-6)) for grade in (5, 6))
    assert fine.tip_relief == pytest.approx(20e-6, rel=1e-14)
    assert factor_at(1.0, coarse).relief_parameter == 1.0 != factor_at(1.0, fine).relief_parameter
    assert factor_at(1.0, deviations(SPUR_62, both, 5)).relief_parameter == 1.0


def test_deviations_are_those_of_the_less_accurate_wheel():
    found = deviations(ISO_TR_EXAMPLE_1, tolerances(Quality(ISO_1995, 5), ISO_TR_EXAMPLE_1), 5)
    angle = math.atan(math.tan(math.radians(20)) / math.cos(math.radians(15.8)))
    assert found.base_pitch == pytest.approx(9.5e-6 * math.cos(angle), rel=1e-12)
    assert found.profile_form == pytest.approx(12e-6, rel=1e-12)
    assert (found.base_pitch_allowance, found.profile_allowance) == (0.0, 0.0)


def test_running_in():
    steel, iron = FlankMaterial("through hardened", 800e6), FlankMaterial("cast iron", 400e6)
    assert running_in_allowance(20e-6, steel, 5.0) == pytest.approx(4e-6, rel=1e-12)
    assert running_in_allowance(100e-6, steel, 5.0) == pytest.approx(20e-6, rel=1e-12)
    assert running_in_allowance(100e-6, steel, 5.1) == pytest.approx(16e-6, rel=1e-12)
    assert running_in_allowance(100e-6, steel, 10.1) == pytest.approx(8e-6, rel=1e-12)
    assert running_in_allowance(40e-6, iron, 20.0) == pytest.approx(11e-6, rel=1e-12)
    assert running_in_allowance(100e-6, iron, 7.0) == pytest.approx(22e-6, rel=1e-12)
    assert running_in_allowance(20e-6, HARDENED, 1.0) == pytest.approx(1.5e-6, rel=1e-12)
    assert running_in_allowance(100e-6, HARDENED, 1.0) == pytest.approx(3e-6, rel=1e-12)
    # the limits begin at f_pb = 80 µm and 40 µm, where the two parts meet
    assert running_in_allowance(80e-6, steel, 10.0) == pytest.approx(running_in_allowance(80e-6, steel, 5.0), rel=1e-12)
    assert running_in_allowance(40e-6, steel, 20.0) == pytest.approx(running_in_allowance(40e-6, steel, 5.0), rel=1e-12)
    assert relief_from_running_in(HARDENED) == pytest.approx((((1500 / 97) - 18.45) ** 2 / 18 + 1.5) * 1e-6, rel=1e-12)
    pair = deviations(SPUR_62, tolerances(Quality(ISO_1995, 5), SPUR_62), 5, velocity=1.0, flanks=(steel, HARDENED))
    assert pair.base_pitch_allowance == pytest.approx((0.2 + 0.075) / 2 * pair.base_pitch, rel=1e-12)
    assert pair.profile_allowance == pytest.approx((0.2 + 0.075) / 2 * pair.profile_form, rel=1e-12)
    assert pair.tip_relief == pytest.approx((relief_from_running_in(steel) + relief_from_running_in(HARDENED)) / 2)
    for group, limit in (("soft", 1e9), ("cast iron", -1.0), ("cast iron", math.inf)):
        with pytest.raises(InputError, match="flank"):
            FlankMaterial(group, limit)


def test_constants_of_method_b():
    assert constants(1.2) == pytest.approx((0.32, 0.34, 0.23, 0.90, 0.47, 0.47, 0.75), rel=1e-14)
    assert constants(3.0) == pytest.approx(
        (0.32, 0.57 / 2.7, 0.096 / 1.44, 0.42 / 1.56, 0.47, 0.12 / 1.26, 1.0), rel=1e-14)
    for border in (1.5, 2.0, 2.5):
        assert constants(border - 1e-9).C_v7 == pytest.approx(constants(border + 1e-9).C_v7, abs=1e-8)
    # the printed constants jump at 2
    jumps = [a - b for a, b in zip(constants(2.0), constants(2.0 + 1e-12), strict=True)]
    assert jumps == pytest.approx(
        [0, 0.34 - 0.57 / 1.7, 0.23 - 0.096 / 0.44, 0.9 - 0.47 / 0.56, 0, 0.47 - 0.12 / 0.26, 0], abs=1e-9)


def test_refusals_and_warnings_of_method_b():
    stiffness = tooth_stiffness(SPUR_62)
    none = dynamic_factor_b(
        SPUR_62, MeshLoad(tangential_force=0.0, line_load=0.0, velocity=1.0), 10.0, stiffness, 50.0, GIVEN)
    assert isinstance(none, Refused) and none.value is None and "load" in none.reason
    wide = spur(centre_distance=SPUR_62.centre_distance + 3e-3)
    load = MeshLoad(tangential_force=4e3, line_load=200e3, velocity=50.0)
    gap = dynamic_factor_b(wide, load, 10.0, stiffness, 50.0, GIVEN)
    assert isinstance(gap, Refused) and "total contact ratio" in gap.reason
    assert "separation" in " ".join(factor_at(0.5, GIVEN, line_load=49e3).warnings)
    assert "should be avoided" in " ".join(factor_at(1.0, GIVEN).warnings)
    assert "method A" in " ".join(factor_at(1.3, GIVEN).warnings)
    assert factor_at(0.5, GIVEN).warnings == ()
    assert "method C" in " ".join(example().warnings)
    unequal = spur(teeth=(60, 20))
    for velocity, warned in ((2.999, True), (3.001, False)):
        load = MeshLoad(tangential_force=4e3, line_load=200e3, velocity=velocity / (20 / 100 * math.sqrt(0.9)))
        found = dynamic_factor_b(unequal, load, 10.0, tooth_stiffness(SPUR_62), 50.0, GIVEN)
        assert ("method C" in " ".join(found.warnings)) is warned


def method_c(velocity: float, grade: int = 5, line_load: float = 200e3, pair=SPUR_62, solid: bool = True):
    """Method C of a pair at a pitch line velocity."""
    load = MeshLoad(tangential_force=1.0, line_load=line_load, velocity=velocity)
    return dynamic_factor_c(pair, load, grade, solid_wheels=solid)


def test_method_c_by_hand():
    pair = replace(SPUR_62, teeth=(20, 60))
    parameter = 5.0 * 20 / 100 * math.sqrt(9 / 10)
    expected = 1 + (7.5 / 200 + 0.0193) * parameter * (2.071 - 0.357 * parameter)
    found = method_c(5.0, pair=pair)
    assert isinstance(found, DynamicFactorC)
    assert (found.velocity_parameter, found.value) == pytest.approx((parameter, expected), rel=1e-12)
    assert method_c(5.0, pair=replace(pair, teeth=(60, 20))) == found
    slow = method_c(0.1, pair=pair)
    assert slow.value == pytest.approx(1 + (7.5 / 200 + 0.0193) * parameter / 50 * 2, rel=1e-12)


@pytest.mark.parametrize(("grade", "spur_k1", "helical_k1"), [
    (3, 2.1, 1.9), (4, 3.9, 3.5), (5, 7.5, 6.7), (6, 14.9, 13.3), (7, 26.8, 23.9), (8, 39.1, 34.8),
])
def test_table_of_method_c(grade: int, spur_k1: float, helical_k1: float):
    pair = replace(ISO_TR_EXAMPLE_1, face_width=(0.05, 0.05))
    found = method_c(2.0, grade, 500e3, pair)
    t, k3 = found.velocity_parameter, found.speed_factor
    assert found.spur == pytest.approx(1 + (spur_k1 / 500 + 0.0193) * t * k3, rel=1e-12)
    assert found.helical == pytest.approx(1 + (helical_k1 / 500 + 0.0087) * t * k3, rel=1e-12)
    assert 0 < pair.overlap_ratio < 1
    assert found.value == pytest.approx(
        (1 - pair.overlap_ratio) * found.spur + pair.overlap_ratio * found.helical, rel=1e-12)
    wide = method_c(2.0, grade, 500e3, ISO_TR_EXAMPLE_1)
    assert ISO_TR_EXAMPLE_1.overlap_ratio > 1
    assert wide.value == wide.helical


def test_limits_of_method_c():
    per_velocity = 62 / 100 * math.sqrt(0.5)
    assert method_c(5.0, line_load=10e3) == method_c(5.0, line_load=100e3)
    assert method_c(5.0, line_load=100e3).value > method_c(5.0, line_load=101e3).value
    below, above = (method_c((0.2 + step) / per_velocity) for step in (-1e-9, 1e-9))
    assert (below.speed_factor, above.speed_factor) == pytest.approx((2.0, 2.071 - 0.357 * 0.2), abs=1e-8)
    assert below.value == pytest.approx(above.value, abs=1e-5)


def test_refusals_of_method_c():
    fast, medium = 10.001, 3.001
    teeth = replace(SPUR_62, teeth=(20, 60))
    per_velocity = 20 / 100 * math.sqrt(0.9)
    assert "below 10 m/s" in method_c(fast / per_velocity, pair=teeth).reason
    assert "K3 is negative" in method_c(9.999 / per_velocity, pair=teeth).reason
    assert method_c(5.80 / per_velocity, pair=teeth).value == pytest.approx(1, abs=2e-3)
    assert method_c(5.81 / per_velocity, pair=teeth).value is None
    assert "grades 3 to 8" in method_c(1.0, grade=9).reason
    assert "grades 3 to 8" in method_c(1.0, grade=2).reason
    many = 62 / 100 * math.sqrt(0.5)
    assert "fewer than 50 teeth" in method_c(medium / many).reason
    assert method_c(2.999 / many).value is not None
    for count, value in ((49, True), (50, False)):
        found = method_c(4.0 / (count / 100 * math.sqrt(0.5)), pair=replace(SPUR_62, teeth=(count, count)))
        assert (found.value is not None) is value
    steep = replace(teeth, helix_angle=math.radians(31))
    assert "helix angle" in method_c(medium / per_velocity, pair=steep).reason
    assert method_c(2.999 / per_velocity, pair=steep).value is not None
    assert "solid discs" in method_c(medium / per_velocity, pair=teeth, solid=False).reason
    assert method_c(2.999 / per_velocity, pair=teeth, solid=False).value is not None
    for found in (method_c(1.0, grade=9), method_c(medium / many)):
        assert isinstance(found, Refused) and found.value is None


def test_agma_by_hand():
    exact = dynamic_factor_agma(10.0, 11)
    assert isinstance(exact, DynamicFactorAGMA)
    assert (exact.exponent, exact.velocity_constant) == pytest.approx((0.25, 92.0), rel=1e-14)
    # 2001-D04 prints both in ft/min: √v_t, and v_t max = (A + Q_v − 3)²; one foot is 0.3048 m
    assert exact.largest_velocity == pytest.approx(100**2 * 0.3048 / 60, rel=1e-5)
    assert exact.value == pytest.approx(((92 + math.sqrt(10 * 60 / 0.3048)) / 92) ** 0.25, rel=1e-6)
    coarse = dynamic_factor_agma(0.0, 5)
    assert coarse.value == 1.0
    assert coarse.exponent == pytest.approx(0.25 * 7 ** (2 / 3), rel=1e-14)
    values = [dynamic_factor_agma(10.0, q).value for q in range(5, 12)]
    assert values == sorted(values, reverse=True)  # K_v falls with the quality number


def test_agma_notation_with_the_accuracy_grade():
    for grade in range(6, 13):
        found = dynamic_factor_agma(10.0, quality_number(grade))
        exponent = 0.25 * (grade - 5) ** (2 / 3)
        constant = 50 + 56 * (1 - exponent)
        assert (found.exponent, found.velocity_constant) == pytest.approx((exponent, constant), rel=1e-14)
        assert found.largest_velocity * 196.85 == pytest.approx((constant + 14 - grade) ** 2, rel=1e-14)
        assert found.value == pytest.approx(((constant + math.sqrt(196.85 * 10.0)) / constant) ** exponent, rel=1e-14)


def test_refusals_of_agma():
    largest = dynamic_factor_agma(1.0, 8).largest_velocity
    assert dynamic_factor_agma(largest, 8).value is not None
    assert "at most 29.13 m/s" in dynamic_factor_agma(largest * 1.0001, 8).reason
    for quality in (4, 12):
        found = dynamic_factor_agma(1.0, quality)
        assert isinstance(found, Refused) and found.value is None and "[5, 11]" in found.reason
    assert quality_number(5) == 12


def design_of_example_1(**changes) -> GearDesign:
    """ISO/TR 6336-30, example 1, with the printed tip diameters."""
    return GearDesign(**{
        "teeth": (17, 103), "module": "8 mm", "helix_angle": "15.8 deg", "face_width": "100 mm",
        "centre_distance": "500 mm", "profile_shift": (0.145, 0.0), "tip_diameter": ("159.66 mm", "872.35 mm"),
        "rack": {"addendum": 1.0, "dedendum": 1.4, "root_radius": 0.39}, "bore": ("60 mm", "120 mm"),
        "tip_relief": "70 um", "quality": {"standard": "ISO 1328-1:1995", "grade": 5}, "speed": "360 rpm",
        "torque": "9000 N*m", **changes,
    })


def dynamic_factors(design: GearDesign) -> dict:
    return {standard.name: standard.factor(design) for standard in standards()}


def test_dynamic_factors_of_a_design():
    found, flanks = dynamic_factors(design_of_example_1()), (HARDENED, HARDENED)
    run_in = of_design(design_of_example_1(), flanks)
    assert run_in.value == pytest.approx(1.003, abs=5e-4)
    assert found["Kv_ISO_C"].value == pytest.approx(1.0119, abs=5e-5)
    assert found["Kv_AGMA"].value is None  # Q_v = 12
    coarse = dynamic_factors(design_of_example_1(quality={"standard": "ISO 1328-1:1995", "grade": (5, 8)}))
    assert coarse["Kv_AGMA"] == dynamic_factor_agma(design_of_example_1().load.velocity, 9)
    assert coarse["Kv_ISO_C"].value > found["Kv_ISO_C"].value
    assert coarse["Kv_ISO_B"].relief_parameter == 1.0 != run_in.relief_parameter
    no_relief = of_design(design_of_example_1(tip_relief=None), flanks)
    assert no_relief.relief_parameter == pytest.approx(
        abs(1 - 12.37047 * relief_from_running_in(HARDENED) * 1e6 / 1273.52), rel=1e-4)


def test_resonance_is_at_the_natural_frequency_of_the_pair():
    design = design_of_example_1()
    found = of_design(design).resonance
    stiffness = tooth_stiffness(design.geometry).mesh_stiffness * 0.1
    assert found.resonance_speed * 17 == pytest.approx(math.sqrt(stiffness / design.equivalent_mass), rel=1e-12)


@pytest.mark.parametrize(("changes", "refused", "words"), [
    ({"quality": None}, ("Kv_ISO_B", "Kv_ISO_C", "Kv_AGMA"), "no quality"),
    ({"speed": None, "torque": None}, ("Kv_ISO_B", "Kv_ISO_C", "Kv_AGMA"), "no speed and no torque"),
    ({"bore": None}, ("Kv_ISO_B",), "bore"), ({"torque": "0 N*m"}, ("Kv_ISO_B",), "Without load"),
    ({"face_width": "3 mm"}, ("Kv_ISO_B",), "face_width"),
])
def test_factors_that_a_design_does_not_have(changes, refused, words: str):
    found = dynamic_factors(design_of_example_1(**changes))
    for name in ("Kv_ISO_B", "Kv_ISO_C"):
        factor = found[name]
        assert (factor.value is None) is (name in refused)
        assert words in factor.reason or name not in refused
