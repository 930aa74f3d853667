"""Division of work items into tiles, and computation of tiles in threads."""

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
"""Largest number of trajectories in a tile: a few seconds of work, so that progress is seen and interrupts act soon."""

_MIN_PER_THREAD = 16
"""Smallest number of trajectories that justifies a thread: two packs of lanes."""

_LEAST_TILE = 256
"""Smallest tile of many: fewer trajectories do not fill the lanes of one kernel call."""

_FINAL_DIVISOR = 16
"""The smallest tile is the share of one thread divided by this, so that threads end at about the same time."""

_TILES_PER_THREAD = 4
"""Tiles of whole parameter points for each thread, where there are points enough: some take much longer than others."""

_MAX_UNDIVIDED = 5120
"""The share of one thread is a single tile up to this number of trajectories: smaller tiles would cost more than the
wait at the end."""


def _workers(threads: int | None) -> int:
    """Number of threads, by default one per core."""
    return cores() if threads is None else whole_number("threads", threads, 1)


def useful_threads(count: int, threads: int | None = None) -> int:
    """Number of threads that ``count`` trajectories keep busy."""
    return max(1, min(_workers(threads), count // _MIN_PER_THREAD))


def split(count: int, largest: int = TILE, threads: int | None = None) -> list[slice]:
    """Consecutive tiles of ``count`` work items, of decreasing size so that all threads end at about the same time.

    ``largest`` is the largest number of items in a tile.
    """
    workers = _workers(threads)
    if count <= workers * min(_MAX_UNDIVIDED, largest):
        parts = max(useful_threads(count, threads), -(-count // largest))
        ends = [count * i // parts for i in range(parts + 1)]  # equal sizes, up to one item
        return [slice(first, last) for first, last in pairwise(ends) if last > first]
    least = min(largest, max(_LEAST_TILE, count // (_FINAL_DIVISOR * workers)))
    tiles, first = [], 0
    while first < count:
        size = largest if workers == 1 else min(largest, max(least, (count - first) // (2 * workers)))
        tiles.append(slice(first, min(first + size, count)))
        first += size
    return tiles


def split_points(points: np.ndarray, most: int, largest: int = TILE, threads: int | None = None) -> list[slice]:
    """`split` into tiles of at most ``most`` parameter points, whose tables are kept from call to call: ``points`` (L,)
    are those of the trajectories, equal ones next to each other."""
    workers, first = _workers(threads), np.flatnonzero(np.diff(points, prepend=np.nan))
    most = max(1, min(most, -(-len(first) // (_TILES_PER_THREAD * workers))))
    ends = [*first[::most].tolist(), len(points)]
    parts = -(-workers // (len(ends) - 1)) if len(points) else 1
    return [slice(begin + part.start, begin + part.stop) for begin, end in pairwise(ends)
            for part in split(end - begin, min(largest, -(-(end - begin) // parts)), 1)]


def interleaved(count: int, threads: int | None = None) -> np.ndarray:
    """Numbers (count,) of work items in an order that spreads neighbours over the threads.

    Neighbouring items often have similar computing times, for example in a chaotic half of a diagram. The share of
    thread i out of n is i, i + n, i + 2n, and so on, so that all shares take about equally long.
    """
    workers = _workers(threads)
    return np.concatenate([np.arange(i, count, workers) for i in range(workers)])


def run(
    work: Callable[[slice], Any], tiles: Iterable[slice], *, progress: str | None = None, threads: int | None = None,
) -> Iterator[tuple[slice, Any]]:
    """Yield (tile, work(tile)) in the order of completion, computed in so many threads, by default one per core.

    Work has the context variables of the caller. With the name of a ``progress`` bar the tiles are read in advance,
    otherwise as they are submitted. After an interrupt those being computed are finished and the others cancelled.
    """
    tiles = tiles if progress is None else list(tiles)
    total = sum(tile.stop - tile.start for tile in tiles) if progress else 0
    with bar(progress, total) as advance, thread_pool(_workers(threads))() as pool:
        for tile, future in pool.results(work, tiles):
            yield tile, future.result()
            advance(tile.stop - tile.start)
