"""Run-ups in pieces: stopped anywhere and continued to the same bits, refused journals, memory, events of jumps."""

import math
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos.cli.runup import print_runup, runup_document
from gearchaos.studies.runup import runup, runup_results
from gearchaos.studies.runup.runup_jumps import GOES_ON, NOT_PERIODIC, ChangePoint, find_event
from gearchaos.studyfile import load_study
from tests.closed_forms.linear_gears import PAIR_FILE
from tests.commands import ask

MODEL = load_study(PAIR_FILE).model


class StopError(Exception):
    """What stops a run in these tests."""


@pytest.fixture
def stop_after(monkeypatch):
    """Writes a journal after every part, and stops the run after so many of them."""
    monkeypatch.setattr(runup_results, "_BETWEEN", 0.0)
    monkeypatch.setattr(runup, "_SAMPLES", 1 << 12)
    original = runup_results.Journal.write

    def stop(parts):
        left = iter(range(parts - 1))

        def write(journal, arrays):
            original(journal, arrays)
            if next(left, None) is None:
                raise StopError

        monkeypatch.setattr(runup_results.Journal, "write", write)

    return stop


def study(torque=None, events=False, **options):
    return gc.RunUp(MODEL, "speed=1240:1330", 2.0, down=True, events=events, torque=torque, **options)


PROFILE = {"time": [0, 4], "torque": [90.0, 100.0]}


@pytest.mark.slow
def test_a_run_that_is_stopped_goes_on_to_the_same_bits(tmp_path, stop_after):
    run = gc.RunUp(MODEL, "speed=1240:1330", 0.3, down=True, events=True, torque=PROFILE)
    whole, journal = run.run(), tmp_path / "r.part"
    for parts in (3, 4, 3):  # the third stop is in the run-down
        stop_after(parts)
        with pytest.raises(StopError):
            run.run(journal=journal)
    stop_after(100)
    xr.testing.assert_identical(run.run(journal=journal).drop_attrs(), whole.drop_attrs())


def test_a_journal_of_another_run_up_is_refused(tmp_path, stop_after):
    journal = tmp_path / "r.part"
    stop_after(1)
    with pytest.raises(StopError):
        study().run(journal=journal)

    def refused(words, other=None, at=journal):
        with pytest.raises(gc.InputError, match=words):
            (other or study()).run(journal=at)

    for other in (study(PROFILE), study(events=True), gc.RunUp(MODEL, "speed=1240:1330", 2.0)):
        refused("must be one of the same model, axes, settings and versions", other)
    content = journal.read_bytes()
    for broken in (content[:-100], b"not at all", b""):
        journal.write_bytes(broken)
        refused("must be a journal of a run-up, whole and readable")
    refused("journal must be left out with a signal", study(signal=True))
    refused("must lie in an existing folder", at=tmp_path / "none" / "r.part")


def test_what_is_kept_does_not_grow_with_the_duration():
    def size(periods):
        run = runup_results.Run(500.0, 0.01, 0.8, periods)
        kept = runup_results.RunResults(run, np.linspace(500, 600, 41), 100, 601).kept
        return sum(each.nbytes for each in kept.values())

    assert size(9_000_000) < size(2_000_000) * 1.01 < 25e6


@pytest.mark.slow
def test_groups_of_periods_have_the_same_results_and_jumps(monkeypatch):
    single = gc.runup(MODEL, "speed=1240:1330", 1.5, down=True)
    monkeypatch.setattr(runup_results, "_SERIES", single.sizes["speed"] * 4)
    grouped = gc.runup(MODEL, "speed=1240:1330", 1.5, down=True)
    xr.testing.assert_identical(single.drop_dims("jump").drop_attrs(), grouped.drop_dims("jump").drop_attrs())
    assert grouped.speed_of_jump.values == pytest.approx(single.speed_of_jump.values, abs=0.2) and single.sizes["jump"]
    for name in ("factor_before_jump", "factor_after_jump"):
        np.testing.assert_allclose(grouped[name], single[name], rtol=3e-2)


@pytest.mark.slow
def test_a_command_that_is_killed_goes_on(tmp_path, monkeypatch):
    """With SIGKILL; once it is finished, the journal is gone."""
    monkeypatch.setattr(runup_results, "_BETWEEN", 0.1)
    monkeypatch.setattr(runup, "_SAMPLES", 1 << 13)

    def arguments(name):
        return ["runup", str(PAIR_FILE), "--speed", "1200:1330", "--duration", "3 s", "--out", str(tmp_path / name)]

    code = ("from gearchaos.studies.runup import runup, runup_results; from gearchaos.cli import main; "
            "runup_results._BETWEEN, runup._SAMPLES = 0.1, 1 << 13; main()")
    run = subprocess.Popen([sys.executable, "-c", code, *arguments("r.nc")], stdout=subprocess.DEVNULL,
                           stderr=subprocess.DEVNULL)
    part, until = tmp_path / "r.nc.part", time.monotonic() + 120
    while time.monotonic() < until and not part.exists():
        time.sleep(0.02)
    os.kill(run.pid, signal.SIGKILL)
    run.wait()
    assert part.exists() and not (tmp_path / "r.nc").exists()
    ask(*arguments("r.nc"), code=0)
    assert not part.exists()
    ask(*arguments("whole.nc"), code=0)
    xr.testing.assert_identical(gc.load(tmp_path / "r.nc"), gc.load(tmp_path / "whole.nc"))


