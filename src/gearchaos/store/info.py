"""How far a run is, from what lies in its store: whoever computes it, and wherever."""

from __future__ import annotations

import os
from contextlib import suppress
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from gearchaos.store.store import Mark, Store

_PAUSE = 20.0


def summary(store: Store) -> dict[str, Any]:
    """Tiles and pieces done, failures, the rate and the time left, as JSON-ready values.

    ``seconds`` is the time that the tiles took, added up over all workers; ``pieces_per_second`` is the rate while
    it ran, None before there are two tiles.
    """
    marks, grid = store.marks(), store.grid
    done = [n for n, m in marks.items() if m.done]
    pieces, total = sum(map(grid.size, done)), prod(grid.shape)
    rate = _rate(store, marks)
    return {
        "store": str(store.path), "study": store.study.kind, "finished": store.finished,
        "tiles": grid.count, "tiles_done": len(done), "pieces": total, "pieces_done": pieces,
        "failed": {str(n): m.error for n, m in sorted(marks.items()) if not m.done},
        "seconds": sum(m.seconds for m in marks.values()), "pieces_per_second": rate,
        "seconds_left": (total - pieces) / rate if rate else None,
        "machines": sorted({m.machine.split(":")[0] for m in marks.values()}), "bytes": _bytes(store.path),
    }


def _rate(store: Store, marks: dict[int, Mark]) -> float | None:
    """Pieces per second from mark to mark; stretches in which nothing ran, far longer than others, are left out."""
    done = sorted((m.at, store.grid.size(n)) for n, m in marks.items() if m.done)
    if len(done) < 2:
        return None
    times, sizes = np.array(done).T
    steps = np.diff(times)
    busy = steps <= _PAUSE * np.median(steps) + 1e-3
    return float(sizes[1:][busy].sum() / max(steps[busy].sum(), 1e-3))


def _bytes(path: Path) -> int:
    """Size of all files, but for those that vanish meanwhile, as drafts do."""
    total = 0
    for folder, _, names in os.walk(path):
        for name in names:
            with suppress(FileNotFoundError):
                total += os.path.getsize(Path(folder) / name)
    return total
