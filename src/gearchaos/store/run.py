"""Running a study: in memory, or into a store, in which a run continues where an earlier one stopped."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Future
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path
from typing import overload

import xarray as xr
from filelock import FileLock

from gearchaos.errors import InputError, whole_number
from gearchaos.execute import pools
from gearchaos.execute.progress import bar
from gearchaos.store.create import create, repair, versions
from gearchaos.store.machine import process_name
from gearchaos.store.record import differences, study_differences
from gearchaos.store.store import Store, TileStatus, open_store
from gearchaos.store.tiles import divide
from gearchaos.store.writers import Shard, write_lock
from gearchaos.studies.registry import STUDIES
from gearchaos.studies.study import Study

ATTEMPTS = 3
"""Number of attempts at a tile before it is reported as failed."""


@dataclass(frozen=True)
class Outcome:
    """The result of a run into a store.

    Attributes
    ----------
    done : int
        Number of tiles of the store that are done.
    failed : dict of int to str
        The errors of the tiles that failed, by number of the tile.
    count : int
        Number of all tiles of the store.

    Examples
    --------
    >>> import gearchaos as gc
    >>> from tempfile import TemporaryDirectory
    >>> study = gc.Zones(gc.MeshModel.of(q0=0.1), "omega=0.9:1.1:4", "eps1=0.1:0.2:4")
    >>> with TemporaryDirectory() as folder:
    ...     gc.run(study, out=f"{folder}/zones.zarr", tile=8).failed
    {}
    """

    done: int
    failed: dict[int, str]
    count: int


@overload
def run(study: Study, out: None = None, *, threads: int | None = None, progress: bool = False) -> xr.Dataset: ...


@overload
def run(
    study: Study, out: str | os.PathLike[str], *, threads: int | None = None, processes: int | None = None,
    scheduler: str | None = None, cluster: str | None = None, jobs: int | None = None, tile: int | None = None,
    shard: str | None = None, progress: bool = False,
) -> Outcome: ...


def run(
    study: Study, out: str | os.PathLike[str] | None = None, *, threads: int | None = None,
    processes: int | None = None, scheduler: str | None = None, cluster: str | None = None, jobs: int | None = None,
    tile: int | None = None, shard: str | None = None, progress: bool = False,
) -> xr.Dataset | Outcome:
    """Compute any study, in memory or into a store.

    Parameters
    ----------
    study : Study
        `Simulate`, `Regime`, `Attractors`, `Bifurcation`, `Zones` or `Basins`.
    out : path, optional
        Folder of a store: a new one, or one in which an earlier run of the same study stopped. Without it the study is
        computed in memory.
    threads, processes : int, optional
        Number of threads, or with ``out`` of processes instead; one thread per core by default. Each computes a part of
        the study, with ``out`` a tile, at a time. A script that uses processes needs ``if __name__ == "__main__":``
        around what it does, since every process imports the script.
    scheduler, cluster, jobs
        With ``out``: the address of a Dask scheduler, or ``"slurm"`` and a number of jobs.
    tile : int, optional
        With ``out``: largest number of work items (cells, columns, initial values) in a tile, for a new store.
    shard : str, optional
        With ``out``: "2/3" computes only every third tile from the second; other processes compute "1/3" and "3/3".
    progress : bool
        Show progress bars and messages on stderr.

    Returns
    -------
    xarray.Dataset or Outcome
        The result; with ``out`` which tiles are done and failed. `xarray.open_zarr` opens the store.

    Raises
    ------
    InputError
        If an option is wrong, or if the folder is not a store, has another study or has another writer.
    OSError
        If the store cannot be written to, or the connection to the workers is lost; tiles that are done are kept.

    Examples
    --------
    >>> import gearchaos as gc
    >>> study = gc.Zones(gc.MeshModel.of(q0=0.1), "omega=0.9:1.1:4", "eps1=0.1:0.2:4")
    >>> gc.run(study).label.shape
    (4, 4)
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     outcome = gc.run(study, out=f"{folder}/zones.zarr", tile=8)
    >>> outcome.done, outcome.count
    (2, 2)
    """
    if not isinstance(study, Study):
        raise InputError("study", "must be a study", f"a {type(study).__name__}", "E.g. gearchaos.Zones(model, x, y).")
    store_options = {"processes": processes, "scheduler": scheduler, "cluster": cluster, "jobs": jobs,
                     "tile": tile, "shard": shard}
    if out is None:
        for name, value in store_options.items():
            if value is not None:
                raise InputError(name, "needs out, the folder of a store", value, "E.g. out='map.zarr'.")
        return study.run(progress=progress, threads=threads)
    if not isinstance(out, (str, os.PathLike)):
        raise InputError("out", "must be a path", out, "E.g. out='map.zarr'.")
    if shard is not None and not isinstance(shard, str):
        raise InputError("shard", "must be a text", shard, "E.g. shard='2/3'.")
    return run_into_store(
        study, out, tile=tile, pool=pools.pool_from_options(threads, processes, scheduler, cluster, jobs),
        shard=None if shard is None else Shard.parse(shard), say=_say if progress else _silent, progress=progress,
    )


def _say(line: str) -> None:
    """Print a line on stderr."""
    print(line, file=sys.stderr, flush=True)


def _silent(_: str) -> None:
    pass


def run_into_store(
    study: Study, path: str | os.PathLike[str], *, tile: int | None = None, pool: pools.PoolFactory | None = None,
    shard: Shard | None = None, say: Callable[[str], None] = _silent, progress: bool = False,
) -> Outcome:
    """Compute a study into a store, or resume it.

    Parameters
    ----------
    study : Study
    path : path
        The folder of the store, created if it does not exist.
    tile : int, optional
        Largest number of work items in a tile; for a new store only.
    pool : PoolFactory, optional
        Threads of this process by default; see `gearchaos.execute.pools`.
    shard : Shard, optional
        Compute only these tiles; other processes or machines compute the others into the same store.
    say : callable
        Called with each line of text for the user.
    progress : bool
        Show a progress bar on stderr.

    Raises
    ------
    InputError
        If the folder is not a store, has another study, or has another writer.
    OSError
        If the store cannot be written to, or the connection to the workers is lost; tiles that are done are kept.
    """
    if type(study) is not STUDIES.get(study.kind):
        raise InputError("study", "must be of a kind that gearchaos.studies.registry names",
                         f"a {type(study).__name__}", "A store records the kind; compute this one in memory.")
    tile = None if tile is None else whole_number("tile", tile, 1)
    store, shard = _opened(study, Path(path).absolute(), tile, say, progress), shard or Shard()
    own_tiles = shard.tiles(store.grid.count)
    with write_lock(store.path / "run" / "writers", shard):
        _repair(store, own_tiles, say)
        _compute(store, own_tiles, pool or pools.thread_pool(), progress)
        if store.all_tiles_done:
            store.finish(progress=progress)
    statuses = store.statuses()
    failed = {n: s.error or "" for n, s in sorted(statuses.items()) if not s.done}
    return Outcome(sum(s.done for s in statuses.values()), failed, store.grid.count)


def _opened(study: Study, path: Path, tile: int | None, say: Callable[[str], None], progress: bool) -> Store:
    """The store at this path, created if it does not exist; tells the user how long the rest may take."""
    if path.is_symlink() and not path.exists():
        raise InputError("out", "must not be a link to nothing", str(path), "Remove it, or make what it points to.")
    if not path.exists():
        try:
            study.cost.announce(progress)
            return create(path, study, divide(study, tile))
        except OSError:
            if not path.exists():  # otherwise another shard has created it meanwhile
                raise
    store = open_store(path)
    differing = study_differences(store.study, study)
    if differing:
        raise InputError("store", "must hold the same study", str(path), "; ".join(differing) + ".")
    done = sum(s.done for s in store.statuses().values())
    study.cost.announce(progress and not store.all_tiles_done)
    say(f"{path.name}: {done} of {store.grid.count} tiles are done already")
    for line in differences(store.versions, versions(study)):
        say(f"warning: the store was begun with other versions, {line}; results may differ in the last digits")
    if tile is not None and divide(study, tile) != store.grid:
        say(f"the store's own tiles of {' x '.join(map(str, store.grid.tile))} are kept")
    return store


def _repair(store: Store, own_tiles: range, say: Callable[[str], None]) -> None:
    """Write damaged files of the store again, and clear the status of those of these tiles whose data are damaged."""
    with FileLock(store.path / "run" / "finish.lock"):
        damaged_files = store.damaged_files()
        if damaged_files:
            say(f"damaged files of the store are written anew: {', '.join(damaged_files)}")
            repair(store)
    damaged = store.damaged_tiles(own_tiles)
    for number in damaged:
        store.clear_status(number)
    if damaged:
        say(f"damaged tiles are computed again: {', '.join(map(str, damaged))}")
        (store.path / "run" / "finished").unlink(missing_ok=True)


def _compute(store: Store, own_tiles: range, pool: pools.PoolFactory, progress: bool) -> None:
    """Compute these tiles in parallel, then those that failed one at a time, so that only a faulty one fails again."""
    statuses, size = store.statuses(), store.grid.size
    todo, errors = [n for n in own_tiles if not (n in statuses and statuses[n].done)], dict[int, str]()
    total = sum(map(size, own_tiles))
    with bar("work items" if progress else None, total, total - sum(map(size, todo))) as advance:
        for attempt in range(1, ATTEMPTS + 1):
            errors = _attempt(store, todo, pool, attempt, advance)
            todo = sorted(errors)
    for number, error in errors.items():
        store.set_status(number, TileStatus(False, 0.0, process_name(), ATTEMPTS, error))


def _attempt(
    store: Store, todo: list[int], pool: pools.PoolFactory, attempt: int, advance: Callable[[int], None]
) -> dict[int, str]:
    """Try each of these tiles once, with a new pool if one breaks; returns the errors of those that failed."""
    errors, left = dict[int, str](), list(todo)
    while left:
        done = set[int]()
        with pool() as workers, suppress(BrokenExecutor):
            work = partial(compute_tile, str(store.path), attempt, workers.threads_per_item(len(left)))
            for number, future in workers.results(work, left, None if attempt == 1 else lambda: 1):
                error = _error(future)
                done.add(number)
                if error is None:
                    advance(store.grid.size(number))
                else:
                    errors[number] = error
        left = [n for n in left if n not in done]
    return errors


def _error(future: Future[str | None]) -> str | None:
    """The error of a tile as text, None if it has none; raises an error that concerns all tiles."""
    error = None if future.cancelled() else future.exception()
    if future.cancelled() or pools.connection_lost(error):
        raise pools.PoolLostError(f"the cluster is gone. {pools.RESUME_ADVICE}")
    if isinstance(error, BrokenExecutor):
        return "the process that computed it died"
    if isinstance(error, OSError):
        raise OSError(f"{error}. {pools.RESUME_ADVICE}") from None
    return future.result() if error is None else _text(error)


def _text(error: BaseException) -> str:
    """Type and message of an error."""
    return f"{type(error).__name__}: {error}"


def compute_tile(path: str, attempt: int, threads: int, number: int) -> str | None:
    """Compute a tile of the store at this path, in some number of threads, and write it.

    Returns the error of the tile as text, None if it has none; raises OSError if the store cannot be written to.
    """
    modified = (Path(path) / "run" / "study.json").stat().st_mtime_ns
    store, started = _cached_store(path, modified), time.perf_counter()
    try:
        results = store.study.compute(store.grid.items(number), threads=threads)
    except Exception as error:  # the failure of one tile must not stop the others
        return _text(error)
    try:
        store.write(number, results)
        store.set_status(number, TileStatus(True, time.perf_counter() - started, process_name(), attempt))
    except OSError as error:
        raise OSError(f"the store cannot be written to: {error}") from None
    return None


@lru_cache(maxsize=4)
def _cached_store(path: str, modified: int) -> Store:
    """The store at this path, opened once per process as long as ``run/study.json`` is not modified."""
    return open_store(Path(path))
