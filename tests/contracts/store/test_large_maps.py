"""Maps that do not fit into memory: checked, computed, loaded and exported part by part."""

import errno
import shutil
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos import export as exporting
from gearchaos.dynamics import Classification
from gearchaos.errors import InputError
from gearchaos.execute import machine
from gearchaos.store.blocks import State
from gearchaos.store.objects import Objects
from gearchaos.store.read import StoredArray, lazy
from gearchaos.store.run import run
from gearchaos.store.store import FINISHED, ArraySpec, Store, open_store
from gearchaos.store.tiles import Grid
from gearchaos.studies.maps.refine import SIDE, refined
from gearchaos.studyfile import load_study
from tests.commands import ask

MODEL, SINGLE = gc.MeshModel.of(q0=0.1), gc.MeshModel.of(kind="single")
FAST = Classification(transient_lengths=(20,), exponent_run=50, doublings=0, longest_transient=100, longest_period=4,
                      averaging_periods=8)
GIGABYTE = 1 << 30


def axes(rows, columns):
    return f"omega=0.5:1.1:{columns}", f"eps1=0.05:0.3:{rows}"


@pytest.fixture(scope="module")
def unfinished(tmp_path_factory):
    """The store of a map of 12 x 16 cells in 8 tiles of 8 x 4, of which three are computed: every third one."""
    path = tmp_path_factory.mktemp("unfinished") / "map.zarr"
    run(gc.Zones(MODEL, *axes(12, 16), settings=FAST), path, tile=32, shard="1/3")
    return path


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    path = tmp_path_factory.mktemp("finished") / "map.zarr"
    run(gc.Zones(MODEL, *axes(12, 16), settings=FAST), path, tile=32)
    return path


@pytest.mark.parametrize(("memory", "make", "rule"), [
    (GIGABYTE, lambda: gc.Zones(MODEL, *axes(31_623, 31_623)).run(), "cells must be at most"),
    (GIGABYTE, lambda: gc.zones(MODEL, *axes(1000, 1000), starts=10), "cells times starts must be at most"),
    (GIGABYTE, lambda: gc.Bifurcation(MODEL, "omega=0.5:1.1:1000000").run(), "columns times points must be at most"),
    # what a store cannot divide
    (GIGABYTE, lambda: gc.Zones(MODEL, *axes(2, 1_000_000), starts=5), "cells of a row times starts must be at most"),
    (GIGABYTE, lambda: gc.Bifurcation(MODEL, "omega=0.5:1.1:1000000", mode="up"), "columns times points must be"),
    (GIGABYTE, lambda: gc.Basins(SINGLE, "z=-1:1:2000", "z_dot=-1:1:2000"), "cells must be at most"),
    (10**18, lambda: gc.Zones(MODEL, *axes(1_000_000, 1_000_000)).run(), "the study must end within 100 years")])
def test_what_is_computed_in_memory_must_fit_into_it_and_end(monkeypatch, memory, make, rule):
    monkeypatch.setattr(machine, "memory", lambda: memory)
    with pytest.raises(InputError, match=rule):
        make()


def test_a_map_for_many_machines_may_take_more_memory_and_time_than_one_has(monkeypatch):
    monkeypatch.setattr(machine, "memory", lambda: GIGABYTE)
    assert gc.Zones(MODEL, *axes(1_000_000, 1_000_000)).count == 10**12


def test_the_last_cells_of_a_huge_map_are_those_of_small_maps():
    side = 60_000  # more than 2^31 cells
    study = gc.Zones(MODEL, *axes(side, side), settings=FAST)
    found = study.compute(np.arange(study.count - 3, study.count))
    x, y = study.x.values[-3:], study.y.values[-1]
    small = gc.zones(MODEL, gc.Axis("omega", x[0], x[2], 3), gc.Axis("eps1", y, y, 1), settings=FAST)
    np.testing.assert_array_equal(small.omega, x)
    for name, values in found.items():
        assert values.tobytes() == small[name].values[0].tobytes(), name


def test_the_last_part_of_a_huge_refined_map_is_that_of_a_small_one():
    side = 65_536

    def computed(cells, columns):
        row, column = (v % SIDE for v in np.divmod(cells, columns))
        label = np.where(np.hypot(row - 90, column - 140) < 40, 3, 1).astype(np.int8)
        return {"label": label, "period": (label == 1).astype(np.int32), "reason": np.ones(len(cells), np.int8)}

    row, column = np.divmod(np.arange(SIDE**2), SIDE)
    cells = (row + side - SIDE) * side + column + side - SIDE
    assert cells[-1] == side**2 - 1
    huge = refined(lambda c: computed(c, side), cells, side, 8)
    small = refined(lambda c: computed(c, SIDE), np.arange(SIDE**2), SIDE, 8)
    for name, values in small.items():
        np.testing.assert_array_equal(huge[name], values)


