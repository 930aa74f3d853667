"""A store: a folder in Zarr format with the results of a study, which xarray opens, and with the state of the run.

One tile is one chunk of every array, written once by one worker. Its status is written after its data, so the data of a
tile that is done are complete. Chunks contain checksums; those of all other files are in ``run/sums.json``. The study
and the versions of packages are in ``run/study.json``, the statuses of tiles in ``run/tiles``.
"""

from __future__ import annotations

import json
import re
import time
from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from functools import cached_property
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
import zarr
from filelock import FileLock

from gearchaos.errors import ChangedFileError, InputError
from gearchaos.files import read_bytes, write_bytes
from gearchaos.store.arrays import FORMAT, ITEMS, ArraySpec, add_results
from gearchaos.store.checksums import checksums, differing
from gearchaos.store.chunks import chunk_file, write_chunk
from gearchaos.store.record import from_record
from gearchaos.store.schema import Checksums, FormatSchema, StudySchema, TileStatusSchema, parse_as, read_as
from gearchaos.store.tiles import Grid
from gearchaos.studies.study import Study

_TILE = re.compile(r"0|[1-9]\d{0,17}", re.ASCII)
"""Names of the files of statuses, without suffix: numbers of tiles."""


@dataclass(frozen=True)
class TileStatus:
    """The status of a tile.

    Attributes
    ----------
    done : bool
        Whether its results are written.
    seconds : float
        Computing time.
    machine : str
        Host name and process number, "host:pid".
    attempt : int
        Number of the attempt, from 1.
    error : str or None
        Why it is not done.
    at : float
        Time of the status, seconds since the epoch.
    """

    done: bool
    seconds: float
    machine: str
    attempt: int = 1
    error: str | None = None
    at: float = field(default_factory=time.time)


