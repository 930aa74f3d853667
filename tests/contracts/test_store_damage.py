"""Damage of stores: it is named, never looks like a result, and is repaired by the next run with the same bytes."""

import errno
import json
import os
import shutil

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import gearchaos as gc
from gearchaos.cli import app
from gearchaos.cli.runs import _say_missing
from gearchaos.dynamics import Classification
from gearchaos.store.journals.journal import Begin, Journal, TileEntry
from gearchaos.store.layout.segments import record_is_intact
from gearchaos.store.reading.check import Damage, check
from gearchaos.store.reading.info import summary
from gearchaos.store.running.run import Outcome, run, run_into_store
from gearchaos.store.store import open_store
from gearchaos.store.writers.locks import Shard, write_lock

pytestmark = pytest.mark.slow

AXES = gc.Axis("omega", 0.5, 1.1, 16), gc.Axis("eps1", 0.05, 0.3, 12)
MAP = gc.Zones(gc.MeshModel.of(q0=0.1), *AXES, settings=Classification(
    longest_transient=800, doublings=1, averaging_periods=16))
FILE = "v_rms/c/0/1"
"""A file with the tiles 2, 3, 6 and 7, of which each is a chunk."""


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A finished store of 3 × 4 tiles, each a chunk, in four groups."""
    path = tmp_path_factory.mktemp("whole") / "map.zarr"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("gearchaos.store.tiles._CHUNK_BYTES", 16 * 8)
        patch.setattr("gearchaos.store.tiles._GROUP_BYTES", 64 * 8)
        run(MAP, path, tile=16)
    return path


@pytest.fixture
def path(whole, tmp_path):
    return shutil.copytree(whole, tmp_path / "map.zarr")


def files(path):
    """The bytes of all files but those in ``run``."""
    every = {p.relative_to(path): p.read_bytes() for p in path.rglob("*") if p.is_file()}
    return {name: data for name, data in every.items() if name.parts[0] != "run"}


def ask(*arguments):
    return CliRunner().invoke(app, list(map(str, arguments)), catch_exceptions=False)


def flip(file, at=5):
    content = file.read_bytes()
    file.write_bytes(content[:at] + bytes([content[at] ^ 1]) + content[at + 1:])


def test_the_store_has_groups_of_single_chunks(whole):
    grid = open_store(whole).grid
    assert (grid.tile, grid.chunk, grid.group, grid.group_count) == ((4, 4), (4, 4), (8, 8), 4)
    assert grid.tiles_of(1) == [2, 3, 6, 7] and (whole / FILE).is_file()


def test_an_undamaged_store_is_said_to_be_so(whole):
    result = ask("check", whole)
    assert result.exit_code == 0 and result.stdout == f"{whole}: all checksums are right\n"
    assert json.loads(ask("check", whole, "--json").stdout) == {
        "store": str(whole), "damaged": False, "files": [], "groups": [], "tiles": [], "noted": False}


def test_a_damaged_chunk_is_named_and_its_tile_computed_again(path, monkeypatch):
    before, computed, true = files(path), [], gc.Zones.compute
    flip(path / FILE)
    result = ask("check", path, "--json")
    assert result.exit_code == 1 and f"damaged: {FILE}" in result.stderr
    assert json.loads(result.stdout) == {
        "store": str(path), "damaged": True, "files": [FILE], "groups": [1], "tiles": [2], "noted": True}
    state = summary(open_store(path))
    assert state["tiles_done"] == 11 and state["missing"] == {
        "tiles": 1, "groups": [1], "files": [FILE], "file_count": 1, "arrays": ["v_rms"],
        "pieces": [{"eps1": [0, 4], "omega": [8, 12]}]}
    assert FILE in ask("info", path).stdout and "omega 8:12" in ask("info", path).stdout

    def compute(study, items, **options):
        computed.append(items)
        return true(study, items, **options)

    monkeypatch.setattr(gc.Zones, "compute", compute)
    monkeypatch.setattr("gearchaos.store.running.worker.cached_store", lambda url, description: open_store(url))
    run(MAP, path)
    assert [items.tolist() for items in computed] == [open_store(path).grid.items(2).tolist()]
    assert files(path) == before and check(open_store(path)).files == []
    assert summary(open_store(path))["missing"]["files"] == [] and open_store(path).finished


@pytest.mark.parametrize("content", [None, b"", b"short"])
def test_a_missing_or_shortened_file_is_named_and_never_a_result(path, content):
    before = files(path)
    (path / FILE).unlink()
    if content is not None:
        (path / FILE).write_bytes(content)
    state = summary(open_store(path))
    assert not state["finished"] and state["tiles_done"] == 8 and state["missing"]["files"] == [FILE]
    assert state["missing"]["pieces"] == [{"eps1": [0, 8], "omega": [8, 16]}]
    found = check(open_store(path))
    assert (found.files, found.tiles) == ([FILE], [2, 3, 6, 7])
    if content is None:
        for dataset in (open_store(path).dataset().load(), xr.open_zarr(path).load()):
            assert np.all(np.isnan(dataset.v_rms.values[:8, 8:])) and np.all(np.isfinite(dataset.v_rms.values[8:]))
    else:
        with pytest.raises(gc.InputError, match=r"store must be undamaged; .*v_rms/c/0/1"):
            open_store(path).dataset().load()
    run(MAP, path)
    assert files(path) == before


def test_missing_whole_numbers_are_minus_one(path):
    (path / "period" / "c" / "1" / "1").unlink()
    for dataset in (open_store(path).dataset().load(), xr.open_zarr(path).load()):
        assert np.all(dataset.period.values[8:, 8:] == -1) and np.all(dataset.period.values[:8] >= 0)


def test_reading_a_damaged_chunk_is_an_error(path):
    flip(path / FILE)
    with pytest.raises(gc.InputError, match=r"store must be undamaged; .*v_rms/c/0/1 .*gearchaos check "):
        open_store(path).dataset().load()


@pytest.mark.parametrize("name", [FILE, "v_rms/c/1/0"])
def test_what_has_the_place_of_a_group_file_is_named(path, name):
    (path / name).unlink()
    (path / name).mkdir()
    with pytest.raises(OSError, match=rf"the store cannot be written to: .*{name}'\. Remove it"):
        run(MAP, path)
    (path / name).rmdir()
    assert run(MAP, path).finished and check(open_store(path)).files == []


def test_a_file_in_place_of_the_segments_stops_the_run_at_once(tmp_path):
    path = tmp_path / "map.zarr"
    run(MAP, path, tile=16, shard="1/2")
    shutil.rmtree(path / "run/segments")
    (path / "run/segments").touch()
    with pytest.raises(OSError, match=r"the store cannot be written to: .*run/segments'\. Remove it"):
        run(MAP, path)


def test_a_tile_that_is_computed_again_after_its_group_was_packed_is_not_missing(path):
    journal = Journal(open_store(path).folder, "2-of-3")
    length = open_store(path).record_length(3)
    journal.append(TileEntry(3, "run/segments/deleted.bin", 0, length, 7, 1.0, "m:1"))  # of a slow worker
    found = summary(open_store(path))
    assert found["tiles_done"] == 12 and found["missing"]["files"] == [] and check(open_store(path)).files == []


@pytest.mark.parametrize(("old", "new"), [(b'"chunk_shape"', b'"chunk_shap!"'), (b"sharding_ind", b"shardinG_ind"),
                                          (b'"shape": [', b'"shape": [1')])
def test_damaged_metadata_of_an_array_that_are_still_json_are_repaired(path, whole, old, new):
    metadata = path / "v_rms/zarr.json"
    content = metadata.read_bytes().replace(b'"shape":[', b'"shape": [')
    assert old in content
    metadata.write_bytes(new.join(content.rsplit(old, 1)))
    assert "v_rms/zarr.json" in check(open_store(path)).files
    assert run(MAP, path).finished and files(path) == files(whole)


@pytest.mark.parametrize("content", [b'{"zarr', b"", b"[]"])
def test_a_damaged_group_of_the_run_does_not_keep_a_store_from_being_finished(tmp_path, content):
    basins = gc.Basins(gc.MeshModel.of(kind="single", omega=2.3, eps1=0.05, q0=0.1), gc.Axis("z", -3, 3, 8),
                       gc.Axis("z_dot", -2, 2, 6), settings=MAP.settings)
    for name in ("whole", "damaged"):
        run(basins, tmp_path / name, tile=8, shard="1/2")
        if name == "damaged":
            (tmp_path / name / "run/zarr.json").write_bytes(content)
        assert run(basins, tmp_path / name).finished
    assert files(tmp_path / "damaged") == files(tmp_path / "whole")


def test_damage_is_told_but_not_noted_while_a_run_writes(path):
    flip(path / FILE)
    for shard in (Shard(), Shard(2, 3)):
        with write_lock(open_store(path).folder, shard):
            assert not check(open_store(path)).noted
    assert summary(open_store(path))["missing"]["tiles"] == 0
    assert check(open_store(path)).noted and summary(open_store(path))["missing"]["tiles"] == 1


def test_a_damaged_record_is_found_by_a_check_and_at_the_latest_when_it_is_packed(tmp_path, whole):
    for checked in (True, False):
        path = tmp_path / str(checked)
        run(MAP, path, tile=16, shard="1/2")
        tile, entry = next(iter(open_store(path).progress().entries.items()))
        flip(path / entry.segment, entry.offset + 9)
        if checked:
            assert (check(open_store(path)).tiles, check(open_store(path)).tiles) == ([tile], [])
            assert not open_store(path).progress().done(tile)
        for _ in range(2):
            run(MAP, path)
        assert open_store(path).finished
        xr.testing.assert_identical(open_store(path).dataset(), open_store(whole).dataset())


@pytest.mark.parametrize("name", ["zarr.json", "label/zarr.json", "omega/c/0", "run/sums.json"])
def test_other_damaged_files_are_named(path, name):
    before = files(path)
    flip(path / name)
    assert check(open_store(path)).files == [name]
    run(MAP, path)
    assert files(path) == before and check(open_store(path)).files == []


@pytest.mark.parametrize("command", ["run", "finish"])
def test_damaged_metadata_of_a_result_of_all_starts_are_written_again(tmp_path, command):
    """Its ``node_type`` is neither "array" nor "group", which the Zarr library refuses to read or to overwrite."""
    path, study = tmp_path / "basins.zarr", tmp_path / "basins.toml"
    study.write_text('[model]\nkind = "single"\n[study]\nkind = "basins"\nx = "z=-1:1:3"\ny = "z_dot=-1:1:2"\n')
    ask("run", study, "--out", path)
    before = files(path)
    metadata = path / "attractor_residual/zarr.json"
    metadata.write_bytes(metadata.read_bytes().replace(b'"array"', b'"brray"'))
    assert "gearchaos finish" in ask("check", path).output
    assert ask("run", study, "--out", path).exit_code == 0 if command == "run" else ask("finish", path).exit_code == 0
    assert files(path) == before and check(open_store(path)).files == []


def test_a_lost_journal_costs_time_alone(path):
    before = files(path)
    (path / "run" / "journal" / "all.jsonl").unlink()
    assert summary(open_store(path))["tiles_done"] == 0
    run(MAP, path)
    assert files(path) == before


def test_a_finished_store_that_lost_its_journal_is_not_said_to_be_finished(path, monkeypatch):
    monkeypatch.setattr("gearchaos.store.running.coordinator.SETTLING_SECONDS", 0.5)
    before = files(path)
    (path / "run" / "journal" / "all.jsonl").unlink()
    assert "not finished" in ask("info", path).stdout
    outcome = run(MAP, path, shard="1/2")
    assert (outcome.done, outcome.finished, outcome.missing) == (6, False, {"2/2": 6})
    assert not open_store(path).finished and len(open_store(path).progress().entries) == 6
    assert check(open_store(path)).files == []
    assert run(MAP, path, shard="2/2").finished and files(path) == before


def test_results_that_a_run_packs_during_a_check_are_not_damaged(tmp_path, monkeypatch):
    path, true = tmp_path / "map.zarr", record_is_intact
    run(MAP, path, tile=16, shard="1/2")
    store = open_store(path)

    def checked(folder, entry):
        if not store.finished:
            monkeypatch.undo()
            assert run(MAP, path).finished
        return true(folder, entry)

    monkeypatch.setattr("gearchaos.store.reading.check.cores", lambda: 1)
    monkeypatch.setattr("gearchaos.store.reading.check.record_is_intact", checked)
    assert check(store) == Damage([], [], [])


def test_damage_is_told_in_ranges_with_the_command_that_repairs_it(path):
    before = files(path)
    shutil.rmtree(path / "v_rms/c/0")
    said = ask("check", path).stderr
    assert "tiles to be computed again, 8 in all: 0–7\n" in said
    assert said.endswith(f"To repair it: gearchaos finish {path}\n")
    assert ask("finish", path).exit_code == 0 and files(path) == before


def test_damage_that_is_not_noted_is_said_to_be_so(path):
    flip(path / FILE)
    with write_lock(open_store(path).folder, Shard()):
        said = ask("check", path).stderr
    assert "all: 2\n" in said and "not noted in the store" in said and "To repair" not in said


def test_info_tells_a_finished_run_from_one_that_is_running_or_was_killed(path):
    assert "finished" in ask("info", path).stdout and "writer" not in ask("info", path).stdout
    (path / "run/finished").unlink()
    Journal(open_store(path).folder, "all").append(Begin("here:1", {}))
    killed = ask("info", path).stdout
    assert "not running; it stopped" in killed and f"gearchaos finish {path}" in "".join(killed.split("\n"))
    with write_lock(open_store(path).folder, Shard()):
        assert summary(open_store(path))["writers"]["all"]["running"] is True
        assert "running, last entry in its journal 0:00:" in ask("info", path).stdout
    shutil.rmtree(path / "run/writers")
    assert summary(open_store(path))["writers"]["all"]["running"] is None
    assert "its lock does not tell" in ask("info", path).stdout


def test_info_tells_lost_results_from_those_never_computed(path):
    (path / FILE).unlink()
    assert summary(open_store(path))["tiles_lost"] == 4
    said = ask("info", path).stdout
    assert "12 of 12; 8 are whole (66.7%" in said and "files of v_rms are missing" in said
    assert "4 tiles that were done" in said and "by position from 0" in said and "damaged; to continue" in said


def test_info_of_a_store_that_does_not_exist_yet_says_why_that_may_be(tmp_path):
    said = CliRunner().invoke(app, ["info", str(tmp_path / "none.zarr")])
    assert said.exit_code == 2 and "compiles its kernels first" in said.stderr


def test_a_run_says_what_it_computes_again_and_where(path):
    (path / FILE).unlink()
    said = []
    run_into_store(MAP, path, say=said.append)
    assert said[0] == (
        f"{path}: 12 of 12 tiles are done already, of which 4 are computed again since files are missing or damaged")


def test_a_picture_of_a_store_with_missing_results_says_what_is_missing(path):
    (path / FILE).unlink()
    assert f"{path}: files of v_rms are missing or damaged for 4 of 12 tiles" in ask("plot", path).stderr


@pytest.mark.parametrize("command", [("info",), ("finish",), ("plot",)])
def test_a_store_without_its_description_is_told_from_what_is_no_store(path, command):
    (path / "run/study.json").unlink()
    said = ask(*command, path)
    assert said.exit_code == 2 and "store must hold run/study.json; got" in said.stderr
    assert "Copy run/study.json from a new store of the same study" in said.stderr
    shutil.rmtree(path / "run")
    assert "store must be a folder that gearchaos run made" in ask(*command, path).stderr


@pytest.mark.parametrize("number", [errno.EACCES, errno.EROFS])
@pytest.mark.parametrize(("place", "words"), [
    ("gearchaos.store.files.folder.FileLock", "store must be writable; got"),
    ("gearchaos.files.tempfile.mkdtemp", "store must lie in a folder you may write in; got")])
def test_a_store_that_must_not_be_written_to_is_named_with_what_is_needed(path, monkeypatch, place, words, number):
    def refuse(*_, **__):
        raise OSError(number, os.strerror(number), "/somewhere/.hidden")

    (path / "run/sums.json").unlink()
    monkeypatch.setattr(place, refuse)
    said = ask("finish", path)
    assert said.exit_code == 2 and f"error: {words} '{path}'. " in said.stderr and "you may write in" in said.stderr
    assert os.strerror(number) in said.stderr


def test_tiles_that_are_lost_are_told_apart_from_those_never_computed(tmp_path):
    run(MAP, path := tmp_path / "map.zarr", tile=16, shard="1/2")
    with pytest.warns(UserWarning, match="map.zarr: 6 of 12 tiles are not computed, [^.]*$"):
        gc.load(path)
    for segment in (path / "run/segments").iterdir():
        segment.unlink()
    lost = r"\. files of .*, .*, .* and \d+ more are missing or damaged for 6 of 12 tiles, "
    with pytest.warns(UserWarning, match=rf"are not computed, .*{lost}.*: gearchaos run STUDY.toml --out {path}$"):
        gc.load(path)


def test_missing_tiles_of_a_run_without_shards_are_told_without_shards(capsys):
    _say_missing("map.zarr", Outcome(3, {}, 5, False, {"1/1": 2}))
    assert capsys.readouterr().err == (
        "the store is not finished; missing tiles: 2. To compute them: gearchaos run STUDY.toml --out map.zarr\n")
    _say_missing("map.zarr", Outcome(5, {}, 5, False, {}))
    assert "gearchaos finish map.zarr" in capsys.readouterr().err


def test_a_path_meant_as_a_url_is_refused_with_the_url():
    with pytest.raises(gc.InputError, match=r"For an object store: s3://bucket/y\.zarr"):
        run(MAP, "s3:bucket/y.zarr")


@pytest.mark.parametrize("name", ["label/zarr.json", "omega/c/0", "zarr.json"])
def test_info_sees_lost_files_that_are_no_results(path, name):
    (path / name).unlink()
    state = summary(open_store(path))
    assert not state["finished"] and name in state["missing"]["files"] and state["missing"]["file_count"] >= 1
    assert "gearchaos finish" in ask("info", path).stdout
