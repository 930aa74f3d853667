"""Group files: the results of all tiles of a group in one array, as a file that Zarr reads."""

from __future__ import annotations

import time
import zlib
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import numpy as np

from gearchaos.store.files.folder import UNREACHABLE
from gearchaos.store.journals.journal import Lost, TileEntry
from gearchaos.store.journals.progress import Progress
from gearchaos.store.layout.chunks import (
    DamagedChunkError,
    decoded,
    decoded_index,
    encoded,
    group_file,
    index_bytes,
    padded,
)
from gearchaos.store.layout.layout import Layout
from gearchaos.store.layout.segments import SegmentWriter, read_parts, record_is_intact
from gearchaos.store.machine import process_name
from gearchaos.store.tiles import Shape

_THREADS = 8
"""Largest number of arrays of a group that are written side by side, so that a slow write delays no other."""


class DamagedRecordsError(ValueError):
    """Records of tiles are missing or damaged.

    Attributes
    ----------
    tiles : set of int
    """

    def __init__(self, tiles: set[int]) -> None:
        super().__init__(f"the records of tiles {sorted(tiles)} are damaged or missing")
        self.tiles = tiles


def pack(store: Layout, group: int, entries: Iterable[TileEntry]) -> dict[str, tuple[int, int]]:
    """Write the group files of a group from the records of its tiles.

    Two processes may pack the same group: they write the same bytes.

    Parameters
    ----------
    store : Layout
    group : int
    entries : iterable of TileEntry
        The entries of all tiles of the group.

    Returns
    -------
    dict of str to (int, int)
        Size in bytes and CRC-32 of the file of each array by name.

    Raises
    ------
    DamagedRecordsError
        If records are missing or damaged; then some of the files may be written, which is harmless.
    OSError
        If a file cannot be written.
    """
    listed = list(entries)
    with ThreadPoolExecutor(min(_THREADS, len(store.arrays) or 1)) as pool:
        intact = pool.map(partial(record_is_intact, store.folder), listed)  # a record of another tile is not
        if moved := {entry.tile for entry, whole in zip(listed, intact, strict=True) if not whole}:
            raise DamagedRecordsError(moved)
        futures = {name: pool.submit(_pack_array, store, group, listed, name) for name in store.arrays}
    errors = [error for future in futures.values() if (error := future.exception()) is not None]
    damaged = {tile for error in errors if isinstance(error, DamagedRecordsError) for tile in error.tiles}
    for error in errors:
        if not isinstance(error, DamagedRecordsError):
            raise error
    if damaged:
        raise DamagedRecordsError(damaged)
    return {name: future.result() for name, future in futures.items()}


def _pack_array(store: Layout, group: int, entries: list[TileEntry], name: str) -> tuple[int, int]:
    """Write the file of one array of a group; size and CRC-32 of it."""
    region, spec = store.grid.group_region(group), store.arrays[name]
    values = np.empty((*(p.stop - p.start for p in region), *spec.shape), spec.dtype)
    damaged = set(store.grid.tiles_of(group))
    for entry, part in read_parts(store.folder, entries, store.arrays, name, store.grid):
        if part is not None:
            values[_within(store.grid.region(entry.tile), region)] = part
            damaged.discard(entry.tile)
    if damaged:
        raise DamagedRecordsError(damaged)
    return write_group(store, group, name, values)


def write_group(store: Layout, group: int, name: str, values: np.ndarray) -> tuple[int, int]:
    """Write the results of a group in one array, in the shape of the group; size and CRC-32 of the file."""
    region, shape = store.grid.group_region(group), store.chunk_shape(name)
    chunks = {
        store.full_position(name, position): encoded(padded(values[_within(part, region)], shape, store.fill(name)))
        for position, part in store.grid.chunk_regions(group)
    }
    content = group_file(chunks, store.chunk_counts(name)) if store.sharded else next(iter(chunks.values()))
    store.folder.write(store.group_file(name, group), content)
    return len(content), zlib.crc32(content)


