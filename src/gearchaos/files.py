"""Files read and written whole or not at all, and what may be one."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from uuid import uuid4

from gearchaos.errors import InputError

DATA_SUFFIXES = (".nc", ".nc4", ".netcdf", ".h5", ".hdf5")
"""How files of data are called; they are NetCDF, which is HDF5."""

NO_FILE = "not a regular file but a device, a pipe or a socket"


def check_target(field: str, path: Path) -> None:
    """Raise `InputError` unless a file can lie at ``path``: what is there must be one, since it is replaced."""
    try:
        mode = path.stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        mode = None
    except (OSError, ValueError) as error:  # the latter for a name with a null character
        why = f"{getattr(error, 'strerror', error)}."
        raise InputError(field, "must be a path that can be written to", str(path), why) from None
    if mode is not None and not stat.S_ISREG(mode):
        what = "a folder" if stat.S_ISDIR(mode) else NO_FILE
        raise InputError(field, "must be a file", str(path), f"It is {what}.")
    if not path.parent.is_dir():
        raise InputError(field, "must lie in an existing folder", str(path), "Create the folder first.")


def read_bytes(path: Path, most: int = -1) -> bytes:
    """The content of a regular file; of another one reading might never end.

    Raises OSError if it cannot be read or is none, or if it has more than ``most`` bytes, unless that is negative.
    """
    mode = path.stat().st_mode
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):  # what reading a folder raises says it well
        raise OSError(errno.EINVAL, f"It is {NO_FILE}", str(path))
    with path.open("rb") as file:
        content = file.read(most + 1 if most >= 0 else most)
    if 0 <= most < len(content):
        raise OSError(errno.EFBIG, f"It has more than {most:,} bytes", str(path))
    return content


def write_bytes(path: Path, content: bytes | memoryview) -> None:
    """Write a file whole or not at all; several processes and machines may do so at once. Who dies in the middle leaves
    a file that ends in ``.partial``."""
    draft = path.with_name(f".{uuid4().hex}.partial")  # without the file's name, which may be as long as a name can be
    try:
        draft.write_bytes(content)
        os.replace(draft, path)
    except OSError as error:  # a full disk names no file
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error
    finally:
        draft.unlink(missing_ok=True)
