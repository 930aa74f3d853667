"""Runs into object stores, with an S3 server and real processes: killed, resumed, shared, shown, exported."""

import json
import os
import random
import time
from uuid import uuid4

import pytest
import xarray as xr

import gearchaos as gc
from gearchaos.store.objects import Objects
from tests.commands import ask, refused, run_json
from tests.object_server import BUCKET, s3_server
from tests.slow.instant import MAP, STUDY, TILE

pytestmark = pytest.mark.usefixtures("instant")


@pytest.fixture(scope="module", autouse=True)
def variables(tmp_path_factory):
    """The environment variables that lead to an S3 server, which are those of this process too."""
    with s3_server(tmp_path_factory.mktemp("server")) as found, pytest.MonkeyPatch.context() as patched:
        for name in [n for n in os.environ if n.startswith("AWS_")]:
            patched.delenv(name)
        for name, value in found.items():
            patched.setenv(name, value)
        yield found


@pytest.fixture
def url():
    return f"s3://{BUCKET}/{uuid4().hex}/map.zarr"


def results(location):
    """The bytes of all objects by name, without the record of the run."""
    objects = Objects(location)
    return {name: objects.get(name) for name in objects.names() if not name.startswith("run/")}


def test_a_run_killed_several_times_goes_on_to_the_same_bytes(nursery, whole, url, variables, tmp_path):
    objects, rng, done, kills = Objects(url), random.Random(1), set(), 0
    while kills < 6:
        run = nursery.run(url, "--threads", 2, folder=tmp_path, INSTANT_SECONDS=0.2, **variables)
        more = len(objects.names()) + (1 + 4 * kills if kills < 3 else 2)  # the first ones while the store is made
        run.until(lambda more=more: time.sleep(0.02) or len(objects.names()) >= more)  # the server needs its time
        time.sleep(rng.uniform(0, 0.2))
        run.kill()
        kept = {name for name in objects.names("run") if not name.endswith(".json")}
        written = {name.rpartition("/")[2] for name in kept if name.startswith("run/blocks/")}
        assert all(name in kept or name.split("/")[2] in written for name in done), "what was done is lost"
        done, kills = kept, kills + 1
    assert sum(4 if name.startswith("run/blocks/") else 1 for name in done) > 5  # tiles; a block is written for four
    assert "are done already" in nursery.run(url, folder=tmp_path, **variables).wait()
    assert results(url) == results(whole)
    xr.testing.assert_identical(gc.load(url).load(), gc.run(MAP))


def test_processes_and_shards_write_the_same_bytes(nursery, whole, url, variables, tmp_path):
    nursery.run(url, "--processes", 2, folder=tmp_path, **variables).wait()
    assert results(url) == results(whole)
    for shard, finished in (("1/2", False), ("2/2", True)):
        assert gc.run(MAP, f"{url}2", tile=TILE, shard=shard).finished == finished
        gc.run(MAP, tmp_path / "map.zarr", tile=TILE, shard=shard)
    assert results(f"{url}2") == results(tmp_path / "map.zarr")


def test_every_command_takes_a_url(url, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "study.toml").write_text(STUDY)
    run = ["run", "study.toml", "--out", url, "--tile", TILE]
    first = json.loads(ask(*run, "--shard", "1/2", "--json", code=3).stdout)
    assert (first["store"], first["finished"]) == (url, False)
    assert run_json("info", url)["tiles_done"] == first["done"] < first["tiles"]
    for command in ([*run, "--shard", "2/2"], ["finish", url], ["export", url, "--out", "map.nc"], ["plot", url]):
        ask(*command, code=0)
    assert "all checksums are right" in ask("check", url, code=0).stdout
    assert (tmp_path / "map.png").stat().st_size > 1000
    xr.testing.assert_identical(gc.load("map.nc"), gc.run(MAP))


@pytest.mark.parametrize("arguments", [
    ["zones", "--axis", "omega=0.5:1:2", "--axis", "eps1=0.1:0.2:2", "--out", "s3://bucket/map.nc"],
    ["export", "none.zarr", "--out", "s3://bucket/map.nc"], ["plot", "none.zarr", "--out", "s3://bucket/map.png"]])
def test_files_of_results_are_not_written_to_a_url(arguments, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "Only stores of gearchaos run can have a URL" in refused(*arguments)
    assert not list(tmp_path.iterdir())


def test_a_bucket_that_is_missing_is_told_before_anything_is_computed(tmp_path, instant):
    with pytest.raises(gc.InputError, match=r"must be in a bucket that can be reached; got .*NoSuchBucket"):
        gc.run(MAP, f"s3://nowhere-{uuid4().hex}/map.zarr")
    assert not instant.exists()


def test_a_server_that_fails_during_a_run_is_no_damage(monkeypatch):
    gc.run(MAP, url := f"memory://{uuid4().hex}/map.zarr", tile=TILE)
    before, get = Objects(url).sizes(Objects(url).names()), Objects.get

    def failing(self, name, *arguments):
        if name == "run/finished":
            raise ConnectionError("The object store failed")
        return get(self, name, *arguments)

    monkeypatch.setattr(Objects, "get", failing)
    with pytest.raises(OSError, match="The object store failed"):
        gc.run(MAP, url, tile=TILE)
    monkeypatch.undo()
    assert Objects(url).sizes(Objects(url).names()) == before
