"""Tooth stiffness by ISO 6336-1:2006: the published example, and each factor by hand."""

import math
from dataclasses import replace

import pytest

from gearchaos.errors import InputError
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.io.fields import formulas
from gearchaos.gears.stiffness.iso6336 import Blank, ToothStiffness, rack_factor, tooth_stiffness
from tests.gear_examples import ISO_TR_EXAMPLE_1, SPUR_62, spur

UNIT = 1e9
LINE_LOAD = 127352.0 / 0.1


def shifted(x1: float, x2: float, teeth: tuple[int, int] = (62, 62)):
    """A spur pair with profile shifts; the centre distance, which the stiffness does not use, opens with them."""
    return spur(teeth=teeth, profile_shift=(x1, x2), centre_distance=1e-3 * sum(teeth) + 2e-3 * max(x1 + x2, 0))


def test_published_example():
    found = tooth_stiffness(ISO_TR_EXAMPLE_1, line_load=LINE_LOAD)
    assert found.single_stiffness_theoretical / UNIT == pytest.approx(17.85584, rel=1e-6)
    assert found.single_stiffness / UNIT == pytest.approx(12.37047, rel=1e-4)
    # the report computes with tip diameters rounded to 0.01 mm, 872.35 for 872.3548, which changes the contact ratio
    assert found.mesh_stiffness / UNIT == pytest.approx(17.46485, rel=2e-4)
    alteration = tuple((published - exact) / 2 for published, exact in zip(
        (0.15966, 0.87235), ISO_TR_EXAMPLE_1.tip_diameter, strict=True))
    rounded = replace(ISO_TR_EXAMPLE_1, tip_alteration=alteration)
    assert rounded.contact_ratio == pytest.approx(1.5491, abs=5e-5)
    assert tooth_stiffness(rounded, line_load=LINE_LOAD).mesh_stiffness / UNIT == pytest.approx(17.46485, rel=1e-5)
    assert found.warnings == ()


def test_every_term_of_the_flexibility():
    z1, z2, x1, x2 = 20, 50, 0.4, -0.3
    expected = (
        0.04723 + 0.15551 / z1 + 0.25791 / z2 - 0.00635 * x1 - 0.11654 * x1 / z1 - 0.00193 * x2 - 0.24188 * x2 / z2
        + 0.00529 * x1 * x1 + 0.00182 * x2 * x2)
    found = tooth_stiffness(shifted(x1, x2, (z1, z2)))
    assert found.flexibility * UNIT == pytest.approx(expected, rel=1e-12)
    assert found.single_stiffness / UNIT == pytest.approx(0.8 * 0.975 / expected, rel=1e-12)


@pytest.mark.parametrize("one", [((0.4, -0.3), (20, 50)), ((0.2, 0.1), (62, 62))])
def test_pinion_is_the_wheel_with_fewer_teeth(one):
    driving, driven = (shifted(*x, teeth=z) for x, z in (one, (one[0][::-1], one[1][::-1])))
    assert tooth_stiffness(driving).single_stiffness == tooth_stiffness(driven).single_stiffness


def test_factors():
    for dedendum, angle, factor in ((1.2, 20, 1.0), (1.25, 20, 0.975), (1.2, 25, 1.1), ((1.2, 1.4), 20, 0.95)):
        assert rack_factor(dedendum, math.radians(angle)) == pytest.approx(factor, rel=1e-14)
    cast = tooth_stiffness(SPUR_62, youngs_modulus=(206e9, 103e9))
    assert cast.material_factor == pytest.approx(2 / 3, rel=1e-14)
    assert cast.mesh_stiffness == pytest.approx(2 / 3 * tooth_stiffness(SPUR_62).mesh_stiffness, rel=1e-14)


