"""Who writes to a store: one run, or the shards of one division, told apart by locks that die with their holder."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from filelock import FileLock, Timeout

from gearchaos.errors import InputError

_ALONE = "all"
_LOOKING = 2.0


@dataclass(frozen=True)
class Shard:
    """The i-th of n parts of a run's tiles, counted from 1: every n-th tile."""

    number: int = 1
    of: int = 1

    def __post_init__(self) -> None:
        if not 1 <= self.number <= self.of:
            raise InputError("--shard", "must read i/n with i from 1 to n", f"{self.number}/{self.of}", "E.g. 1/3.")

    @classmethod
    def parse(cls, text: str) -> Shard:
        """A shard from "i/n"."""
        number, slash, of = text.partition("/")
        if not (slash and number.strip().isdecimal() and of.strip().isdecimal()):
            raise InputError("--shard", "must read i/n with i from 1 to n", text, "E.g. 1/3.")
        return cls(int(number), int(of))

    @property
    def name(self) -> str:
        return _ALONE if self.of == 1 else f"{self.number}-of-{self.of}"

    def tiles(self, count: int) -> range:
        """Numbers of its tiles, of so many."""
        return range(self.number - 1, count, self.of)


@contextmanager
def writing(folder: Path, shard: Shard) -> Iterator[None]:
    """Hold the right to write; raises `InputError` if another run, which is not another of these shards, has it.

    Each takes its own lock first and looks at the others' then, so that of two who come at once none goes on unseen.
    """
    own = FileLock(folder / f"{shard.name}.lock", timeout=0)
    try:
        own.acquire()
    except Timeout:
        raise _refusal(folder, shard.name) from None
    try:
        for lock in folder.glob("*.lock"):
            if lock.stem != shard.name and not _together(lock.stem, shard) and _held(lock):
                raise _refusal(folder, lock.stem)
        yield
    finally:
        own.release()


def _together(name: str, shard: Shard) -> bool:
    return shard.of > 1 and name.endswith(f"-of-{shard.of}")


def _held(lock: Path) -> bool:
    """Whether a writer holds a lock for good, and not another that just looks, as this does."""
    try:
        with FileLock(lock, timeout=_LOOKING):
            return False
    except Timeout:
        return True


def _refusal(folder: Path, name: str) -> InputError:
    who = "a run" if name == _ALONE else f"shard {name.replace('-of-', '/')}"
    return InputError(
        "store", "must not have another writer", str(folder.parents[1]),
        f"{who} is writing to it. Wait for it, or divide the work: --shard 1/2 and --shard 2/2.",
    )
