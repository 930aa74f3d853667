"""Shards: the parts into which a run is divided among processes that share a store but no scheduler."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain, islice

from gearchaos.errors import InputError
from gearchaos.store.journals.journal import WHOLE
from gearchaos.store.journals.progress import Progress
from gearchaos.store.tiles import Grid

_GROUPS_PER_SHARD = 8
"""Number of groups for each shard from which shards own whole groups; with fewer some would have much more to do."""

_MOST_SHARDS = 100_000
"""Each shard reads the journals of all others."""


@dataclass(frozen=True)
class Shard:
    """Part ``number`` of ``count`` parts of the tiles of a run, counted from 1."""

    number: int = 1
    count: int = 1

    def __post_init__(self) -> None:
        if not 1 <= self.number <= self.count:
            raise InputError("shard", "must read i/n with i from 1 to n", f"{self.number}/{self.count}", "E.g. 1/3.")
        if self.count > _MOST_SHARDS:
            raise InputError("shard", f"must be of at most {_MOST_SHARDS:,} shards", f"{self.number}/{self.count}")

    @classmethod
    def parse(cls, text: str) -> Shard:
        """A shard from "i/n"."""
        number, slash, count = text.partition("/")
        if not (slash and number.strip().isdecimal() and count.strip().isdecimal()):
            raise InputError("shard", "must read i/n with i from 1 to n", text, "E.g. 1/3.")
        return cls(int(number), int(count))

    @classmethod
    def of_writer(cls, name: str) -> Shard | None:
        """The shard with this name of a writer; None if it is the name of none."""
        if name == WHOLE:
            return cls()
        number, _, count = name.partition("-of-")
        known = all(part.isdecimal() and part.isascii() for part in (number, count))
        possible = known and 1 <= int(number) <= int(count) <= _MOST_SHARDS and int(count) > 1
        return cls(int(number), int(count)) if possible else None

    def __str__(self) -> str:
        return "a run" if self.count == 1 else f"shard {self.number}/{self.count}"

    @property
    def name(self) -> str:
        """Name of the writer: of its journal and its lock."""
        return WHOLE if self.count == 1 else f"{self.number}-of-{self.count}"

    @property
    def others(self) -> list[Shard]:
        """The other shards of the same division."""
        return [Shard(i, self.count) for i in range(1, self.count + 1) if i != self.number]

    def packs(self, group: int) -> bool:
        """Whether this shard, of all of the division, is the one to pack a group when its tiles are done."""
        return group % self.count == self.number - 1

    def tiles(self, grid: Grid) -> Iterator[int]:
        """The numbers of its tiles, group after group: its own groups, or every ``count``-th tile if they are few."""
        if owns_groups(grid, self.count):
            own = range(self.number - 1, grid.group_count, self.count)
            return chain.from_iterable(map(grid.tiles_of, own))
        return islice(_in_order(grid), self.number - 1, None, self.count)


def owns_groups(grid: Grid, count: int) -> bool:
    """Whether each of ``count`` shards owns whole groups."""
    return count == 1 or grid.group_count >= _GROUPS_PER_SHARD * count


def _in_order(grid: Grid) -> Iterator[int]:
    """All tiles, group after group."""
    return chain.from_iterable(map(grid.tiles_of, range(grid.group_count)))


def owners(grid: Grid, count: int) -> Iterator[tuple[int, int]]:
    """Yield every tile with the number of its shard, of ``count`` shards, in the order in which they are computed."""
    if owns_groups(grid, count):
        for group in range(grid.group_count):
            for tile in grid.tiles_of(group):
                yield tile, group % count + 1
    else:
        for rank, tile in enumerate(_in_order(grid)):
            yield tile, rank % count + 1


def missing_by_shard(grid: Grid, progress: Progress, count: int) -> dict[str, int]:
    """The number of tiles that are not done by shard, "3/4", of ``count`` shards; only of shards that have any."""
    found = Counter(owner for tile, owner in owners(grid, count) if not progress.done(tile))
    return {f"{number}/{count}": found[number] for number in sorted(found)}


def latest_division(writers: Iterable[tuple[str, float]]) -> int:
    """Number of shards of the writer that began last, of writers with their times; 1 for none or for a single run."""
    known = ((begun, shard.count) for name, begun in writers if (shard := Shard.of_writer(name)) is not None)
    return max(known, default=(0.0, 1))[1]
