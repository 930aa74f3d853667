"""Running a study: in memory, or into a store, in which a run continues where an earlier one stopped."""

from __future__ import annotations

import os
import sys
import time
from collections import Counter, deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from typing import Any, overload

import numpy as np
import xarray as xr

from gearchaos.errors import InputError, whole_number
from gearchaos.execute import pools
from gearchaos.execute.machine import cores
from gearchaos.execute.pool import RESUME_ADVICE, PoolLostError, connection_lost
from gearchaos.execute.progress import bar
from gearchaos.store.blocks import State, damaged_shards, tiles_there, work, write_tile
from gearchaos.store.check import missing as missing_results
from gearchaos.store.lock import Shard, write_lock
from gearchaos.store.objects import Objects
from gearchaos.store.read import results
from gearchaos.store.record import differences, to_record
from gearchaos.store.store import STUDY, ArraySpec, Store, create, open_store, versions, write_finished, write_metadata
from gearchaos.store.tiles import Grid, divide, with_blocks
from gearchaos.studies.core.price import announce
from gearchaos.studies.core.registry import STUDIES
from gearchaos.studies.core.study import Study

WORKER_MODULES = ("gearchaos.store.blocks",)  # what worker processes import; see `pools.process_pool`
ATTEMPTS = 3  # number of attempts at a tile before it is reported as failed
Task = tuple[str, int]  # a ("tile", number) to be computed, or a ("block", number) to be written


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
    workers: int | None = None, scheduler: str | None = None, cluster: str | None = None, jobs: int | None = None,
    tile: int | None = None, shard: str | None = None, progress: bool = False,
) -> Outcome: ...


def run(
    study: Study, out: str | os.PathLike[str] | None = None, *, threads: int | None = None,
    processes: int | None = None, workers: int | None = None, scheduler: str | None = None, cluster: str | None = None,
    jobs: int | None = None, tile: int | None = None, shard: str | None = None, progress: bool = False,
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
    workers : int, optional
        With ``out``: number of Dask workers on this machine, which are restarted if they die.
    scheduler, cluster, jobs
        With ``out``: the address of a Dask scheduler, or ``"slurm"`` and a number of jobs.
    tile : int, optional
        With ``out``: largest number of work items (cells, columns, initial values) in a tile, for a new store.
    shard : str, optional
        With ``out``: "2/3" computes only every third block of tiles from the second; other processes compute "1/3" and
        "3/3".
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
    store_options = {"processes": processes, "workers": workers, "scheduler": scheduler, "cluster": cluster,
                     "jobs": jobs, "tile": tile, "shard": shard}
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
        pool=pools.pool_from_options(threads, processes, scheduler, cluster, jobs, workers, WORKER_MODULES),
        shard=None if shard is None else Shard.parse(shard), progress=progress)


def _say(line: str, progress: bool) -> None:
    """Print a line on stderr, if progress is shown and stderr is not closed."""
    if progress and sys.stderr is not None:
        print(line, file=sys.stderr, flush=True)


def run_into_store(
    study: Study, path: str | os.PathLike[str], *, tile: int | None = None, pool: pools.PoolFactory | None = None,
    shard: Shard | None = None, progress: bool = False,
) -> Outcome:
    """Compute a study into a store, or resume it: `run` with ``out`` and a pool of workers, by default of threads."""
    if type(study) is not STUDIES.get(study.kind):
        raise InputError("study", "must be of a kind that gearchaos or an installed package offers",
                         f"a {type(study).__name__}", "A store records the kind; compute this one in memory, or offer "
                         "it: docs/howto/extend.md.")
    tile = None if tile is None else whole_number("tile", tile, 1)
    to_record(study)  # raises an error for what cannot be kept, before any work
    shard, objects = shard or Shard(), Objects(path)
    store = _opened(study, objects, tile, progress) if objects.exists() and objects.get(STUDY) is not None else None
    with write_lock(objects, shard):
        if store is None:
            objects.check_creatable()
            announce(study, progress)
            if objects.get(STUDY) is None:
                _create(study, objects, divide(study, tile), shard)
            store = _opened(study, objects, None, False)
        blocks = shard.blocks(store.grid)
        if not blocks:
            _say(f"{shard} has nothing to do: the store has {store.grid.block_count} blocks of tiles", progress)
        store, damaged = _verified(store, blocks, progress)
        return _write(store, blocks, damaged, shard.count, pool or pools.thread_pool(), progress)


