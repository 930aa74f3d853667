"""Runs into stores: they go on where they were stopped, try again what fails, and keep other writers out."""

import json
import os
import shutil
import socket
import subprocess
import sys
from contextlib import nullcontext

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos.store import blocks
from gearchaos.store.check import check, summary
from gearchaos.store.lock import Shard, running, write_lock
from gearchaos.store.objects import Objects
from gearchaos.store.run import Outcome, _create, finish_store, run
from gearchaos.store.store import open_store
from gearchaos.store.tiles import Grid, divide, with_blocks
from tests.commands import ask
from tests.contracts.store.stores import BASINS, MAP, computed, counted, files, half_done

pytestmark = pytest.mark.usefixtures("instant")


@pytest.fixture
def path(tmp_path, monkeypatch):
    monkeypatch.setattr("gearchaos.store.lock._WAIT", 0.2)
    return tmp_path / "map.zarr"


@pytest.mark.parametrize("after", [0, 5, 11])
def test_a_run_that_was_interrupted_goes_on(path, made, monkeypatch, after, capsys):
    seen = []

    def advance(count):
        if sum(seen) == after:
            raise KeyboardInterrupt
        seen.append(count)

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr("gearchaos.store.run.bar", lambda *_: nullcontext(advance))
        run(MAP, path, tile=8, threads=1)
    state, tiles = blocks.State.of(open_store(path)), counted(monkeypatch)
    done = sum(state.done(open_store(path), block) for block in range(3))
    assert after < done and run(MAP, path, tile=96, progress=True) == Outcome(12, {}, 12, True, {})
    said = capsys.readouterr().err
    assert f"{path}: {done} of 12 tiles are done already\n" in said and "own tiles of 4 x 2 are kept\n" in said
    assert run(MAP, path).finished and len(tiles) == 12 - done and files(path) == files(made)
    xr.testing.assert_identical(gc.load(path), gc.run(MAP))


def test_finish_says_what_is_missing_and_computes_nothing(path, made, monkeypatch):
    half_done(path, monkeypatch)
    before, tiles = files(path), counted(monkeypatch)
    assert finish_store(path) == Outcome(11, {}, 12, False, {"1/1": 1})
    assert (said := ask("finish", path)).exit_code == 3 and said.stderr == (
        f"{path}: 11 of 12 tiles are done\nthe store is not finished; missing tiles: 1. To compute them: "
        f"gearchaos run STUDY.toml --out {path}\n")
    assert tiles == [] and files(path) == before
    blocks.work(str(path), 1, ("tile", 0))  # as of a run that was killed before it wrote the block
    assert finish_store(path).finished and tiles == [0]
    assert {n: c for n, c in files(path).items() if n != "run/failed/0"} == files(made)


def test_a_tile_that_fails_is_tried_three_times_and_named_while_the_rest_goes_on(path, made, monkeypatch):
    tiles, study = counted(monkeypatch, lambda items: 10 in items and len(items) > 1), path.with_name("study.toml")
    study.write_text('[model]\nq0 = 0.1\n[study]\nkind = "zones"\nx = "omega=0.5:1.1:12"\ny = "eps1=0.05:0.3:8"\n')
    said = ask("run", study, "--out", path, "--tile", 8)
    assert said.exit_code == 1 and "tile 5 failed: ArithmeticError: no" in said.stderr.splitlines()
    assert sorted(tiles) == sorted([0, *range(0, 12, 2), *range(48, 60, 2), 10, 10])  # one of item 0 alone, at first
    assert run(MAP, path) == Outcome(11, {5: "ArithmeticError: no"}, 12, False, {"1/1": 1})
    assert "tile 5 failed" in ask("info", path).stdout and check(open_store(path))[0] == []
    fails = iter([True, True])
    counted(monkeypatch, lambda items: next(fails, False))
    assert run(MAP, path).finished and files(path) == files(made)  # what failed is forgotten


def test_a_study_of_which_three_items_cannot_be_computed_makes_no_store(path, monkeypatch):
    counted(monkeypatch, lambda items: True)
    for tile in (8, 1000):
        with pytest.raises(gc.InputError, match="study must have work items that can be computed; got 'Arith"):
            run(MAP, path, tile=tile)
        assert not path.exists()
    for good in (0, 48, 95):
        counted(monkeypatch, lambda items, good=good: len(items) == 1 and items[0] != good)
        assert run(MAP, path.with_name(f"{good}.zarr"), tile=8).finished


