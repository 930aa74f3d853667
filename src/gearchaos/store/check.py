"""What is there of a store, what is missing and what is damaged: for `gearchaos info`, `check`, and warnings."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, groupby, pairwise
from math import prod
from shlex import quote
from typing import Any

import numpy as np

from gearchaos.execute.machine import cores
from gearchaos.store.blocks import BlockRecord, State, block_record, damaged_shards, read_tile, tile_record
from gearchaos.store.lock import running
from gearchaos.store.store import BLOCKS, Store
from gearchaos.store.tiles import Grid
from gearchaos.studies.motion.attractor_set import NOT_COMPUTED

_PAUSE = 20.0
"""An interval without a finished tile is a pause of the run if it is this many times as long as the median interval."""

_LISTED, _NAMED = 20, 3  # most files and parts of the grid that are listed, and that are named in a sentence
Box = tuple[tuple[int, int], ...]  # a part of the grid of work items: first and last + 1 along each dimension


@dataclass(frozen=True)
class Missing:
    """What is missing of a store, by the names and sizes of its objects, or after all of them were read."""

    store: Store
    state: State
    records: dict[int, BlockRecord]  # what is known of the blocks that are written
    lost: dict[int, list[str]]  # the arrays whose results are missing or damaged, by block
    tiles: tuple[str, ...] = ()  # the objects of tiles, in no block yet, that are damaged

    @property
    def never(self) -> list[int]:
        """The tiles that are not computed."""
        blocks = set(range(self.store.grid.block_count)) - self.state.blocks - self.lost.keys()
        tiles = map(self.store.grid.tiles_of, sorted(blocks))
        there = set(chain.from_iterable(self.state.tiles.values()))
        return [tile for tile in chain.from_iterable(tiles) if tile not in there]

    @property
    def lost_tiles(self) -> list[int]:
        """The tiles that were computed, of which results are missing or damaged."""
        return list(chain.from_iterable(map(self.store.grid.tiles_of, sorted(self.lost))))

    @property
    def files(self) -> list[str]:
        """The names of the objects of results that are missing or damaged."""
        lost = [[self.store.shard(name, block) for name in names] if block in self.records else [f"{BLOCKS}/{block}"]
                for block, names in self.lost.items()]
        return sorted([*chain.from_iterable(lost), *self.tiles])

    @property
    def repair(self) -> str:
        """The command that goes on; without the study file if all tiles were computed."""
        known = all(b in self.lost or self.state.done(self.store, b) == self.store.grid.tile_count(b)
                    for b in range(self.store.grid.block_count))
        return f"gearchaos {'finish' if known else 'run STUDY.toml --out'} {quote(str(self.store.objects))}"


def missing(store: Store) -> Missing:
    """What is missing of a store, by the names and sizes of its objects."""
    finished = store.finished  # before the blocks: a run that ends meanwhile has lost nothing
    state, records = State.of(store), dict[int, BlockRecord]()
    with ThreadPoolExecutor(cores()) as threads:
        for block, record in zip(state.blocks, threads.map(partial(block_record, store), state.blocks), strict=True):
            if record is not None:
                records[block] = record
    sizes = store.objects.sizes(store.shard(name, block) for block in records for name in store.arrays)
    written = set(range(store.grid.block_count)) if finished else state.blocks
    lost = {block: list(store.arrays) for block in sorted(written - records.keys())}
    for block, record in records.items():
        if wrong := [n for n in store.arrays if sizes.get(store.shard(n, block)) != record.shards.get(n, (None,))[0]]:
            lost[block] = wrong
    return Missing(store, state, records, lost)


def check(store: Store) -> tuple[list[str], Missing]:
    """Verify all checksums of a store: the names of all damaged objects, and what is missing of its results."""
    found = missing(store)
    pairs = [(block, tile) for block, tiles in found.state.tiles.items() for tile in tiles]
    with ThreadPoolExecutor(cores()) as threads:
        blocks = sorted(found.state.blocks | found.lost.keys())
        lost = {b: names for b, names in zip(blocks, threads.map(partial(damaged_shards, store), blocks), strict=True)
                if names}
        whole = threads.map(lambda pair: read_tile(store, pair[1], store.arrays) is not None, pairs)
        damaged = [store.tile(tile) for (_, tile), intact in zip(pairs, whole, strict=True) if not intact]
    if damaged or lost:  # perhaps a run has written blocks since the objects were listed
        state = State.of(store)
        damaged = [name for name in damaged if int(name.split("/")[2]) not in state.blocks]
        lost = {block: names for block in lost if (names := damaged_shards(store, block))}
    found = replace(found, lost=lost, tiles=tuple(damaged))
    return sorted([*found.files, *store.damaged_files()]), found


def summary(store: Store) -> dict[str, Any]:
    """Tiles and work items done, failures, the rate and the time left, as values for JSON.

    ``finished`` says whether the Dataset is complete; a store that was finished and has lost results is not. ``pieces``
    are work items. ``seconds`` is the computing time of the tiles, summed over all workers; ``pieces_per_second`` is
    the rate while the run was active, None before two tiles are done. ``missing`` says which tiles have no results, the
    first of them as blocks of work items [first, last + 1] along each dimension, and which files are lost; of
    ``tiles_lost`` tiles, which were computed. ``running`` names the processes that write to the store.
    """
    found, grid = missing(store), store.grid
    never, lost, damaged = found.never, found.lost_tiles, store.damaged_files()
    without, total = sorted({*never, *lost}), prod(grid.shape)
    items = total - sum(map(grid.size, without))
    known = [*chain.from_iterable(record.tiles for record in found.records.values()),
             *filter(None, (tile_record(store, t) for tiles in found.state.tiles.values() for t in tiles))]
    rate, boxes = None, list(_boxes(without, grid))
    if len(known) > 1:  # between the first and the last finished tile, without pauses
        ordered = sorted(known, key=lambda record: record.at)
        steps = np.diff([record.at for record in ordered])
        active = steps <= _PAUSE * np.median(steps) + 1e-3
        sizes = np.array([grid.size(record.tile) for record in ordered[1:]])
        rate = float(sizes[active].sum() / max(steps[active].sum(), 1e-3))
    files, whole = [*found.files, *damaged], store.finished and not without and not damaged
    return {
        "store": str(store.objects), "study": store.study.kind, "finished": whole, "tiles": grid.count,
        "tiles_done": grid.count - len(without), "tiles_lost": len(lost), "pieces": total, "pieces_done": items,
        "failed": {str(n): (store.objects.get(store.failed(n)) or b"").decode(errors="replace")
                   for n in sorted(found.state.failed)},
        "seconds": sum(record.seconds for record in known), "pieces_per_second": rate,
        "seconds_left": (total - items) / rate if rate else None,
        "machines": sorted({record.host for record in known}), "bytes": store.objects.total_bytes(),
        "missing": {
            "tiles": len(without), "files": files[:_LISTED], "file_count": len(files),
            "arrays": sorted(set(chain.from_iterable(found.lost.values()))),
            "pieces": [dict(zip(store.study.grid, map(list, box), strict=True)) for box in boxes[:_LISTED]]},
        "running": running(store.objects), "command": None if whole else found.repair,
    }


def in_words(store: Store) -> str:
    """What is not computed and what is lost of a store, and what the values there are; empty if nothing is missing."""
    if store.finished and not store.study.gridded:  # the Dataset is stored beside the results of work items
        return ""
    found, sentences = missing(store), []
    if never := found.never:
        sentences.append(f"{len(never)} of {store.grid.count} tiles are not computed{_where(store, never)}")
    if lost := found.lost_tiles:
        names = sorted(set(chain.from_iterable(found.lost.values())))
        others = ", other variables are intact" if store.study.gridded and len(names) < len(store.arrays) else ""
        sentences.append(f"files of {listed(names)} are missing or damaged for {len(lost)} of {store.grid.count} tiles"
                         f"{_where(store, lost)}{others}. To repair it: {found.repair}")
    return ". ".join(sentences)


def listed(names: list[str]) -> str:
    """Names in words, of which the first are named."""
    return ", ".join(names[:_NAMED]) + (f" and {len(names) - _NAMED} more" if len(names) > _NAMED else "")


def _where(store: Store, tiles: list[int]) -> str:
    """Where tiles are, and what the values there are."""
    boxes = _boxes(sorted(tiles), store.grid)
    named = [" ".join(f"{dim}={first}:{end}" for dim, (first, end) in zip(store.study.grid, box, strict=True))
             for box in boxes]
    fills = {str(a.fill) for a in store.arrays.values() if np.dtype(a.dtype).kind in "iu"}
    values = f"values there are NaN, {' or '.join(sorted(fills))} in integers"
    if not store.study.gridded:
        values = f"the attractor there is {NOT_COMPUTED}"
    return f", by position from 0: {listed(named)}; {values}"


def _boxes(tiles: list[int], grid: Grid) -> Iterator[Box]:
    """The work items of tiles: neighbours in a row are joined, then equal parts of consecutive rows."""
    positions = zip(*np.unravel_index(np.array(tiles, int), grid.tiles), strict=True)
    open_boxes: dict[tuple[int, int], tuple[int, int]] = {}
    for prefix, row_tiles in groupby(positions, key=lambda position: position[:-1]):
        row = int(prefix[0]) if prefix else 0
        runs = consecutive([int(position[-1]) for position in row_tiles])
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
