"""Reading and atomic writing of whole files, checks of their paths, and their content as strict JSON."""

from __future__ import annotations

import errno
import json
import math
import os
import re
import shutil
import stat
import tempfile
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib.resources import files
from pathlib import Path
from typing import Any
from uuid import uuid4

from gearchaos.errors import InputError

NOT_REGULAR = "not a regular file but a device, a pipe or a socket"  # a path that is no folder either
# attempts at removing a temporary folder, 50 ms apart, while threads that write to it come to their end
_REMOVALS = 20


def strict_json(document: Any) -> str:
    """A document as JSON that every program reads, with null for NaN and infinity."""
    return json.dumps(_finite(document), allow_nan=False)


def _finite(value: Any) -> Any:
    """A value with None for each number in it that is not finite."""
    if isinstance(value, dict):
        return {key: _finite(v) for key, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def examples() -> list[Path]:
    """The study files of the manual, by name."""
    folder = Path(str(files("gearchaos"))) / "examples"
    if not folder.is_dir():  # the sources are installed so that they can be edited
        folder = Path(__file__).parents[2] / "examples"
    return sorted(path for path in folder.iterdir() if path.is_file())


def check_target(field: str, path: Path) -> None:
    """Raise `InputError` unless a file can be written at ``path``.

    The folder must exist. If something already exists at the path, it must be a regular file, which will be replaced.
    """
    try:
        mode = path.stat().st_mode
    except (FileNotFoundError, NotADirectoryError):
        mode = None
    except (OSError, ValueError) as error:  # ValueError for a name with a null character
        why = f"{getattr(error, 'strerror', error)}."
        raise InputError(field, "must be a path that can be written to", str(path), why) from None
    if mode is not None and not stat.S_ISREG(mode):
        what = "a folder" if stat.S_ISDIR(mode) else NOT_REGULAR
        raise InputError(field, "must be a file", str(path), f"It is {what}.")
    if not path.parent.is_dir():
        url = re.match(r"(s3a?|gs|az|abfss?):/", str(path))  # Path makes s3:// into s3:/
        advice = "Only stores of gearchaos run can have a URL." if url else "Create the folder first."
        raise InputError(field, "must lie in an existing folder", str(path), advice)


def read_bytes(path: Path, most: int = -1, cut: bool = False) -> bytes:
    """The content of a regular file, with ``cut`` its first ``most`` bytes.

    Raises OSError if the file cannot be read, if it has more than ``most`` bytes (no limit if that is negative), or if
    it is not a regular file: reading a pipe or a device might never end.
    """
    mode = path.stat().st_mode
    if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):  # opening a folder raises a clear error below
        raise OSError(errno.EINVAL, f"It is {NOT_REGULAR}", str(path))
    with path.open("rb") as file:
        content = file.read(most + 1 if most >= 0 and not cut else most)
    if 0 <= most < len(content):
        raise OSError(errno.EFBIG, f"It has more than {most:,} bytes", str(path))
    return content


def write_bytes(path: Path, content: bytes | memoryview | Iterable[bytes], durable: bool = False) -> None:
    """Write a file atomically: it appears, or replaces an older one, only when all of its content is written.

    The content may come in parts. Several processes and machines may write the same file at the same time. A process
    killed while it writes leaves a hidden file that ends in ``.partial``. With ``durable`` the file is on the disk at
    return, and survives a power failure. Raises OSError, with the path, if the file cannot be written.
    """
    with partial_file(path, content, durable) as partial:
        os.replace(partial, path)
        if durable:
            sync_folder(path.parent)


@contextmanager
def partial_file(path: Path, content: bytes | memoryview | Iterable[bytes], durable: bool) -> Iterator[Path]:
    """A hidden file with this content in the folder of ``path``, which is deleted at the end unless it was renamed.

    An OSError, also one raised by the caller, is raised again with ``path``: the error of a full disk has none.
    """
    partial = path.with_name(f".{uuid4().hex}.partial")  # the file's own name could make this too long
    try:
        with partial.open("wb") as file:
            file.writelines([content] if isinstance(content, (bytes, memoryview)) else content)
            if durable:
                file.flush()
                os.fsync(file.fileno())
        yield partial
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from error
    finally:
        partial.unlink(missing_ok=True)


def sync_folder(folder: Path) -> None:
    """Make the entries of a folder, its new, renamed and deleted files, survive a power failure."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@contextmanager
def temporary_folder(parent: Path) -> Iterator[Path]:
    """A hidden folder in ``parent`` that is removed at the end, also while other threads still write to it.

    `tempfile.TemporaryDirectory` would raise an error then, in place of the one that ended the writing: on a full disk
    Zarr is still writing other chunks when the first one fails.
    """
    folder = Path(tempfile.mkdtemp(dir=parent, prefix=".gearchaos-"))
    try:
        yield folder
    finally:
        for _ in range(_REMOVALS):
            shutil.rmtree(folder, ignore_errors=True)
            if not folder.exists():
                break
            time.sleep(0.05)
