"""The Zarr arrays of a store and their metadata."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import xarray as xr
import zarr

from gearchaos.store.errors import damaged_description
from gearchaos.store.files.checked_files import read_as
from gearchaos.store.files.folder import Folder
from gearchaos.store.layout.chunks import CODECS
from gearchaos.store.layout.layout import Layout
from gearchaos.store.layout.specs import ITEMS
from gearchaos.store.layout.zarr_metadata import ArraySchema


def create_arrays(store: Layout) -> None:
    """Create the folder of a store with empty arrays for its results, and with the coordinates of the Dataset."""
    study, target = store.study, store.folder.zarr_store(read_only=False)
    empty = _empty_dataset(store) if study.gridded else xr.Dataset()
    xr.Dataset(coords=empty.coords, attrs=empty.attrs).to_zarr(target, mode="w-", zarr_format=3, consolidated=False)
    group = zarr.open_group(target, path="" if study.gridded else ITEMS, mode="a", zarr_format=3)
    for name, spec in store.arrays.items():
        labels = empty[name] if study.gridded else None
        group.create_array(
            name, shape=(*store.grid.shape, *spec.shape), chunks=store.chunk_shape(name), dtype=np.dtype(spec.dtype),
            fill_value=store.fill(name), compressors=CODECS,
            shards=(*store.grid.group, *spec.shape) if store.sharded else None,
            dimension_names=None if labels is None else [str(d) for d in labels.dims],
            attributes=None if labels is None else _plain(labels.attrs),
        )
    zarr.open_group(target, path="run", mode="w-", zarr_format=3)  # as a group, since Zarr warns of other folders
    _consolidate(store.folder)


def _empty_dataset(store: Layout) -> xr.Dataset:
    """The Dataset of a gridded study with zeros, which share one element: it takes no memory."""
    count = store.study.count
    zeros = {n: np.broadcast_to(np.zeros((), a.dtype), (count, *a.shape)) for n, a in store.arrays.items()}
    return store.study.finish(zeros)


def restore_metadata(folder: Folder, fresh: Folder) -> None:
    """Replace metadata and coordinates of a store by those of a newly created empty store; results are kept."""
    for name, _ in fresh.list():
        folder.write(name, fresh.read(name))


def check_layout(store: Layout, damaged_files: Callable[[], list[str]]) -> None:
    """Raise `InputError` unless the arrays have the shape, the chunks and the groups that ``run/study.json`` says.

    An array whose metadata are damaged is left out; the next run writes them again.
    """
    for name, spec in store.arrays.items():
        expected = (*store.grid.shape, *spec.shape), (*store.grid.group, *spec.shape), store.chunk_shape(name)
        metadata = f"{store.array_folder(name)}/zarr.json"
        found = read_as(ArraySchema, store.folder, metadata)
        if found is not None and found.layout != expected and metadata not in damaged_files():
            why = f"groups of {expected[1]} over {expected[0]} are not those of its arrays, {found.layout[1]}"
            raise damaged_description(store.folder, why)


def add_results(dataset: xr.Dataset, folder: Folder) -> None:
    """Add the variables of a finished Dataset to a store."""
    folder.delete("run/zarr.json")  # of which there is no checksum; Zarr reads it to collect the metadata
    zarr.open_group(folder.zarr_store(read_only=False), path="run", mode="a", zarr_format=3)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Zarr warns that format 3 does not yet specify strings
        dataset.to_zarr(folder.zarr_store(read_only=False), mode="a", zarr_format=3, consolidated=False)
    _consolidate(folder)


def _consolidate(folder: Folder) -> None:
    """Collect the metadata of all arrays in one file, so that xarray need not search the folder."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Zarr warns that format 3 does not specify this, and of files in run/
        zarr.consolidate_metadata(folder.zarr_store(read_only=False), zarr_format=3)


def _plain(attributes: dict[Any, Any]) -> dict[str, Any]:
    """Attributes with lists for NumPy arrays, as JSON needs them."""
    return {str(k): v.tolist() if hasattr(v, "tolist") else v for k, v in attributes.items()}
