"""Speeds and torques as they are given to commands and functions: one reader for all."""

import pytest

import gearchaos as gc
from gearchaos.errors import InputError
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.core.operating_ranges import FIRST_SPEEDS, operating_axis, range_of_speeds, torques_of

SPUR = gc.GearDesign(
    teeth=(50, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05, torque=150,
    backlash={"value": "0.12 mm", "of": "line of action, total"}, transmission_error="from quality",
    quality={"standard": "ISO 1328-1:1995", "grade": 6})


@pytest.mark.parametrize("text", [
    "500:6000", "speed=500:6000", " speed = 500 : 6000 ", "500 rpm:6000 rpm", f"500:6000:{FIRST_SPEEDS}"])
def test_a_range_of_speeds_may_leave_out_its_name_its_number_and_its_unit(text):
    assert range_of_speeds(text) == Axis("speed", 500, 6000, FIRST_SPEEDS)


def test_every_reader_of_speeds_takes_a_text_without_the_name():
    assert gc.RunUp(SPUR.at(speed=500), "500:900", 10.0).speed == Axis("speed", 500, 900, 2)
    assert gc.Scatter(SPUR, ["damping_ratio=0.03:0.1"], "500:900:3", samples=32).speed == Axis("speed", 500, 900, 3)
    model = gc.MeshModel.of(kind="single", omega=0.8, q0=0.1)
    assert gc.Scatter(model, ["zeta=0.04:0.06"], "0.7:0.9:3", samples=32).speed == Axis("omega", 0.7, 0.9, 3)


@pytest.mark.parametrize(("given", "torques"), [
    (85, (85,)), ("85", (85,)), ("85 N*m", (85,)), ("0.1,0.2 kN*m", (100, 200)), ("20:60:3", (20, 40, 60)),
    (["300", "100,200 N*m"], (300, 100, 200)), ([300, "0.1 kN*m", "20:40:2"], (300, 100, 20, 40)),
    ("-50,-20", (-50, -20))])
def test_torques_are_numbers_texts_lists_and_ranges(given, torques):
    assert torques_of(given) == torques


@pytest.mark.parametrize(("given", "message"), [
    ("56,5", "--torque must rise from one to the next; got '56,5'. A comma stands"),
    ([60, "0.06 kN*m"], "--torque must be given once; got 60.0"), ("20:60", "--torque must read start:stop:count"),
    ("1:2000:1001", "--torque must be 1 to 1000 values; got 1001"), ([], "--torque must be 1 to 1000 values; got 0"),
    ([float("nan")], "--torque must be a finite number"), ("60 mm", "--torque must be a torque"),
    ([True], "--torque must be a torque"), (None, "--torque must be a torque")])
def test_torques_that_are_wrong_are_named(given, message):
    with pytest.raises(InputError) as error:
        torques_of(given, "--torque")
    assert str(error.value).startswith(message)


@pytest.mark.parametrize(("given", "count", "message"), [
    ("500", 40, "--speed must read start:stop or start:stop:count; got '500'. E.g. 500:8000 or 500:8000:200."),
    ("500:6000", None, "--speed must read start:stop:count; got '500:6000'. E.g. 500:8000:200."),
    (500, None, "--speed must be an Axis or a text"), ("6000:500", 40, "--speed must run from a smaller to a larger"),
    ("omega=1:2", 40, "--speed must be an axis of speed; got 'omega'"), ("500:1 m", 40, "--speed must be an angular"),
    ("5:9:x", 40, "--speed must read name=start:stop:count")])
def test_axes_of_speed_that_are_wrong_are_named(given, count, message):
    with pytest.raises(InputError) as error:
        operating_axis("speed", given, "--speed", count)
    assert str(error.value).startswith(message)
