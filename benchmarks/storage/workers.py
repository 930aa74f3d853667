"""Workers on slow disks, and the files that one shard of many opens."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

from storage.children import Spent, gearchaos
from storage.lines import Line
from storage.scaling import TILES, write_study

WORKERS, SECONDS, SIDE = 8, 1.0, 72
"""Workers, seconds a tile, and side of a map of 324 tiles of 16 cells."""


def slow_disk(folder: Path) -> Iterator[Line]:
    """324 tiles of a second each in 8 processes, where each write of a file takes 50 ms."""
    study, store, log = write_study(folder, SIDE, SIDE), folder / "disk.zarr", folder / "disk.log"
    spent = gearchaos("run", study, "--out", store, "--tile", 16, "--processes", WORKERS,
                      INSTANT_SECONDS=SECONDS, INSTANT_LOG=log, INSTANT_WRITE_SECONDS=0.05)
    shutil.rmtree(store)
    begun = sorted(float(line.split()[0]) - spent.started for line in log.read_text().splitlines())
    text = f"{spent}; tiles begin from {begun[0]:.1f} to {begun[-1]:.1f} s, {len(begun)} in all"
    yield Line("8 workers x 324 tiles of 1 s, 50 ms a write", text, "< 50 s, ideal 40.5", spent.wall < 50)


def one_shard_of_many(folder: Path) -> Iterator[Line]:
    """Files of a store of 10^5 tiles that shard 3/512 opens: in a new store, and in one that all others have filled."""
    study, store, trace = write_study(folder, *TILES[100_000]), folder / "shard.zarr", folder / "shard.strace"
    gearchaos("run", study, "--out", store, "--tile", 16, "--shard", "1/512", check=False)
    prefix = ("strace", "-f", "--seccomp-bpf", "-e", "trace=openat,open,creat", "-o", str(trace))
    spent = gearchaos("run", study, "--out", store, "--shard", "3/512", "--json", check=False, prefix=prefix)
    opened = sum(f'{store}/' in line and "= -1 E" not in line for line in trace.open())
    own = _computed(spent)
    goal = own * 22 + 5000
    yield Line("--shard 3/512 of 10^5 tiles: files opened", f"{opened:,} for {own} tiles, {spent}",
               f"<= {goal:,}", opened <= goal)
    trace.unlink()
    shutil.rmtree(store)


def _computed(spent: Spent) -> int:
    """Tiles of this shard: those that are done, without those of the first shard, which has as many."""
    done = re.search(r'"done": (\d+)', spent.stdout)
    return 0 if done is None else int(done[1]) // 2
