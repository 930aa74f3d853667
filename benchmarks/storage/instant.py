"""The command ``gearchaos`` with maps whose cells take no time to compute: what remains is the cost of the store.

``python benchmarks/storage/instant.py run study.toml --out map.zarr`` takes the arguments of ``gearchaos``. The values
of a cell follow from its number. Worker processes import this file as their main module, and so compute in
the same way.

Environment variables:

- ``INSTANT_SECONDS``: how long a tile takes; a single cell, which the creation of a store computes, takes no time.
- ``INSTANT_WRITE_SECONDS``: how much longer each write of an object of the store takes.
- ``INSTANT_LOG``: a file that gets a line for each tile: time, number of its first cell, number of its cells.
- ``INSTANT_BLOCK_BYTES``: largest size of the results of a block, so that small maps have several blocks.
- ``INSTANT_STOP``: the number of tiles after which the process interrupts itself.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from itertools import count

import numpy as np

from gearchaos.studies.maps.zones import Zones

DTYPES = {
    "label": "i1", "period": "i4", "reason": "i1", "lyapunov": "f8", "lyapunov_lo": "f8", "lyapunov_hi": "f8",
    "trace_error": "f4", "residual": "f4", "multiplier": "f8", "rotation": "f4", "transient_chaos": "i1",
    "periods_spent": "i4", "v_rms": "f8", "contact_fraction": "f8", "contact": "i1", "dynamic_factor": "f8",
    "z_rms": "f4", "z_peak_to_peak": "f4", "z_dot_rms": "f4", "z_dot_peak_to_peak": "f4", "switches": "f4",
}
"""The arrays of a map and their dtypes."""

CODES = {"label": 5, "period": 8, "reason": 5, "transient_chaos": 1, "contact": 2}
"""Arrays of codes and their largest value."""

_tiles = count(1)


def values(cells: np.ndarray) -> dict[str, np.ndarray]:
    """The results (L,) of cells with these numbers (L,): no fill value, and different for neighbouring cells."""
    largest = {name: CODES.get(name, 100 + number) for number, name in enumerate(DTYPES)}
    return {name: (cells % largest[name] + 1).astype(dtype) for name, dtype in DTYPES.items()}


def _compute(
    self: Zones, items: np.ndarray, *, progress: bool = False, threads: int | None = None
) -> dict[str, np.ndarray]:
    if len(items) > 1:
        _log(items)
        time.sleep(float(os.environ.get("INSTANT_SECONDS", 0)))
        if next(_tiles) == int(os.environ.get("INSTANT_STOP", 0)):
            os.kill(os.getpid(), signal.SIGINT)
    return values(items)


def _log(items: np.ndarray) -> None:
    """Append a line about a tile to the log."""
    if path := os.environ.get("INSTANT_LOG"):
        with open(path, "a") as file:
            file.write(f"{time.time()} {items[0]} {len(items)}\n")


def _delay_writes(seconds: float) -> None:
    """Let each write of an object of the store take so much longer."""
    from gearchaos.store.objects import Objects

    put = Objects.put

    def slow(*arguments, **options):
        time.sleep(seconds)
        return put(*arguments, **options)

    Objects.put = slow


def _limit_blocks(size: int) -> None:
    """Let the results of blocks have at most this size, and chunks half of it."""
    from gearchaos.store import tiles

    tiles._CHUNK_BYTES, tiles._BLOCK_BYTES, tiles._SMALLEST_BLOCK = size // 2, size, 1


Zones.compute = _compute
if "INSTANT_BLOCK_BYTES" in os.environ:
    _limit_blocks(int(os.environ["INSTANT_BLOCK_BYTES"]))
if "INSTANT_WRITE_SECONDS" in os.environ:
    _delay_writes(float(os.environ["INSTANT_WRITE_SECONDS"]))

if __name__ == "__main__":
    from gearchaos.cli import main

    sys.exit(main())
