"""Runs lose nothing: real processes, real signals, real damage; and the same data whoever computes them."""

import itertools
import json
import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import time
import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import psutil
import pytest
import xarray as xr
import zarr
from typer.testing import CliRunner

import gearchaos as gc
from gearchaos.cli import app
from gearchaos.dynamics import Classification
from gearchaos.execute import pools
from gearchaos.store.files.folder import LocalFolder
from gearchaos.store.journals.journal import TileEntry, decoded_line
from gearchaos.store.reading.check import check
from gearchaos.store.reading.info import summary
from gearchaos.store.record import differences, to_record
from gearchaos.store.running.run import run_into_store as run
from gearchaos.store.running.worker import cached_store as remembered
from gearchaos.store.store import open_store
from gearchaos.store.tiles import Grid, divide
from gearchaos.store.writers.locks import write_lock
from gearchaos.store.writers.shards import Shard

SHORT = Classification(longest_transient=800, doublings=1, averaging_periods=16)
SINGLE = gc.MeshModel.of(kind="single", omega=2.3, eps1=0.05, q0=0.1)
COMMAND = [sys.executable, "-c", "from gearchaos.cli import main; main()"]

STUDY = """
[model]
q0 = 0.1
[study]
kind = "zones"
x = "omega=0.5:1.1:48"
y = "eps1=0.05:0.3:40"
[classification]
longest_transient = 800
doublings = 1
averaging_periods = 16
"""


def small_map(**model):
    axes = gc.Axis("omega", 0.5, 1.1, 16), gc.Axis("eps1", 0.05, 0.3, 12)
    return gc.Zones(gc.MeshModel.of(q0=0.1, **model), *axes, settings=SHORT)


STUDIES = {
    "zones": small_map(),
    "zones refined": replace(small_map(), refine=4),
    "zones with starts": gc.Zones(
        gc.MeshModel.of(q0=0.1), gc.Axis("omega", 0.7, 0.9, 9), gc.Axis("eps1", 0.05, 0.1, 4), starts=3, settings=SHORT
    ),
    "bifurcation": gc.Bifurcation(
        gc.MeshModel.of(q0=0.1), gc.Axis("eps1", 0.05, 0.2, 130), points=5, settings=SHORT
    ),
    "sweep": gc.Bifurcation(
        gc.MeshModel.of(q0=0.1), gc.Axis("eps1", 0.05, 0.2, 9), points=5, mode="up", settings=SHORT
    ),
    "basins": gc.Basins(SINGLE, gc.Axis("z", -3, 3, 16), gc.Axis("z_dot", -2, 2, 12), settings=SHORT),
    "attractors": gc.Attractors(SINGLE, 130, sweep=gc.Axis("omega", 2.2, 2.4, 5), settings=SHORT),
    "attractors with kicks": gc.Attractors(SINGLE, 64, kicks=2, settings=SHORT),
    "simulate": gc.Simulate(SINGLE, periods=20, transient=3, samples=4),
    "simulate sections alone": gc.Simulate(SINGLE, periods=20),
}


@pytest.mark.parametrize("name", STUDIES)
def test_a_store_opens_as_what_the_function_returns(name, tmp_path):
    study, path = STUDIES[name], tmp_path / "s.zarr"
    outcome = run(study, path, tile=40)
    assert (outcome.done, outcome.failed) == (outcome.count, {})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        opened = xr.open_zarr(path).load()
    xr.testing.assert_identical(opened, study.run())
    assert open_store(path).study == study
    again = []
    assert run(study, path, say=again.append).done == outcome.count
    assert len(again) == 1 and "are done already" in again[0]


def files(path):
    """The bytes of all chunks and metadata, by name; not the record of the run."""
    every = {p.relative_to(path): p.read_bytes() for p in path.rglob("*") if p.is_file()}
    return {name: data for name, data in every.items() if name.parts[0] != "run"}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """An undisturbed run of `small_map`."""
    path = tmp_path_factory.mktemp("whole") / "s.zarr"
    run(small_map(), path, tile=20, pool=pools.thread_pool(1))
    return path


def data(path):
    return xr.open_zarr(path).load()


def test_engines_and_tiles_do_not_matter(whole, tmp_path):
    for name, tile, pool in (("threads", 50, pools.thread_pool(2)), ("processes", 20, pools.process_pool(2))):
        run(small_map(), tmp_path / name, tile=tile, pool=pool)
        xr.testing.assert_identical(data(tmp_path / name), data(whole))
    assert files(tmp_path / "processes") == files(whole)


