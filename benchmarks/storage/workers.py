"""Workers on slow disks, a slow worker, and the files that one shard of many opens."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from storage.children import Spent, gearchaos
from storage.lines import Line
from storage.scaling import TILES, write_study

WORKERS, SECONDS, SIDE = 8, 1.0, 72
"""Workers, seconds a tile, and side of a map of 324 tiles of 16 cells."""


def slow_disk(folder: Path) -> Iterator[Line]:
    """324 tiles of a second each in 8 processes, where each write of a file takes 50 ms."""
    spent, text = _tiles_of_a_second(folder, "disk", INSTANT_WRITE_SECONDS=0.05)
    yield Line("8 workers x 324 tiles of 1 s, 50 ms a write", text, "< 50 s, ideal 40.5", spent.wall < 50)


def slow_worker(folder: Path) -> Iterator[Line]:
    """The same with a fast disk, but one worker takes 20 times as long."""
    place = folder / "slow"
    place.mkdir()
    spent, text = _tiles_of_a_second(folder, "worker", INSTANT_SLOW=place)
    yield Line("8 workers x 324 tiles of 1 s, one 20 x slower", text, "< 50 s", spent.wall < 50)


def _tiles_of_a_second(folder: Path, name: str, **environment: object) -> tuple[Spent, str]:
    """What a run takes, and a text of it with the times at which tiles begin."""
    study, store, log = write_study(folder, SIDE, SIDE), folder / f"{name}.zarr", folder / f"{name}.log"
    spent = gearchaos("run", study, "--out", store, "--tile", 16, "--processes", WORKERS,
                      INSTANT_SECONDS=SECONDS, INSTANT_LOG=log, **environment)
    shutil.rmtree(store)
    begun = sorted(float(line.split()[0]) - spent.started for line in log.read_text().splitlines())
    return spent, f"{spent}; tiles begin from {begun[0]:.1f} to {begun[-1]:.1f} s, {len(begun)} in all"


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


def stale_listings(folder: Path, seconds: float = 30.0, count: int = 4) -> Iterator[Line]:
    """Four shards that begin at once, where each sees files of the others as they were up to 30 s ago."""
    study, store = write_study(folder, *TILES[1000]), folder / "stale.zarr"
    arguments = ("run", study, "--out", store, "--tile", 16, "--json")
    with ThreadPoolExecutor(count) as pool:
        shards = [pool.submit(gearchaos, *arguments, "--shard", f"{number}/{count}", check=False, INSTANT_STALE=seconds)
                  for number in range(1, count + 1)]
    ended = [shard.result() for shard in shards]
    told = sum('"finished": true' in spent.stdout for spent in ended)
    done = (store / "run" / "finished").exists()
    text = f"finished: {done}, said by {told} of {count} shards, after {max(spent.wall for spent in ended):.1f} s"
    yield Line(f"listings that are {seconds:g} s old, {count} shards", text, "finished", done and told > 0)
    shutil.rmtree(store)


def one_shard_alone(folder: Path) -> Iterator[Line]:
    """What shard 2/4 says when the others never ran."""
    study, store = write_study(folder, *TILES[1000]), folder / "alone.zarr"
    spent = gearchaos("run", study, "--out", store, "--tile", 16, "--shard", "2/4", "--json", check=False)
    said = '"finished": false' in spent.stdout
    yield Line("--shard 2/4 alone", f"exit code {spent.code}, says that it is not finished: {said}",
               "exit code 3", spent.code == 3 and said)
    shutil.rmtree(store)
