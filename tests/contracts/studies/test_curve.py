"""`gearchaos.curve` and the commands for curves: variables, units, files, JSON, bad input, pictures."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest

import gearchaos as gc
from gearchaos import plot
from gearchaos.errors import InputError
from tests import ONE_SPRING
from tests.branches import PAIR
from tests.commands import ask, run_json
from tests.event_curves import FULL, SINGLE, axes, folds

SET = ["--set", "kind=single", "--set", "zeta=0.025", "--set", "q0=0.1", "--set", "eps1=0.05", "--set", "omega=1.0"]
SPUR = ONE_SPRING
PLANE = ["--axis", "omega=0.5:1.2", "--axis", "eps1=0.02:0.08"]
FOLD = ["--event", "fold", "--period", "1", *PLANE]


def test_a_curve_has_the_variables_that_its_docstring_names():
    ds = folds()
    assert set(ds.coords) == {"omega", "eps1"} and ds["omega"].dims == ("point",)
    assert ds["section_z"].dims == ("point", "cycle") and ds["multipliers_real"].dims == ("point", "exponent")
    assert ds["special_omega"].dims == ds["special_kind"].dims == ("special",)
    assert np.abs(ds["multipliers_real"] - 1).min("exponent").max() < 1e-6 and ds["residual"].max() < 1e-10
    assert (ds.attrs["event"], ds.attrs["period"], ds.attrs["boundary"]) == ("fold", 1, 0)
    assert json.loads(ds.attrs["closed"]) is False and ds.attrs["study"] == "curve"
    for end in json.loads(ds.attrs["ends"]):
        assert set(end) == {"omega", "eps1", "why"} and end["why"] == "end of the axis"
        assert end["eps1"] in (0.02, 0.08), "exactly on the bound"


def test_a_neimark_sacker_curve_has_angles():
    ds = gc.curve(FULL, "neimark-sacker", "eps1=0.01:0.06", "omega=1:1.1", period=1)
    assert ds["angle"].attrs["units"] == "rad" and "angle" not in folds()
    assert ((ds["angle"] > 0) & (ds["angle"] < np.pi)).all()


def test_longest_step_and_number_of_points():
    short, cut = (gc.curve(SINGLE, "fold", "omega=0.5:1.2", "eps1=0.02:0.08", period=1, **option) for option in (
        {"longest_step": 0.005}, {"max_points": 3}))
    assert short.sizes["point"] > 3 * folds().sizes["point"]
    assert cut.sizes["point"] == 7 and "point limit" in cut.attrs["ends"]


@pytest.mark.parametrize(("changes", "words"), [
    ({"event": "hopf"}, "must be one of flip, fold, graze, neimark-sacker"),
    ({"event": "neimark-sacker"}, "The branch of period 1 has these: fold."),
    ({"event": "neimark-sacker", "x": "omega=0.99:1.01"}, "has these: none. With the axes exchanged"),
    ({"y": "eps1=0.1:0.2"}, "must contain the model's own value"),
    ({"y": "omega=0.5:2"}, "must be two different parameters"), ({"y": "z=0.5:2"}, "give it as start"),
    ({"y": "kappa=0.5:2"}, "kappa"), ({"x": "omega"}, "must read name=start:stop"), ({"period": 0}, "from 1 to 1024"),
    ({"start": {"w": 1.0}}, "start"), ({"longest_step": 0}, "longest_step must lie in"),
    ({"max_points": 1}, "max_points"),
])
def test_bad_input_of_a_curve(changes, words):
    with pytest.raises(InputError, match=re.escape(words)):
        gc.curve(SINGLE, **{"event": "fold", "x": "omega=0.5:1.2", "y": "eps1=0.02:0.08", "period": 1, **changes})


def test_the_command_writes_a_curve_that_begins_again_from_a_point_of_it(tmp_path):
    out, picture = tmp_path / "curve.nc", tmp_path / "curve.png"
    document, ds = run_json("curve", *SET, *FOLD, "--out", out, "--plot", picture), folds()
    assert list(document) == ["points", "codimension2", "ends"]
    assert document["points"] == [{"omega": a, "eps1": b} for a, b in zip(
        ds["omega"].values.tolist(), ds["eps1"].values.tolist(), strict=True)]
    assert document["codimension2"] == [] and document["ends"] == json.loads(ds.attrs["ends"])
    assert picture.stat().st_size > 1000
    at = gc.load(out).isel(point=10)
    starts = [f"--start={n[8:]}={float(at[n][0])!r}" for n in at.data_vars if n.startswith("section_")]
    sets = [*SET, "--set", f"omega={float(at['omega'])!r}", "--set", f"eps1={float(at['eps1'])!r}"]
    assert "end of the axis" in ask("curve", *sets, *FOLD, *starts, "--out", out, code=0).stdout
    assert {round(end["omega"], 9) for end in json.loads(gc.load(out).attrs["ends"])} == {
        round(end["omega"], 9) for end in document["ends"]}


def test_the_json_of_points_of_codimension_2():
    plane = ["--axis", "eps1=0.02:0.07", "--axis", "omega=1.0:1.2"]
    model = ["--set", "kind=full", "--set", "kappa=0.5", "--set", "omega=1.05", "--set", "eps1=0.03"]
    found = run_json("curve", *model, "--event", "neimark-sacker", "--period", 1, *plane)["codimension2"]
    assert {special["kind"] for special in found} == {"1:4 resonance"} and set(found[0]) == {"kind", "eps1", "omega"}


@pytest.mark.parametrize(("arguments", "words"), [
    (["curve", "--event", "fold", "--axis", "omega=1:2"], "--axis must be given twice"),
    (["curve", *PLANE], "event must be one of"),
    (["curve", "--event", "fold", *PLANE, "--start", "z"], "must read NAME=VALUE"),
    (["curve", "--event", "fold", *PLANE, "--out", "curve.txt"], "must end in"),
    (["skeleton", "--out", "s.nc", "--axis", "omega=1:2"], "--axis must be given twice"),
    (["skeleton", "--out", "s.nc", "--axis", "omega=1:2:0", "--axis", "eps1=0:0.1"], "from 1 to"),
    (["skeleton", "--out", "s.nc", *PLANE, "--period", "0"], "period"),
    (["skeleton", "--out", "s.nc", *PLANE, "--workers", "0"], "workers"),
])
def test_bad_input_of_the_commands(arguments, words):
    assert words in " ".join(ask(*arguments, code=2).stderr.split())


def test_a_picture_of_one_curve_marks_its_points_of_codimension_2():
    ds = gc.curve(FULL, "neimark-sacker", "eps1=0.01:0.07", "omega=1:1.2", period=1)
    ax = plot.skeleton(ds, ax=axes(), special=True)
    assert plot.result(ds).axes[0].lines
    np.testing.assert_array_equal(ax.lines[0].get_xdata(), ds["eps1"])
    np.testing.assert_array_equal(ax.lines[1].get_xdata(), ds["special_eps1"])


@pytest.mark.slow
def test_curves_of_gears_in_physical_units():
    ds = gc.curve(PAIR, "fold", "speed=3000:30000", "zeta=0.02:0.1", period=1)
    scaled = gc.physical(ds)
    assert scaled["section_x1"].attrs["units"] == "µm"
    np.testing.assert_array_equal(scaled["speed"], ds["speed"])
    scaled = gc.physical(folds(), PAIR)
    factor = float(scaled["omega"][0] / folds()["omega"][0])
    assert scaled["omega"].attrs["units"] == "Hz" and factor != 1
    ends, own = (json.loads(d.attrs["ends"]) for d in (scaled, folds()))
    assert ends[0]["omega"] == pytest.approx(factor * own[0]["omega"], rel=1e-12)
    ax = plot.skeleton(scaled, ax=axes())
    assert ax.get_xlim() == pytest.approx((0.5 * factor, 1.2 * factor)) and "Hz" in ax.get_xlabel()


@pytest.mark.parametrize("y", ["beta1=0.001:0.05", "J1=1.5:3"])
def test_a_curve_may_need_more_coordinates_than_its_start(y):
    ds = gc.curve(gc.MeshModel.of(omega=0.7, q0=0.1, eps1=0.05), "fold", "omega=0.5:1", y, period=1, max_points=40)
    assert ds.sizes["exponent"] == 3 and np.abs(ds["multipliers_real"].values - 1).min(axis=1).max() < 1e-5


@pytest.mark.slow
def test_curves_over_torque_without_points_of_codimension_2_in_physical_units(tmp_path):
    """The unit of length of this design depends on the torque."""
    out = tmp_path / "fold.nc"
    document = run_json("curve", SPUR, "--set", "speed=2000", "--set", "damping_law=always", "--event", "fold",
                        "--axis", "speed=1500:3000", "--axis", "torque=50:200", "--out", out, "--physical")
    assert document["units"] == {"speed": "rpm", "torque": "N*m"}
    scaled = gc.load(out)
    assert document["codimension2"] == [] and scaled.sizes["special"] == 0
    assert scaled["section_x1"].attrs["units"] == "µm" and scaled["torque"].attrs["units"] == "N*m"
    ask("plot", out, "--physical", "--out", tmp_path / "fold.png", code=0)
