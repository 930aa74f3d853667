"""Compiling subroutines as part of the kernels that call them.

By default Numba optimises every function and generates its machine code, and does both again in each function that
calls it, since callers contain copies of the functions they call. Subroutines are never called from Python. So here
their LLVM code is only linked into that of their callers, and optimised once, with the whole kernel, which halves the
compile time.

This overrides undocumented parts of Numba: the steps of a code library before and after linking, and the constructor of
the compiler.
"""

from __future__ import annotations

from typing import Any

from llvmlite.binding import Linkage, ModuleRef
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler


class _NoEnvironments:
    """Replacement for the code generator in a subroutine's library.

    Numba calls `set_env` to give compiled code the address of the Python objects it needs to raise exceptions.
    Subroutines raise none.
    """

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