def write_study(folder, text=STUDY):
    (folder / "study.toml").write_text(text)
    return folder / "study.toml"


_STARTED = []


@pytest.fixture(autouse=True)
def _no_process_outlives_its_test():
    yield
    while _STARTED:
        with _STARTED.pop() as process:
            process.kill()


def start(study, path, *options, **how):
    command = [*COMMAND, "run", str(study), "--out", str(path), "--tile", "16", *options]
    _STARTED.append(subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **how))
    return _STARTED[-1]


def finish(process, *codes):
    _, stderr = process.communicate(timeout=300)
    assert process.returncode in (codes or (0,)), stderr
    return stderr


def refused(study, path, *options):
    """What ``gearchaos run`` says on stderr when it exits with 2; called in this process."""
    result = CliRunner().invoke(app, ["run", str(study), "--out", str(path), *options], catch_exceptions=False)
    assert result.exit_code == 2, result.stderr
    return result.stderr


def entries(path):
    """The entries of tiles in all journals of a store: they are kept when groups are packed."""
    journals = path.glob("run/journal/*.jsonl")
    lines = (decoded_line(line) for journal in journals for line in journal.read_bytes().splitlines())
    return [line for line in lines if isinstance(line, TileEntry)]


def tiles_done(path):
    return len({entry.tile for entry in entries(path)})


def wait_for_tiles(process, path, more):
    before, until = tiles_done(path), time.monotonic() + 240
    while process.poll() is None and tiles_done(path) < before + more:
        assert time.monotonic() < until
        time.sleep(0.01)


@pytest.fixture(scope="module")
def calm(tmp_path_factory):
    """An undisturbed run of `STUDY`."""
    folder = tmp_path_factory.mktemp("calm")
    finish(start(write_study(folder), folder / "s.zarr"))
    return folder / "s.zarr"


@pytest.mark.parametrize("deaths", [5, pytest.param(20, marks=pytest.mark.exhaustive)])
def test_a_run_killed_many_times_loses_nothing(calm, tmp_path, deaths):
    study, path, rng = write_study(tmp_path), tmp_path / "s.zarr", random.Random(1)
    kills, kept = 0, {}
    while kills < deaths:
        with start(study, path) as process:
            wait_for_tiles(process, path, 1)
            assert process.poll() is None, "the study is too short to be killed so often"
            time.sleep(rng.uniform(0, 0.1))
            kept |= {entry.tile: entry for entry in entries(path)}
            process.kill()
            kills += 1
    assert "are done already" in finish(start(study, path))
    assert len(kept) >= deaths
    done = entries(path)
    assert all(entry in done for entry in kept.values())
    assert sorted(entry.tile for entry in done) == list(range(open_store(path).grid.count))  # none was computed again
    assert files(path) == files(calm)


def test_ctrl_c_keeps_what_is_done(tmp_path):
    study, path = write_study(tmp_path), tmp_path / "s.zarr"
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    process = start(study, path)
    signal.signal(signal.SIGINT, before)
    wait_for_tiles(process, path, 2)
    process.send_signal(signal.SIGINT)
    assert finish(process, 130).splitlines()[-1] == "interrupted"
    assert tiles_done(path) >= 2


