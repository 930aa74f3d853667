"""Run-ups in pieces: stopped anywhere and continued to the same bits, refused journals, memory, events of jumps."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import gearchaos as gc
from gearchaos.cli import app
from gearchaos.studies import runup_results
from gearchaos.studies.runup_jumps import GOES_ON, NOT_PERIODIC, Jump, find_event
from gearchaos.studyfile import load_study
from tests import EXAMPLES

DESIGN = EXAMPLES / "spur_50_50.toml"
MODEL = load_study(DESIGN).model


class StopError(Exception):
    """What stops a run in these tests."""


@pytest.fixture
def stop_after(monkeypatch):
    """Writes a journal after every part, and stops the run after so many of them."""
    monkeypatch.setattr(runup_results, "_BETWEEN", 0.0)
    original = runup_results.Journal.write

    def stop(parts):
        left = [parts]

        def write(journal, arrays):
            original(journal, arrays)
            left[0] -= 1
            if left[0] == 0:
                raise StopError

        monkeypatch.setattr(runup_results.Journal, "write", write)

    return stop


def study(**options):
    return gc.RunUp(MODEL, "speed=1200:1330", 3.0, down=True, events=True, **options)


@pytest.mark.slow
def test_a_run_that_is_stopped_goes_on_to_the_same_bits(tmp_path, stop_after):
    profile = {"time": [0, 6], "torque": [90.0, 100.0]}
    whole, journal = study(torque=profile).run(), tmp_path / "r.part"
    for parts in (1, 2, 2):  # the third stop is in the run-down
        stop_after(parts)
        with pytest.raises(StopError):
            study(torque=profile).run(journal=journal)
    stop_after(100)
    xr.testing.assert_identical(study(torque=profile).run(journal=journal).drop_attrs(), whole.drop_attrs())


def test_a_journal_of_another_run_up_is_refused(tmp_path, stop_after):
    stop_after(1)
    with pytest.raises(StopError):
        study().run(journal=tmp_path / "r.part")
    for other in (study(torque={"time": [0, 6], "torque": [90.0, 100.0]}), gc.RunUp(MODEL, "speed=1200:1330", 3.0)):
        with pytest.raises(gc.InputError, match="must be one of the same model, axes, settings and versions"):
            other.run(journal=tmp_path / "r.part")
    content = (tmp_path / "r.part").read_bytes()
    for broken in (content[:-100], b"not at all", b""):
        (tmp_path / "r.part").write_bytes(broken)
        with pytest.raises(gc.InputError, match="must be a journal of a run-up, whole and readable"):
            study().run(journal=tmp_path / "r.part")
    with pytest.raises(gc.InputError, match="journal must be left out with a signal"):
        gc.RunUp(MODEL, "speed=1200:1330", 3.0, signal=True).run(journal=tmp_path / "r.part")
    with pytest.raises(gc.InputError, match="must lie in an existing folder"):
        study().run(journal=tmp_path / "none" / "r.part")


def test_what_is_kept_does_not_grow_with_the_duration():
    def size(periods):
        run = runup_results.Run(500.0, 0.01, 0.8, periods)
        kept = runup_results.RunResults(run, np.linspace(500, 600, 41), 100, 601).kept
        return sum(each.nbytes for each in kept.values())

    assert size(9_000_000) < size(2_000_000) * 1.01 < 25e6


@pytest.mark.slow
def test_groups_of_periods_have_the_same_results_and_jumps(monkeypatch):
    single = gc.runup(MODEL, "speed=1200:1330", 6.0, down=True)
    monkeypatch.setattr(runup_results, "_SERIES", single.sizes["speed"] * 4)
    grouped = gc.runup(MODEL, "speed=1200:1330", 6.0, down=True)
    xr.testing.assert_identical(single.drop_dims("jump").drop_attrs(), grouped.drop_dims("jump").drop_attrs())
    assert grouped.speed_of_jump.values == pytest.approx(single.speed_of_jump.values, abs=0.2) and single.sizes["jump"]
    for name in ("factor_before_jump", "factor_after_jump"):
        np.testing.assert_allclose(grouped[name], single[name], rtol=3e-2)


@pytest.mark.slow
def test_a_command_that_is_killed_goes_on(tmp_path):
    """With SIGKILL, at two instants, until it is finished; the journal is then gone."""
    def command(name):
        options = ["runup", str(DESIGN), "--speed", "1200:1330", "--duration", "12 s", "--out", str(tmp_path / name)]
        return [sys.executable, "-c", "from gearchaos.studies import runup_results; runup_results._BETWEEN = 0.1; "
                "from gearchaos.cli import main; main()", *options]

    subprocess.run(command("whole.nc"), check=True, capture_output=True)
    part, known = tmp_path / "r.nc.part", 0.0
    for _ in range(2):
        run = subprocess.Popen(command("r.nc"), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        until = time.monotonic() + 120
        while time.monotonic() < until and not (part.exists() and part.stat().st_mtime_ns > known):
            time.sleep(0.02)
        os.kill(run.pid, signal.SIGKILL)
        run.wait()
        known = part.stat().st_mtime_ns
    assert not (tmp_path / "r.nc").exists()
    subprocess.run(command("r.nc"), check=True, capture_output=True)
    assert not part.exists()
    xr.testing.assert_identical(gc.load(tmp_path / "r.nc"), gc.load(tmp_path / "whole.nc"))


@pytest.mark.slow
def test_the_event_of_a_jump_is_that_of_the_branch(tmp_path):
    branch = gc.branch(MODEL.with_values({"speed": 1300.0}), "speed=1200:1330")
    folds = branch.event_value.values[branch.event_kind.values == "fold"]
    found = study().run()
    at = found.direction_of_jump.values == "down"
    assert found.event_kind.values[at].tolist() == ["fold"]
    np.testing.assert_allclose(found.event_speed.values[at], folds.min(), rtol=1e-8)
    assert found.event_speed.values[at] > found.speed_of_jump.values[at]  # it is passed before
    result = CliRunner().invoke(app, ["runup", str(DESIGN), "--speed", "1200:1330", "--duration", "3", "--down",
                                      "--events", "--plot", str(tmp_path / "r.png")])
    assert f"fold at {folds.min():.5g} rpm" in " ".join(result.stdout.split()) and result.exit_code == 0
    assert max(map(len, result.stdout.splitlines())) <= 80


def event_after(speed, jump, w=None, before=3.0):
    """What is found for a motion (settled from rest, or in the state w) at a speed that is to end at the jump."""
    model = MODEL.with_values({"speed": speed})
    if w is None:
        motion = gc.simulate(model, periods=1, transient=3000)
        w = [motion.section_z.item(-1), motion.section_z_dot.item(-1)]
    return find_event(Jump(500, 10, jump, before, 2 * before), 0, 0, lambda _: (model, np.array(w), ("z", "z_dot")))


def test_without_an_end_of_the_branch_there_is_no_event():
    kind, speed = event_after(1000.0, 1010.0)
    assert kind == GOES_ON and math.isnan(speed)


def test_a_chaotic_motion_is_on_no_branch():
    there = gc.regime(MODEL.with_values({"speed": 1550.0}))
    assert "chaotic" in there.label
    kind, speed = event_after(1550.0, 1580.0, before=there.dynamic_factor)
    assert kind == NOT_PERIODIC and math.isnan(speed)
