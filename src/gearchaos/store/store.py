"""A store: a Zarr group with the results of a study, which xarray opens, and what is known of the run.

What is done follows from what is there. The results of a tile are one object, ``run/tiles/BLOCK/TILE``. When all tiles
of a block are there, its results are written as one shard of each array, then ``run/blocks/BLOCK`` with their
checksums; then the tiles are deleted. ``run/study.json`` describes the study, its division, and the versions of
packages; ``run/finished`` is there when the Dataset is complete. All objects have checksums.
"""

from __future__ import annotations

import json
import os
import platform
import warnings
import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from math import prod
from typing import Any

import numpy as np
import xarray as xr
import zarr
from zarr.codecs import Crc32cCodec, ZstdCodec

from gearchaos.datasets import PACKAGES
from gearchaos.errors import ChangedFileError, InputError
from gearchaos.plugins import NotInstalledError
from gearchaos.store.objects import Objects
from gearchaos.store.record import from_record, to_record
from gearchaos.store.tiles import Grid
from gearchaos.studies.core.study import Study

FORMAT = 3  # version of the layout of stores
STUDY, FINISHED = "run/study.json", "run/finished"
TILES, BLOCKS, FAILED = "run/tiles", "run/blocks", "run/failed"
ITEMS = "items"  # folder of the results of work items, for a study whose Dataset is computed from them at the end

_CODECS = (ZstdCodec(level=1), Crc32cCodec())
_REMEDY = ("Copy run/study.json from a new store of the same study, computed by the same version, or begin a new "
           "store in another folder.")


@dataclass(frozen=True)
class ArraySpec:
    """The dtype of an array of results, and its shape for one work item."""

    dtype: str
    shape: tuple[int, ...]

    @property
    def item_bytes(self) -> int:
        """Size of the result of one work item in bytes."""
        return prod(self.shape) * np.dtype(self.dtype).itemsize

    @property
    def fill(self) -> Any:
        """The value where nothing is computed: NaN, −1 in signed integers, the largest value in unsigned ones.

        It is no label, no period and no code, so that what is missing never looks like a result.
        """
        dtype = np.dtype(self.dtype)
        if dtype.kind in "iu":
            return -1 if dtype.kind == "i" else np.iinfo(dtype).max
        return np.nan if dtype.kind in "fc" else True


