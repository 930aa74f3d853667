"""Flank tolerances: values of the printed tables, formulas by hand, ranges, rounding and scope."""

import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest

from gearchaos.errors import InputError
from gearchaos.gears.io.fields import formulas
from gearchaos.gears.transmission_error import Quality, rounded, tolerances
from gearchaos.gears.transmission_error.iso1328_1995 import ISO_1995
from gearchaos.gears.transmission_error.iso1328_2013 import ISO_2013
from tests.gear_examples import ISO_TR_EXAMPLE_1, spur


def sized(standard: str, grade: int, diameter: float, module: float, face_width: float = 20.0):
    """The tolerances in µm of a spur wheel with this reference diameter, sizes in mm."""
    teeth = max(math.floor(diameter / module * (1 + 1e-12)), 1)
    if standard == ISO_2013:
        teeth = min(teeth, 1000)
    pair = SimpleNamespace(
        teeth=(teeth, teeth), normal_module=module * 1e-3, reference_diameter=(diameter * 1e-3,) * 2,
        face_width=(face_width * 1e-3,) * 2, helix_angle=0.0)
    found = tolerances(Quality(standard, grade), pair)[1]
    return {name: round(1e6 * getattr(found, name), 6) for name in formulas(found)}


@pytest.mark.parametrize(("name", "size", "first_grade", "printed"), [
    # Table 1, 5 mm to 20 mm, modules 0.5 to 2
    ("single_pitch", (12, 1.0), 0, [0.8, 1.2, 1.7, 2.3, 3.3, 4.7, 6.5, 9.5, 13, 19, 26, 37, 53]),
    # 50 mm to 125 mm, modules 3.5 to 6
    ("single_pitch", (80, 4.0), 5, [6.5, 9, 13]), ("cumulative_pitch", (80, 4.0), 5, [19, 28, 39]),
    ("profile", (80, 4.0), 5, [9.5, 13, 19])])
def test_printed_tables_of_1995(name, size, first_grade, printed):
    assert [sized(ISO_1995, first_grade + n, *size)[name] for n in range(len(printed))] == printed


def by_hand_1995(d: float, m: float, b: float) -> dict[str, float]:
    """Tolerances of grade 5 in µm, of geometric means in mm."""
    return {
        "single_pitch": 0.3 * (m + 0.4 * math.sqrt(d)) + 4, "cumulative_pitch": 0.3 * m + 1.25 * math.sqrt(d) + 7,
        "profile": 3.2 * math.sqrt(m) + 0.22 * math.sqrt(d) + 0.7,
        "profile_form": 2.5 * math.sqrt(m) + 0.17 * math.sqrt(d) + 0.5,
        "profile_slope": 2 * math.sqrt(m) + 0.14 * math.sqrt(d) + 0.5,
        "helix": 0.1 * math.sqrt(d) + 0.63 * math.sqrt(b) + 4.2, "runout": 0.24 * m + math.sqrt(d) + 5.6}


def by_hand_2013(d: float, m: float, b: float) -> dict[str, float]:
    """Tolerances of class 5 in µm, of sizes in mm."""
    slope, form = 0.4 * m + 0.001 * d + 4, 0.55 * m + 5
    cumulative = 0.002 * d + 0.55 * math.sqrt(d) + 0.7 * m + 12
    helix = (0.05 * math.sqrt(d) + 0.35 * math.sqrt(b) + 4, 0.07 * math.sqrt(d) + 0.45 * math.sqrt(b) + 4)
    return {
        "single_pitch": 0.001 * d + 0.4 * m + 5, "cumulative_pitch": cumulative, "profile": math.hypot(slope, form),
        "profile_form": form, "profile_slope": slope, "runout": 0.9 * cumulative, "helix": math.hypot(*helix)}


DIAMETERS = (5, 20, 50, 125, 280, 560, 1000, 1600, 2500, 4000, 6000, 8000, 10000)
MODULES = (0.5, 2, 3.5, 6, 10, 16, 25, 40, 70)
FACE_WIDTHS = (4, 10, 20, 40, 80, 160, 250, 400, 650, 1000)


def upper_limits(limits: tuple[float, ...]) -> list[tuple[float, float]]:
    """The geometric mean and the upper limit of each range."""
    return [(math.sqrt(low * high), high) for low, high in itertools.pairwise(limits)]


def test_formulas_of_1995_in_every_range():
    widths = itertools.cycle(upper_limits(FACE_WIDTHS))
    for (mean_m, m), (mean_d, d) in itertools.product(upper_limits(MODULES), upper_limits(DIAMETERS)):
        mean_b, b = next(widths)
        by_hand = by_hand_1995(mean_d, mean_m, mean_b).items()
        for grade in (0, 5, 12) if d / m >= 1 else ():
            step = math.sqrt(2) ** (grade - 5)
            assert sized(ISO_1995, grade, d, m, b) == {name: rounded(step * value) for name, value in by_hand}


def test_formulas_of_2013_for_many_sizes():
    rng = np.random.default_rng(5)
    for _ in range(60):
        d, m, b = np.exp(rng.uniform(np.log((70, 0.5, 4)), np.log((15000, 10, 1200))))
        for grade in (1, 5, 11):
            step = math.sqrt(2) ** (grade - 5)
            expected = {name: rounded(step * value) for name, value in by_hand_2013(d, m, b).items()}
            assert sized(ISO_2013, grade, d, m, b) == expected


@pytest.mark.parametrize(("value", "expected"), [
    (4.04, 4.0), (4.06, 4.1), (4.96, 5.0), (5.24, 5.0), (5.26, 5.5), (9.74, 9.5), (9.76, 10.0), (10.4, 10.0),
    (10.6, 11.0), (0.83, 0.8)])
def test_rounding(value: float, expected: float):
    assert rounded(value) == expected


