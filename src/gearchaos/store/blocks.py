"""Tiles and blocks: what a worker writes when it has computed, and whether that is still as it was written."""

from __future__ import annotations

import io
import json
import socket
import time
import zlib
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, astuple, dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import zarr

from gearchaos.store.objects import Objects
from gearchaos.store.store import BLOCKS, FAILED, STUDY, TILES, Store, checked, from_description, with_checksum
from gearchaos.store.tiles import span, within

_HEAD = 160  # size in bytes of the beginning of the object of a tile, with what is known of its computation

_THREADS = 4  # number of arrays of a block that are encoded and written at the same time


@dataclass(frozen=True)
class TileRecord:
    """What is known of the computation of a tile: seconds it took, time at its end, machine."""

    tile: int
    seconds: float
    at: float
    host: str


@dataclass(frozen=True)
class BlockRecord:
    """What is known of a block: size and CRC-32 of its shard in each array, and its tiles."""

    shards: dict[str, tuple[int, int]]
    tiles: list[TileRecord]


def write_tile(store: Store, tile: int, results: Mapping[str, np.ndarray], seconds: float) -> None:
    """Write the results (L, ...) of the work items of a tile."""
    for name, spec in store.arrays.items():
        if results[name].shape != (store.grid.size(tile), *spec.shape):
            raise ValueError(f"{name} has results of shape {results[name].shape[1:]}, not {spec.shape}")
    record = TileRecord(tile, round(seconds, 6), round(time.time(), 3), socket.gethostname()[:40])
    file = io.BytesIO()
    file.write(json.dumps(asdict(record)).encode().ljust(_HEAD))
    arrays: dict[str, Any] = {n: np.asarray(results[n], spec.dtype) for n, spec in store.arrays.items()}
    np.savez(file, **arrays)
    store.objects.put(store.tile(tile), with_checksum(file.getvalue()))


def read_tile(store: Store, tile: int, names: Iterable[str]) -> tuple[TileRecord, dict[str, np.ndarray]] | None:
    """What is known of a tile, and its results in some arrays, in the shape of the tile; None if it is missing or
    damaged."""
    try:
        content = checked(store.objects.get(store.tile(tile)))
    except ValueError:
        return None
    record, shape = TileRecord(**json.loads(content[:_HEAD])), span(store.grid.region(tile))
    if record.tile != tile:
        return None
    with np.load(io.BytesIO(content[_HEAD:])) as found:
        return record, {name: found[name].reshape(*shape, *store.arrays[name].shape) for name in names}


def tile_record(store: Store, tile: int) -> TileRecord | None:
    """What is known of a tile that is in no block yet; None if it is damaged or gone."""
    try:
        return TileRecord(**json.loads(store.objects.get(store.tile(tile), _HEAD) or b""))
    except (TypeError, ValueError):
        return None


def block_record(store: Store, block: int) -> BlockRecord | None:
    """What is known of a block; None if it is not written, or its record is damaged."""
    try:
        found = json.loads(checked(store.objects.get(f"{BLOCKS}/{block}")))
    except ValueError:
        return None
    return BlockRecord({n: tuple(s) for n, s in found["shards"].items()}, [TileRecord(*t) for t in found["tiles"]])


def is_written(store: Store, block: int) -> bool:
    """Whether a block is written."""
    return store.objects.get(f"{BLOCKS}/{block}", 1) is not None


