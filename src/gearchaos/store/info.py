"""Progress of a run as its store shows it, whoever computes it and wherever."""

from __future__ import annotations

import os
from contextlib import suppress
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from gearchaos.store.store import Store, TileStatus

_PAUSE = 20.0


def summary(store: Store) -> dict[str, Any]:
    """Tiles and work items done, failures, the rate and the time left, as JSON-ready values.

    ``seconds`` is the computing time of the tiles, summed over all workers; ``pieces_per_second`` is the rate of work
    items while the run was active, None before two tiles are done.
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
    """Work items per second between the times at which tiles were done, without pauses: intervals that are much longer
    than the median."""
    done = sorted((s.at, store.grid.size(n)) for n, s in statuses.items() if s.done)
    if len(done) < 2:
        return None
    times, sizes = np.array(done).T
    steps = np.diff(times)
    busy = steps <= _PAUSE * np.median(steps) + 1e-3
    return float(sizes[1:][busy].sum() / max(steps[busy].sum(), 1e-3))


def _bytes(path: Path) -> int:
    """Total size of all files; those that vanish meanwhile, as temporary files do, are left out."""
    total = 0
    for folder, _, names in os.walk(path):
        for name in names:
            with suppress(FileNotFoundError):
                total += os.path.getsize(Path(folder) / name)
    return total
