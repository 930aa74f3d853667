"""Running a study: in memory, or into a store, in which a run continues where an earlier one stopped."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Future
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import overload

import xarray as xr

from gearchaos.errors import InputError, whole_number
from gearchaos.execute import pools
from gearchaos.execute.progress import bar
from gearchaos.store.arrays import add_results, check_layout
from gearchaos.store.create import create, repair, versions
from gearchaos.store.folder import Folder, open_folder
from gearchaos.store.journal import Begin, Ended, Failed, Journal, TileEntry
from gearchaos.store.machine import process_name
from gearchaos.store.missing import missing_parts, recovery
from gearchaos.store.progress import Progress
from gearchaos.store.record import differences, study_differences
from gearchaos.store.segments import SEGMENTS
from gearchaos.store.store import FINISHED, Store, open_store
from gearchaos.store.tiles import divide
from gearchaos.store.worker import compute_tile, pack_group
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
    folder, shard = open_folder(os.path.abspath(path)), shard or Shard()
    store = _opened(study, folder, tile, say, progress)
    own_tiles = shard.tiles(store.grid.count)
    with write_lock(folder, shard):
        found, journal = store.progress(), Journal(folder, shard.name)
        journal.append(Begin(process_name(), versions(study)))
        _repair(store, found, journal, say)
        _compute(store, own_tiles, pool or pools.thread_pool(), progress, found, journal)
        _pack(store, found, journal)
        if found.all_done and not found.complete_groups():
            _finish(store, progress)
        journal.append(Ended())
    found.refresh()
    return Outcome(found.done_count, dict(sorted(found.failed.items())), store.grid.count)


def _opened(study: Study, folder: Folder, tile: int | None, say: Callable[[str], None], progress: bool) -> Store:
    """The store in this folder, created if it does not exist; tells the user how long the rest may take."""
    if not folder.exists():
        study.cost.announce(progress)
        if create(folder, study, divide(study, tile)):
            return open_store(folder.url)
    store = open_store(folder.url)
    check_layout(store)
    differing = study_differences(store.study, study)
    if differing:
        raise InputError("store", "must hold the same study", str(folder), "; ".join(differing) + ".")
    found = store.progress()
    study.cost.announce(progress and not found.all_done)
    say(f"{os.path.basename(folder.url)}: {found.done_count} of {store.grid.count} tiles are done already")
    for line in differences(store.versions, versions(study)):
        say(f"warning: the store was begun with other versions, {line}; results may differ in the last digits")
    if tile is not None and divide(study, tile).tile != store.grid.tile:
        say(f"the store's own tiles of {' x '.join(map(str, store.grid.tile))} are kept")
    return store


def _repair(store: Store, found: Progress, journal: Journal, say: Callable[[str], None]) -> None:
    """Write damaged files of the store again, and note which results are lost, so that they are computed again."""
    with store.folder.lock("run/finish.lock", -1):
        damaged_files = store.damaged_files()
        if damaged_files:
            say(f"damaged files of the store are written anew: {', '.join(damaged_files)}")
            repair(store)
    missing = missing_parts(store, found)
    if missing.files:
        say(f"files with results are missing or cut short: {', '.join(missing.files[:10])}")
        store.folder.delete(FINISHED)
    for lines in recovery(store, found, missing):
        journal.append(*lines)
    found.refresh()


def _compute(
    store: Store, own_tiles: range, pool: pools.PoolFactory, progress: bool, found: Progress, journal: Journal
) -> None:
    """Compute these tiles in parallel, then those that failed one at a time, so that only a faulty one fails again."""
    size, errors = store.grid.size, dict[int, str]()
    todo = found.missing(own_tiles)
    total = sum(map(size, own_tiles))
    with bar("work items" if progress else None, total, total - sum(map(size, todo))) as advance:
        for attempt in range(1, ATTEMPTS + 1):
            errors = _attempt(store, todo, pool, attempt, advance, journal)
            todo = sorted(errors)
    for number, error in errors.items():
        journal.append(Failed(number, error, ATTEMPTS, process_name()))
    found.refresh()


def _pack(store: Store, found: Progress, journal: Journal) -> None:
    """Pack the groups of which all tiles are done."""
    for group in found.complete_groups():
        entries = [found.entries[tile] for tile in store.grid.tiles_of(group)]
        journal.append(pack_group(store.folder.url, group, entries))
    found.refresh()


def _finish(store: Store, progress: bool) -> None:
    """Complete the Dataset when all groups are packed, and remove what is not needed any more."""
    with store.folder.lock("run/finish.lock", -1):
        if store.finished:
            return
        for name, _ in list(store.folder.list()):
            if name.endswith(".partial"):
                store.folder.delete(name)
        if not store.study.gridded:
            add_results(store.study.finish(store.results(), progress=progress), store.folder)
        store.write_checksums()
        store.folder.write(FINISHED, b"")
        store.folder.delete_tree(SEGMENTS)


def _attempt(
    store: Store, todo: list[int], pool: pools.PoolFactory, attempt: int, advance: Callable[[int], None],
    journal: Journal,
) -> dict[int, str]:
    """Try each of these tiles once, with a new pool if one breaks; returns the errors of those that failed."""
    errors, left = dict[int, str](), list(todo)
    while left:
        done = set[int]()
        with pool() as workers, suppress(BrokenExecutor):
            work = partial(compute_tile, store.folder.url, attempt, workers.threads_per_item(len(left)))
            for number, future in workers.results(work, left, None if attempt == 1 else lambda: 1):
                error = _error(future)
                done.add(number)
                if error is None:
                    journal.append(future.result())
                    advance(store.grid.size(number))
                else:
                    errors[number] = error
        left = [n for n in left if n not in done]
    return errors


def _error(future: Future[TileEntry | str]) -> str | None:
    """The error of a tile as text, None if it has none; raises an error that concerns all tiles."""
    error = None if future.cancelled() else future.exception()
    if future.cancelled() or pools.connection_lost(error):
        raise pools.PoolLostError(f"the cluster is gone. {pools.RESUME_ADVICE}")
    if isinstance(error, BrokenExecutor):
        return "the process that computed it died"
    if isinstance(error, OSError):
        raise OSError(f"{error}. {pools.RESUME_ADVICE}") from None
    result = future.result() if error is None else f"{type(error).__name__}: {error}"
    return result if isinstance(result, str) else None
