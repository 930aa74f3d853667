"""How kernels are compiled: without the GIL, cached on disk under a hash of all kernel sources.

Numba notices an edit of the file of a cached function but not of the files of the functions it calls, so the name of
the cache directory contains a hash of this folder and all below it. Numba does not synchronise processes that write to
the cache at the same time either: two may choose the same file name for different code, and a third would then run the
wrong code. Therefore a lock is held while a kernel is written. Another lock is held while it is compiled: of many
processes that start at the same time with an empty cache one compiles a kernel, and the others wait and load it. So
processes can share the kernels of a first run among them (`flow.parallel_compilation`).

The compiler never contracts a product and a sum into one operation by itself: where they are to be rounded once, the
code calls `simd.vfma`. So the result of a lane depends neither on the vector width of the machine nor on the other
lanes.
"""

from __future__ import annotations

import gc
import hashlib
import os
import threading
import warnings
from collections.abc import Callable, Iterator
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
from numba.core.types import Function, Type


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

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if function.linkage == Linkage.linkonce_odr:  # not called from outside: LLVM may remove it once inlined
                function.linkage = Linkage.internal
        self._optimize()

    def _optimize(self) -> None:
        super()._optimize_final_module()


class _MainKernelLibrary(_KernelLibrary):
    """The code of the kernel in which nearly all time is spent: optimised twice, since LLVM unrolls loops that contain
    unrolled loops in the second round; its loops are not vectorised, since it computes with vectors."""

    def _optimize(self) -> None:
        codegen, plain = self._codegen, {"loop_vectorize": False, "slp_vectorize": False}
        for options in 2 * ({"cost": "cheap", "opt": 0}, {}):  # as Numba does in one round
            passes, builder = codegen._module_pass_manager(**plain, **options)
            passes.run(self._final_module, builder)


@contextmanager
def _rare_collection() -> Iterator[None]:
    """Collect garbage rarely: of the millions of objects that Numba makes, nearly all are in use to the end."""
    before = gc.get_threshold()
    gc.set_threshold(max(200_000, before[0]), *before[1:])
    try:
        yield
    finally:
        gc.set_threshold(*before)


class _TypingContext:
    """Numba's rules for types, with the types of operators and built-in functions remembered. Numba tries all their
    overloads, those for strings and lists among them, at each of the thousands of uses."""

    def __init__(self, context: Any) -> None:
        self._context = context
        self._found: dict[Any, Any] = {}

    def __getattr__(self, name: str) -> Any:
        return getattr(self._context, name)

    def resolve_function_type(self, function: Any, arguments: tuple[Any, ...], keywords: dict[str, Any]) -> Any:
        """The signature of a call with arguments of these types."""
        builtin = isinstance(function, Function) or (callable(function) and not isinstance(function, Type))
        if not builtin or keywords:
            return self._context.resolve_function_type(function, arguments, keywords)
        if (function, arguments) not in self._found:
            self._found[function, arguments] = self._context.resolve_function_type(function, arguments, keywords)
        return self._found[function, arguments]


_typing_context = cache(_TypingContext)

_UNUSED_PASSES = {
    "WithLifting", "InlineClosureLikes", "RewriteDynamicRaises", "MakeFunctionToJitFunction", "InlineInlinables",
    "FindLiterallyCalls", "LiteralUnroll", "LiteralPropagationSubPipelinePass", "InlineOverloads", "NopythonRewrites",
    "NoPythonSupportedFeatureValidation", "DumpParforDiagnostics",
}
"""Passes of Numba for what no kernel contains: closures, with statements, unrolled loops over tuples of several types,
arithmetic of whole arrays."""


class _Compiler(Compiler):
    """Numba's compiler without what kernels do not need."""

    def __init__(self, typing_context: Any, *arguments: Any) -> None:
        super().__init__(typing_context, *arguments)
        self.state.typingctx = _typing_context(typing_context)

    def define_pipelines(self) -> list[Any]:
        """Numba's pipeline without the passes that would change nothing."""
        (pipeline,) = super().define_pipelines()
        pipeline.passes = [each for each in pipeline.passes if each[0].__name__ not in _UNUSED_PASSES]
        return [pipeline]


class SubroutineCompiler(_Compiler):
    """Numba's compiler for a function that only kernels call."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.state.library = _SubroutineLibrary(self.state.targetctx.codegen(), "subroutine")


class KernelCompiler(_Compiler):
    """Numba's compiler for a kernel."""

    library: type[_KernelLibrary] = _KernelLibrary

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.state.library = self.library(self.state.targetctx.codegen(), "kernel")
        self.state.library.enable_object_caching()

    def compile_extra(self, function: Callable[..., Any]) -> Any:
        """Compile a function."""
        with _rare_collection():
            return super().compile_extra(function)


class MainKernelCompiler(KernelCompiler):
    """Numba's compiler for the kernel in which nearly all time is spent."""

    library = _MainKernelLibrary


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
    folder = Path(__file__).parent
    for source in sorted(folder.rglob("*.py")):
        digest.update(source.relative_to(folder).as_posix().encode() + source.read_bytes())
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
        if found is not None or sig in self._compiling:  # held already where compiling was interrupted
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
        except OSError as error:  # on a full disk, say; the kernel itself is there
            _warn_once(error.strerror or str(error))
        finally:
            self._release(sig)

    def holds(self, first: Any) -> bool:
        """Whether the function is on disk for a first argument of this type."""
        return any(signature[0] == first for signature, *_ in self._cache_file._load_index())

    def _release(self, sig: Any) -> None:
        """Let other processes load what is compiled."""
        lock = self._compiling.pop(sig, None)
        if lock is not None:
            lock.release()


@cache
def _warn_once(why: str) -> None:
    """Say why kernels are not kept, for all of them: Numba makes Python forget that it has shown a warning."""
    warnings.warn(f"compiled kernels cannot be kept in {cache_directory()}: {why}. Each process compiles them again. "
                  "Free space there, or set NUMBA_CACHE_DIR to another folder.", RuntimeWarning, stacklevel=1)


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


def is_missing(compiled: Any, first: Any) -> bool:
    """Whether a kernel could be on disk for this value of its first argument, but is not."""
    found = getattr(compiled, "_cache", None)  # plain functions, without compilation, have none
    return isinstance(found, _SharedCache) and not found.holds(numba.typeof(first))


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
    return _cached(function, MainKernelCompiler)


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
