"""A run's folder: a Zarr store that xarray opens, with the state of the run beside the data.

One tile is one chunk of every array, written once by one worker; the tile's mark comes last, so what is marked is
there. Chunks carry checksums, and ``run/sums.json`` has those of all else. Beside the arrays, ``run/study.json`` says
what is computed and with what, and ``run/tiles`` holds the marks.
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

from gearchaos.errors import InputError
from gearchaos.files import read_bytes, write_bytes
from gearchaos.store.arrays import FORMAT, PIECES, Layout, put
from gearchaos.store.checksums import differing, sums
from gearchaos.store.chunks import chunk_file, write_chunk
from gearchaos.store.resolved import Resolved
from gearchaos.store.schema import FormatSchema, MarkSchema, StudySchema, Sums, parsed, read_as
from gearchaos.store.tiles import Grid
from gearchaos.studies.plan import Plan

_TILE = re.compile(r"0|[1-9]\d{0,17}", re.ASCII)
"""Names of marks: numbers of tiles."""


@dataclass(frozen=True)
class Mark:
    """What became of one tile: done or failed, with the error; how long it took, where, when, and at which attempt."""

    done: bool
    seconds: float
    machine: str
    attempt: int = 1
    error: str | None = None
    at: float = field(default_factory=time.time)


@dataclass(frozen=True)
class Store:
    """A run's folder.

    Attributes
    ----------
    path : Path
    study : Resolved
    grid : Grid
    arrays : dict of str to Layout
        The arrays that tiles fill, by name.
    versions : dict of str to str
        Of the packages that decide the numbers, when it was made.
    """

    path: Path
    study: Resolved
    grid: Grid
    arrays: dict[str, Layout]
    versions: dict[str, str]

    @cached_property
    def plan(self) -> Plan:
        """The study's plan; raises `InputError` if the store is not cut as that plan can be."""
        plan, tile = self.study.plan(), self.grid.tile
        shape, block = tuple(plan.shape.values()), plan.block.values()
        if shape != self.grid.shape or not all(b <= t <= n for b, t, n in zip(block, tile, shape, strict=True)):
            raise _damaged(self.path, f"tiles of {tile} over {self.grid.shape} do not fit the study's {shape}")
        return plan

    @cached_property
    def _open(self) -> dict[str, Any]:
        return {}

    def array(self, name: str) -> Any:
        """One of those arrays, (grid..., ...)."""
        if name not in self._open:
            folder = name if self.plan.labelled else f"{PIECES}/{name}"
            self._open[name] = self._fitting(zarr.open_array(self.path / folder, mode="r", zarr_format=3))
        return self._open[name]

    def _fitting(self, array: Any) -> Any:
        """The array, if its chunks are the tiles; else what is in it would be taken for other pieces."""
        shape, tile, dims = self.grid.shape, self.grid.tile, len(self.grid.shape)
        chunk = array.chunks[:dims]
        if (array.shape[:dims], chunk) != (shape, tile):
            raise _damaged(self.path, f"tiles of {tile} over {shape} are not those of its arrays, {chunk}")
        return array

    def write(self, number: int, found: dict[str, np.ndarray]) -> None:
        """Put what was found of a tile's pieces, arrays (L, ...), in its place; blank chunks, too: a missing one is a
        loss."""
        shape = tuple(p.stop - p.start for p in self.grid.part(number))
        for name, values in found.items():
            array = self.array(name)
            write_chunk(array, self._place(number, array), values.reshape(*shape, *values.shape[1:]))

    def _place(self, number: int, array: Any) -> tuple[int, ...]:
        """The place of a tile's chunk in the grid of chunks of an array, which is not cut beyond the pieces' dims."""
        along = self.grid.place(number)
        return (*along, *[0] * (array.ndim - len(along)))

    def mark(self, number: int, mark: Mark) -> None:
        """Say what became of a tile; after its data are written."""
        write_bytes(self._mark_path(number), json.dumps(asdict(mark)).encode())

    def marks(self) -> dict[int, Mark]:
        """The marks there are, by the number of the tile; a damaged one, or one of no tile, counts as none."""
        files = (p for p in (self.path / "run" / "tiles").glob("*.json") if _TILE.fullmatch(p.stem))
        found = {int(p.stem): read_as(MarkSchema, p) for p in files}
        return {n: Mark(**dict(m)) for n, m in found.items() if m is not None and n < self.grid.count}

    def unmark(self, number: int) -> None:
        self._mark_path(number).unlink(missing_ok=True)

    def _mark_path(self, number: int) -> Path:
        return self.path / "run" / "tiles" / f"{number}.json"

    def damaged(self, numbers: Iterable[int] | None = None) -> list[int]:
        """Tiles, of these or of all, that are marked as done but whose data are missing or miss their checksums."""
        chosen, arrays = None if numbers is None else set(numbers), [self.array(name) for name in self.arrays]
        done = [n for n, mark in self.marks().items() if mark.done and (chosen is None or n in chosen)]
        return [n for n in done if not all(self._sound(n, array) for array in arrays)]

    def _sound(self, number: int, array: Any) -> bool:
        """Whether a tile's chunk of one array is there and fits its checksum."""
        if not chunk_file(array, self._place(number, array)).is_file():
            return False
        try:
            array[self.grid.part(number)]
        except Exception:  # whatever a codec raises at bytes that are not its own
            return False
        return True

    def fixed(self) -> list[Path]:
        """The files that tiles do not fill: metadata, coordinates, and of a finished study all its results."""
        filled = {(PIECES, n, "c") if not self.plan.labelled else (n, "c") for n in self.arrays}
        every = (p for p in self.path.rglob("*") if p.is_file() and not p.name.endswith(".partial"))
        parts = ((p, p.relative_to(self.path).parts) for p in every)
        return [p for p, q in parts if q[0] != "run" and q[:2] not in filled and q[:3] not in filled]

    def seal(self) -> None:
        """Note the checksums of those files."""
        write_bytes(self.path / "run" / "sums.json", json.dumps(sums(self.path, self.fixed())).encode())

    def broken(self) -> list[str]:
        """Names of the files among them that are missing or damaged."""
        noted = read_as(Sums, self.path / "run" / "sums.json")
        names = (f.relative_to(self.path) for f in self.fixed())
        own = {str(n) for n in names if n.name == "zarr.json" or "c" in n.parts}  # metadata and chunks
        return ["run/sums.json"] if noted is None or own - noted.keys() else differing(self.path, noted)

    def found(self) -> dict[str, np.ndarray]:
        """The arrays (N, ...) that tiles filled, blank where none did yet."""
        arrays = {n: self.array(n)[:] for n in self.arrays}
        return {n: v.reshape(prod(self.grid.shape), *v.shape[len(self.grid.shape):]) for n, v in arrays.items()}

    def dataset(self) -> xr.Dataset:
        """The Dataset, as far as it is; raises `InputError` if the store is damaged."""
        lost = self.broken() or [f"tile {n}" for n in self.damaged()]
        if lost:
            raise InputError("store", "must be sound", str(self.path), f"Run it again to mend {', '.join(lost)}.")
        if self.plan.labelled or self.finished:
            return xr.open_zarr(self.path, chunks=None).load()
        return self.plan.finish(self.found())

    @property
    def finished(self) -> bool:
        """Whether the Dataset is complete."""
        return (self.path / "run" / "finished").exists()

    @property
    def complete(self) -> bool:
        """Whether all tiles are done."""
        marks = self.marks()
        return all(n in marks and marks[n].done for n in range(self.grid.count))

    def finish(self, **options: Any) -> None:
        """Complete the Dataset once all tiles are done, and clear away what dying writers left. One at a time."""
        with FileLock(self.path / "run" / "finish.lock"):
            if self.finished:
                return
            for partial in self.path.rglob("*.partial"):
                partial.unlink(missing_ok=True)
            if not self.plan.labelled:
                put(self.plan.finish(self.found(), **options), self.path)
            self.seal()
            write_bytes(self.path / "run" / "finished", b"")


def read(path: Path) -> Store:
    """The store of an earlier run."""
    file = path / "run" / "study.json"
    try:
        content = read_bytes(file)
    except (OSError, ValueError) as error:  # the latter for a name that no file can have
        said = f"{file} cannot be read: {getattr(error, 'strerror', error)}."
        raise InputError("store", "must be a folder that gearchaos run made", str(path), said) from None
    try:
        made = parsed(FormatSchema, content).format
        if made == FORMAT:
            return _store(path, parsed(StudySchema, content))
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise _damaged(path, str(error)) from None
    raise InputError("store", f"must have format {FORMAT}", made, "It was made by another version of gearchaos.")


def _store(path: Path, words: StudySchema) -> Store:
    grid = Grid(words.grid.shape, words.grid.tile)
    arrays = {n: Layout(a.dtype, a.shape) for n, a in words.arrays.items()}
    return Store(path, Resolved.from_dict(words.study.model_dump()), grid, arrays, words.versions)


def _damaged(path: Path, why: str) -> InputError:
    return InputError("store", "must hold a sound run/study.json", str(path), f"It is damaged, or not a store: {why}.")
