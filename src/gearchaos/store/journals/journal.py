"""Journals: append-only records of what the writers of a store have done.

Each writer, a run or a shard, appends to journals of its own, ``run/journal/<writer>.jsonl``, ``<writer>.1.jsonl`` and
so on. A line is the CRC-32 of a JSON object in 8 hexadecimal digits, a space, the object and a line feed. A line that
is damaged is ignored: what it says is done again. `gearchaos.store.journals.progress` says what all journals together
mean.
"""

from __future__ import annotations

import time
import zlib
from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Literal

from pydantic import ConfigDict, Field, TypeAdapter, ValidationError

from gearchaos.store.files.folder import Folder
from gearchaos.store.files.parsing import Positive, Seconds, Whole

JOURNALS = "run/journal"
"""Folder of the journals."""

WHOLE = "all"
"""Name of the writer that computes all tiles."""

LINES_PER_FILE = 1000
"""Number of lines from which a journal is continued in a new file: on an object store every line rewrites its file."""

_STRICT = ConfigDict(extra="forbid", strict=True)


@dataclass(frozen=True)
class Begin:
    """A writer has begun.

    Attributes
    ----------
    machine : str
        Host name and process number, "host:pid".
    versions : dict of str to str
        Versions of the packages on which results depend.
    at : float
        Time, seconds since the epoch.
    """

    machine: str
    versions: dict[str, str]
    at: Seconds = field(default_factory=time.time)
    kind: Literal["begin"] = "begin"

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT


@dataclass(frozen=True)
class TileEntry:
    """A tile is done: its results are on the disk.

    Attributes
    ----------
    tile : int
        Number of the tile.
    segment : str or None
        The file with the record of its results; None if they are in group files.
    offset, length : int
        Where the record is in the file, in bytes.
    crc : int
        CRC-32 of the record.
    seconds : float
        Computing time.
    machine : str
        Host name and process number of the worker, "host:pid".
    attempt : int
        Number of the attempt, from 1.
    at : float
        Time at which it was done, seconds since the epoch.
    """

    tile: Whole
    segment: str | None
    offset: Whole
    length: Whole
    crc: Whole
    seconds: Seconds
    machine: str
    attempt: Positive = 1
    at: Seconds = field(default_factory=time.time)
    kind: Literal["tile"] = "tile"

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT


@dataclass(frozen=True)
class Failed:
    """A tile could not be computed: its error after the last attempt. It is tried again by the next run."""

    tile: Whole
    error: str
    attempt: Positive
    machine: str
    at: Seconds = field(default_factory=time.time)
    kind: Literal["failed"] = "failed"

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT


@dataclass(frozen=True)
class Packed:
    """The group files of a group are on the disk: size in bytes and CRC-32 of the file of each array by name."""

    group: Whole
    files: dict[str, tuple[Whole, Whole]]
    at: Seconds = field(default_factory=time.time)
    kind: Literal["packed"] = "packed"

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT


@dataclass(frozen=True)
class Lost:
    """Results that are damaged or missing: these tiles, and those of these groups, are not done.

    It concerns only what was done up to the time ``at``, the latest time of the entries that are lost: what is done
    again later is valid, in whichever order journals are read.
    """

    tiles: list[Whole]
    groups: list[Whole]
    at: Seconds
    kind: Literal["lost"] = "lost"

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT


@dataclass(frozen=True)
class Damaged:
    """Group files that do not agree with their checksums; the next run repairs them.

    Attributes
    ----------
    files : list of (int, str)
        Group and array of each file.
    tiles : list of int
        The tiles whose results in these files are damaged.
    at : float
        The latest time at which one of these groups was packed: it does not concern files that are written later.
    """

    files: list[tuple[Whole, str]]
    tiles: list[Whole]
    at: Seconds
    kind: Literal["damaged"] = "damaged"

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT


@dataclass(frozen=True)
class Ended:
    """A writer has ended regularly: of its tiles all are done or have failed."""

    at: Seconds = field(default_factory=time.time)
    kind: Literal["ended"] = "ended"

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT


Line = Begin | TileEntry | Failed | Packed | Lost | Damaged | Ended
"""What a line of a journal says."""

_LINES: TypeAdapter[Line] = TypeAdapter(Annotated[Line, Field(discriminator="kind")])


def encoded_line(line: Line) -> bytes:
    """A line of a journal with its checksum and line feed."""
    content = _LINES.dump_json(line)
    return b"%08x %s\n" % (zlib.crc32(content), content)


def decoded_line(content: bytes) -> Line | None:
    """The inverse of `encoded_line`, without line feed; None if the line is damaged or not one of a journal."""
    checksum, _, rest = content.partition(b" ")
    if checksum != b"%08x" % zlib.crc32(rest):
        return None
    try:
        return _LINES.validate_json(rest)
    except ValidationError:
        return None


def journal_name(writer: str, number: int) -> str:
    """Name of a file of the journals of a writer, counted from 0."""
    return f"{JOURNALS}/{writer}.{number}.jsonl" if number else f"{JOURNALS}/{writer}.jsonl"


class Journal:
    """The journal of a writer, to which one process appends at a time.

    Parameters
    ----------
    folder : Folder
        The folder of the store.
    writer : str
        Name of the writer: ``all``, or ``3-of-512`` for a shard.
    """

    def __init__(self, folder: Folder, writer: str) -> None:
        self.folder, self.writer = folder, writer
        self._number, self._lines = self._end()
        self._whole = False
        """Whether the file is known to end with a line feed: a writer that was killed may have left half a line."""

    def append(self, *lines: Line) -> None:
        """Append lines, which are on the disk at return; raises OSError if they cannot be written."""
        content = b"".join(map(encoded_line, lines))
        if self._lines >= LINES_PER_FILE:
            self._number, self._lines, self._whole = self._number + 1, 0, True
        first = b"" if self._whole else b"\n"
        self._whole = False
        self.folder.append(journal_name(self.writer, self._number), first + content)
        self._lines, self._whole = self._lines + len(lines) + len(first), True

    def _end(self) -> tuple[int, int]:
        """Number of the last file, and of its lines."""
        number = 0
        while self.folder.size(journal_name(self.writer, number + 1)) is not None:
            number += 1
        name = journal_name(self.writer, number)
        return number, 0 if self.folder.size(name) is None else self.folder.read(name).count(b"\n")
