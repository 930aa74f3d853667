"""What the journals of all writers of a store together say: which tiles are done, and where their results are."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from fnmatch import fnmatchcase
from math import inf

import numpy as np

from gearchaos.store.files.folder import UNREACHABLE, Folder
from gearchaos.store.journals.journal import (
    JOURNALS,
    LINES_PER_FILE,
    Begin,
    Damaged,
    Ended,
    Failed,
    Line,
    Lost,
    Packed,
    TileEntry,
    decoded_line,
    journal_name,
)
from gearchaos.store.tiles import Grid


@dataclass(frozen=True)
class WriterState:
    """What the journal of a writer last said: whether it has begun and ended, and the time of its last line."""

    begun: float
    ended: bool
    at: float


@dataclass
class _JournalEnd:
    """How far the journals of a writer have been read: number of the file, bytes and lines of it, and whether it was
    read before."""

    number: int = 0
    offset: int = 0
    lines: int = 0
    begun: bool = False


class Progress:
    """What all journals of a store say. They are read once; `refresh` reads what was added since.

    The order in which journals are read does not matter. A tile is done if it is in a packed group, or has an entry
    that is later than the last loss of the tile or its group. Entries of tiles in packed groups are not kept, so that
    the memory does not grow with the number of tiles but for 16 bytes each.

    Parameters
    ----------
    folder : Folder
        The folder of the store.
    grid : Grid
    record_length : callable
        Function from the number of a tile to the length of its record in bytes; other entries are ignored.

    Attributes
    ----------
    entries : dict of int to TileEntry
        The entries of the tiles that are done but not in a packed group.
    failed : dict of int to str
        The errors of the tiles that failed and are not done.
    packed : dict of int to dict of str to (int, int)
        Size and CRC-32 of the group file of each array, for each packed group; empty if they are not known.
    writers : dict of str to WriterState
        By name of the writer.
    at, seconds : (count,) float
        When each tile was done, in seconds since the epoch, NaN if it is not; and its computing time, NaN if the group
        of a tile is packed and its entry is not known.
    latest_loss : float
        Time of the latest loss; what is done again must be later, also if the clock of its worker is behind.
    hosts : set of str
        Names of the machines that computed.
    unreadable : set of str
        Journals that cannot be read.
    """

    def __init__(self, folder: Folder, grid: Grid, record_length: Callable[[int], int]) -> None:
        self.folder, self.grid, self._record_length = folder, grid, record_length
        self.entries: dict[int, TileEntry] = {}
        self.failed: dict[int, str] = {}
        self.packed: dict[int, dict[str, tuple[int, int]]] = {}
        self.writers: dict[str, WriterState] = {}
        self.hosts: set[str] = set()
        self.unreadable: set[str] = set()
        self.at = np.full(grid.count, np.nan)
        self.seconds = np.zeros(grid.count)
        self.latest_loss = 0.0
        self._packed_at: dict[int, float] = {}
        self._lost_tiles: dict[int, float] = {}
        self._lost_groups: dict[int, float] = {}
        self._lost_in_group: dict[int, float] = {}
        self._done_in_group: dict[int, int] = {}
        self._complete: set[int] = set()
        self._damaged: list[Damaged] = []
        self._later: dict[int, TileEntry] = {}
        """Entries of tiles that are later than the packing of their group: of a slower copy of the tile, whose segment
        may be deleted; or of its computation after a loss of the group that has not been read yet."""
        self._ends: dict[str, _JournalEnd] = {}

    @property
    def done_count(self) -> int:
        """Number of tiles that are done."""
        return sum(self._done_in_group.values())

    @property
    def all_done(self) -> bool:
        """Whether all tiles are done."""
        return self.done_count == self.grid.count

    def done(self, tile: int) -> bool:
        """Whether a tile is done."""
        return not np.isnan(self.at[tile])

    def missing(self, tiles: Iterable[int]) -> list[int]:
        """Those of these tiles that are not done."""
        return [tile for tile in tiles if not self.done(tile)]

    def complete_groups(self) -> list[int]:
        """The groups that are not packed though all their tiles are done."""
        return sorted(self._complete)

    def damaged_files(self) -> dict[int, set[str]]:
        """The arrays of which the file is damaged, for each packed group with such files, as the last check found."""
        out: dict[int, set[str]] = {}
        for line in self._damaged:
            for group, name in line.files:
                if self._packed_at.get(group, inf) <= line.at:
                    out.setdefault(group, set()).add(name)
        return out

    def damaged_tiles(self) -> set[int]:
        """The tiles whose results in damaged files are damaged."""
        tiles = {(tile, line.at) for line in self._damaged for tile in line.tiles if tile < self.grid.count}
        return {tile for tile, at in tiles if self._packed_at.get(self.grid.group_of(tile), inf) <= at}

    def packed_at(self, group: int) -> float:
        """When a packed group was packed, in seconds since the epoch."""
        return self._packed_at[group]

    def loss(self, tiles: list[int], groups: list[int]) -> Lost:
        """The line for a journal that says that what is known to be done of these tiles and groups is lost."""
        times = [self.at[tile] for tile in tiles] + [self._packed_at[group] for group in groups if group in self.packed]
        times += [self.at[tile] for group in groups for tile in self.grid.tiles_of(group)]
        return Lost(tiles, groups, float(np.nanmax([0.0, *times])))

    def refresh(self, writers: Iterable[str] | None = None) -> None:
        """Read what was added to the journals of these writers, by default of all that a listing finds."""
        for writer in self._listed() if writers is None else writers:
            self._read(writer, self._ends.setdefault(writer, _JournalEnd()))

    def _listed(self) -> list[str]:
        """Names of all writers that have journals."""
        names = (name.removeprefix(f"{JOURNALS}/") for name, _ in self.folder.list(JOURNALS))
        return sorted({name.split(".")[0] for name in names if fnmatchcase(name, "[!.]*.jsonl")})

    def _read(self, writer: str, end: _JournalEnd) -> None:
        """Apply the lines of a writer that have not been read. A line without its line feed is read later."""
        while True:
            name = journal_name(writer, end.number)
            try:
                content = self.folder.read(name, end.offset)
            except FileNotFoundError:
                content = b""
            except UNREACHABLE:
                raise
            except OSError:
                self.unreadable.add(name)
                return
            whole = content[:content.rfind(b"\n") + 1]
            for line in whole.splitlines():
                if (found := decoded_line(line)) is not None:
                    self.add(found, writer)
            end.offset, end.lines = end.offset + len(whole), end.lines + whole.count(b"\n")
            if end.lines < LINES_PER_FILE and not self._continued(writer, end):
                return
            end.number, end.offset, end.lines, end.begun = end.number + 1, 0, 0, False

    def _continued(self, writer: str, end: _JournalEnd) -> bool:
        """Whether a journal has a next file though this one, read for the first time, is short or missing: damaged."""
        first, end.begun = not end.begun, True
        return first and self.folder.size(journal_name(writer, end.number + 1)) is not None

    def add(self, line: Line, writer: str | None = None) -> None:
        """Apply a line of the journal of a writer."""
        if writer is not None:
            self._add_state(line, writer)
        match line:
            case TileEntry():
                self._add_entry(line)
            case Failed() if line.tile < self.grid.count and not self.done(line.tile):
                self.failed[line.tile] = line.error
            case Packed() if line.group < self.grid.group_count:
                self._add_packed(line)
            case Lost():
                self._add_lost(line)
            case Damaged():
                self._damaged.append(line)

    def _add_state(self, line: Line, writer: str) -> None:
        """Note when a writer has begun and ended. Losses and damage begin none: `gearchaos check` writes them too."""
        old = self.writers.get(writer, WriterState(line.at, True, line.at))
        begun = line.at if isinstance(line, Begin) else old.begun
        ended = isinstance(line, Ended) or (isinstance(line, Damaged | Lost) and old.ended)
        self.writers[writer] = WriterState(begun, ended, line.at)

    def _add_entry(self, entry: TileEntry) -> None:
        """Apply the entry of a tile, unless it is lost, not of this store, or older than another one."""
        tile = entry.tile
        if tile >= self.grid.count or (entry.segment is not None and entry.length != self._record_length(tile)):
            return
        group = self.grid.group_of(tile)
        if entry.at <= max(self._lost_tiles.get(tile, -inf), self._lost_groups.get(group, -inf)):
            return
        if self.done(tile) and entry.at < self.at[tile] and not np.isnan(self.seconds[tile]):
            return
        self.hosts.add(entry.machine.split(":")[0])
        self._set_done(tile, group, entry.at, entry.seconds)
        if group not in self.packed:
            self.entries[tile] = entry
        elif entry.at > self._packed_at[group]:
            self._later[tile] = entry
        self._review(group)

    def _set_done(self, tile: int, group: int, at: float, seconds: float) -> None:
        """Note that a tile is done."""
        self.failed.pop(tile, None)
        if not self.done(tile):
            self._done_in_group[group] = self._done_in_group.get(group, 0) + 1
        self.at[tile], self.seconds[tile] = at, seconds

    def _review(self, group: int) -> None:
        """Note whether all tiles of a group are done though it is not packed."""
        done = self._done_in_group.get(group, 0)
        if group not in self.packed and done == self.grid.tile_count(group):
            self._complete.add(group)
        else:
            self._complete.discard(group)

    def _add_packed(self, line: Packed) -> None:
        """Apply that a group is packed, unless it is lost or was packed again later: all its tiles are done."""
        group = line.group
        if line.at <= max(self._lost_groups.get(group, -inf), self._packed_at.get(group, -inf)):
            return
        if line.at <= self._lost_in_group.get(group, -inf):
            self._lose_group(group, line.at)
            return
        self.packed[group], self._packed_at[group] = line.files, line.at
        for tile in self.grid.tiles_of(group):
            entry = self.entries.pop(tile, None) or self._later.pop(tile, None)
            if entry is not None and entry.at > line.at:
                self._later[tile] = entry
            if not self.done(tile):
                self._set_done(tile, group, line.at, np.nan)  # until its entry is read
        self._review(group)

    def _add_lost(self, line: Lost) -> None:
        """Apply a loss: what was done up to its time is not done."""
        self.latest_loss = max(self.latest_loss, line.at)
        for group in line.groups:
            if group < self.grid.group_count:
                self._lose_group(group, line.at)
        for tile in line.tiles:
            if tile < self.grid.count:
                self._lose_tile(tile, line.at)

    def _lose_group(self, group: int, at: float) -> None:
        self._lost_groups[group] = max(at, self._lost_groups.get(group, -inf))
        if self._packed_at.get(group, inf) <= at:
            del self.packed[group], self._packed_at[group]
            for tile in self.grid.tiles_of(group):
                if tile in self._later:
                    self.entries[tile] = self._later.pop(tile)
        if group not in self.packed:
            for tile in self.grid.tiles_of(group):
                self._clear(tile, group, at)
        self._review(group)

    def _lose_tile(self, tile: int, at: float) -> None:
        """Apply the loss of a tile; of a packed group all tiles are lost, since there are no entries of the others."""
        group = self.grid.group_of(tile)
        self._lost_tiles[tile] = max(at, self._lost_tiles.get(tile, -inf))
        self._lost_in_group[group] = max(at, self._lost_in_group.get(group, -inf))
        if self._packed_at.get(group, inf) <= at:
            self._lose_group(group, self._packed_at[group])
        if group not in self.packed:
            self._clear(tile, group, at)
            self._review(group)

    def _clear(self, tile: int, group: int, at: float) -> None:
        """Note that a tile is not done, unless it was done later than ``at``."""
        if self.at[tile] <= at:
            self.entries.pop(tile, None)
            self.at[tile], self.seconds[tile] = np.nan, 0.0
            self._done_in_group[group] -= 1
