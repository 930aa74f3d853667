"""Who writes to a store: a single run, or shards of one division; and the locks that keep others out."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from filelock import SoftFileLock, Timeout

from gearchaos.errors import InputError
from gearchaos.store.objects import Objects
from gearchaos.store.store import STUDY
from gearchaos.store.tiles import Grid

LOCKS = "run/locks"
_WAIT = 2.0  # how long a lock must stay taken to count as held; a process that only looks at it releases it at once
_MOST_SHARDS = 100_000


@dataclass(frozen=True)
class Shard:
    """Part ``number`` of ``count`` parts of the blocks of a store, counted from 1."""

    number: int = 1
    count: int = 1

    def __post_init__(self) -> None:
        if not 1 <= self.number <= self.count:
            raise InputError("shard", "must read i/n with i from 1 to n", f"{self.number}/{self.count}", "E.g. 1/3.")
        if self.count > _MOST_SHARDS:
            raise InputError("shard", f"must be of at most {_MOST_SHARDS:,} shards", f"{self.number}/{self.count}")

    @classmethod
    def parse(cls, text: str) -> Shard:
        """A shard from "i/n"."""
        number, slash, count = text.partition("/")
        if not (slash and number.strip().isdecimal() and count.strip().isdecimal() and len(text) < 99):
            raise InputError("shard", "must read i/n with i from 1 to n", text, "E.g. 1/3.")
        return cls(int(number), int(count))

    def __str__(self) -> str:
        return "a run" if self.count == 1 else f"shard {self.number}/{self.count}"

    @property
    def lock(self) -> str:
        """Name of its lock."""
        return "all.lock" if self.count == 1 else f"{self.number}-of-{self.count}.lock"

    def blocks(self, grid: Grid) -> range:
        """The blocks that it computes."""
        return range(self.number - 1, grid.block_count, self.count)


@contextmanager
def write_lock(objects: Objects, shard: Shard) -> Iterator[None]:
    """Hold the lock of a shard; other shards of the same division do not exclude it. Object stores have no locks.

    The lock is a file with the number and the host of the process. One of a process that has ended on this host is
    taken over. Every writer first takes its own lock and then looks at those of others: of two that start at the same
    time at least one finds the other. Raises `InputError` if another writer holds a lock that excludes this one, or if
    the store is read-only.
    """
    if objects.folder is None:
        yield
        return
    objects.check_creatable()
    folder = objects.folder / LOCKS
    with ExitStack() as stack:
        stack.callback(_remove_empty, objects)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            stack.enter_context(_locked(folder / shard.lock, _WAIT))
        except Timeout:
            raise _refusal(objects, shard.lock) from None
        except OSError as error:
            if error.errno not in (errno.EACCES, errno.EPERM, errno.EROFS, errno.EEXIST, errno.ENOTDIR):
                raise OSError(error.errno, error.strerror, str(objects)) from None  # that of a full disk has no path
            raise InputError("store", "must be writable", str(objects), f"{error}. Make all its files and folders "
                             "writable and free of others, or copy it to a place you may write in.") from None
        same = f"-of-{shard.count}.lock"
        for other in sorted(path.name for path in folder.glob("*.lock")):
            if other != shard.lock and not other.endswith(same) and _held(objects, other, _WAIT):
                raise _refusal(objects, other)
        yield


@contextmanager
def _locked(path: Path, timeout: float) -> Iterator[None]:
    """Hold a lock; one that names no process is of before a power failure, since a process gives its name at once."""
    lock = SoftFileLock(path, timeout=timeout)
    try:
        lock.acquire()
    except Timeout:
        if not timeout or lock.pid is not None:
            raise
        path.unlink(missing_ok=True)
        lock.acquire()
    try:
        yield
    finally:
        lock.release()


def _remove_empty(objects: Objects) -> None:
    """Remove the folders of a store that could not be made; those of one that is there may be in use."""
    if objects.folder is not None and objects.get(STUDY) is None:
        with suppress(OSError):
            for folder in (objects.folder / LOCKS, (objects.folder / LOCKS).parent, objects.folder):
                folder.rmdir()


def running(objects: Objects) -> list[str]:
    """Who holds locks of a store, as "shard 2/4, process 4711 on host node3"; none in object stores."""
    names = [] if objects.folder is None else sorted(p.name for p in (objects.folder / LOCKS).glob("*.lock"))
    return [_holder(objects, name) for name in names if _held(objects, name, 0.0)]


def _held(objects: Objects, name: str, timeout: float) -> bool:
    """Whether a lock is held for longer than ``timeout`` seconds."""
    try:
        with _locked(objects.folder / LOCKS / name, timeout):  # type: ignore[operator]
            return False
    except (Timeout, OSError):  # OSError in a store that is read-only
        return True


def _holder(objects: Objects, name: str) -> str:
    """The writer and the process that hold a lock, as its name and its content say."""
    number, of, count = name.removesuffix(".lock").partition("-of-")
    lines = (objects.get(f"{LOCKS}/{name}") or b"").decode(errors="replace").split("\n")
    process = f"process {lines[0]} on host {lines[1]}" if len(lines) > 1 else "a process that does not give its name"
    return f"{f'shard {number}/{count}' if of else 'a run'}, {process}"


def _refusal(objects: Objects, name: str) -> InputError:
    """The error where another writer holds a lock."""
    count = name.removesuffix(".lock").partition("-of-")[2]
    others = f"run other shards of {count}" if count else "stop it and divide the work: --shard 1/2 and --shard 2/2"
    return InputError(
        "store", "must not have another writer", str(objects),
        f"{_holder(objects, name)}, is writing to it. Wait for it, or {others}. "
        f"If that process is gone, delete {objects}/{LOCKS}/{name}.")
