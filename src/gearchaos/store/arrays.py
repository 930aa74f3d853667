"""The empty arrays of a store, which decide all its metadata."""

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
from gearchaos.studies.plan import Plan
from gearchaos.studies.verdict_variables import blank

FORMAT = 1

PIECES = "pieces"
"""Where the arrays lie that are not the Dataset's own."""


@dataclass(frozen=True)
class Layout:
    """Of an array over the pieces of a study: its kind of number, and its shape for one piece."""

    dtype: str
    shape: tuple[int, ...]


def lay_out(path: Path, plan: Plan, arrays: dict[str, Layout], grid: Grid) -> None:
    """Make the empty arrays of all pieces in a new folder, and what the Dataset has beside them."""
    nothing = {n: np.broadcast_to(np.zeros((), a.dtype), (plan.count, *a.shape)) for n, a in arrays.items()}
    empty = plan.finish(nothing) if plan.labelled else xr.Dataset()
    xr.Dataset(coords=empty.coords, attrs=empty.attrs).to_zarr(path, mode="w-", zarr_format=3, consolidated=False)
    group = zarr.open_group(path if plan.labelled else path / PIECES, mode="a", zarr_format=3)
    for name, values in nothing.items():
        labels = empty[name] if plan.labelled else None
        group.create_array(
            name, shape=(*grid.shape, *values.shape[1:]), chunks=(*grid.tile, *values.shape[1:]), dtype=values.dtype,
            fill_value=blank(name, values.dtype), compressors=CODECS,
            dimension_names=None if labels is None else [str(d) for d in labels.dims],
            attributes=None if labels is None else _plain(labels.attrs),
        )
    zarr.open_group(path / "run", mode="w-", zarr_format=3)  # else the store holds what is no part of a store
    _consolidate(path)


def restore(path: Path, fresh: Path) -> None:
    """Copy every file of a fresh layout over that of a store; the chunks that tiles filled stay."""
    for one in fresh.rglob("*"):
        _check_kind(path / one.relative_to(fresh), one.is_dir())
    shutil.copytree(fresh, path, dirs_exist_ok=True)


def _check_kind(path: Path, folder: bool) -> None:
    """Raise `InputError` if something else is where a file or a folder of a store belongs."""
    if path.exists() and not (path.is_dir() if folder else path.is_file()):
        kind = "folders" if folder else "files"
        raise InputError("store", f"must have {kind} where its own lie", str(path), "Remove it and run again.")


def put(dataset: xr.Dataset, path: Path) -> None:
    """Add a finished Dataset to a store."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that version 3 of the format has no final word on text
        dataset.to_zarr(path, mode="a", zarr_format=3, consolidated=False)
    _consolidate(path)


def _consolidate(path: Path) -> None:
    """Gather the metadata of all arrays in one file, from which xarray opens the store at once."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that version 3 of the format does not ask for it; that run/ is no array
        zarr.consolidate_metadata(path, zarr_format=3)


def _plain(attributes: dict[Any, Any]) -> dict[str, Any]:
    return {str(k): v.tolist() if hasattr(v, "tolist") else v for k, v in attributes.items()}
