"""Stores survive power failures and damage: what was promised is there, the rest is computed again, nothing is zero."""

import importlib.util
import json
import os
import random
import shutil
import subprocess
import sys
import time
import zlib
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import gearchaos as gc
from gearchaos.cli import app
from gearchaos.store import tiles as store_tiles
from gearchaos.store.journals import journal as journals
from gearchaos.store.journals import progress
from gearchaos.store.running.run import run_into_store
from gearchaos.store.store import open_store
from gearchaos.studies.zones import Zones
from tests.slow.power_failure import STRACE, Call, Disk, Loss, calls, read_files, survivors, write_files

INSTANT = Path(__file__).parents[2] / "benchmarks" / "storage" / "instant.py"
GROUP_BYTES = 1024
"""Size of a group of the arrays of 8 bytes: 128 cells, eight tiles, so that small maps have several groups."""

STUDY = """
[model]
q0 = 0.1
[study]
kind = "zones"
x = "omega=0.5:1.1:30"
y = "eps1=0.05:0.3:20"
"""
TILE = 16

LOSSES = [Loss("lost", "lost"), Loss("lost", "zeros"), Loss("kept", "lost"), Loss("kept", "zeros"), Loss("any", "any")]

needs_strace = pytest.mark.skipif(shutil.which("strace") is None, reason="needs strace")


def the_map():
    axes = gc.Axis("omega", 0.5, 1.1, 30), gc.Axis("eps1", 0.05, 0.3, 20)
    return gc.Zones(gc.MeshModel.of(q0=0.1), *axes)


