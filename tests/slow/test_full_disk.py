"""A disk that is full: one message and exit code 2, nothing left behind, whatever command writes and however far."""

import re
import resource
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from tests.slow.fuzzing.runner import CommandRunner

MAP = ["--axis", "omega=0.5:1:12", "--axis", "eps1=0:0.2:10"]
STUDY = '[study]\nkind = "zones"\nx = "omega=0.5:1:12"\ny = "eps1=0:0.2:10"\n'
COMMANDS = {
    "simulate": ["simulate", "--periods", "40", "--samples", "40", "--out", "out.nc"],
    "regime": ["regime", "--plot", "out.png"], "attractors": ["attractors", "--starts", "8", "--out", "out.nc"],
    "bifurcation with a picture": [
        "bifurcation", "--axis", "eps1=0:0.2:8", "--points", "4", "--out", "out.nc", "--plot", "out.png"],
    "zones": ["zones", *MAP, "--out", "out.nc"],
    "basins": ["basins", "--set", "kind=single", "--axis", "z=-3:3:12", "--axis", "z_dot=-2:2:12", "--out", "out.nc"],
    "export": ["export", "../map.zarr", "--out", "out.nc"], "plot": ["plot", "../map.zarr", "--out", "out.png"],
    "run": ["run", "../study.toml", "--out", "out.zarr"],
    "paper": ["paper", "--out", "report", "--figures", "4", "--quality", "draft"]}


@pytest.fixture(scope="module")
def disk(tmp_path_factory):
    folder = tmp_path_factory.mktemp("disk")
    (folder / "study.toml").write_text(STUDY)
    with CommandRunner(120) as trials:
        assert trials.run(["run", "study.toml", "--out", "map.zarr"], folder).code == 0
        yield trials, folder


@pytest.mark.parametrize("name", COMMANDS)
def test_a_full_disk_ends_with_one_message_and_leaves_nothing(name, disk):
    trials, folder = disk
    for size in (0, 10_000):
        place = folder / f"{name} {size}"
        place.mkdir()
        tried = trials.run(COMMANDS[name], place, largest=size)
        complaints = [line for line in tried.stderr.splitlines() if "rror" in line]
        assert tried.code == 2 and len(complaints) == 1 and complaints[0].startswith("error: "), tried
        assert "File too large" in tried.stderr or "must be writable" in tried.stderr, tried
        assert re.search(r"'.*(out|report)", complaints[0]), "the message names the file"
        left = [p.name for p in place.iterdir()]
        assert not [p for p in place.rglob("*") if p.name.endswith(".partial") or p.name.startswith(".gearchaos-")]
        assert set(left) <= {"out.zarr", "report", "out.nc"}, (left, tried)
        if "out.nc" in left:  # only the picture beside it was too large
            gc.load(place / "out.nc")


def test_a_run_that_meets_a_full_disk_keeps_what_is_done_and_goes_on(disk):
    trials, folder = disk
    run = ["run", "study.toml", "--out", "half.zarr"]
    assert trials.run([*run, "--shard", "1/2"], folder).code == 3
    tried = trials.run([*run, "--shard", "2/2"], folder, largest=1000)
    assert tried.code == 2 and tried.stderr.count("rror") == 1, tried
    assert "File too large" in tried.stderr and "What is done is kept" in tried.stderr
    assert trials.run(run, folder).code == 0


def test_with_room_the_same_command_succeeds(disk):
    trials, folder = disk
    (folder / "room").mkdir()
    assert trials.run(COMMANDS["zones"], folder / "room").code == 0
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[0] == resource.RLIM_INFINITY


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize("arguments", [["--version"], ["regime", "--json"], ["regime", "--help"]])
def test_a_full_stdout_is_one_message(arguments):
    command = [sys.executable, "-c", "from gearchaos.cli import main; main()", *arguments]
    with open("/dev/full", "w") as full:
        ended = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True)
    assert (ended.returncode, ended.stderr) == (
        2, "error: [Errno 28] No space left on device. Free space, or write to another place.\n")


def test_a_netcdf_file_takes_no_more_memory_than_as_much_again(tmp_path):
    """`gc.save` makes the file in memory; nothing is copied once more."""
    dataset = xr.Dataset({"z": (("y", "x"), np.random.default_rng(0).normal(size=(1000, 1000)))})
    gc.save(dataset, tmp_path / "z.nc")  # once, so that the packages it needs are loaded
    tracemalloc.start()
    gc.save(dataset, tmp_path / "z.nc")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1.5 * dataset.nbytes
