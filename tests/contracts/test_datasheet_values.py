"""Quantities of a datasheet that follow from the supports, the accuracy grade and the number of teeth."""

import math
from dataclasses import replace

import pytest

from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.sheet import datasheet
from gearchaos.gears.transmission_error.harmonics import from_quality
from gearchaos.gears.transmission_error.quality import tolerances

DESIGN = GearDesign(
    teeth=(50, 50), module="3 mm", face_width="20 mm", mass=(2.0, 2.0),
    quality={"standard": "ISO 1328-1:1995", "grade": (5, 6)})


def test_support_frequencies_are_those_of_the_wheels_alone():
    assert datasheet(DESIGN)["support_frequency"].reason == "The supports are rigid."
    supports = {"stiffness": ["200 N/um", "800 N/um"], "damping_ratio": 0.02}
    found = datasheet(replace(DESIGN, supports=supports))["support_frequency"]
    assert found.value == pytest.approx((1e4 / (2 * math.pi), 2e4 / (2 * math.pi)), rel=1e-14) and found.unit == "Hz"
    without = datasheet(replace(DESIGN, supports=supports, mass=None))["support_frequency"]
    assert without.value is None and without.reason.startswith("bore must be given")


def test_the_tangential_composite_deviation_is_that_of_the_grade():
    found = datasheet(DESIGN)["tangential_composite_deviation"]
    grade = from_quality(DESIGN.geometry, DESIGN.quality, tolerances(DESIGN.quality, DESIGN.geometry))
    assert found.value == tuple(v * 1e6 for v in grade.tooth_to_tooth) and found.symbol == "f_i′"
    newer = datasheet(replace(DESIGN, quality={"standard": "ISO 1328-1:2013", "grade": 6}))
    assert "no formula for f_i′" in newer["tangential_composite_deviation"].reason
    none = datasheet(replace(DESIGN, quality=None))["tangential_composite_deviation"]
    assert none.reason.startswith("quality must be given")


def test_the_mesh_period_is_a_roll_angle_of_wheel_1():
    found = datasheet(replace(DESIGN, teeth=(50, 80)))["mesh_period_roll_angle"]
    assert (found.value, found.unit) == (pytest.approx(7.2, rel=1e-14), "deg")
