"""A folder in an object store: S3, Google Cloud Storage, Azure Blob Storage, through the package obstore.

An object is written as a whole and is durable when the request is answered, so nothing is renamed or synchronised.
What a file system does with links and locks is done by conditional writes: an object is created if there is none, or
replaced if it still is of the version that was read.
"""

from __future__ import annotations

import tempfile
import threading
from collections.abc import Container, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path
from typing import Any, ClassVar
from uuid import uuid4

from gearchaos.errors import InputError
from gearchaos.files import temporary_folder
from gearchaos.store.files import lease
from gearchaos.store.files.object_client import (
    Connection,
    condition_errors,
    connect,
    errors_as_os_errors,
    normalised,
    obstore,
)

_DESCRIPTION = "run/study.json"
"""The object that makes a folder a store; a draft is published with it as the last one."""

_CREATION = "run/creation.lock"
"""The lock of the process that publishes a draft. Together with a missing description it says that a draft was not
published completely."""

_TOKEN = "gearchaos"
"""Name of the metadata of an object by which a process recognises that it has created it itself."""

_PAGE = 1000
"""Number of objects that are listed, or deleted, by one request."""

_UPLOADS = 8
"""Number of objects of a draft that are uploaded at the same time."""

_REMEMBERED = 8
"""Number of appended objects of which the content is kept in memory; of others it is read again."""


