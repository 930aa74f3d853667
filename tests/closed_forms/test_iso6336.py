"""Tooth stiffness by ISO 6336-1:2006: the published example, and each factor by hand."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from gearchaos.errors import InputError
from gearchaos.gears.formulas import formulas
from gearchaos.gears.stiffness.iso6336 import Blank, ToothStiffness, rack_factor, tooth_stiffness
from tests.gear_examples import ISO_TR_EXAMPLE_1, SPUR_62, spur

UNIT = 1e9
LINE_LOAD = 127352.0 / 0.1


def shifted(x1: float, x2: float, teeth: tuple[int, int] = (62, 62)):
    """A spur pair with profile shifts; the centre distance, which the stiffness does not use, opens with them."""
    return spur(teeth=teeth, profile_shift=(x1, x2), centre_distance=1e-3 * sum(teeth) + 2e-3 * max(x1 + x2, 0))


def test_published_example():
    found = tooth_stiffness(ISO_TR_EXAMPLE_1, line_load=LINE_LOAD)
    assert ISO_TR_EXAMPLE_1.virtual_teeth == pytest.approx((18.905, 114.543), abs=5e-4)
    assert found.single_stiffness_theoretical / UNIT == pytest.approx(17.85584, rel=1e-6)
    assert found.single_stiffness / UNIT == pytest.approx(12.37047, rel=1e-4)
    # the report computes with tip diameters rounded to 0.01 mm, 872.35 for 872.3548, which changes the contact ratio
    assert found.mesh_stiffness / UNIT == pytest.approx(17.46485, rel=2e-4)
    alteration = tuple(
        (published - exact) / 2
        for published, exact in zip((0.15966, 0.87235), ISO_TR_EXAMPLE_1.tip_diameter, strict=True))
    rounded = replace(ISO_TR_EXAMPLE_1, tip_alteration=alteration)
    assert rounded.contact_ratio == pytest.approx(1.5491, abs=5e-5)
    assert tooth_stiffness(rounded, line_load=LINE_LOAD).mesh_stiffness / UNIT == pytest.approx(17.46485, rel=1e-5)
    assert found.warnings == ()


def test_equal_spur_gears_by_hand():
    found = tooth_stiffness(SPUR_62)
    flexibility = 0.04723 + (0.15551 + 0.25791) / 62
    assert found.flexibility * UNIT == pytest.approx(flexibility, rel=1e-12)
    assert found.single_stiffness / UNIT == pytest.approx(0.8 * 0.975 / flexibility, rel=1e-12)
    assert found.mesh_stiffness * 0.02 / 1e6 == pytest.approx(460.9, abs=0.05)


def test_every_term_of_the_flexibility():
    z1, z2, x1, x2 = 20, 50, 0.4, -0.3
    expected = (
        0.04723 + 0.15551 / z1 + 0.25791 / z2 - 0.00635 * x1 - 0.11654 * x1 / z1 - 0.00193 * x2 - 0.24188 * x2 / z2
        + 0.00529 * x1 * x1 + 0.00182 * x2 * x2)
    assert tooth_stiffness(shifted(x1, x2, (z1, z2))).flexibility * UNIT == pytest.approx(expected, rel=1e-12)


def test_pinion_is_the_wheel_with_fewer_teeth():
    driving, driven = shifted(0.4, -0.3, (20, 50)), shifted(-0.3, 0.4, (50, 20))
    assert tooth_stiffness(driving).single_stiffness == tooth_stiffness(driven).single_stiffness
    equal = (shifted(0.2, 0.1), shifted(0.1, 0.2))
    assert tooth_stiffness(equal[0]).single_stiffness == tooth_stiffness(equal[1]).single_stiffness


def test_factors():
    assert rack_factor(1.2, math.radians(20)) == pytest.approx(1.0, rel=1e-14)
    assert rack_factor(1.25, math.radians(20)) == pytest.approx(0.975, rel=1e-14)
    assert rack_factor(1.2, math.radians(25)) == pytest.approx(1.1, rel=1e-14)
    assert rack_factor((1.2, 1.4), math.radians(20)) == pytest.approx(0.95, rel=1e-14)
    cast = tooth_stiffness(SPUR_62, youngs_modulus=(206e9, 103e9))
    assert cast.material_factor == pytest.approx(2 / 3, rel=1e-14)
    assert cast.mesh_stiffness == pytest.approx(2 / 3 * tooth_stiffness(SPUR_62).mesh_stiffness, rel=1e-14)


def test_wheel_with_rim_and_web():
    def factor(web: float, rim: float) -> float:
        return tooth_stiffness(SPUR_62, blanks=(None, Blank(web * 20e-3, rim * 2e-3))).blank_factor

    assert factor(0.4, 3) == pytest.approx(1 + math.log(0.4) / (5 * math.exp(0.6)), rel=1e-12)
    assert factor(0.4, 0.5) == factor(0.4, 1)
    assert factor(0.1, 3) == factor(0.2, 3)
    assert factor(1.5, 3) == 1.0  # the other wheel, a solid disc, is the more flexible one
    both = tooth_stiffness(SPUR_62, blanks=(Blank(30e-3, 6e-3), Blank(24e-3, 6e-3)))
    assert both.blank_factor == pytest.approx(1 + math.log(1.2) / (5 * math.exp(0.6)), rel=1e-12)


def test_low_load():
    full, at, below = (tooth_stiffness(SPUR_62, line_load=w).mesh_stiffness for w in (1e6, 100e3, 100e3 * 0.5**4))
    assert at == full == tooth_stiffness(SPUR_62).mesh_stiffness
    assert below == pytest.approx(full / 2, rel=1e-14)
    assert tooth_stiffness(SPUR_62, line_load=100e3 * (1 - 1e-9)).mesh_stiffness == pytest.approx(full, rel=1e-9)


@pytest.mark.parametrize(("x1", "x2", "field"), [
    (1.2, 0.9, "profile_shift"), (-0.2, -0.31, "profile_shift"), (0.0, 0.1, "profile_shift[0]"),
])
def test_profile_shifts_out_of_range_are_refused(x1: float, x2: float, field: str):
    with pytest.raises(InputError) as error:
        tooth_stiffness(shifted(x1, x2, (40, 62)))
    assert error.value.field == field
    assert "potential energy" in error.value.advice


def test_profile_shifts_on_the_limits_are_accepted():
    for x1, x2 in ((1.0, 1.0), (-0.25, -0.25), (0.1, 0.1)):
        tooth_stiffness(shifted(x1, x2, (40, 62)))


def test_no_permanent_tooth_contact_is_refused():
    wide = spur(centre_distance=SPUR_62.centre_distance + 3e-3)
    assert wide.contact_ratio < 1
    with pytest.raises(InputError, match="contact_ratio must be at least 1"):
        tooth_stiffness(wide)


def test_warnings_outside_the_validated_range():
    def words(pair, **options) -> str:
        return " ".join(tooth_stiffness(pair, **options).warnings)

    assert "normal working pressure angles" in words(spur(pressure_angle=math.radians(28)))
    assert "helix angles" in words(spur(helix_angle=math.radians(35)))
    assert "below 1.2" in words(spur(addendum=0.6))
    assert "contact ratios from 1 to 2.5" in words(spur(addendum=1.6))
    assert "fitted" in words(SPUR_62, line_load=1700e3)
    assert words(SPUR_62, line_load=1000e3) == ""


@pytest.mark.parametrize("options", [
    {"line_load": 0.0}, {"line_load": math.nan}, {"youngs_modulus": (206e9, -1.0)},
    {"blanks": (Blank(0.0, 1e-3), None)},
])
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
