"""Computing a study into a store: what is not there yet, whatever happened before."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Future
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path

from filelock import FileLock

from gearchaos.errors import InputError
from gearchaos.execute import engines, tiles
from gearchaos.store.create import create, mend, versions
from gearchaos.store.machine import name
from gearchaos.store.resolved import Resolved, differences
from gearchaos.store.store import Mark, Store, read
from gearchaos.store.tiles import cut
from gearchaos.store.writers import Shard, writing

ATTEMPTS = 3
"""So often a tile is tried before it is reported as failed."""


@dataclass(frozen=True)
class Outcome:
    """How a run ended: tiles of the store that are done, that failed (with errors), and how many there are."""

    done: int
    failed: dict[int, str]
    count: int


def run(
    study: Resolved, path: Path, *, tile: int | None = None, engine: engines.Engine | None = None,
    shard: Shard | None = None, say: Callable[[str], None] = lambda _: None, progress: bool = False,
) -> Outcome:
    """Compute a study into a store, or go on with it where it stopped.

    Parameters
    ----------
    study : Resolved
    path : Path
        The store's folder, made if need be.
    tile : int, optional
        Pieces in a tile, at most; only for a new store.
    engine : Engine, optional
        Threads of this process by default.
    shard : Shard, optional
        Compute only these tiles; other processes or machines compute the others into the same store.
    say : callable
        Takes lines for people.
    progress : bool
        Show a progress bar on stderr.

    Raises
    ------
    InputError
        If the folder is no store, holds another study, or has another writer.
    OSError
        If the store cannot be written to, or the engine is gone; what is done is kept.
    """
    store, shard = _opened(study, path.absolute(), tile, say, progress), shard or Shard()
    mine = shard.tiles(store.grid.count)
    with writing(store.path / "run" / "writers", shard):
        _repair(store, mine, say)
        _compute(store, mine, engine or engines.threads(), progress)
        if store.complete:
            store.finish(progress=progress)
    marks = store.marks()
    failed = {n: m.error or "" for n, m in sorted(marks.items()) if not m.done}
    return Outcome(sum(m.done for m in marks.values()), failed, store.grid.count)


def _opened(study: Resolved, path: Path, tile: int | None, say: Callable[[str], None], progress: bool) -> Store:
    """The store at this path, made if need be; says how long what is left may take."""
    if path.is_symlink() and not path.exists():
        raise InputError("--out", "must not be a link to nothing", str(path), "Remove it, or make what it points to.")
    if not path.exists():
        try:
            plan = study.plan()
            plan.effort.announce(progress)
            return create(path, study, cut(plan, tile))
        except OSError:
            if not path.exists():  # else another shard was faster
                raise
    store = read(path)
    unlike = differences(store.study.to_dict(), study.to_dict())
    if unlike:
        raise InputError("store", "must hold the same study", str(path), "; ".join(unlike) + ".")
    done = sum(m.done for m in store.marks().values())
    store.plan.effort.announce(progress and not store.complete)
    say(f"{path.name}: {done} of {store.grid.count} tiles are done already")
    for line in differences(store.versions, versions(study)):
        say(f"warning: the store was begun with other versions, {line}; results may differ in the last digits")
    if tile is not None and cut(study.plan(), tile) != store.grid:
        say(f"the store's own tiles of {' x '.join(map(str, store.grid.tile))} are kept")
    return store


def _repair(store: Store, mine: range, say: Callable[[str], None]) -> None:
    """Make the store's own files anew if they are damaged, and forget the marks of tiles whose data are."""
    with FileLock(store.path / "run" / "finish.lock"):
        broken = store.broken()
        if broken:
            say(f"damaged files of the store are written anew: {', '.join(broken)}")
            mend(store)
    damaged = store.damaged(mine)
    for number in damaged:
        store.unmark(number)
    if damaged:
        say(f"damaged tiles are computed again: {', '.join(map(str, damaged))}")
        (store.path / "run" / "finished").unlink(missing_ok=True)


def _compute(store: Store, mine: range, engine: engines.Engine, progress: bool) -> None:
    """All tiles side by side; then those that failed, one after another, so that only what is to blame fails again."""
    marks, size = store.marks(), store.grid.size
    todo, errors = [n for n in mine if not (n in marks and marks[n].done)], dict[int, str]()
    total = sum(map(size, mine))
    with tiles.bar("pieces" if progress else None, total, total - sum(map(size, todo))) as advance:
        for attempt in range(1, ATTEMPTS + 1):
            errors = _pass(store, todo, engine, attempt, advance)
            todo = sorted(errors)
    for number, error in errors.items():
        store.mark(number, Mark(False, 0.0, name(), ATTEMPTS, error))


def _pass(
    store: Store, todo: list[int], engine: engines.Engine, attempt: int, advance: Callable[[int], None]
) -> dict[int, str]:
    """Try each of these tiles once; the errors of those that failed. A pool that breaks is opened anew."""
    errors, left = dict[int, str](), list(todo)
    while left:
        done = set[int]()
        with engine() as pool, suppress(BrokenExecutor):
            work = partial(compute_tile, str(store.path), attempt, pool.share(len(left)))
            ahead = partial(_ahead, pool, attempt)
            for number, future in tiles.few_ahead(pool.executor, work, left, ahead, pool.beat):
                error = _error(future)
                done.add(number)
                if error is None:
                    advance(store.grid.size(number))
                else:
                    errors[number] = error
        left = [n for n in left if n not in done]
    return errors


def _ahead(pool: engines.Pool, attempt: int) -> int:
    """How many tiles may be handed out: at first so many that workers that come later find some, too."""
    return 2 * pool.width() if attempt == 1 else 1


def _error(future: Future[str | None]) -> str | None:
    """What went wrong with a tile, in words; raises what concerns all tiles."""
    error = None if future.cancelled() else future.exception()
    if future.cancelled() or engines.cut_off(error):
        raise engines.EngineLostError(f"the cluster is gone. {engines.KEPT}")
    if isinstance(error, BrokenExecutor):
        return "the process that computed it died"
    if isinstance(error, OSError):
        raise OSError(f"{error}. {engines.KEPT}") from None
    return future.result() if error is None else _words(error)


def _words(error: BaseException) -> str:
    return f"{type(error).__name__}: {error}"


def compute_tile(path: str, attempt: int, threads: int, number: int) -> str | None:
    """Compute one tile of the store at this path in so many threads and write it; its error in words if it has one.

    Raises OSError if the store cannot be written to.
    """
    store, begin = _store(path, (Path(path) / "run" / "study.json").stat().st_mtime_ns), time.perf_counter()
    try:
        found = store.plan.compute(store.grid.pieces(number), threads=threads)
    except Exception as error:  # one tile's failure must not cost the others
        return _words(error)
    try:
        store.write(number, found)
        store.mark(number, Mark(True, time.perf_counter() - begin, name(), attempt))
    except OSError as error:
        raise OSError(f"the store cannot be written to: {error}") from None
    return None


@lru_cache(maxsize=4)
def _store(path: str, _: int) -> Store:
    """The store, read once a process for every version of its study."""
    return read(Path(path))
