"""The folder of a store: all files of a store are read and written through this interface.

`LocalFolder` is a folder of a file system, `gearchaos.store.files.object_folder.ObjectFolder` a prefix of an object
store.
"""

from __future__ import annotations

import errno
import os
import re
import shutil
import stat
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, ClassVar, Protocol

from filelock import FileLock

from gearchaos.errors import InputError
from gearchaos.files import NOT_REGULAR, partial_file, sync_folder, temporary_folder, write_bytes

_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+://|(s3a?|gs|az|abfss?):/")
"""Beginning of the URL of an object store, e.g. ``s3://``, also after `pathlib.Path` has made it ``s3:/``."""

_ALMOST_URL = re.compile(r"(s3a?|gs|az|abfss?):(.+)")
"""A path that was meant as the URL of an object store: its scheme, and bucket with prefix."""

_SEGMENT_SIZE = 64 * 2**20
"""Size from which a file to which records are appended is followed by a new one, in bytes."""


_DURABLE = set[Path]()
"""Files and folders that this process knows to survive a power failure, since it has synchronised the folders that
contain them. Another process may have made them and may have been killed before it did so."""

UNREACHABLE = (ConnectionError, TimeoutError, PermissionError)
"""Errors that say that a folder cannot be reached; any other OSError at reading a file means that it is damaged."""


def is_refused(error: Exception) -> bool:
    """Whether an error says that this process may not write to a place."""
    return getattr(error, "errno", None) in (errno.EACCES, errno.EPERM, errno.EROFS)


class Folder(Protocol):
    """A folder with files that are named relative to it, with "/" between the parts of a name.

    What a method has written survives a power failure when the method returns. `str` of a folder is what the user
    calls it.

    Attributes
    ----------
    url : str
        `open_folder` of it gives an equal folder in any process: an absolute path, or ``s3://bucket/prefix``.
    segment_size : int
        Size in bytes from which a file to which records are appended is followed by a new one; 0 if nothing can be
        appended cheaply, so that every record is a file of its own.
    """

    @property
    def url(self) -> str: ...

    @property
    def segment_size(self) -> int: ...

    def exists(self) -> bool:
        """Whether there is anything at this location; raises `InputError` for a link to nothing."""
        ...

    def check_creatable(self) -> None:
        """Raise `InputError` if the folder cannot be created, e.g. since its parent does not exist."""
        ...

    def read(self, name: str, start: int = 0, length: int | None = None) -> bytes:
        """The bytes of a file from ``start``, ``length`` of them or fewer if it ends before; by default all.

        Raises FileNotFoundError if there is none, OSError if it is not a regular file.
        """
        ...

    def write(self, name: str, content: bytes | memoryview) -> None:
        """Write a file as a whole: it appears, or replaces an older one, when all of its content is written.

        Raises `InputError` if something that is not a file has its place.
        """
        ...

    def create(self, name: str, content: bytes) -> bool:
        """Write a file as a whole unless it exists; False if it does. Of several processes one succeeds."""
        ...

    def append(self, name: str, content: bytes | memoryview) -> int:
        """Append to a file, which is created if it does not exist; the offset in bytes at which the content begins.

        A file is appended to by one process and thread at a time. If it raises OSError, nothing was appended.
        """
        ...

    def size(self, name: str) -> int | None:
        """Size of a file in bytes; None if there is none, or if it is not a regular file."""
        ...

    def list(self, prefix: str = "") -> Iterator[tuple[str, int]]:
        """Names, relative to this folder, and sizes in bytes of all files in a subfolder and below it."""
        ...

    def delete(self, name: str) -> None:
        """Delete a file, if it exists."""
        ...

    def delete_tree(self, prefix: str) -> None:
        """Delete a subfolder with all its files, if it exists."""
        ...

    def lock(self, name: str, timeout: float) -> AbstractContextManager[Any]:
        """A lock that one process holds at a time, until it leaves the context or ends.

        Raises `filelock.Timeout` if it cannot be acquired within ``timeout`` seconds, without limit if negative.
        """
        ...

    def zarr_store(self, read_only: bool = True) -> Any:
        """The same folder as a store of the package zarr."""
        ...

    def draft(self) -> AbstractContextManager[Path]:
        """The path of a folder, not yet created, from which `publish` can take a draft; deleted at the end."""
        ...

    def publish(self, draft: Path) -> bool:
        """Create this folder with the content of a local draft; False if it exists already."""
        ...