def test_a_full_disk_stops_with_a_message_and_can_go_on(calm, tmp_path):
    study, path = write_study(tmp_path), tmp_path / "s.zarr"
    finish(start(study, path, "--shard", "1/100"), 3)
    before = tiles_done(path)
    limit = 1000  # bytes in a file: less than a record has
    full = start(study, path, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
    said = finish(full, 2)
    assert "File too large" in said and "What is done is kept" in said and "Traceback" not in said
    assert tiles_done(path) == before > 0
    finish(start(study, path))
    assert files(path) == files(calm)


def test_shards_in_processes_of_their_own_fill_one_store(calm, tmp_path):
    study, path = write_study(tmp_path), tmp_path / "s.zarr"
    shards = [start(study, path, "--shard", f"{i}/3") for i in (1, 2, 3)]
    for shard in shards:
        finish(shard, 0, 3)  # the one that ends last finishes the store
    store = open_store(path)
    assert store.finished and summary(store)["tiles_done"] == store.grid.count
    assert files(path) == files(calm)


def test_a_second_writer_is_refused(whole):
    folder = LocalFolder(whole)
    with write_lock(folder, Shard()):
        for shard in (Shard(), Shard(1, 2)):
            with pytest.raises(gc.InputError, match=r"another writer.*a run is writing"), write_lock(folder, shard):
                pass
    with write_lock(folder, Shard(1, 2)), write_lock(folder, Shard(2, 2)):
        for shard in (Shard(), Shard(1, 2), Shard(1, 3)):
            with pytest.raises(gc.InputError, match=r"shard ./2 is writing"), write_lock(folder, shard):
                pass
    with write_lock(folder, Shard()):
        pass


def copy(whole, folder):
    path = folder / "s.zarr"
    subprocess.run(["cp", "-r", str(whole), str(path)], check=True)
    return path


def chunks(path, name):
    return sorted(p for p in (path / name / "c").rglob("*") if p.is_file())


@pytest.mark.parametrize("damage", ["flipped byte", "cut short", "missing", "empty"])
def test_a_damaged_chunk_is_found_and_computed_again(whole, tmp_path, damage):
    path, said = copy(whole, tmp_path), []
    (chunk,) = chunks(path, "v_rms")
    content = chunk.read_bytes()
    if damage == "missing":
        chunk.unlink()
    else:
        middle = len(content) // 2
        flipped = content[:middle] + bytes([content[middle] ^ 8]) + content[middle + 1 :]
        chunk.write_bytes({"flipped byte": flipped, "cut short": content[:middle], "empty": b""}[damage])
    if damage == "flipped byte":  # the size is right: found by the checksum
        found = check(open_store(path))
        assert found.files == ["v_rms/c/0/0"] and found.noted
    run(small_map(), path, say=said.append)
    assert damage == "flipped byte" or any("v_rms/c/0/0" in line for line in said)
    assert files(path) == files(whole)
    assert check(open_store(path)).files == []


@pytest.mark.parametrize("name", ["zones", "basins"])
@pytest.mark.parametrize("lost", ["zarr.json", "{array}/zarr.json", "{axis}/c/0", "run/sums.json"])
@pytest.mark.parametrize("how", ["missing", "damaged"])
def test_damaged_files_of_the_store_itself_are_made_anew(tmp_path, name, lost, how):
    study, path, said = STUDIES[name], tmp_path / "s.zarr", []
    run(study, path)
    good = data(path)
    file = path / lost.format(array={"zones": "label", "basins": "attractor"}[name], axis=study.x.name)
    content = file.read_bytes()
    if how == "missing":
        file.unlink()
    else:
        file.write_bytes(content[: len(content) // 2])
    with pytest.raises(gc.InputError, match="must be undamaged"):
        open_store(path).dataset()
    run(study, path, say=said.append)
    assert any("written anew" in line for line in said)
    xr.testing.assert_identical(data(path), good)


def test_shards_that_finish_at_once_do_not_collide(tmp_path):
    study, path = STUDIES["basins"], tmp_path / "s.zarr"
    run(study, path, tile=40)
    good = data(path)
    for _ in range(3):
        (path / "run" / "finished").unlink()
        with ThreadPoolExecutor(4) as pool:
            for future in [pool.submit(run, study, path, shard=Shard(i, 4)) for i in range(1, 5)]:
                future.result()
        xr.testing.assert_identical(data(path), good)


def test_many_shards_may_start_at_once_beside_old_locks(whole):
    folder = LocalFolder(whole)
    for old in (Shard(), Shard(1, 3), Shard(2, 3)):
        with write_lock(folder, old):
            pass

    def enter(number):
        with write_lock(folder, Shard(number, 4)):
            time.sleep(0.01)

    for _ in range(20):
        with ThreadPoolExecutor(4) as pool:
            list(pool.map(enter, range(1, 5)))


def test_other_versions_are_told(whole, tmp_path):
    path, said = copy(whole, tmp_path), []
    words = json.loads((path / "run" / "study.json").read_text())
    words["versions"]["gearchaos_version"] = "0.0.1"
    (path / "run" / "study.json").write_text(json.dumps(words))
    run(small_map(), path, say=said.append)
    assert any(line.startswith("warning: the store was begun with other versions, gearchaos_version") for line in said)
    (path / "run" / "study.json").write_text(json.dumps({**words, "format": 77}))
    with pytest.raises(gc.InputError, match="store must have format 1 or 2; got 77"):
        open_store(path)


def test_a_damaged_line_of_a_journal_is_computed_again(tmp_path):
    path = tmp_path / "s.zarr"
    run(small_map(), path, tile=20, shard=Shard(1, 2))
    journal = path / "run" / "journal" / "1-of-2.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    found = {entry.tile for entry in entries(path)}
    number = next(n for n, line in enumerate(lines) if b'"kind":"tile"' in line)
    lines[number] = lines[number].replace(b'"tile":', b'"tile": ')
    journal.write_bytes(b"".join(lines))
    assert len(found - {entry.tile for entry in entries(path)}) == 1
    assert run(small_map(), path).finished


def test_what_is_no_store_and_what_is_damaged_is_refused(whole, tmp_path):
    with pytest.raises(gc.InputError, match="store must be a folder that gearchaos run made"):
        open_store(tmp_path)
    path = copy(whole, tmp_path)
    text = (path / "run" / "study.json").read_text()
    for bad in (text[:300], "[]", text.replace('"zones"', '"nonsense"')):
        (path / "run" / "study.json").write_text(bad)
        with pytest.raises(gc.InputError, match=r"store must hold an undamaged|must be one of"):
            open_store(path)


def test_another_study_is_refused_with_the_difference(whole, tmp_path):
    with pytest.raises(gc.InputError, match=r"same study.*model\.zeta: 0\.025 in the store, 0\.03 asked for"):
        run(small_map(zeta=0.03), copy(whole, tmp_path))
    one, other = to_record(small_map()), to_record(gc.Zones(gc.MeshModel.of(q0=0.1), small_map().y, small_map().x))
    assert [line.split(":")[0] for line in differences(one, other)] == [
        "axes", "budget.extensions", "budget.measured", "budget.patience",
    ]


@pytest.mark.parametrize(("times", "failed"), [(2, 0), (99, 1)])
def test_a_tile_that_raises_is_tried_again_and_reported(tmp_path, monkeypatch, times, failed):
    study = small_map()
    run(study, tmp_path / "s.zarr", tile=20, shard=Shard(40, 40))  # makes the store, and computes nothing
    true, count = gc.Zones.compute, itertools.count()

    def compute(study, items, **options):
        if 0 in items and next(count) < times:
            raise ValueError("a cosmic ray")
        return true(study, items, **options)

    monkeypatch.setattr(gc.Zones, "compute", compute)
    outcome = run(study, tmp_path / "s.zarr", pool=pools.thread_pool(1))
    assert (outcome.done, len(outcome.failed)) == (outcome.count - failed, failed)
    monkeypatch.undo()
    remembered.cache_clear()
    if failed:
        assert outcome.failed == {0: "ValueError: a cosmic ray"}
        assert summary(open_store(tmp_path / "s.zarr"))["failed"] == {"0": "ValueError: a cosmic ray"}
        assert run(study, tmp_path / "s.zarr").failed == {}


@pytest.mark.parametrize(("tile", "expected"), [(20, [1] * 12), (130, [2, 2])])
def test_tiles_share_the_threads(tmp_path, monkeypatch, tile, expected):
    study, shares = small_map(), []
    true = gc.Zones.compute

    def compute(study, items, threads=None, **options):
        shares.append(threads)
        return true(study, items, threads=threads, **options)

    run(study, tmp_path / "s.zarr", tile=tile, shard=Shard(40, 40))  # makes the store, and computes nothing
    monkeypatch.setattr(gc.Zones, "compute", compute)
    outcome = run(study, tmp_path / "s.zarr", pool=pools.thread_pool(4))
    remembered.cache_clear()
    assert (outcome.count, sorted(shares)) == (len(expected), expected)


def workers_of(pid):
    """Processes that compute: they are forked from the one that has imported the modules they need."""
    servers = [p for p in psutil.Process(pid).children() if any("forkserver" in word for word in p.cmdline())]
    return [p.pid for server in servers for p in server.children()]


def test_a_worker_killed_in_the_middle_costs_nothing_but_time(calm, tmp_path):
    study, path = write_study(tmp_path), tmp_path / "s.zarr"
    process = start(study, path, "--processes", "2")
    wait_for_tiles(process, path, 3)
    os.kill(workers_of(process.pid)[0], signal.SIGKILL)
    finish(process)
    assert files(path) == files(calm)


def test_workers_do_not_outlive_a_run_that_is_killed(tmp_path):
    path = tmp_path / "s.zarr"
    process = start(write_study(tmp_path), path, "--processes", "2")
    wait_for_tiles(process, path, 3)
    workers = workers_of(process.pid)
    process.kill()
    until = time.monotonic() + 30
    while any(os.path.exists(f"/proc/{pid}") for pid in workers):
        assert time.monotonic() < until
        time.sleep(0.1)
    assert len(workers) == 2


def test_info_plot_and_export_of_a_run_half_done(tmp_path):
    study, path = write_study(tmp_path), tmp_path / "s.zarr"
    finish(start(study, path, "--shard", "1/2"), 3)

    def ask(*arguments):
        return subprocess.run([*COMMAND, *arguments], capture_output=True, text=True, timeout=120)

    said = json.loads(ask("info", str(path), "--json").stdout)
    assert said["tiles_done"] == said["tiles"] // 2 and said["failed"] == {} and not said["finished"]
    assert said["pieces_per_second"] > 0 and said["seconds_left"] > 0
    assert "tiles done" in ask("info", str(path)).stdout
    assert ask("plot", str(path)).returncode == 0 and (tmp_path / "s.png").stat().st_size > 10_000
    exported = ask("export", str(path), "--out", str(tmp_path / "s.nc"))
    assert exported.returncode == 0 and "tiles are not computed" in exported.stderr
    half = gc.load(tmp_path / "s.nc")
    assert 0.4 < float((half["label"] > 0).mean()) < 0.6
    assert np.all(np.isnan(half["v_rms"].values[half["label"].values == -1]))


@pytest.mark.parametrize(("arguments", "words"), [
    (("--shard", "4/3"), "shard must read i/n with i from 1 to n; got '4/3'"),
    (("--shard", "one"), "shard must read i/n"),
    (("--threads", "1", "--processes", "2"), "threads and processes must not be given together"),
    (("--shard", "²/3"), "shard must read i/n"),
    (("--jobs", "3"), "jobs must be left out without cluster"),
    (("--cluster", "pbs"), "cluster must be slurm; got 'pbs'"),
    (("--scheduler", "tcp://127.0.0.1:9"), "scheduler must be a Dask scheduler that answers"),
    pytest.param(("--cluster", "slurm", "--jobs", "64"), "cluster needs the command sbatch; got 'no such command'",
                 marks=pytest.mark.skipif(shutil.which("sbatch") is not None, reason="this machine has Slurm")),
])
def test_bad_options_are_refused_before_anything_is_made(tmp_path, arguments, words):
    assert words in refused(write_study(tmp_path), tmp_path / "s.zarr", *arguments)
    assert not (tmp_path / "s.zarr").exists()


@pytest.mark.parametrize(("text", "words"), [
    (STUDY.replace("doublings", "doubblings"), "key of [classification] must be one of"),
    (STUDY.replace('kind = "zones"', 'kind = "picture"').replace("x =", "#").replace("y =", "#"), "study.kind must be"),
    (STUDY.split("[study]")[0], "study.kind must be given"),
    (STUDY.replace("x =", "# x ="), "--axis must be given twice"),
    ('[study]\nkind = "simulate"\n', "study.periods must be given"),
    (STUDY.replace("longest_transient = 800", "longest_transient = -1"),
     "classification.longest_transient must be a whole number of at least 0; got -1"),
])
def test_bad_study_files_are_refused(tmp_path, text, words):
    assert words in refused(write_study(tmp_path, text), tmp_path / "s.zarr")


def test_tiles_cover_the_grid_once():
    for shape, tile in (((5, 7), (2, 3)), ((300,), (64,)), ((1, 9), (1, 9)), ((4, 4), (4, 1))):
        grid = Grid(shape, tile)
        pieces = np.concatenate([grid.items(n) for n in range(grid.count)])
        assert sorted(pieces) == list(range(int(np.prod(shape))))
        assert [grid.size(n) for n in range(grid.count)] == [len(grid.items(n)) for n in range(grid.count)]
    rows = divide(STUDIES["zones with starts"], 20)
    assert rows.tile == (2, 9)


def test_what_a_dying_writer_leaves_is_no_data_and_is_cleared(whole, tmp_path):
    path = tmp_path / "s.zarr"
    run(small_map(), path, tile=20, shard=Shard(1, 2))
    for folder in [path, *(p for p in path.rglob("*") if p.is_dir())]:
        (folder / ".0.cut short.partial").write_bytes(b"half")
    store = open_store(path)
    assert check(store).files == []
    assert store.dataset().sizes == data(whole).sizes
    assert run(small_map(), path).done == store.grid.count
    assert not list(path.rglob("*.partial"))
    assert files(path) == files(whole)


@pytest.mark.parametrize(("side", "options", "tile"), [
    (1000, {}, (128, 128)), (100, {}, (32, 32)), (8, {}, (8, 8)), (200, {"starts": 14}, (4, 200)),
    (40, {"starts": 4}, (4, 40)), (2048, {"refine": 8}, (512, 256)), (300, {"refine": 8}, (256, 256)),
])
def test_tiles_are_large_but_some_can_share(side, options, tile):
    axes = gc.Axis("omega", 0.5, 1.1, side), gc.Axis("eps1", 0.05, 0.3, side)
    assert divide(gc.Zones(gc.MeshModel(), *axes, **options, settings=SHORT)).tile == tile


def test_checksums_are_there(whole):
    assert "crc32c" in json.dumps(zarr.open_array(whole / "v_rms", mode="r").metadata.to_dict(), default=str)


@pytest.fixture
def cluster(tmp_path):
    """A Dask scheduler and two workers, each a process started through the command line: address and processes."""
    address_file = tmp_path / "scheduler.json"
    python = [sys.executable, "-m", "distributed.cli.dask_scheduler"]
    options = ["--scheduler-file", str(address_file), "--port", "0", "--no-dashboard", "--host", "127.0.0.1"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    started = [subprocess.Popen([*python, *options], **quiet)]
    try:
        until = time.monotonic() + 60
        while not (address_file.exists() and address_file.read_text().endswith("}")):
            assert time.monotonic() < until
            time.sleep(0.1)
        address = json.loads(address_file.read_text())["address"]
        worker = [sys.executable, "-m", "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny"]
        started += [subprocess.Popen([*worker, "--no-dashboard"], cwd=tmp_path, **quiet) for _ in range(2)]
        yield address, started
    finally:
        for process in started:
            process.kill()
            process.wait()


def test_a_dask_cluster_computes_the_same_though_a_worker_dies(cluster, calm, tmp_path):
    address, (_, *workers) = cluster
    study, path = write_study(tmp_path), tmp_path / "s.zarr"
    process = start(study, path, "--scheduler", address)
    wait_for_tiles(process, path, 5)
    workers[0].kill()
    finish(process)
    assert files(path) == files(calm)


def test_a_scheduler_that_is_gone_ends_the_run_with_a_message(cluster, calm, tmp_path):
    address, (scheduler, *_) = cluster
    study, path = write_study(tmp_path), tmp_path / "s.zarr"
    process = start(study, path, "--scheduler", address)
    wait_for_tiles(process, path, 5)
    scheduler.kill()
    said = finish(process, 2)
    assert "is gone" in said and "What is done is kept" in said
    finish(start(study, path))
    assert files(path) == files(calm)


def test_a_local_cluster_computes_the_same(whole, tmp_path):
    distributed = pytest.importorskip("distributed")
    local = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": "127.0.0.1:0", "processes": True}
    with distributed.LocalCluster(**local) as cluster:
        run(small_map(), tmp_path / "s.zarr", tile=20, pool=pools.dask_workers(cluster.scheduler_address))
    assert files(tmp_path / "s.zarr") == files(whole)


def test_slurm_jobs_run_one_worker_each():
    jobqueue = pytest.importorskip("dask_jobqueue")
    options = {"dashboard_address": "127.0.0.1:0"}
    with jobqueue.SLURMCluster(**pools.slurm_job(), scheduler_options=options) as cluster:
        script = cluster.job_script()
    assert "#SBATCH --cpus-per-task=1" in script and "--nthreads 1" in script


def test_a_lone_tile_uses_the_cores_that_others_leave():
    with pools.thread_pool(4)() as pool:
        assert [pool.threads_per_item(tiles) for tiles in (1, 2, 3, 4, 9)] == [4, 2, 1, 1, 1]


@pytest.mark.parametrize("tile", [20, 1000])
def test_a_study_of_which_nothing_can_be_computed_makes_no_store(tmp_path, monkeypatch, tile):
    study = small_map()

    def fail(study, items, **options):
        raise ValueError("a cosmic ray")

    monkeypatch.setattr(gc.Zones, "compute", fail)
    with pytest.raises(gc.InputError, match=r"study must have work items that can be computed.*a cosmic ray"):
        run(study, tmp_path / "s.zarr", tile=tile)
    assert not (tmp_path / "s.zarr").exists()
