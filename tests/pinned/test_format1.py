"""Stores of format 1, made by version 0.1.0 before journals: they are read and resumed.

The archive holds three: a map of 3 × 4 tiles of which all are done, the same with every second tile, and basins of
which every third tile is done.
"""

import json
import os
import tarfile
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos.dynamics import Classification
from gearchaos.store.reading.check import check
from gearchaos.store.reading.info import summary
from gearchaos.store.reading.missing import missing_parts
from gearchaos.store.running.run import run
from gearchaos.store.store import open_store

ARCHIVE = Path(__file__).with_name("stores_of_format_1.tar.xz")
SHORT = Classification(longest_transient=800, doublings=1, averaging_periods=16)
MAP = gc.Zones(gc.MeshModel.of(q0=0.1), gc.Axis("omega", 0.5, 1.1, 16), gc.Axis("eps1", 0.05, 0.3, 12), settings=SHORT)
BASINS = gc.Basins(gc.MeshModel.of(kind="single", omega=2.3, eps1=0.05, q0=0.1), gc.Axis("z", -3, 3, 8),
                   gc.Axis("z_dot", -2, 2, 6), settings=SHORT)
STATUS = {"done": True, "seconds": 1.0, "machine": "m:1", "attempt": 1, "error": None, "at": 1.7e9}


@pytest.fixture
def old(tmp_path):
    """The folder with the stores."""
    with tarfile.open(ARCHIVE) as archive:
        archive.extractall(tmp_path, filter="data")
    return tmp_path


def files(path):
    """The bytes of all files but those in ``run``."""
    every = {p.relative_to(path): p.read_bytes() for p in path.rglob("*") if p.is_file()}
    return {name: data for name, data in every.items() if name.parts[0] != "run"}


def test_a_finished_store_reads_as_zarr_reads_it(old):
    store = open_store(old / "whole.zarr")
    assert store.format == 1 and store.finished and store.grid.group == store.grid.tile == (4, 4)
    xr.testing.assert_identical(store.dataset(), xr.open_zarr(old / "whole.zarr").load())
    assert summary(store)["tiles_done"] == summary(store)["tiles"] == 12 and check(store).files == []


def test_a_finished_store_stays_as_it_is(old):
    before, said = files(old / "whole.zarr"), []
    assert run(MAP, old / "whole.zarr").done == 12
    assert files(old / "whole.zarr") == before and said == []


def test_what_an_unfinished_store_has_is_kept_and_the_rest_has_its_fill_values(old):
    half, whole = (open_store(old / f"{name}.zarr") for name in ("half", "whole"))
    assert summary(half)["tiles_done"] == 6 and not half.finished
    known = half.read("label") != 0
    assert known.mean() == 0.5 and np.all(np.isnan(half.read("v_rms")[~known]))
    assert np.all(half.read("contact")[~known] == -1)
    np.testing.assert_array_equal(half.read("label")[known], whole.read("label")[known])


def test_an_unfinished_store_is_resumed_in_its_format(old):
    half, whole = files(old / "half.zarr"), files(old / "whole.zarr")
    outcome = run(MAP, old / "half.zarr")
    resumed = files(old / "half.zarr")
    assert (outcome.done, outcome.failed) == (12, {}) and half.items() <= resumed.items()
    assert resumed.keys() == whole.keys() and open_store(old / "half.zarr").finished
    xr.testing.assert_equal(xr.open_zarr(old / "half.zarr").load(), MAP.run())  # in the words of its beginning
    assert json.loads((old / "half.zarr" / "run" / "study.json").read_text())["format"] == 1


def test_an_unfinished_store_of_motions_that_are_compared_at_the_end_is_resumed(old):
    half = open_store(old / "basins.zarr").dataset()
    assert 0 < np.sum(half["attractor"].values == -2) < 48
    run(BASINS, old / "basins.zarr")
    xr.testing.assert_identical(xr.open_zarr(old / "basins.zarr").load(), BASINS.run())


WRONG = {
    "words for numbers": STATUS | {"seconds": "long"}, "NaN": STATUS | {"seconds": float("nan")}, "list": [1, 2],
    "infinite": STATUS | {"at": float("inf")}, "missing": {"done": True}, "more": STATUS | {"colour": "red"},
    "deep": json.loads("[" * 500 + "]" * 500), "number for a word": STATUS | {"machine": 7},
    "word for a number": STATUS | {"attempt": "1"}, "no attempt": STATUS | {"attempt": 0}, "cut short": None,
}


@pytest.mark.parametrize("status", WRONG.values(), ids=WRONG)
def test_a_status_of_wrong_content_is_no_status(status, old):
    file = old / "whole.zarr" / "run" / "tiles" / "2.json"
    file.write_text('{"done": tr' if status is None else json.dumps(status))
    progress = open_store(old / "whole.zarr").progress()
    assert progress.missing(range(12)) == [2]
    assert run(MAP, old / "whole.zarr").done == 12


@pytest.mark.parametrize("name", ["77777", "-1", "01", "1e3", "9" * 30, "²"])
def test_a_status_of_no_tile_is_no_status(name, old):
    (old / "half.zarr" / "run" / "tiles" / f"{name}.json").write_text(json.dumps(STATUS))
    state = summary(open_store(old / "half.zarr"))
    assert (state["tiles_done"], state["pieces_done"]) == (6, 96)


def test_a_status_that_is_a_pipe_is_no_status(old, no_waiting):
    file = old / "whole.zarr" / "run" / "tiles" / "2.json"
    file.unlink()
    os.mkfifo(file)
    assert open_store(old / "whole.zarr").progress().missing(range(12)) == [2]


def test_a_failed_tile_is_told_and_tried_again(old):
    failed = STATUS | {"done": False, "error": "ValueError: no"}
    (old / "half.zarr" / "run" / "tiles" / "1.json").write_text(json.dumps(failed))
    assert summary(open_store(old / "half.zarr"))["failed"] == {"1": "ValueError: no"}
    assert run(MAP, old / "half.zarr").failed == {}


@pytest.mark.parametrize("damage", ["flipped byte", "cut short", "missing", "empty"])
def test_a_damaged_chunk_is_found_and_computed_again(old, damage):
    path, before = old / "whole.zarr", files(old / "whole.zarr")
    chunk = path / "v_rms" / "c" / "1" / "2"
    content = chunk.read_bytes()
    if damage == "missing":
        chunk.unlink()
    else:
        flipped = content[:9] + bytes([content[9] ^ 8]) + content[10:]
        chunk.write_bytes({"flipped byte": flipped, "cut short": content[:9], "empty": b""}[damage])
    assert (damage == "missing") == (missing_parts(open_store(path), open_store(path).progress()).tiles == [6])
    found = check(open_store(path))
    assert (found.files, found.groups, found.tiles, found.noted) == (["v_rms/c/1/2"], [6], [6], True)
    run(MAP, path)
    assert files(path) == before and check(open_store(path)).files == []
