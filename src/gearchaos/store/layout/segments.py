"""Segments: append-only files with the results of tiles whose groups are not complete yet.

Each worker, a thread or a process, appends to segments of its own, ``run/segments/<host>-<pid>-<random>-<k>.bin``. A
*record* has the results of one tile: for each array, in the order of the store, its numbers in little-endian byte
order and their CRC-32C. The journal has the CRC-32 of the record: the CRC-32C of bytes that contain their CRC-32C would
be the same for all records of a length.
"""

from __future__ import annotations

import os
import socket
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import count
from uuid import uuid4

import google_crc32c
import numpy as np

from gearchaos.store.files.folder import UNREACHABLE, Folder
from gearchaos.store.journals.journal import TileEntry
from gearchaos.store.layout.specs import ArraySpec
from gearchaos.store.tiles import Grid

SEGMENTS = "run/segments"
"""Folder of the segments."""

_CHECKSUM_BYTES = 4
"""Size of the CRC-32C behind the numbers of an array."""

_GAP = 2**16
"""Largest number of bytes between two parts of a segment that are read at once together with what lies between."""

_READ = 2**20
"""Largest number of bytes of a segment that are read at once, unless a part is larger."""


@dataclass(frozen=True)
class _Part:
    """The bytes of one array in the record of a tile: ``start`` and ``stop`` in the segment, with the checksum."""

    entry: TileEntry
    start: int
    stop: int


@dataclass(frozen=True)
class _Layout:
    """Where an array is in a record: bytes for each work item, in it and before it, and number of arrays before it."""

    item_bytes: int
    before: int
    number: int

    @classmethod
    def of(cls, arrays: Mapping[str, ArraySpec], name: str) -> _Layout:
        """The layout of the array with this name."""
        names = list(arrays)[:list(arrays).index(name)]
        return cls(arrays[name].item_bytes, sum(arrays[n].item_bytes for n in names), len(names))

    def part(self, entry: TileEntry, items: int) -> _Part:
        """The bytes of the array in the record of a tile of some work items."""
        start = entry.offset + items * self.before + _CHECKSUM_BYTES * self.number
        return _Part(entry, start, start + items * self.item_bytes + _CHECKSUM_BYTES)


def record_length(arrays: Mapping[str, ArraySpec]) -> Callable[[int], int]:
    """Function from a number of work items to the size of their record in bytes."""
    item_bytes, others = sum(spec.item_bytes for spec in arrays.values()), _CHECKSUM_BYTES * len(arrays)
    return partial(_length, item_bytes, others)


def _length(item_bytes: int, others: int, items: int) -> int:
    return items * item_bytes + others


class SegmentWriter:
    """Appends records to segments of its own; to be used by one thread.

    Parameters
    ----------
    folder : Folder
        The folder of the store.
    arrays : dict of str to ArraySpec
        The arrays of the store.
    """

    def __init__(self, folder: Folder, arrays: Mapping[str, ArraySpec]) -> None:
        self.folder, self._arrays = folder, arrays
        writer = f"{socket.gethostname()}-{os.getpid()}-{uuid4().hex[:8]}"
        self._names = (f"{SEGMENTS}/{writer}-{k}.bin" for k in count())
        self._name, self._size = next(self._names), 0

    def append(self, results: Mapping[str, np.ndarray]) -> tuple[str, int, int, int]:
        """Append the results of a tile; the record is on the disk at return.

        Parameters
        ----------
        results : dict of str to (L, ...)
            The arrays of the store by name, for L work items.

        Returns
        -------
        tuple
            Name of the segment, offset and length of the record in bytes, and its CRC-32.

        Raises
        ------
        OSError
            If it cannot be written.
        ValueError
            If an array is missing or has a wrong shape.
        """
        record = self._record(results)
        if self._size and self._size >= self.folder.segment_size:
            self._name, self._size = next(self._names), 0
        if self._size:
            offset = self.folder.append(self._name, record)
        else:
            self.folder.write(self._name, record)
            offset = 0
        self._size = offset + len(record)
        return self._name, offset, len(record), zlib.crc32(record)

    def _record(self, results: Mapping[str, np.ndarray]) -> bytes:
        parts = []
        for name, spec in self._arrays.items():
            values = np.asarray(results[name])
            if values.shape[1:] != spec.shape:
                raise ValueError(f"{name} has results of shape {values.shape[1:]}, not {spec.shape}")
            content = np.ascontiguousarray(values, np.dtype(spec.dtype).newbyteorder("<")).tobytes()
            parts += [content, google_crc32c.value(content).to_bytes(_CHECKSUM_BYTES, "little")]
        return b"".join(parts)


def record_is_intact(folder: Folder, entry: TileEntry) -> bool:
    """Whether the record of a tile exists and agrees with its checksum."""
    record = _read(folder, entry, entry.offset, entry.offset + entry.length)
    return len(record) == entry.length and zlib.crc32(record) == entry.crc


def read_parts(
    folder: Folder, entries: Iterable[TileEntry], arrays: Mapping[str, ArraySpec], name: str, grid: Grid
) -> Iterator[tuple[TileEntry, np.ndarray | None]]:
    """Yield the entry of each tile and its results in one array, in the shape of the tile.

    The results are None if they are missing or damaged. Tiles come in the order of their records, of which neighbours
    are read at once.
    """
    layout, items = _Layout.of(arrays, name), grid.size
    ordered = sorted(entries, key=lambda entry: (entry.segment or "", entry.offset))
    for run in _runs(layout.part(entry, items(entry.tile)) for entry in ordered):
        start = run[0].start
        content = _read(folder, run[0].entry, start, run[-1].stop)
        for part in run:
            shape = tuple(p.stop - p.start for p in grid.region(part.entry.tile))
            yield part.entry, _numbers(content[part.start - start:part.stop - start], arrays[name], shape)


def _runs(parts: Iterable[_Part]) -> Iterator[list[_Part]]:
    """Join parts that lie near each other in a segment, to be read at once."""
    run: list[_Part] = []
    for part in parts:
        near = run and part.entry.segment == run[-1].entry.segment and part.start - run[-1].stop <= _GAP
        if near and part.stop - run[0].start <= _READ:
            run.append(part)
        else:
            if run:
                yield run
            run = [part]
    if run:
        yield run


def _read(folder: Folder, entry: TileEntry, start: int, stop: int) -> bytes:
    """Bytes of the segment of an entry, fewer if it is cut short or missing."""
    try:
        return b"" if entry.segment is None else folder.read(entry.segment, start, stop - start)
    except UNREACHABLE:
        raise
    except (OSError, ValueError, OverflowError):  # also for a name or a place that no file can have
        return b""


def _numbers(content: bytes, spec: ArraySpec, shape: tuple[int, ...]) -> np.ndarray | None:
    """The results in the dtype of the store, from their bytes and checksum; None unless they agree."""
    numbers, checksum = content[:-_CHECKSUM_BYTES], content[-_CHECKSUM_BYTES:]
    if google_crc32c.value(numbers).to_bytes(_CHECKSUM_BYTES, "little") != checksum:
        return None
    dtype = np.dtype(spec.dtype)
    return np.frombuffer(numbers, dtype.newbyteorder("<")).reshape(*shape, *spec.shape).astype(dtype, copy=False)
