"""Runs lose nothing: real processes, real signals, and the same bytes whoever computes them."""

import os
import random
import signal
import subprocess
import sys
import time

import distributed
import numpy as np
import psutil
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos.dynamics import Classification
from gearchaos.execute import pools
from gearchaos.store.store import open_store
from tests import ROOT
from tests.commands import ask
from tests.slow.instant import MAP, STUDY, wait_until


def files(path):
    """The bytes of all files by name, without the record of the run."""
    every = {p.relative_to(path): p.read_bytes() for p in path.rglob("*") if p.is_file()}
    return {name: content for name, content in every.items() if name.parts[0] != "run"}


def tiles_done(path):
    """The tiles that have a file, or are in a block that is written, by the names of files alone."""
    if not (path / "run/study.json").exists():
        return set()
    blocks = {int(file.name) for file in path.glob("run/blocks/*") if file.name.isdecimal()}
    tiles = {int(file.name) for file in path.glob("run/tiles/*/*") if file.name.isdecimal()}
    return tiles.union(*map(open_store(path).grid.tiles_of, blocks))


def computed(log, grid):
    """The tiles that were computed, by the numbers of their first cells."""
    first = {int(grid.items(tile)[0]): tile for tile in range(grid.count)}
    return [first[int(line)] for line in log.read_text().splitlines()] if log.exists() else []


def workers_of(command):
    below = psutil.Process(command.pid).children(recursive=True)
    return [p for p in below if not p.children() and not any("resource_tracker import" in word for word in p.cmdline())]


def begun(command, path, count=3):
    before = len(tiles_done(path))
    command.until(lambda: len(tiles_done(path)) >= before + count)
    return command


def test_threads_processes_and_dask_write_the_same_bytes_though_a_worker_dies(nursery, whole, instant, tmp_path):
    in_memory = gc.run(MAP)
    xr.testing.assert_identical(xr.open_zarr(whole).load(), in_memory)
    for engine in ("--processes", "--workers"):
        path = tmp_path / f"{engine}.zarr"
        command = begun(nursery.run(path, engine, 2, INSTANT_SECONDS=0.05), path)
        workers = workers_of(command)
        workers[0].kill()
        command.wait()
        assert len(workers) == 2 and files(path) == files(whole)
        xr.testing.assert_identical(gc.load(path).load(), in_memory)


def test_shards_in_processes_of_their_own_write_the_same_bytes(nursery, instant, tmp_path):
    path, plain = tmp_path / "map.zarr", tmp_path / "plain.zarr"
    shards = [nursery.run(path, "--shard", f"{i}/4", INSTANT_SECONDS=0.01) for i in (1, 2, 3, 4)]
    for shard in shards:
        shard.wait(0, 3)  # the one that ends last finishes the store
    nursery.run(plain, "--shard", "1/4").wait(3)
    assert 0 < len(tiles_done(plain)) < 20
    nursery.run(plain).wait()
    assert any(shard.code == 0 for shard in shards) and files(path) == files(plain)
    xr.testing.assert_identical(gc.load(path).load(), gc.run(MAP))


def test_motions_are_the_same_in_threads_in_processes_and_in_memory(tmp_path):
    short = Classification(longest_transient=800, doublings=1, averaging_periods=16)
    single = gc.MeshModel.of(kind="single", omega=2.3, eps1=0.05, q0=0.1)
    study = gc.Attractors(single, 24, kicks=2, settings=short)
    for engine in ("threads", "processes"):
        outcome = gc.run(study, tmp_path / engine, tile=8, **{engine: 2})
        assert (outcome.done, outcome.failed, outcome.finished) == (outcome.count, {}, True)
        xr.testing.assert_identical(xr.open_zarr(tmp_path / engine).load(), study.run())
    assert files(tmp_path / "threads") == files(tmp_path / "processes")


def half_written(path, grid):
    """The blocks of which a shard is there, and which are not said to be written."""
    shards = [file.relative_to(path).parts[2:] for file in path.glob("*/c/*/*") if file.name.isdecimal()]
    blocks = {int(np.ravel_multi_index(tuple(map(int, position)), grid.blocks)) for position in shards}
    return {block for block in blocks if not (path / f"run/blocks/{block}").exists()}


