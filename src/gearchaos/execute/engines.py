"""Where tiles are computed: in threads, in processes, or on a Dask cluster. All of them are executors to the run."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from multiprocessing import get_context, parent_process
from threading import Thread
from typing import Any

from gearchaos.errors import InputError, whole_number
from gearchaos.execute.tiles import cores

KEPT = "What is done is kept; the same command goes on from there."


class EngineLostError(OSError):
    """The engine is gone, and with it the tiles under way."""


def cut_off(error: BaseException | None) -> bool:
    """Whether a tile's error only says that its engine cannot be reached any more; Dask's own error is known by name,
    since Dask may not be installed."""
    return isinstance(error, ConnectionError) or type(error).__name__ == "CommClosedError"


@dataclass(frozen=True)
class Pool:
    """An open engine: an executor, how many tiles it computes at once, a check that it is still there, and how many
    threads each of so many tiles may use."""

    executor: Executor
    width: Callable[[], int]
    beat: Callable[[], None] = lambda: None
    share: Callable[[int], int] = lambda tiles: 1


Engine = Callable[[], AbstractContextManager[Pool]]
"""Opens a pool; opened anew if the pool breaks."""


def threads(count: int | None = None) -> Engine:
    """Threads of this process, one per core by default; kernels run without the GIL."""
    width = cores() if count is None else whole_number("threads", count, 1)

    @contextmanager
    def opened() -> Iterator[Pool]:
        with ThreadPoolExecutor(width) as executor:
            yield Pool(executor, lambda: width, share=lambda tiles: max(1, width // tiles))

    return opened


def processes(count: int) -> Engine:
    """Processes on this machine; one that dies takes nothing but its tile with it."""
    width = whole_number("processes", count, 1)

    @contextmanager
    def opened() -> Iterator[Pool]:
        context = get_context("spawn")
        with ProcessPoolExecutor(width, mp_context=context, initializer=_begin_worker) as executor:
            yield Pool(executor, lambda: width)

    return opened


def _begin_worker() -> None:
    """Leave interrupts to the run, which decides what becomes of its tiles; and do not outlive it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def scheduler(address: str) -> Engine:
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


def slurm(jobs: int) -> Engine:
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
            raise EngineLostError(f"the Dask scheduler is gone. {KEPT}") from error

    def beat() -> None:
        if client.status != "running":
            raise EngineLostError(f"the Dask scheduler is gone. {KEPT}")

    return Pool(client.get_executor(pure=False), width, beat)