@pytest.mark.parametrize("lost", ["deleted", "damaged"])
def test_a_tile_that_is_lost_before_its_block_is_written_is_computed_again(path, made, monkeypatch, lost):
    true, seen = blocks.work, []

    def work(url, threads, task):
        if task == ("block", 1) and not seen:
            seen.append(path / "run/tiles/1/8")
            seen[0].unlink() if lost == "deleted" else seen[0].write_bytes(b"words")
        return true(url, threads, task)

    monkeypatch.setattr("gearchaos.store.run.work", work)
    tiles = counted(monkeypatch)
    assert run(MAP, path, tile=8).finished and seen and tiles.count(52) == 2 and len(tiles) == 14
    assert files(path) == files(made)


def timed(path, times):
    """A store of 12 tiles, of which these are done at these times."""
    with pytest.MonkeyPatch.context() as patch:
        counted(patch, lambda items: len(items) > 1)
        assert run(MAP, path, tile=8).done == 0
        store = open_store(path)
        store.objects.delete_all("run/failed")
        for tile, at in times:
            patch.setattr("gearchaos.store.blocks.time.time", lambda at=at: at)
            blocks.write_tile(store, tile, computed(MAP, store.grid.items(tile)), 1.5)
    return store


def test_a_summary_counts_what_is_there(path):
    store = timed(path, ((0, 100.0), (1, 102.0), (3, 106.0), (8, 108.0)))
    store.objects.put("run/failed/2", b"ValueError: no")
    found, size = summary(store), sum(f.stat().st_size for f in path.rglob("*") if f.is_file())
    assert found == {
        "store": str(path), "study": "zones", "finished": False, "tiles": 12, "tiles_done": 4, "tiles_lost": 0,
        "pieces": 96, "pieces_done": 32, "failed": {"2": "ValueError: no"}, "seconds": 6.0,
        "pieces_per_second": 24 / 8, "seconds_left": 64 / 3, "machines": [socket.gethostname()[:40]], "bytes": size,
        "missing": {"tiles": 8, "files": [], "file_count": 0, "arrays": [], "pieces": [
            {"eps1": [0, 4], "omega": [4, 6]}, {"eps1": [0, 4], "omega": [8, 12]},
            {"eps1": [4, 8], "omega": [0, 4]}, {"eps1": [4, 8], "omega": [6, 12]}]},
        "running": [], "command": f"gearchaos run STUDY.toml --out {path}"}


@pytest.mark.parametrize(("pause", "counts"), [(19.9, True), (20.1, False)])
def test_the_rate_leaves_out_pauses_of_twenty_times_the_usual_step(path, pause, counts):
    store = timed(path, tuple(enumerate(map(float, np.cumsum([0.0, 1.0, 1.0, 1.0, pause])))))
    expected = 4 * 8 / (3 + pause) if counts else 3 * 8 / 3
    assert summary(store)["pieces_per_second"] == pytest.approx(expected, rel=1e-9)


def test_info_and_check_tell_a_finished_run_from_one_that_is_running_or_was_stopped(made, path, monkeypatch):
    assert "finished" in ask("info", made).stdout and summary(open_store(made))["command"] is None
    half_done(path, monkeypatch)
    assert "not finished; to continue: gearchaos run" in " ".join(ask("info", path).stdout.split())
    assert ask("check", path).stdout == f"{path}: all checksums are right; 1 of 12 tiles are not computed\n"
    with write_lock(Objects(path), Shard(2, 4)):
        assert running(Objects(path)) == [f"shard 2/4, process {os.getpid()} on host {socket.gethostname()}"]
        assert "running: shard 2/4, process" in " ".join(ask("info", path).stdout.split())
    assert running(Objects(path)) == []
    run(MAP, path)
    (path / "run/finished").unlink()
    assert ask("check", path).stdout.endswith(f"right; the store is not finished: gearchaos finish {path}\n")


