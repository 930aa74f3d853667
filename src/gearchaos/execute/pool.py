"""An open pool of workers: work items are submitted to it, and results come in the order of completion."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from dataclasses import dataclass
from itertools import islice
from typing import Any, TypeVar

OTHER_CALL = "It keeps what an earlier call began: repeat that call, delete the file, or choose another one."
"""Advice where a file that keeps finished work is of another call."""

RESUME_ADVICE = "What is done is kept; the same command goes on from there."  # ends the message of an interrupted run
CHECK_INTERVAL = 2.0  # seconds between two checks that the workers can still be reached, and how many they are

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

    def submit(self, work: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Submit one work item, ``work(*arguments)``."""
        return self.executor.submit(work, *arguments)

    def cancel(self) -> None:
        """Cancel all work items that have not begun, without waiting for those being computed."""
        self.executor.shutdown(wait=False, cancel_futures=True)

    def results(
        self, work: Callable[[Item], Any], items: Iterable[Item], first: deque[Item] | None = None
    ) -> Iterator[tuple[Item, Future[Any]]]:
        """Yield every item with the future of ``work(item)``, in the order of completion.

        At most twice as many items as there are workers are submitted at a time: a submitted item may run to its end
        after an interrupt. Items not yet begun are cancelled when iteration stops. The caller may append to ``first``,
        which comes before ``items``. If the pool breaks, the item that could not be submitted any more is put there,
        and iteration stops when all submitted ones have ended.
        """
        rest, first, pending = iter(items), deque() if first is None else first, dict[Future[Any], Item]()
        broken = False
        try:
            while True:
                while not broken and len(pending) < 2 * self.workers():
                    taken = [first.popleft()] if first else list(islice(rest, 1))
                    if not taken:
                        break
                    try:
                        pending[self.submit(work, taken[0])] = taken[0]
                    except BrokenExecutor:
                        first.append(taken[0])
                        broken = True
                if not pending:
                    return
                ended = wait(pending, CHECK_INTERVAL, FIRST_COMPLETED).done
                self.check()
                for future in ended:
                    yield pending.pop(future), future
        finally:
            for future in pending:
                future.cancel()
