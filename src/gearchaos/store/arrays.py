"""The Zarr arrays of a store and their metadata."""

from __future__ import annotations

import shutil
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
import zarr

from gearchaos.errors import InputError
from gearchaos.store.chunks import CODECS
from gearchaos.store.tiles import Grid
from gearchaos.studies.fill_values import fill_value
from gearchaos.studies.study import Study

FORMAT = 1
"""Version of the layout of a store; a store of another version cannot be opened."""

ITEMS = "pieces"
"""Folder of the results of work items, which format 1 calls pieces, for a study whose Dataset is computed from them at
the end."""


@dataclass(frozen=True)
class ArraySpec:
    """The dtype of an array of results, and its shape for one work item."""

    dtype: str
    shape: tuple[int, ...]


def create_arrays(path: Path, study: Study, arrays: dict[str, ArraySpec], grid: Grid) -> None:
    """Create a folder with empty arrays for the results of all work items, and with the coordinates of the Dataset."""
    zeros = {n: np.broadcast_to(np.zeros((), a.dtype), (study.count, *a.shape)) for n, a in arrays.items()}
    empty = study.finish(zeros) if study.gridded else xr.Dataset()
    xr.Dataset(coords=empty.coords, attrs=empty.attrs).to_zarr(path, mode="w-", zarr_format=3, consolidated=False)
    group = zarr.open_group(path if study.gridded else path / ITEMS, mode="a", zarr_format=3)
    for name, values in zeros.items():
        labels = empty[name] if study.gridded else None
        group.create_array(
            name, shape=(*grid.shape, *values.shape[1:]), chunks=(*grid.tile, *values.shape[1:]), dtype=values.dtype,
            fill_value=fill_value(name, values.dtype), compressors=CODECS,
            dimension_names=None if labels is None else [str(d) for d in labels.dims],
            attributes=None if labels is None else _plain(labels.attrs),
        )
    zarr.open_group(path / "run", mode="w-", zarr_format=3)  # as a group, since Zarr warns of other folders
    _consolidate(path)


def restore_metadata(path: Path, fresh: Path) -> None:
    """Replace metadata and coordinates of a store by those of a newly created empty store; results are kept."""
    for one in fresh.rglob("*"):
        _check_node(path / one.relative_to(fresh), one.is_dir())
    shutil.copytree(fresh, path, dirs_exist_ok=True)


def _check_node(path: Path, folder: bool) -> None:
    """Raise `InputError` if ``path`` is a file but a store has a folder there, or the other way round."""
    if path.exists() and not (path.is_dir() if folder else path.is_file()):
        expected = "folder" if folder else "file"
        raise InputError("store", f"must have a {expected} at this path", str(path), "Remove it and run again.")


def add_results(dataset: xr.Dataset, path: Path) -> None:
    """Add the variables of a finished Dataset to a store."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Zarr warns that format 3 does not yet specify strings
        dataset.to_zarr(path, mode="a", zarr_format=3, consolidated=False)
    _consolidate(path)


def _consolidate(path: Path) -> None:
    """Collect the metadata of all arrays in one file, so that xarray need not search the folder."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Zarr warns that format 3 does not specify this, and of files in run/
        zarr.consolidate_metadata(path, zarr_format=3)


def _plain(attributes: dict[Any, Any]) -> dict[str, Any]:
    """Attributes with lists for NumPy arrays, as JSON needs them."""
    return {str(k): v.tolist() if hasattr(v, "tolist") else v for k, v in attributes.items()}