def test_a_rim_or_web_beyond_the_limits_counts_as_the_limit_with_a_warning():
    def with_wheel(web: float, rim: float) -> ToothStiffness:
        return tooth_stiffness(SPUR_62, blanks=(None, Blank(rim * 2e-3, web * 20e-3)))

    factor = 1 + math.log(0.4) / (5 * math.exp(0.6))
    assert with_wheel(0.4, 3).blank_factor == pytest.approx(factor, rel=1e-12)
    assert with_wheel(0.4, 0.5).blank_factor == with_wheel(0.4, 1).blank_factor
    assert with_wheel(0.1, 3).blank_factor == with_wheel(0.2, 3).blank_factor
    assert with_wheel(1.5, 3).blank_factor == 1.0  # the other wheel, a solid disc, is the more flexible one
    both = tooth_stiffness(SPUR_62, blanks=(Blank(6e-3, 30e-3), Blank(6e-3, 24e-3)))
    assert both.blank_factor == pytest.approx(1 + math.log(1.2) / (5 * math.exp(0.6)), rel=1e-12)
    words = " ".join(tooth_stiffness(SPUR_62, blanks=(Blank(1e-3, 2e-3), Blank(6e-3, 30e-3))).warnings)
    assert "web of wheel 1, b_s/b = 0.1, counts as 0.2" in words
    assert "web of wheel 2, b_s/b = 1.5, counts as 1.2" in words
    assert "rim of wheel 1, s_R/m_n = 0.5, counts as 1 in" in words and "rim of wheel 2" not in words


def test_low_load():
    full = tooth_stiffness(SPUR_62).mesh_stiffness
    for line_load, share in ((1e6, 1), (100e3, 1), (100e3 * (1 - 1e-12), 1), (100e3 * 0.5**4, 0.5)):
        assert tooth_stiffness(SPUR_62, line_load=line_load).mesh_stiffness == pytest.approx(share * full, rel=1e-12)


@pytest.mark.parametrize(("shifts", "teeth", "words"), [
    ((1.2, 0.9), (40, 62), "sums of the profile shifts from −0.5 to 2; here it is 2.1"),
    ((-0.2, -0.31), (40, 62), "sums of the profile shifts from −0.5 to 2; here it is -0.51"),
    ((0.0, 1e-4), (40, 62), "at least the profile shift of its wheel; here they are 0 and 0.0001"),
    ((1e-4, 0.0), (62, 40), "at least the profile shift of its wheel; here they are 0 and 0.0001"),
    ((1.0, 1.0), (40, 62), ""), ((-0.25, -0.25), (40, 62), ""), ((0.1, 0.1), (40, 62), ""),  # on the limits
])
def test_profile_shifts_out_of_range_are_extrapolated_with_a_warning(shifts, teeth, words: str):
    found = [text for text in tooth_stiffness(shifted(*shifts, teeth)).warnings if "is extrapolated" in text]
    assert len(found) == bool(words) and all(text.endswith(words) for text in found)


def test_a_flexibility_that_is_not_positive_is_refused():
    geometry = spur(teeth=(5, 5), profile_shift=(3.0, 3.0), centre_distance=20.5e-3)
    with pytest.raises(InputError, match="profile_shift must give a positive flexibility") as error:
        tooth_stiffness(geometry)
    assert "potential energy" in error.value.advice and "q′ would be -0.0" in error.value.advice
    with pytest.raises(InputError, match="positive flexibility") as error:
        tooth_stiffness(replace(geometry, helix_angle=math.radians(1)))
    assert "potential energy" not in error.value.advice and "table" in error.value.advice


NREL = {"stage 1": ((19, 17), 45, 0, 491, 863, (0.617, 0.8021), (978.808, 905.470), 3.5),
        "stage 2": ((18, 36), 21, 0, 550, 584, (0.389, 0.5039), (432.838, 815.663), 3.5),
        "stage 3": ((24, 95), 14, 10, 360, 861, (0.480, 0.6691), (380.747, 1395.376), 5.0)}
"""The external pairs of the NREL 5 MW gearbox (A. R. Nejad et al., Wind Energy 19, 2016): teeth, module, helix angle,
face width, centre distance, profile shifts and tip diameters of KISSsoft's reports, and its assumption for s_R/m_n."""


@pytest.mark.parametrize(("stage", "blank_factor", "single", "mesh"), [
    ("stage 1", 0.862, 12.362, 13.426), ("stage 2", 0.862, 12.240, 15.640), ("stage 3", 0.898, 13.832, 18.632)])