def stored(dataset, block, read=None):
    """The same Dataset with variables that are read when they are used; ``read`` collects the regions."""
    class Memory(StoredArray):
        def read(self, region):
            if read is not None:
                read.append(region)
            return dataset[self._name].values[region].copy()

    arrays = {n: ArraySpec(v.dtype.str, v.shape[2:]) for n, v in dataset.data_vars.items()}
    store = SimpleNamespace(arrays=arrays, grid=Grid(next(iter(dataset.data_vars.values())).shape[:2], block))
    return dataset.assign({n: lazy(dataset[n].variable, Memory(store, n, set())) for n in arrays})


@pytest.mark.parametrize("key", [
    (slice(None), slice(None)), (slice(None, None, 3), slice(2, None, 5)), (slice(None, None, -2), 3),
    (-1, slice(14, 2, -3)), ([3, 1, 1], slice(None)), (slice(4, 4), slice(None)), (slice(4, 4), slice(None, None, 3)),
    (slice(0, 5, -1), slice(None, 0, -2)), ([3, 1], slice(0, 5, -1)), (slice(5, 0, -2), slice(-1, -1, -1)), (7, 0),
], ids=str)
@pytest.mark.parametrize("block", [(5, 7), (1, 1), (12, 16)])
def test_parts_of_stored_arrays_are_those_of_arrays_in_memory(key, block):
    plain = np.random.default_rng(0).normal(size=(12, 16, 3))
    whole = xr.Dataset({"a": (("y", "x", "p"), plain)})
    for last in (slice(None), slice(None, None, 2), 1):
        lazily = stored(whole, block)["a"][(*key, last)]
        np.testing.assert_array_equal(lazily.values, whole["a"][(*key, last)].values)


def test_nothing_is_read_until_values_are_used_and_then_once():
    read = []
    dataset = stored(xr.Dataset({"a": (("y", "x"), np.arange(12.0).reshape(3, 4))}), (1, 2), read)
    part = dataset["a"][1:, 2:]
    assert read == []
    assert part.values.tolist() == [[6, 7], [10, 11]]
    assert read == [(slice(1, 2), slice(2, 4)), (slice(2, 3), slice(2, 4))]
    assert dataset["a"].values.sum() == dataset["a"].values.sum() == 66 and len(read) == 2 + 6


def test_spaced_values_are_read_block_by_block():
    read = []
    dataset = stored(xr.Dataset({"a": (("y", "x"), np.arange(400.0).reshape(20, 20))}), (5, 5), read)
    assert dataset["a"][::4, ::7].shape == (5, 3) and read == []
    np.testing.assert_array_equal(dataset["a"][::4, ::7].values, np.arange(400.0).reshape(20, 20)[::4, ::7])
    assert max((r.stop - r.start) * (c.stop - c.start) for r, c in read) <= 25


def test_an_unfinished_store_loads_with_a_warning_of_what_is_missing(unfinished, finished):
    with pytest.warns(UserWarning, match=r"5 of 8 tiles are not computed, by position from 0: eps1=0:8 omega=4:12, "
                                         r"eps1=8:12 omega=0:8, .*; values there are NaN, -1 in integers"):
        found = gc.load(unfinished)
    whole, known = gc.load(finished), found["label"].values > 0
    assert known.sum() == 80
    for name, array in found.data_vars.items():
        np.testing.assert_array_equal(array.values[known], whole[name].values[known])
        rest = array.values[~known]
        assert np.isnan(rest).all() if rest.dtype.kind == "f" else (rest == -1).all(), name


def test_a_store_of_basins_that_is_being_finished_is_not_damaged(tmp_path, monkeypatch):
    study = gc.Basins(SINGLE, "z=-1:1:6", "z_dot=-1:1:6", settings=FAST)

    def put(self, name, *content, true=Objects.put, **how):
        if name == FINISHED:
            raise KeyboardInterrupt
        true(self, name, *content, **how)

    monkeypatch.setattr(Objects, "put", put)
    with pytest.raises(KeyboardInterrupt):
        run(study, tmp_path / "basins.zarr", tile=9)
    monkeypatch.undo()
    assert (tmp_path / "basins.zarr" / "attractor").is_dir() and not open_store(tmp_path / "basins.zarr").finished
    xr.testing.assert_identical(gc.load(tmp_path / "basins.zarr"), study.run())
    assert run(study, tmp_path / "basins.zarr").finished
    xr.testing.assert_identical(gc.load(tmp_path / "basins.zarr"), study.run())


@pytest.mark.parametrize("state", ["finished", "unfinished"])
@pytest.mark.filterwarnings("ignore:.*tiles are not computed")
def test_values_of_a_store_that_was_moved_after_loading_are_an_error(tmp_path, state, request):
    path = shutil.copytree(request.getfixturevalue(state), tmp_path / "map.zarr")
    found = gc.load(path)
    path.rename(tmp_path / "moved.zarr")
    with pytest.raises(InputError, match=r"store must still be there .*map\.zarr'\. .*load it again"):
        found["v_rms"].load()


