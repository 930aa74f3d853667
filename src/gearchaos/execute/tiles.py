"""Work items divided into tiles, and tiles computed in threads."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from gearchaos.errors import whole_number
from gearchaos.execute.machine import cores
from gearchaos.execute.pools import thread_pool
from gearchaos.execute.progress import bar

TILE = 8192
"""Most trajectories in a tile: a few seconds of work, so that progress shows and an interrupt is soon obeyed."""

_LEAST = 256
"""Fewer trajectories do not fill the lanes of one kernel call; they are not worth a thread of their own."""

_LAST = 16
"""The last tiles of a thread are this fraction of its share, so that the other threads do not wait long for it."""

_FEW = 5120
"""If the share of a thread is not larger than this, it is one tile: smaller ones would cost more than the wait."""


def _workers(threads: int | None) -> int:
    """Number of threads, by default one per core."""
    return cores() if threads is None else whole_number("threads", threads, 1)


def side_by_side(count: int, threads: int | None = None) -> int:
    """Number of threads that so many trajectories can fill."""
    return max(1, min(_workers(threads), count // _LEAST))


def split(count: int, largest: int = TILE, threads: int | None = None) -> list[slice]:
    """Consecutive tiles of ``count`` work items, of decreasing size, so that all threads end at about the same time."""
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
    """Numbers (count,) of work items, dealt to the threads in turn.

    Neighbouring items often take alike long: half of a diagram may be chaotic. Dealt out, all shares are alike.
    """
    workers = _workers(threads)
    return np.concatenate([np.arange(i, count, workers) for i in range(workers)])


def _equal(count: int, parts: int) -> list[slice]:
    ends = [count * i // parts for i in range(parts + 1)]
    return [slice(first, last) for first, last in pairwise(ends) if last > first]


def run(
    work: Callable[[slice], Any], tiles: Iterable[slice], *, progress: str | None = None, threads: int | None = None,
) -> Iterator[tuple[slice, Any]]:
    """Yield (tile, work(tile)) as tiles finish; kernels release the GIL, so threads use all cores.

    Parameters
    ----------
    work : callable
        Sees the context variables of the caller.
    tiles : iterable of slice
        Without a progress bar they are drawn one by one, as they are needed.
    progress : str, optional
        Name of a progress bar on stderr.
    threads : int, optional
        Tiles computed at once; by default one per core.

    On an interrupt the tiles under way finish and the others are dropped.
    """
    tiles = tiles if progress is None else list(tiles)
    total = sum(map(_size, tiles)) if progress else 0
    with bar(progress, total) as advance, thread_pool(_workers(threads))() as pool:
        for tile, future in pool.results(work, tiles):
            yield tile, future.result()
            advance(_size(tile))


def _size(tile: slice) -> int:
    return tile.stop - tile.start
