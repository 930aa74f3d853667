"""Pools of workers with one interface: threads, processes, the workers of a Dask scheduler, Slurm jobs."""

from __future__ import annotations

import logging
import os
import shutil
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from contextvars import copy_context
from multiprocessing import get_all_start_methods, get_context
from typing import Any

from gearchaos.errors import InputError, missing_package, whole_number
from gearchaos.execute.machine import cores
from gearchaos.execute.pool import CHECK_INTERVAL, RESUME_ADVICE, Pool, PoolLostError
from gearchaos.processes import end_with_parent

PoolFactory = Callable[[], AbstractContextManager[Pool]]  # opens a pool; called again if the pool breaks


class _Threads(ThreadPoolExecutor):
    """Threads in which work runs with the context variables of the thread that submits it."""

    def submit(self, work: Callable[..., Any], /, *arguments: Any, **options: Any) -> Any:
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
        context = get_context("forkserver" if "forkserver" in get_all_start_methods() else "spawn")
        context.set_forkserver_preload(["gearchaos.execute.forkserver", "__main__", *modules])
        with ProcessPoolExecutor(
                workers, mp_context=context, initializer=_begin_worker, initargs=(dict(os.environ),)) as executor:
            yield Pool(executor, lambda: workers)

    return opened


def _begin_worker(environment: dict[str, str]) -> None:
    """Exit when the parent process does, which handles interrupts.

    A forked worker has the environment that the parent had when it began to fork, so the present one is given.
    """
    os.environ.update(environment)
    end_with_parent()


def pool_from_options(
    threads: int | None = None, processes: int | None = None, scheduler: str | None = None, cluster: str | None = None,
    jobs: int | None = None, workers: int | None = None, modules: Sequence[str] = (),
) -> PoolFactory:
    """The pool that the options of a command select, of which at most one may be given; by default one thread per core.

    ``modules`` are those that the work items need; see `process_pool`.
    """
    given = {name: value for name, value in {"threads": threads, "processes": processes, "workers": workers,
                                             "scheduler": scheduler, "cluster": cluster}.items() if value is not None}
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
    if workers is not None:
        return local_cluster(workers)
    return process_pool(processes, modules) if processes is not None else thread_pool(threads)


def dask_workers(address: str) -> PoolFactory:
    """The workers of a Dask scheduler; the folder of the store must have the same path on all of them."""
    distributed = _distributed()

    def client() -> Any:
        try:
            return distributed.Client(address, timeout="10s", set_as_default=False)
        except (OSError, ValueError) as error:
            raise InputError("scheduler", "must be a Dask scheduler that answers", address, f"{error}.") from None

    @contextmanager
    def opened() -> Iterator[Pool]:
        # when a scheduler is gone Dask prints what it meets; the run ends with one message
        loggers = map(logging.getLogger, ("distributed.client", "tornado.application"))
        levels = {logger: logger.level for logger in loggers}
        for logger in levels:
            logger.setLevel(logging.CRITICAL)
        try:
            with client() as reached:
                yield _dask_pool(reached)
        finally:
            for logger, level in levels.items():
                logger.setLevel(level)

    client().close()  # checked before any work
    return opened


def local_cluster(count: int) -> PoolFactory:
    """The workers of a Dask scheduler of this process, which restarts those that die."""
    workers, distributed = whole_number("workers", count, 1), _distributed()

    @contextmanager
    def opened() -> Iterator[Pool]:
        with (distributed.LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None,
                                       silence_logs=logging.CRITICAL) as cluster,
              cluster.get_client() as client):
            yield _dask_pool(client)

    return opened


def slurm_jobs(jobs: int) -> PoolFactory:
    """Jobs of a Slurm cluster, with one worker each; raises `InputError` where no job can be submitted."""
    _distributed()
    try:
        from dask_jobqueue import SLURMCluster
    except ImportError:
        raise missing_package("cluster", "dask-jobqueue", "cluster") from None
    if shutil.which("sbatch") is None:  # otherwise the store is made before the first job cannot be submitted
        raise InputError("cluster", "needs the command sbatch", "no such command",
                         "Run it on a machine that submits jobs of Slurm, or leave out --cluster and --jobs.")

    @contextmanager
    def opened() -> Iterator[Pool]:
        with SLURMCluster(**slurm_job()) as cluster:
            cluster.scale(jobs=jobs)
            with cluster.get_client() as client:
                yield _dask_pool(client)

    return opened


def slurm_job() -> dict[str, Any]:
    """Arguments of `SLURMCluster`: one worker with one core per job, with 2 GB where dask-jobqueue's configuration,
    which sets the others, does not say its memory."""
    import dask

    return {"cores": 1, "processes": 1, "memory": dask.config.get("jobqueue.slurm.memory", None) or "2GB"}


def _distributed() -> Any:
    """The package distributed; raises `InputError` if it is not installed."""
    try:
        import distributed
    except ImportError:
        raise missing_package("cluster", "distributed", "cluster") from None
    return distributed


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

    return Pool(client.get_executor(pure=False, retries=2), workers, check)
