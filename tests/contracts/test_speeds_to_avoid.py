"""Which speeds to avoid, on the command line: the torque and the options that it takes, and what is refused."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from gearchaos.cli import app

SPUR = Path(__file__).parents[2] / "examples" / "spur_50_50.toml"


def run(*arguments, code=0):
    result = CliRunner().invoke(app, [str(a) for a in arguments])
    assert result.exit_code == code, result.stderr
    return result


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
