"""The progress of a run, as found in its store, wherever it is being computed."""

from __future__ import annotations

import os
from contextlib import suppress
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from gearchaos.store.store import Store, TileStatus

_PAUSE = 20.0
"""An interval without a finished tile is a pause of the run if it is this many times as long as the median interval."""


def summary(store: Store) -> dict[str, Any]:
    """Tiles and work items done, failures, the rate and the time left, as values for JSON.

    ``pieces`` are work items. ``seconds`` is the computing time of the tiles, summed over all workers;
    ``pieces_per_second`` is the rate while the run was active, None before two tiles are done.
    """
    statuses, grid = store.statuses(), store.grid
    done = [n for n, s in statuses.items() if s.done]
    items, total = sum(map(grid.size, done)), prod(grid.shape)
    rate = _rate(store, statuses)
    return {
        "store": str(store.path), "study": store.study.kind, "finished": store.finished,
        "tiles": grid.count, "tiles_done": len(done), "pieces": total, "pieces_done": items,
        "failed": {str(n): s.error for n, s in sorted(statuses.items()) if not s.done},
        "seconds": sum(s.seconds for s in statuses.values()), "pieces_per_second": rate,
        "seconds_left": (total - items) / rate if rate else None,
        "machines": sorted({s.machine.split(":")[0] for s in statuses.values()}), "bytes": _bytes(store.path),
    }


def _rate(store: Store, statuses: dict[int, TileStatus]) -> float | None:
    """Work items per second between the first and the last finished tile, without pauses; None before two are done."""
    done = sorted((s.at, store.grid.size(n)) for n, s in statuses.items() if s.done)
    if len(done) < 2:
        return None
    times, sizes = np.array(done).T
    steps = np.diff(times)
    active = steps <= _PAUSE * np.median(steps) + 1e-3
    return float(sizes[1:][active].sum() / max(steps[active].sum(), 1e-3))


def _bytes(path: Path) -> int:
    """Total size of all files; files that are deleted meanwhile, as temporary ones are, are left out."""
    total = 0
    for folder, _, names in os.walk(path):
        for name in names:
            with suppress(FileNotFoundError):
                total += os.path.getsize(Path(folder) / name)
    return total