def finish_store(path: str | os.PathLike[str], *, progress: bool = False) -> Outcome:
    """Finish a store of which all tiles are done: write the blocks that are not written, and complete the Dataset.

    Nothing is computed but tiles whose results are damaged or missing. If other tiles were never computed, nothing is
    changed, and the outcome says how many. Raises as `run`.
    """
    store = open_store(path)
    with write_lock(store.objects, Shard()):
        state, blocks = State.of(store), range(store.grid.block_count)
        if not store.finished and any(state.done(store, b) < store.grid.tile_count(b) for b in blocks):
            return _outcome(store, set(), {}, store.shards)
        store, damaged = _verified(store, blocks, progress)
        return _write(store, blocks, damaged, 1, pools.thread_pool(), progress)


def _opened(study: Study, objects: Objects, tile: int | None, progress: bool) -> Store:
    """The store at this location, which must hold the study; tells the user what is done, and the time it may take."""
    store = open_store(objects)
    if differing := differences(to_record(store.study), to_record(study)):
        raise InputError("store", "must hold the same study", str(objects), "; ".join(differing)
                         + ". Give another --out, or the values in the store.")
    if progress:
        done = sum(map(partial(State.of(store).done, store), range(store.grid.block_count)))
        announce(study, not done)
        _say(f"{objects}: {done} of {store.grid.count} tiles are done already", progress)
        for line in differences(store.versions, versions(study)):
            _say(f"warning: the store was begun with other versions, {line}; results may differ in the last digits",
                 progress)
        if tile is not None and divide(study, tile).tile != store.grid.tile:
            _say(f"the store's own tiles of {' x '.join(map(str, store.grid.tile))} are kept", progress)
    return store


