"""Connections to object stores: S3, Google Cloud Storage, Azure Blob Storage, and the memory of this process.

Credentials and endpoints come from the environment variables that the providers' own tools use, e.g. AWS_ACCESS_KEY_ID,
AWS_SECRET_ACCESS_KEY, AWS_REGION, AWS_ENDPOINT_URL and AWS_ALLOW_HTTP.
"""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import timedelta
from functools import lru_cache
from types import ModuleType
from typing import Any

from gearchaos.errors import InputError, missing_package

_PROVIDERS = {"s3": "AWS", "s3a": "AWS", "gs": "GOOGLE", "az": "AZURE", "abfs": "AZURE", "abfss": "AZURE"}
"""Beginning of the names of the environment variables of a provider, by scheme of the URL."""

_MEMORY = "memory"
"""Scheme of a folder in the memory of this process, which other processes do not see: for tests."""

_ADVICE = {
    "AWS": "Set AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and AWS_REGION; profiles in ~/.aws are not read, but "
           "`aws configure export-credentials --format env` prints them.",
    "GOOGLE": "Set GOOGLE_APPLICATION_CREDENTIALS to the file of a service account.",
    "AZURE": "Set AZURE_STORAGE_ACCOUNT_NAME and AZURE_STORAGE_ACCOUNT_KEY.",
}
"""How to give credentials, by provider."""

_URL = re.compile(r"([a-z][a-z0-9+.-]*)://([^/?#%\s]+)((?:/[^/?#%]+)*)")
"""A normalised URL: scheme, bucket, and a path without empty parts, query and encoded characters."""

_FIRST = {"max_retries": 2, "retry_timeout": timedelta(seconds=10)}
"""Retries of the first request to a URL, and of renewals of leases: a wrong address is reported within seconds."""

_LATER = {"max_retries": 20, "retry_timeout": timedelta(minutes=3)}
"""Retries of all other requests: a run outlasts a short outage, and ends with an error after a long one."""

_CONNECTING = timedelta(seconds=5)
_FIRST_TIMEOUT, _LATER_TIMEOUT = timedelta(seconds=10), timedelta(minutes=5)
"""Longest times for connecting, and for one request with its data."""


@dataclass(frozen=True)
class Connection:
    """Two clients of the package obstore for the objects below one URL.

    Attributes
    ----------
    store : obstore.store.ObjectStore
        For data; it repeats requests that fail for up to three minutes.
    quick : obstore.store.ObjectStore
        For leases; it reports a failure within seconds.
    """

    store: Any
    quick: Any


def obstore() -> ModuleType:
    """The package obstore; raises `InputError` if it is not installed."""
    try:
        import obstore
    except ImportError:
        raise missing_package("store", "obstore", "object") from None
    return obstore


def normalised(url: str) -> str:
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


def connect(url: str) -> Connection:
    """The connection to a normalised URL, which is made and tried once per process.

    Raises `InputError` if the package is missing, or if the bucket does not exist or cannot be reached with these
    environment variables.
    """
    return _connect(url, tuple(sorted(_settings(url).items())))


def _settings(url: str) -> dict[str, str]:
    """The environment variables on which the connection to a URL depends."""
    provider = _PROVIDERS.get(url.partition("://")[0], "-")
    return {name: value for name, value in os.environ.items() if name.upper().startswith(f"{provider}_")}


@lru_cache(maxsize=64)
def _connect(url: str, settings: tuple[tuple[str, str], ...]) -> Connection:
    """`connect` with these environment variables."""
    package = obstore()
    if url.startswith(f"{_MEMORY}://"):
        memory = package.store.MemoryStore()
        return Connection(memory, memory)
    plain = _plain_http(url, dict(settings))
    try:
        first = _client(package, url, _FIRST, _FIRST_TIMEOUT, plain)
        next(package.list(first, chunk_size=1), None)
        return Connection(_client(package, url, _LATER, _LATER_TIMEOUT, plain), first)
    except (package.exceptions.BaseError, FileNotFoundError, ValueError) as error:
        raise InputError("store", "must be in an object store that can be reached", url,
                         _why(error, _PROVIDERS[url.partition("://")[0]], dict(settings))) from None


def _plain_http(url: str, settings: dict[str, str]) -> bool:
    """Whether connections without encryption are allowed: the endpoint says http://, or a variable allows it.

    Raises `InputError` if the endpoint is no URL.
    """
    endpoints = {n: v for n, v in settings.items() if n.startswith("AWS_ENDPOINT")}
    for name, value in endpoints.items():
        if not re.match("https?://[^/]", value):
            raise InputError(name, "must begin with http:// or https://", value, f"It is the endpoint of {url}.")
    allowed = any(v.lower() in ("1", "true") for n, v in settings.items() if n.endswith("_ALLOW_HTTP"))
    return allowed or any(value.startswith("http://") for value in endpoints.values())


def _client(package: ModuleType, url: str, retries: dict[str, Any], timeout: timedelta, plain_http: bool) -> Any:
    """A client for the objects below a URL, with these limits on retries and on the time of a request."""
    options = {"connect_timeout": _CONNECTING, "timeout": timeout, "allow_http": plain_http}
    return package.store.from_url(url, client_options=options, retry_config=retries)


def _why(error: Exception, provider: str, settings: dict[str, str]) -> str:
    """Why a bucket cannot be reached with these environment variables, and what to do."""
    text = reason(error)
    if "NoSuchBucket" in text or "404 Not Found" in text or isinstance(error, FileNotFoundError):
        return f"There is no such bucket: create it, or correct the URL or the endpoint ({text})."
    given = any(re.search("KEY|CREDENTIAL|ACCOUNT|TOKEN|ROLE|SKIP_SIGNATURE", name) for name in settings)
    if not given or re.search("401 U|403 F|AccessDenied|AccessKey|Account must|Signature|169.254", text):
        return f"Credentials are missing or refused ({text}). {_ADVICE[provider]}"
    return f"{text}. Check the network, and the endpoint and region in the variables {provider}_…."


def reason(error: Exception) -> str:
    """The message of an error of obstore in one line: the server and what it says, or why it does not answer."""
    text = " ".join(str(error).partition("\n\nDebug source")[0].split())
    server = re.search(r"performing \w+ (https?://[^/ ]+)", text)
    code = re.search("<Code>(.*?)</Code> ?<Message>(.*?)</Message>", text)
    what = f"{code[1]}: {code[2]}" if code else text.rpartition(" - ")[2].partition("<")[0]
    return f"{server[1]}: {what}".rstrip(".: ") if server else what


@contextmanager
def errors_as_os_errors(where: str) -> Iterator[None]:
    """Raise errors of obstore in words with the URL of the object; conditions that failed pass through.

    FileNotFoundError if there is no such object, ConnectionError if the object store fails, OSError for a name that it
    does not take.
    """
    try:
        yield
    except InputError:
        raise
    except FileNotFoundError:
        raise FileNotFoundError(errno.ENOENT, "There is no such object", where) from None
    except ValueError as error:  # a name with ".." or other characters that obstore refuses
        raise OSError(errno.EINVAL, reason(error), where) from None
    except Exception as error:
        kinds = obstore().exceptions
        if isinstance(error, kinds.BaseError) and not isinstance(error, condition_errors()):
            raise ConnectionError(errno.EIO, f"The object store failed: {reason(error)}", where) from None
        raise


def condition_errors() -> tuple[type[Exception], ...]:
    """The errors of obstore for an object that exists, or is not of the expected version."""
    kinds = obstore().exceptions
    return (kinds.AlreadyExistsError, kinds.PreconditionError)
