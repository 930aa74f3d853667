"""The writer of a run: it gives tiles and groups to a pool of workers, and keeps the journal."""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Future
from contextlib import suppress
from dataclasses import dataclass, replace
from statistics import median
from typing import Any

from gearchaos.execute.pool import RESUME_ADVICE, Pool, PoolLostError, Submitted, connection_lost
from gearchaos.execute.pools import PoolFactory
from gearchaos.store.journals.journal import Damaged, Failed, Journal, Line, Lost, Packed, TileEntry
from gearchaos.store.journals.progress import Progress
from gearchaos.store.machine import process_name
from gearchaos.store.reading.missing import missing_parts
from gearchaos.store.running.sources import CHECK_SECONDS, SLOW, Listed, Source
from gearchaos.store.running.worker import compute_tile, pack_group
from gearchaos.store.store import Store
from gearchaos.store.writers.shards import Shard

ATTEMPTS = 3
"""Number of attempts at a tile before it is reported as failed, and at packing a group before the run stops."""

SETTLING_SECONDS = 90.0
"""Longest time until what one machine has written is seen by another one: network file systems may show each the state
of half a minute ago."""

_WRITING_SECONDS = 0.5
"""Time in addition to `SLOW` medians after which a tile is computed a second time: that of writing its results."""

_DURATIONS = 99
"""Number of the latest tiles of whose computing times the median is taken."""


@dataclass(frozen=True)
class Tile:
    """The task to compute a tile."""

    number: int


@dataclass(frozen=True)
class Group:
    """The task to pack a group."""

    number: int


Task = Tile | Group


class Coordinator:
    """Computes tiles and packs groups in pools, and writes down what is done.

    Parameters
    ----------
    store : Store
    progress : Progress
        What the journals of all writers say; it follows what this writer does.
    journal : Journal
        The journal of this writer.
    shard : Shard
    pool : PoolFactory
    advance : callable
        Called with the number of tiles that are done, by this or another writer, since the last call; it is negative
        when results are lost.

    Attributes
    ----------
    packs_all : bool
        Whether this writer packs all groups that are complete, not only those that it has to.
    """

    def __init__(
        self, store: Store, progress: Progress, journal: Journal, shard: Shard, pool: PoolFactory,
        advance: Callable[[int], None] = lambda tiles: None,
    ) -> None:
        self.store, self.progress, self.shard, self.pool, self.advance = store, progress, shard, pool, advance
        self.packs_all = False
        self._journal = journal
        self._latest_loss = 0.0
        self._shown = progress.done_count
        self._in_segments = Counter[str]()
        """Number of tiles in each segment of this run that are in no packed group."""

    def compute(self, source: Source) -> None:
        """Compute these tiles, those that fail twice more and alone, and pack the groups that are complete."""
        errors = _Attempt(self, 1, source).run()
        for attempt in range(2, ATTEMPTS + 1):
            errors = _Attempt(self, attempt, Listed(sorted(errors))).run()
        if errors:
            self.record(*(Failed(tile, error, ATTEMPTS, process_name()) for tile, error in sorted(errors.items())))

    def to_pack(self) -> list[int]:
        """The groups that this writer packs now: their tiles are done."""
        return [g for g in self.progress.complete_groups() if self.packs_all or self.shard.packs(g)]

    def entries(self, group: int) -> list[TileEntry]:
        """The entries of all tiles of a complete group."""
        return [self.progress.entries[tile] for tile in self.store.grid.tiles_of(group)]

    def refresh(self) -> None:
        """Read what other writers have done."""
        self.progress.refresh([other.name for other in self.shard.others])
        self._show()

    def _show(self) -> None:
        """Say how many more tiles are done."""
        done = self.progress.done_count
        self.advance(done - self._shown)
        self._shown = done

    def record(self, *lines: Line) -> None:
        """Write lines into the journal, and apply them."""
        current = [self._after_losses(line) for line in lines]
        self._journal.append(*current)
        for line in current:
            if isinstance(line, TileEntry):
                self._in_segments[line.segment or ""] += 1
            packed = self._entries_of(line.group) if isinstance(line, Packed) else []
            self.progress.add(line, self.shard.name)
            self._delete_segments(packed)
        self._show()

    def _entries_of(self, group: int) -> list[TileEntry]:
        """The entries of those tiles of a group that are not in a packed group."""
        entries = self.progress.entries
        return [entries[tile] for tile in self.store.grid.tiles_of(group) if tile in entries]

    def _after_losses(self, line: Line) -> Line:
        """A line with a time after that of all losses, also if the clock of its worker is behind."""
        if isinstance(line, Lost | Damaged):
            self._latest_loss = max(self._latest_loss, line.at)
            return line
        latest = max(self._latest_loss, self.progress.latest_loss)
        return line if line.at > latest else replace(line, at=latest + 1e-3)

    def _delete_segments(self, packed: list[TileEntry]) -> None:
        """Delete the segments of this run that are full and of which all tiles are in packed groups."""
        for entry in packed:
            name = entry.segment or ""
            if name not in self._in_segments:
                continue
            self._in_segments[name] -= 1
            folder = self.store.folder
            if self._in_segments[name] == 0 and (folder.size(name) or 0) >= max(1, folder.segment_size):
                folder.delete(name)

    def done_by_another(self, task: Task) -> bool:
        """Whether another writer has done a task: it may be finishing the store, and deletes files of this writer."""
        if self.shard.count == 1:
            return False
        self.refresh()
        done = self.progress.done(task.number) if isinstance(task, Tile) else task.number in self.progress.packed
        return done or self.store.finished

    def finished_with_losses(self) -> bool:
        """Whether results of a finished store are missing, also after the time in which it is seen what other shards,
        which may have finished it just now, have written and deleted."""
        return self._stays(lambda: self.store.finished and bool(missing_parts(self.store, self.progress).tiles))

    def superseded(self, group: int) -> bool:
        """Whether another writer has packed a group, which it may have done some time before this one sees it."""
        return not self._stays(lambda: group not in self.progress.packed and not self.store.finished)

    def _stays(self, condition: Callable[[], bool]) -> bool:
        """Whether a condition holds, also after what other shards have written is seen."""
        latest = time.monotonic() + (SETTLING_SECONDS if self.shard.count > 1 else 0.0)
        while True:
            self.refresh()
            if not condition():
                return False
            if time.monotonic() >= latest:
                return True
            time.sleep(CHECK_SECONDS)