def _create(study: Study, objects: Objects, tiles: Grid, shard: Shard) -> None:
    """Create a store. A study that is a single tile is computed first: the size of its results may not be known."""
    begun, error = time.perf_counter(), None
    single = [np.array([n]) for n in dict.fromkeys((0, study.count // 2, study.count - 1))]
    for items in [tiles.items(0)] if tiles.count == 1 else single:
        try:
            sample = study.compute(items)
            break
        except Exception as failure:  # one of the items may fail; the run will report its tile
            error = failure
    else:
        raise InputError("study", "must have work items that can be computed", type(error).__name__, f"{error}")
    arrays = {n: ArraySpec(v.dtype.str, v.shape[1:]) for n, v in sample.items()}
    sizes = [spec.item_bytes for spec in arrays.values()]
    grid = with_blocks(tiles, max(sizes), sum(sizes), shard.count)
    store = create(Store(objects, study, grid, arrays, versions(study), shard.count))
    if grid.count == 1:
        write_tile(store, 0, sample, time.perf_counter() - begun)


def _verified(store: Store, blocks: Iterable[int], progress: bool) -> tuple[Store, set[int]]:
    """Write damaged metadata again, and find the blocks, of these, of which results are missing or damaged."""
    files, state = store.damaged_files(), State.of(store)
    written = [block for block in blocks if block in state.blocks]
    if files:
        _say(f"damaged files of the store are written anew: {', '.join(files)}", progress)
        store = write_metadata(store, store.metadata())
    else:  # the run that wrote them may have been killed before they would survive a power failure
        store.objects.keep([*(store.files or {}), STUDY])
    with ThreadPoolExecutor(cores()) as threads:
        found = dict(zip(written, threads.map(partial(damaged_shards, store), written), strict=True))
    damaged = {block for block, names in found.items() if names}
    if damaged:
        names = [store.shard(name, block) for block in sorted(damaged) for name in found[block]]
        more = f" and {len(names) - 10} more" if len(names) > 10 else ""
        _say(f"results are missing or damaged, their blocks are computed again: {', '.join(names[:10])}{more}",
             progress)
    return store, damaged


def _write(
    store: Store, blocks: Iterable[int], damaged: set[int], division: int, pool: pools.PoolFactory, progress: bool
) -> Outcome:
    """Compute what is missing of these blocks, and finish the store if no other block is missing."""
    state = State.of(store)
    todo = {block: None for block in blocks if block in damaged or block not in state.blocks}
    if todo and store.finished:
        store = write_metadata(store, store.metadata())
    store.objects.delete([store.failed(tile) for tile in state.failed if store.grid.block_of(tile) in todo])
    remaining = sum(store.grid.tile_count(block) - len(state.tiles.get(block, ())) for block in todo)
    total = sum(map(store.grid.tile_count, blocks))
    with bar("tiles" if progress else None, total, total - remaining) as advance:
        failed = _compute(store, todo, remaining, pool, advance)
    for tile, error in failed.items():
        store.objects.put(store.failed(tile), error.encode())
    return _outcome(store, damaged if failed else set(), failed, division, progress)


def _compute(
    store: Store, blocks: Iterable[int], count: int, pool: pools.PoolFactory, advance: Callable[[int], None]
) -> dict[int, str]:
    """Compute the ``count`` missing tiles of blocks, and write each block when its last tile is done.

    Returns the errors of the tiles that failed. A tile that fails is tried again twice. If a worker process dies, the
    tiles that were being computed are tried again one by one at the end: any of them may be the cause.
    """
    left, attempts, failed = dict[int, int](), Counter[int](), dict[int, str]()
    rest, again, alone = _tasks(store, blocks, left), deque[Task](), deque[Task]()

    def take(task: Task, future: Future[Any], later: deque[Task]) -> None:
        """Note the result of a task, and what follows from it."""
        kind, number = task
        error, result = _result(future)
        if kind == "block" and not error:
            left[number] = len(result)  # tiles whose objects are damaged
            later.extend(("tile", tile) for tile in result)
            advance(-len(result))
        elif not error and not result:
            block = store.grid.block_of(number)
            left[block] -= 1
            advance(1)
            if not left[block]:
                later.append(("block", block))
        elif kind == "block":
            raise OSError(f"block {number} cannot be written: {error}. {RESUME_ADVICE}")
        else:
            attempts[number] += 1
            if attempts[number] < ATTEMPTS:
                later.append(task)
            else:
                failed[number] = error or result

    going = True
    while going:  # once more with a new pool if one breaks
        going = False
        with pool() as opened:
            do = partial(work, store.objects.url, opened.threads_per_item(max(1, count)))
            for task, future in opened.results(do, rest, again):
                if isinstance(future.exception() if not future.cancelled() else None, BrokenExecutor):
                    going = True
                    alone.append(task)
                else:
                    take(task, future, again)
        going = going or bool(again)
    while alone:
        with pool() as opened:
            do = partial(work, store.objects.url, opened.threads_per_item(1))
            for task, future in opened.results(do, [alone.popleft()]):
                take(task, future, alone)
    return dict(sorted(failed.items()))


def _tasks(store: Store, blocks: Iterable[int], left: dict[int, int]) -> Iterator[Task]:
    """The missing tiles of blocks, or the writing of those that have all; ``left`` counts the tiles of each."""
    for block in blocks:
        there = tiles_there(store, block)
        missing = [tile for tile in store.grid.tiles_of(block) if tile not in there]
        left[block] = len(missing)
        yield from [("tile", tile) for tile in missing] or [("block", block)]


def _result(future: Future[Any]) -> tuple[str, Any]:
    """The error of a task as text, and its result; raises an error that concerns all tasks."""
    error = None if future.cancelled() else future.exception()
    if future.cancelled() or connection_lost(error):
        raise PoolLostError(f"the cluster is gone. {RESUME_ADVICE}")
    if isinstance(error, BrokenExecutor):
        return "the process that computed it died", None
    if isinstance(error, OSError):
        raise OSError(f"the store cannot be written to: {error}. {RESUME_ADVICE}") from None
    return ("", future.result()) if error is None else (f"{type(error).__name__}: {error}", None)


def _outcome(
    store: Store, damaged: set[int], failed: dict[int, str], division: int, progress: bool = False
) -> Outcome:
    """What a run has done, after it has finished the store if all blocks are written and whole."""
    grid, state = store.grid, State.of(store)
    whole = not damaged and len(state.blocks) == grid.block_count
    if whole and not store.finished and (lost := missing_results(store).lost):  # perhaps of another shard
        damaged, whole = set(lost), False
    if whole and not store.finished:
        made = None if store.study.gridded else store.study.finish(results(store), progress=progress)
        write_finished(store, made)
        if division == 1:  # no shard is writing
            store.objects.delete(store.objects.names(partial=True))
    missing = Counter[int]()
    for block in range(grid.block_count):
        there = len(tiles_there(store, block)) if block in damaged else state.done(store, block)
        missing[block % division + 1] += grid.tile_count(block) - there
    by_shard = {f"{number}/{division}": n for number, n in sorted(missing.items()) if n}
    return Outcome(grid.count - missing.total(), failed, grid.count, whole, by_shard)
