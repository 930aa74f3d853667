"""Texts with units: usual spellings are read, and what could be read in two ways is refused."""

import json
import math
import pickle
from dataclasses import replace

import pytest

from gearchaos.errors import InputError
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.io import units

SMALL = {"teeth": (20, 40), "module": 3e-3, "face_width": 0.03}


@pytest.mark.parametrize(("text", "dimension", "number"), [
    *((text, units.SPEED, 360) for text in (
        "360 rpm", "360rpm", "360 1/min", "360/min", "360 1 / min", "360 min^-1", "360 min-1", "360 min**-1",
        "360 min⁻¹", "360 rev/min", "360 r/min", "360 U/min", "6 turn/s", "6 rev/s", "6 r/s", "360 RPM", "2160 deg/s",
        "360 revolution/minute")),
    # without a sign of multiplication
    *((text, units.TORQUE, 400) for text in ("400Nm", "400 Nm", "400 N m", "0.4 kNm", "400 N·m", "400 N-m")),
    ("5 Nmm", units.TORQUE, 5e-3), ("5 Ncm", units.TORQUE, 5e-2), ("5 mNm", units.TORQUE, 5e-3),
    ("5 daNm", units.TORQUE, 50), ("1 N*m/rad", units.TORQUE, 1), ("5 m^2 kg s^-2", units.TORQUE, 5),
    *((text, units.BEARING_FRICTION, 2) for text in ("2 Nms", "2 Nm*s/rad", "2 Nms/rad")),
    *((text, units.INERTIA, 4) for text in ("4 kg m^2", "4 kgm^2", "4 kgm²")), ("4 kgcm**2", units.INERTIA, 4e-4),
    ("20mm", units.LENGTH, 0.02), ("3e1mm", units.LENGTH, 0.03), ("2 N*m^(-1)", units.STIFFNESS, 2),
    # of drawings
    *((text, units.TORQUE, 500 * 0.45359237 * 9.80665 * 0.0254) for text in (
        "500 lb-in", "500 lbf*in", "500 in-lb", "500 lbf in", "500 in·lbf", "500 lb.in", "500lbs in", "500 in-lbf")),
    *((text, units.TORQUE, 40 * 0.45359237 * 9.80665 * 0.3048) for text in ("40 ft-lb", "40 lbf-ft", "40 lb ft")),
    ("16 oz-in", units.TORQUE, 0.45359237 * 9.80665 * 0.0254), ("3 kgf·m", units.TORQUE, 3 * 9.80665),
    ("1/8 in", units.LENGTH, 0.0254 / 8), ("3 1/2 in", units.LENGTH, 3.5 * 0.0254),
    ("3-1/2\"", units.LENGTH, 3.5 * 0.0254), ("0.004\"", units.LENGTH, 0.004 * 0.0254),
    ("-1/4 in", units.LENGTH, -0.00635), ("2 thou", units.LENGTH, 2e-3 * 0.0254),
    ("12 ′", units.ANGLE, math.radians(0.2)), ("36\"", units.ANGLE, math.radians(0.01)),
    ("20º", units.ANGLE, math.radians(20)), ("15°48.5'", units.ANGLE, math.radians(15 + 48.5 / 60)),
    ("2 mil", units.LENGTH, 2e-3 * 0.0254), ("5 lb/in", units.STIFFNESS, 5 * 0.45359237 * 9.80665 / 0.0254),
    ("15 gon", units.ANGLE, math.radians(13.5)), ("15°48'", units.ANGLE, math.radians(15.8)),
    ("-15 deg 47 arcmin 60 arcsec", units.ANGLE, -math.radians(15.8)),
    ("15° 47′ 60″", units.ANGLE, math.radians(15.8)), ("7.2°", units.ANGLE, math.radians(7.2)),
    *((text, units.DIAMETRAL_PITCH, 8) for text in ("8 1/in", "8/in", "8 in^-1", 8, "8 DP", "8")),
])
def test_spellings_of_units(text, dimension, number):
    assert units.to_si("x", text, dimension) == pytest.approx(number, rel=1e-14)


@pytest.mark.parametrize(("text", "dimension", "words"), [
    ("500 lb-mm", units.TORQUE, "The unit 'lb-mm' is not known."), ("3 mm)", units.LENGTH, "The unit 'mm)' is not"),
    ("3 furlongz", units.LENGTH, "The unit 'furlongz' is not known."), ("1/8/2 in", units.LENGTH, "unit '/2 in' is"),
    ("3 kg", units.LENGTH, "The unit 'kg' is no unit of a length."), ("1/0 in", units.LENGTH, "The unit '/0 in' is"),
    ("mm", units.LENGTH, "It is not a number followed by a unit."), ("3", units.LENGTH, "It is not a number followed"),
    ("8 mm", units.DIAMETRAL_PITCH, "The unit 'mm' is no unit of a diametral pitch. Write e.g. '8 1/in'"),
    *((f"3 {unit}", units.LENGTH, "is not known.") for unit in (
        "mm**9**9**9", "km**999999999", "km⁹⁹⁹⁹⁹⁹⁹⁹⁹", "mm*9^9^9", "mm*(9**9)**9", "m" + "*m" * 30)),
    *((f"15 {unit}", units.ANGLE, "Write deg or gon: the unit may be either.") for unit in ("grad", "Grad", "GRAD")),
    ("15 grad/s", units.SPEED, "Write deg or gon: the unit may be"), ("15 mm", units.ANGLE, "is no unit of an angle."),
    ("157 rad/s", units.FREQUENCY, "A speed, in rpm or rad/s, is `speed`."), ("25 Hz", units.SPEED, "write rpm, or"),
    *((text, units.SPEED, "turns or radians are meant") for text in ("60 Hz", "60 1/s", "60/s", "60 s^-1")),
    *((text, units.ANGLE, "must be an angle") for text in ("20 %", "0.3", "20 deg^2", "5 deg*rad")),
    ("100 N*m/deg", units.TORQUE, "must be a torque"), ("50 deg*rpm", units.SPEED, "must be an angular velocity"),
    ("2 \"'", units.LENGTH, "is not known."), ("25 rpm", units.FREQUENCY, "units of angles that do not belong"),
])
def test_what_is_no_unit_is_refused_in_words(text, dimension, words):
    with pytest.raises(InputError) as refusal:
        units.to_si("x", text, dimension)
    assert words in str(refusal.value) and not any(w in str(refusal.value) for w in ("pint", "registry", "[length]"))