def test_one_grade_for_each_wheel():
    both = tolerances(Quality(ISO_1995, (5, 7)), ISO_TR_EXAMPLE_1)
    assert both == (
        tolerances(Quality(ISO_1995, 5), ISO_TR_EXAMPLE_1)[0], tolerances(Quality(ISO_1995, 7), ISO_TR_EXAMPLE_1)[1])
    assert Quality(ISO_1995, (5, 7)).coarsest == 7 and Quality(ISO_1995, [5, 7]).grades == (5, 7)


@pytest.mark.parametrize(("standard", "grade", "rule"), [
    (ISO_1995, 13, "from 0 to 12 in ISO 1328-1:1995"), (ISO_1995, -1, "from 0 to 12"), (ISO_2013, 0, "from 1 to 11"),
    (ISO_2013, 12, "from 1 to 11 in ISO 1328-1:2013"), (ISO_1995, 5.0, "a whole number"), (ISO_1995, True, "a whole"),
    (ISO_1995, (5, 13), "from 0 to 12"), (ISO_1995, (5, 6, 7), "one grade or a list"), (ISO_1995, "5", "a whole"),
    # a letter belongs to its standard
    ("JIS B 1702-1:1998", "A8", "a whole"), (ISO_1995, "N8", "a whole")])
def test_wrong_grades_are_refused(standard: str, grade, rule: str):
    with pytest.raises(InputError, match=rf"quality\.grade must .*{rule}") as error:
        Quality(standard, grade)
    assert error.value.field == "quality.grade"


@pytest.mark.parametrize(("standard", "changes", "field"), [
    (ISO_1995, {"normal_module": 0.499e-3}, "module"), (ISO_1995, {"normal_module": 70.01e-3}, "module"),
    (ISO_2013, {"normal_module": 0.499e-3}, "module"), (ISO_2013, {"normal_module": 70.01e-3}, "module"),
    (ISO_1995, {"teeth": (62, 4), "normal_module": 1e-3}, "reference_diameter[1]"),
    (ISO_1995, {"normal_module": 0.0400001, "teeth": (62, 250)}, "reference_diameter[1]"),
    (ISO_2013, {"normal_module": 0.0600001, "teeth": (62, 250)}, "reference_diameter[1]"),
    (ISO_1995, {"face_width": (0.0039, 0.02)}, "face_width[0]"),
    (ISO_1995, {"face_width": (0.02, 1.0001)}, "face_width[1]"),
    (ISO_2013, {"face_width": (0.02, 1.2001)}, "face_width[1]"),
    (ISO_2013, {"teeth": (4, 62)}, "teeth[0]"), (ISO_2013, {"teeth": (62, 1001)}, "teeth[1]"),
    (ISO_2013, {"helix_angle": math.radians(46)}, "helix_angle")])
def test_sizes_outside_the_scope_are_refused(standard: str, changes: dict, field: str):
    with pytest.raises(InputError, match="must lie in") as error:
        tolerances(Quality(standard, 5), spur(**changes))
    assert error.value.field == field and "extrapolation" in error.value.advice


@pytest.mark.parametrize(("standard", "width", "module"), [(ISO_1995, 1.0, 0.04), (ISO_2013, 1.2, 0.06)])
def test_sizes_on_the_limits_of_the_scope_are_accepted(standard, width, module):
    for changes in ({"normal_module": 70e-3}, {"normal_module": 0.5e-3, "teeth": (10, 1000)}):
        tolerances(Quality(standard, 5), spur(face_width=(0.004, width), **changes))
    tolerances(Quality(standard, 5), spur(normal_module=module, teeth=(62, 250)))


@pytest.mark.parametrize(("standard", "grade", "expected"), [
    ("JIS B 1702-1:1998", "N8", Quality(ISO_1995, 8)), ("JIS B 1702-1:1998", 8, Quality(ISO_1995, 8)),
    ("JIS B 1702-1:1998", ["N5", "N7"], Quality(ISO_1995, (5, 7))),
    ("ANSI/AGMA ISO 1328-1-B14", "A6", Quality(ISO_2013, 6))])
def test_a_national_standard_that_is_the_text_of_an_edition_is_read_as_it(standard, grade, expected):
    assert Quality(standard, grade) == expected


@pytest.mark.parametrize(("standard", "grade", "nearest", "why"), [
    ("DIN 3962", 6, "'ISO 1328-1:1995', grade = 6 }", "tables of its own"),
    ("DIN 3961:1978", [6, 7], "'ISO 1328-1:1995', grade = [6, 7] }", "ranges of sizes"),
    ("AGMA 2000-A88", "Q10", "'ISO 1328-1:1995', grade = 7 }", "17 less the quality number"),
    ("ANSI/AGMA 2015-1-A01", "A6", "'ISO 1328-1:1995', grade = 6 }", "not identical"),
    ("JIS B 1702:1976", 4, "'ISO 1328-1:1995', grade = 8 }", "plus 4"),
    ("AGMA 2000", "Q3", "ISO 1328-1:1995 has no grade near it, only 0 to 12", "17 less the quality number"),
    ("JIS B 1702", 9, "no grade near it", "plus 4"), ("JIS B 1702", 8, "grade = 12 }", "plus 4"),
    ("JIS B 1702-1:2016", "N5", "'ISO 1328-1:2013', grade = 5 }", "could not be compared"), ("ISO 1328", 5, "", "")])
def test_a_grade_of_another_standard_is_refused_with_the_nearest_one(standard, grade, nearest, why):
    with pytest.raises(InputError, match=r"^quality\.standard must be one of .*ISO 1328-1:1995, .*:2013") as error:
        Quality(standard, grade)
    assert nearest in error.value.advice and why in error.value.advice and error.value.value == standard
