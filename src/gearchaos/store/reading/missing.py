"""What is missing of a store: tiles that are not computed, and files that were lost."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby, pairwise

import numpy as np

from gearchaos.store.journals.journal import Line
from gearchaos.store.journals.progress import Progress
from gearchaos.store.layout.groups import unpack
from gearchaos.store.layout.segments import SEGMENTS, SegmentWriter
from gearchaos.store.store import Store
from gearchaos.store.tiles import Grid

Box = tuple[tuple[int, int], ...]
"""A block of work items: first and last + 1 along each dimension of the grid."""


@dataclass(frozen=True)
class MissingParts:
    """What is missing of a store, by the names and sizes of its files and by what `gearchaos check` found.

    Attributes
    ----------
    tiles : list of int
        The tiles that are not computed, or whose results are missing or damaged.
    records : list of int
        Those of them of which a record was lost.
    groups : list of int
        The packed groups of which a file is missing, has another size or is damaged.
    files : list of str
        The names of these files, and of the segments of the records.
    arrays : list of str
        The names of the arrays to which these files belong: all of them if a record was lost.
    """

    tiles: list[int]
    records: list[int]
    groups: list[int]
    files: list[str]
    arrays: list[str]

    def boxes(self, grid: Grid) -> list[Box]:
        """The work items of these tiles, as blocks as large as their order allows."""
        return list(_boxes(self.tiles, grid))


def missing_parts(store: Store, progress: Progress) -> MissingParts:
    """What is missing of a store. If a run packs groups at the same time, ``progress`` is refreshed."""
    found = _missing_parts(store, progress)
    if found.files:  # perhaps a run has deleted segments since the journals were read
        progress.refresh()
        found = _missing_parts(store, progress)
    return found


def recovery(store: Store, progress: Progress, missing: MissingParts) -> Iterator[list[Line]]:
    """Save what is intact of groups with missing files; yields the lines to append to a journal, group by group."""
    writer = SegmentWriter(store.folder, store.arrays)
    for group in missing.groups:
        lost, entries = unpack(store, group, progress, writer)
        yield [lost, *entries]
    if missing.records:
        yield [progress.loss(missing.records, [])]


def _missing_parts(store: Store, progress: Progress) -> MissingParts:
    """What is missing of a store, from one listing of its files."""
    absent, noted = _absent_files(store, progress), progress.damaged_files()
    damaged = {group: names & store.arrays.keys() for group, names in noted.items()}
    segments = dict(store.folder.list(SEGMENTS))
    cut = {t: e.segment for t, e in progress.entries.items()
           if e.segment is None or segments.get(e.segment, -1) < e.offset + e.length}
    tiles = {*np.flatnonzero(np.isnan(progress.at)).tolist(), *cut, *progress.damaged_tiles()}
    tiles |= {tile for group in absent for tile in store.grid.tiles_of(group)}
    lost = {(group, name) for found in (absent, damaged) for group, names in found.items() for name in names}
    files = {store.group_file(name, group) for group, name in lost} | {name for name in cut.values() if name}
    arrays = set(store.arrays) if cut else {name for _, name in lost}
    groups = sorted(absent.keys() | damaged.keys())
    return MissingParts(sorted(tiles), sorted(cut), groups, sorted(files), sorted(arrays))


def _absent_files(store: Store, progress: Progress) -> dict[int, list[str]]:
    """The arrays of which the file is missing or has another size than when it was written, by packed group."""
    sizes = dict(file for name in store.arrays for file in store.folder.list(f"{store.array_folder(name)}/c"))
    out: dict[int, list[str]] = {}
    for group, written in progress.packed.items():
        for name in store.arrays:
            found, expected = sizes.get(store.group_file(name, group)), written.get(name)
            if found is None or (expected is not None and found != expected[0]):
                out.setdefault(group, []).append(name)
    return out


def _boxes(tiles: list[int], grid: Grid) -> Iterator[Box]:
    """The work items of tiles: neighbours in a row are joined, then equal parts of consecutive rows."""
    rows = groupby(map(grid.position, tiles), key=lambda position: position[:-1])
    open_boxes: dict[tuple[int, int], tuple[int, int]] = {}
    for prefix, positions in rows:
        row = prefix[0] if prefix else 0
        runs = consecutive([position[-1] for position in positions])
        for run in [run for run, (_, last) in open_boxes.items() if run not in runs or last != row - 1]:
            yield _box(run, open_boxes.pop(run), grid)
        for run in runs:
            open_boxes[run] = open_boxes.get(run, (row, row))[0], row
    for run, span in open_boxes.items():
        yield _box(run, span, grid)


def consecutive(numbers: list[int]) -> list[tuple[int, int]]:
    """First and last of each run of consecutive numbers."""
    breaks = [i for i, (a, b) in enumerate(pairwise(numbers), 1) if b != a + 1]
    return [(numbers[i], numbers[j - 1]) for i, j in pairwise([0, *breaks, len(numbers)])]


def _box(run: tuple[int, int], rows: tuple[int, int], grid: Grid) -> Box:
    """The work items of the tiles from the first to the last of a run, in the rows from the first to the last."""
    spans = (rows, run)[-len(grid.shape):]
    return tuple((a * t, min((b + 1) * t, n)) for (a, b), t, n in zip(spans, grid.tile, grid.shape, strict=True))