@pytest.mark.parametrize(("times", "in_blocks"), [(8, 2), pytest.param(20, 5, marks=pytest.mark.exhaustive)])
def test_a_run_killed_at_any_moment_goes_on_to_the_same_bytes(nursery, tmp_path, times, in_blocks):
    path, rng, small = tmp_path / "map.zarr", random.Random(1), ("--tile", 4)
    nursery.run(tmp_path / "whole.zarr", *small).wait()
    grid, kills, writing, done = open_store(tmp_path / "whole.zarr").grid, 0, 0, set()
    while kills < times or writing < in_blocks:
        engine, log = "--processes" if kills in (4, 12) else "--threads", tmp_path / f"{kills}.log"
        command = nursery.run(path, *small, engine, 2, INSTANT_SECONDS=0.2, INSTANT_LOG=log)
        if kills % 4 == 3:
            command.until(lambda: half_written(path, grid))
        elif engine == "--processes":
            begun(command, path, 1)
        else:
            time.sleep(rng.uniform(0, 0.4))
        command.kill()
        kills, writing = kills + 1, writing + bool(half_written(path, grid))
        assert not done & set(computed(log, grid)), "what was done is computed again"
        done = tiles_done(path)
    assert 0 < len(done) < grid.count, "killed too early or too late"
    nursery.run(path, *small, INSTANT_LOG=tmp_path / "last.log").wait()
    assert sorted(computed(tmp_path / "last.log", grid)) == sorted(set(range(grid.count)) - done)
    assert files(path) == files(tmp_path / "whole.zarr")


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=lambda number: number.name)
@pytest.mark.parametrize("engine", [(), ("--workers", 2)], ids=["threads", "workers"])
def test_ctrl_c_and_a_scheduler_that_ends_a_run_keep_what_is_done_and_leave_no_lock(nursery, tmp_path, number, engine):
    """A lock that is left would keep other hosts out. Dask's workers say nothing of what they were doing."""
    path = tmp_path / "map.zarr"
    command = begun(nursery.run(path, *engine, INSTANT_SECONDS=0.1), path)
    assert len(list(path.glob("run/locks/*"))) == 1
    os.kill(command.pid, number)
    code, said = (130, "interrupted") if number == signal.SIGINT else (143, "terminated")
    output = command.wait(code)
    assert output.splitlines()[-1] == said and "distributed" not in output
    assert len(tiles_done(path)) >= 3 and not list(path.glob("run/locks/*"))


@pytest.mark.parametrize("engine", ["--processes", "--workers"])
def test_workers_do_not_outlive_a_run_that_is_killed(nursery, tmp_path, engine):
    path = tmp_path / "map.zarr"
    command = begun(nursery.run(path, engine, 2, INSTANT_SECONDS=0.1), path)
    workers = workers_of(command)
    os.kill(command.pid, signal.SIGKILL)  # not the process group
    command.wait(-signal.SIGKILL)
    wait_until(lambda: not any(worker.is_running() for worker in workers))
    assert len(workers) == 2


SCHEDULER = """
import sys, time, distributed
from tests.slow.instant import install
install()
with distributed.LocalCluster(n_workers=1, processes=False, protocol="tcp", dashboard_address=None) as cluster:
    print(cluster.scheduler_address, flush=True)
    time.sleep(1000)
"""


def test_a_scheduler_that_is_gone_ends_the_run_with_one_message(nursery, whole, tmp_path):
    path = tmp_path / "map.zarr"
    command = [sys.executable, "-c", SCHEDULER]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, cwd=ROOT,
                          env=os.environ | {"INSTANT_SECONDS": "0.1"}) as cluster:
        try:
            run = begun(nursery.run(path, "--scheduler", cluster.stdout.readline().strip()), path)
        finally:
            cluster.kill()
    said = run.wait(2)
    assert "is gone. What is done is kept" in said and said.count("error: ") == 1 and "Traceback" not in said
    nursery.run(path).wait()
    assert files(path) == files(whole)


def test_slurm_jobs_run_one_worker_each():
    jobqueue = pytest.importorskip("dask_jobqueue")
    options = {"dashboard_address": "127.0.0.1:0"}
    with jobqueue.SLURMCluster(**pools.slurm_job(), scheduler_options=options) as cluster:
        script = cluster.job_script()
    assert "#SBATCH --cpus-per-task=1" in script and "--nthreads 1" in script


@pytest.mark.parametrize(("arguments", "words"), [
    *((("--shard", n), f"shard must read i/n with i from 1 to n; got '{n}'") for n in ("4/3", "one", "²/3")),
    (("--threads", "1", "--processes", "2"), "threads and processes must not be given together"),
    (("--workers", "1", "--processes", "2"), "processes and workers must not be given together"),
    (("--jobs", "3"), "jobs must be left out without cluster"),
    (("--cluster", "pbs"), "cluster must be slurm; got 'pbs'"),
    (("--scheduler", "tcp://127.0.0.1:9"), "scheduler must be a Dask scheduler that answers")])
def test_bad_options_are_refused_before_anything_is_made(tmp_path, monkeypatch, arguments, words):
    client = distributed.Client
    monkeypatch.setattr(distributed, "Client", lambda *a, **options: client(*a, **options | {"timeout": "1s"}))
    (tmp_path / "study.toml").write_text(STUDY)
    refused = ask("run", tmp_path / "study.toml", "--out", tmp_path / "map.zarr", *arguments, code=2)
    assert words in refused.stderr
    assert not (tmp_path / "map.zarr").exists()
