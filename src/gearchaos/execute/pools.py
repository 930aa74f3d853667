"""Pools of workers with one interface: threads, processes, the workers of a Dask scheduler, Slurm jobs.

Work items are submitted one by one or as an iterable, and results are yielded as they complete. Items not yet begun are
cancelled when iteration stops. Work may be computed twice at the same time where a pool can stop the copy that is not
needed any more (`Pool.stop`).
"""

from __future__ import annotations

import os
import signal
import time
from collections import deque
from collections.abc import Callable, Container, Iterable, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from contextvars import copy_context
from dataclasses import dataclass
from itertools import islice, takewhile
from multiprocessing import get_all_start_methods, parent_process
from multiprocessing.context import ForkServerContext, SpawnContext
from queue import Empty, SimpleQueue
from threading import Thread
from typing import Any, Generic, TypeVar

from gearchaos.errors import InputError, whole_number
from gearchaos.execute.machine import cores

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
    """An open pool of workers.

    Attributes
    ----------
    executor : concurrent.futures.Executor
    workers : callable
        Function without arguments: the number of work items computed at once, which may change on a cluster.
    check : callable
        Function without arguments that raises `PoolLostError` if the workers cannot be reached any more.
    threads_per_item : callable
        Function from the number of remaining work items to the number of threads that each may use.
    stop : callable, optional
        Function without arguments that ends the pool without waiting for work that is being computed. None for the
        threads of this process, which cannot be stopped.
    """

    executor: Executor
    workers: Callable[[], int]
    check: Callable[[], None] = lambda: None
    threads_per_item: Callable[[int], int] = lambda items: 1
    stop: Callable[[], None] | None = None

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


PoolFactory = Callable[[], AbstractContextManager[Pool]]
"""Function that opens a pool; called again if the pool breaks."""


class _Threads(ThreadPoolExecutor):
    """Threads in which work runs with the context variables of the thread that submits it."""

    def submit(self, work: Callable[..., Any], /, *arguments: Any, **options: Any) -> Future[Any]:
        return super().submit(copy_context().run, work, *arguments, **options)


def thread_pool(count: int | None = None) -> PoolFactory:
    """Threads of this process, by default one per core, which run at the same time since kernels release the GIL."""
    workers = cores() if count is None else whole_number("threads", count, 1)

    @contextmanager
    def opened() -> Iterator[Pool]:
        with _Threads(workers) as executor:
            yield Pool(executor, lambda: workers, threads_per_item=lambda items: max(1, workers // items))

    return opened


def process_pool(count: int, modules: Sequence[str] = ()) -> PoolFactory:
    """Processes on this machine; if one dies, the futures of unfinished work items raise `BrokenExecutor`.

    The ``modules`` that the work items need are imported once, where the system can fork, and not by every process.
    """
    workers = whole_number("processes", count, 1)

    @contextmanager
    def opened() -> Iterator[Pool]:
        context, started = _recording_context(modules)
        executor = ProcessPoolExecutor(workers, mp_context=context, initializer=_begin_worker)

        def stop() -> None:
            executor.shutdown(wait=False, cancel_futures=True)
            for process in started:
                process.terminate()

        with executor:
            yield Pool(executor, lambda: workers, stop=stop)

    return opened


def _recording_context(modules: Sequence[str]) -> tuple[Any, list[Any]]:
    """A context of `multiprocessing`, and the list of the processes that are started with it, which fills itself."""
    started: list[Any] = []
    forking = "forkserver" in get_all_start_methods()
    parent: Any = ForkServerContext if forking else SpawnContext

    class Recording(parent):
        def Process(self, *arguments: Any, **options: Any) -> Any:
            started.append(parent.Process(*arguments, **options))
            return started[-1]

    context = Recording()
    if forking:
        context.set_forkserver_preload(["__main__", *modules])
    return context, started


def _begin_worker() -> None:
    """Ignore interrupts, which the parent process handles, and exit when the parent does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """Wait for the end of the parent process, then exit."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def pool_from_options(
    threads: int | None = None, processes: int | None = None, scheduler: str | None = None, cluster: str | None = None,
    jobs: int | None = None, modules: Sequence[str] = (),
) -> PoolFactory:
    """The pool that the options of a command select, of which at most one is given; by default one thread per core.

    ``modules`` are those that the work items need; see `process_pool`.

    Raises
    ------
    InputError
        If several are given, or one is wrong.
    """
    options = {"threads": threads, "processes": processes, "scheduler": scheduler, "cluster": cluster}
    given = {name: value for name, value in options.items() if value is not None}
    if jobs is not None and cluster is None:
        raise InputError("jobs", "must be left out without cluster", jobs)
    if len(given) > 1:
        raise InputError(" and ".join(given), "must not be given together", list(given.values()))
    if cluster not in (None, "slurm"):
        raise InputError("cluster", "must be slurm", cluster, "For others start a Dask scheduler and give its address.")
    if cluster is not None:
        return slurm_jobs(1 if jobs is None else whole_number("jobs", jobs, 1))
    if scheduler is not None:
        return dask_workers(scheduler)
    return process_pool(processes, modules) if processes is not None else thread_pool(threads)


def dask_workers(address: str) -> PoolFactory:
    """The workers of a Dask scheduler; the folder of the store must have the same path on all of them."""
    _client(address).close()  # checked before any work

    @contextmanager
    def opened() -> Iterator[Pool]:
        with _client(address) as client:
            yield _dask_pool(client)

    return opened


def _client(address: str) -> Any:
    """A client of the Dask scheduler at an address; raises `InputError` if it does not answer."""
    try:
        return _distributed().Client(address, timeout="10s", set_as_default=False)
    except (OSError, ValueError) as error:
        raise InputError("scheduler", "must be a Dask scheduler that answers", address, f"{error}.") from None


_MEMORY = "2GB"
"""Memory of a Slurm job where dask-jobqueue's configuration sets none."""


def slurm_jobs(jobs: int) -> PoolFactory:
    """Jobs of a Slurm cluster, with one worker each."""
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
    """Arguments of `SLURMCluster`: one worker with one core per job; dask-jobqueue's configuration sets the others."""
    import dask

    return {"cores": 1, "processes": 1, "memory": dask.config.get("jobqueue.slurm.memory", None) or _MEMORY}


def _distributed() -> Any:
    """The package distributed; raises `InputError` if it is not installed."""
    try:
        import distributed
    except ImportError:
        raise _missing("distributed") from None
    return distributed


def _missing(package: str) -> InputError:
    """The error that a package for clusters is not installed."""
    return InputError("cluster", f"needs {package}", None, "Install it with: pip install 'gearchaos[cluster]'.")


def _dask_pool(client: Any) -> Pool:
    """The pool of the workers that a Dask client reaches."""

    counted, count = -CHECK_INTERVAL, 1

    def workers() -> int:
        nonlocal counted, count
        if time.monotonic() - counted >= CHECK_INTERVAL:  # counting takes a message and time for each worker
            try:
                counted, count = time.monotonic(), max(1, sum(client.nthreads().values()))
            except OSError as error:
                raise PoolLostError(f"the Dask scheduler is gone. {RESUME_ADVICE}") from error
        return count

    def check() -> None:
        if client.status != "running":
            raise PoolLostError(f"the Dask scheduler is gone. {RESUME_ADVICE}")

    return Pool(client.get_executor(pure=False), workers, check, stop=lambda: None)  # closing the client waits for none
