"""Verification of all checksums of a store."""

from __future__ import annotations

import errno
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

from gearchaos.errors import InputError
from gearchaos.execute.machine import cores
from gearchaos.store.journals.journal import WHOLE, Damaged, Journal, Line, TileEntry
from gearchaos.store.journals.progress import Progress
from gearchaos.store.layout.groups import damaged_chunks
from gearchaos.store.layout.segments import record_is_intact
from gearchaos.store.store import Store
from gearchaos.store.writers.locks import Shard, write_lock


@dataclass(frozen=True)
class Damage:
    """The damage of a store.

    Attributes
    ----------
    files : list of str
        The files that are damaged or missing: of groups, segments, journals, metadata, coordinates and results.
    groups : list of int
        The groups with such files.
    tiles : list of int
        The tiles that the next run has to compute again.
    noted : bool
        Whether the damage of results is noted in a journal, so that the next run repairs it.
    """

    files: list[str]
    groups: list[int]
    tiles: list[int]
    noted: bool = False


def check(store: Store) -> Damage:
    """Verify all checksums of a store: of group files and their chunks, of records, and of all other files.

    Damaged results are noted in a journal, unless a run writes to the store or it is read-only: the next run computes
    again what is lost.
    """
    progress = store.progress()
    groups, records = _damaged(store, progress, progress.packed, progress.entries)
    if groups or records:  # perhaps a run has packed or repaired them since the journals were read
        progress.refresh()
        groups, records = _damaged(
            store, progress, groups.keys() & progress.packed.keys(),
            {entry.tile for entry in records} & progress.entries.keys(),
        )
    files = {store.group_file(name, group) for group, arrays in groups.items() for name in arrays}
    files |= {entry.segment or "" for entry in records} | progress.unreadable | set(store.damaged_files())
    lost = {tile for arrays in groups.values() for tiles in arrays.values() for tile in tiles}
    tiles = sorted(lost | {entry.tile for entry in records})
    return Damage(sorted(files), sorted(groups), tiles, _note(store, _lines(progress, groups, records)))


def _damaged(
    store: Store, progress: Progress, groups: Iterable[int], tiles: Iterable[int]
) -> tuple[dict[int, dict[str, set[int]]], list[TileEntry]]:
    """Those of these packed groups with damaged files, with the tiles by array, and the damaged records of tiles."""
    numbers, entries = list(groups), [progress.entries[tile] for tile in tiles]
    with ThreadPoolExecutor(cores()) as pool:
        checked = pool.map(partial(_check_group, store, progress), numbers)
        intact = pool.map(partial(record_is_intact, store.folder), entries)
        found = {group: arrays for group, arrays in zip(numbers, checked, strict=True) if arrays}
        return found, [entry for entry, whole in zip(entries, intact, strict=True) if not whole]


def _check_group(store: Store, progress: Progress, group: int) -> dict[str, set[int]]:
    """The tiles whose results are damaged in the file of each array of a group; empty if all files are whole."""
    regions, written = dict(store.grid.chunk_regions(group)), progress.packed[group]
    damaged = {name: damaged_chunks(store, name, group, written.get(name)) for name in store.arrays}
    return {name: {tile for position in positions for tile in store.grid.tiles_in(regions[position])}
            for name, positions in damaged.items() if positions}


def _lines(progress: Progress, groups: dict[int, dict[str, set[int]]], records: list[TileEntry]) -> list[Line]:
    """What is damaged as lines of a journal: tiles by group and array, and records."""
    lines: list[Line] = []
    if groups:
        files = [(group, name) for group, arrays in groups.items() for name in arrays]
        tiles = {tile for arrays in groups.values() for found in arrays.values() for tile in found}
        lines.append(Damaged(files, sorted(tiles), max(map(progress.packed_at, groups))))
    if records:
        lines.append(progress.loss([entry.tile for entry in records], []))
    return lines


def _note(store: Store, lines: list[Line]) -> bool:
    """Append lines to a journal of the store; False if there are none, or if it must not or cannot be written to."""
    if not lines:
        return False
    try:
        with write_lock(store.folder, Shard()):
            Journal(store.folder, WHOLE).append(*lines)
    except (InputError, PermissionError):  # a run writes to the store, or it is read-only
        return False
    except OSError as error:
        if error.errno != errno.EROFS:
            raise
        return False
    return True
