"""How kernels are compiled: without the GIL, cached on disk under a hash of all kernel sources.

Numba notices edits in the file of a cached function but not in the files of the functions it calls, so the cache
directory carries a hash of this whole folder. Nor does it keep processes apart that write to the cache at once: two
may choose the same file for different code, and a third would run the wrong one. Hence the lock. Contraction is never
left to the compiler: `fma` says where a product and a sum round once, so a lane's result does not depend on vector
width, block size or neighbours.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numba
import platformdirs
from filelock import FileLock
from numba import config, njit, types
from numba.core import event
from numba.core.caching import FunctionCache
from numba.extending import intrinsic


@cache
def cache_directory() -> Path:
    """The disk cache of compiled kernels, one folder per state of the kernel sources.

    It stands in NUMBA_CACHE_DIR where that is set, else in the user's cache directory.
    """
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.name.encode() + source.read_bytes())
    base = config.CACHE_DIR or Path(platformdirs.user_cache_dir("gearchaos")) / "kernels"
    return Path(base) / digest.hexdigest()[:16]


class _SharedCache(FunctionCache):
    """Numba's cache of one function, written by one process at a time."""

    def _save_overload(self, sig: Any, data: Any) -> None:
        with FileLock(cache_directory() / ".lock"):
            super()._save_overload(sig, data)


@cache
def _writable() -> bool:
    """Whether there can be a cache on disk; without one every process compiles for itself."""
    folder = cache_directory()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)


def cold() -> bool:
    """Whether nothing has been compiled yet that the disk cache would have kept."""
    return _writable() and not any(cache_directory().rglob("*.nbi"))


@contextmanager
def _own_cache():
    """Our cache directory for the functions decorated inside, and nobody else's."""
    before = config.CACHE_DIR
    config.CACHE_DIR = str(cache_directory())
    try:
        yield
    finally:
        config.CACHE_DIR = before


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a module-level function of floats and arrays."""
    compiled = njit(nogil=True, error_model="numpy", _nrt=False)(function)
    if not config.DISABLE_JIT and _writable():
        with _own_cache():
            compiled._cache = _SharedCache(function)
    return compiled


def on_compile(call: Callable[[], None]) -> None:
    """Call this whenever a kernel is about to be compiled, rather than loaded from the cache."""

    class Listener(event.Listener):
        def on_start(self, _: event.Event) -> None:
            call()

        def on_end(self, _: event.Event) -> None:
            pass

    event.register("numba:compile", Listener())


def inlined(function: Callable[..., Any]) -> Any:
    """A kernel that its callers take in whole: for the few with long lists of arrays, which cost much to pass."""
    return njit(inline="always", nogil=True, error_model="numpy", _nrt=False)(function)


@intrinsic
def _fused(typingctx, a, b, c):
    signature = types.float64(types.float64, types.float64, types.float64)

    def codegen(context, builder, signature, arguments):
        return builder.fma(*arguments)

    return signature, codegen


def _plain(a: float, b: float, c: float) -> float:
    return a * b + c


if config.DISABLE_JIT:
    fma = _plain
else:

    @njit(inline="always")
    def fma(a, b, c):
        """a * b + c, rounded once."""
        return _fused(a, b, c)
