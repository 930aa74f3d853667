"""How kernels are compiled: without the GIL, cached on disk under a hash of all kernel sources.

Numba notices an edit of the file of a cached function but not of the files of the functions it calls, so the name of
the cache directory contains a hash of this whole folder. Numba does not synchronise processes that write to the cache
at the same time either: two may choose the same file name for different code, and a third would then run the wrong
code. Therefore a lock is held while a kernel is written. Another lock is held while it is compiled: of many processes
that start at the same time with an empty cache one compiles a kernel, and the others wait and load it.

The compiler never contracts a product and a sum into one operation by itself: where they are to be rounded once, the
code calls `simd.vfma`. So the result of a lane depends neither on the vector width of the machine nor on the other
lanes.
"""

from __future__ import annotations

import hashlib
import os
import threading
from collections.abc import Callable
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

import numba
import platformdirs
from filelock import FileLock
from llvmlite.binding import Linkage, ModuleRef
from numba import config, njit
from numba.core import event
from numba.core.caching import FunctionCache
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler


class _NoEnvironments:
    """Replacement for the code generator in a subroutine's library. Numba calls `set_env` to give compiled code the
    address of the Python objects that it needs to raise exceptions; subroutines raise none."""

    def set_env(self, name: str, environment: Any) -> None:
        """Do nothing."""


class _SubroutineLibrary(JITCodeLibrary):
    """The LLVM code of a subroutine and of those that it calls, neither optimised nor turned into machine code."""

    codegen = _NoEnvironments()

    def _optimize_functions(self, ll_module: ModuleRef) -> None:
        ll_module.data_layout = self._codegen._data_layout

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalized = True


class _KernelLibrary(JITCodeLibrary):
    """The code of a kernel and of its subroutines."""

    passes = 1

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if function.linkage == Linkage.linkonce_odr:  # not called from outside: LLVM may remove it once inlined
                function.linkage = Linkage.internal
        for _ in range(self.passes):
            super()._optimize_final_module()


class SubroutineCompiler(Compiler):
    """Numba's compiler for a function that only kernels call."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.state.library = _SubroutineLibrary(self.state.targetctx.codegen(), "subroutine")


class KernelCompiler(Compiler):
    """Numba's compiler for a kernel."""

    passes = 1

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.state.library = _KernelLibrary(self.state.targetctx.codegen(), "kernel")
        self.state.library.passes = self.passes
        self.state.library.enable_object_caching()


class ThoroughCompiler(KernelCompiler):
    """A `KernelCompiler` with two optimisation passes: in the second one LLVM unrolls loops that contain unrolled
    loops."""

    passes = 2


_OPTIONS = {"nogil": True, "error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}
"""Kernels release the GIL, divide by zero as NumPy does, and allocate no arrays; they need no C wrapper, because no C
code calls them."""


@cache
def cache_directory() -> Path:
    """The disk cache of compiled kernels: one folder for each state of the kernel sources.

    It is in NUMBA_CACHE_DIR if that is set, else in the user's cache directory.

    Returns
    -------
    Path

    Examples
    --------
    >>> len(cache_directory().name)  # a checksum of the sources
    16
    """
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(source.name.encode() + source.read_bytes())
    base = config.CACHE_DIR or Path(platformdirs.user_cache_dir("gearchaos")) / "kernels"
    return Path(base) / digest.hexdigest()[:16]


LONGEST_WAIT = 300.0  # seconds that a process waits for another one to compile a kernel; then it compiles for itself


class _SharedCache(FunctionCache):
    """Numba's cache of one function, whose machine code for a signature is compiled and written by one process."""

    def __init__(self, function: Callable[..., Any]) -> None:
        super().__init__(function)
        self._compiling: dict[Any, FileLock] = {}

    def _load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compiled function, None if there is none; then this process holds the lock to compile it."""
        found = super()._load_overload(sig, target_context)
        if found is not None:
            return found
        digest = hashlib.sha256(f"{self._impl.filename_base} {sig}".encode()).hexdigest()[:16]
        lock = FileLock(cache_directory() / f".{digest}.lock")
        with suppress(OSError, NotImplementedError):  # a Timeout, too, is an OSError; some file systems have no locks
            lock.acquire(timeout=LONGEST_WAIT)
            self._compiling[sig] = lock
        found = super()._load_overload(sig, target_context)  # by the process that held the lock
        if found is not None:
            self._release(sig)
        return found

    def _save_overload(self, sig: Any, data: Any) -> None:
        try:
            with FileLock(cache_directory() / ".lock"):
                super()._save_overload(sig, data)
        finally:
            self._release(sig)

    def _release(self, sig: Any) -> None:
        """Let other processes load what is compiled."""
        lock = self._compiling.pop(sig, None)
        if lock is not None:
            lock.release()


@cache
def _writable() -> bool:
    """Whether the disk cache can be written; without it every process compiles for itself."""
    folder = cache_directory()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK)


def cache_is_empty() -> bool:
    """Whether the disk cache can be written but holds no kernel yet.

    Returns
    -------
    bool

    Examples
    --------
    >>> from gearchaos.flow import cache_is_empty
    >>> isinstance(cache_is_empty(), bool)
    True
    """
    return _writable() and not any(cache_directory().rglob("*.nbi"))


@contextmanager
def _own_cache():
    """Make Numba use `cache_directory` for functions compiled inside the context."""
    before = config.CACHE_DIR
    config.CACHE_DIR = str(cache_directory())
    try:
        yield
    finally:
        config.CACHE_DIR = before


def _cached(function: Callable[..., Any], compiler: type) -> Any:
    """Compile a function with this compiler, and keep the result on disk."""
    compiled = njit(**_OPTIONS, pipeline_class=compiler)(function)
    if not config.DISABLE_JIT and _writable():
        with _own_cache():
            compiled._cache = _SharedCache(function)
    return compiled


def kernel(function: Callable[..., Any]) -> Any:
    """Decorator: compile a function that Python calls with numbers, arrays and tuples of them; cached on disk."""
    return _cached(function, KernelCompiler)


def main_kernel(function: Callable[..., Any]) -> Any:
    """Decorator: like `kernel`, with more optimisation; for the kernel in which nearly all time is spent."""
    return _cached(function, ThoroughCompiler)


def subroutine(function: Callable[..., Any]) -> Any:
    """Decorator: compile a function that only kernels and other subroutines call, as part of them."""
    return _linked(function, forceinline=False)  # explicit: by default Numba would use the caller's setting


def inlined(function: Callable[..., Any]) -> Any:
    """Decorator: a subroutine whose code is copied into every caller, since passing its many arrays would cost time."""
    return _linked(function, forceinline=True)


def _linked(function: Callable[..., Any], forceinline: bool) -> Any:
    compiler = SubroutineCompiler
    return njit(**_OPTIONS, forceinline=forceinline, no_cpython_wrapper=True, pipeline_class=compiler)(function)


def on_compile(call: Callable[[], None]) -> None:
    """Register a function to be called whenever a kernel is about to be compiled, but not when one is loaded from the
    cache.

    Parameters
    ----------
    call : callable
        Called without arguments; what it returns is ignored.

    Examples
    --------
    >>> from gearchaos.flow import on_compile
    >>> on_compile(lambda: None)
    """
    nested = threading.local()  # compiling a kernel compiles its subroutines; only the kernel counts

    class Listener(event.Listener):
        def on_start(self, event: event.Event) -> None:
            nested.depth = getattr(nested, "depth", 0) + 1
            if nested.depth == 1:
                call()

        def on_end(self, event: event.Event) -> None:
            nested.depth -= 1

    event.register("numba:compile", Listener())