@pytest.mark.slow
def test_the_event_of_a_jump_is_that_of_the_branch(monkeypatch):
    branch = gc.branch(MODEL.with_values({"speed": 1300.0}), "speed=1240:1330")
    fold = branch.event_value.values[branch.event_kind.values == "fold"].min()
    found = study(events=True).run()
    at = found.direction_of_jump.values == "down"
    assert found.event_kind.values[at].tolist() == ["fold"]
    np.testing.assert_allclose(found.event_speed.values[at], fold, rtol=1e-8)
    assert found.event_speed.values[at] > found.speed_of_jump.values[at]  # it is passed before
    monkeypatch.setattr(gc.RunUp, "run", lambda *_, **__: found)  # as it was computed
    said = ask("runup", PAIR_FILE, "--speed", "1240:1330", "--duration", "2", "--down", "--events", code=0).stdout
    assert f"fold at {fold:.5g} rpm" in " ".join(said.split()) and max(map(len, said.splitlines())) <= 80


def test_a_price_counts_the_events_of_jumps_which_a_part_that_is_tried_does_not_look_for():
    study = gc.RunUp(MODEL, "speed=1000:1400", 3.0, events=True, down=True)
    part = study.thinned(0.2)
    found = part.thinned(0.5).run()
    assert part.trial_of == part.thinned(0.5).trial_of == study._periods > part._periods and "event_kind" not in found
    periods = 500 + 2 * study._periods
    for jumps in (0, 5, 7):
        some = found.drop_dims("jump").assign(speed_of_jump=("jump", np.zeros(jumps)))
        assert part.needed(some) == pytest.approx(1 + max(jumps, 5) * 2000 / periods)
    assert gc.RunUp(MODEL, "speed=1000:1400", 3.0).thinned(0.2).needed(found) == 1


def event_after(speed, jump, before=3.0, period=500, width=10):
    """What is found for a motion that has settled from rest at a speed and is to end at the jump."""
    model = MODEL.with_values({"speed": speed})
    motion = gc.simulate(model, periods=1, transient=3000)
    w = np.array([motion.section_z.item(-1), motion.section_z_dot.item(-1)])
    return find_event(
        ChangePoint(period, width, jump, before, 2 * before, True), 0, lambda _: (model, w, ("z", "z_dot")))


def test_without_an_end_of_the_branch_or_from_a_chaotic_motion_there_is_no_event():
    there = gc.regime(MODEL.with_values({"speed": 1550.0}))
    assert "chaotic" in there.label
    for found, expected in ((event_after(1000.0, 1010.0), GOES_ON),
                            (event_after(1550.0, 1580.0, there.dynamic_factor), NOT_PERIODIC)):
        assert found[0] == expected and math.isnan(found[1])


def test_the_motion_before_a_jump_at_the_beginning_of_a_run_is_taken_soon_before_it():
    assert event_after(1000.0, 1010.0, period=15)[0] == GOES_ON


def test_jumps_are_printed_by_their_size_and_the_others_in_one_line(capsys):
    values = {"speed_of_jump": [1400.0, 1500.0, 1600.0, 1700.0, 1800.0],
              "factor_before_jump": [2.0, 2.0, 9.0, 8.0, 2.0],
              "factor_after_jump": [3.0, 4.0, 8.0, 3.0, 2.5], "clear_jump": [True, True, False, False, True],
              "event_kind": ["fold", NOT_PERIODIC, NOT_PERIODIC, NOT_PERIODIC, GOES_ON],
              "event_speed": [1405.0, *[math.nan] * 4]}
    without = gc.runup(MODEL.gears, "speed=1240:1260", 0.3)
    print_runup(without, runup_document(without, None, MODEL), MODEL)
    assert "; no jumps" in " ".join(capsys.readouterr().out.split())
    found = without.drop_dims("jump", errors="ignore").assign(
        {name: ("jump", each) for name, each in {**values, "direction_of_jump": ["up"] * 5}.items()})
    document = runup_document(found, None, MODEL)
    print_runup(found, document, MODEL)
    said = " ".join(capsys.readouterr().out.split())
    assert "no jumps" not in said
    assert ("jumps of the dynamic factor at 1500 rpm (2 to 4): not from a branch, the motion before is not periodic; "
            "1400 rpm (2 to 3): fold at 1405 rpm; 1800 rpm (2 to 2.5): the branch before goes on "
            "2 more, from or to a motion that is not steady: 1600 to 1700 rpm") in said
    assert [jump.get("why") for jump in document["jumps"]][::4] == [None, "the branch before goes on"]
