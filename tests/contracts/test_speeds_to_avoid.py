"""Which speeds to avoid: the ranges from made-up results counted by hand, and the command that prints them."""

import json
import math
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import gearchaos as gc
from gearchaos.cli import app
from gearchaos.errors import InputError
from gearchaos.studies.speeds_to_avoid import (
    CRITERION,
    FORCE_CRITERION,
    MOST_PEAKS,
    Peak,
    RangeToAvoid,
    SpeedRange,
    all_speeds,
)
from gearchaos.studyfile import load_design

SPUR = Path(__file__).parents[2] / "examples" / "spur_50_50.toml"


def run(*arguments, code=0):
    result = CliRunner().invoke(app, [str(a) for a in arguments])
    assert result.exit_code == code, result.stderr
    return result


def made_up(contact, factor):
    speed = 100.0 * np.arange(1, len(contact) + 1)
    return xr.Dataset({"contact": ("speed", np.array(contact, np.int8)), "dynamic_factor": ("speed", factor)},
                      coords={"speed": speed})


def test_ranges_are_runs_of_speeds_with_separation():
    found = gc.speeds_to_avoid(made_up([0, 1, 2, 1, 0, 0, 1, 3], [9.0, 2.0, 4.0, 3.0, 9.0, 1.0, 5.0, np.nan]))
    assert found == (RangeToAvoid(200.0, 400.0, 4.0, 300.0, peaks=(Peak(300.0, 4.0),)),
                     RangeToAvoid(700.0, 800.0, 5.0, 700.0, to_scan_end=True, peaks=(Peak(700.0, 5.0),)))
    assert gc.speeds_to_avoid(made_up([0, 0], [1.0, 1.0])) == ()
    assert gc.speeds_to_avoid(made_up([1, 1], [1.5, 1.0])) == (
        RangeToAvoid(100.0, 200.0, 1.5, 100.0, from_scan_start=True, to_scan_end=True),)
    (diverged,) = gc.speeds_to_avoid(made_up([0, 3], [1.0, np.nan]))
    assert diverged.start == 200.0 and math.isnan(diverged.dynamic_factor) and math.isnan(diverged.speed_of_largest)
    assert all_speeds(made_up([0, 1, 0], [3.0, 2.0, 1.0])) == SpeedRange(100.0, 300.0, 3.0, 100.0)


def test_the_largest_local_peaks_of_a_range_are_listed_in_rising_order_of_speed():
    factor = [9.0, 1.0, 3.0, 3.0, 1.0, 8.0, 1.0, 4.0, 1.0, 5.0, np.nan, 6.0, 1.0, 2.0, 1.0, 7.0]
    (one,) = gc.speeds_to_avoid(made_up([1] * 16, factor))
    assert MOST_PEAKS == 5 and [p.speed for p in one.peaks] == [300.0, 600.0, 800.0, 1000.0, 1200.0]
    assert [p.dynamic_factor for p in one.peaks] == [3.0, 8.0, 4.0, 5.0, 6.0]
    only = gc.speeds_to_avoid(made_up([0, 1, 0], [3.0, 2.0, 1.0]))
    assert only[0].peaks == () and not only[0].from_scan_start and not only[0].to_scan_end


def test_high_forces_in_contact_are_ranges_of_their_own():
    data = made_up([0, 0, 1, 0, 0, 3], [2.0, 1.0, 3.0, 1.6, 1.5, np.nan])
    found = gc.speeds_to_avoid(data, factor=1.5)
    assert [(r.start, r.stop, r.criterion) for r in found] == [
        (100.0, 100.0, FORCE_CRITERION), (300.0, 300.0, CRITERION), (400.0, 400.0, FORCE_CRITERION),
        (600.0, 600.0, CRITERION)]
    assert gc.speeds_to_avoid(data) == tuple(r for r in found if r.criterion == CRITERION)
    with pytest.raises(InputError, match=r"^factor must be greater than 0"):
        gc.speeds_to_avoid(data, factor=0)


def test_without_separation_the_dynamic_factor_alone_narrows_the_ranges():
    data = made_up([0, 0, 1, 1, 0, 3], [2.0, 1.0, 3.0, 1.2, 1.5, np.nan])
    found = gc.speeds_to_avoid(data, factor=1.5, separation=False)
    assert [(r.start, r.stop) for r in found] == [(100.0, 100.0), (300.0, 300.0), (600.0, 600.0)]
    assert {r.criterion for r in found} == {FORCE_CRITERION}
    (pair,) = gc.speeds_to_avoid(made_up([0, 1, 0, 0], [1.0, 3.0, 2.0, 1.0]), factor=1.5, separation=False)
    assert (pair.words, found[0].words) == ("200 to 300 rpm", "near 100 rpm")
    with pytest.raises(InputError, match=r"^factor must be given with separation=False"):
        gc.speeds_to_avoid(data, separation=False)


def test_the_command_narrows_the_ranges_to_those_by_the_factor_alone(factors):
    options = ("--speed", "1000:3000:9", "--torque", "300", "--factor", "3", "--factor-alone")
    found = json.loads(run("gear", SPUR, *options, "--json").stdout)["speeds_to_avoid"]
    ranges = gc.speeds_to_avoid(factors, 3, separation=False)
    assert found["criterion"] == "the dynamic factor exceeds 3" and len(ranges) > 0
    assert found["ranges"] == json.loads(json.dumps([asdict(each) for each in ranges]))
    text = " ".join(run("gear", SPUR, *options).stdout.split())
    assert "Speeds to avoid at 300 N m: the dynamic factor exceeds 3" in text
    assert ("near" in text) == any(each.start == each.stop for each in ranges)


