"""Results read when they are used: a Dataset that may be larger than the memory, of an unfinished run too."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Iterator
from functools import cached_property
from itertools import product
from shlex import quote
from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from gearchaos.errors import InputError
from gearchaos.formats import load as load_file
from gearchaos.plugins import NotInstalledError
from gearchaos.store.blocks import is_written, read_tile, tiles_there
from gearchaos.store.check import in_words, missing
from gearchaos.store.objects import Objects
from gearchaos.store.store import FINISHED, STUDY, Store, checked, open_store
from gearchaos.store.tiles import Region, span, within


class StoredArray(BackendArray):
    """An array of results (*grid.shape, …) that is read from its store, block by block, when it is used."""

    def __init__(self, store: Store, name: str, lost: set[int]) -> None:
        spec = store.arrays[name]
        self._store, self._name, self._lost = store, name, lost
        self.shape, self.dtype = (*store.grid.shape, *spec.shape), np.dtype(spec.dtype)

    def __getitem__(self, key: indexing.ExplicitIndexer) -> np.ndarray:
        nothing = slice(0, 0)  # xarray cannot divide an empty slice with a negative step
        key = type(key)(tuple(nothing if isinstance(k, slice) and not range(n)[k] else k
                              for k, n in zip(key.tuple, self.shape, strict=True)))
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.BASIC, self.select)

    def select(self, key: tuple[int | slice, ...]) -> np.ndarray:
        """The values at a tuple of whole numbers and of slices with positive steps, one for each dimension."""
        slices = [k if isinstance(k, slice) else slice(k, k + 1) for k in key]
        chosen = [range(n)[k] for k, n in zip(slices, self.shape, strict=True)]
        grid, inner = chosen[: len(self._store.grid.shape)], tuple(slices[len(self._store.grid.shape):])
        out = np.empty((*map(len, grid), *self.shape[len(grid):]), self.dtype)
        for block in product(*(list(_by_block(r, b)) for r, b in zip(grid, self._store.grid.block, strict=True))):
            region = tuple(slice(r.start, r[-1] + 1) for _, r in block)
            values = self.read(region)[tuple(slice(None, None, r.step) for _, r in block)]
            out[tuple(target for target, _ in block)] = values
        return out[(*[slice(None)] * len(grid), *inner)][tuple(slice(None) if isinstance(k, slice) else 0 for k in key)]

    def read(self, region: Region) -> np.ndarray:
        """The values of a region of the grid within one block, with the fill value where none are computed.

        Raises `InputError` if they are damaged, or the store is gone.
        """
        store, (block,) = self._store, self._store.grid.blocks_in(region)
        fill, shape = store.arrays[self._name].fill, (*span(region), *store.arrays[self._name].shape)
        if block in self._lost:
            return np.full(shape, fill, self.dtype)
        try:
            if is_written(store, block):
                return np.asarray(self._array[region])
            out = np.full(shape, fill, self.dtype)
            whole = self._read_tiles(block, region, out)
            if is_written(store, block):  # meanwhile, and its tiles may have been deleted before they were listed
                return np.asarray(self._array[region])
            if whole:
                return out
            what = "a tile that is in no block yet"
        except InputError:  # it is a ValueError
            raise
        except (LookupError, RuntimeError, ValueError):
            what = store.shard(self._name, block)
        raise InputError("store", "must be undamaged", str(store.objects), f"{what} does not have its checksum. "
                         f"gearchaos check {quote(str(store.objects))} finds all damage.")

    def _read_tiles(self, block: int, region: Region, out: np.ndarray) -> bool:
        """Read what is computed of a block that is not written; whether all tiles that are there are undamaged."""
        store, whole = self._store, True
        for tile in sorted(set(store.grid.tiles_in(region)) & tiles_there(store, block)):
            found = read_tile(store, tile, [self._name])
            if found is None:
                whole = False
                continue
            part = store.grid.region(tile)
            both = tuple(slice(max(p.start, r.start), min(p.stop, r.stop)) for p, r in zip(part, region, strict=True))
            out[within(both, region)] = found[1][self._name][within(both, part)]
        if whole and store.objects.get(STUDY) is None:
            raise InputError("store", "must still be there when its values are read", str(store.objects),
                             "It was moved or deleted after it was opened: load it again.")
        return whole

    @cached_property
    def _array(self) -> Any:
        return self._store.zarr_array(self._name)


def _by_block(chosen: range, size: int) -> Iterator[tuple[slice, range]]:
    """Divide positions along a dimension into those in each block of ``size``; with where they are in the result."""
    first = 0
    while first < len(chosen):
        end = (chosen[first] // size + 1) * size  # of the block with this position
        last = min(len(chosen), first + -(-(end - chosen[first]) // chosen.step))
        yield slice(first, last), chosen[first:last]
        first = last


def results(store: Store) -> dict[str, np.ndarray]:
    """The results (N, ...) of all N work items by name, with the fill value where they are not computed yet."""
    lost, count = missing(store).lost, store.study.count
    out = {}
    for name, spec in store.arrays.items():
        array = StoredArray(store, name, {block for block, names in lost.items() if name in names})
        out[name] = array.select((slice(None),) * len(array.shape)).reshape(count, *spec.shape)
    return out


def dataset(store: Store) -> xr.Dataset:
    """The Dataset that the study returns, with fill values where nothing is computed.

    The results of a gridded study are read when they are used; `InputError` is raised then if they are damaged. Of
    another study that is not finished nothing but the results of work items is read.
    """
    if not store.study.gridded and not store.finished:
        if store.grid.count == 1 and ((found := missing(store)).never or found.lost):
            raise InputError("store", "must hold its only tile", str(store.objects), f"To compute it: {found.repair}")
        return store.study.finish(results(store))
    if damaged := store.damaged_files():
        raise InputError("store", "must be undamaged", str(store.objects),
                         f"To repair {', '.join(damaged)}: {missing(store).repair}")
    opened = xr.open_zarr(store.objects.zarr, chunks=None)
    if not store.study.gridded:
        written = json.loads(checked(store.objects.get(FINISHED)))  # in the order of the study; zarr lists by alphabet
        variables = opened.load()[[n for f in written if (n := f.removesuffix("/zarr.json")) in opened.variables]]
        return variables.reset_coords()[list(variables.variables)].set_coords(opened.coords)
    lost = missing(store).lost
    arrays = {n: StoredArray(store, n, {b for b, names in lost.items() if n in names}) for n in store.arrays}
    ordered = opened[list(arrays)]  # zarr lists variables by the alphabet
    return ordered.assign({name: lazy(ordered[name].variable, array) for name, array in arrays.items()})


def lazy(variable: xr.Variable, array: StoredArray) -> xr.Variable:
    """A variable with other values, which are read when they are used and then kept in memory."""
    cached: Any = indexing.MemoryCachedArray(indexing.LazilyIndexedArray(array))
    return xr.Variable(variable.dims, indexing.CopyOnWriteArray(cached), variable.attrs)


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
        If a part of a store is not computed or missing; it says which, and what the values there are. If the package
        that has the study of a finished store, or its stiffness, is not installed; it says which.

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
    try:
        store = open_store(path)
    except NotInstalledError as error:
        if (objects := Objects(path)).get(FINISHED) is None:
            raise
        warnings.warn(f"{os.fspath(path)}: the data are read, but not what made them: {error}", stacklevel=2)
        return xr.open_zarr(objects.zarr, chunks=None)
    if words := in_words(store):
        warnings.warn(f"{os.fspath(path)}: {words}", stacklevel=2)
    return dataset(store)


def is_store(path: str | os.PathLike[str]) -> bool:
    """Whether this is the URL of an object store, or a folder; raises `InputError` unless it is a path."""
    if not isinstance(path, (str, os.PathLike)):
        raise InputError("path", "must be a path", path, "E.g. 'map.nc' or 'map.zarr'.")
    folder = Objects(path).folder
    return folder is None or folder.is_dir()
