"""Reading and writing of whole files, and checks of their paths."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from uuid import uuid4

from gearchaos.errors import InputError

DATA_SUFFIXES = (".nc", ".nc4", ".netcdf", ".h5", ".hdf5")
"""Suffixes of files of results, which are NetCDF-4 and thus HDF5."""

NO_FILE = "not a regular file but a device, a pipe or a socket"


def check_target(field: str, path: Path) -> None:
    """Raise `InputError` unless a file can be written at ``path``.

    Its folder must exist, and what is there already must be a regular file, since it is replaced.
    """
    try:
        mode = path.stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        mode = None
    except (OSError, ValueError) as error:  # ValueError for a name with a null character
        why = f"{getattr(error, 'strerror', error)}."
        raise InputError(field, "must be a path that can be written to", str(path), why) from None
    if mode is not None and not stat.S_ISREG(mode):
        what = "a folder" if stat.S_ISDIR(mode) else NO_FILE
        raise InputError(field, "must be a file", str(path), f"It is {what}.")
    if not path.parent.is_dir():
        raise InputError(field, "must lie in an existing folder", str(path), "Create the folder first.")


def read_bytes(path: Path, most: int = -1) -> bytes:
    """The content of a regular file.

    Raises OSError if the file cannot be read, if it has more than ``most`` bytes (unless that is negative), or if it is
    not a regular file: reading a pipe or a device might never end.
    """
    mode = path.stat().st_mode
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):  # opening a folder raises a clear error below
        raise OSError(errno.EINVAL, f"It is {NO_FILE}", str(path))
    with path.open("rb") as file:
        content = file.read(most + 1 if most >= 0 else most)
    if 0 <= most < len(content):
        raise OSError(errno.EFBIG, f"It has more than {most:,} bytes", str(path))
    return content


def write_bytes(path: Path, content: bytes | memoryview) -> None:
    """Write a file as a whole: it appears, or replaces an older one, when all of its content is written.

    Several processes and machines may write the same file at once. A process that is killed while it writes leaves a
    hidden file that ends in ``.partial``. Raises OSError, with the path, if the file cannot be written.
    """
    draft = path.with_name(f".{uuid4().hex}.partial")  # the file's own name could make this too long
    try:
        draft.write_bytes(content)
        os.replace(draft, path)
    except OSError as error:  # the error of a full disk has no path
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error
    finally:
        draft.unlink(missing_ok=True)
