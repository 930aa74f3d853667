"""What the workers of a run do: compute tiles, and pack groups. Pools call these functions, in any process."""

from __future__ import annotations

import os
import threading
import time
from functools import lru_cache

from gearchaos.errors import InputError
from gearchaos.store.files.folder import open_folder
from gearchaos.store.journals.journal import Lost, Packed, TileEntry
from gearchaos.store.layout.groups import DamagedRecordsError, pack
from gearchaos.store.layout.segments import SegmentWriter
from gearchaos.store.machine import process_name
from gearchaos.store.store import STUDY, Store, from_description

_OWN = threading.local()
"""The segments of each thread, ``writers``: dict of (process number, URL of a store, its arrays) to `SegmentWriter`."""


def compute_tile(url: str, attempt: int, threads: int, tile: int) -> TileEntry | str:
    """Compute a tile of a store, in some number of threads, and append its results to a segment.

    Parameters
    ----------
    url : str
        The URL of the folder of the store.
    attempt : int
        Number of the attempt, from 1.
    threads : int
    tile : int
        Number of the tile.

    Returns
    -------
    TileEntry or str
        The entry for the journal, or the error of the tile as text.

    Raises
    ------
    OSError
        If the store cannot be read or written to.
    """
    store, started = _store(url), time.perf_counter()
    try:
        results = store.study.compute(store.grid.items(tile), threads=threads)
    except Exception as error:  # the failure of one tile must not stop the others
        return f"{type(error).__name__}: {error}"
    try:
        record = _segments(store).append(results)
    except (InputError, OSError) as error:
        raise _unwritable(error) from None
    return TileEntry(tile, *record, time.perf_counter() - started, process_name(), attempt)


def pack_group(url: str, group: int, entries: list[TileEntry]) -> Packed | Lost:
    """Write the group files of a group from the entries of all its tiles.

    Returns
    -------
    Packed or Lost
        The line for the journal: that the group is packed, or which tiles must be computed again, since their records
        are damaged.

    Raises
    ------
    OSError
        If the store cannot be read or written to.
    """
    store = _store(url)
    try:
        files = pack(store, group, entries)
    except DamagedRecordsError as error:
        at = max(entry.at for entry in entries if entry.tile in error.tiles)
        return Lost(sorted(error.tiles), [], at)
    except (InputError, OSError) as error:
        raise _unwritable(error) from None
    return Packed(group, files, max(time.time(), *(entry.at for entry in entries)))  # clocks of machines differ


def _unwritable(error: Exception) -> OSError:
    """The error that ends a run, since no other tile or group could be written either."""
    return OSError(f"the store cannot be written to: {error}".removesuffix("."))


def _store(url: str) -> Store:
    """The store with this URL, opened once per process as long as its ``run/study.json`` is the same."""
    return cached_store(url, open_folder(url).read(STUDY))


@lru_cache(maxsize=4)
def cached_store(url: str, description: bytes) -> Store:
    """The store with this URL and this content of ``run/study.json``."""
    return from_description(open_folder(url), description)


def _segments(store: Store) -> SegmentWriter:
    """The segments of this thread in a store."""
    writers = _OWN.__dict__.setdefault("writers", {})
    key = os.getpid(), store.folder.url, *store.arrays.items()  # a folder may be deleted, and have another study then
    if key not in writers:
        writers[key] = SegmentWriter(store.folder, store.arrays)
    return writers[key]
