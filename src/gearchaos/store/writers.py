"""Locks of the writers of a store: a single run, or shards i/n with the same n. A lock ends with the process that holds
it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import PurePosixPath

from filelock import Timeout

from gearchaos.errors import InputError
from gearchaos.store.folder import Folder
from gearchaos.store.journal import WHOLE

_LOCKS = "run/writers"
"""Folder of the locks."""

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
        return WHOLE if self.count == 1 else f"{self.number}-of-{self.count}"

    def tiles(self, total: int) -> range:
        """The numbers of its tiles, where ``total`` is the number of all tiles."""
        return range(self.number - 1, total, self.count)


@contextmanager
def write_lock(folder: Folder, shard: Shard) -> Iterator[None]:
    """Hold the lock of a shard in a store; raises `InputError` if another writer holds one that excludes it.

    Shards i/n with the same n do not exclude each other. Every writer first takes its own lock and then checks those
    of others: of two that start at the same time at least one finds the other.
    """
    with ExitStack() as held:
        try:
            held.enter_context(folder.lock(_lock_name(shard.name), 0))
        except Timeout:
            raise _refusal(folder, shard.name) from None
        for name in _writers(folder):
            if name != shard.name and not _of_same_count(name, shard) and _held(folder, name):
                raise _refusal(folder, name)
        yield


def _lock_name(writer: str) -> str:
    """The file of the lock of a writer."""
    return f"{_LOCKS}/{writer}.lock"


def _writers(folder: Folder) -> list[str]:
    """The names of all writers that have had a lock."""
    return [PurePosixPath(name).stem for name, _ in folder.list(_LOCKS) if name.endswith(".lock")]


def _of_same_count(name: str, shard: Shard) -> bool:
    """Whether the lock with this name is that of another of the same number of shards."""
    return shard.count > 1 and name.endswith(f"-of-{shard.count}")


def _held(folder: Folder, name: str) -> bool:
    """Whether a writer holds its lock; another process that only checks it, by this function, does not count."""
    try:
        with folder.lock(_lock_name(name), _CHECK_SECONDS):
            return False
    except Timeout:
        return True


def _refusal(folder: Folder, name: str) -> InputError:
    """The error where the lock with this name is held by another writer."""
    who = "a run" if name == WHOLE else f"shard {name.replace('-of-', '/')}"
    return InputError(
        "store", "must not have another writer", str(folder),
        f"{who} is writing to it. Wait for it, or divide the work: --shard 1/2 and --shard 2/2.",
    )