def test_a_diametral_pitch_takes_the_place_of_the_module():
    given = {"teeth": (20, 40), "face_width": "1 1/4 in"}
    design = GearDesign(**given, diametral_pitch=8)
    assert design.module == pytest.approx(3.175e-3, rel=1e-15) and design.face_width[0] == pytest.approx(31.75e-3)
    assert design == GearDesign(**given, diametral_pitch="8 1/in")
    assert design == GearDesign.from_tables({**given, "diametral_pitch": 8})
    assert replace(design, torque=1.0).module == design.module


@pytest.mark.parametrize(("key", "text", "rpm"), [
    ("shaft_frequency", "25 Hz", 1500), ("shaft_frequency", 25, 1500), ("mesh_frequency", "500 Hz", 1500),
    ("mesh_frequency", "0.5 kHz", 1500), ("mesh_frequency", "30000 1/min", 1500),
])
def test_a_frequency_of_the_shaft_or_of_the_mesh_is_a_speed(key, text, rpm):
    tables = {"teeth": [20, 40], "module": "3 mm", "face_width": "30 mm"}
    assert GearDesign.from_tables(tables, {key: text}).speed == pytest.approx(rpm, rel=1e-14)
    with pytest.raises(InputError, match=f"{key} must be left out beside speed"):
        GearDesign.from_tables(tables, {key: text, "speed": "3 rpm"})
    with pytest.raises(InputError, match=f"{key} must be greater than 0; got '0 Hz'"):
        GearDesign.from_tables(tables, {key: "0 Hz"})


@pytest.mark.parametrize(("changes", "words"), [
    ({"helix_angle": "70 deg"}, "helix_angle must lie between 0 and 60 deg; got 70 deg."),
    ({"helix_angle": "-70°"}, "between 0 and 60 °; got 70 °."),
    ({"helix_angle": 1.2}, "between 0 and 1.047 rad; got 1.2."),
    ({"pressure_angle": 20}, "between 0.08727 and 0.7854 rad; got 20. Did you mean '20 deg'? A plain number is"),
    ({"module": "5 in"}, "module must lie between 0.0003937 and 3.937 in; got 5 in."),
    ({"bore": "2.3 in"}, "got 2.3 in. It leaves"),
    ({"speed": "150000 rpm"}, "below 300 m/s; got 150000 rpm. It gives 471.2 m/s."),
    ({"speed": 150000}, "below 300 m/s; got 150000. It gives 471.2 m/s. A speed without a unit is in rpm."),
    ({"material": {"E": "5 TPa", "poisson": 0.3, "density": "8 g/cm^3"}}, "between 1e-05 and 1.2 TPa; got 5 TPa."),
    ({"supports": {"stiffness": "1e-6 N/um", "damping_ratio": 0.1}}, "between 0.01 and 1e+07 N/um; got 1e-06 N/um."),
    ({"tip_alteration": "-0.01 in", "tip_diameter": [0.066, 0.126]}, "got (-0.01 in, -0.01 in)."),
    ({"helix_angle": "15 deg", "stiffness": "potential energy"}, "got 15 deg."),
    ({"teeth": [8, 40], "module": None, "diametral_pitch": 8, "profile_shift": [0.9, 0]},
     "tip_thickness[0] must be greater than 0; got -0.054"),
])
def test_limits_and_values_are_in_the_unit_of_the_input(changes, words):
    with pytest.raises(InputError) as refusal:
        _ = GearDesign(**{**SMALL, "bore": "10 mm", **changes}).mesh_stiffness
    assert words in str(refusal.value) and str(pickle.loads(pickle.dumps(refusal.value))) == str(refusal.value)


def test_a_measured_number_is_a_number():
    number = units.to_si("x", "8 mm", units.LENGTH)
    again = pickle.loads(pickle.dumps(number))
    assert repr(number) == "0.008" and json.dumps({"x": number}) == '{"x": 0.008}'
    assert again == number and (again.unit, again.size) == ("mm", 1e-3) and type(number * 1) is float


@pytest.mark.parametrize(("text", "advice"), [
    ("3,0 mm", "Write '3.0 mm'."), ("-3,5mm", "Write '-3.5mm'."), (",5 mm", "Write '0.5 mm'."), ("3,5", "Write '3.5'."),
    ("1.234,5 mm", "Write '1234.5 mm'."), ("1,234.5 mm", "Write '1234.5 mm'."),
    ("1,250 mm", "Write '1.250 mm', or '1250 mm' if the comma separates thousands."),
])
def test_decimal_commas_are_refused_with_the_number_to_write(text, advice):
    with pytest.raises(InputError, match="must have a decimal point, not a comma") as refusal:
        units.to_si("module", text, units.LENGTH)
    assert refusal.value.advice == advice and refusal.value.value == text
