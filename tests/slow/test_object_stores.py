"""Runs into object stores, with an S3 server and real processes: killed, resumed, shared, shown, exported."""

import json
import os
import random
import signal
import time
from contextlib import contextmanager
from multiprocessing import get_context
from uuid import uuid4

import pytest
import xarray as xr
from typer.testing import CliRunner

import gearchaos as gc
from gearchaos.cli import app
from gearchaos.dynamics import Classification
from gearchaos.store.files.folder import open_folder
from gearchaos.store.files.object_folder import ObjectFolder
from gearchaos.store.running.run import run_into_store
from gearchaos.store.store import open_store
from tests.object_server import BUCKET, s3_server

STUDY = """
[model]
q0 = 0.1
[study]
kind = "zones"
x = "omega=0.5:1.1:24"
y = "eps1=0.05:0.3:20"
[classification]
longest_transient = 800
doublings = 1
averaging_periods = 16
"""
TILE = 4
SMALL = gc.Zones(
    gc.MeshModel.of(q0=0.1), gc.Axis("omega", 0.5, 1.1, 6), gc.Axis("eps1", 0.05, 0.3, 4),
    settings=Classification(longest_transient=800, doublings=1, averaging_periods=16),
)


@pytest.fixture(scope="module", autouse=True)
def server(tmp_path_factory):
    """An S3 server, to which the environment variables of these tests lead."""
    with s3_server(tmp_path_factory.mktemp("server")) as variables, pytest.MonkeyPatch.context() as patched:
        for name in [n for n in os.environ if n.startswith("AWS_")]:
            patched.delenv(name)
        for name, value in variables.items():
            patched.setenv(name, value)
        yield


@pytest.fixture
def url():
    """The URL of a store that does not exist yet."""
    return f"s3://{BUCKET}/{uuid4().hex}/map.zarr"


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    path = tmp_path_factory.mktemp("study") / "study.toml"
    path.write_text(STUDY)
    return path


def results(location):
    """The bytes of all files by name; not the record of the run."""
    folder = open_folder(location)
    return {name: folder.read(name) for name, _ in folder.list() if not name.startswith("run/")}


def command(*arguments, code=0):
    """What a command prints on stderr, after it has ended with this exit code."""
    done = CliRunner().invoke(app, [str(a) for a in arguments])
    assert done.exit_code == code, done.stderr
    return done.stderr


def document(*arguments, code=0):
    """The JSON that a command prints."""
    done = CliRunner().invoke(app, [*(str(a) for a in arguments), "--json"])
    assert done.exit_code == code, done.stderr
    return json.loads(done.stdout)


def run_command(variables, *arguments):
    """What a process does: the command with these environment variables."""
    os.environ.update(variables)
    app([str(a) for a in arguments], standalone_mode=False)


@contextmanager
def running(study, url):
    """A run in a process of its own, forked from one that has imported the modules; killed at the end."""
    processes = get_context("forkserver")
    processes.set_forkserver_preload(["tests.slow.test_object_stores"])
    variables = {name: value for name, value in os.environ.items() if name.startswith("AWS_")}
    arguments = "run", study, "--out", url, "--tile", TILE
    process = processes.Process(target=run_command, args=(variables, *arguments))
    process.start()
    try:
        yield process
    finally:
        process.kill()
        process.join()


def wait_for(process, condition):
    """Wait until a condition holds; False if the process ends before."""
    until = time.monotonic() + 120
    while not condition():
        assert time.monotonic() < until
        if not process.is_alive():
            return False
        time.sleep(0.05)  # each look is a request
    return True


def test_a_run_killed_ten_times_loses_nothing(study, url, tmp_path):
    folder, rng, kept = ObjectFolder(url), random.Random(1), set()
    for kill in range(10):
        size = len(list(folder.list()))
        more = 1 + 2 * kill if kill < 3 else rng.randrange(1, 20)  # the first ones while the store is being created
        with running(study, url) as process:
            alive = wait_for(process, lambda size=size, more=more: len(list(folder.list())) >= size + more)
            assert alive, "the study is too short to be killed so often"
            time.sleep(rng.uniform(0, 0.05))
        if folder.exists():
            done = set(open_store(url).progress().entries)
            assert kept <= done
            kept = done
    assert len(kept) > 10
    command("run", study, "--out", url, "--tile", TILE)
    command("run", study, "--out", tmp_path / "map.zarr", "--tile", TILE)
    assert results(url) == results(tmp_path / "map.zarr")
    assert not list(folder.list("run/segments"))