def write_block(store: Store, block: int) -> list[int]:
    """Write a block from its tiles, and delete them; returns the tiles that are missing or damaged, of which there must
    be none.

    A process that is killed meanwhile leaves tiles, shards, or both; whoever goes on writes the same bytes.
    """
    region, tiles = store.grid.block_region(block), store.grid.tiles_of(block)
    values = {n: np.empty((*span(region), *spec.shape), spec.dtype) for n, spec in store.arrays.items()}
    records, damaged = [], []
    for tile in tiles:
        found = read_tile(store, tile, store.arrays)
        if found is None:
            damaged.append(tile)
            continue
        records.append(found[0])
        for name, part in found[1].items():
            values[name][within(store.grid.region(tile), region)] = part
    if damaged:
        store.objects.delete([store.tile(tile) for tile in damaged])
        return damaged
    def write(name: str) -> tuple[int, int]:  # the results in one array, as zarr encodes them; size and CRC-32
        written: dict[str, Any] = {}
        store.create_array(zarr.storage.MemoryStore(written), name)[region] = values.pop(name)
        content = written[store.shard(name, block)].to_bytes()
        store.objects.put(store.shard(name, block), content)
        return len(content), zlib.crc32(content)

    with ThreadPoolExecutor(_THREADS) as threads:
        shards = list(threads.map(write, store.arrays))
    store.objects.keep([store.shard(name, block) for name in store.arrays])
    written = {"shards": dict(zip(store.arrays, shards, strict=True)), "tiles": [list(astuple(r)) for r in records]}
    store.objects.put(f"{BLOCKS}/{block}", with_checksum(json.dumps(written).encode()), durable=True)
    store.objects.keep([f"{BLOCKS}/{block}"])
    store.objects.delete([store.tile(tile) for tile in tiles])
    return []


def damaged_shards(store: Store, block: int) -> list[str]:
    """The arrays of which the shard of a written block is missing or has another content; all if its record is
    damaged."""
    record = block_record(store, block)
    if record is None:
        return list(store.arrays)
    found = {name: store.objects.get(store.shard(name, block)) for name in store.arrays}
    return [name for name, content in found.items()
            if content is None or record.shards.get(name) != (len(content), zlib.crc32(content))]


def work(url: str, threads: int, task: tuple[str, int]) -> str | list[int]:
    """What a worker does, in any process: compute a ("tile", number), or write a ("block", number).

    Returns the error of a tile as text, empty without one, or the damaged tiles of a block that could not be written.
    Raises OSError if the store cannot be read or written to.
    """
    kind, number = task
    objects = Objects(url)
    store, begun = _store(url, objects.get(STUDY) or b""), time.perf_counter()
    if kind == "block":
        return write_block(store, number)
    try:
        results = store.study.compute(store.grid.items(number), threads=threads)
    except Exception as error:  # the failure of one tile must not stop the others
        return f"{type(error).__name__}: {error}"
    write_tile(store, number, results, time.perf_counter() - begun)
    return ""


@lru_cache(maxsize=4)
def _store(url: str, description: bytes) -> Store:
    """The store with this URL and this content of ``run/study.json``, opened once per process."""
    return from_description(Objects(url), description)


@dataclass(frozen=True)
class State:
    """What is there of a store, by the names of its objects."""

    blocks: set[int]  # that are written
    tiles: dict[int, set[int]]  # that are there of other blocks, by block
    failed: set[int]  # that failed in the last run

    @classmethod
    def of(cls, store: Store) -> State:
        """The state of a store now."""
        objects, grid, tiles = store.objects, store.grid, dict[int, set[int]]()
        for number in _numbers(objects, TILES, grid.count):
            tiles.setdefault(grid.block_of(number), set()).add(number)
        blocks = _numbers(objects, BLOCKS, grid.block_count)  # after the tiles: a block written meanwhile is not missed
        others = {b: t for b, t in tiles.items() if b not in blocks}
        return cls(blocks, others, _numbers(objects, FAILED, grid.count))

    def done(self, store: Store, block: int) -> int:
        """Number of tiles of a block that are done."""
        return store.grid.tile_count(block) if block in self.blocks else len(self.tiles.get(block, ()))


def tiles_there(store: Store, block: int) -> set[int]:
    """The tiles of a block that have an object."""
    return _numbers(store.objects, f"{TILES}/{block}", store.grid.count)


def _numbers(objects: Objects, folder: str, count: int) -> set[int]:
    """The numbers below ``count`` with which the names of objects below a folder end; other names are left out."""
    ends = (name.rpartition("/")[2] for name in objects.names(folder))
    return {int(end) for end in ends if end.isdecimal() and int(end) < count}
