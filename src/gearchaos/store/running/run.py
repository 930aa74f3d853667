"""Running a study: in memory, or into a store, in which a run continues where an earlier one stopped."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import overload

import xarray as xr

from gearchaos.errors import InputError, whole_number
from gearchaos.execute import pools
from gearchaos.execute.progress import bar
from gearchaos.store.files.folder import Folder, open_folder
from gearchaos.store.journals.journal import Begin, Ended, Journal
from gearchaos.store.journals.progress import Progress
from gearchaos.store.machine import process_name
from gearchaos.store.reading.missing import missing_parts, recovery
from gearchaos.store.record import differences, study_differences
from gearchaos.store.running.coordinator import Coordinator
from gearchaos.store.running.create import create, repair, versions
from gearchaos.store.running.finish import finish_lock, wait_and_finish
from gearchaos.store.running.sources import Listed, Others, Own
from gearchaos.store.store import FINISHED, Store, open_store
from gearchaos.store.tiles import divide
from gearchaos.store.writers.claims import Claims
from gearchaos.store.writers.locks import NO_LOCKS, write_lock
from gearchaos.store.writers.shards import Shard, latest_division, missing_by_shard
from gearchaos.studies.registry import STUDIES
from gearchaos.studies.study import Study

WORKER_MODULES = ("gearchaos.store.running.worker",)
"""What worker processes import; see `pools.process_pool`."""


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
    finished : bool
        Whether the store is complete. A shard that is not the last one to end leaves it unfinished.
    missing : dict of str to int
        Number of the tiles that are not done by shard, e.g. {"3/4": 20}; "1/1" for a run that is not divided.

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
    finished: bool
    missing: dict[str, int]


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
        A class of a study, such as `Zones`.
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
        study, out, tile=tile,
        pool=pools.pool_from_options(threads, processes, scheduler, cluster, jobs, WORKER_MODULES),
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
    folder, shard = open_folder(path), shard or Shard()
    store, found = _opened(study, folder, tile, say, progress)
    with write_lock(folder, shard) as locks:
        if not locks:
            say(NO_LOCKS)
        found.refresh()
        finished = _write(store, found, shard, pool or pools.thread_pool(), locks, say, progress)
    return _outcome(store, found, finished, shard.count)


def finish_store(
    path: str | os.PathLike[str], *, say: Callable[[str], None] = _silent, progress: bool = False
) -> Outcome:
    """Finish a store of which all tiles are done: pack what is not packed, and complete the Dataset.

    Nothing is computed but tiles whose results are damaged or of which a file is missing. If other tiles are not done,
    nothing is changed, and the outcome says how many.

    Raises
    ------
    InputError
        If the folder is not a store, or has a writer.
    OSError
        If the store cannot be written to.
    """
    folder = open_folder(path)
    store = open_store(folder.url)
    found = store.progress()
    division = latest_division((name, state.begun) for name, state in found.writers.items())
    with write_lock(folder, Shard()) as locks:
        found.refresh()
        finished = found.all_done and _write(store, found, Shard(), pools.thread_pool(), locks, say, progress)
    return _outcome(store, found, finished, division)


def _outcome(store: Store, found: Progress, finished: bool, division: int) -> Outcome:
    """What a run has done, with the tiles that are missing by shards of which there are ``division``."""
    missing = {} if finished else missing_by_shard(store.grid, found, division)
    return Outcome(found.done_count, dict(sorted(found.failed.items())), store.grid.count, finished, missing)


def _write(
    store: Store, found: Progress, shard: Shard, pool: pools.PoolFactory, locks: bool, say: Callable[[str], None],
    progress: bool,
) -> bool:
    """Compute the tiles of a shard, help the others, and finish the store if all are done; whether it is finished."""
    journal = Journal(store.folder, shard.name)
    own = list(shard.tiles(store.grid))
    with bar("tiles" if progress else None, store.grid.count, found.done_count) as advance:
        coordinator = Coordinator(store, found, journal, shard, pool, advance)
        coordinator.record(Begin(process_name(), versions(store.study)))
        damaged = _repair(coordinator, set(own), locks, say)
        _compute(coordinator, own, locks)
        finished = wait_and_finish(coordinator, locks=locks, verify=damaged, progress=progress)
    coordinator.record(Ended())
    return finished


def _compute(coordinator: Coordinator, own: list[int], locks: bool) -> None:
    """Compute the tiles of a shard, then those that other shards have not done."""
    store, found, shard = coordinator.store, coordinator.progress, coordinator.shard
    if shard.count == 1:
        coordinator.compute(Listed(found.missing(own)))
        return
    claims = Claims(store.folder, shard.name)
    coordinator.compute(Own(found.missing(own), found, shard, claims))
    if locks and claims.possible:
        coordinator.compute(Others(store.folder, store.grid, found, shard))


def _opened(
    study: Study, folder: Folder, tile: int | None, say: Callable[[str], None], progress: bool
) -> tuple[Store, Progress]:
    """The store in this folder, created if it does not exist, and what is done; tells the user of the time it takes."""
    if not folder.exists():
        study.cost.announce(progress)
        if create(folder, study, divide(study, tile)):
            store = open_store(folder.url)
            return store, store.progress()
    store = open_store(folder.url)
    differing = study_differences(store.study, study)
    if differing:
        raise InputError("store", "must hold the same study", str(folder), "; ".join(differing) + ".")
    found = store.progress()
    study.cost.announce(progress and not found.all_done)
    lost = sum(map(found.done, missing_parts(store, found).tiles))
    again = f", of which {lost} are computed again since files are missing or damaged" if lost else ""
    say(f"{folder}: {found.done_count} of {store.grid.count} tiles are done already{again}")
    for line in differences(store.versions, versions(study)):
        say(f"warning: the store was begun with other versions, {line}; results may differ in the last digits")
    if tile is not None and divide(study, tile).tile != store.grid.tile:
        say(f"the store's own tiles of {' x '.join(map(str, store.grid.tile))} are kept")
    return store, found


def _repair(coordinator: Coordinator, own: set[int], locks: bool, say: Callable[[str], None]) -> bool:
    """Write damaged files of the store again, and note which results of a shard are lost, to be computed again.

    Returns whether any results of the store are lost: other shards repair theirs.
    """
    store, found, shard = coordinator.store, coordinator.progress, coordinator.shard
    with finish_lock(store, locks):
        damaged_files = store.damaged_files()
        if damaged_files:
            say(f"damaged files of the store are written anew: {', '.join(damaged_files)}")
            repair(store)
        damaged = coordinator.finished_with_losses()
        missing = missing_parts(store, found)
        if missing.files:
            say(f"files with results are missing or cut short: {', '.join(missing.files[:10])}")
        if damaged:
            store.folder.delete(FINISHED)
    mine = replace(
        missing, records=[tile for tile in missing.records if tile in own],
        groups=[group for group in missing.groups if shard.packs(group)],
    )
    for lines in recovery(store, found, mine):
        coordinator.record(*lines)
    return bool(missing.files)
