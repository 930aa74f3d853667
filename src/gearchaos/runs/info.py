"""How far a run is, from what lies in its store: whoever computes it, and wherever."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from gearchaos.runs.store import Mark, Store


def summary(store: Store) -> dict[str, Any]:
    """Tiles and pieces done, failures, the rate and the time left, as JSON-ready values.

    ``seconds`` is the time that the tiles took, added up over all workers; ``pieces_per_second`` is the rate over the
    time from the first mark to the last, None before there are two.
    """
    marks, grid = store.marks(), store.grid
    done = [n for n, m in marks.items() if m.done]
    pieces, total = sum(map(grid.size, done)), sum(map(grid.size, range(grid.count)))
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
    """Pieces per second, between the first mark and the last."""
    times = {n: store.marked_at(n) for n, m in marks.items() if m.done}
    if len(times) < 2:
        return None
    first, last = min(times.values()), max(times.values())
    after = sum(store.grid.size(n) for n, t in times.items() if t > first)
    return after / (last - first) if last > first else None


def _bytes(path: Path) -> int:
    return sum(os.path.getsize(Path(folder) / name) for folder, _, names in os.walk(path) for name in names)