def test_an_unfinished_store_of_basins_numbers_what_is_missing(tmp_path):
    study = gc.Basins(SINGLE, "z=-1:1:6", "z_dot=-1:1:6", settings=FAST)
    run(study, tmp_path / "plane.zarr", tile=4, shard="1/3")
    with pytest.warns(UserWarning, match=r"tiles are not computed.*the attractor there is -2"):
        found = gc.load(tmp_path / "plane.zarr")
    store = open_store(tmp_path / "plane.zarr")
    done = sum(store.grid.size(n) for block in State.of(store).blocks for n in store.grid.tiles_of(block))
    assert int((found["attractor"].values != -2).sum()) == done < study.count
    counts = [np.sum(found["attractor"].values == n) for n in found["number"].values]
    assert found["attractor_fraction"].values.tolist() == [count / done for count in counts]


def exported(path, target, *options):
    result = ask("export", path, "--out", target, *options, code=0)
    return gc.load(target), result.stderr


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*tiles are not computed")
def test_an_exported_file_is_that_of_save(unfinished, tmp_path, monkeypatch):
    monkeypatch.setattr(Store, "block", {"eps1": 5, "omega": 7})
    gc.save(gc.load(unfinished), tmp_path / "saved.nc")
    (found, said), saved = exported(unfinished, tmp_path / "map.nc"), gc.load(tmp_path / "saved.nc")
    assert "map.zarr: 5 of 8 tiles are not computed, " in said
    xr.testing.assert_identical(found, saved)
    assert list(found.variables) == list(saved.variables) and list(found.attrs) == list(saved.attrs)
    own = {"chunksizes", "preferred_chunks", "source"}
    for name in saved.variables:
        encodings = [{k: v for k, v in one[name].encoding.items() if k not in own} for one in (found, saved)]
        assert repr(encodings[0]) == repr(encodings[1]), name
        assert not found[name].ndim or found[name].encoding["fletcher32"]


@pytest.mark.slow
def test_an_export_in_physical_units_is_the_same_in_any_blocks(tmp_path, monkeypatch):
    pair = load_study("examples/physical_pair.toml").pair
    study = gc.Zones(pair, "speed=3000:4000:4", "torque=100:200:3", settings=FAST)
    run(study, tmp_path / "map.zarr")
    monkeypatch.setattr(Store, "block", {"torque": 1, "speed": 3})
    gc.save(gc.physical(gc.load(tmp_path / "map.zarr")), tmp_path / "saved.nc")
    found, _ = exported(tmp_path / "map.zarr", tmp_path / "map.nc", "--physical")
    xr.testing.assert_identical(found, gc.load(tmp_path / "saved.nc"))


def test_no_more_than_a_block_of_one_variable_is_read_at_once(tmp_path):
    read = []
    plain = xr.Dataset({"a": (("y", "x"), np.arange(400.0).reshape(20, 20)), "b": (("y", "x"), np.ones((20, 20)))})
    dataset = stored(plain, (5, 4), read)
    exporting.export_dataset(dataset, ["a", "b"], {"y": 5, "x": 4}, tmp_path / "map.nc", lambda ds: ds)
    whole = [r for r in read if r != (slice(0, 1), slice(0, 1))]
    assert whole == 2 * [(slice(i, i + 5), slice(j, j + 4)) for i in range(0, 20, 5) for j in range(0, 20, 4)]
    xr.testing.assert_identical(gc.load(tmp_path / "map.nc"), plain)


@pytest.mark.parametrize("fails_at", [1, 12])
def test_a_full_disk_ends_an_export_without_a_file(fails_at, finished, tmp_path, monkeypatch):
    """Writing fails from some call on, as on a full disk; HDF5 itself must not fail."""
    calls, path_open = [], exporting.Path.open

    class Full:
        def __init__(self, file):
            self.file = file

        def write(self, content):
            calls.append(len(content))
            if len(calls) >= fails_at:
                raise OSError(errno.ENOSPC, "No space left on device")
            return self.file.write(content)

        def __getattr__(self, name):
            return getattr(self.file, name)

    monkeypatch.setattr(exporting.Path, "open", lambda self, mode="r", *more, **options: (
        Full(path_open(self, mode, *more, **options)) if mode == "w+b" else path_open(self, mode, *more, **options)))
    store, out = open_store(finished), tmp_path / "map.nc"
    out.write_bytes(b"older")
    with pytest.raises(OSError, match="No space left on device") as failed:
        exporting.export_dataset(gc.load(finished), store.arrays, store.block, out, lambda ds: ds)
    assert failed.value.filename == str(out) and len(calls) == fails_at
    assert list(tmp_path.iterdir()) == [out] and out.read_bytes() == b"older"
