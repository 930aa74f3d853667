"""The progress of a run, as found in its store, wherever it is being computed."""

from __future__ import annotations

from dataclasses import asdict
from functools import reduce
from math import prod
from typing import Any

import numpy as np

from gearchaos.store.journals.progress import Progress
from gearchaos.store.reading.missing import MissingParts, missing_parts
from gearchaos.store.store import Store
from gearchaos.store.tiles import Grid
from gearchaos.store.writers.locks import is_running

_PAUSE = 20.0
"""An interval without a finished tile is a pause of the run if it is this many times as long as the median interval."""

_LISTED = 20
"""Largest number of missing files, and of blocks of work items, that are named."""


def summary(store: Store) -> dict[str, Any]:
    """Tiles and work items done, failures, the rate and the time left, as values for JSON.

    ``finished`` says whether the Dataset is complete; a store that was finished and has lost results is not. ``pieces``
    are work items. ``seconds`` is the computing time of the tiles, summed over all workers; ``pieces_per_second`` is
    the rate while the run was active, None before two tiles are done. ``missing`` says which tiles have no results, the
    first of them as blocks of work items [first, last + 1] along each dimension, and which groups and arrays have lost
    files; ``tiles_lost`` how many of them were done before. ``writers`` is what each run or shard last said, and
    whether it is running, None if that cannot be told.
    """
    progress, grid = store.progress(), store.grid
    missing, damaged = missing_parts(store, progress), store.damaged_files() if store.finished else []
    sizes, total = _sizes(grid), prod(grid.shape)
    items = total - int(sizes[missing.tiles].sum())
    rate = _rate(progress, sizes)
    return {
        "store": str(store.folder), "study": store.study.kind,
        "finished": store.finished and not missing.tiles and not damaged,
        "tiles": grid.count, "tiles_done": grid.count - len(missing.tiles),
        "tiles_lost": sum(map(progress.done, missing.tiles)), "pieces": total, "pieces_done": items,
        "failed": {str(n): error for n, error in sorted(progress.failed.items())},
        "seconds": float(np.nansum(progress.seconds)), "pieces_per_second": rate,
        "seconds_left": (total - items) / rate if rate else None,
        "machines": sorted(progress.hosts), "bytes": sum(size for _, size in store.folder.list()),
        "missing": _missing(store, missing, damaged), "writers": _writers(store, progress),
    }


def _writers(store: Store, progress: Progress) -> dict[str, dict[str, Any]]:
    """What each writer last said, and whether it is running."""
    return {name: {**asdict(state), "running": not state.ended and is_running(store.folder, name)}
            for name, state in sorted(progress.writers.items())}


def _missing(store: Store, missing: MissingParts, damaged: list[str]) -> dict[str, Any]:
    """What is missing: counts, and the names of the first files and work items; with files other than those of results
    that are missing or damaged."""
    dims, boxes, files = tuple(store.study.grid), missing.boxes(store.grid), [*missing.files, *damaged]
    return {
        "tiles": len(missing.tiles), "groups": missing.groups[:_LISTED], "files": files[:_LISTED],
        "file_count": len(files), "arrays": missing.arrays,
        "pieces": [dict(zip(dims, map(list, box), strict=True)) for box in boxes[:_LISTED]],
    }


def _sizes(grid: Grid) -> np.ndarray:
    """Number of work items of each tile, (count,)."""
    along = [np.minimum(t, n - t * np.arange(-(-n // t))) for n, t in zip(grid.shape, grid.tile, strict=True)]
    return reduce(np.multiply.outer, along).ravel()


def _rate(progress: Progress, sizes: np.ndarray) -> float | None:
    """Work items per second between the first and the last finished tile, without pauses; None before two are done."""
    done = np.flatnonzero(~np.isnan(progress.at))
    if len(done) < 2:
        return None
    order = done[np.argsort(progress.at[done], kind="stable")]
    steps = np.diff(progress.at[order])
    active = steps <= _PAUSE * np.median(steps) + 1e-3
    return float(sizes[order][1:][active].sum() / max(steps[active].sum(), 1e-3))
