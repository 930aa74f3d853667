"""The command ``gearchaos`` with maps whose cells take no time to compute: what remains is the cost of the store.

``python benchmarks/storage/instant.py run study.toml --out map.zarr`` takes the arguments of ``gearchaos``. The values
of a cell follow from its number. Worker processes import this file as their main module, and so compute in
the same way.

Environment variables:

- ``INSTANT_SECONDS``: how long a tile takes; a single cell, which the creation of a store computes, takes no time.
- ``INSTANT_SLOW``: a folder; the first process that computes a tile takes 20 times as long for each.
- ``INSTANT_WRITE_SECONDS``: how much longer each write of a file of the store takes.
- ``INSTANT_LOG``: a file that gets a line for each tile: time, number of its first cell, number of its cells.
- ``INSTANT_GROUP_BYTES``: largest size of a group file, so that small maps have several groups.
- ``INSTANT_STALE``: for how many seconds a process sees files of others as it saw them first, or that there are none.
- ``INSTANT_STOP``: the number of tiles after which the process interrupts itself.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from itertools import count
from pathlib import Path

import numpy as np

from gearchaos.studies.zones import Zones

DTYPES = {
    "label": "i1", "period": "i4", "reason": "i1", "lyapunov": "f8", "lyapunov_lo": "f8", "lyapunov_hi": "f8",
    "trace_error": "f4", "residual": "f4", "multiplier": "f8", "rotation": "f4", "transient_chaos": "i1",
    "periods_spent": "i4", "v_rms": "f8", "contact_fraction": "f8", "contact": "i1", "dynamic_factor": "f8",
    "z_rms": "f4", "z_peak_to_peak": "f4", "z_dot_rms": "f4", "z_dot_peak_to_peak": "f4", "switches": "f4",
}
"""The arrays of a map and their dtypes."""

CODES = {"label": 5, "period": 8, "reason": 5, "transient_chaos": 1, "contact": 2}
"""Arrays of codes and their largest value."""

SLOWDOWN = 20
"""How many times as long the slow worker takes."""

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
        time.sleep(float(os.environ.get("INSTANT_SECONDS", 0)) * (SLOWDOWN if _is_slow() else 1))
        if next(_tiles) == int(os.environ.get("INSTANT_STOP", 0)):
            os.kill(os.getpid(), signal.SIGINT)
    return values(items)


def _log(items: np.ndarray) -> None:
    """Append a line about a tile to the log."""
    if path := os.environ.get("INSTANT_LOG"):
        with open(path, "a") as file:
            file.write(f"{time.time()} {items[0]} {len(items)}\n")


def _is_slow() -> bool:
    """Whether this process is the slow one."""
    folder = os.environ.get("INSTANT_SLOW")
    if folder is None:
        return False
    try:
        with open(Path(folder) / "slow", "x") as file:
            file.write(str(os.getpid()))
    except FileExistsError:
        pass
    return (Path(folder) / "slow").read_text() == str(os.getpid())


def _delay_writes(seconds: float) -> None:
    """Let each write of a file of the store take so much longer."""
    from gearchaos.store.files.folder import LocalFolder

    for name in ("write", "create", "append"):
        setattr(LocalFolder, name, _delayed(getattr(LocalFolder, name), seconds))


def _delayed(function, seconds):
    def slow(*arguments, **options):
        time.sleep(seconds)
        return function(*arguments, **options)

    return slow


def _remember_files(seconds: float) -> None:
    """Let this process see what it once saw of files of others for so many seconds, as a client of a network file
    system may do: their content, their sizes, that there are none, and listings."""
    from gearchaos.store.files.folder import LocalFolder

    seen = dict[tuple[str, str], tuple[float, object]]()

    def remembered(kind, function, folder, name):
        at, found = seen.get((kind, name), (0.0, None))
        if time.time() - at > seconds:
            try:
                found = function(folder, name)
            except OSError as error:
                found = error
            seen[kind, name] = time.time(), found
        if isinstance(found, OSError):
            raise found
        return found

    def read(folder, name, start=0, length=None):
        return remembered("content", true_read, folder, name)[start:][:length]

    def changing(function):
        def change(folder, name, *arguments):
            for kind in ("content", "size"):
                seen.pop((kind, name), None)
            return function(folder, name, *arguments)

        return change

    true_read, true_size, true_list = LocalFolder.read, LocalFolder.size, LocalFolder.list
    LocalFolder.read = read
    LocalFolder.size = lambda folder, name: remembered("size", true_size, folder, name)
    LocalFolder.list = lambda folder, prefix="": iter(remembered(
        "list", lambda folder, prefix: list(true_list(folder, prefix)), folder, prefix))
    for name in ("write", "append", "create"):
        setattr(LocalFolder, name, changing(getattr(LocalFolder, name)))


def _limit_groups(size: int) -> None:
    """Let group files have at most this size before compression, and two chunks."""
    from gearchaos.store import tiles

    tiles._CHUNK_BYTES, tiles._GROUP_BYTES = size // 2, size


Zones.compute = _compute
if "INSTANT_GROUP_BYTES" in os.environ:
    _limit_groups(int(os.environ["INSTANT_GROUP_BYTES"]))
if "INSTANT_STALE" in os.environ:
    _remember_files(float(os.environ["INSTANT_STALE"]))
if "INSTANT_WRITE_SECONDS" in os.environ:
    _delay_writes(float(os.environ["INSTANT_WRITE_SECONDS"]))

if __name__ == "__main__":
    from gearchaos.cli import main

    sys.exit(main())
