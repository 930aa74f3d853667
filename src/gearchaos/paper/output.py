"""Files of the report: the folder is checked before work starts; files are written as a whole or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import xarray as xr

from gearchaos.errors import InputError
from gearchaos.studies import save

_SMALL = 1000
"""Variables with at most this many values are not compressed."""


def writable_folder(path: str | os.PathLike[str]) -> Path:
    """The folder, created if necessary; raises an `InputError` if files cannot be written in it."""
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            return folder
    except OSError as error:
        raise InputError(
            "out", "must be a folder that files can be written in", str(path), f"{error.strerror}."
        ) from None


def save_data(ds: xr.Dataset, path: Path) -> None:
    """Save a Dataset compressed, whole or not at all."""
    path.parent.mkdir(parents=True, exist_ok=True)
    packed = ds.copy()
    for name in packed.variables:
        if packed[name].size > _SMALL:
            packed[name].encoding = {"zlib": True, "complevel": 4, "shuffle": True}
    save(packed, path)