def test_every_command_takes_a_url(study, url, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    first = document("run", study, "--out", url, "--tile", 100, "--shard", "1/2", code=3)
    assert (first["store"], first["finished"]) == (url, False)
    assert document("info", url)["tiles_done"] == first["done"] < first["tiles"]
    assert document("run", study, "--out", url, "--shard", "2/2")["finished"]
    assert document("finish", url)["finished"]
    assert document("check", url)["damaged"] is False
    command("export", url, "--out", "map.nc")
    command("plot", url)
    assert (tmp_path / "map.png").stat().st_size > 1000
    command("run", study, "--out", "local.zarr", "--tile", 100)
    command("export", "local.zarr", "--out", "local.nc")
    xr.testing.assert_identical(gc.load("map.nc"), gc.load("local.nc"))
    xr.testing.assert_identical(gc.load(url).load(), gc.load("local.zarr").load())


@pytest.mark.parametrize("arguments", [
    ["zones", "--axis", "omega=0.5:1:2", "--axis", "eps1=0.1:0.2:2", "--out", "s3://bucket/map.nc"],
    ["export", "none.zarr", "--out", "s3://bucket/map.nc"], ["plot", "none.zarr", "--out", "s3://bucket/map.png"],
])
def test_files_of_results_are_not_written_to_a_url(arguments, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "Only stores of gearchaos run can have a URL" in command(*arguments, code=2)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("arguments", [["info"], ["check"], ["finish"], ["plot"], ["export", "--out", "map.nc"]])
def test_what_is_no_store_is_refused_by_its_url(arguments, url, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    said = command(*arguments, url, code=2)
    assert url in said and ("must exist" if arguments == ["info"] else "There is no such object") in said
    assert not list(tmp_path.iterdir())


def test_a_store_is_not_made_among_other_objects(study, url):
    ObjectFolder(url).write("thesis.pdf", b"1")
    assert "must be a folder that gearchaos run made" in command("run", study, "--out", url, code=2)
    assert list(ObjectFolder(url).list()) == [("thesis.pdf", 1)]


def test_a_second_writer_is_refused_and_told_who_writes(study, url):
    folder = ObjectFolder(url)
    with running(study, url) as process:
        assert wait_for(process, lambda: folder.size("run/writers/all.lock") is not None)
        os.kill(process.pid, signal.SIGSTOP)  # it still holds its lock
        for options in ([], ["--shard", "1/2"]):
            said = command("run", study, "--out", url, *options, code=2)
            assert "must not have another writer" in said and f":{process.pid}, until" in said
    command("run", study, "--out", url)


def test_processes_write_the_same_bytes(url, tmp_path):
    for location in (url, tmp_path / "map.zarr"):
        outcome = gc.run(SMALL, location, processes=2, tile=5)
        assert (outcome.done, outcome.failed) == (outcome.count, {})
    assert results(url) == results(tmp_path / "map.zarr")


def test_a_study_that_is_finished_from_all_results(url, tmp_path):
    study = gc.Attractors(gc.MeshModel.of(kind="single", omega=2.3, eps1=0.05, q0=0.1), 40, settings=SMALL.settings)
    for location in (url, tmp_path / "a.zarr"):
        run_into_store(study, location, tile=10)
    assert results(url) == results(tmp_path / "a.zarr")
    with xr.open_zarr(open_folder(url).zarr_store()) as opened:
        xr.testing.assert_identical(opened.load(), study.run())


def test_damaged_and_missing_objects_are_repaired(url, tmp_path):
    folder = ObjectFolder(url)
    gc.run(SMALL, url, tile=5)
    before = results(url)
    folder.delete("label/c/0/0")
    folder.write("zarr.json", b"{}")
    assert document("info", url)["missing"]["files"] == ["label/c/0/0", "zarr.json"]
    gc.run(SMALL, url, tile=5)
    assert results(url) == before


def test_a_server_that_fails_during_a_run_is_no_damage(url, monkeypatch):
    """A store is left as it is, and the run ends with a message, if results cannot be read for a while."""
    gc.run(SMALL, url, tile=5)
    before = {name: size for name, size in ObjectFolder(url).list()}
    read = ObjectFolder.read

    def failing(self, name, *arguments):
        if name == "run/sums.json":
            raise ConnectionError("The object store failed")
        return read(self, name, *arguments)

    monkeypatch.setattr(ObjectFolder, "read", failing)
    with pytest.raises(OSError, match="The object store failed"):
        gc.run(SMALL, url, tile=5)
    monkeypatch.undo()
    after = {name: size for name, size in ObjectFolder(url).list()}
    assert {n: s for n, s in after.items() if "run/" not in n} == {n: s for n, s in before.items() if "run/" not in n}
    assert after["run/finished"] == 0
