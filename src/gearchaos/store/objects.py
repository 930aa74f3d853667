"""The objects of a store by name: files of a folder, or of a prefix of an object store, read and written by zarr."""

from __future__ import annotations

import asyncio
import errno
import os
import re
from collections.abc import Iterable
from contextlib import suppress
from datetime import timedelta
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

from zarr.abc.store import RangeByteRequest
from zarr.core.buffer import default_buffer_prototype
from zarr.core.sync import sync
from zarr.storage import LocalStore, MemoryStore, ObjectStore

from gearchaos.errors import InputError, missing_package
from gearchaos.files import sync_folder, write_bytes

_PARTIAL = re.compile(r"\.[0-9a-f]{32}\.partial$")  # end of the files that are written before they are renamed

_PROVIDERS = {"s3": "AWS", "s3a": "AWS", "gs": "GOOGLE", "az": "AZURE", "abfs": "AZURE", "abfss": "AZURE"}
"""Beginning of the names of the environment variables of a provider, by scheme of the URL."""

_MEMORY = "memory"  # scheme of a folder in the memory of this process, which other processes do not see: for tests

_SCHEME = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+://|(s3a?|gs|az|abfss?):/")
"""Beginning of the URL of an object store, e.g. ``s3://``, also after `pathlib.Path` has made it ``s3:/``."""

_ALMOST_URL = re.compile(r"(s3a?|gs|az|abfss?):(.+)")
"""A path that was meant as the URL of an object store: its scheme, and bucket with prefix."""

_URL = re.compile(r"([a-z][a-z0-9+.-]*)://([^/?#%\s]+)((?:/[^/?#%]+)*)")
"""A normalised URL: scheme, bucket, and a path without empty parts, query and encoded characters."""

_FIRST = {"max_retries": 2, "retry_timeout": timedelta(seconds=10)}  # a wrong address is reported within seconds
_LATER = {"max_retries": 20, "retry_timeout": timedelta(minutes=3)}  # a run outlasts a short outage
_AT_ONCE = 64  # number of objects whose sizes are asked for at the same time


def is_url(text: str) -> bool:
    """Whether a location is the URL of an object store, not a path."""
    return _SCHEME.match(text) is not None


class Objects:
    """The objects of a store by name, with "/" between the parts of a name. Each is written as a whole or not at all.

    Parameters
    ----------
    location : path
        A folder, which need not exist, or a URL such as ``s3://bucket/map.zarr``. A URL is normalised here, and the
        bucket is reached at the first use.

    Attributes
    ----------
    url : str
        `Objects` of it are the same in any process: an absolute path, or a normalised URL.
    folder : Path or None
        The folder; None in an object store.
    """

    def __init__(self, location: str | os.PathLike[str]) -> None:
        self._text = os.fspath(location)
        self.folder = None if is_url(self._text) else Path(self._text).absolute()
        self.url = _normalised(self._text) if self.folder is None else str(self.folder)

    def __str__(self) -> str:
        return self._text

    @cached_property
    def zarr(self) -> Any:
        """The same objects as a store of the package zarr.

        Raises `InputError` if a bucket does not exist or cannot be reached with the environment variables of this
        process.
        """
        if self.folder is None:
            return _connected(self.url)
        return LocalStore(self.folder)

    def exists(self) -> bool:
        """Whether there is anything at this location; raises `InputError` for a link to nothing."""
        if self.folder is None:
            return not self._done("", self.zarr.is_empty(""))
        try:
            os.lstat(self.folder)
        except (FileNotFoundError, NotADirectoryError):
            return False
        except (OSError, ValueError) as error:  # ValueError for a name with a null character
            why = f"{getattr(error, 'strerror', error)}."
            raise InputError("out", "must be a possible path of a folder", self._text, why) from None
        if not self.folder.exists():
            raise InputError("out", "must not be a link to nothing", self._text,
                             "Remove it, or make what it points to.")
        return True

    def check_creatable(self) -> None:
        """Raise `InputError` if the folder cannot be created, e.g. since its parent does not exist."""
        if self.folder is not None and self.folder.exists() and not self.folder.is_dir():
            raise InputError("out", "must be a folder", self._text, "It is a file: give another path.")
        if self.folder is not None and not self.folder.parent.is_dir():
            url = _ALMOST_URL.match(self._text)
            advice = f"For an object store: {url[1]}://{url[2]}" if url else "Create the folder first."
            raise InputError("out", "must lie in an existing folder", self._text, advice)

    def get(self, name: str, most: int | None = None) -> bytes | None:
        """The bytes of an object, the first ``most`` of them if given; None if there is none, or it is no file."""
        if self.folder is not None and not (self.folder / name).is_file():  # reading a pipe might never end
            return None
        part = None if most is None else RangeByteRequest(0, most)
        found = self._done(name, self.zarr.get(name, default_buffer_prototype(), part))
        return None if found is None else found.to_bytes()

    def put(self, name: str, content: bytes, durable: bool = False) -> None:
        """Write an object, which replaces an older one; one that is ``durable`` is never seen with a part of its
        content, not even after a power failure."""
        async def write() -> None:
            if durable and self.folder is not None:
                (self.folder / name).parent.mkdir(parents=True, exist_ok=True)
                write_bytes(self.folder / name, content, durable=True)
            else:
                await self.zarr.set(name, default_buffer_prototype().buffer.from_bytes(content))
        self._done(name, write())

    def names(self, prefix: str = "", partial: bool = False) -> list[str]:
        """The names of all objects below a prefix, or of what killed processes have left of some they were writing."""

        async def collect() -> list[str]:
            listed = self.zarr.list_prefix(f"{prefix}/" if prefix else "")
            return [name async for name in listed if bool(_PARTIAL.search(name)) == partial]

        return self._done(prefix, collect())

    def sizes(self, names: Iterable[str]) -> dict[str, int]:
        """Sizes in bytes of those of these objects that exist."""

        async def size(name: str) -> tuple[str, int | None]:
            async with at_once:
                with suppress(FileNotFoundError):
                    return name, await store.getsize(name)
                return name, None

        async def collect() -> list[tuple[str, int | None]]:
            return await asyncio.gather(*map(size, names))

        store, at_once = self.zarr, asyncio.Semaphore(_AT_ONCE)
        return {name: found for name, found in self._done("", collect()) if found is not None}

    def total_bytes(self) -> int:
        """Size of all objects together."""
        if self.folder is not None:  # zarr fails where a run deletes tiles meanwhile
            return sum(self.sizes(self.names()).values())
        return self._done("", self.zarr.getsize_prefix(""))

    def delete(self, names: Iterable[str]) -> None:
        """Delete these objects, if they exist."""
        for name in names:
            self._done(name, self.zarr.delete(name))

    def delete_all(self, prefix: str) -> None:
        """Delete all objects below a prefix, of which other processes may delete some at the same time."""
        done = False
        while not done:
            with suppress(FileNotFoundError):
                self._done(prefix, self.zarr.delete_dir(prefix))
                done = True

    def keep(self, names: Iterable[str]) -> None:
        """Let objects survive a power failure; those of an object store do at once."""
        if self.folder is not None:
            paths = [self.folder / name for name in names]
            for path in paths:
                with path.open("rb") as file:
                    os.fsync(file.fileno())
            inner = {parent for path in paths for parent in path.parents if parent.is_relative_to(self.folder)}
            for folder in (*inner, self.folder.parent):
                sync_folder(folder)

    def _done(self, name: str, work: Any) -> Any:
        """The result of a coroutine of zarr; errors have the location of the object."""
        try:
            return sync(work)
        except Exception as error:
            where = f"{self.url}/{name}"
            if type(error).__module__.startswith("obstore"):
                raise ConnectionError(errno.EIO, f"The object store failed: {_reason(error)}", where) from None
            if isinstance(error, (FileExistsError, IsADirectoryError, NotADirectoryError)):
                raise OSError(error.errno, "Remove what is in the place of a file of the store", where) from None
            if isinstance(error, OSError):  # that of a full disk has no path
                raise OSError(error.errno, error.strerror or str(error), where) from error
            raise