def test_a_second_writer_is_refused_and_told_who_writes(path, made, monkeypatch):
    half_done(path, monkeypatch)
    for held, asked in ((None, None), (None, "1/2"), ("2/3", None), ("2/3", "1/2"), ("2/3", "2/3")):
        before = files(path)
        with write_lock(Objects(path), Shard.parse(held) if held else Shard()):
            name = f"shard {held}" if held else "a run"
            lock = f"{held.replace('/', '-of-')}.lock" if held else "all.lock"
            with pytest.raises(gc.InputError, match=rf"store must not have another writer; .*{name}, process "
                               rf"{os.getpid()} on host {socket.gethostname()}, .*delete {path}/run/locks/{lock}\."):
                run(MAP, path, shard=asked)
        assert files(path) == before
    with write_lock(Objects(path), Shard(2, 3)):
        assert run(MAP, path, shard="1/3").finished
    assert files(path) == files(made)


def test_the_lock_of_a_dead_process_is_taken_over_but_not_that_of_another_host(path, made):
    (ended := subprocess.Popen([sys.executable, "-c", ""])).wait()
    locks = path / "run/locks"
    locks.mkdir(parents=True)
    for name in ("all.lock", "2-of-3.lock"):
        (locks / name).write_text(f"{ended.pid}\n{socket.gethostname()}\n")
    assert run(MAP, path, tile=8).finished and files(path) == files(made)
    locks.mkdir(exist_ok=True)
    (locks / "2-of-3.lock").write_text("1\nnowhere\n")
    with pytest.raises(gc.InputError, match="shard 2/3, process 1 on host nowhere, is writing to it"):
        run(MAP, path)
    (locks / "2-of-3.lock").write_text("")  # as a power failure may leave it
    assert run(MAP, path).finished


def test_a_run_that_is_refused_leaves_nothing(path):
    (file := path.parent / "file").write_text("mine")
    for out, options, rule in (
            (path, {"shard": "3/2"}, "shard must read i/n"),
            (path, {"shard": f"1/{'1' * 5000}"}, "shard must read i/n"),
            (path / "s", {}, "out must lie in an existing folder"),
            (7, {}, "out must be a path"), (None, {"tile": 8}, "tile needs out"), (file, {}, "out must be a folder")):
        with pytest.raises(gc.InputError, match=rule):
            run(MAP, out, **options)
    assert [p.name for p in path.parent.iterdir()] == ["file"]


def test_shards_have_all_blocks_once_and_a_single_tile_is_computed_with_its_store(path, capsys, monkeypatch):
    grid = Grid((10,), (1,), (1,), (1,))
    assert [list(Shard(n, 3).blocks(grid)) for n in (1, 2, 3)] == [[0, 3, 6, 9], [1, 4, 7], [2, 5, 8]]
    assert list(Shard(2, 3).blocks(Grid((1,), (1,)))) == [] and Shard().lock == "all.lock"
    tiles = counted(monkeypatch)
    assert run(MAP, path, shard="3/3", tile=1000, progress=True) == Outcome(1, {}, 1, False, {}) and tiles == [0]
    assert "shard 3/3 has nothing to do: the store has 1 blocks of tiles\n" in capsys.readouterr().err
    assert Shard.parse(" 2/3") == Shard(2, 3) and (str(Shard()), str(Shard(2, 3))) == ("a run", "shard 2/3")


def test_a_row_of_a_sweep_is_never_split():
    study = gc.Zones(MAP.model, MAP.x, MAP.y, starts=2)
    for shards in (1, 2, 8, 50):
        grid = with_blocks(divide(study, 1), 8, 100, shards)
        assert grid.tile == (1, 12) and grid.block[1] == 12


@pytest.mark.parametrize("order", [(1, 2, 3), (3, 1, 2)])
def test_shards_share_no_block_and_the_last_one_finishes(path, made, monkeypatch, order):
    written = {}
    for number in order:
        tiles = counted(monkeypatch)
        outcome = run(MAP, path, tile=8, shard=f"{number}/3")
        grid = open_store(path).grid
        written[number] = {grid.items(t)[0] for b in Shard(number, 3).blocks(grid) for t in grid.tiles_of(b)}
        assert set(tiles) - {0} <= written[number]
        missing = {f"{n}/3": 4 for n in {1, 2, 3} - written.keys()}
        assert (outcome.finished, outcome.missing, outcome.done) == (not missing, missing, 4 * len(written))
    assert sum(map(len, written.values())) == 12 and gc.load(path).equals(gc.load(made))