@dataclass(frozen=True)
class Store:
    """A store that can be read."""

    objects: Objects
    study: Study
    grid: Grid  # the division of the study into tiles, chunks and blocks
    arrays: dict[str, ArraySpec]  # the arrays of the results of work items, by name
    versions: dict[str, str]  # of the packages on which results depend, when the store was created
    shards: int = 1  # for which its blocks were chosen
    files: Mapping[str, int] | None = None  # the CRC-32 of metadata and coordinates by the names of their objects

    def array_path(self, name: str) -> str:
        """The path of an array of results in the group."""
        return name if self.study.gridded else f"{ITEMS}/{name}"

    def shard(self, name: str, block: int) -> str:
        """The name of the object with the results of a block in an array."""
        position = [*np.unravel_index(block, self.grid.blocks), *[0] * len(self.arrays[name].shape)]
        return f"{self.array_path(name)}/c/{'/'.join(map(str, position))}"

    def tile(self, number: int) -> str:
        """The name of the object with the results of a tile."""
        return f"{TILES}/{self.grid.block_of(number)}/{number}"

    def failed(self, tile: int) -> str:
        """The name of the object with the error of a tile."""
        return f"{FAILED}/{tile}"

    @property
    def block(self) -> dict[str, int]:
        """Sizes by dimension of the parts of the grid that are read at once where the whole may not fit in memory."""
        return {d: min(n, b) for (d, n), b in zip(self.study.grid.items(), self.grid.block, strict=True)}

    @property
    def finished(self) -> bool:
        """Whether the Dataset is complete."""
        return self.objects.get(FINISHED) is not None

    def create_array(self, target: Any, name: str, labels: xr.DataArray | None = None) -> zarr.Array:
        """Create an array for results in a store of zarr, with the dimensions and attributes of ``labels``."""
        spec, grid = self.arrays[name], self.grid
        return zarr.create_array(
            target, name=self.array_path(name), shape=(*grid.shape, *spec.shape), dtype=np.dtype(spec.dtype),
            chunks=(*grid.chunk, *spec.shape), shards=(*grid.block, *spec.shape), compressors=_CODECS,
            fill_value=spec.fill, zarr_format=3, config={"write_empty_chunks": True},
            dimension_names=None if labels is None else [str(d) for d in labels.dims],
            attributes=None if labels is None else {
                str(k): v.tolist() if hasattr(v, "tolist") else v for k, v in labels.attrs.items()})

    def metadata(self, finished: xr.Dataset | None = None) -> dict[str, bytes]:
        """Metadata and coordinates by the names of their objects, with the variables of a Dataset made at the end.

        Those of each variable follow one another, in the order of the Dataset.
        """
        written: dict[str, Any] = {}
        memory = zarr.storage.MemoryStore(written)
        empty = xr.Dataset() if finished is None else finished
        if self.study.gridded:  # zeros that share one element take no memory
            empty = self.study.finish({n: np.broadcast_to(np.zeros((), a.dtype), (self.study.count, *a.shape))
                                       for n, a in self.arrays.items()})
        kept = xr.Dataset(coords=empty.coords, attrs=empty.attrs) if self.study.gridded else empty
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Zarr warns that format 3 does not yet specify strings and consolidation
            kept.to_zarr(memory, mode="w", zarr_format=3, consolidated=False)
            for name in self.arrays:
                self.create_array(memory, name, empty[name] if self.study.gridded else None)
            zarr.open_group(memory, path="run", mode="a", zarr_format=3)  # Zarr warns of folders that are no group
            zarr.consolidate_metadata(memory, zarr_format=3)
        order = {str(name): number for number, name in enumerate(kept.variables)}  # xarray writes them in any order
        names = sorted(written, key=lambda name: (order.get(name.partition("/")[0], -1), name))
        return {name: written[name].to_bytes() for name in names}

    def description(self) -> bytes:
        """The content of ``run/study.json``, with its own checksum."""
        content = {
            "format": FORMAT, "study": to_record(self.study), "grid": asdict(self.grid), "shards": self.shards,
            "arrays": {n: asdict(a) for n, a in self.arrays.items()}, "versions": self.versions,
            "machine": {"system": platform.platform(), "processor": platform.machine(), "cores": os.cpu_count(),
                        "python": platform.python_version()},
            "files": self.files,
        }
        return json.dumps({**content, "checksum": _checksum(content)}, indent=2).encode()

    def damaged_files(self) -> list[str]:
        """Names of metadata, coordinates and results made at the end that are missing or have another checksum."""
        finished, damaged = self.objects.get(FINISHED), []
        expected = dict(self.files or {})
        if finished is not None:
            try:
                expected |= {str(n): int(c) for n, c in json.loads(checked(finished)).items()}
            except ValueError:
                damaged.append(FINISHED)
        for name, checksum in expected.items():
            content = self.objects.get(name)
            if content is None or zlib.crc32(content) != checksum:
                damaged.append(name)
        return damaged

    def zarr_array(self, name: str) -> zarr.Array:
        """An array of results as zarr reads it."""
        return zarr.open_array(self.objects.zarr, path=self.array_path(name), mode="r", zarr_format=3)


def with_checksum(content: bytes) -> bytes:
    """Bytes followed by their CRC-32."""
    return content + zlib.crc32(content).to_bytes(4, "little")


def checked(content: bytes | None) -> bytes:
    """The bytes without their checksum; raises ValueError unless they agree."""
    if content is None or with_checksum(content[:-4]) != content:
        raise ValueError("the checksum differs")
    return content[:-4]


def _checksum(content: Mapping[str, Any]) -> int:
    """CRC-32 of a value for JSON, whatever the spaces and the order of its file."""
    return zlib.crc32(json.dumps(content, sort_keys=True).encode())


def versions(study: Study) -> dict[str, str]:
    """The versions of the packages on which results depend, by attribute of a Dataset."""
    return {n: v for n, v in study.provenance().items() if n.endswith("_version")}


def create(store: Store) -> Store:
    """Write the objects of a new store, unless another shard has done so meanwhile.

    Raises `InputError` if its folder has anything else in it.
    """
    objects, content = store.objects, store.metadata()
    names = objects.names() if objects.exists() else []
    if objects.get(STUDY) is not None:  # asked after the names: another shard writes this before any results
        return open_store(objects)
    if any(name.startswith((f"{TILES}/", f"{BLOCKS}/")) for name in names):
        raise _damaged(objects, "run/study.json is missing, other files of a store are there")
    for name in names:
        if name not in content and not name.startswith("run/"):
            raise InputError("store", "must be a new folder, or one that gearchaos run made", str(objects),
                             f"It has other files, such as {name}.")
    return write_metadata(store, content)


