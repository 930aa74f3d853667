"""Studies in tiles: independent pieces of work, run on all cores, with progress and a clean stop."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from itertools import islice
from typing import Any

from gearchaos.errors import InputError, whole_number

TILE = 2048
"""Most trajectories in one tile: a second or two of work, so that progress shows and Ctrl-C is felt."""

_LEAST = 64
_PER_CORE = 6
_BYTES = 400
"""What a study keeps of each cell or start, at most."""


def check_memory(name: str, count: int) -> None:
    """Raise if so many cells or starts cannot be kept in this machine's memory."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") if hasattr(os, "sysconf") else 1 << 33
    if count * _BYTES > memory:
        raise InputError(name, f"must be at most {memory // _BYTES:,} on this machine, by its memory", count)


def split(count: int, largest: int = TILE) -> list[slice]:
    """Consecutive tiles of ``count`` pieces of work, small enough that every core has work to the end."""
    size = min(largest, max(min(_LEAST, largest), -(-count // (_PER_CORE * (os.cpu_count() or 1)))))
    return [slice(i, min(i + size, count)) for i in range(0, count, size)]


def run(
    work: Callable[[slice], Any], tiles: Sequence[slice], *, progress: str | None = None, threads: int | None = None,
) -> Iterator[tuple[slice, Any]]:
    """Yield (tile, work(tile)) as tiles finish; kernels run without the GIL, so threads use all cores.

    ``progress`` names a bar on stderr that shows the rate and the time left. On an interrupt the tiles not yet begun
    are dropped and those under way finish.
    """
    workers = os.cpu_count() or 1 if threads is None else whole_number("threads", threads, 1)
    with _bar(progress, sum(map(_size, tiles))) as advance, ThreadPoolExecutor(workers) as pool:
        rest, waiting = iter(tiles), dict[Future[Any], slice]()
        try:
            while True:
                # a few ahead, not all: whatever is submitted runs to its end if the caller is interrupted meanwhile
                for tile in islice(rest, 2 * workers - len(waiting)):
                    waiting[pool.submit(work, tile)] = tile
                if not waiting:
                    break
                done, _ = wait(waiting, return_when=FIRST_COMPLETED)
                for future in done:
                    tile = waiting.pop(future)
                    yield tile, future.result()
                    advance(_size(tile))
        finally:
            pool.shutdown(wait=False, cancel_futures=True)


def _size(tile: slice) -> int:
    return tile.stop - tile.start


@contextmanager
def _bar(name: str | None, total: int) -> Iterator[Callable[[int], None]]:
    if name is None:
        yield lambda n: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True)) as bar:
        task = bar.add_task(name, total=total, rate="")

        def advance(n: int) -> None:
            bar.advance(task, n)
            speed = bar.tasks[0].finished_speed or bar.tasks[0].speed
            bar.update(task, rate=f"{speed:,.0f}/s" if speed else "")

        yield advance