def open_folder(location: str | os.PathLike[str]) -> Folder:
    """The folder at a path, or at the URL of an object store such as ``s3://bucket/prefix``. It need not exist."""
    text = os.fspath(location)
    if is_url(text):
        from gearchaos.store.files.object_folder import ObjectFolder  # here, since few stores need it

        return ObjectFolder(text)
    return LocalFolder(Path(text))


def is_url(text: str) -> bool:
    """Whether a location is the URL of an object store, not a path."""
    return _SCHEME.match(text) is not None


@dataclass(frozen=True)
class LocalFolder:
    """A folder of a file system; see `Folder`."""

    path: Path

    segment_size: ClassVar[int] = _SEGMENT_SIZE

    def __str__(self) -> str:
        return str(self.path)

    @property
    def url(self) -> str:
        return str(self.path.absolute())

    def exists(self) -> bool:
        try:
            os.lstat(self.path)
        except (FileNotFoundError, NotADirectoryError):
            return False
        except (OSError, ValueError) as error:  # ValueError for a name with a null character
            why = f"{getattr(error, 'strerror', error)}."
            raise InputError("out", "must be a possible path of a folder", str(self.path), why) from None
        if not self.path.exists():
            advice = "Remove it, or make what it points to."
            raise InputError("out", "must not be a link to nothing", str(self.path), advice)
        return True

    def check_creatable(self) -> None:
        if not self.path.absolute().parent.is_dir():
            advice = "Create the folder first."
            if url := _ALMOST_URL.match(str(self.path)):
                advice = f"For an object store: {url[1]}://{url[2]}"
            raise InputError("out", "must lie in an existing folder", str(self.path), advice)

    def read(self, name: str, start: int = 0, length: int | None = None) -> bytes:
        with _opened(self.path / name, os.O_RDONLY, "rb") as file:
            file.seek(start)
            return _read(file, length)

    def write(self, name: str, content: bytes | memoryview) -> None:
        path = self._in_folder(name)
        if path.exists() and not path.is_file():
            raise InputError("store", "must have a file at this path", str(path), "Remove it and run again.")
        write_bytes(path, content, durable=True)

    def create(self, name: str, content: bytes) -> bool:
        path = self._in_folder(name)
        try:
            with partial_file(path, content, durable=True) as partial:
                os.link(partial, path)
                sync_folder(path.parent)
        except FileExistsError:
            return False
        return True

    def append(self, name: str, content: bytes | memoryview) -> int:
        path = self._in_folder(name)
        if not path.exists():
            _DURABLE.discard(path)
        try:
            with _opened(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, "ab") as file:
                offset = os.fstat(file.fileno()).st_size
                _append(file, content, offset)
        except OSError as error:  # the error of a full disk has no path
            raise OSError(error.errno, error.strerror or str(error), str(path)) from error
        _make_durable(path)
        return offset

    def size(self, name: str) -> int | None:
        try:
            status = os.stat(self.path / name)
        except (FileNotFoundError, NotADirectoryError):
            return None
        return status.st_size if stat.S_ISREG(status.st_mode) else None

    def list(self, prefix: str = "") -> Iterator[tuple[str, int]]:
        try:
            entries = os.scandir(self.path / prefix)
        except (FileNotFoundError, NotADirectoryError):
            return
        with entries:
            for entry in entries:
                name = f"{prefix}/{entry.name}" if prefix else entry.name
                if entry.is_dir(follow_symlinks=False):
                    yield from self.list(name)
                elif (size := self.size(name)) is not None:  # None also if it was deleted meanwhile
                    yield name, size

    def delete(self, name: str) -> None:
        (self.path / name).unlink(missing_ok=True)

    def delete_tree(self, prefix: str) -> None:
        if (self.path / prefix).exists():
            shutil.rmtree(self.path / prefix)

    @contextmanager
    def lock(self, name: str, timeout: float) -> Iterator[None]:
        with FileLock(self._in_folder(name), timeout=timeout):
            yield

    def zarr_store(self, read_only: bool = True) -> Any:
        from zarr.storage import LocalStore

        return LocalStore(self.path, read_only=read_only)

    @contextmanager
    def draft(self) -> Iterator[Path]:
        parent = self.path.absolute().parent
        with ExitStack() as stack:
            try:
                folder = stack.enter_context(temporary_folder(parent))
            except OSError as error:
                if not is_refused(error):
                    raise
                advice = f"{parent}: {error.strerror}. Stores are made and repaired by way of a folder beside them."
                raise InputError("store", "must lie in a folder you may write in", str(self.path), advice) from None
            yield folder / "draft"

    def publish(self, draft: Path) -> bool:
        for folder, _, names in os.walk(draft):
            for name in names:
                with _opened(Path(folder, name), os.O_RDONLY, "rb") as file:
                    os.fsync(file.fileno())
            sync_folder(Path(folder))
        try:
            os.rename(draft, self.path)
        except OSError as error:
            if error.errno in (errno.EEXIST, errno.ENOTEMPTY, errno.ENOTDIR):
                return False
            raise
        sync_folder(self.path.absolute().parent)
        return True

    def _in_folder(self, name: str) -> Path:
        """The path of a file, in a folder that exists. New folders survive a power failure."""
        top = self.path.absolute()
        path = folder = top / name
        folders = []
        while folder != top:
            folder = folder.parent
            folders.append(folder)
        for folder in reversed(folders):
            if not folder.exists():
                _DURABLE.discard(folder)
                folder.mkdir(parents=True, exist_ok=True)
            elif not folder.is_dir():
                raise InputError("store", "must have a folder at this path", str(folder), "Remove it and run again.")
            _make_durable(folder)
        return path