class ObjectFolder:
    """A folder in an object store; see `gearchaos.store.files.folder.Folder`.

    A pickled folder is its URL; each process connects by its own environment variables.

    Parameters
    ----------
    url : str
        ``s3://bucket/prefix``, or with ``gs``, ``az``, ``abfs``; ``memory`` for the memory of this process.

    Raises
    ------
    InputError
        If the URL is wrong. The first request of a process raises it if the package obstore is missing or the bucket
        cannot be reached, every request ConnectionError if the object
        store fails.
    """

    segment_size: ClassVar[int] = 0

    def __init__(self, url: str) -> None:
        self.url = normalised(url)
        self._appended: dict[str, tuple[bytes, dict[str, str]]] = {}
        self._appending = threading.Lock()

    def __reduce__(self):
        return type(self), (self.url,)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ObjectFolder) and self.url == other.url

    def __hash__(self) -> int:
        return hash(self.url)

    def __repr__(self) -> str:
        return f"ObjectFolder({self.url!r})"

    def __str__(self) -> str:
        return self.url

    def exists(self) -> bool:
        """Whether there is an object at this location, other than those of a draft not published completely."""
        if self.size(_DESCRIPTION) is not None:
            return True
        return self.size(_CREATION) is None and next(self.list(), None) is not None

    def check_creatable(self) -> None:
        """Raise `InputError` if the bucket does not exist or cannot be reached."""
        _ = self._connection

    def read(self, name: str, start: int = 0, length: int | None = None) -> bytes:
        with self._errors(name):
            try:
                return self._read_range(name, start, length)
            except (obstore().exceptions.BaseError, ValueError):  # refused: empty ranges, or after the end
                size = obstore().head(self._store, name)["size"]
                if length != 0 and start < size:
                    raise
                return b""

    def _read_range(self, name: str, start: int, length: int | None) -> bytes:
        """`read` for a range that begins before the end of the object."""
        if length is not None:
            return bytes(obstore().get_range(self._store, name, start=start, length=length))
        options = {"range": {"offset": start}} if start else None
        return bytes(obstore().get(self._store, name, options=options).bytes())

    def write(self, name: str, content: bytes | memoryview) -> None:
        with self._errors(name):
            self._appended.pop(name, None)
            self._put(name, content)

    def create(self, name: str, content: bytes) -> bool:
        token = uuid4().hex
        with self._errors(name):
            try:
                self._put(name, content, mode="create", attributes={_TOKEN: token})
            except condition_errors():  # it exists; perhaps it was created but the answer was lost
                return obstore().get(self._store, name).attributes.get(_TOKEN) == token
        return True

    def append(self, name: str, content: bytes | memoryview) -> int:
        """Append to an object, which is written again as a whole.

        Raises OSError if another process has written to it since this one did: an object has one writer.
        """
        with self._appending, self._errors(name):
            before, version = self._appended.get(name) or self._read_version(name)
            whole = before + content
            self._appended.pop(name, None)  # it is read again if writing fails
            try:
                put = self._put(name, whole, mode=version or "create")
                self._remember(name, whole, lease.version_of(put))
            except condition_errors():
                self._remember(name, *self._rewritten(name, whole))
        return len(before)

    def _read_version(self, name: str) -> tuple[bytes, dict[str, str]]:
        """Content and version of an object; both empty if there is none."""
        try:
            found = obstore().get(self._store, name)
        except FileNotFoundError:
            return b"", {}
        return bytes(found.bytes()), lease.version_of(found.meta)

    def _rewritten(self, name: str, whole: bytes) -> tuple[bytes, dict[str, str]]:
        """Content and version of an object that was written but the answer was lost; OSError if another writer was."""
        found, version = self._read_version(name)
        if found != whole:
            raise OSError(f"{self.url}/{name}: another process writes to it")
        return found, version

    def _remember(self, name: str, whole: bytes, version: dict[str, str]) -> None:
        """Keep content and version of an object, and forget those of the one that was appended to longest ago."""
        self._appended[name] = whole, version
        if len(self._appended) > _REMEMBERED:
            del self._appended[next(iter(self._appended))]

    def size(self, name: str) -> int | None:
        with self._errors(name):
            try:
                return obstore().head(self._store, name)["size"]
            except FileNotFoundError:
                return None

    def list(self, prefix: str = "") -> Iterator[tuple[str, int]]:
        with self._errors(prefix):
            for page in obstore().list(self._store, prefix.strip("/") or None, chunk_size=_PAGE):
                yield from ((found["path"], found["size"]) for found in page)

    def delete(self, name: str) -> None:
        self._delete([name])

    def delete_tree(self, prefix: str) -> None:
        self._delete([name for name, _ in self.list(prefix)])

    def _delete(self, names: Sequence[str]) -> None:
        """Delete objects that may exist."""
        for start in range(0, len(names), _PAGE):
            page = [*names[start : start + _PAGE]]
            for name in page:
                self._appended.pop(name, None)
            with self._errors(page[0]), suppress(FileNotFoundError):  # some providers refuse those that do not exist
                obstore().delete(self._store, page)

    def lock(self, name: str, timeout: float) -> AbstractContextManager[None]:
        """A lock that one process holds at a time; see `gearchaos.store.files.lease.hold`."""
        return lease.hold(self._connection, name, f"{self.url}/{name}", timeout)

    def zarr_store(self, read_only: bool = True) -> Any:
        from zarr.storage import ObjectStore

        return ObjectStore(self._store, read_only=read_only)

    @contextmanager
    def draft(self) -> Iterator[Path]:
        with temporary_folder(Path(tempfile.gettempdir())) as folder:
            yield folder / "draft"

    def publish(self, draft: Path) -> bool:
        """Upload a draft, its description last; False if there is anything at this location already.

        One process publishes at a time; the others wait for it. Objects of a process that was killed while it published
        are replaced; raises `InputError` if there are any that this draft does not replace.
        """
        if self.exists():
            return False
        files = {file.relative_to(draft).as_posix(): file for file in sorted(draft.rglob("*")) if file.is_file()}
        with self.lock(_CREATION, -1):
            if self.size(_DESCRIPTION) is not None:
                return False
            self._check_replaced(files)
            rest = [name for name in files if name != _DESCRIPTION]
            with ThreadPoolExecutor(_UPLOADS) as threads:
                for _ in threads.map(lambda name: self.write(name, files[name].read_bytes()), rest):
                    pass
            return self.create(_DESCRIPTION, files[_DESCRIPTION].read_bytes())

    def _check_replaced(self, names: Container[str]) -> None:
        """Raise `InputError` if there is an object that has none of these names."""
        for name, _ in self.list():
            if name not in names and name != _CREATION:
                advice = f"It has {name}, left by a run of another study that was killed as it began. Delete it first."
                raise InputError("store", "must be empty", self.url, advice)

    @property
    def _connection(self) -> Connection:
        return connect(self.url)

    @property
    def _store(self) -> Any:
        """The client for data."""
        return self._connection.store

    def _put(self, name: str, content: bytes | memoryview, **options: Any) -> Any:
        """Write an object by one request: unlike a multipart upload it leaves nothing if it fails, and may have a
        condition."""
        return obstore().put(self._store, name, content, use_multipart=False, **options)

    def _errors(self, name: str) -> AbstractContextManager[None]:
        return errors_as_os_errors(f"{self.url}/{name}")
