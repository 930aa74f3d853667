"""Claims: tiles that shards which are done take over from shards that are not.

The claims on the tiles of a shard are in ``run/claims/<shard>.jsonl``, a file to which lines are appended under a lock.
They only save time: a tile that two shards compute has the same results, and each writes to segments of its own. So a
line that is missed, cut short or out of date does no harm.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager

from gearchaos.store.files.folder import Folder

_CLAIMS = "run/claims"
_LOCK_SECONDS = 10.0
"""Longest time to wait for the lock of a file of claims."""


class Claims:
    """The claims on the tiles of one shard.

    Parameters
    ----------
    folder : Folder
        The folder of the store.
    writer : str
        Name of the shard as a writer, e.g. "3-of-4".

    Attributes
    ----------
    tiles : set of int
        The tiles that other shards have taken over, as far as they have been read.
    workers : int
        Number of tiles that the shard computes at once.
    """

    def __init__(self, folder: Folder, writer: str) -> None:
        self.tiles: set[int] = set()
        self.workers = 0
        self._folder, self._name, self._end = folder, f"{_CLAIMS}/{writer}.jsonl", 0

    @property
    def possible(self) -> bool:
        """Whether tiles can be claimed: locks of object stores take several requests."""
        return "://" not in self._folder.url

    @contextmanager
    def lock(self) -> Iterator[bool]:
        """Hold the lock of this file; yields False where it cannot be had, as on a file system without locks."""
        if not self.possible:
            yield False
            return
        with ExitStack() as stack:
            try:
                stack.enter_context(self._folder.lock(f"{self._name}.lock", _LOCK_SECONDS))
                locked = True
            except (OSError, NotImplementedError):  # a Timeout, too, is an OSError
                locked = False
            yield locked

    def begin(self, workers: int) -> None:
        """Begin a new file, without claims, for a shard that computes ``workers`` tiles at a time."""
        with self.lock() as locked:
            if locked:
                self._folder.write(self._name, _line(workers=workers))

    def refresh(self) -> set[int]:
        """The tiles that were claimed since the last call."""
        size = self._folder.size(self._name) or 0
        if size < self._end:  # the shard has begun anew
            self.tiles, self._end = set(), 0
        if size <= self._end:
            return set()
        try:
            content = self._folder.read(self._name, self._end)
        except OSError:
            return set()
        whole = content[:content.rfind(b"\n") + 1]
        self._end += len(whole)
        found = {tile for line in whole.splitlines() for tile in self._read(line)} - self.tiles
        self.tiles |= found
        return found

    def _read(self, line: bytes) -> list[int]:
        """The tiles of a line of claims; notes the number of workers where a line gives it."""
        try:
            content = json.loads(line)
            self.workers = int(content.get("workers", self.workers))
            return [int(tile) for tile in content.get("tiles", ())]
        except (ValueError, TypeError, AttributeError, OverflowError, RecursionError):
            return []

    def add(self, tiles: Iterable[int], writer: str) -> None:
        """Claim tiles for another writer; the lock must be held."""
        self._folder.append(self._name, _line(tiles=list(tiles), writer=writer))
        self.refresh()


def _line(**values: object) -> bytes:
    return json.dumps(values).encode() + b"\n"
