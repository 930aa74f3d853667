"""The operating point of a design without one, and what the commands that map over two parameters have in common."""

import json
from dataclasses import replace

import pytest
import typer.main

import gearchaos as gc
from gearchaos.cli import app
from gearchaos.errors import InputError
from gearchaos.studies.core.axis import at_axis_starts, parse_axis
from gearchaos.studyfile import load_design, load_study
from tests import EXAMPLES
from tests.commands import ask, refused, run_json

SPUR = EXAMPLES / "spur_50_50.toml"
SHORT = "[classification]\nlongest_transient = 300\nexponent_run = 200\ndoublings = 0\naveraging_periods = 16\n"
AXES = ("speed=1000:3000:2", "torque=200:300:2")


@pytest.fixture
def drawing(tmp_path):
    """The 50/50 pair without [operation]; further text of the study file may be appended."""
    path = tmp_path / "drawing.toml"
    path.write_text(SPUR.read_text().partition("[operation]")[0])
    return path


def axes(*texts):
    return [parse_axis(text) for text in texts]


def test_a_design_without_operating_point_gets_the_first_values_of_the_axes(drawing):
    design = load_design(drawing)
    found = at_axis_starts(design, axes("eps1=0:1:2", *AXES, "speed=7:8:2"))
    assert (found.speed, found.torque) == (1000.0, 200.0)
    assert at_axis_starts(design, axes("speed=1000:2000:2")).torque is None
    assert at_axis_starts(replace(design, torque=50.0), axes(*AXES)).torque == 50.0
    assert at_axis_starts(3, axes(*AXES)) == 3


def test_axes_beside_a_file_come_before_those_of_the_file(drawing):
    with pytest.raises(InputError, match=r"^speed and torque must be given"):
        load_study(drawing)
    with drawing.open("a") as file:
        file.write(f'[study]\nkind = "zones"\nx = "{AXES[0]}"\ny = "{AXES[1]}"\n')
    assert load_study(drawing).model.value("torque") == 200.0
    beside = load_study(drawing, axes=axes("torque=250:300:2")).model
    assert beside.value("torque") == 250.0 and beside.value("speed") == 1000.0
    assert load_study(drawing, {"torque": 90}, axes=axes("torque=250:300:2")).model.value("torque") == 90.0


def test_a_command_and_a_study_fill_in_the_same_operating_point(drawing, tmp_path):
    out = tmp_path / "b.nc"
    ask("bifurcation", drawing, "--set", "torque=150", "--axis", AXES[0], "--points", 0, "--out", out)
    study = gc.Bifurcation(replace(load_design(drawing), torque=150.0), AXES[0], points=0)
    assert json.loads(gc.load(out).attrs["gears"]) == json.loads(study.provenance()["gears"])


def test_the_options_of_zones_and_map_are_the_same():
    group = typer.main.get_command(app)
    first, second = ({p.name: (p.opts, p.help, p.metavar) for p in group.commands[command].params
                      if p.param_type_name == "option"} for command in ("zones", "map"))
    for name in ("starts", "refine", "out", "plot", "json_out"):
        assert first[name] == second[name], name


def test_the_summaries_of_zones_and_map_are_the_same(drawing, tmp_path):
    with drawing.open("a") as file:
        file.write(SHORT)
    out = ("--out", tmp_path / "m.nc")
    mapped = run_json("map", drawing, "--speed", AXES[0][6:], "--torque", AXES[1][7:], *out)
    physical, plain = (run_json("zones", drawing, "--axis", AXES[0], "--axis", AXES[1], *out, *options)
                       for options in (("--physical",), ()))
    assert {**mapped, "study": "zones"} == physical == plain
    assert [axis["units"] for axis in plain["axes"]] == ["rpm", "N*m"] and list(plain)[:4] == [
        "study", "out", "plot", "axes"]


@pytest.mark.parametrize(("command", "options", "message"), [
    ("zones", ("speed=5:3:4", "eps1=0:1:2"), "speed=500:8000:200"),
    ("zones", ("torque=1:2",), "torque=20:400:150"), ("zones", ("omega=1:2",), "omega=0.2:3:400"),
    ("zones", ("q0=1:2:0", "eps1=0:1:2"), "q0=0:0.3:400"), ("basins", ("z_dot=a:2:3",), "z_dot=-3:3:400"),
    ("zones", ("speed=1:2:3",), "--axis speed=500:8000:200 --axis torque=20:400:150"),
    ("bifurcation", (), "--axis speed=500:8000:200"),
    ("basins", (), "--axis z=-3:3:400 --axis z_dot=-3:3:400"), ("zones", ("eps1=0,1:2:3",), "decimal point"),
    ("map", ("--speed", "500:8000"), "E.g. 500:8000:200."), ("map", ("--torque", "20-400"), "E.g. 20:400:150."),
    ("map", ("--torque", "speed=20:400:3"), "E.g. 20:400:150."),
    ("map", ("--torque", "400:400:2"), "one value alone is 400:400:1"),
    ("map", ("--torque", "20:4e2:x"), "torque=20:400:150"), ("map", ("--speed", "500,5:600:3"), "decimal point"),
    ("map", ("--speed", "omega=1:2:3"), "--speed must be an axis of speed"),
    ("map", ("--speed", "600 m:9000 rpm:20"), "--speed must be an angular velocity; got '600 m'"),
    ("map", ("--speed", "10 Hz:20 Hz:3"), "got '10 Hz'")])
def test_the_advice_on_an_axis_is_an_axis_of_that_name(command, options, message, tmp_path):
    if command == "map":
        options = ("--speed", "500:600:2", "--torque", "20:30:2", *options)
    else:
        options = [part for text in options for part in ("--axis", text)]
    assert message in refused(command, SPUR, *options, "--out", tmp_path / "o.nc")


def test_a_map_at_one_torque(drawing, tmp_path):
    with drawing.open("a") as file:
        file.write(SHORT)
    out, picture = tmp_path / "m.nc", tmp_path / "m.png"
    ask("map", drawing, "--speed", "1000:3000:3", "--torque", "400:400:1", "--out", out, "--plot", picture)
    found = gc.load(out)
    assert dict(found.sizes) == {"torque": 1, "speed": 3} and found["torque"].values.tolist() == [400.0]
    assert picture.stat().st_size > 5000
    ask("map", drawing, "--speed", "1000:1000:1", "--torque", "400:400:1", "--refine", 4, "--out", out)
    assert gc.load(out)["label"].size == 1