def test_a_shard_that_begins_at_once_with_another_shares_its_store(path, made, monkeypatch):
    """The other one makes the store and computes all its tiles, while this one looks how large results are."""
    def late(*arguments):
        monkeypatch.setattr("gearchaos.store.run._create", _create)
        assert run(MAP, path, tile=8, shard="2/2").missing.keys() == {"1/2"}
        _create(*arguments)

    monkeypatch.setattr("gearchaos.store.run._create", late)
    outcome = run(MAP, path, tile=8, shard="1/2")
    assert outcome.finished and outcome.done == outcome.count == 12 and gc.load(path).equals(gc.load(made))


def test_a_shard_mends_its_own_blocks_alone_but_finishes_no_damaged_store(path, made, monkeypatch):
    run(MAP, path, tile=8)
    Objects(path).delete(["label/c/0/0", "label/c/0/1"])
    tiles = counted(monkeypatch)
    run(MAP, path, shard="1/2")
    assert set(tiles) == {0, 2, 48, 50} and check(open_store(path))[0] == ["label/c/0/1"]
    assert run(MAP, path, shard="2/2").finished and files(path) == files(made)


@pytest.mark.slow
@pytest.mark.parametrize("mended", [True, False])
def test_no_attractors_are_found_among_results_that_another_shard_has_lost(path, monkeypatch, mended):
    compute = gc.Basins.compute

    def other_ends(study, items, **options):
        monkeypatch.setattr(gc.Basins, "compute", compute)
        outcome = run(BASINS, path, shard="2/2")
        assert (outcome.finished, outcome.missing) == (False, {"1/2": 1})
        return compute(study, items, **options)

    run(BASINS, path, tile=8, shard="1/2")
    Objects(path).delete([open_store(path).shard("label", 0)])
    if mended:
        monkeypatch.setattr(gc.Basins, "compute", other_ends)
        assert run(BASINS, path, shard="1/2").finished
    else:
        other_ends(BASINS, np.arange(1))
        with pytest.warns(UserWarning, match="files of label are missing"):
            gc.load(path)
        assert finish_store(path).finished
    assert gc.load(path).equals(gc.run(BASINS))


def test_a_run_in_an_object_store_has_the_same_objects(made):
    url = f"memory://bucket/{os.getpid()}/map.zarr"
    assert run(MAP, url, tile=8).finished and gc.load(url).equals(gc.load(made))
    assert set(Objects(url).names()) == files(made).keys()
    assert ask("check", url).stdout == f"{url}: all checksums are right\n"
    Objects(url).delete(["label/c/0/1"])
    assert json.loads(ask("info", url, "--json").stdout)["missing"]["files"] == ["label/c/0/1"]
    assert ask("check", url).exit_code == 1 and ask("finish", url).exit_code == 0
    assert Objects(url).get("label/c/0/1") == files(made)["label/c/0/1"]


def test_a_shard_leaves_what_others_may_be_writing_and_a_single_run_clears_it(path):
    for shards, left in (((1, 2), True), ((1,), False)):
        for number in shards:
            run(MAP, path, tile=8, shard=f"{number}/{len(shards)}")
            (half := path / f"label/c/0/0.{'0' * 32}.partial").write_bytes(b"half")
        assert run(MAP, path, shard=f"{shards[-1]}/{len(shards)}").finished
        (path / "run/finished").unlink()
        assert run(MAP, path, shard=f"{shards[-1]}/{len(shards)}").finished and half.exists() == left


@pytest.mark.parametrize("name", ["run/blocks", "run/tiles/1", "run/locks"])
def test_what_has_the_place_of_a_folder_of_the_store_is_named_with_what_to_do(path, name):
    run(MAP, path, tile=8, shard="1/3")
    shutil.rmtree(path / name, ignore_errors=True)
    (path / name).parent.mkdir(exist_ok=True)
    (path / name).write_bytes(b"")
    words = "free of others" if name == "run/locks" else "Remove what is in the place of a file of the store.*" + name
    with pytest.raises((OSError, gc.InputError), match=words):
        run(MAP, path)
