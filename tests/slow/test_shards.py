"""Shards that share a store: who computes what, who finishes, and what is said if somebody is missing."""

import errno
import json
import os
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import pytest
from typer.testing import CliRunner

import gearchaos as gc
from gearchaos.cli import app
from gearchaos.execute import pools
from gearchaos.store.files.folder import LocalFolder
from gearchaos.store.journals.journal import Journal, Packed, TileEntry, decoded_line
from gearchaos.store.journals.progress import Progress
from gearchaos.store.layout.groups import pack
from gearchaos.store.running.run import finish_store
from gearchaos.store.running.run import run_into_store as run
from gearchaos.store.running.worker import compute_tile
from gearchaos.store.store import FINISHED, open_store
from gearchaos.store.tiles import Grid
from gearchaos.store.writers.claims import Claims
from gearchaos.store.writers.shards import Shard, latest_division, missing_by_shard, owners
from tests.slow.one_shard import STUDY


def files(path):
    """The bytes of all files but the record of the run, by name."""
    every = {p.relative_to(path): p.read_bytes() for p in path.rglob("*") if p.is_file()}
    return {name: data for name, data in every.items() if name.parts[0] != "run"}


def tiles_of(path, writer):
    """The tiles in the journal of a writer."""
    lines = map(decoded_line, (path / "run" / "journal" / f"{writer}.jsonl").read_bytes().splitlines())
    return [line.tile for line in lines if isinstance(line, TileEntry)]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """An undisturbed run in tiles of 4 cells: 48 tiles, one group."""
    path = tmp_path_factory.mktemp("whole") / "s.zarr"
    run(STUDY, path, tile=4)
    return path


@pytest.fixture
def empty(tmp_path):
    """The same store without any tile."""
    path = tmp_path / "s.zarr"
    run(STUDY, path, tile=4, shard=Shard(99, 99))
    return path


def start(path, shard, *options):
    command = [sys.executable, "-m", "tests.slow.one_shard", str(path), shard, *map(str, options)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, text=True)


def outcome(process):
    said, _ = process.communicate(timeout=300)
    assert process.returncode == 0
    return json.loads(said)


def wait_for(condition):
    until = time.monotonic() + 120
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.02)


def begun(path, writer):
    return (path / "run" / "claims" / f"{writer}.jsonl").exists()


def test_a_shard_that_is_done_takes_over_tiles_of_one_that_is_not(whole, empty):
    slow = start(empty, "1/2", "--sleep", 0.5)
    wait_for(lambda: begun(empty, "1-of-2"))
    fast = start(empty, "2/2")
    outcomes = [outcome(slow), outcome(fast)]
    first, second = tiles_of(empty, "1-of-2"), tiles_of(empty, "2-of-2")
    assert any(found["finished"] for found in outcomes)
    assert set(first) | set(second) == set(range(48)) and len(second) > 24
    assert set(second) - set(range(1, 48, 2)) <= set(range(0, 48, 2)) and max(first) < 46  # from the end
    assert files(empty) == files(whole) and not (empty / "run" / "segments").exists()


def test_a_shard_that_was_killed_is_helped_but_one_that_never_began_is_not(whole, empty):
    killed = start(empty, "1/2", "--sleep", 0.2)
    wait_for(lambda: begun(empty, "1-of-2") and len(tiles_of(empty, "1-of-2")) > 2)
    killed.kill()
    killed.communicate()
    assert len(tiles_of(empty, "1-of-2")) < 24
    assert outcome(start(empty, "2/2"))["finished"]
    assert files(empty) == files(whole)


def test_a_shard_alone_says_who_is_missing(empty):
    found = outcome(start(empty, "2/4"))
    assert found["done"] == 12 and not found["finished"]
    assert found["missing"] == {"1/4": 12, "3/4": 12, "4/4": 12}


@pytest.mark.parametrize("count", [2, 3])
def test_shards_that_do_not_see_each_other_finish_in_the_end(whole, empty, count):
    """The files of the others are hidden for some seconds, longer than the whole run takes."""
    shards = [start(empty, f"{i}/{count}", "--sleep", 0.1, "--stale", 8) for i in range(1, count + 1)]
    outcomes = [outcome(shard) for shard in shards]
    assert [found["finished"] for found in outcomes].count(True) == 1
    assert open_store(empty).finished and files(empty) == files(whole)


@pytest.mark.parametrize("error", [OSError(errno.ENOLCK, "no locks"), NotImplementedError("no locks")])
def test_without_locks_nothing_is_taken_over_but_the_store_is_finished(whole, empty, monkeypatch, error):
    def refuse(*_):
        raise error

    monkeypatch.setattr(LocalFolder, "lock", refuse)
    said = []
    first = run(STUDY, empty, shard=Shard(1, 2), say=said.append)
    assert not first.finished and first.missing == {"2/2": 24}
    assert any("has no locks" in line for line in said)
    assert run(STUDY, empty, shard=Shard(2, 2)).finished
    assert len(tiles_of(empty, "1-of-2")) == len(tiles_of(empty, "2-of-2")) == 24
    assert files(empty) == files(whole)


