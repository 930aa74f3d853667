"""A run's folder: a Zarr store that xarray opens, with the state of the run beside the data.

One tile is one chunk of every array, written once by one worker; the tile's mark comes last, so what is marked is
there. Chunks carry checksums. Beside the arrays, ``run/study.json`` says what is computed and with what, and
``run/tiles`` holds the marks.
"""

from __future__ import annotations

import json
import os
import tempfile
import warnings
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
import zarr
from zarr.codecs import Crc32cCodec, ZstdCodec

from gearchaos.errors import InputError
from gearchaos.runs.grid import Grid
from gearchaos.runs.machine import machine
from gearchaos.runs.resolved import Resolved
from gearchaos.studies.dataset import provenance
from gearchaos.studies.evidence import blank
from gearchaos.studies.plan import Plan

_PIECES = "pieces"
"""Where the arrays lie that are not the Dataset's own."""

_CODECS = (ZstdCodec(level=1), Crc32cCodec())
_FORMAT = 1


@dataclass(frozen=True)
class Mark:
    """What became of one tile: done or failed, with the error; how long it took, where, and at which attempt."""

    done: bool
    seconds: float
    machine: str
    attempt: int = 1
    error: str | None = None


@dataclass(frozen=True)
class Store:
    """A run's folder.

    Attributes
    ----------
    path : Path
    study : Resolved
    grid : Grid
    arrays : tuple of str
        Names of the arrays that tiles fill.
    """

    path: Path
    study: Resolved
    grid: Grid
    arrays: tuple[str, ...]

    @cached_property
    def plan(self) -> Plan:
        return self.study.plan()

    @cached_property
    def _open(self) -> dict[str, Any]:
        return {}

    def array(self, name: str) -> Any:
        """One of those arrays, (grid..., ...). Empty chunks are stored too, so that a missing one is a loss."""
        if name not in self._open:
            folder = name if self.plan.labelled else f"{_PIECES}/{name}"
            array = zarr.open_array(self.path / folder, mode="r+", zarr_format=3)
            self._open[name] = array.with_config({"write_empty_chunks": True})
        return self._open[name]

    def write(self, number: int, found: dict[str, np.ndarray]) -> None:
        """Put what was found of a tile's pieces, arrays (L, ...), in its place."""
        part = self.grid.part(number)
        for name, values in found.items():
            self.array(name)[part] = values.reshape(*(p.stop - p.start for p in part), *values.shape[1:])

    def mark(self, number: int, mark: Mark) -> None:
        """Say what became of a tile; after its data are written."""
        _write_text(self._mark_path(number), json.dumps(asdict(mark)))

    def marks(self) -> dict[int, Mark]:
        """The marks there are, by the number of the tile."""
        found = ((int(p.stem), _read_mark(p)) for p in (self.path / "run" / "tiles").glob("*.json"))
        return {number: mark for number, mark in found if mark is not None}

    def unmark(self, number: int) -> None:
        self._mark_path(number).unlink(missing_ok=True)

    def marked_at(self, number: int) -> float:
        """When a tile was marked, in seconds of the file system's clock."""
        return self._mark_path(number).stat().st_mtime

    def _mark_path(self, number: int) -> Path:
        return self.path / "run" / "tiles" / f"{number}.json"

    def damaged(self) -> Iterator[int]:
        """Tiles marked as done whose data are missing or do not fit their checksums."""
        arrays = {name: self.array(name) for name in self.arrays}
        for number, mark in self.marks().items():
            if mark.done and not all(self._sound(number, array) for array in arrays.values()):
                yield number

    def _sound(self, number: int, array: Any) -> bool:
        """Whether a tile's chunk of one array is there and fits its checksum."""
        along = [int(i) for i in np.unravel_index(number, self.grid.tiles)]
        place = (*along, *[0] * (array.ndim - len(along)))
        key = f"{array.path}/{array.metadata.encode_chunk_key(place)}".lstrip("/")
        if not (Path(array.store.root) / key).is_file():
            return False
        try:
            array[self.grid.part(number)]
        except Exception:  # whatever a codec raises at bytes that are not its own
            return False
        return True

    def found(self) -> dict[str, np.ndarray]:
        """The arrays (N, ...) that tiles filled, with zeros or NaN where none did yet."""
        arrays = {n: self.array(n)[:] for n in self.arrays}
        return {n: v.reshape(-1, *v.shape[len(self.grid.shape):]) for n, v in arrays.items()}

    def dataset(self) -> xr.Dataset:
        """The Dataset as far as it is, in memory or lazily."""
        if self.plan.labelled or self.finished:
            return xr.open_zarr(self.path, chunks=None)
        return self.plan.finish(self.found())

    @property
    def finished(self) -> bool:
        """Whether the Dataset is complete."""
        return (self.path / "run" / "finished").exists()

    def finish(self) -> None:
        """Complete the Dataset once all tiles are done, and clear away what dying writers left."""
        for partial in self.path.rglob("*.partial"):
            partial.unlink(missing_ok=True)
        if not self.plan.labelled:
            self.plan.finish(self.found()).to_zarr(self.path, mode="a", zarr_format=3, consolidated=False)
            _consolidate(self.path)
        _write_text(self.path / "run" / "finished", "")


