"""Arrays of a store as variables of a Dataset that are read from the store only when, and as far as, they are used."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from itertools import product
from typing import Any

import numpy as np
import xarray as xr
from xarray.backends import BackendArray
from xarray.core import indexing

from gearchaos.store.tiles import doubled

Region = tuple[slice, ...]
"""A part of the grid of work items: a range along each dimension, with step 1."""

_BLOCK_BYTES = 2**20
"""Most bytes of the largest array in a block that is read at once, unless a chunk of the store is larger."""


class StoredArray(BackendArray):
    """An array of results in a store, which xarray indexes.

    Parameters
    ----------
    read : callable
        Function from a region of the grid to the values there, with the fill value where nothing is computed.
    shape : tuple of int
        Shape of the grid, followed by that of the results of one work item.
    dtype : dtype
    block : tuple of int
        Shape of the parts of the grid that are read at once.
    """

    def __init__(
        self, read: Callable[[Region], np.ndarray], shape: tuple[int, ...], dtype: np.dtype, block: tuple[int, ...]
    ) -> None:
        self.read, self.shape, self.dtype, self.block = read, shape, dtype, block

    def __getitem__(self, key: indexing.ExplicitIndexer) -> np.ndarray:
        return indexing.explicit_indexing_adapter(key, self.shape, indexing.IndexingSupport.BASIC, self._select)

    def _select(self, key: tuple[int | slice, ...]) -> np.ndarray:
        """The values at a tuple of whole numbers and of slices with positive steps, one for each dimension."""
        slices = [k if isinstance(k, slice) else slice(k, k + 1) for k in key]
        chosen = [range(n)[k] for k, n in zip(slices, self.shape, strict=True)]
        out = self._read_ranges(chosen[: len(self.block)])
        out = out[(*[slice(None)] * len(self.block), *slices[len(self.block):])]
        return out[tuple(slice(None) if isinstance(k, slice) else 0 for k in key)]

    def _read_ranges(self, chosen: list[range]) -> np.ndarray:
        """The values at the combinations of some positions along each dimension of the grid."""
        if all(r.step == 1 for r in chosen) and all(map(len, chosen)):
            return self.read(tuple(slice(r.start, r.stop) for r in chosen))
        out = np.empty((*map(len, chosen), *self.shape[len(chosen):]), self.dtype)
        for target, source in _blocks_of_ranges(chosen, self.block):
            region = tuple(slice(r.start, r[-1] + 1) for r in source)
            out[target] = self.read(region)[tuple(slice(None, None, r.step) for r in source)]
        return out


def _blocks_of_ranges(
    chosen: list[range], block: tuple[int, ...]
) -> Iterator[tuple[Region, tuple[range, ...]]]:
    """Divide positions along each dimension into those in each block; with the part of the result that they fill."""
    parts = [list(_blocks_of_range(r, n)) for r, n in zip(chosen, block, strict=True)]
    for combination in product(*parts):
        yield tuple(t for t, _ in combination), tuple(s for _, s in combination)


def _blocks_of_range(chosen: range, size: int) -> Iterator[tuple[slice, range]]:
    """Divide positions into those in each block of ``size``."""
    first = 0
    while first < len(chosen):
        end = (chosen[first] // size + 1) * size  # of the block with this position
        last = min(len(chosen), first + -(-(end - chosen[first]) // chosen.step))
        yield slice(first, last), chosen[first:last]
        first = last


def reading_block(shape: tuple[int, ...], chunk: tuple[int, ...], item_bytes: int) -> tuple[int, ...]:
    """Shape of the parts of a grid that are read at once: a chunk, doubled while at most `_BLOCK_BYTES`.

    ``item_bytes`` is the size of the largest array for one work item.
    """
    within = tuple(min(c, n) for c, n in zip(chunk, shape, strict=True))
    return doubled(within, shape, _BLOCK_BYTES // max(1, item_bytes))


def regions(shape: tuple[int, ...], block: tuple[int, ...]) -> Iterator[Region]:
    """The blocks of a grid, in C order."""
    starts = (range(0, n, b) for n, b in zip(shape, block, strict=True))
    for corner in product(*starts):
        yield tuple(slice(i, min(i + b, n)) for i, b, n in zip(corner, block, shape, strict=True))


def parts(dataset: xr.Dataset, block: Mapping[str, int]) -> Iterator[tuple[Region, xr.Dataset]]:
    """The parts of a Dataset, of these sizes along the dimensions of a grid, and the region of the grid of each."""
    shape = tuple(dataset.sizes[dim] for dim in block)
    for region in regions(shape, tuple(block.values())):
        yield region, dataset.isel(dict(zip(block, region, strict=True)))


def with_stored_arrays(dataset: xr.Dataset, arrays: Mapping[str, StoredArray]) -> xr.Dataset:
    """A Dataset whose variables of these names are read from a store when they are used, and then kept in memory.

    Their dimensions and attributes are those of the variables in ``dataset``.
    """
    return dataset.assign({name: _lazy(dataset[name].variable, array) for name, array in arrays.items()})


def _lazy(variable: xr.Variable, array: StoredArray) -> xr.Variable:
    """A variable with other values, which are read when they are used."""
    cached: Any = indexing.MemoryCachedArray(indexing.LazilyIndexedArray(array))
    return xr.Variable(variable.dims, indexing.CopyOnWriteArray(cached), variable.attrs)