def test_a_lock_that_cannot_be_written_is_an_error(empty, monkeypatch):
    def refuse(*_):
        raise OSError(errno.ENOSPC, "no space")

    monkeypatch.setattr(LocalFolder, "lock", refuse)
    with pytest.raises(OSError, match="no space"):
        run(STUDY, empty)


def test_the_command_finish_finishes_or_says_what_is_missing(whole, empty):
    def finish(*options):
        return CliRunner().invoke(app, ["finish", str(empty), *options], catch_exceptions=False)

    run(STUDY, empty, shard=Shard(1, 2))
    said = finish("--json")
    assert said.exit_code == 3
    assert json.loads(said.stdout) | {"store": ""} == {
        "store": "", "tiles": 48, "done": 24, "failed": 0, "finished": False, "missing": {"2/2": 24},
    }
    said = finish().stderr
    assert "missing tiles: 24 of shard 2/2\n" in said and "Run those that are not running: --shard 2/2\n" in said
    run(STUDY, empty, shard=Shard(2, 2))
    (empty / "run" / "finished").unlink()
    said = finish("--json")
    assert said.exit_code == 0 and json.loads(said.stdout)["finished"] and open_store(empty).finished
    assert files(empty) == files(whole)
    assert finish_store(empty).finished


STUCK = """
import os, sys, time
import gearchaos as gc
from gearchaos.execute import pools
from gearchaos.store.running.run import WORKER_MODULES, run_into_store
from tests.slow.one_shard import STUDY

true = gc.Zones.compute

def compute(study, items, **options):
    if len(items) > 1 and 0 in items:
        try:
            os.close(os.open(sys.argv[1] + "-stuck", os.O_CREAT | os.O_EXCL))
        except FileExistsError:
            pass
        else:
            time.sleep(1e6)
    time.sleep(0.05)
    return true(study, items, **options)

gc.Zones.compute = compute
if __name__ == "__main__":
    print(run_into_store(STUDY, sys.argv[1], pool=pools.process_pool(2, WORKER_MODULES)).finished)
"""


def test_a_tile_that_takes_for_ever_is_computed_a_second_time(whole, empty, tmp_path):
    """The first copy never ends: its process is terminated."""
    script = tmp_path / "stuck.py"
    script.write_text(STUCK)
    paths = os.pathsep.join([str(Path(__file__).parents[2]), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run(
        [sys.executable, str(script), str(empty)], env={**os.environ, "PYTHONPATH": paths}, capture_output=True,
        text=True, timeout=300,
    )
    assert done.stdout == "True\n", done.stderr
    assert (tmp_path / "s.zarr-stuck").exists() and files(empty) == files(whole)


def test_a_stopped_pool_ends_its_processes():
    with pools.process_pool(1)() as pool:
        future = pool.submit(time.sleep, 1e6)
        assert pool.stop is not None
        wait_for(future.running)
        pool.stop()
    assert future.exception() is not None


def test_shards_that_finish_at_once_write_the_same(whole, empty):
    for _ in range(3):
        with ThreadPoolExecutor(4) as pool:
            found = list(pool.map(lambda i: run(STUDY, empty, shard=Shard(i, 4)), range(1, 5)))
        assert any(one.finished for one in found) and files(empty) == files(whole)
        (empty / "run" / "finished").unlink()


def test_a_file_deleted_by_the_shard_that_finishes_is_no_error(whole, empty, monkeypatch):
    run(STUDY, empty, shard=Shard(2, 2))
    ways = []

    def packed_by_another(store, group, entries):
        Journal(store.folder, "2-of-2").append(Packed(group, pack(store, group, entries), time.time()))
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(empty / "label/c/0/0"))

    def computed_by_another(url, *options):
        ways.append("tile")
        Journal(LocalFolder(empty), "2-of-2").append(compute_tile(url, *options))
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(empty / "run/segments"))

    monkeypatch.setattr("gearchaos.store.running.worker.pack", packed_by_another)
    monkeypatch.setattr("gearchaos.store.running.coordinator.compute_tile", computed_by_another)
    assert run(STUDY, empty, shard=Shard(1, 2)).finished and files(empty) == files(whole) and ways


def test_a_shard_that_ends_while_another_one_finishes_the_store_is_no_error(whole, empty, monkeypatch):
    true = os.link

    def link(partial, path):
        monkeypatch.undo()
        assert run(STUDY, empty, shard=Shard(2, 2)).finished  # it deletes run/ended and what is left of killed writers
        true(partial, path)

    monkeypatch.setattr(os, "link", link)
    assert run(STUDY, empty, shard=Shard(1, 2)).finished and files(empty) == files(whole)


