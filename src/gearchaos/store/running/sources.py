"""Which tile a writer computes next: its own, then those of other shards."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Collection, Iterable
from typing import Protocol

import numpy as np

from gearchaos.store.files.folder import Folder
from gearchaos.store.journals.progress import Progress
from gearchaos.store.tiles import Grid
from gearchaos.store.writers.claims import Claims
from gearchaos.store.writers.locks import held
from gearchaos.store.writers.shards import Shard, owners

CHECK_SECONDS = 2.0
"""Time between two looks at the journals of others while there is nothing to do."""

_REFRESH_SECONDS = 30.0
"""Time between two looks at the journals of others while there are own tiles to compute."""

SLOW = 2.0
"""A tile is computed a second time if it takes this many times as long as the median, and there are idle workers."""


class Source(Protocol):
    """Where the numbers of the tiles come from that are to be computed."""

    @property
    def remaining(self) -> int:
        """Number of tiles that may still come."""
        ...

    @property
    def exhausted(self) -> bool:
        """Whether no more tiles will come."""
        ...

    def begin(self, workers: int) -> None:
        """Called with the number of tiles that are computed at a time before the first ones are taken."""
        ...

    def take(self, count: int) -> list[int]:
        """The next tiles, at most ``count``; maybe none for now."""
        ...

    def withdrawn(self) -> set[int]:
        """Tiles that were taken but that others compute, since the last call: not needed if they have not begun."""
        ...


class Listed:
    """Tiles of a list, in its order."""

    def __init__(self, tiles: Iterable[int]) -> None:
        self._left = deque(tiles)

    @property
    def remaining(self) -> int:
        return len(self._left)

    @property
    def exhausted(self) -> bool:
        return not self._left

    def begin(self, workers: int) -> None:
        pass

    def take(self, count: int) -> list[int]:
        return [self._left.popleft() for _ in range(min(count, len(self._left)))]

    def withdrawn(self) -> set[int]:
        return set()


class Own(Listed):
    """The tiles of a shard without those that other shards claim.

    Parameters
    ----------
    tiles : iterable of int
    progress : Progress
        It is refreshed from time to time, since this shard packs groups with tiles of other shards, too.
    shard : Shard
    claims : Claims
        The claims on the tiles of this shard.
    """

    def __init__(self, tiles: Iterable[int], progress: Progress, shard: Shard, claims: Claims) -> None:
        super().__init__(tiles)
        self._progress, self._others, self._claims = progress, [other.name for other in shard.others], claims
        self._claimed = set[int]()
        self._looked = time.monotonic()
        self._begun = False

    def begin(self, workers: int) -> None:
        if not self._begun:
            self._claims.begin(workers)
        self._begun = True

    def take(self, count: int) -> list[int]:
        if time.monotonic() - self._looked >= _REFRESH_SECONDS:
            self._progress.refresh(self._others)
            self._looked = time.monotonic()
        self._refresh()
        return super().take(count)

    def withdrawn(self) -> set[int]:
        self._refresh()
        claimed, self._claimed = self._claimed, set()
        return claimed

    def _refresh(self) -> None:
        claimed = self._claims.refresh()
        if claimed:
            self._left = deque(tile for tile in self._left if tile not in claimed)
            self._claimed |= claimed


class Others:
    """The tiles that are not done of all shards of a division that have begun, for a shard that has done its own.

    Tiles are claimed, from the end, so that their owner, which computes them from the beginning, leaves them out.
    Tiles that are being computed elsewhere are taken, too, when they take clearly longer than others did.

    Parameters
    ----------
    folder : Folder
        The folder of the store.
    grid : Grid
    progress : Progress
    shard : Shard
        The shard that takes over tiles.
    """

    def __init__(self, folder: Folder, grid: Grid, progress: Progress, shard: Shard) -> None:
        self._folder, self._progress, self._shard = folder, progress, shard
        self._claims = {other: Claims(folder, other.name) for other in (*shard.others, shard)}
        tiles: dict[Shard, list[int]] = {other: [] for other in self._claims}
        for tile, number in owners(grid, shard.count):
            if not progress.done(tile):
                tiles[Shard(number, shard.count)].append(tile)
        self._missing = {other: np.array(missing, np.int64) for other, missing in tiles.items()}
        self._taken = set[int]()
        self._seen = dict[int, float]()
        self._looked = -CHECK_SECONDS
        done = progress.seconds[~np.isnan(progress.at) & ~np.isnan(progress.seconds)]
        self._patience = SLOW * (float(np.median(done)) if len(done) else 0.0) + 2 * CHECK_SECONDS
        self._refresh()

    @property
    def remaining(self) -> int:
        return sum(len(self._left(other)) for other in self._begun)

    @property
    def exhausted(self) -> bool:
        return not any(len(self._left(other)) for other in self._begun)

    @property
    def _begun(self) -> list[Shard]:
        """The shards whose tiles are computed: those that have begun, and this one, of which others may have claimed
        tiles."""
        return [other for other in self._missing if other.name in self._progress.writers]

    def _left(self, shard: Shard) -> np.ndarray:
        """The tiles (N,) of a shard that are not done, have not failed and are not being computed by this shard."""
        missing = self._missing[shard]
        self._missing[shard] = missing = missing[np.isnan(self._progress.at[missing])]
        return _without(missing, self._taken | self._progress.failed.keys())

    def begin(self, workers: int) -> None:
        pass

    def take(self, count: int) -> list[int]:
        if time.monotonic() - self._looked >= CHECK_SECONDS:
            self._refresh()
        tiles = self._claimed(count) or self._overdue(count)
        self._taken.update(tiles)
        return tiles

    def withdrawn(self) -> set[int]:
        """Tiles that others have done meanwhile."""
        done = {tile for tile in self._taken if self._progress.done(tile)}
        self._taken -= done
        return done

    def _refresh(self) -> None:
        """Read what the other shards have done."""
        self._progress.refresh([other.name for other in self._shard.others])
        for claims in self._claims.values():
            claims.refresh()
        self._looked = time.monotonic()

    def _claimed(self, count: int) -> list[int]:
        """Tiles of the shard that has most left, which are claimed."""
        free = {other: self._unclaimed(other) for other in self._begun if other != self._shard}
        for other in sorted(free, key=lambda o: len(free[o]), reverse=True):
            if len(free[other]) <= self._running(other):
                continue
            with self._claims[other].lock() as locked:
                if not locked:
                    return []
                self._claims[other].refresh()
                tail = self._unclaimed(other)[self._running(other):]
                tiles = tail[-min(count, -(-len(tail) // 2)):].tolist() if len(tail) else []
                if tiles:
                    self._claims[other].add(tiles, self._shard.name)
                    return tiles[::-1]
        return []

    def _unclaimed(self, other: Shard) -> np.ndarray:
        return _without(self._left(other), self._claims[other].tiles)

    def _running(self, other: Shard) -> int:
        """How many of its next tiles a shard is computing already."""
        return self._claims[other].workers if held(self._folder, other) else 0

    def _overdue(self, count: int) -> list[int]:
        """Tiles that others are computing for longer than they should."""
        now = time.monotonic()
        left = [tile for other in self._begun for tile in self._left(other).tolist()]
        self._seen = {tile: self._seen.get(tile, now) for tile in left}
        overdue = [tile for tile in left if now - self._seen[tile] > self._patience]
        first = len(overdue) * self._shard.number // self._shard.count  # so that shards begin with different ones
        return (overdue[first:] + overdue[:first])[:count]


def _without(tiles: np.ndarray, others: Collection[int]) -> np.ndarray:
    """Tiles (N,) without some others, in the same order: a look at each of a million tiles for each that is taken would
    cost more than the tile."""
    return tiles[~np.isin(tiles, list(others))] if others else tiles
