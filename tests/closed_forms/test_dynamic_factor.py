"""Dynamic factors by ISO 6336-1, methods B and C, and AGMA: published values, limits, jumps and refusals."""

import math
from dataclasses import replace

import pytest

from gearchaos.errors import InputError
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.dynamic_factor import Refused, standards
from gearchaos.gears.dynamic_factor.agma import dynamic_factor_agma, quality_number
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
from gearchaos.gears.dynamic_factor.main_resonance import ResonanceRange, resonance
from gearchaos.gears.geometry.mechanics import MeshLoad, mesh_load
from gearchaos.gears.stiffness.iso6336 import tooth_stiffness
from gearchaos.gears.transmission_error import Quality, tolerances
from gearchaos.gears.transmission_error.iso1328_1995 import ISO_1995
from tests.gear_examples import ISO_TR_EXAMPLE_1, SPUR_62, spur

RPM = math.pi / 30
STEEL, IRON, HARDENED = (FlankMaterial("through hardened", 800e6), FlankMaterial("cast iron", 400e6),
                         FlankMaterial("surface hardened", 1500e6))


def test_load_of_a_mesh():
    load = mesh_load(SPUR_62, -100.0, -62.0, 1.5)
    assert (load.tangential_force, load.line_load, load.velocity) == pytest.approx((1000.0, 75e3, 6.2), rel=1e-14)
    for name, options in (("speed", (math.nan, 1.0, 1.0)), ("torque", (1.0, math.inf, 1.0)),
                          ("application_factor", (1.0, 1.0, 0.0))):
        with pytest.raises(InputError) as error:
            mesh_load(SPUR_62, *options)
        assert error.value.field == name


def test_the_ranges_begin_at_shares_of_the_resonance_speed():
    # the standard's own form, with 20 N/(mm µm) and 0.05 kg/mm; here per metre
    found, exact = resonance(25, 20e9, 50.0, 200e3), 30000 / (math.pi * 25) * math.sqrt(20 / 0.05) * RPM
    assert (found.resonance_speed, found.main_start, found.main_end, found.supercritical_start) == pytest.approx(
        (exact, 0.85 * exact, 1.15 * exact, 1.5 * exact), rel=1e-12)
    names = [found.range_at(n * exact).value for n in (0.2, 0.8499, 0.8501, 1.1499, 1.1501, 1.4999, 1.5001)]
    assert names == ["subcritical"] * 2 + ["main resonance"] * 2 + ["intermediate"] * 2 + ["supercritical"]
    ratios = [resonance(25, 20e9, 50.0, w).lower_limit_ratio for w in (1e3, 25e3, 100e3 * (1 - 1e-12), 100e3, 1e6)]
    assert ratios == pytest.approx([0.535, 0.675, 0.85, 0.85, 0.85], rel=1e-9)


def factor_at(ratio: float, given: Deviations, line_load: float = 200e3) -> DynamicFactorB:
    """Method B at a resonance ratio, for a reduced mass of 50 kg/m."""
    load = MeshLoad(tangential_force=4e3, line_load=line_load, velocity=50.0)
    stiffness = tooth_stiffness(SPUR_62, line_load=line_load)
    speed = ratio * resonance(62, stiffness.mesh_stiffness, 50.0, line_load).resonance_speed
    return dynamic_factor_b(SPUR_62, load, speed, stiffness, 50.0, given)


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
    for ratio, expected in (  # it jumps at 0.85 alone
        (1e-9, 1.0), (0.5, 1 + 0.5 * subcritical), (0.85 - 1e-12, 1 + 0.85 * subcritical), (0.85 + 1e-12, main),
        (1.15 - 1e-9, main), (1.15 + 1e-9, main), (1.325, (main + above) / 2), (1.5 - 1e-9, above), (5.0, above)):
        assert factor_at(ratio, GIVEN).value == pytest.approx(expected, abs=1e-8)
    exact = replace(GIVEN, base_pitch=0.0, profile_form=0.0, base_pitch_allowance=0.0, profile_allowance=0.0)
    assert factor_at(2.0, exact).value == pytest.approx(seventh, rel=1e-12) and seventh < 1


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


@pytest.mark.parametrize(("flank", "deviation", "velocity", "allowance"), [
    (STEEL, 20, 5.0, 4), (STEEL, 100, 5.0, 20), (STEEL, 100, 5.1, 16), (STEEL, 100, 10.1, 8), (IRON, 40, 20.0, 11),
    (IRON, 100, 7.0, 22), (HARDENED, 20, 1.0, 1.5), (HARDENED, 100, 1.0, 3),
    (STEEL, 80, 10.0, 16), (STEEL, 40, 20.0, 8),  # where the limits begin
])
def test_running_in_removes_a_share_up_to_a_limit_that_falls_with_the_velocity(flank, deviation, velocity, allowance):
    assert running_in_allowance(deviation * 1e-6, flank, velocity) == pytest.approx(allowance * 1e-6, rel=1e-12)


