"""Quantities of a datasheet: values from supports, grade and teeth; each has a source, its unit fits its factor."""

import math
from dataclasses import is_dataclass, replace
from importlib import import_module
from pkgutil import walk_packages

import pytest

from gearchaos import gears
from gearchaos.datasheet.quantities import datasheet, with_scanned_speeds
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.dynamic_factor import standards
from gearchaos.gears.io import units
from gearchaos.gears.io.fields import Formula, formulas
from gearchaos.gears.transmission_error import tolerances
from gearchaos.gears.transmission_error.harmonics import from_quality

DESIGN = GearDesign(
    teeth=(50, 50), module="3 mm", face_width="20 mm", mass=(2.0, 2.0),
    quality={"standard": "ISO 1328-1:1995", "grade": (5, 6)})


def sheet(**changes):
    return datasheet(replace(DESIGN, **changes))


def test_support_frequencies_are_those_of_the_wheels_alone_and_the_mesh_period_is_an_angle_of_wheel_1():
    period = sheet(teeth=(50, 80))["mesh_period_roll_angle"]
    assert (period.value, period.unit) == (pytest.approx(7.2, rel=1e-14), "deg")
    assert sheet()["support_frequency"].reason == "The supports are rigid."
    supports = {"stiffness": ["200 N/um", "800 N/um"], "damping_ratio": 0.02}
    found = sheet(supports=supports)["support_frequency"]
    assert found.value == pytest.approx((1e4 / (2 * math.pi), 2e4 / (2 * math.pi)), rel=1e-14) and found.unit == "Hz"
    wheels = replace(DESIGN, supports=supports, mass=(2.0, 4.5), inertia=(1e-3, 3e-3), damping_ratio=0.05, speed=500,
                     torque=100, backlash={"value": "0.1 mm", "of": "line of action, total"})
    assert (wheels.to_pair().k1, wheels.to_pair().k2) == pytest.approx((0.04 * 2e4, 0.04 * 6e4), rel=1e-14)
    base = wheels.geometry.base_diameter[0] / 2
    assert datasheet(wheels)["equivalent_mass"].value == pytest.approx(1 / (base**2 * (1e3 + 1e3 / 3)), rel=1e-14)
    without = sheet(supports=supports, mass=None)["support_frequency"]
    assert without.value is None and without.reason.startswith("bore must be given")


def test_the_tangential_composite_deviation_is_that_of_the_grade():
    entries = sheet(transmission_error="from quality")
    found = entries["tangential_composite_deviation"]
    grade = from_quality(DESIGN.geometry, DESIGN.quality, tolerances(DESIGN.quality, DESIGN.geometry))
    assert found.value == tuple(v * 1e6 for v in grade.tooth_to_tooth) and found.symbol == "f_i′"
    expected = [4 * math.hypot(*found.value) / (math.pi * j) ** 2 for j in (1, 2, 3)]
    assert entries["transmission_error_amplitudes"].value == pytest.approx(expected, rel=1e-14)
    reason = sheet(quality={"standard": "ISO 1328-1:2013", "grade": 6})["tangential_composite_deviation"].reason
    assert "ISO 1328-1:2013 has no formula for f_i′" in reason and "uses that of ISO 1328-1:1995, annex A" in reason
    assert sheet(quality=None)["tangential_composite_deviation"].reason.startswith("quality must be given")


def test_the_transmission_error_says_which_formula_it_has_with_which_values():
    older, newer = (replace(DESIGN, transmission_error="from quality", quality={"standard": s, "grade": (6, 7)})
                    for s in ("ISO 1328-1:1995", "ISO 1328-1:2013"))
    for design in (older, newer):
        row = datasheet(design)["transmission_error_amplitudes"]
        assert "f_i′ = K (4.3 2^((Q−5)/2) + f_pt + F_α)" in row.formula
        assert "6 and 7: assumption, both wheels at the limit of the grade" in row.source
        (warning,) = design.assumptions
        assert warning.startswith("The accuracy grade gives no transmission error; this one is an assumption")
    source = datasheet(newer)["transmission_error_amplitudes"].source
    assert "by the formula of ISO 1328-1:1995, annex A, with the grade and the deviations f_pT and F_αT of " in source
    assert "with the deviations of ISO 1328-1:2013, which has no such formula" in newer.assumptions[0]
    assert "formula of" not in older.assumptions[0]


def test_exact_teeth_are_said_and_beside_a_quality_warned_of_unless_they_are_meant():
    (warning,) = DESIGN.warnings
    assert warning.startswith("The teeth are taken to be exact although a quality is given") and "'none'" in warning
    assert "transmission_error = 'from quality'" in warning
    for changes in ({"transmission_error": "none"}, {"quality": None},
                    {"quality": None, "transmission_error": "from quality"}):
        assert replace(DESIGN, **changes).warnings == ()
    for name in ("transmission_error_amplitudes", "transmission_error_phases"):
        found = sheet()[name]
        assert found.value == () and found.formula.startswith("none given") and found == sheet(
            transmission_error="none")[name]
        assert 'transmission_error = "from quality"' in found.formula


def test_phases_and_rounding_errors_are_shown_as_a_reader_expects():
    found = sheet(transmission_error="from quality")
    phases = found["transmission_error_phases"]
    assert phases.value[2] > 360 and phases.shown == tuple(v % 360 for v in phases.value)
    tiny = replace(found["theoretical_backlash"], value=-2.99e-14)
    assert tiny.shown == 0.0 and math.copysign(1, tiny.shown) == 1
    assert replace(tiny, value=(1e-3, -1e-15)).shown == (1e-3, 0.0)
    assert found["support_frequency"].shown is None and found["support_frequency"].expected


def test_what_lacks_only_the_speed_refers_to_the_scan():
    found = datasheet(replace(DESIGN, torque=100.0))
    along = with_scanned_speeds(found)
    changed = {name for name in found if along[name] != found[name]}
    assert changed == {n for n, e in found.items() if e.reason.startswith("speed must be given")}
    assert changed >= {standard.name for standard in standards()}
    assert all(along[n].expected and along[n].reason == "depends on speed: see the curve" for n in changed)


MODULES = [import_module(found.name) for found in walk_packages(gears.__path__, "gearchaos.gears.")]
RESULTS = [value for module in MODULES for value in vars(module).values()
           if is_dataclass(value) and value.__module__ == module.__name__ and formulas(value)]

SI = {"N": "N", "N/mm": "N/m", "N/(mm µm)": "N/m^2", "mm µm/N": "m^2/N", "µm": "m", "m/s": "m/s", "kg/mm": "kg/m",
      "rpm": "rad/s"}


@pytest.mark.parametrize("formula", [pytest.param(formula, id=f"{result.__name__}.{name}")
                                     for result in RESULTS for name, formula in formulas(result).items()])
def test_formula(formula: Formula):
    assert formula.text and formula.source
    if not formula.unit:
        assert formula.factor == 1
        return
    dimension = units.SPEED if formula.unit == "rpm" else units.Dimension("a value", SI[formula.unit], "")
    in_si = units.to_si("value", f"1 {formula.unit.replace(' ', '*')}", dimension)
    assert in_si * (units.RPM if formula.unit == "rpm" else 1) * formula.factor == pytest.approx(1, rel=1e-12)


def test_every_standard_has_formulas():
    assert {standard.result for standard in standards()} < set(RESULTS) and formulas(Formula) == {}
