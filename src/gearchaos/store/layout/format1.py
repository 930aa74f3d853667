"""Stores of format 1, which earlier versions made: a file for the status of each tile, instead of journals.

In format 1 every tile is a chunk of all arrays and a file of its own: a group of one tile. A run continues such a store
with journals, and leaves the statuses as they are.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from gearchaos.store.files.checked_files import read_as
from gearchaos.store.files.folder import Folder
from gearchaos.store.files.parsing import Positive, Seconds, StrictSchema
from gearchaos.store.journals.journal import Failed, Line, Packed, TileEntry

_STATUS = re.compile(r"run/tiles/(0|[1-9]\d{0,17})\.json", re.ASCII)
"""Names of the files of statuses."""


class TileStatusSchema(StrictSchema):
    """``run/tiles/<number>.json`` of a store of format 1: the status of a tile."""

    done: bool
    seconds: Seconds
    machine: str
    attempt: Positive
    error: str | None
    at: Seconds


def status_lines(folder: Folder) -> Iterator[Line]:
    """What the statuses of tiles say, as lines of a journal; damaged files are ignored."""
    for name, _ in folder.list("run/tiles"):
        if (found := _STATUS.fullmatch(name)) and (status := read_as(TileStatusSchema, folder, name)) is not None:
            yield from _lines(int(found[1]), status)


def _lines(tile: int, status: TileStatusSchema) -> Iterator[Line]:
    """What the status of a tile says."""
    if status.done:
        yield TileEntry(tile, None, 0, 0, 0, status.seconds, status.machine, status.attempt, status.at)
        yield Packed(tile, {}, status.at)
    else:
        yield Failed(tile, status.error or "", status.attempt, status.machine, status.at)