def _normalised(url: str) -> str:
    """The URL of a folder without superfluous slashes; raises `InputError` if it is none that can be opened."""
    scheme, _, path = url.partition("://")
    text = f"{scheme.lower()}://{re.sub('/+', '/', path).strip('/')}"
    known = [*_PROVIDERS, _MEMORY]
    if scheme.lower() not in known:
        rule = f"must be a path, or begin with {', '.join(f'{name}://' for name in known[:-1])}"
        advice = "pathlib.Path makes s3:// into s3:/; give the URL as a text." if "://" not in url else ""
        raise InputError("store", rule, url, advice)
    if not _URL.fullmatch(text) or any(part in (".", "..") for part in text.split("/")):
        raise InputError("store", "must be a URL such as s3://bucket/map.zarr", url,
                         "It has a bucket and a path, without '?', '#', '%' and '..'.")
    return text


@lru_cache(maxsize=64)
def _connected(url: str) -> Any:
    """The objects below a URL as a store of zarr, by the environment variables of this process; tried once."""
    scheme = url.partition("://")[0]
    if scheme == _MEMORY:
        return MemoryStore()
    try:
        import obstore
    except ImportError:
        raise missing_package("store", "obstore", "object") from None
    plain = any(n.startswith("AWS_ENDPOINT") and v.startswith("http://") for n, v in os.environ.items())

    def client(retries: Any, timeout: timedelta) -> Any:
        options: Any = {"connect_timeout": timedelta(seconds=5), "timeout": timeout}
        options |= {"allow_http": True} if plain else {}
        return obstore.store.from_url(url, client_options=options, retry_config=retries)

    try:
        first = client(_FIRST, timedelta(seconds=10))
        next(obstore.list(first, chunk_size=1), None)
    except (obstore.exceptions.BaseError, FileNotFoundError, ValueError) as error:
        raise InputError(
            "store", "must be in a bucket that can be reached", url, f"{_reason(error)}. Check the bucket, and "
            f"credentials, region and endpoint in the environment variables {_PROVIDERS[scheme]}_…; profiles in ~/.aws "
            "are not read, but `aws configure export-credentials --format env` prints them.") from None
    return ObjectStore(client(_LATER, timedelta(minutes=5)))


def _reason(error: Exception) -> str:
    """The message of an error of obstore in one line."""
    return " ".join(str(error).partition("\n\nDebug source")[0].split()).rstrip(".")
