"""Compiling subroutines as part of the kernels that call them.

By default Numba optimises every function, generates its machine code, and does both again for each function that calls
it, since callers contain copies of what they call. Subroutines are never called from Python. So here their LLVM code is
only linked into that of their callers, and optimised once, with the whole kernel. Compiling takes half the time.

This uses parts of Numba that are not documented: what a code library does before and after linking, and the constructor
of the compiler.
"""

from __future__ import annotations

from typing import Any

from llvmlite.binding import Linkage, ModuleRef
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler


class _NoEnvironments:
    """Stands for the code generator where Numba would tell compiled code the address of the Python objects that it
    needs to raise exceptions: subroutines raise none."""

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

    rounds = 1

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if function.linkage == Linkage.linkonce_odr:  # linked, but called from nowhere else: copies may vanish
                function.linkage = Linkage.internal
        for _ in range(self.rounds):
            super()._optimize_final_module()


class SubroutineCompiler(Compiler):
    """Numba's compiler for a function that only kernels call."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.state.library = _SubroutineLibrary(self.state.targetctx.codegen(), "subroutine")


class KernelCompiler(Compiler):
    """Numba's compiler for a kernel."""

    rounds = 1

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.state.library = _KernelLibrary(self.state.targetctx.codegen(), "kernel")
        self.state.library.rounds = self.rounds
        self.state.library.enable_object_caching()


class ThoroughCompiler(KernelCompiler):
    """The same with two rounds of optimisation: in the second one LLVM unrolls loops that contain unrolled loops."""

    rounds = 2
