"""Locks of the writers of a store: a single run, or shards i/n with the same n. A lock ends with the process that holds
it."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

from filelock import Timeout

from gearchaos.errors import InputError
from gearchaos.store.files.folder import Folder, is_refused
from gearchaos.store.writers.shards import Shard

_WRITERS = "run/writers"
_CHECK_SECONDS = 2.0
"""How long a lock must stay taken to count as held by a writer; a process that only checks it releases it at once."""

_WITHOUT_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.ENOTSUP, errno.EOPNOTSUPP)
"""Error numbers with which file systems refuse locks."""

NO_LOCKS = "warning: this file system has no locks. Make sure that no other run, or the same shard twice, writes to it"


@contextmanager
def write_lock(folder: Folder, shard: Shard) -> Iterator[bool]:
    """Hold the lock of a shard; raises `InputError` if another writer holds one that excludes it, or the store is
    read-only.

    Shards i/n with the same n do not exclude each other. Every writer first takes its own lock and then checks those
    of others: of two that start at the same time at least one finds the other. Yields False, without holding a lock,
    where the file system has none.
    """
    with ExitStack() as stack:
        try:
            stack.enter_context(folder.lock(_lock(shard.name), _CHECK_SECONDS))
            locked = True
        except Timeout as error:
            raise _refusal(folder, shard, error) from None
        except (OSError, NotImplementedError) as failure:
            if is_refused(failure):
                raise _unwritable(folder, failure) from None
            if not _without_locks(failure):
                raise
            locked = False
        for other in _writers(folder) if locked else ():
            excluded = other != shard and not 1 < shard.count == other.count
            if excluded and (busy := _timeout(folder, other, _CHECK_SECONDS)) is not None:
                raise _refusal(folder, other, busy)
        yield locked


def _unwritable(folder: Folder, error: Exception) -> InputError:
    """The error for a store that this process may not write to."""
    advice = f"{error}. Make all its files and folders writable, or copy it to a place you may write in."
    return InputError("store", "must be writable", str(folder), advice)


def _without_locks(error: Exception) -> bool:
    """Whether an error means that the file system has no locks."""
    return isinstance(error, NotImplementedError) or getattr(error, "errno", None) in _WITHOUT_LOCKS


def _lock(name: str) -> str:
    return f"{_WRITERS}/{name}.lock"


def _writers(folder: Folder) -> Iterator[Shard]:
    """The writers of which there are files of locks."""
    for name, _ in folder.list(_WRITERS):
        shard = Shard.of_writer(name.removeprefix(f"{_WRITERS}/").removesuffix(".lock"))
        if shard is not None:
            yield shard


def held(folder: Folder, shard: Shard, timeout: float = 0.0) -> bool:
    """Whether a writer holds its lock for longer than ``timeout`` seconds; False where there are no locks."""
    return _timeout(folder, shard, timeout) is not None


def is_running(folder: Folder, writer: str) -> bool | None:
    """Whether a writer of this name holds its lock; None if that cannot be told, e.g. where there are no locks."""
    if folder.size(_lock(writer)) is None:
        return None
    try:
        with folder.lock(_lock(writer), 0.0):
            return False
    except Timeout:
        return True
    except (OSError, NotImplementedError):
        return None


def _timeout(folder: Folder, shard: Shard, timeout: float) -> Timeout | None:
    """The error that a writer holds its lock for longer than ``timeout`` seconds; None if it does not."""
    try:
        with folder.lock(_lock(shard.name), timeout):
            return None
    except Timeout as error:
        return error
    except (OSError, NotImplementedError):
        return None


def _refusal(folder: Folder, writer: Shard, busy: Timeout) -> InputError:
    """The error where another writer holds a lock. Locks of object stores tell which process that is."""
    holder = f" ({busy.holder})" if hasattr(busy, "holder") else ""
    return InputError(
        "store", "must not have another writer", str(folder),
        f"{writer!s}{holder} is writing to it. Wait for it, or divide the work: --shard 1/2 and --shard 2/2.",
    )