def test_a_shard_finishes_the_store_though_another_one_ends_at_that_time(whole, empty, monkeypatch):
    run(STUDY, empty, shard=Shard(1, 2))
    true = shutil.rmtree

    def rmtree(path):
        if path == empty / "run/ended":
            raise OSError(errno.ENOTEMPTY, os.strerror(errno.ENOTEMPTY), str(path))
        true(path)

    monkeypatch.setattr(shutil, "rmtree", rmtree)
    assert run(STUDY, empty, shard=Shard(2, 2)).finished and open_store(empty).finished
    monkeypatch.undo()
    assert files(empty) == files(whole)


def test_the_bar_counts_the_tiles_of_all_shards_and_those_that_are_lost(empty, monkeypatch):
    bars = []

    @contextmanager
    def bar(name, total, done):
        bars.append([name, total, done])
        yield bars[-1].append

    monkeypatch.setattr("gearchaos.store.running.run.bar", bar)
    run(STUDY, empty, shard=Shard(1, 2), progress=True)
    run(STUDY, empty, shard=Shard(2, 2), progress=True)
    (empty / "label/c/0/0").unlink()
    run(STUDY, empty, progress=True)
    assert [one[:3] for one in bars] == [["tiles", 48, 0], ["tiles", 48, 24], ["tiles", 48, 48]]
    assert [sum(one[2:]) for one in bars] == [24, 48, 48] and min(bars[2][3:]) < 0


def test_the_last_shard_waits_until_it_sees_all_files_of_tiles_that_are_done(empty, monkeypatch):
    seen = iter([False, False, True])
    monkeypatch.setattr("gearchaos.store.running.finish.finish", lambda coordinator, **options: next(seen))
    assert not run(STUDY, empty, shard=Shard(1, 2)).finished
    assert run(STUDY, empty, shard=Shard(2, 2)).finished and next(seen, None) is None


def test_a_shard_that_begins_late_leaves_a_store_finished_that_others_have_just_finished(empty, monkeypatch):
    """It sees their journals some time after it sees that the store is finished."""
    for number in (1, 2):
        run(STUDY, empty, shard=Shard(number, 2))
    deleted, begin = [], time.monotonic()
    delete, refresh = LocalFolder.delete, Progress.refresh

    def late(self, writers=None):
        refresh(self, writers if time.monotonic() > begin + 1.0 else ["1-of-2"])

    monkeypatch.setattr(LocalFolder, "delete", lambda self, name: (deleted.append(name), delete(self, name)))
    monkeypatch.setattr(Progress, "refresh", late)
    assert run(STUDY, empty, shard=Shard(1, 2)).finished and time.monotonic() > begin + 1.0
    assert FINISHED not in deleted


def test_tiles_belong_to_one_shard_each():
    few, many = Grid((24, 16), (2, 2), (4, 4), (8, 8)), Grid((32, 64), (2, 2), (2, 2), (4, 4))
    for grid in (few, many):
        shards = [Shard(i, 3) for i in (1, 2, 3)]
        parts = [list(shard.tiles(grid)) for shard in shards]
        assert sorted(tile for part in parts for tile in part) == list(range(grid.count))
        assert dict(owners(grid, 3)) == {tile: i for i, part in enumerate(parts, 1) for tile in part}
        assert [next(s.number for s in shards if s.packs(g)) for g in range(4)] == [1, 2, 3, 1]
    groups = [{many.group_of(tile) for tile in Shard(i, 3).tiles(many)} for i in (1, 2, 3)]
    assert not groups[0] & groups[1] and not groups[1] & groups[2]  # with many groups each shard has its own
    order = [many.group_of(tile) for tile in Shard(2, 3).tiles(many)]
    assert order == sorted(order)


def test_what_is_missing_is_told_by_shard_of_the_latest_division(empty):
    store = open_store(empty)
    assert missing_by_shard(store.grid, store.progress(), 5) == {"1/5": 10, "2/5": 10, "3/5": 10, "4/5": 9, "5/5": 9}
    assert latest_division([("all", 3.0), ("2-of-4", 5.0), ("nonsense", 9.0), ("0-of-3", 9.0)]) == 4
    assert latest_division([]) == 1


def test_claims_are_read_as_they_are_added(tmp_path):
    folder = LocalFolder(tmp_path)
    owner, thief = Claims(folder, "1-of-2"), Claims(folder, "1-of-2")
    owner.begin(3)
    assert thief.refresh() == set() and thief.workers == 3
    with thief.lock() as locked:
        assert locked
        thief.add([7, 8], "2-of-2")
    assert owner.refresh() == {7, 8} and owner.refresh() == set()
    with (tmp_path / "run" / "claims" / "1-of-2.jsonl").open("ab") as file:
        file.write(b'nonsense\n[1]\n{"tiles": 3}\n{"workers": 1e999}\n{"tiles": [9]}\n{"tiles": [10')
    assert owner.refresh() == {9}
    owner.begin(2)
    assert owner.refresh() == set() and owner.tiles == set()


def test_a_study_is_given_to_a_shard_that_no_command_names():
    with pytest.raises(gc.InputError, match="shard must read i/n"):
        Shard(4, 3)
