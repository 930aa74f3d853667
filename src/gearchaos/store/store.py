"""A store: a folder in Zarr format with the results of a study, which xarray opens, and with the state of the run.

A worker appends the results of a tile to a segment, ``run/segments``, and a writer notes it in its journal,
``run/journal``. When all tiles of a group are done, the group is packed: its results are written to one file of each
array, a shard of Zarr's sharding codec. Chunks and records contain checksums; those of all other files are in
``run/sums.json``. The study and the versions of packages are in ``run/study.json``.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from math import prod

import numpy as np
import xarray as xr

from gearchaos.errors import ChangedFileError, InputError
from gearchaos.store.errors import damaged_description, missing_description
from gearchaos.store.files.checked_files import read_as
from gearchaos.store.files.checksums import checksums, differing
from gearchaos.store.files.folder import Folder, open_folder
from gearchaos.store.files.parsing import parse_as
from gearchaos.store.journals.journal import JOURNALS
from gearchaos.store.journals.progress import Progress
from gearchaos.store.layout.arrays import check_layout
from gearchaos.store.layout.chunks import DamagedChunkError
from gearchaos.store.layout.format1 import status_lines
from gearchaos.store.layout.groups import put, read_group
from gearchaos.store.layout.layout import Layout
from gearchaos.store.layout.lazy import StoredArray, reading_block, with_stored_arrays
from gearchaos.store.layout.segments import read_parts
from gearchaos.store.layout.specs import FORMATS, ArraySpec
from gearchaos.store.record import from_record
from gearchaos.store.schema import Checksums, FormatSchema, StudySchema

STUDY = "run/study.json"
"""File that describes the store: study, grid, arrays, versions."""

_SUMS = "run/sums.json"
FINISHED = "run/finished"
"""File that exists when the Dataset is complete."""


@dataclass(frozen=True)
class Store(Layout):
    """A store that can be read. It has the attributes of `Layout`."""

    def progress(self, writers: Iterable[str] | None = None) -> Progress:
        """What the journals of these writers say, by default of all that a listing finds."""
        found = Progress(self.folder, self.grid, self.record_length)
        for line in status_lines(self.folder) if self.format == 1 else ():
            found.add(line)
        found.refresh(writers)
        return found

    def read(self, name: str, region: tuple[slice, ...] | None = None, progress: Progress | None = None) -> np.ndarray:
        """The results of the work items of a region in one array, with the fill value where none are computed.

        Parameters
        ----------
        name : str
            Name of an array.
        region : tuple of slice, optional
            A part of the grid of work items, with start and stop and without step; by default all of it.
        progress : Progress, optional
            What is done, read from the journals if it is left out.

        Returns
        -------
        array
            The shape of the region, then that of the result of one item.

        Raises
        ------
        InputError
            If a chunk is damaged, or the whole store is gone. What is missing has the fill value; see
            `gearchaos.store.reading.missing`.
        """
        region = region or tuple(slice(0, n) for n in self.grid.shape)
        progress, spec = progress or self.progress(), self.arrays[name]
        out = np.full((*(p.stop - p.start for p in region), *spec.shape), self.fill(name), spec.dtype)
        for group in self.grid.groups_in(region):
            if group in progress.packed:
                self._read_group(name, group, region, out)
            elif not self._read_tiles(name, group, region, out, progress):
                progress.refresh()  # perhaps the group was packed since the journals were read
                if group in progress.packed:
                    self._read_group(name, group, region, out)
                else:
                    self._check_exists()
        return out

    def _read_group(self, name: str, group: int, region: tuple[slice, ...], out: np.ndarray) -> None:
        """Read a packed group into the results of a region; a missing file is left out."""
        try:
            read_group(self, name, group, region, out)
        except FileNotFoundError:
            self._check_exists()
        except DamagedChunkError:
            advice = (f"{self.group_file(name, group)} does not have its checksum. Find the damage with gearchaos "
                      f"check {self.folder}, which says how to repair it.")
            raise InputError("store", "must be undamaged", str(self.folder), advice) from None

    def _check_exists(self) -> None:
        """Raise `InputError` if the store is gone: a file that is not found is then no part that is missing."""
        if self.folder.size(STUDY) is None:
            advice = "It was moved or deleted after it was opened: load it again."
            raise InputError("store", "must still be there when its values are read", str(self.folder), advice)

    def _read_tiles(
        self, name: str, group: int, region: tuple[slice, ...], out: np.ndarray, progress: Progress
    ) -> bool:
        """Read the tiles of a group that is not packed into the results of a region; whether no record is missing."""
        wanted = set(self.grid.tiles_in(region))
        entries = [progress.entries[t] for t in self.grid.tiles_of(group) if t in wanted and t in progress.entries]
        whole = True
        for entry, values in read_parts(self.folder, entries, self.arrays, name, self.grid):
            if values is None:
                whole = False
            else:
                put(self.grid.region(entry.tile), values, region, out)
        return whole

    def results(self) -> dict[str, np.ndarray]:
        """The results (N, ...) of all N work items by name, with the fill value where they are not computed yet."""
        progress, count = self.progress(), prod(self.grid.shape)
        return {n: self.read(n, None, progress).reshape(count, *a.shape) for n, a in self.arrays.items()}

    def checksummed_files(self) -> list[str]:
        """All files but ``run`` and those of groups: metadata, coordinates, and what a finished study adds."""
        groups = tuple(f"{self.array_folder(name)}/c/" for name in self.arrays)
        return [name for name, _ in self.folder.list()
                if not name.startswith(("run/", *groups)) and not name.endswith(".partial")]

    def write_checksums(self) -> None:
        """Write the checksums of `checksummed_files`."""
        self.folder.write(_SUMS, json.dumps(checksums(self.folder, self.checksummed_files())).encode())

    def damaged_files(self) -> list[str]:
        """The names of those of `checksummed_files` that are missing or damaged."""
        expected = read_as(Checksums, self.folder, _SUMS)
        written = {n for n in self.checksummed_files() if n.endswith("zarr.json") or "c" in n.split("/")}  # by Zarr
        return [_SUMS] if expected is None or written - expected.keys() else differing(self.folder, expected)

    def repair_command(self, progress: Progress) -> str:
        """The command that writes again what is missing or damaged; without the study file if all tiles were done."""
        return f"gearchaos {'finish' if progress.all_done else 'run STUDY.toml --out'} {self.folder}"

    @property
    def block(self) -> dict[str, int]:
        """Sizes by dimension of the parts of the grid that are read at once where the whole may not fit into memory."""
        largest = max(prod(a.shape) * np.dtype(a.dtype).itemsize for a in self.arrays.values())
        block = reading_block(self.grid.shape, self.grid.chunk, largest)
        return dict(zip(self.study.grid, block, strict=True))

    def dataset(self) -> xr.Dataset:
        """The Dataset as far as it is computed; raises `InputError` if files other than those of results are damaged.

        The results of work items of a gridded study are read when they are used; `InputError` is raised then if they
        are damaged. What is missing has the fill value, see `gearchaos.store.reading.missing`. Of another study that is
        not finished nothing but these results is read.
        """
        if not self.study.gridded and not self.finished:  # whatever a run that is finishing it has written
            return self.study.finish(self.results())
        if damaged := self.damaged_files():
            advice = f"To repair {', '.join(damaged)}: {self.repair_command(self.progress())}"
            raise InputError("store", "must be undamaged", str(self.folder), advice)
        if not self.study.gridded:
            return xr.open_zarr(self.folder.zarr_store(), chunks=None).load()
        progress, opened = self.progress(), xr.open_zarr(self.folder.zarr_store(), chunks=None)
        return with_stored_arrays(opened, {name: self._stored_array(name, progress) for name in self.arrays})

    def _stored_array(self, name: str, progress: Progress) -> StoredArray:
        """An array of results that is read when it is used."""
        spec = self.arrays[name]
        shape, block = (*self.grid.shape, *spec.shape), tuple(self.block.values())
        return StoredArray(partial(self.read, name, progress=progress), shape, np.dtype(spec.dtype), block)

    @property
    def finished(self) -> bool:
        """Whether the run has been finished after the last tile: the Dataset and the checksums are written."""
        return self.folder.size(FINISHED) is not None


def open_store(location: str | os.PathLike[str]) -> Store:
    """The store in a folder; raises `InputError` if there is none, or it is damaged or of an unknown format."""
    folder = open_folder(location)
    try:
        content = folder.read(STUDY)
    except InputError:
        raise
    except (OSError, ValueError) as error:  # ValueError for a name with a null character
        if isinstance(error, FileNotFoundError) and _has_parts(folder):
            raise missing_description(folder) from None
        why = f"{folder}/{STUDY} cannot be read: {getattr(error, 'strerror', error)}."
        raise InputError("store", "must be a folder that gearchaos run made", str(folder), why) from None
    store = from_description(folder, content)
    check_layout(store, store.damaged_files)
    return store


def _has_parts(folder: Folder) -> bool:
    """Whether a folder has files that only stores have; a draft that is not published completely is no store yet."""
    return (folder.size(_SUMS) is not None or next(folder.list(JOURNALS), None) is not None) and folder.exists()


def from_description(folder: Folder, content: bytes) -> Store:
    """The store in a folder, from the content of its ``run/study.json``; raises `InputError` if that is damaged."""
    try:
        found = parse_as(FormatSchema, content).format
        if found in FORMATS:
            return _from_schema(folder, parse_as(StudySchema, content))
    except ChangedFileError as error:
        raise InputError(
            "store", "must find the tables of its gears as they were when it was made", str(folder),
            f"The table {error.value} changed since, or is missing. Restore it to go on with this store, or compute "
            "the study with the new table into a new folder.") from None
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise damaged_description(folder, str(error)) from None
    raise InputError("store", f"must have format {' or '.join(map(str, FORMATS))}", found,
                     "It was made by another version of gearchaos.")


def _from_schema(folder: Folder, record: StudySchema) -> Store:
    """The store with this content of ``run/study.json``."""
    arrays = {n: ArraySpec(a.dtype, a.shape) for n, a in record.arrays.items()}
    study = from_record(record.study.model_dump())
    return Store(folder, study, record.grid.grid(), arrays, record.versions, record.format)