@pytest.mark.parametrize("dataset", [3, xr.Dataset(), made_up([0], [1.0]).expand_dims("torque"),
                                     made_up([0], [1.0]).drop_vars("contact")])
def test_what_is_not_over_the_speed_alone_is_refused(dataset):
    with pytest.raises(InputError, match=r"^dataset must have contact and dynamic_factor over the speed alone"):
        gc.speeds_to_avoid(dataset)


@pytest.fixture(scope="module")
def factors():
    return gc.dynamic_factor(load_design(SPUR), "1000:3000:9", torque=300)


def test_the_command_prints_the_ranges_of_python(factors, tmp_path):
    picture = tmp_path / "k.svg"
    options = ("--speed", "1000:3000:9", "--torque", "300 N*m", "--plot", picture)
    found = json.loads(run("gear", SPUR, *options, "--json").stdout)["speeds_to_avoid"]
    ranges = gc.speeds_to_avoid(factors)
    assert ranges and found["ranges"] == json.loads(json.dumps([asdict(each) for each in ranges]))
    assert found["along_speed"]["Kv_AGMA"] == factors["Kv_AGMA"].values.tolist()
    assert found["transmission_error"].startswith("ISO 1328-1:1995, grade 6: assumption")
    assert found["criterion"] == CRITERION == "the teeth separate" and found["torque"] == 300.0
    assert found["computed"]["count"] == 9 and found["computed"]["stop"] == 3000.0
    assert "</svg>" in picture.read_text(encoding="utf-8")
    text = " ".join(run("gear", SPUR, "--speed", "1000:3000:9", "--torque", "300").stdout.split())
    assert f"Speeds to avoid at 300 N m: {CRITERION}" in text and "at 9 speeds from 1000 to 3000 rpm" in text
    assert f"{ranges[0].dynamic_factor:.6g}" in text and "the end of the scan" in text and "K_v AGMA" in text
    assert "gearchaos attractors" in text and "No transmission error" not in text


def test_a_limit_of_the_dynamic_factor():
    options = ("--speed", "8000:9000:2", "--torque", "400", "--factor", "1.001", "--set",
               "design.transmission_error=none")
    found = json.loads(run("gear", SPUR, *options, "--json").stdout)["speeds_to_avoid"]
    assert found["criterion"] == "the teeth separate, or the dynamic factor exceeds 1.001"
    assert [r["criterion"] for r in found["ranges"]] == [FORCE_CRITERION]
    text = " ".join(run("gear", SPUR, *options).stdout.split())
    assert FORCE_CRITERION in text and "No transmission error was assumed" in text


def test_no_speed_to_avoid(tmp_path):
    options = ("--speed", "8000:9000:2", "--torque", "400", "--set", "design.transmission_error=none")
    found = json.loads(run("gear", SPUR, *options, "--json").stdout)["speeds_to_avoid"]
    assert found["ranges"] == [] and found["computed"]["dynamic_factor"] >= 1
    assert "none" in run("gear", SPUR, *options).stdout


def test_the_torque_of_the_command_is_that_of_the_datasheet():
    by_option, by_set = (json.loads(run("gear", SPUR, *options, "--json").stdout) for options in (
        ("--set", "torque=3", "--set", "operation.torque=4", "--torque", "250 N*m"), ("--set", "torque=250")))
    assert by_option == by_set and by_option["speeds_to_avoid"] is None


@pytest.mark.parametrize(("arguments", "message"), [
    (("--plot", "x.png"), "--plot needs --speed"), (("--plot", "x.html", "--speed", "1:2:2"), "--plot must end in"),
    (("--factor", "2"), "--factor needs --speed"), (("--speed", "1:2:2", "--factor", "0"), "--factor must be greater"),
    (("--speed", "1:2:2", "--factor-alone"), "--factor-alone needs --factor"),
    (("--speed", "500:8000"), "--speed must read start:stop:count; got '500:8000'. E.g. 500:8000:200."),
    (("--speed", "0:9:3"), "speed must be greater than 0"), (("--speed", "9:8:3"), "axis speed must run from"),
    (("--speed", "1:2:2", "--torque", "0"), "torque must be greater than 0"),
    (("--torque", ""), "torque must be a torque"), (("--torque", "400 mm"), "torque must be a torque"),
    (("--torque", "x=3"), "torque must be a torque"),
])
def test_bad_input_is_refused(arguments, message):
    result = run("gear", SPUR, *arguments, code=2)
    assert result.stderr.startswith(f"error: {message}") and result.stdout == ""


def test_the_torque_must_be_known(tmp_path):
    path = tmp_path / "drawing.toml"
    path.write_text(SPUR.read_text().partition("[operation]")[0])
    assert "error: torque must be given" in run("gear", path, "--speed", "1000:2000:2", code=2).stderr
    assert run("gear", path, "--speed", "1000:2000:2", "--torque", "100").exit_code == 0


def test_speeds_that_were_not_computed_are_no_safe_speeds():
    found = gc.dynamic_factor(load_design(SPUR).at(torque=400.0), "speed=3000:4000:3")
    contact = found.contact.copy(data=[1, -1, 1])
    with pytest.raises(InputError, match=r"dataset must be computed at all its speeds; got '1 of 3"):
        gc.speeds_to_avoid(found.assign(contact=contact))
