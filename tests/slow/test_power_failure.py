"""Stores survive power failures: a block that is written is there, the rest is computed again, no value is wrong."""

import pickle
import random
import warnings

import pytest
import xarray as xr

import gearchaos as gc
from gearchaos.store.store import ArraySpec, open_store
from tests.slow.instant import MAP, STUDY, TILE
from tests.slow.power_failure import Disk, read_files, write_files


def record(folder, nursery):
    """The files of a folder, and what a run that computes the map into a store in this folder does to them."""
    events = folder.with_name(f"{folder.name}.events")
    (folder / "study.toml").write_text(STUDY)
    before = read_files(folder)
    nursery.run(folder / "map.zarr", "--threads", 2, INSTANT_RECORD=events).wait()
    done = pickle.loads(events.read_bytes())
    assert Disk(before).apply(done).files(random.Random()) == read_files(folder), "the model is wrong"
    return before, done


@pytest.fixture(scope="module", params=["first", "resumed"])
def recording(request, nursery, tmp_path_factory):
    """A run into a new store, or one that goes on after a power failure in the middle of the first."""
    before, events = record(tmp_path_factory.mktemp("recorded"), nursery)
    if request.param == "first":
        return before, events
    folder = tmp_path_factory.mktemp("resumed")
    write_files(Disk(before).apply(events[: len(events) // 2]).files(random.Random(5), 0.5), folder)
    return record(folder, nursery)


def in_place(whole):
    """The files of the undisturbed store, as they are in a folder of a run."""
    return {f"map.zarr/{name}": content for name, content in read_files(whole).items()}


def results(files):
    """The content by name of the files of a store without the record of its run."""
    return {name: content for name, content in files.items() if not name.startswith(("map.zarr/run/", "study.toml"))}


def blocks(files):
    return {int(name.rpartition("/")[2]) for name in files if name.startswith("map.zarr/run/blocks/")
            and name.rpartition("/")[2].isdecimal()}


def check_values(path, right):
    """No value that can be read is wrong: it is right, or says that it is not computed, or the store is refused."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that a part is not computed
            found = gc.load(path).load()
    except gc.InputError:
        return
    for name, values in found.data_vars.items():
        fill = ArraySpec(values.dtype.str, ()).fill
        xr.testing.assert_equal(values, xr.where(values.isnull() | (values == fill), values, right[name]))


def goes_on(files, folder, whole, log):
    """Let a run complete a store with these files; returns its grid and the tiles that were computed for it."""
    write_files(files, folder)
    check_values(folder / "map.zarr", whole)
    log.unlink(missing_ok=True)
    assert gc.run(MAP, folder / "map.zarr", tile=TILE).finished
    grid = open_store(folder / "map.zarr").grid
    first = {int(grid.items(tile)[0]): tile for tile in range(grid.count)}
    return grid, {first[int(line)] for line in log.read_text().splitlines()} if log.exists() else set()


@pytest.mark.parametrize("kept", [0.0, 0.5, 0.9])
@pytest.mark.parametrize("points", [4, pytest.param(100, marks=pytest.mark.exhaustive)])
def test_after_a_power_failure_a_run_goes_on_to_the_same_bytes(recording, whole, tmp_path, instant, kept, points):
    before, events = recording
    rng, right, most = random.Random(f"{kept}"), gc.run(MAP), 0
    described = next((n for n, event in enumerate(events, 1) if event[2] == "map.zarr/run/study.json"), 1)
    for number in range(points):
        early, late = (len(events) * n // (points - 1) for n in (number - 1, number))
        last = rng.randint(early, late) if number else described
        disk, folder = Disk(before).apply(events[:last]), tmp_path / str(number)
        grid, computed = goes_on(disk.files(rng, kept), folder, right, instant)
        assert results(read_files(folder)) == results(in_place(whole))
        durable = blocks(disk.files(rng, 0.0))
        assert not computed & {tile for block in durable for tile in grid.tiles_of(block)}, "a block was lost"
        most = max(most, len(durable))
    assert most > 0, "the power always failed before the first block"


def test_what_a_finished_run_leaves_is_durable(recording, whole, tmp_path, instant):
    before, events = recording
    left = Disk(before).apply(events).files(random.Random(), 0.0)
    assert results(left) == results(in_place(whole))
    assert not goes_on(left, tmp_path / "left", gc.run(MAP), instant)[1] and "map.zarr/run/finished" in left


def test_a_tile_is_deleted_after_its_block_is_written(recording):
    made, written = set(), set()
    for kind, path, new in recording[1]:
        made |= {new} if kind == "rename" and new.startswith("map.zarr/run/tiles/") else set()
        written |= blocks([new]) if kind == "rename" else set()
        assert kind != "delete" or path not in made or int(path.split("/")[3]) in written
    assert made and written


@pytest.mark.parametrize("made", ["run/study.json", "/c/0/0", "run/blocks/0"])
def test_a_run_that_is_killed_makes_nothing_less_durable(nursery, whole, tmp_path, made):
    """A run is killed as soon as it has made a file; another one finishes the store; then the power fails."""
    for name in ("first", "second"):
        (tmp_path / name).mkdir()
    before, events = record(tmp_path / "first", nursery)
    last = next(n for n, (kind, _, new) in enumerate(events, 1)
                if kind in ("rename", "link") and new.startswith("map.zarr/") and new.endswith(made))
    disk = Disk(before).apply(events[:last])
    write_files(disk.files(random.Random()), tmp_path / "second")
    disk.apply(record(tmp_path / "second", nursery)[1])
    left = disk.files(random.Random(), 0.0)
    assert results(in_place(whole)).items() <= left.items() and blocks(left) == blocks(in_place(whole))
    assert {"map.zarr/run/study.json", "map.zarr/run/finished"} <= set(left)