class _Attempt:
    """One attempt at each tile of a source, with a new pool if one breaks."""

    def __init__(self, owner: Coordinator, number: int, source: Source) -> None:
        self._owner, self._number, self._source = owner, number, source
        self._errors: dict[int, str] = {}
        self._durations: deque[float] = deque(maxlen=_DURATIONS)
        self._todo = deque[int]()
        """Tiles to be submitted next: of the source, or again since their pool broke or their results are damaged."""
        self._copies = Counter[int]()
        """How often a tile is being computed at the moment."""
        self._packing = set[int]()
        self._packed = Counter[int]()
        """Number of attempts at packing a group."""
        self._packing_errors: dict[int, str] = {}

    def run(self) -> dict[int, str]:
        """Try each tile once; returns the errors of those that failed."""
        while self._left:
            with self._owner.pool() as pool, suppress(BrokenExecutor):
                self._work(pool)
        return self._errors

    @property
    def _left(self) -> bool:
        """Whether there is anything to do or to wait for."""
        needed = any(not self._owner.progress.done(tile) for tile in self._copies)
        return bool(needed or self._packing or self._todo or not self._source.exhausted or self._owner.to_pack())

    def _work(self, pool: Pool) -> None:
        """Submit tasks and take their results until nothing is left."""
        submitted = Submitted[Task](pool)
        self._source.begin(pool.workers())
        threads = pool.threads_per_item(max(1, len(self._todo) + self._source.remaining))
        try:
            while self._left:
                self._submit(pool, submitted, threads)
                self._take(submitted.ended(self._patience(submitted)))
            if len(submitted) and pool.stop is not None:  # they are copies of tiles that are done
                pool.stop()
        finally:
            submitted.cancel()
            self._todo.extend(tile for tile in self._copies if not self._owner.progress.done(tile))
            self._copies.clear()
            self._packing.clear()

    def _submit(self, pool: Pool, submitted: Submitted[Task], threads: int) -> None:
        """Give the workers groups to pack, then tiles, then second copies of tiles that take long."""
        for group in self._owner.to_pack():
            if group not in self._packing:
                self._pack(submitted, group)
        self._withdraw(submitted)
        free = (2 * pool.workers() if self._number == 1 else 1) - len(submitted)
        if free > len(self._todo):
            self._todo.extend(self._source.take(free - len(self._todo)))
        for _ in range(min(free, len(self._todo))):
            self._compute(submitted, self._todo[0], threads)
            self._todo.popleft()  # not before it is submitted: the pool may be broken
        if pool.stop is not None and submitted.idle:
            for tile in self._overdue(submitted):
                self._compute(submitted, tile, threads)

    def _compute(self, submitted: Submitted[Task], tile: int, threads: int) -> None:
        """Submit a tile."""
        submitted.add(Tile(tile), compute_tile, self._owner.store.folder.url, self._number, threads, tile)
        self._copies[tile] += 1

    def _overdue(self, submitted: Submitted[Task]) -> list[int]:
        """The tiles to compute a second time, at most one for each idle worker."""
        tasks = submitted.longer_than(self._limit) if self._durations else []
        slow = [t.number for t in tasks if isinstance(t, Tile) and self._copies[t.number] == 1]
        return [tile for tile in slow if not self._owner.progress.done(tile)][:submitted.idle]

    @property
    def _limit(self) -> float:
        """Seconds after which a tile is computed a second time."""
        return SLOW * median(self._durations) + _WRITING_SECONDS

    def _patience(self, submitted: Submitted[Task]) -> float:
        """Seconds to wait for a result before looking again for something to do."""
        return min(CHECK_SECONDS, self._limit / 4) if self._durations and submitted.idle else CHECK_SECONDS

    def _withdraw(self, submitted: Submitted[Task]) -> None:
        """Cancel tiles that others compute, if no worker has begun them."""
        tiles = {Tile(tile) for tile in self._source.withdrawn()}
        for task in submitted.withdraw(tiles) if tiles else ():
            self._end_copy(task.number)

    def _end_copy(self, tile: int) -> None:
        """Note that a tile is computed once less."""
        self._copies[tile] -= 1
        if not self._copies[tile]:
            del self._copies[tile]

    def _pack(self, submitted: Submitted[Task], group: int) -> None:
        """Submit a group to be packed."""
        if self._packed[group] >= ATTEMPTS:
            why = self._packing_errors.get(group, "the processes that did it died")
            raise OSError(f"group {group} cannot be packed: {why.removesuffix('.')}. {RESUME_ADVICE}")
        self._packed[group] += 1
        self._packing.add(group)
        submitted.add(
            Group(group), pack_group, self._owner.store.folder.url, group, self._owner.entries(group)
        )

    def _take(self, ended: list[tuple[Task, Future[Any]]]) -> None:
        """Record results, all that have come together in one writing of the journal."""
        lines: list[Line] = []
        for task, future in ended:
            result = self._result(task, future)
            if isinstance(task, Group):
                lines += self._taken_group(task.number, result)
            else:
                lines += self._taken_tile(task.number, result)
        if lines:
            self._owner.record(*lines)

    def _result(self, task: Task, future: Future[Any]) -> Any:
        """The result of a task, or its error as text if that does not concern all tasks."""
        try:
            return result_of(future)
        except PoolLostError:
            raise
        except OSError as error:
            if self._owner.done_by_another(task):
                return str(error)
            raise

    def _taken_group(self, group: int, result: Packed | Lost | str) -> list[Line]:
        """The lines of the journal for a group that a worker has packed, or could not pack."""
        self._packing.discard(group)
        if isinstance(result, str):
            self._packing_errors[group] = result
        if isinstance(result, str) or (isinstance(result, Lost) and self._owner.superseded(group)):
            return []
        if isinstance(result, Lost):
            self._todo.extend(result.tiles)
        return [result]

    def _taken_tile(self, tile: int, result: TileEntry | str) -> list[Line]:
        """The lines of the journal for a tile that a worker has computed, or could not compute."""
        self._end_copy(tile)
        if self._owner.progress.done(tile):
            return []
        if isinstance(result, str):
            if tile not in self._copies:
                self._errors[tile] = result
            return []
        self._durations.append(result.seconds)
        return [result]


def result_of(future: Future[Any]) -> Any:
    """The result of a task, its error as text; raises an error that concerns all tasks."""
    error = None if future.cancelled() else future.exception()
    if future.cancelled() or connection_lost(error):
        raise PoolLostError(f"the cluster is gone. {RESUME_ADVICE}")
    if isinstance(error, BrokenExecutor):
        return "the process that computed it died"
    if isinstance(error, OSError):
        raise OSError(f"{error}. {RESUME_ADVICE}") from None
    return future.result() if error is None else f"{type(error).__name__}: {error}"
