"""The end of a run: the last writer of a store packs what is left and completes the Dataset."""

from __future__ import annotations

import time
from contextlib import AbstractContextManager, nullcontext, suppress
from itertools import count
from typing import Any

from gearchaos.store.layout.arrays import add_results
from gearchaos.store.layout.segments import SEGMENTS
from gearchaos.store.reading.missing import missing_parts
from gearchaos.store.running.coordinator import SETTLING_SECONDS, Coordinator
from gearchaos.store.running.sources import CHECK_SECONDS, Listed
from gearchaos.store.store import FINISHED, Store
from gearchaos.store.writers.shards import Shard

_ENDED = "run/ended"


def finish_lock(store: Store, locks: bool) -> AbstractContextManager[Any]:
    """The lock that is held while a store is repaired or finished; nothing where there are no locks."""
    return store.folder.lock("run/finish.lock", -1) if locks else nullcontext()


def finish(coordinator: Coordinator, *, locks: bool, verify: bool, progress: bool) -> bool:
    """Finish a store if all tiles are done.

    Parameters
    ----------
    coordinator : Coordinator
        The writer, which packs the groups that are left.
    locks : bool
        Whether the file system has locks.
    verify : bool
        Whether to look for files of groups that are missing first.
    progress : bool
        Show progress on stderr.

    Returns
    -------
    bool
        Whether the store is finished, by this writer or another one.
    """
    store, found = coordinator.store, coordinator.progress
    coordinator.refresh()
    if not found.all_done and not store.finished:
        return False
    with finish_lock(store, locks):
        coordinator.refresh()
        if store.finished:
            _delete_remains(store)  # segments of workers that computed a tile for the second time
            return True
        coordinator.packs_all = True
        coordinator.compute(Listed(()))
        if not found.all_done or found.complete_groups() or (verify and missing_parts(store, found).files):
            return False
        _complete(store, progress)
    return True


def _complete(store: Store, progress: bool) -> None:
    """Write what is computed from all results, and delete what is not needed any more."""
    for name, _ in list(store.folder.list()):
        if name.endswith(".partial"):
            store.folder.delete(name)
    if not store.study.gridded:
        add_results(store.study.finish(store.results(), progress=progress), store.folder)
    store.write_checksums()
    _delete_remains(store)
    store.folder.write(FINISHED, b"")


def _delete_remains(store: Store) -> None:
    """Delete all segments, and the files that count shards; what another shard still writes goes when that one ends."""
    for folder in (SEGMENTS, _ENDED):
        with suppress(OSError):
            store.folder.delete_tree(folder)


def wait_and_finish(coordinator: Coordinator, *, locks: bool, verify: bool, progress: bool) -> bool:
    """Finish a store; the last shard waits for what the others have done if it does not see it yet.

    A network file system may show for half a minute what files were before. Then each shard may end without seeing that
    the others have ended, too. Therefore they are counted by files of which each is created once: the last one waits.
    """
    options = {"locks": locks, "verify": verify, "progress": progress}
    if finish(coordinator, **options):
        return True
    if not _is_last(coordinator.store, coordinator.shard):
        return False
    latest = time.monotonic() + SETTLING_SECONDS
    while time.monotonic() < latest and _may_finish(coordinator):
        time.sleep(CHECK_SECONDS)
        if finish(coordinator, **options):
            return True
    return False


def _is_last(store: Store, shard: Shard) -> bool:
    """Whether all other shards have ended, too. A shard that ends again is not counted again."""
    folder, division = store.folder, f"{_ENDED}/of-{shard.count}"
    try:
        if shard.count == 1 or not folder.create(f"{_ENDED}/{shard.name}", b""):
            return False
        known = sum(1 for _ in folder.list(division))
        rank = next(n for n in count(known + 1) if folder.create(f"{division}/{n}", b""))
    except FileNotFoundError:  # the last one finishes the store, and has deleted these files
        return True
    return rank >= shard.count


def _may_finish(coordinator: Coordinator) -> bool:
    """Whether no tile has failed, or there are others that are not done.

    A store of which all tiles are done may still be seen with files missing that another shard has just written.
    """
    progress = coordinator.progress
    return not progress.failed or coordinator.store.grid.count - progress.done_count > len(progress.failed)