def create(path: Path, study: Resolved, grid: Grid) -> Store:
    """A new store, whole or not at all."""
    plan = study.plan()
    sample = plan.compute(np.zeros(1, dtype=np.int64), threads=1)
    store = Store(path, study, grid, tuple(sample))
    if not path.parent.is_dir():
        raise InputError("--out", "must lie in an existing folder", str(path), "Create the folder first.")
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=".gearchaos-") as folder:
        draft = Path(folder) / "draft"
        _lay_out(draft, plan, sample, grid)
        words = {"format": _FORMAT, "study": study.to_dict(), "grid": asdict(grid), "arrays": store.arrays,
                 "versions": _versions(study), "machine": machine()}
        zarr.open_group(draft / "run", mode="w-", zarr_format=3)  # else the store holds what is no part of a store
        _consolidate(draft)
        (draft / "run" / "tiles").mkdir()
        (draft / "run" / "writers").mkdir()
        _write_text(draft / "run" / "study.json", json.dumps(words, indent=2))
        os.rename(draft, path)
    return store


def _versions(study: Resolved) -> dict[str, str]:
    return {n: v for n, v in provenance(study.kind, study.model).items() if n.endswith("_version")}


def _lay_out(path: Path, plan: Plan, sample: dict[str, np.ndarray], grid: Grid) -> None:
    """The empty arrays of all pieces."""
    nothing = {n: np.broadcast_to(np.zeros((), v.dtype), (plan.count, *v.shape[1:])) for n, v in sample.items()}
    empty = plan.finish(nothing) if plan.labelled else xr.Dataset()
    xr.Dataset(coords=empty.coords, attrs=empty.attrs).to_zarr(path, mode="w-", zarr_format=3, consolidated=False)
    group = zarr.open_group(path if plan.labelled else path / _PIECES, mode="a", zarr_format=3)
    for name, values in nothing.items():
        labels = empty[name] if plan.labelled else None
        group.create_array(
            name, shape=(*grid.shape, *values.shape[1:]), chunks=(*grid.tile, *values.shape[1:]), dtype=values.dtype,
            fill_value=blank(name, values.dtype), compressors=_CODECS,
            dimension_names=None if labels is None else [str(d) for d in labels.dims],
            attributes=None if labels is None else _plain(labels.attrs),
        )


def _consolidate(path: Path) -> None:
    """Gather the metadata of all arrays in one file, from which xarray opens the store at once."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that version 3 of the format does not ask for it; that run/ is no array
        zarr.consolidate_metadata(path, zarr_format=3)


def _plain(attributes: dict[Any, Any]) -> dict[str, Any]:
    return {str(k): v.tolist() if hasattr(v, "tolist") else v for k, v in attributes.items()}


def read(path: Path) -> Store:
    """The store of an earlier run."""
    file, field = path / "run" / "study.json", "store"
    try:
        words = json.loads(file.read_text())
        study = Resolved.from_dict(words["study"])
        grid = Grid(**{n: tuple(v) for n, v in words["grid"].items()})
        return Store(path, study, grid, tuple(words["arrays"]))
    except OSError as error:
        said = f"{file} cannot be read: {error.strerror}."
        raise InputError(field, "must be a folder that gearchaos run made", str(path), said) from None
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(field, "must hold a sound run/study.json", str(path), f"It is damaged: {error!r}.") from None


def _read_mark(path: Path) -> Mark | None:
    """The mark in a file, None if it is damaged: the tile then counts as not computed."""
    try:
        return Mark(**json.loads(path.read_text()))
    except (ValueError, TypeError):
        return None


def _write_text(path: Path, text: str) -> None:
    """Write a small file whole or not at all."""
    draft = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        draft.write_text(text)
        os.replace(draft, path)
    finally:
        draft.unlink(missing_ok=True)