def _make_durable(path: Path) -> None:
    """Let a file or folder that exists survive a power failure."""
    if path not in _DURABLE:
        sync_folder(path.parent)
        _DURABLE.add(path)


def _opened(path: Path, flags: int, mode: str) -> BinaryIO:
    """Open a regular file; raises OSError if it is something else, without waiting for a pipe."""
    descriptor = os.open(path, flags | os.O_NONBLOCK, 0o666)
    kind = os.fstat(descriptor).st_mode
    if not stat.S_ISREG(kind):
        os.close(descriptor)
        if stat.S_ISDIR(kind):
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
        raise OSError(errno.EINVAL, f"It is {NOT_REGULAR}", str(path))
    return os.fdopen(descriptor, mode, buffering=0)  # type: ignore[return-value]


def _read(file: BinaryIO, length: int | None) -> bytes:
    """The next ``length`` bytes of a file without buffer, of which one call may return fewer; by default the rest."""
    if length is None:
        return file.read()
    parts = []
    while length > 0 and (part := file.read(length)):
        parts.append(part)
        length -= len(part)
    return b"".join(parts)


def _append(file: BinaryIO, content: bytes | memoryview, offset: int) -> None:
    """Append to an open file of ``offset`` bytes, and wait until the content is on the disk; all of it or nothing."""
    rest = memoryview(content).cast("B")
    try:
        while rest:
            rest = rest[file.write(rest):]
        os.fsync(file.fileno())
    except OSError:
        os.ftruncate(file.fileno(), offset)
        raise