@pytest.fixture(autouse=True)
def instant(monkeypatch, tmp_path):
    """Cells that take no time to compute, and groups of few tiles; returns the file that names the tiles computed."""
    monkeypatch.setattr(Zones, "compute", Zones.compute)  # restored at the end
    spec = importlib.util.spec_from_file_location("instant", INSTANT)
    spec.loader.exec_module(importlib.util.module_from_spec(spec))
    monkeypatch.setattr(store_tiles, "_CHUNK_BYTES", GROUP_BYTES // 2)
    monkeypatch.setattr(store_tiles, "_GROUP_BYTES", GROUP_BYTES)
    monkeypatch.setenv("INSTANT_LOG", str(tmp_path / "tiles.log"))
    return tmp_path / "tiles.log"


def run(path, **options):
    outcome = run_into_store(the_map(), path, tile=TILE, **options)
    assert (outcome.done, outcome.failed) == (outcome.count, {})


def results(path):
    """The bytes of all files but the record of the run, by name."""
    every = {str(p.relative_to(path)): p.read_bytes() for p in path.rglob("*") if p.is_file()}
    return {name: content for name, content in every.items() if not name.startswith("run/")}


def first_cells(log):
    """The numbers of the first cells of the tiles that were computed."""
    return [int(line.split()[1]) for line in log.read_text().splitlines()] if log.exists() else []


def promised(path):
    """The tiles that the journals of a store say are done and not lost since, read independently."""
    done = set()
    for journal in sorted((path / "run" / "journal").glob("*.jsonl")):
        for line in journal.read_bytes().split(b"\n")[:-1]:  # a line without end is torn
            checksum, _, content = line.partition(b" ")
            if checksum == b"%08x" % zlib.crc32(content) and json.loads(content)["kind"] == "tile":
                done.add(json.loads(content)["tile"])
    return done


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A finished store of an undisturbed run."""
    path = tmp_path_factory.mktemp("whole") / "map.zarr"
    with pytest.MonkeyPatch.context() as patch:
        instant.__wrapped__(patch, path.parent)
        run(path)
    return path


@pytest.fixture
def finished(whole, tmp_path):
    return Path(shutil.copytree(whole, tmp_path / "map.zarr"))


# Power failures


@dataclass(frozen=True)
class Recording:
    """A run that was recorded.

    Attributes
    ----------
    root : Path
        The folder in which it had its store, ``map.zarr``.
    before : dict of str to bytes
        Files of the folder at the beginning.
    calls : list of Call
        System calls that changed it or made changes durable.
    """

    root: Path
    before: dict[str, bytes]
    calls: list[Call]

    def after_power_failure(self, count, loss, rng):
        """Files of the folder where the power failed after so many calls."""
        disk = Disk(self.root, self.before)
        for call in self.calls[:count]:
            disk.apply(call)
        return survivors(disk.tree, loss, rng)


def command_of_a_process(root, *options, prefix=(), **environment):
    """The result of the command that computes the map into a store in this folder, in a process of its own."""
    (root / "study.toml").write_text(STUDY)
    command = ["run", str(root / "study.toml"), "--out", str(root / "map.zarr"), "--tile", str(TILE), *options]
    return subprocess.run([*prefix, sys.executable, str(INSTANT), *command], capture_output=True, text=True,
                          env=os.environ | {"INSTANT_GROUP_BYTES": str(GROUP_BYTES)} | environment)


def record(root, *options):
    """Record the command that computes the map into a store in this folder."""
    (root / "study.toml").write_text(STUDY)
    before, trace = read_files(root), root.with_name(f"{root.name}.strace")
    disk = Disk(root, before)
    ended = command_of_a_process(root, *options, prefix=(*STRACE, str(trace)))
    assert ended.returncode == 0, ended.stderr
    changes = [call for call in calls(trace) if disk.apply(call)]
    assert survivors(disk.tree, Loss("kept", "kept"), random.Random()) == read_files(root)  # the model is right
    return Recording(root, before, changes)


@pytest.fixture(scope="module", params=[["--threads", "2"], ["--processes", "2"]], ids=["threads", "processes"])
def recording(request, tmp_path_factory):
    return record(tmp_path_factory.mktemp("recorded"), *request.param)


def resumes(folder, whole, log):
    """A store that is left in a folder can be resumed, computes nothing again that was promised, has the same bytes."""
    path = folder / "map.zarr"
    kept = promised(path)
    log.unlink(missing_ok=True)
    run(path)
    assert results(path) == results(whole)
    store = open_store(path)
    assert store.finished
    computed = {store.grid.items(tile)[0]: tile for tile in range(store.grid.count)}
    assert not kept & {computed[cell] for cell in first_cells(log)}
    return len(kept)


@needs_strace
@pytest.mark.parametrize("loss", LOSSES, ids=lambda loss: f"entries {loss.entries}, content {loss.content}")
@pytest.mark.parametrize("points", [8, pytest.param(200, marks=pytest.mark.exhaustive)])
def test_after_a_power_failure_a_run_has_the_same_bytes(recording, whole, tmp_path, instant, loss, points):
    rng, kept = random.Random(f"{loss}"), []
    for number in range(points):
        count, folder = rng.randrange(len(recording.calls) + 1), tmp_path / str(number)
        write_files(recording.after_power_failure(count, loss, rng), folder)
        kept.append(resumes(folder, whole, instant))
    assert max(kept) > 0, "the power always failed before the first tile"


@needs_strace
def test_what_a_finished_run_leaves_is_durable(recording, whole):
    """When the command has ended, a power failure takes nothing."""
    rng = random.Random()
    last = recording.after_power_failure(len(recording.calls), Loss("lost", "lost"), rng)
    files = {name: content for name, content in last.items() if name.startswith("map.zarr/") and not name.endswith("/")}
    store = {name.removeprefix("map.zarr/"): content for name, content in files.items()}
    assert {n: c for n, c in store.items() if not n.startswith("run/")} == results(whole)
    assert "run/finished" in store


@needs_strace
def test_power_fails_again_during_the_resumed_run(recording, whole, tmp_path, instant):
    rng = random.Random(5)
    first = tmp_path / "first"
    write_files(recording.after_power_failure(len(recording.calls) // 2, Loss("any", "any"), rng), first)
    again = record(first)
    for number in range(8):
        folder = tmp_path / str(number)
        count = rng.randrange(len(again.calls) + 1)
        write_files(again.after_power_failure(count, Loss("lost", "lost"), rng), folder)
        resumes(folder, whole, instant)


MADE = {"journal": "/run/journal/all.jsonl", "segments": "/run/segments", "group files": "/label/c/0"}


@needs_strace
@pytest.mark.parametrize("name", MADE.values(), ids=MADE)
def test_a_killed_run_makes_nothing_less_durable(recording, whole, name, request):
    """A run is killed as soon as it has made a file or folder; another one finishes it; then the power fails."""
    made = next(n for n, call in enumerate(recording.calls, 1) if made_by(call).endswith(name))
    disk = Disk(recording.root, recording.before)
    for call in recording.calls[:made]:
        disk.apply(call)
    shutil.rmtree(recording.root)
    write_files(survivors(disk.tree, Loss("kept", "kept"), random.Random()), recording.root)
    trace = recording.root.with_name(f"{request.node.name}.strace".replace("/", "_"))
    assert command_of_a_process(recording.root, prefix=(*STRACE, str(trace))).returncode == 0
    for call in calls(trace):
        disk.apply(call)
    files = survivors(disk.tree, Loss("lost", "lost"), random.Random())
    journals_left = [content for name, content in files.items() if name.startswith("map.zarr/run/journal/")]
    assert {f"map.zarr/{n}": c for n, c in results(whole).items()}.items() <= files.items()
    assert "map.zarr/run/finished" in files and any(journals_left)


def made_by(call):
    """The path of the file or folder that a call makes, empty if it makes none."""
    if call.name in ("mkdir", "mkdirat") or (call.name == "openat" and "O_CREAT" in str(call.arguments[2])):
        return os.fsdecode(call.arguments[0 if call.name == "mkdir" else 1])
    return ""


# Damaged and missing files


def command(*arguments):
    """The result of a command, called in this process."""
    return CliRunner().invoke(app, list(map(str, arguments)))


def group_files(path, name):
    return sorted(p for p in (path / name / "c").rglob("*") if p.is_file())


def lose(file):
    file.unlink()
    return file


def empty(file):
    file.write_bytes(b"")
    return file


def cut(file):
    file.write_bytes(file.read_bytes()[:-7])
    return file


def flip(file, rng):
    content = bytearray(file.read_bytes())
    content[rng.randrange(len(content))] ^= 1 << rng.randrange(8)
    file.write_bytes(content)
    return file


def without_zeros(dataset):
    """Whether the values of cells are results, which are never zero here, or say that they are not computed."""
    return all((np.asarray(values) != 0).all() for values in dataset.data_vars.values())


@pytest.mark.parametrize("damage", [lose, cut], ids=["missing", "cut short"])
@pytest.mark.parametrize("name", ["lyapunov", "label"])
def test_a_lost_file_of_a_finished_store_never_reads_as_zeros(finished, tmp_path, whole, name, damage):
    lost = damage(group_files(finished, name)[1])
    with pytest.warns(UserWarning, match=f"files of {name} are missing or damaged for 8 of 40 tiles"):
        loaded = gc.load(finished)
    if damage is lose:
        values = loaded.load()
        assert without_zeros(values)
        missing = np.isnan(values[name]) if name == "lyapunov" else values[name] == -1
        assert 0 < int(missing.sum()) <= 128
    else:
        with pytest.raises(gc.InputError, match=str(lost.relative_to(finished))):
            loaded.load()
    told = json.loads(command("info", finished, "--json").stdout)
    assert str(lost.relative_to(finished)) in json.dumps(told["missing"])
    assert str(lost.relative_to(finished)) in command("info", finished).stdout.replace("\n", "")
    exported = command("export", finished, "--out", tmp_path / "out.nc")
    assert exported.exit_code != 0 or without_zeros(xr.load_dataset(tmp_path / "out.nc"))
    assert "missing" in exported.stderr or "not computed" in exported.stderr
    drawn = command("plot", finished, "--out", tmp_path / "out.png")
    assert drawn.exit_code in (0, 2), drawn.output
    run(finished)
    assert results(finished) == results(whole)
    assert json.loads(command("info", finished, "--json").stdout)["missing"]["file_count"] == 0
    xr.testing.assert_identical(gc.load(finished).load(), xr.open_zarr(whole).load())


def test_a_missing_file_is_not_zero_for_other_programs(finished):
    for name in ("lyapunov", "label", "period", "reason"):
        lose(group_files(finished, name)[0])
    assert without_zeros(xr.open_zarr(finished, mask_and_scale=False).load())
    assert without_zeros(xr.open_zarr(finished).load().fillna(-1))


def test_check_finds_every_flipped_bit(finished, whole):
    rng, files = random.Random(2), [f for f in finished.rglob("c/**/*") if f.is_file()]
    assert command("check", finished).exit_code == 0
    for _ in range(40):
        name = flip(rng.choice(files), rng).relative_to(finished)
        checked = command("check", finished, "--json")
        assert checked.exit_code == 1 and str(name) in checked.stdout, name
        shutil.copy(whole / name, finished / name)
    flip(finished / name, rng)
    assert command("check", finished).exit_code == 1
    run(finished)
    assert command("check", finished).exit_code == 0 and results(finished) == results(whole)


@pytest.fixture(scope="module")
def interrupted(tmp_path_factory):
    """A store of which about half of 40 tiles are done, some of them in group files and some in segments."""
    folder = tmp_path_factory.mktemp("interrupted")
    assert command_of_a_process(folder, "--threads", "1", INSTANT_STOP="22").returncode == 130
    assert 20 <= len(promised(folder / "map.zarr")) < 30
    return folder / "map.zarr"


@pytest.fixture
def unfinished(interrupted, tmp_path):
    return Path(shutil.copytree(interrupted, tmp_path / "map.zarr"))


def journal(path):
    (only,) = (path / "run" / "journal").glob("*.jsonl")
    return only


def tiles_done(path):
    return open_store(path).progress().done_count


def test_a_journal_cut_anywhere_promises_what_its_whole_lines_say(unfinished, whole, tmp_path, instant):
    content, shortest = journal(unfinished).read_bytes(), tiles_done(unfinished)
    for size in range(len(content), len(content) - 301, -1):
        journal(unfinished).write_bytes(content[:size])
        done = tiles_done(unfinished)
        assert done == len(promised(unfinished)) <= shortest
        shortest = done
    for size in range(len(content) - 300, len(content), 59):
        folder = tmp_path / str(size)
        shutil.copytree(unfinished, folder / "map.zarr")
        journal(folder / "map.zarr").write_bytes(content[:size])
        resumes(folder, whole, instant)


def segments(path):
    return sorted((path / "run" / "segments").iterdir())


@pytest.mark.parametrize("bytes_left", [0, 1, 0.5, -1])
def test_a_segment_that_is_cut_loses_only_its_end(unfinished, whole, bytes_left):
    segment = max(segments(unfinished), key=lambda file: file.stat().st_size)
    content = segment.read_bytes()
    segment.write_bytes(content[:int(len(content) * bytes_left) if 0 < bytes_left < 1 else bytes_left])
    run(unfinished)
    assert results(unfinished) == results(whole)


def test_a_flipped_bit_in_a_segment_is_found(unfinished, whole):
    rng = random.Random(3)
    for segment in segments(unfinished):
        flip(segment, rng)
    run(unfinished)
    assert results(unfinished) == results(whole)


JOURNALS = {
    "empty": lambda content: b"",
    "one line twice": lambda content: content + content.splitlines(keepends=True)[5],
    "all lines twice": lambda content: content * 2,
    "in reverse": lambda content: b"".join(reversed(content.splitlines(keepends=True))),
    "half a line in the middle": lambda content: content[:-200] + b"\n" + content[-200:],
    "zeros at the end": lambda content: content + bytes(4096),
    "zeros in the middle": lambda content: content[:-300] + bytes(300) + content[-300:],
    "no end of line": lambda content: content.rstrip(b"\n"),
    "text": lambda content: content + "nothing of a journal, é\n".encode("latin-1"),
}


@pytest.mark.parametrize("damage", JOURNALS.values(), ids=JOURNALS)
def test_a_damaged_journal_is_as_good_as_its_whole_lines(unfinished, whole, instant, damage):
    journal(unfinished).write_bytes(damage(journal(unfinished).read_bytes()))
    resumes(unfinished.parent, whole, instant)
    again = len(first_cells(instant))
    run(unfinished)
    assert len(first_cells(instant)) == again, "a finished store computes nothing"


def test_two_journals_may_have_the_same_tiles(unfinished, whole, instant):
    content = journal(unfinished).read_bytes()
    for writer in ("1-of-2", "2-of-2"):
        journal_of = unfinished / "run" / "journal" / f"{writer}.jsonl"
        journal_of.write_bytes(content)
    resumes(unfinished.parent, whole, instant)


def test_a_journal_of_which_a_file_is_lost_goes_on(whole, tmp_path, instant, monkeypatch):
    """A journal is continued in a new file after some lines; each of its files may be damaged."""
    monkeypatch.setattr(journals, "LINES_PER_FILE", 10)
    monkeypatch.setattr(progress, "LINES_PER_FILE", 10)
    path = tmp_path / "first" / "map.zarr"
    path.parent.mkdir()
    run(path)
    files = sorted((path / "run" / "journal").iterdir())
    assert len(files) > 3
    for number, damage in product(range(len(files)), (lose, empty, cut)):
        folder = Path(shutil.copytree(path.parent, tmp_path / f"{number}{damage.__name__}"))
        damage(folder / "map.zarr" / "run" / "journal" / files[number].name)
        run(folder / "map.zarr")
        assert results(folder / "map.zarr") == results(whole)
        again = len(first_cells(instant))
        run(folder / "map.zarr")
        what = f"{files[number].name}, {damage.__name__}: a finished store computes nothing"
        assert len(first_cells(instant)) == again, what
        assert tiles_done(folder / "map.zarr") == 40


def rewritten(content, change):
    """A journal of which a function changes each line."""
    lines = [json.loads(line.partition(b" ")[2]) for line in content.splitlines() if line]
    texts = [json.dumps(change(line)).encode() for line in lines]
    return b"".join(b"%08x %s\n" % (zlib.crc32(text), text) for text in texts)


def test_a_clock_that_was_ahead_does_not_hide_what_is_computed_again(unfinished, whole, tmp_path):
    """The results of a tile are lost that a machine with a clock an hour ahead computed."""
    lost = {"kind": "lost", "tiles": [0, 1], "groups": [0], "at": time.time() + 3600}
    content = rewritten(journal(unfinished).read_bytes(), lambda line: line | {"at": line["at"] + 3590})
    text = json.dumps(lost).encode()
    journal(unfinished).write_bytes(content + b"%08x %s\n" % (zlib.crc32(text), text))
    run(unfinished)
    assert results(unfinished) == results(whole)
    assert tiles_done(unfinished) == 40 and open_store(unfinished).finished


@pytest.mark.parametrize("count", [2, 3])
def test_shards_finish_though_each_sees_old_files_of_the_others(whole, tmp_path, count):
    """Each process sees files of others as it saw them first, for longer than the run takes."""
    with ThreadPoolExecutor(count) as pool:
        options = [("--json", "--shard", f"{number}/{count}") for number in range(1, count + 1)]
        shards = [pool.submit(command_of_a_process, tmp_path, *each, INSTANT_STALE="5") for each in options]
    said = [json.loads(shard.result().stdout) for shard in shards]
    assert open_store(tmp_path / "map.zarr").finished and any(told["finished"] for told in said)
    assert results(tmp_path / "map.zarr") == results(whole)
    for told, shard in zip(said, shards, strict=True):
        assert shard.result().returncode == (0 if told["finished"] else 3)