@dataclass(frozen=True)
class Store:
    """A store on disk.

    Attributes
    ----------
    path : Path
        Its folder.
    study : Study
    grid : Grid
        The division of the study into tiles.
    arrays : dict of str to ArraySpec
        The arrays of the results of work items, by name.
    versions : dict of str to str
        Versions of the packages on which results depend, when the store was created.
    """

    path: Path
    study: Study
    grid: Grid
    arrays: dict[str, ArraySpec]
    versions: dict[str, str]

    def __post_init__(self) -> None:
        shape, block, tile = tuple(self.study.grid.values()), self.study.block.values(), self.grid.tile
        if shape != self.grid.shape or not all(b <= t <= n for b, t, n in zip(block, tile, shape, strict=True)):
            raise _damaged(self.path, f"tiles of {tile} over {self.grid.shape} do not fit the study's {shape}")

    @cached_property
    def _opened_arrays(self) -> dict[str, Any]:
        """Arrays opened so far, by name."""
        return {}

    def array(self, name: str) -> Any:
        """The Zarr array of one result: the shape of the grid of work items, then that of the result of one item."""
        if name not in self._opened_arrays:
            folder = name if self.study.gridded else f"{ITEMS}/{name}"
            array = zarr.open_array(self.path / folder, mode="r", zarr_format=3)
            self._opened_arrays[name] = self._checked_chunks(array)
        return self._opened_arrays[name]

    def _checked_chunks(self, array: Any) -> Any:
        """The array; raises `InputError` unless each of its chunks has the work items of one tile."""
        shape, tile, dims = self.grid.shape, self.grid.tile, len(self.grid.shape)
        chunk = array.chunks[:dims]
        if (array.shape[:dims], chunk) != (shape, tile):
            raise _damaged(self.path, f"tiles of {tile} over {shape} are not those of its arrays, {chunk}")
        return array

    def write(self, number: int, results: dict[str, np.ndarray]) -> None:
        """Write the results of the L work items of a tile, arrays (L, ...) by name.

        Chunks that hold only the fill value are written too: a missing chunk counts as damaged.
        """
        shape = tuple(p.stop - p.start for p in self.grid.region(number))
        for name, values in results.items():
            array = self.array(name)
            write_chunk(array, self._chunk_position(number, array), values.reshape(*shape, *values.shape[1:]))

    def _chunk_position(self, number: int, array: Any) -> tuple[int, ...]:
        """Position of a tile's chunk in an array; dimensions after those of the grid have one chunk."""
        along = self.grid.position(number)
        return (*along, *[0] * (array.ndim - len(along)))

    def set_status(self, number: int, status: TileStatus) -> None:
        """Write the status of a tile; its data must have been written before."""
        write_bytes(self._status_path(number), json.dumps(asdict(status)).encode())

    def statuses(self) -> dict[int, TileStatus]:
        """The statuses by number of the tile, without damaged files and numbers that no tile has."""
        files = (p for p in (self.path / "run" / "tiles").glob("*.json") if _TILE.fullmatch(p.stem))
        found = {int(p.stem): read_as(TileStatusSchema, p) for p in files}
        return {n: TileStatus(**dict(m)) for n, m in found.items() if m is not None and n < self.grid.count}

    def clear_status(self, number: int) -> None:
        """Delete the status of a tile, so that it will be computed again."""
        self._status_path(number).unlink(missing_ok=True)

    def _status_path(self, number: int) -> Path:
        return self.path / "run" / "tiles" / f"{number}.json"

    def damaged_tiles(self, numbers: Iterable[int] | None = None) -> list[int]:
        """The tiles, of these numbers or of all, that are done but have a missing or damaged chunk."""
        chosen, arrays = None if numbers is None else set(numbers), [self.array(name) for name in self.arrays]
        done = [n for n, status in self.statuses().items() if status.done and (chosen is None or n in chosen)]
        return [n for n in done if not all(self._intact(n, array) for array in arrays)]

    def _intact(self, number: int, array: Any) -> bool:
        """Whether a tile's chunk of one array exists and agrees with its checksum."""
        if not chunk_file(array, self._chunk_position(number, array)).is_file():
            return False
        try:
            array[self.grid.region(number)]
        except Exception:  # codecs raise various errors for damaged bytes
            return False
        return True

    def checksummed_files(self) -> list[Path]:
        """All files but ``run`` and the chunks of tiles: metadata, coordinates, and what a finished study adds."""
        chunks = {(ITEMS, n, "c") if not self.study.gridded else (n, "c") for n in self.arrays}
        files = (p for p in self.path.rglob("*") if p.is_file() and not p.name.endswith(".partial"))
        parts = ((p, p.relative_to(self.path).parts) for p in files)
        return [p for p, q in parts if q[0] != "run" and q[:2] not in chunks and q[:3] not in chunks]

    def write_checksums(self) -> None:
        """Write the checksums of `checksummed_files`."""
        content = json.dumps(checksums(self.path, self.checksummed_files()))
        write_bytes(self.path / "run" / "sums.json", content.encode())

    def damaged_files(self) -> list[str]:
        """The names of those of `checksummed_files` that are missing or damaged."""
        expected = read_as(Checksums, self.path / "run" / "sums.json")
        names = (f.relative_to(self.path) for f in self.checksummed_files())
        written = {str(n) for n in names if n.name == "zarr.json" or "c" in n.parts}  # by Zarr: metadata and chunks
        return ["run/sums.json"] if expected is None or written - expected.keys() else differing(self.path, expected)

    def results(self) -> dict[str, np.ndarray]:
        """The results (N, ...) of all N work items by name, with the fill value where they are not computed yet."""
        arrays = {n: self.array(n)[:] for n in self.arrays}
        return {n: v.reshape(prod(self.grid.shape), *v.shape[len(self.grid.shape):]) for n, v in arrays.items()}

    def dataset(self) -> xr.Dataset:
        """The Dataset as far as it is computed; raises `InputError` if the store is damaged."""
        damaged = self.damaged_files() or [f"tile {n}" for n in self.damaged_tiles()]
        if damaged:
            advice = f"Run it again to repair {', '.join(damaged)}."
            raise InputError("store", "must be undamaged", str(self.path), advice)
        if self.study.gridded or self.finished:
            return xr.open_zarr(self.path, chunks=None).load()
        return self.study.finish(self.results())

    @property
    def finished(self) -> bool:
        """Whether `finish` has been done after the last tile: the Dataset and the checksums are written."""
        return (self.path / "run" / "finished").exists()

    @property
    def all_tiles_done(self) -> bool:
        """Whether all tiles are done; the run may still have to `finish`."""
        statuses = self.statuses()
        return all(n in statuses and statuses[n].done for n in range(self.grid.count))

    def finish(self, **options: Any) -> None:
        """Complete the Dataset when all tiles are done, and remove the partial files of writers that were killed.

        Only one process does so at a time; others wait. ``options`` are those of `Study.finish`.
        """
        with FileLock(self.path / "run" / "finish.lock"):
            if self.finished:
                return
            for partial in self.path.rglob("*.partial"):
                partial.unlink(missing_ok=True)
            if not self.study.gridded:
                add_results(self.study.finish(self.results(), **options), self.path)
            self.write_checksums()
            write_bytes(self.path / "run" / "finished", b"")


def open_store(path: Path) -> Store:
    """The store in a folder; raises `InputError` if there is none, or it is damaged or of another format."""
    file = path / "run" / "study.json"
    try:
        content = read_bytes(file)
    except (OSError, ValueError) as error:  # ValueError for a name with a null character
        why = f"{file} cannot be read: {getattr(error, 'strerror', error)}."
        raise InputError("store", "must be a folder that gearchaos run made", str(path), why) from None
    try:
        found = parse_as(FormatSchema, content).format
        if found == FORMAT:
            return _from_description(path, parse_as(StudySchema, content))
    except ChangedFileError as error:
        raise InputError(
            "store", "must find the tables of its gears as they were when it was made", str(path),
            f"The table {error.value} changed since, or is missing. Restore it to go on with this store, or compute "
            "the study with the new table into a new folder.") from None
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise _damaged(path, str(error)) from None
    raise InputError("store", f"must have format {FORMAT}", found, "It was made by another version of gearchaos.")


def _from_description(path: Path, record: StudySchema) -> Store:
    """The store with this content of ``run/study.json``."""
    grid = Grid(record.grid.shape, record.grid.tile)
    arrays = {n: ArraySpec(a.dtype, a.shape) for n, a in record.arrays.items()}
    return Store(path, from_record(record.study.model_dump()), grid, arrays, record.versions)


def _damaged(path: Path, why: str) -> InputError:
    """The error for a store whose ``run/study.json`` is damaged or does not fit its arrays."""
    advice = f"It is damaged, or not a store: {why}."
    return InputError("store", "must hold an undamaged run/study.json", str(path), advice)