def test_what_running_in_removes_of_a_pair_is_the_mean_of_both_wheels():
    assert relief_from_running_in(HARDENED) == pytest.approx((((1500 / 97) - 18.45) ** 2 / 18 + 1.5) * 1e-6, rel=1e-12)
    pair = deviations(SPUR_62, tolerances(Quality(ISO_1995, 5), SPUR_62), 5, velocity=1.0, flanks=(STEEL, HARDENED))
    assert pair.base_pitch_allowance == pytest.approx((0.2 + 0.075) / 2 * pair.base_pitch, rel=1e-12)
    assert pair.profile_allowance == pytest.approx((0.2 + 0.075) / 2 * pair.profile_form, rel=1e-12)
    assert pair.tip_relief == pytest.approx((relief_from_running_in(STEEL) + relief_from_running_in(HARDENED)) / 2)
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
    wide = spur(centre_distance=SPUR_62.centre_distance + 3e-3)
    for pair, line_load, words in ((SPUR_62, 0.0, "load"), (wide, 200e3, "total contact ratio")):
        load = MeshLoad(tangential_force=line_load / 50, line_load=line_load, velocity=50.0)
        found = dynamic_factor_b(pair, load, 10.0, stiffness, 50.0, GIVEN)
        assert isinstance(found, Refused) and found.value is None and words in found.reason
    for ratio, line_load, words in (
            (0.5, 49e3, "separation"), (1.0, 200e3, "should be avoided"), (1.3, 200e3, "method A")):
        assert words in " ".join(factor_at(ratio, GIVEN, line_load).warnings)
    assert factor_at(0.5, GIVEN).warnings == ()
    for velocity, warned in ((2.999, True), (3.001, False)):
        load = MeshLoad(tangential_force=4e3, line_load=200e3, velocity=velocity / (20 / 100 * math.sqrt(0.9)))
        found = dynamic_factor_b(spur(teeth=(60, 20)), load, 10.0, stiffness, 50.0, GIVEN)
        assert ("method C" in " ".join(found.warnings)) is warned


TEETH = replace(SPUR_62, teeth=(20, 60))
STEEP = replace(TEETH, helix_angle=math.radians(31))


def method_c(velocity: float, grade: int = 5, line_load: float = 200e3, pair=SPUR_62, solid: bool = True):
    """Method C of a pair at a pitch line velocity."""
    load = MeshLoad(tangential_force=1.0, line_load=line_load, velocity=velocity)
    return dynamic_factor_c(pair, load, grade, solid_wheels=solid)


def test_method_c_by_hand():
    parameter = 5.0 * 20 / 100 * math.sqrt(9 / 10)
    expected = 1 + (7.5 / 200 + 0.0193) * parameter * (2.071 - 0.357 * parameter)
    found = method_c(5.0, pair=TEETH)
    assert (found.velocity_parameter, found.value) == pytest.approx((parameter, expected), rel=1e-12)
    assert method_c(5.0, pair=replace(TEETH, teeth=(60, 20))) == found
    assert method_c(0.1, pair=TEETH).value == pytest.approx(1 + (7.5 / 200 + 0.0193) * parameter / 50 * 2, rel=1e-12)


@pytest.mark.parametrize(("grade", "spur_k1", "helical_k1"), [
    (3, 2.1, 1.9), (4, 3.9, 3.5), (5, 7.5, 6.7), (6, 14.9, 13.3), (7, 26.8, 23.9), (8, 39.1, 34.8)])
def test_table_of_method_c(grade: int, spur_k1: float, helical_k1: float):
    pair = replace(ISO_TR_EXAMPLE_1, face_width=(0.05, 0.05))
    found, wide = (method_c(2.0, grade, 500e3, each) for each in (pair, ISO_TR_EXAMPLE_1))
    t, k3 = found.velocity_parameter, found.speed_factor
    assert found.spur == pytest.approx(1 + (spur_k1 / 500 + 0.0193) * t * k3, rel=1e-12)
    assert found.helical == pytest.approx(1 + (helical_k1 / 500 + 0.0087) * t * k3, rel=1e-12)
    assert 0 < pair.overlap_ratio < 1 < ISO_TR_EXAMPLE_1.overlap_ratio
    assert found.value == pytest.approx(
        (1 - pair.overlap_ratio) * found.spur + pair.overlap_ratio * found.helical, rel=1e-12)
    assert wide.value == wide.helical


