"""Pools of workers with one interface: threads, processes, the workers of a Dask scheduler, Slurm jobs.

Work items are submitted one by one or as an iterable; results come as they are done; leaving the pool cancels what has
not begun.
"""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor, wait
from contextlib import AbstractContextManager, contextmanager
from contextvars import copy_context
from dataclasses import dataclass
from itertools import islice
from multiprocessing import get_context, parent_process
from threading import Thread
from typing import Any, TypeVar

from gearchaos.errors import InputError, whole_number
from gearchaos.execute.machine import cores

KEPT = "What is done is kept; the same command goes on from there."

_BEAT = 2.0
"""Seconds between two checks that the workers are still there."""

Item = TypeVar("Item")


class PoolLostError(OSError):
    """The pool is gone, and with it the work items under way."""


def connection_lost(error: BaseException | None) -> bool:
    """Whether the error of a work item only says that its pool cannot be reached any more.

    Dask's own error is recognised by its name, since Dask may not be installed.
    """
    return isinstance(error, ConnectionError) or type(error).__name__ == "CommClosedError"


@dataclass(frozen=True)
class Pool:
    """An open pool of workers.

    Attributes
    ----------
    executor : concurrent.futures.Executor
    width : callable
        Number of work items computed at once, now.
    check : callable
        Raises `PoolLostError` if the workers cannot be reached any more.
    threads_per_item : callable
        Number of threads that each of so many work items may use.
    """

    executor: Executor
    width: Callable[[], int]
    check: Callable[[], None] = lambda: None
    threads_per_item: Callable[[int], int] = lambda items: 1

    def submit(self, work: Callable[..., Any], *arguments: Any) -> Future[Any]:
        """Have one work item computed."""
        return self.executor.submit(work, *arguments)

    def results(
        self, work: Callable[[Item], Any], items: Iterable[Item], ahead: Callable[[], int] | None = None
    ) -> Iterator[tuple[Item, Future[Any]]]:
        """Yield every item with the future of ``work(item)`` as it is done.

        At most ``ahead()`` items, by default twice the width, are submitted at a time, since a submitted item may run
        to its end after an interrupt. Whoever stops iterating cancels those not yet begun.
        """
        ahead = ahead or (lambda: 2 * self.width())
        rest, waiting = iter(items), dict[Future[Any], Item]()
        try:
            while True:
                for item in islice(rest, max(0, ahead() - len(waiting))):
                    waiting[self.submit(work, item)] = item
                if not waiting:
                    return
                done, _ = wait(waiting, timeout=_BEAT, return_when=FIRST_COMPLETED)
                self.check()
                for future in done:
                    yield waiting.pop(future), future
        finally:
            for future in waiting:
                future.cancel()


PoolMaker = Callable[[], AbstractContextManager[Pool]]
"""Opens a pool; called again if the pool breaks."""


class _Threads(ThreadPoolExecutor):
    """Threads in which work sees the context variables of whoever submits it."""

    def submit(self, work: Callable[..., Any], /, *arguments: Any, **options: Any) -> Future[Any]:
        return super().submit(copy_context().run, work, *arguments, **options)


def thread_pool(count: int | None = None) -> PoolMaker:
    """Threads of this process, one per core by default; kernels release the GIL."""
    width = cores() if count is None else whole_number("threads", count, 1)

    @contextmanager
    def opened() -> Iterator[Pool]:
        with _Threads(width) as executor:
            yield Pool(executor, lambda: width, threads_per_item=lambda items: max(1, width // items))

    return opened


def process_pool(count: int) -> PoolMaker:
    """Processes on this machine; if one dies, only its work item has to be computed again."""
    width = whole_number("processes", count, 1)

    @contextmanager
    def opened() -> Iterator[Pool]:
        context = get_context("spawn")
        with ProcessPoolExecutor(width, mp_context=context, initializer=_begin_worker) as executor:
            yield Pool(executor, lambda: width)

    return opened


def _begin_worker() -> None:
    """Ignore interrupts, which the parent process handles, and end with the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def choose(
    threads: int | None = None, processes: int | None = None, scheduler: str | None = None, cluster: str | None = None,
    jobs: int | None = None,
) -> PoolMaker:
    """The pool that at most one of these options asks for; by default threads, one per core.

    Raises
    ------
    InputError
        If several are given, or one is wrong.
    """
    options = {"--threads": threads, "--processes": processes, "--scheduler": scheduler, "--cluster": cluster}
    given = {name: value for name, value in options.items() if value is not None}
    if jobs is not None and cluster is None:
        raise InputError("--jobs", "must be left out without --cluster", jobs)
    if len(given) > 1:
        raise InputError(" and ".join(given), "must not be given together", list(given.values()))
    if cluster not in (None, "slurm"):
        raise InputError("--cluster", "must be slurm", cluster, "For others start a scheduler and give --scheduler.")
    if cluster is not None:
        return slurm_jobs(jobs or 1)
    if scheduler is not None:
        return dask_workers(scheduler)
    return process_pool(processes) if processes is not None else thread_pool(threads)


def dask_workers(address: str) -> PoolMaker:
    """The workers of a Dask scheduler, which see the store's folder under the same path."""
    _client(address).close()  # checked before any work

    @contextmanager
    def opened() -> Iterator[Pool]:
        with _client(address) as client:
            yield _dask_pool(client)

    return opened


def _client(address: str) -> Any:
    try:
        return _distributed().Client(address, timeout="10s", set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError("--scheduler", "must be a Dask scheduler that answers", address, f"{error}.") from None


_MEMORY = "2GB"


def slurm_jobs(jobs: int) -> PoolMaker:
    """Jobs of a Slurm cluster, one worker each."""
    _distributed()
    try:
        from dask_jobqueue import SLURMCluster
    except ImportError:
        raise _missing("dask-jobqueue") from None

    @contextmanager
    def opened() -> Iterator[Pool]:
        with SLURMCluster(**slurm_job()) as cluster:
            cluster.scale(jobs=jobs)
            with cluster.get_client() as client:
                yield _dask_pool(client)

    return opened


def slurm_job() -> dict[str, Any]:
    """A job is one worker with one core; all else comes from dask-jobqueue's own configuration files."""
    import dask

    return {"cores": 1, "processes": 1, "memory": dask.config.get("jobqueue.slurm.memory", None) or _MEMORY}


def _distributed() -> Any:
    try:
        import distributed
    except ImportError:
        raise _missing("distributed") from None
    return distributed


def _missing(package: str) -> InputError:
    return InputError("cluster", f"needs {package}", None, "Install it with: pip install 'gearchaos[cluster]'.")


def _dask_pool(client: Any) -> Pool:
    def width() -> int:
        try:
            return max(1, sum(client.nthreads().values()))
        except OSError as error:
            raise PoolLostError(f"the Dask scheduler is gone. {KEPT}") from error

    def check() -> None:
        if client.status != "running":
            raise PoolLostError(f"the Dask scheduler is gone. {KEPT}")

    return Pool(client.get_executor(pure=False), width, check)
