"""Tiles, chunks and blocks of stores: they cover the grid once, and any program that reads Zarr reads the results."""

import itertools
from dataclasses import dataclass
from math import prod

import numpy as np
import pytest
import xarray as xr
import zarr

import gearchaos as gc
from gearchaos.store import blocks
from gearchaos.store.objects import Objects
from gearchaos.store.run import run
from gearchaos.store.store import ArraySpec, Store, open_store
from gearchaos.store.tiles import Grid, divide, with_blocks
from tests.contracts.store.stores import MAP, files, half_done

ARRAYS = {"label": ArraySpec("|i1", ()), "period": ArraySpec("<i4", ()), "v_rms": ArraySpec("<f8", ()),
          "section": ArraySpec("<f8", (3,)), "multiplier": ArraySpec("<c16", (2,)), "count": ArraySpec("<u2", ())}
GRID = Grid((10, 13), (2, 3), (4, 6), (8, 12))
"""Tiles, chunks and blocks that are cut off at both ends of the grid: 25 tiles in four blocks."""


@dataclass(frozen=True)
class Numbers:
    """What a store needs of a study with the grid of `GRID`."""

    gridded = True
    count = 130
    grid = {"y": 10, "x": 13}  # noqa: RUF012 -- it stands for a property

    def finish(self, found):
        return xr.Dataset({n: (("y", "x", f"{n}_n")[: v.ndim + 1], v.reshape(10, 13, *v.shape[1:]))
                           for n, v in found.items()}, {"x": np.arange(13.0)}, {"study": "numbers"})


VALUES = {name: (50 * np.random.default_rng(len(name)).standard_normal((10, 13, *spec.shape))).astype(spec.dtype)
          for name, spec in ARRAYS.items() if name != "count"} | {"count": np.arange(130, dtype="u2").reshape(10, 13)}


@pytest.fixture
def store(tmp_path):
    """A store with its metadata alone."""
    made = Store(Objects(tmp_path / "s.zarr"), Numbers(), GRID, ARRAYS, {})
    for name, content in made.metadata().items():
        made.objects.put(name, content)
    return made


def write(store, numbers):
    for tile in numbers:
        values = {n: v[GRID.region(tile)].reshape(-1, *ARRAYS[n].shape) for n, v in VALUES.items()}
        blocks.write_tile(store, tile, values, 1.5)