class GroupFile:
    """Reads the chunks of a group file.

    Parameters
    ----------
    store : Layout
    name : str
        Name of the array.
    group : int
    """

    def __init__(self, store: Layout, name: str, group: int) -> None:
        self._store, self._array, self._file = store, name, store.group_file(name, group)
        self._index = self._read_index() if store.sharded else None

    def chunk(self, position: Shape) -> bytes:
        """The bytes of the chunk at a position in the group.

        Raises FileNotFoundError if there is no file, `DamagedChunkError` if it does not have the chunk.
        """
        if self._index is None:
            return self._read(0, None)
        offset, length = (int(n) for n in self._index[self._store.full_position(self._array, position)])
        return self._read(offset, length)

    def values(self, position: Shape) -> np.ndarray:
        """The numbers of a chunk in its full shape; raises as `chunk`, also if its checksum is wrong."""
        dtype, shape = np.dtype(self._store.arrays[self._array].dtype), self._store.chunk_shape(self._array)
        return decoded(self.chunk(position), dtype, shape)

    def _read_index(self) -> np.ndarray:
        counts = self._store.chunk_counts(self._array)
        length, size = index_bytes(counts), self._store.folder.size(self._file)
        if size is None:
            raise FileNotFoundError(self._file)
        if size < length:
            raise DamagedChunkError("cut short")
        return decoded_index(self._read(size - length, length), counts)

    def _read(self, start: int, length: int | None) -> bytes:
        try:
            content = self._store.folder.read(self._file, start, length)
        except (*UNREACHABLE, FileNotFoundError):
            raise
        except OSError as error:
            raise DamagedChunkError(str(error)) from error
        if length is not None and len(content) < length:
            raise DamagedChunkError("cut short")
        return content


def read_group(store: Layout, name: str, group: int, region: tuple[slice, ...], out: np.ndarray) -> None:
    """Put the results of a group in one array into those of a region, at the work items that they share.

    Raises as `GroupFile.values`.
    """
    file = GroupFile(store, name, group)
    for position, part in store.grid.chunk_regions(group):
        if all(p.start < r.stop and r.start < p.stop for p, r in zip(part, region, strict=True)):
            put(part, file.values(position), region, out)


def put(part: tuple[slice, ...], values: np.ndarray, region: tuple[slice, ...], out: np.ndarray) -> None:
    """Put the values of a part of the grid into those of a region, at the work items that they share.

    ``values`` may extend beyond the part, as those of a chunk at the end of an array.
    """
    shared = tuple(slice(max(p.start, r.start), min(p.stop, r.stop)) for p, r in zip(part, region, strict=True))
    out[_within(shared, region)] = values[_within(shared, part)]


def unpack(store: Layout, group: int, progress: Progress, writer: SegmentWriter) -> tuple[Lost, list[TileEntry]]:
    """Save what is intact of a group of which a file is damaged or missing.

    Tiles that are intact in all arrays are appended to a segment. The others have to be computed again.

    Returns
    -------
    tuple of Lost and list of TileEntry
        What to append to a journal: that the group is lost, and the entries of the tiles that are saved.
    """
    lost, written = progress.loss([], [group]), progress.packed[group]
    damaged = set().union(*(damaged_chunks(store, name, group, written.get(name)) for name in store.arrays))
    entries = []
    for position, region in store.grid.chunk_regions(group):
        if position in damaged:
            continue
        values = {name: GroupFile(store, name, group).values(position) for name in store.arrays}
        for tile in store.grid.tiles_in(region):
            inner = _within(store.grid.region(tile), region)
            results = {n: v[inner].reshape(-1, *store.arrays[n].shape) for n, v in values.items()}
            record, at = writer.append(results), max(time.time(), lost.at + 1e-3)  # clocks of machines differ
            seconds = float(np.nan_to_num(progress.seconds[tile]))
            entries.append(TileEntry(tile, *record, seconds, process_name(), 1, at))
    return lost, entries


def damaged_chunks(store: Layout, name: str, group: int, written: tuple[int, int] | None) -> set[Shape]:
    """The positions in a group of the chunks of an array that are missing or damaged.

    Parameters
    ----------
    store : Layout
    name : str
        Name of the array.
    group : int
    written : (int, int) or None
        Size and CRC-32 of the file when it was written, None if they are not known. If they differ but the checksums of
        all chunks are right, it is another file: then all chunks count as damaged.
    """
    positions = {position for position, _ in store.grid.chunk_regions(group)}
    try:
        content = store.folder.read(store.group_file(name, group))
    except UNREACHABLE:
        raise
    except OSError:
        return positions
    if written == (len(content), zlib.crc32(content)):
        return set()
    try:
        file = GroupFile(store, name, group)
    except (FileNotFoundError, DamagedChunkError):
        return positions
    damaged = {position for position in positions if not _is_intact(file, position)}
    return damaged or (set() if written is None else positions)


def _is_intact(file: GroupFile, position: Shape) -> bool:
    """Whether a group file has the chunk at a position, with the right checksum and shape."""
    try:
        file.values(position)
    except (FileNotFoundError, DamagedChunkError):
        return False
    return True


def _within(part: tuple[slice, ...], region: tuple[slice, ...]) -> tuple[slice, ...]:
    """A part of the grid as seen from the beginning of a region that contains it."""
    return tuple(slice(p.start - r.start, p.stop - r.start) for p, r in zip(part, region, strict=True))
