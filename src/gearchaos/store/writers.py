"""Locks of the writers of a store: a single run, or shards i/n with the same n. A lock ends with the process that holds
it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from filelock import FileLock, Timeout

from gearchaos.errors import InputError

_WHOLE = "all"
"""Name of the lock of a run that computes all tiles."""

_CHECK_SECONDS = 2.0
"""How long a lock must stay taken to count as held by a writer; a process that only checks it releases it at once."""


@dataclass(frozen=True)
class Shard:
    """Part ``number`` of ``count`` parts of the tiles of a run, counted from 1: every ``count``-th tile from there."""

    number: int = 1
    count: int = 1

    def __post_init__(self) -> None:
        if not 1 <= self.number <= self.count:
            raise InputError("shard", "must read i/n with i from 1 to n", f"{self.number}/{self.count}", "E.g. 1/3.")

    @classmethod
    def parse(cls, text: str) -> Shard:
        """A shard from "i/n"."""
        number, slash, count = text.partition("/")
        if not (slash and number.strip().isdecimal() and count.strip().isdecimal()):
            raise InputError("shard", "must read i/n with i from 1 to n", text, "E.g. 1/3.")
        return cls(int(number), int(count))

    @property
    def name(self) -> str:
        """Name of its lock."""
        return _WHOLE if self.count == 1 else f"{self.number}-of-{self.count}"

    def tiles(self, total: int) -> range:
        """The numbers of its tiles, where ``total`` is the number of all tiles."""
        return range(self.number - 1, total, self.count)


@contextmanager
def write_lock(folder: Path, shard: Shard) -> Iterator[None]:
    """Hold the lock of a shard; raises `InputError` if another writer holds one that excludes it.

    Shards i/n with the same n do not exclude each other. Every writer first takes its own lock and then checks those
    of others: of two that start at the same time at least one finds the other.
    """
    own = FileLock(folder / f"{shard.name}.lock", timeout=0)
    try:
        own.acquire()
    except Timeout:
        raise _refusal(folder, shard.name) from None
    try:
        for lock in folder.glob("*.lock"):
            if lock.stem != shard.name and not _of_same_count(lock.stem, shard) and _held(lock):
                raise _refusal(folder, lock.stem)
        yield
    finally:
        own.release()


def _of_same_count(name: str, shard: Shard) -> bool:
    """Whether the lock with this name is that of another of the same number of shards."""
    return shard.count > 1 and name.endswith(f"-of-{shard.count}")


def _held(lock: Path) -> bool:
    """Whether a writer holds a lock; another process that only checks it, by this function, does not count."""
    try:
        with FileLock(lock, timeout=_CHECK_SECONDS):
            return False
    except Timeout:
        return True


def _refusal(folder: Path, name: str) -> InputError:
    """The error where the lock with this name is held by another writer."""
    who = "a run" if name == _WHOLE else f"shard {name.replace('-of-', '/')}"
    return InputError(
        "store", "must not have another writer", str(folder.parents[1]),
        f"{who} is writing to it. Wait for it, or divide the work: --shard 1/2 and --shard 2/2.",
    )