@pytest.mark.parametrize("grid", [
    GRID, Grid((5, 7), (2, 3)), Grid((300,), (64,), (128,), (256,)), Grid((300,), (64,), (300,), (300,)),
    Grid((1, 9), (1, 9)), Grid((4, 4), (4, 1), (4, 2), (4, 4)), Grid((6, 100), (2, 8), (6, 16), (6, 32)),
], ids=str)
def test_tiles_and_blocks_cover_the_grid_once_and_lie_in_each_other(grid):
    owner, plane = np.full(grid.shape, -1), np.arange(prod(grid.shape)).reshape(grid.shape)
    for block in range(grid.block_count):
        assert np.all(owner[grid.block_region(block)] == -1)
        owner[grid.block_region(block)] = block
        assert grid.tile_count(block) == len(grid.tiles_of(block))
        assert grid.blocks_in(grid.block_region(block)) == [block]
    items = [grid.items(t) for t in range(grid.count)]
    assert np.all(owner >= 0) and sorted(np.concatenate(items)) == list(range(prod(grid.shape)))
    for tile in range(grid.count):
        np.testing.assert_array_equal(items[tile], plane[grid.region(tile)].ravel())
        assert set(owner[grid.region(tile)].ravel()) == {grid.block_of(tile)} and grid.size(tile) == len(items[tile])
        chunks = {tuple(i // c for i, c in zip(at, grid.chunk, strict=True))
                  for at in np.argwhere(np.isin(plane, items[tile]))}
        assert len(chunks) == 1
    assert sorted(itertools.chain(*map(grid.tiles_of, range(grid.block_count)))) == list(range(grid.count))


@pytest.mark.parametrize(("shape", "block", "size", "tile"), [
    ((100, 100), (1, 1), 64, (8, 8)), ((100, 100), (1, 1), 100, (8, 8)), ((100, 100), (1, 1), 128, (16, 8)),
    ((4, 1000), (1, 1), 256, (4, 64)), ((10, 50), (1, 50), 20, (1, 50)), ((10, 50), (1, 50), 200, (4, 50))])
def test_tiles_are_as_square_as_may_be(shape, block, size, tile, monkeypatch):
    monkeypatch.setattr(gc.Zones, "grid", dict(zip("yx", shape, strict=True)))
    monkeypatch.setattr(gc.Zones, "block", dict(zip("yx", block, strict=True)))
    assert divide(MAP, size) == Grid(shape, tile)


@pytest.mark.parametrize(("shape", "tile", "item_bytes", "chunk", "block"), [
    ((31623, 31623), (128, 128), 100, (512, 256), (1024, 1024)),
    ((1000, 1000), (128, 128), 100, (256, 256), (256, 256)), ((12, 16), (8, 4), 100, (12, 16), (12, 16)),
    ((100_000,), (64,), 1024, (65536,), (65536,)), ((10, 50_000), (4, 50_000), 100, (4, 50_000), (4, 50_000)),
    ((7, 7), (7, 7), 0, (7, 7), (7, 7)), ((10**6, 10**6), (128, 128), 100, (512, 256), (1024, 1024))])
def test_chunks_have_a_mebibyte_and_blocks_a_hundred_unless_there_are_too_many(shape, tile, item_bytes, chunk, block):
    grid = with_blocks(Grid(shape, tile), 8, item_bytes)
    assert (grid.tile, grid.chunk, grid.block) == (tile, chunk, block)


def test_a_billion_cells_are_twenty_thousand_files():
    study = gc.Zones(MAP.model, "omega=0.5:1.1:31623", "eps1=0:0.3:31623")
    found = gc.Zones(MAP.model, "omega=0.5:1.1:2", "eps1=0:0.3:2").compute(np.arange(4))
    sizes = [v.dtype.itemsize for v in found.values()]
    grid = with_blocks(divide(study), max(sizes), sum(sizes))
    assert len(found) * grid.block_count == 21 * 31**2 == 20_181


@pytest.mark.parametrize("shards", [2, 3, 7, 64, 1000])
def test_there_are_blocks_enough_for_all_shards(shards):
    grid = with_blocks(Grid((1000, 1000), (32, 32)), 8, 100, shards)
    items = np.array([prod(p.stop - p.start for p in grid.block_region(b)) for b in range(grid.block_count)])
    assert max(items[n::shards].sum() for n in range(shards)) < (1.1 if shards < 1000 else 2.1) * 10**6 / shards


def test_zarr_reads_the_blocks_that_are_written_and_fill_values_elsewhere(store):
    write(store, [*store.grid.tiles_of(0), *store.grid.tiles_of(3), 4])
    assert blocks.write_block(store, 0) == blocks.write_block(store, 3) == []
    written = np.isin(np.arange(130).reshape(10, 13), np.concatenate(
        [GRID.items(t) for b in (0, 3) for t in GRID.tiles_of(b)]))
    opened = xr.open_zarr(store.objects.folder, mask_and_scale=False)
    assert opened.attrs == {"study": "numbers"} and opened.x.values.tolist() == list(range(13))
    fills = {"label": -1, "period": -1, "count": 65535}
    for name, spec in ARRAYS.items():
        expected = np.full_like(VALUES[name], fills.get(name, np.nan))
        expected[written] = VALUES[name][written]
        assert opened[name].encoding["shards"] == (8, 12, *spec.shape)
        np.testing.assert_array_equal(zarr.open_array(store.objects.folder / name, mode="r")[:], expected)
        np.testing.assert_array_equal(opened[name].values, expected)


def test_a_tile_is_read_as_it_was_written_without_any_changed_byte_and_by_its_own_number(store):
    write(store, [11, 12])
    _, found = blocks.read_tile(store, 12, ARRAYS)
    for name, values in VALUES.items():
        np.testing.assert_array_equal(found[name], values[GRID.region(12)])
        assert found[name].dtype == values.dtype
    assert (blocks.tile_record(store, 12).seconds, blocks.tile_record(store, 23)) == (1.5, None)
    content = store.objects.get(store.tile(12))
    for i in range(0, len(content), 7):
        store.objects.put(store.tile(12), content[:i] + bytes([content[i] ^ 4]) + content[i + 1:])
        assert blocks.read_tile(store, 12, ARRAYS) is None
    for wrong in (content[:-1], b"", store.objects.get(store.tile(11))):
        store.objects.put(store.tile(12), wrong)
        assert blocks.read_tile(store, 12, ARRAYS) is None
    write(store, set(GRID.tiles_of(0)) - {12})
    assert blocks.write_block(store, 0) == [12] and not blocks.is_written(store, 0)
    assert not (store.objects.folder / store.tile(12)).exists()


def test_names_of_the_objects_of_a_run(tmp_path, instant, monkeypatch):
    grid = open_store(path := half_done(tmp_path / "map.zarr", monkeypatch)).grid
    assert (grid.tile, grid.chunk, grid.block, grid.count, grid.block_count) == ((4, 2), (4, 4), (8, 4), 12, 3)
    own = {"zarr.json", "omega/zarr.json", "omega/c/0", "eps1/zarr.json", "eps1/c/0", "run/zarr.json"}
    names = own | {f"{n}/{rest}" for n in ("label", "period", "v_rms") for rest in ("zarr.json", "c/0/1", "c/0/2")}
    run_files = {"run/study.json", "run/blocks/1", "run/blocks/2", "run/failed/0"}
    assert files(path).keys() == names | run_files | {f"run/tiles/0/{n}" for n in (1, 6, 7)}
    assert set(open_store(path).files) == {n for n in names if "/c/0/" not in n}
    run(MAP, path)
    assert files(path).keys() == names | run_files - {"run/failed/0"} | {"run/finished", "run/blocks/0"} | {
        f"{n}/c/0/0" for n in ("label", "period", "v_rms")}
