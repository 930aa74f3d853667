"""Loading of a result: a file, or a store of a finished or unfinished run."""

from __future__ import annotations

import os
import warnings
from collections.abc import Sized
from dataclasses import replace

import numpy as np
import xarray as xr

from gearchaos.datasets import load as load_file
from gearchaos.errors import InputError
from gearchaos.store.files.folder import LocalFolder, open_folder
from gearchaos.store.reading.missing import MissingParts, missing_parts
from gearchaos.store.store import Store, open_store
from gearchaos.studies.attractor_set import NOT_COMPUTED

_NAMED = 3
"""Largest number of missing blocks of work items, and of variables, that are named."""


def load(path: str | os.PathLike[str]) -> xr.Dataset:
    """Read the result of a study: a file that `save` wrote, or a store that `gearchaos run` made.

    Parameters
    ----------
    path : path
        A NetCDF file, the folder of a store, or the URL of a store such as ``s3://bucket/map.zarr``.

    Returns
    -------
    Dataset
        That of a file is in memory. The results in a store of a map or a diagram are read when they are used, so that
        it may be larger than the memory: select a part before you use the values.

    Raises
    ------
    InputError
        If there is no file or store, or it is damaged.

    Warns
    -----
    UserWarning
        If a part of a store is not computed or missing; it says which, and what the values there are.

    Examples
    --------
    >>> import gearchaos as gc
    >>> from tempfile import TemporaryDirectory
    >>> study = gc.Zones(gc.MeshModel.of(q0=0.1), "omega=0.9:1.1:2", "eps1=0.1:0.2:2")
    >>> with TemporaryDirectory() as folder:
    ...     finished = gc.run(study, out=f"{folder}/zones.zarr").finished
    ...     print(finished, gc.load(f"{folder}/zones.zarr").equals(gc.run(study)))
    True True
    """
    if not is_store(path):
        return load_file(path)
    store = open_store(open_folder(path).url)  # its values are read later, perhaps in another working directory
    if missing := missing_in_words(store):
        warnings.warn(f"{os.fspath(path)}: {missing}", stacklevel=2)
    return store.dataset()


def is_store(path: str | os.PathLike[str]) -> bool:
    """Whether this is the URL of an object store, or a folder; raises `InputError` unless it is a path."""
    if not isinstance(path, (str, os.PathLike)):
        raise InputError("path", "must be a path", path, "E.g. 'map.nc' or 'map.zarr'.")
    return not isinstance(open_folder(path), LocalFolder) or os.path.isdir(path)


def missing_in_words(store: Store) -> str:
    """What is not computed and what is lost of a store, and what the values there are; empty if nothing is missing."""
    if store.finished and not store.study.gridded:  # the Dataset is stored beside the results of work items
        return ""
    progress = store.progress()
    missing = missing_parts(store, progress)
    never = replace(missing, tiles=progress.missing(missing.tiles))
    lost = replace(missing, tiles=[tile for tile in missing.tiles if progress.done(tile)])
    sentences = []
    if never.tiles:
        sentences.append(f"{_tiles(store, never)} are not computed{_where(store, never)}")
    if lost.tiles:
        sentences.append(f"files of {listed(lost.arrays)} are missing or damaged for {_tiles(store, lost)}"
                         f"{_where(store, lost)}{_intact(store, lost)}. To repair it: {store.repair_command(progress)}")
    return ". ".join(sentences)


def listed(names: list[str]) -> str:
    """Names in words, of which the first are named."""
    return ", ".join(names[:_NAMED]) + _more(names)


def _more(names: Sized) -> str:
    """How many there are beyond those that are named."""
    return f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""


def _tiles(store: Store, missing: MissingParts) -> str:
    return f"{len(missing.tiles)} of {store.grid.count} tiles"


def _where(store: Store, missing: MissingParts) -> str:
    """Where these tiles are, and what the values there are."""
    boxes = missing.boxes(store.grid)
    named = [", ".join(f"{dim}={first}:{end}" for dim, (first, end) in zip(store.study.grid, box, strict=True))
             for box in boxes[:_NAMED]]
    return f", by position from 0: {'; '.join(named)}{_more(boxes)}; {_values(store)}"


def _values(store: Store) -> str:
    """What the values are that are missing."""
    if not store.study.gridded:
        return f"the attractor there is {NOT_COMPUTED}"
    fills = {store.fill(n) for n, a in store.arrays.items() if np.dtype(a.dtype).kind in "iu"}
    return f"values there are NaN, {' or '.join(map(str, sorted(fills)))} in integers"


def _intact(store: Store, lost: MissingParts) -> str:
    """That other variables are intact, where they are; attractors are compared by all of them."""
    return ", other variables are intact" if store.study.gridded and len(lost.arrays) < len(store.arrays) else ""