def write_metadata(store: Store, content: Mapping[str, bytes]) -> Store:
    """Write metadata and coordinates, then the description: a folder without it is no store yet.

    What was made from all results is to be made again.
    """
    for name, value in content.items():
        store.objects.put(name, value)
    store.objects.delete([FINISHED])
    made = replace(store, files={name: zlib.crc32(value) for name, value in content.items()})
    if made.files != store.files:  # in a new store, or since another version of zarr writes them otherwise
        store.objects.put(STUDY, made.description(), durable=True)
    store.objects.keep([*content, STUDY])
    return made


def write_finished(store: Store, made: xr.Dataset | None) -> None:
    """Write the Dataset that is ``made`` from all results, if any, and delete what is not needed any more."""
    content = {} if made is None else store.metadata(made)
    content = {name: value for name, value in content.items() if zlib.crc32(value) != (store.files or {}).get(name)}
    for name, value in content.items():
        store.objects.put(name, value)
    store.objects.keep(content)
    store.objects.delete_all(TILES)
    files = {name: zlib.crc32(value) for name, value in content.items()}
    store.objects.put(FINISHED, with_checksum(json.dumps(files).encode()))
    store.objects.keep([FINISHED])


def open_store(location: str | os.PathLike[str] | Objects) -> Store:
    """The store at a location; raises `InputError` if there is none, or it is damaged or of an unknown format."""
    objects = location if isinstance(location, Objects) else Objects(location)
    if objects.exists():
        if (content := objects.get(STUDY)) is not None:
            return from_description(objects, content)
        if objects.folder is None or objects.folder.is_dir():
            names = objects.names("run")
            if any(name.startswith((f"{TILES}/", f"{BLOCKS}/", FINISHED)) for name in names):
                raise _damaged(objects, "run/study.json is missing, other files of a store are there")
            if names:
                raise InputError("store", "must have been made", str(objects), "gearchaos run compiles its kernels "
                                 "first. If it was stopped meanwhile, the same command makes the store.")
    raise InputError("store", "must be a folder that gearchaos run made", str(objects), f"There is no {STUDY} in it.")


def from_description(objects: Objects, content: bytes) -> Store:
    """The store with this content of ``run/study.json``; raises `InputError` if that is damaged."""
    try:
        found = json.loads(content)
        if found["format"] != FORMAT:
            raise InputError("store", f"must have format {FORMAT}", found["format"],
                             "It was made by another version of gearchaos: compute the study again in a new folder.")
        if found.pop("checksum") != _checksum(found):
            raise ValueError("it does not have its checksum")
        grid = Grid(**{name: tuple(values) for name, values in found["grid"].items()})
        arrays = {n: ArraySpec(a["dtype"], tuple(a["shape"])) for n, a in found["arrays"].items()}
        study = from_record(found["study"])
    except ChangedFileError as error:
        raise InputError(
            "store", "must find the tables of its gears as they were when it was made", str(objects),
            f"The table {error.value} changed since, or is missing. Restore it to go on with this store, or compute "
            "the study with the new table into a new folder.") from None
    except NotInstalledError as error:
        raise NotInstalledError(error.field, error.rule, error.value, _brought_by(found["versions"])) from None
    except InputError as error:
        if error.field == "store":
            raise
        raise _damaged(objects, str(error)) from None
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise _damaged(objects, str(error)) from None
    return Store(objects, study, grid, arrays, found["versions"], found["shards"], found["files"])


def _brought_by(versions: Mapping[str, str]) -> str:
    """Which packages a store was made with, besides those of gearchaos."""
    packages = [f"{key.removesuffix('_version')} {versions[key]}" for key in versions
                if key.removesuffix("_version") not in PACKAGES]
    return f"The store was made with {' and '.join(packages)}: install it again."


def _damaged(objects: Objects, why: str) -> InputError:
    """The error for a store whose description is missing or damaged."""
    advice = f"It is damaged, or not a store: {why.removesuffix('.')}. {_REMEDY}"
    return InputError("store", "must hold an undamaged run/study.json", str(objects), advice)