def test_the_stages_of_the_nrel_gearbox_as_kisssoft_computes_them(stage, blank_factor, single, mesh):
    # c', c_γα and C_R (b_s/b = 0.25) of the reports @NREL_5MW/stage_0N.rtf in github.com/gfsReboucas/Drivetrain
    teeth, module, helix, width, distance, shifts, tips, rim = NREL[stage]
    design = GearDesign(
        teeth=teeth, module=f"{module} mm", helix_angle=f"{helix} deg", face_width=f"{width} mm", profile_shift=shifts,
        centre_distance=f"{distance} mm", tip_diameter=[f"{tip} mm" for tip in tips],
        blank={"rim": f"{rim * module} mm", "web": f"{0.25 * width} mm"})
    found = design.tooth_stiffness
    assert found.blank_factor == pytest.approx(blank_factor, abs=5e-4)
    assert found.single_stiffness / UNIT == pytest.approx(single, abs=6e-4)
    assert found.mesh_stiffness / UNIT == pytest.approx(mesh, abs=6e-4)
    assert any("extrapolated" in text for text in design.warnings) is (stage != "stage 1")


def test_a_stiffness_that_a_low_load_makes_doubtful_has_a_warning_with_numbers():
    full = tooth_stiffness(SPUR_62).mesh_stiffness / UNIT
    found = tooth_stiffness(SPUR_62, line_load=33.0)
    (warning,) = found.warnings
    assert f"is {(33 / 100e3) ** 0.25:.3g} of that" in warning and warning.startswith("F_t K_A/b is 0.033 N/mm")
    assert f"{found.mesh_stiffness / UNIT:.3g} instead of {full:.3g} N/(mm µm)" in warning
    assert warning.endswith('Write stiffness = "potential energy", or stiffness = { table = "tvms.csv" }')
    assert tooth_stiffness(SPUR_62, line_load=25e3 * (1 - 1e-9)).warnings
    assert tooth_stiffness(SPUR_62, line_load=25e3).warnings == ()


def test_no_permanent_tooth_contact_is_refused():
    wide = spur(centre_distance=SPUR_62.centre_distance + 3e-3)
    assert wide.contact_ratio < 1
    with pytest.raises(InputError, match="contact_ratio must be at least 1"):
        tooth_stiffness(wide)


@pytest.mark.parametrize(("changes", "line_load", "words"), [
    ({"pressure_angle": math.radians(28)}, 1000e3, "normal working pressure angles"),
    ({"helix_angle": math.radians(35)}, 1000e3, "helix angles"), ({"addendum": 0.6}, 1000e3, "below 1.2"),
    ({"addendum": 1.6}, 1000e3, "contact ratios from 1 to 2.5"), ({}, 1700e3, "fitted"), ({}, 1000e3, "")])
def test_warnings_outside_the_validated_range(changes, line_load, words):
    found = " ".join(tooth_stiffness(spur(**changes), line_load=line_load).warnings)
    assert words in found and bool(words) is bool(found)


@pytest.mark.parametrize("options", [
    {"line_load": 0.0}, {"line_load": math.nan}, {"youngs_modulus": (206e9, -1.0)},
    {"blanks": (Blank(1e-3, 0.0), None)}, {"blanks": (None, Blank(0.0, 1e-3))}])
def test_values_that_must_be_positive(options):
    with pytest.raises(InputError, match="must be a positive finite number"):
        tooth_stiffness(SPUR_62, **options)


def test_every_number_has_its_formula():
    described = formulas(ToothStiffness)
    assert set(described) == {name for name in ToothStiffness.__dataclass_fields__ if name != "warnings"}
    shown = described["single_stiffness"]
    value = tooth_stiffness(ISO_TR_EXAMPLE_1).single_stiffness * shown.factor
    assert (shown.symbol, shown.unit, round(value, 3)) == ("c′", "N/(mm µm)", 12.370)
    assert all("ISO 6336-1:2006, 9.3" in formula.source for formula in described.values())
