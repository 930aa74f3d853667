"""Texts with units: usual spellings are read, and what could be read in two ways is refused."""

import pickle

import pytest

from gearchaos.errors import InputError
from gearchaos.gears import units
from gearchaos.gears.design.gear_design import GearDesign


@pytest.mark.parametrize("text", [
    "360 rpm", "360rpm", "360 1/min", "360/min", "360 1 / min", "360 min^-1", "360 min-1", "360 min**-1", "360 min⁻¹",
    "360 rev/min", "360 r/min", "360 U/min", "6 turn/s",
])
def test_spellings_of_a_speed(text):
    assert units.to_si("speed", text, units.SPEED) == pytest.approx(360, rel=1e-14)


@pytest.mark.parametrize(("text", "dimension", "number"), [
    ("400Nm", units.TORQUE, 400), ("400 Nm", units.TORQUE, 400), ("400 N m", units.TORQUE, 400),
    ("0.4 kNm", units.TORQUE, 400), ("5 Nmm", units.TORQUE, 5e-3), ("5 Ncm", units.TORQUE, 5e-2),
    ("2 Nms", units.BEARING_FRICTION, 2), ("2 Nm*s/rad", units.BEARING_FRICTION, 2),
    ("2 Nms/rad", units.BEARING_FRICTION, 2), ("20mm", units.LENGTH, 0.02), ("3e1mm", units.LENGTH, 0.03),
    ("4 kgm^2", units.INERTIA, 4), ("4 kgm²", units.INERTIA, 4), ("4 kgcm**2", units.INERTIA, 4e-4),
])
def test_units_without_a_sign_of_multiplication(text, dimension, number):
    assert units.to_si("x", text, dimension) == pytest.approx(number, rel=1e-14)


@pytest.mark.parametrize("text", ["60 Hz", "60 1/s", "60/s", "60 s^-1"])
def test_frequencies_without_turns_or_radians_are_refused(text):
    with pytest.raises(InputError, match="turns or radians are meant"):
        units.to_si("speed", text, units.SPEED)


@pytest.mark.parametrize(("text", "advice"), [
    ("3,0 mm", "Write '3.0 mm'."), ("-3,5mm", "Write '-3.5mm'."), (",5 mm", "Write '0.5 mm'."), ("3,5", "Write '3.5'."),
    ("1,250 mm", "Write '1.250 mm', or '1250 mm' if the comma separates thousands."),
])
def test_decimal_commas_are_refused_with_the_number_to_write(text, advice):
    with pytest.raises(InputError, match="must have a decimal point, not a comma") as refusal:
        units.to_si("module", text, units.LENGTH)
    assert refusal.value.advice == advice and refusal.value.value == text


SMALL = {"teeth": (20, 40), "module": 3e-3, "face_width": 0.03}


def test_messages_about_lengths_are_in_millimetres():
    for changes, words in [
        ({"module": "3 um"}, "between 0.01 and 100 mm; got 0.003 mm."),
        ({"module": 3}, "got 3000 mm. Did you mean '3 mm'? A plain number is in m."),
        ({"centre_distance": "84 mm", "profile_shift": [0, 0]},
         "greater than 84.5723359 mm, the sum of the base radii; got 84 mm."),
        ({"teeth": [8, 40], "profile_shift": [0.9, 0]}, "tip_thickness[0] must be greater than 0; got -1.29749755 mm"),
        ({"tip_alteration": -1e-4, "tip_diameter": [0.066, 0.126]}, "got (-0.1 mm, -0.1 mm)."),
        ({"rack": {"root_radius": 0.47, "addendum": 1.2}}, "form diameter, 56.5245323 mm; got 56.4464157 mm."),
    ]:
        with pytest.raises(InputError) as refusal:
            GearDesign(**{**SMALL, **changes})
        assert words in str(refusal.value) and " m," not in str(refusal.value), str(refusal.value)
        assert "mm" in str(refusal.value)
    with pytest.raises(InputError) as refusal:
        GearDesign(**{**SMALL, "module": "3 um"})
    assert refusal.value.value == 3e-6
    assert str(pickle.loads(pickle.dumps(refusal.value))) == str(refusal.value)
