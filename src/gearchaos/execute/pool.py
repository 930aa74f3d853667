"""An open pool of workers, and the work items that are submitted to it.

Results are yielded as they complete; items that have not begun are cancelled when iteration stops. Work may be computed
twice at the same time where a pool can stop the copy that is not needed any more (`Pool.stop`).
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Container, Iterable, Iterator
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from itertools import islice, takewhile
from queue import Empty, SimpleQueue
from typing import Any, Generic, TypeVar

RESUME_ADVICE = "What is done is kept; the same command goes on from there."
"""Last sentence of the messages of errors that interrupt a run."""

CHECK_INTERVAL = 2.0
"""Seconds between two checks that the workers can still be reached, and that they are as many as before."""

Item = TypeVar("Item")


class PoolLostError(OSError):
    """The workers of a pool cannot be reached any more; the work items being computed are lost."""


def connection_lost(error: BaseException | None) -> bool:
    """Whether the error of a work item means that its pool cannot be reached, not that the item failed.

    Dask's own error is recognised by its name, since Dask may not be installed.
    """
    return isinstance(error, ConnectionError) or type(error).__name__ == "CommClosedError"


@dataclass(frozen=True)
class Pool:
    """An open pool of workers."""

    executor: Executor
    workers: Callable[[], int]  # the number of work items computed at once, which may change on a cluster
    check: Callable[[], None] = lambda: None  # raises `PoolLostError` if the workers cannot be reached any more
    threads_per_item: Callable[[int], int] = lambda items: 1  # for so many remaining items
    stop: Callable[[], None] | None = None
    """Ends the pool without waiting for what is being computed; None for threads, which cannot be stopped."""

    def submit(self, work: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Submit one work item, ``work(*arguments)``."""
        return self.executor.submit(work, *arguments)

    def cancel(self) -> None:
        """Cancel all work items that have not begun, without waiting for those being computed."""
        self.executor.shutdown(wait=False, cancel_futures=True)

    def results(
        self, work: Callable[[Item], Any], items: Iterable[Item], max_pending: Callable[[], int] | None = None
    ) -> Iterator[tuple[Item, Future[Any]]]:
        """Yield every item with the future of ``work(item)``, in the order of completion.

        At most ``max_pending()`` submitted items, by default twice the number of workers, are unfinished at a time: a
        submitted item may run to its end after an interrupt. Items not yet begun are cancelled when iteration stops.
        """
        max_pending = max_pending or (lambda: 2 * self.workers())
        rest, submitted = iter(items), Submitted[Item](self)
        try:
            while True:
                for item in islice(rest, max(0, max_pending() - len(submitted))):
                    submitted.add(item, work, item)
                if not len(submitted):
                    return
                yield from submitted.ended(CHECK_INTERVAL)
        finally:
            submitted.cancel()


class Submitted(Generic[Item]):
    """Work items that are submitted to a pool and have not ended.

    Every future puts itself into a queue when it ends. So the time to find the next result does not depend on the
    number of workers, as it would if all futures were waited for.
    """

    def __init__(self, pool: Pool) -> None:
        self._pool = pool
        self._items = dict[Future[Any], Item]()
        self._begun = dict[Future[Any], float]()
        """Times of those that are being computed, if workers begin them in the order in which they were submitted."""
        self._waiting = deque[Future[Any]]()
        self._ended: SimpleQueue[Future[Any]] = SimpleQueue()

    def __len__(self) -> int:
        return len(self._items)

    def add(self, item: Item, work: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Submit ``work(*arguments)``, of which `ended` will speak as ``item``; returns its future."""
        future = self._pool.submit(work, *arguments)
        self._items[future] = item
        self._waiting.append(future)
        self._begin()
        future.add_done_callback(self._ended.put)
        return future

    def _begin(self) -> None:
        """Note the time at which workers that are free begin the next items."""
        workers = self._pool.workers()
        while self._waiting and len(self._begun) < workers:
            future = self._waiting.popleft()
            if future in self._items:
                self._begun[future] = time.monotonic()

    @property
    def idle(self) -> int:
        """Number of workers that have nothing to do."""
        return max(0, self._pool.workers() - len(self._items))

    def longer_than(self, seconds: float) -> list[Item]:
        """The items that have been computed for longer than this."""
        latest = time.monotonic() - seconds
        return [self._items[f] for f, begun in takewhile(lambda pair: pair[1] < latest, self._begun.items())]

    def ended(self, timeout: float) -> list[tuple[Item, Future[Any]]]:
        """Wait until an item ends, at most ``timeout`` seconds; returns all that have ended, with their futures.

        Raises `PoolLostError` if the workers cannot be reached any more.
        """
        futures = []
        try:
            futures.append(self._ended.get(timeout=timeout))
            while True:
                futures.append(self._ended.get_nowait())
        except Empty:
            pass
        self._pool.check()
        out = [(self._items.pop(future), future) for future in futures if future in self._items]
        for future in futures:
            self._begun.pop(future, None)
        self._begin()
        return out

    def withdraw(self, items: Container[Item]) -> list[Item]:
        """Cancel those of these items that no worker has begun; returns those that were cancelled."""
        chosen = [(future, item) for future, item in self._items.items() if item in items]
        cancelled = [(future, item) for future, item in chosen if future not in self._begun and future.cancel()]
        for future, _ in cancelled:
            del self._items[future]
        return [item for _, item in cancelled]

    def cancel(self) -> None:
        """Cancel all items that have not begun."""
        for future in list(self._items):
            future.cancel()
