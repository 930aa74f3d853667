"""`gearchaos.curve`, `skeleton`, `agreement` and `manifolds`: variables, units, files, JSON, bad input, pictures."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from typer.testing import CliRunner

import gearchaos as gc
from gearchaos import plot
from gearchaos.cli import app
from gearchaos.continuation import skeleton as algorithm
from gearchaos.errors import InputError

SINGLE = gc.MeshModel.of(kind="single", omega=1.0, zeta=0.025, q0=0.1, eps1=0.05)
FULL = gc.MeshModel.of(kind="full", kappa=0.5, omega=1.05, eps1=0.02)
SMALL = gc.MeshModel.of(q0=0.1)
WINDOW = {"x": "omega=1.7:2.3:8", "y": "eps1=0.03:0.09:4"}
SEARCH = {"period": 2, "lines": (1, 1), "starts": 0, "workers": 1}
QUICK = {**SEARCH, "period": 1}
SET = ["--set", "kind=single", "--set", "zeta=0.025", "--set", "q0=0.1", "--set", "eps1=0.05", "--set", "omega=1.0"]
PLANE = ["--axis", "omega=0.5:1.2", "--axis", "eps1=0.02:0.08"]
PAIR = gc.GearPair(
    n1=25, n2=40, I1=4.88e-4, I2=3.2e-3, R1=0.03524, R2=0.05638, c0=4e8, k=530.0, backlash=1.2e-4, M10=85.0,
    speed="14000 rpm", error_amplitudes=["6 um"],
)


@cache
def folds() -> xr.Dataset:
    return gc.curve(SINGLE, "fold", "omega=0.5:1.2", "eps1=0.02:0.08", period=1)


@cache
def small() -> xr.Dataset:
    return gc.skeleton(SMALL, **WINDOW, **SEARCH)


@cache
def quick() -> xr.Dataset:
    return gc.skeleton(SMALL, **WINDOW, **QUICK)


@cache
def zones() -> xr.Dataset:
    return gc.zones(SMALL, "omega=1.7:2.3:12", "eps1=0.03:0.09:8")


@cache
def manifolds() -> xr.Dataset:
    return gc.manifolds(SINGLE.with_values({"omega": 2.3}), period=3, length=4, spacing=0.1)


def axes():
    figure = Figure(layout="constrained")
    FigureCanvasAgg(figure)
    return figure.subplots()


def run(*arguments: object, code: int = 0) -> str:
    done = CliRunner().invoke(app, [str(a) for a in arguments])
    assert done.exit_code == code, done.output
    return done.stderr if code else done.stdout


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


@pytest.mark.parametrize("make", [folds, small, manifolds, lambda: gc.agreement(small(), zones())])
def test_results_can_be_saved(make, tmp_path):
    ds = make()
    gc.save(ds, tmp_path / "file.nc")
    assert gc.load(tmp_path / "file.nc").identical(ds)
    assert all("long_name" in ds[name].attrs for name in ds.data_vars)


def test_longest_step_and_number_of_points():
    short = gc.curve(SINGLE, "fold", "omega=0.5:1.2", "eps1=0.02:0.08", period=1, longest_step=0.005)
    assert short.sizes["point"] > 3 * folds().sizes["point"]
    cut = gc.curve(SINGLE, "fold", "omega=0.5:1.2", "eps1=0.02:0.08", period=1, max_points=3)
    assert cut.sizes["point"] == 7 and "point limit" in cut.attrs["ends"]


@pytest.mark.parametrize(("changes", "words"), [
    ({"event": "hopf"}, "must be one of flip, fold, graze, neimark-sacker"),
    ({"event": "neimark-sacker"}, "The branch of period 1 has these: fold."),
    ({"x": "omega=1.1:2"}, "must contain the model's own value"),
    ({"y": "eps1=0.1:0.2"}, "must contain the model's own value"),
    ({"y": "omega=0.5:2"}, "must be two different parameters"),
    ({"y": "z=0.5:2"}, "give it as start"),
    ({"y": "kappa=0.5:2"}, "kappa"),
    ({"x": "omega"}, "must read name=start:stop"),
    ({"period": 0}, "from 1 to 1024"),
    ({"start": {"w": 1.0}}, "start"),
    ({"longest_step": 0}, "longest_step must lie in"),
    ({"max_points": 1}, "max_points"),
])
def test_bad_input_of_a_curve(changes, words):
    given = {"event": "fold", "x": "omega=0.5:1.2", "y": "eps1=0.02:0.08", "period": 1, **changes}
    with pytest.raises(InputError) as caught:
        gc.curve(SINGLE, **given)
    assert words in str(caught.value)


def test_the_json_of_a_curve():
    document = json.loads(run("curve", *SET, "--event", "fold", "--period", 1, *PLANE, "--json"))
    ds = folds()
    assert list(document) == ["points", "codimension2", "ends"]
    assert document["points"] == [{"omega": a, "eps1": b} for a, b in zip(
        ds["omega"].values.tolist(), ds["eps1"].values.tolist(), strict=True)]
    assert document["codimension2"] == [] and document["ends"] == json.loads(ds.attrs["ends"])


def test_the_json_of_points_of_codimension_2():
    plane = ["--axis", "eps1=0.02:0.07", "--axis", "omega=1.0:1.2"]
    model = ["--set", "kind=full", "--set", "kappa=0.5", "--set", "omega=1.05", "--set", "eps1=0.03"]
    document = json.loads(run("curve", *model, "--event", "neimark-sacker", "--period", 1, *plane, "--json"))
    assert {special["kind"] for special in document["codimension2"]} == {"1:4 resonance"}
    assert set(document["codimension2"][0]) == {"kind", "eps1", "omega"}


def test_a_curve_begins_again_from_a_point_of_its_json(tmp_path):
    out = tmp_path / "curve.nc"
    text = run("curve", *SET, "--event", "fold", "--period", 1, *PLANE, "--out", out, "--plot", tmp_path / "curve.png")
    assert "end of the axis" in text and (tmp_path / "curve.png").stat().st_size > 1000
    at = gc.load(out).isel(point=10)
    starts = [f"--start={n[8:]}={float(at[n][0])!r}" for n in at.data_vars if n.startswith("section_")]
    sets = [*SET, "--set", f"omega={float(at['omega'])!r}", "--set", f"eps1={float(at['eps1'])!r}"]
    again = json.loads(run("curve", *sets, "--event", "fold", "--period", 1, *PLANE, *starts, "--json"))
    assert {round(end["omega"], 9) for end in again["ends"]} == {
        round(end["omega"], 9) for end in json.loads(folds().attrs["ends"])}


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
    assert words in " ".join(run(*arguments, code=2).split())


def test_a_skeleton_has_all_its_curves_one_after_another():
    ds = small()
    numbers = ds["curve"].values
    assert numbers.tolist() == sorted(numbers.tolist()) and set(numbers) == set(range(ds.sizes["number"]))
    assert ds["curve_kind"].dims == ds["curve_period"].dims == ds["curve_closed"].dims == ("number",)
    assert ds["special_curve"].dims == ("special",) and "flip" in ds["curve_kind"].values
    assert {*ds["curve_boundary"].values[ds["curve_kind"].values == "graze"]} <= {1, -1}
    assert {end["curve"] for end in json.loads(ds.attrs["ends"])} <= set(numbers)
    assert np.abs(np.isfinite(ds["section_x1"]).sum("cycle") - ds["curve_period"].values[numbers]).max() == 0


def test_curves_of_a_skeleton_are_those_that_curve_follows():
    ds = small()
    number = int(np.flatnonzero((ds["curve_kind"] == "flip") & (ds["curve_period"] == 1))[0])
    own = ds.isel(point=np.flatnonzero(ds["curve"].values == number))
    middle = own.isel(point=own.sizes["point"] // 2)
    start = {str(n)[8:]: float(middle[n][0]) for n in own.data_vars if str(n).startswith("section_")}
    model = SMALL.with_values({n: float(middle[n]) for n in ("omega", "eps1")})
    found = gc.curve(model, "flip", "omega=1.7:2.3", "eps1=0.03:0.09", period=1, start=start)
    ends = [(e["omega"], e["eps1"]) for e in json.loads(ds.attrs["ends"]) if e["curve"] == number]
    again = [(e["omega"], e["eps1"]) for e in json.loads(found.attrs["ends"])]
    np.testing.assert_allclose(sorted(ends), sorted(again), atol=1e-7)


def test_an_interrupted_skeleton_goes_on_from_its_journal(tmp_path, monkeypatch):
    journal = tmp_path / "s.nc.part"
    assert gc.skeleton(SMALL, **WINDOW, **QUICK, journal=journal).identical(quick())
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join(lines[:-2]) + lines[-2][:100])  # killed while it wrote the last line but one
    followed = []
    monkeypatch.setattr(algorithm, "line_seeds", lambda line: pytest.fail("all lines are finished"))
    follow = algorithm.follow_curve
    monkeypatch.setattr(algorithm, "follow_curve", lambda *a: followed.append(a) or follow(*a))
    assert gc.skeleton(SMALL, **WINDOW, **QUICK, journal=journal).identical(quick())
    assert len(followed) == 2 and journal.read_bytes().splitlines(keepends=True)[:-2] == lines[:-2]


def test_a_journal_of_another_skeleton_is_refused(tmp_path):
    journal = tmp_path / "s.nc.part"
    gc.skeleton(SMALL, **WINDOW, **QUICK, journal=journal)
    with pytest.raises(InputError, match="same model, axes, settings and versions"):
        gc.skeleton(SMALL, **WINDOW, **{**QUICK, "starts": 1}, journal=journal)
    journal.write_text("no journal\n")
    with pytest.raises(InputError, match="must be a journal of a skeleton"):
        gc.skeleton(SMALL, **WINDOW, **QUICK, journal=journal)
    with pytest.raises(InputError, match="must be a file that can be written"):
        gc.skeleton(SMALL, **WINDOW, **QUICK, journal=tmp_path / "none" / "s.part")


@pytest.mark.slow
def test_the_number_of_workers_changes_nothing():
    assert gc.skeleton(SMALL, **WINDOW, **{**QUICK, "workers": 2}).identical(quick())


@pytest.mark.slow
def test_a_killed_command_goes_on(tmp_path):
    out = tmp_path / "s.nc"
    command = [sys.executable, "-c", "from gearchaos.cli import main; main()", "skeleton", "--set", "q0=0.1",
               "--axis", WINDOW["x"], "--axis", WINDOW["y"], "--period", "1", "--workers", "1", "--out", str(out)]
    journal = Path(f"{out}.part")
    killed = subprocess.Popen(command, stderr=subprocess.DEVNULL, env=os.environ)
    for _ in range(1200):
        if journal.exists() and journal.read_bytes().count(b"\n") > 6:
            break
        time.sleep(0.05)
    killed.send_signal(signal.SIGKILL)
    killed.wait()
    finished = journal.read_bytes()[: journal.read_bytes().rfind(b"\n") + 1]
    assert finished.count(b"\n") > 6 and not out.exists()
    subprocess.run([*command, "--json"], check=True, capture_output=True, env=os.environ)
    assert out.exists() and not journal.exists()
    assert gc.load(out).identical(gc.skeleton(SMALL, **WINDOW, period=1, workers=1))


def test_agreement_names_the_cause_of_every_side():
    found = gc.agreement(small(), zones())
    assert found["cause"].attrs["flag_meanings"] == "curve basin_boundary unexplained"
    at_curve = found["cause"].values == 1
    assert np.array_equal(at_curve, found["curve"].values >= 0)
    assert found["orbit_sides"].sum() == found.sizes["side"] and found["orbit_period"].values.tolist() == [1, 2]
    steps = np.hypot((found["cell_omega"] - found["neighbour_omega"]) / 0.6 * 11,
                     (found["cell_eps1"] - found["neighbour_eps1"]) / 0.06 * 7)
    np.testing.assert_allclose(steps, 1, atol=1e-9)
    seen = np.unique(found["curve"].values[at_curve])
    assert found["curve_seen"].values[seen].all()
    assert found.identical(gc.agreement(small(), zones()))


def test_bad_input_of_agreement():
    with pytest.raises(InputError, match=r"must be a result of gearchaos.skeleton"):
        gc.agreement(zones(), small())
    with pytest.raises(InputError, match="must be of the model of the skeleton"):
        gc.agreement(small(), gc.zones(SMALL.with_values({"zeta": 0.3}), "omega=1.7:2.3:3", "eps1=0.03:0.09:3"))
    with pytest.raises(InputError, match="must be over the parameters of the skeleton"):
        gc.agreement(small(), gc.zones(SMALL, "omega=1.7:2.3:3", "q0=0.03:0.09:3"))
    with pytest.raises(InputError, match="at least two values"):
        gc.agreement(small(), gc.zones(SMALL, "omega=1.7:2.3:3", "eps1=0.03:0.09:1"))


def test_manifolds_have_the_variables_that_their_docstring_names():
    ds = manifolds()
    assert ds["z"].dims == ds["z_dot"].dims == ds["manifold"].dims == ("point",)
    assert ds["manifold_stable"].dims == ds["manifold_saddle"].dims == ds["manifold_complete"].dims == ("number",)
    assert ds["saddle_multipliers_real"].dims == ("saddle_number", "exponent")
    periods = ds["saddle_period"].values
    assert ds.sizes["number"] == 4 * periods.sum(), "two branches of each kind at every point"
    assert (np.isfinite(ds["saddle_section_z"]).sum("cycle") == periods).all()


@pytest.mark.parametrize(("model", "options", "words"), [
    (FULL, {}, "must have two coordinates"),
    (SINGLE, {"period": 0}, "period"),
    (SINGLE, {"length": 0}, "greater than 0"),
    (SINGLE, {"spacing": 0}, "must lie in"),
    (SINGLE, {"region": {"x1": (0, 1)}}, "region"),
    (SINGLE, {"region": {"z": (1, 0)}}, "the smaller one first"),
])
def test_bad_input_of_manifolds(model, options, words):
    with pytest.raises(InputError, match=words):
        gc.manifolds(model, **options)


def test_without_saddles_there_are_no_manifolds(tmp_path):
    ds = gc.manifolds(gc.MeshModel.of(kind="single", omega=4.0, zeta=0.5, q0=0.5, eps1=0), period=1)
    assert ds.sizes["point"] == ds.sizes["number"] == ds.sizes["saddle_number"] == 0
    gc.save(ds, tmp_path / "none.nc")
    plot.manifolds(gc.load(tmp_path / "none.nc"), ax=axes())


def test_without_events_there_are_no_curves(tmp_path):
    model = gc.MeshModel.of(kind="single", zeta=0.5, q0=0.5)
    ds = gc.skeleton(model, "omega=4:5:2", "eps1=0:0.001:2", lines=(1, 1), starts=0, period=1, workers=1)
    assert ds.sizes["point"] == ds.sizes["number"] == 0
    gc.save(ds, tmp_path / "none.nc")
    plot.skeleton(gc.load(tmp_path / "none.nc"), ax=axes())


def test_a_picture_of_a_skeleton_has_a_line_for_every_curve():
    ds, ax = small(), plot.skeleton(small(), ax=axes())
    assert len(ax.lines) == ds.sizes["number"]
    np.testing.assert_array_equal(ax.lines[0].get_xdata(), ds["omega"].values[ds["curve"].values == 0])
    assert (ax.get_xlim(), ax.get_ylim()) == ((1.7, 2.3), (0.03, 0.09))
    without = plot.skeleton(ds, ax=axes(), grazes=False)
    assert len(without.lines) == (ds["curve_kind"] != "graze").sum()
    words = [text.get_text() for text in without.get_legend().get_texts()]
    assert "flip" in words and "graze" not in words and {"1T", "2T"} <= set(words)


def test_curves_over_a_map_keep_its_limits_and_its_legend():
    ax = plot.zones(zones(), ax=axes())
    limits, before = (ax.get_xlim(), ax.get_ylim()), ax.get_legend()
    plot.skeleton(small(), ax=ax)
    ax.figure.canvas.draw()
    assert (ax.get_xlim(), ax.get_ylim()) == limits
    after = ax.get_legend()
    assert before in ax.get_children() and after is not before
    assert not after.get_window_extent().overlaps(before.get_window_extent())
    assert not after.get_window_extent().overlaps(ax.get_window_extent())


def test_a_picture_of_one_curve_marks_its_points_of_codimension_2():
    ds = gc.curve(FULL, "neimark-sacker", "eps1=0.01:0.07", "omega=1:1.2", period=1)
    ax = plot.skeleton(ds, ax=axes(), special=True)
    np.testing.assert_array_equal(ax.lines[0].get_xdata(), ds["eps1"])
    np.testing.assert_array_equal(ax.lines[1].get_xdata(), ds["special_eps1"])


def test_a_picture_of_manifolds_has_a_line_for_every_branch():
    ds = manifolds()
    stable = ds["manifold_stable"].values
    counts = [({}, stable.size), ({"unstable": False}, stable.sum()), ({"stable": False}, (~stable).sum())]
    for options, count in counts:
        ax = plot.manifolds(ds, ax=axes(), **options)
        drawn = [c for c in ax.collections if isinstance(c, LineCollection)]
        assert sum(len(c.get_segments()) for c in drawn) == count
    assert (ax.get_xlim(), ax.get_ylim()) == ((-4, 4), (-3, 3))


@pytest.mark.parametrize("make", [folds, small, manifolds])
def test_every_result_has_a_picture(make, monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "Agg")
    import matplotlib.pyplot as plt

    plt.switch_backend("Agg")
    figure = plot.result(make())
    assert figure.axes[0].lines
    plt.close(figure)


def test_pictures_of_other_results_are_refused():
    for draw in (plot.skeleton, plot.manifolds):
        with pytest.raises(InputError, match=r"drawn by gearchaos.plot.zones"):
            draw(zones(), ax=axes())


def test_curves_of_gears_in_physical_units():
    ds = gc.curve(PAIR, "fold", "speed=3000:30000", "zeta=0.02:0.1", period=1)
    scaled = gc.physical(ds)
    assert scaled["section_x1"].attrs["units"] == "µm"
    np.testing.assert_array_equal(scaled["speed"], ds["speed"])
    over_omega = gc.curve(gc.MeshModel.of(kind="single", omega=1.0, zeta=0.025, q0=0.1, eps1=0.05), "fold",
                          "omega=0.5:1.2", "eps1=0.02:0.08", period=1)
    scaled = gc.physical(over_omega, PAIR)
    factor = float(scaled["omega"][0] / over_omega["omega"][0])
    assert scaled["omega"].attrs["units"] == "Hz" and factor != 1
    ends, own = (json.loads(d.attrs["ends"]) for d in (scaled, over_omega))
    assert ends[0]["omega"] == pytest.approx(factor * own[0]["omega"], rel=1e-12)
    ax = plot.skeleton(scaled, ax=axes())
    assert ax.get_xlim() == pytest.approx((0.5 * factor, 1.2 * factor)) and "Hz" in ax.get_xlabel()
