"""`gearchaos.skeleton` and `agreement`: variables, journals, processes, bad input, pictures."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import BrokenExecutor
from pathlib import Path

import numpy as np
import pytest

import gearchaos as gc
from gearchaos import plot
from gearchaos.continuation import skeleton as algorithm
from gearchaos.errors import InputError
from gearchaos.studies import skeleton as skeletons
from tests.event_curves import QUICK, SMALL, WINDOW, axes, quick, small, zones


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


def test_a_dead_worker_is_an_error_with_advice(tmp_path, monkeypatch):
    def broken(*_, **__):
        raise BrokenExecutor

    monkeypatch.setattr(skeletons, "find_curves", broken)
    with pytest.raises(OSError, match=r"a worker process died.*the same command goes on"):
        gc.skeleton(SMALL, **WINDOW, **QUICK, journal=tmp_path / "s.part")


@pytest.mark.parametrize(("changes", "words"), [
    ({"lines": 3}, "must be two numbers"), ({"lines": (1, -1)}, "lines"), ({"period": 65}, "period"),
    ({"lines": (0, 0)}, "at least one line"),
    ({"starts": -1}, "starts"), ({"workers": 0}, "workers"), ({"x": "z=1:2"}, "x1"), ({"x": "eps1=0:0.1"}, "different"),
])
def test_bad_input_of_a_skeleton(changes, words):
    with pytest.raises(InputError, match=words):
        gc.skeleton(SMALL, **{**WINDOW, **QUICK, **changes})


def test_motions_that_are_not_isolated_are_passed_over():
    ds = gc.skeleton(gc.MeshModel.of(kind="single", q0=0.0, eps1=0.1, omega=0.7), "omega=0.6:0.9:4", "q0=0:0.1:3",
                     period=1, lines=(1, 2), workers=1)
    assert ds.attrs["study"] == "skeleton"
