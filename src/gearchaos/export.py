"""Export of a Dataset that does not fit into memory, as a NetCDF file with the content that `gearchaos.save` writes.

The arrays of results are read and written block by block, one variable after another.
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any
from uuid import uuid4

import h5netcdf
import numpy as np
import xarray as xr
from xarray.backends import H5NetCDFStore

from gearchaos.datasets import parts, with_checksums

Block = Mapping[str, int]
"""Sizes of the parts of a grid that are read at once, by dimension."""

Convert = Callable[[xr.Dataset], xr.Dataset]
"""Function from a part of a Dataset to the same part in other units."""


def export_dataset(dataset: xr.Dataset, stored: Collection[str], block: Block, path: Path, convert: Convert) -> None:
    """Write a Dataset as NetCDF with checksums; the file appears, or replaces an older one, only when it is complete.

    Only a block of one of its ``stored`` variables, those over all dimensions of the grid, perhaps with further ones,
    is held in memory at a time, and all other variables. ``block`` has the sizes of a block along the dimensions of the
    grid, which are also those of the chunks of the file. ``convert`` is applied to each block with all coordinates; it
    may change values and attributes, but no names and dimensions. Raises OSError with the path, if the file cannot be
    written, for example on a full disk.
    """
    partial = path.with_name(f".{uuid4().hex}.partial")  # the file's own name could make this too long
    try:
        with _GuardedFile(partial) as file:
            _write(file, dataset, stored, block, convert)
        os.replace(partial, path)
    except OSError as error:  # the error of a full disk has no path
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error
    finally:
        partial.unlink(missing_ok=True)


def _write(file: _GuardedFile, dataset: xr.Dataset, stored: Collection[str], block: Block, convert: Convert) -> None:
    """Write the file of a Dataset, by an outline of it with zeros that take no memory for the stored variables."""
    out = convert(dataset.drop_vars(stored))
    first = convert(dataset.isel(dict.fromkeys(block, slice(0, 1))))
    for name in dataset.data_vars:
        if name in stored:
            sample, whole = first[name].variable, dataset[name].variable
            zeros = np.broadcast_to(np.zeros((), sample.dtype), whole.shape)
            out[name] = xr.Variable(whole.dims, zeros, sample.attrs)
            out[name].encoding["chunksizes"] = tuple(
                min(n, block.get(str(d), n)) for d, n in zip(whole.dims, whole.shape, strict=True))
    outline, netcdf = with_checksums(out[list(dataset.data_vars)]), h5netcdf.File(file, "w")
    try:
        outline.dump_to_store(H5NetCDFStore(netcdf), writer=_BlockWriter(dataset, stored, block, convert, file))
    finally:
        try:
            netcdf.close()
        except Exception:  # one with missing parts may not close cleanly
            if file.error is None:
                raise
    file.check()


class _BlockWriter:
    """Writer of variables for xarray: stored ones block by block, others at once."""

    def __init__(
        self, dataset: xr.Dataset, stored: Collection[str], block: Block, convert: Convert, file: _GuardedFile
    ) -> None:
        self.dataset, self.stored, self.block, self.convert, self.file = dataset, stored, block, convert, file

    def add(self, source: Any, target: Any, region: Any = None) -> None:
        """Write a variable; ``source`` has its values, or zeros in their place if it is stored."""
        name = target.variable_name
        if name not in self.stored:
            target[...] = source
            return
        for region, part in parts(self.dataset[[name]], self.block):
            target[region] = self.convert(part)[name].values
            self.file.check()


class _GuardedFile(io.RawIOBase):
    """A new file for the HDF5 library, which cannot recover from a full disk.

    The first error is kept in ``error``; from then on everything is accepted and nothing is written, so that the
    library can close the file. `check` raises the error.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open("w+b", buffering=0)
        self.error: OSError | None = None

    def check(self) -> None:
        """Raise the first error, if there was one."""
        if self.error is not None:
            raise self.error

    def write(self, content: Any) -> int:
        rest = memoryview(content).cast("B")
        length = len(rest)
        try:
            while len(rest) and self.error is None:
                rest = rest[self._file.write(rest):]
        except OSError as error:
            self.error = error
        return length

    def truncate(self, size: int | None = None) -> int:
        try:
            if self.error is None:
                self._file.truncate(size)
        except OSError as error:
            self.error = error
        return self.tell() if size is None else size

    def readinto(self, buffer: Any) -> int:
        return self._file.readinto(buffer)

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        return self._file.tell()

    def readable(self) -> bool:
        return True

    def writable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def close(self) -> None:
        self._file.close()
        super().close()
