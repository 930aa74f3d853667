"""Loading of a result: a file, or a store of a finished or unfinished run."""

from __future__ import annotations

import os
import warnings

import xarray as xr

from gearchaos.datasets import load as load_file
from gearchaos.errors import InputError
from gearchaos.store.files.folder import LocalFolder, open_folder
from gearchaos.store.reading.missing_words import missing_in_words
from gearchaos.store.store import open_store


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