def test_limits_of_method_c():
    assert method_c(5.0, line_load=10e3) == method_c(5.0, line_load=100e3)
    assert method_c(5.0, line_load=100e3).value > method_c(5.0, line_load=101e3).value
    below, above = (method_c((0.2 + step) / (62 / 100 * math.sqrt(0.5))) for step in (-1e-9, 1e-9))
    assert (below.speed_factor, above.speed_factor) == pytest.approx((2.0, 2.071 - 0.357 * 0.2), abs=1e-8)
    assert below.value == pytest.approx(above.value, abs=1e-5)


@pytest.mark.parametrize(("parameter", "options", "words"), [  # (v z1/100) √(u²/(1 + u²)), m/s
    (10.001, {}, "below 10 m/s"), (9.999, {}, "K3 is negative"), (5.81, {}, "K3 is negative"), (5.8, {}, ""),
    (0.2, {"grade": 9}, "grades 3 to 8"), (0.2, {"grade": 2}, "grades 3 to 8"),
    (3.001, {"pair": SPUR_62}, "fewer than 50 teeth"), (2.999, {"pair": SPUR_62}, ""),
    (4.0, {"pair": replace(SPUR_62, teeth=(49, 49))}, ""),
    (4.0, {"pair": replace(SPUR_62, teeth=(50, 50))}, "fewer than 50 teeth"),
    (3.001, {"pair": STEEP}, "helix angle"), (2.999, {"pair": STEEP}, ""),
    (3.001, {"solid": False}, "solid discs"), (2.999, {"solid": False}, "")])
def test_refusals_of_method_c(parameter, options, words):
    few, many = sorted(options.get("pair", TEETH).teeth)
    found = method_c(parameter / (few / 100 * math.sqrt(1 / (1 + (few / many) ** 2))), **{"pair": TEETH, **options})
    assert isinstance(found, Refused if words else DynamicFactorC)
    assert (found.value is None) is bool(words) and words in found.reason


def test_agma_by_hand():
    """In the notation with the accuracy grade; 1 m/s is 196.85 ft/min."""
    assert dynamic_factor_agma(0.0, 5).value == 1.0
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
        "torque": "9000 N*m", **changes})


def dynamic_factors(design: GearDesign) -> dict:
    return {standard.name: standard.factor(design) for standard in standards()}


def test_dynamic_factors_of_a_design():
    design, flanks = design_of_example_1(), (HARDENED, HARDENED)
    found, run_in = dynamic_factors(design), of_design(design, flanks)
    for each in (found["Kv_ISO_B"], run_in):  # as published
        assert each.value == pytest.approx(1.003, abs=5e-4) and each.speed_range is ResonanceRange.SUBCRITICAL
    stiffness = tooth_stiffness(design.geometry).mesh_stiffness * 0.1
    assert run_in.resonance.resonance_speed * 17 == pytest.approx(
        math.sqrt(stiffness / design.equivalent_mass), rel=1e-12)
    assert found["Kv_ISO_C"].value == pytest.approx(1.0119, abs=5e-5)
    assert found["Kv_AGMA"].value is None  # Q_v = 12
    coarse = dynamic_factors(design_of_example_1(quality={"standard": "ISO 1328-1:1995", "grade": (5, 8)}))
    assert coarse["Kv_AGMA"] == dynamic_factor_agma(design.load.velocity, 9)
    assert coarse["Kv_ISO_C"].value > found["Kv_ISO_C"].value
    assert coarse["Kv_ISO_B"].relief_parameter == 1.0 != run_in.relief_parameter
    no_relief = of_design(design_of_example_1(tip_relief=None), flanks)
    assert no_relief.relief_parameter == pytest.approx(
        abs(1 - 12.37047 * relief_from_running_in(HARDENED) * 1e6 / 1273.52), rel=1e-4)


@pytest.mark.parametrize(("changes", "refused", "words"), [
    ({"quality": None}, ("Kv_ISO_B", "Kv_ISO_C", "Kv_AGMA"), "no quality"),
    ({"speed": None, "torque": None}, ("Kv_ISO_B", "Kv_ISO_C", "Kv_AGMA"), "no speed and no torque"),
    ({"bore": None}, ("Kv_ISO_B",), "bore"), ({"torque": "0 N*m"}, ("Kv_ISO_B",), "Without load"),
    ({"face_width": "3 mm"}, ("Kv_ISO_B",), "face_width")])
def test_factors_that_a_design_does_not_have(changes, refused, words: str):
    found = dynamic_factors(design_of_example_1(**changes))
    for name in ("Kv_ISO_B", "Kv_ISO_C"):
        assert (found[name].value is None) is (name in refused)
        assert words in found[name].reason or name not in refused
