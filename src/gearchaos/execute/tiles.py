"""Studies in tiles: independent pieces of work, run on all cores, with progress and a clean stop."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from contextvars import copy_context
from itertools import islice, pairwise
from typing import Any, TypeVar

import numpy as np

from gearchaos.errors import InputError, whole_number

TILE = 8192
"""Most trajectories in one tile: a few seconds of work, so that progress shows and Ctrl-C is felt."""

Item = TypeVar("Item")

_BEAT = 2.0
_LEAST = 256
"""Fewer motions do not fill the seats of one kernel call; they are worth no thread of their own."""
_LAST = 16
"""A thread's last tile is so small a part of its share that the others do not wait long for it."""
_FEW = 5120
"""A thread has no more than one tile where its share is no more than this: smaller ones would cost more than waiting
for the last."""
_BYTES = 400
"""What a study keeps of each cell or start, at most."""


def memory() -> int:
    """Bytes of memory that this machine has."""
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") if hasattr(os, "sysconf") else 1 << 33


def check_memory(name: str, count: int, each: int = _BYTES) -> None:
    """Raise if so many cells, starts or whatever takes so many bytes ``each`` cannot be kept in memory."""
    most = memory() // each
    if count > most:
        raise InputError(name, f"must be at most {most:,} on this machine, by its memory", count)


def cores() -> int:
    """Cores that this process may use: of a shared node those of its job."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _workers(threads: int | None) -> int:
    """How many threads there are to be, by default one per core."""
    return cores() if threads is None else whole_number("threads", threads, 1)


def side_by_side(count: int, threads: int | None = None) -> int:
    """How many threads so many motions can fill."""
    return max(1, min(_workers(threads), count // _LEAST))


def split(count: int, largest: int = TILE, threads: int | None = None) -> list[slice]:
    """Consecutive tiles of ``count`` pieces of work, large ones first and ever smaller ones: threads end together."""
    workers = _workers(threads)
    if count <= workers * min(_FEW, largest):
        return _equal(count, max(side_by_side(count, threads), -(-count // largest)))
    least = min(largest, max(_LEAST, count // (_LAST * workers)))
    tiles, first = [], 0
    while first < count:
        size = largest if workers == 1 else min(largest, max(least, (count - first) // (2 * workers)))
        tiles.append(slice(first, min(first + size, count)))
        first += size
    return tiles


def dealt(count: int, threads: int | None = None) -> np.ndarray:
    """The numbers of so many pieces of work, dealt to the threads in turn: a share is like any other, where half of a
    diagram may be chaotic."""
    workers = _workers(threads)
    return np.concatenate([np.arange(i, count, workers) for i in range(workers)])


def _equal(count: int, parts: int) -> list[slice]:
    ends = [count * i // parts for i in range(parts + 1)]
    return [slice(first, last) for first, last in pairwise(ends) if last > first]


def run(
    work: Callable[[slice], Any], tiles: Iterable[slice], *, progress: str | None = None, threads: int | None = None,
) -> Iterator[tuple[slice, Any]]:
    """Yield (tile, work(tile)) as tiles finish; kernels run without the GIL, so threads use all cores.

    ``progress`` names a bar on stderr that shows the rate and the time left; without it tiles may be cut as they are
    needed, as late as when the one before was begun. On an interrupt the tiles not yet begun
    are dropped and those under way finish. The work sees the context variables of its caller.
    """
    workers = _workers(threads)
    here = copy_context()

    def in_context(tile: slice) -> Any:
        return here.copy().run(work, tile)

    tiles = tiles if progress is None else list(tiles)
    with bar(progress, sum(map(_size, tiles)) if progress else 0) as advance, ThreadPoolExecutor(workers) as pool:
        for tile, future in few_ahead(pool, in_context, tiles, lambda: 2 * workers):
            yield tile, future.result()
            advance(_size(tile))


def few_ahead(
    pool: Executor, work: Callable[[Item], Any], items: Iterable[Item], ahead: Callable[[], int],
    beat: Callable[[], None] = lambda: None,
) -> Iterator[tuple[Item, Future[Any]]]:
    """Yield every item with its future as it is done; ``beat`` is called now and then, and may raise.

    A few items are handed out ``ahead``, not all: whatever is handed out runs to its end if the caller is interrupted.
    """
    rest, waiting = iter(items), dict[Future[Any], Item]()
    try:
        while True:
            for item in islice(rest, max(0, ahead() - len(waiting))):
                waiting[pool.submit(work, item)] = item
            if not waiting:
                return
            done, _ = wait(waiting, timeout=_BEAT, return_when=FIRST_COMPLETED)
            beat()
            for future in done:
                yield waiting.pop(future), future
    finally:
        for future in waiting:
            future.cancel()


def _size(tile: slice) -> int:
    return tile.stop - tile.start


@contextmanager
def bar(name: str | None, total: int, done: int = 0) -> Iterator[Callable[[int], None]]:
    """A progress bar on stderr, or none without a name; yields the function that moves it on."""
    if name is None:
        yield lambda n: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True)) as shown:
        task = shown.add_task(name, total=total, completed=done, rate="")

        def advance(n: int) -> None:
            shown.advance(task, n)
            speed = shown.tasks[0].finished_speed or shown.tasks[0].speed
            shown.update(task, rate=f"{speed:,.0f}/s" if speed else "")

        yield advance
