"""A command in its own process: what is imported, how garbage is collected, how kernels are compiled."""

from __future__ import annotations

import gc
import itertools
import sys

from gearchaos.cli.errors import say

own_process = False
"""Whether this process runs a command and nothing else; `gearchaos.cli.main` says so."""

_COLLECTION = gc.get_threshold()


def collect_garbage(imported: bool) -> None:
    """In a command's own process collect no garbage while modules are imported; once they are, leave them out of it.

    What is imported is in use to the end, and looking at it takes up to a quarter of the time of a short command.
    """
    if own_process:
        if imported:
            gc.freeze()
        gc.set_threshold(_COLLECTION[0] if imported else 500_000, *_COLLECTION[1:])


_UNUSED = "scipy.linalg.cython_blas", "cffi"
"""What Numba imports if it is installed, for functions that use `numpy.dot`, `numpy.linalg` or C libraries."""


def load_kernels() -> None:
    """Import Numba, and print a message whenever the compilation of a kernel begins, and how many there are at most.

    In a command's own process it is imported without `_UNUSED`, which take up to a third of a second. No kernel uses
    them, and no other compiled functions run there. They can be imported afterwards.
    """
    if own_process:
        unused = [name for name in _UNUSED if name not in sys.modules]
        sys.modules.update(dict.fromkeys(unused))  # type: ignore[arg-type]  # they cannot be imported then
        try:
            from numba.core.registry import cpu_target

            cpu_target.target_context.refresh()  # it imports them, too
        finally:
            for name in unused:
                del sys.modules[name]
    from gearchaos.execute.machine import cores
    from gearchaos.flow import compile_beside, on_compile

    beside = own_process and cores() > 1
    if beside:
        compile_beside()
    note = {1: ", and the others beside it"} if beside else {2: ", which takes the longest"}
    count = itertools.count(1)

    def announce() -> None:
        number = next(count)
        if number == 1:
            say("compiling the kernels, once after an install; gearchaos warmup compiles them all")
        # each of five is compiled once for a dimension of the state: the first makes the tables of the motion, the
        # second advances it, and the last is for branches alone
        say(f"compiling kernel {number} of at most 5{note.get(number, '')}")

    on_compile(announce)
    collect_garbage(imported=True)
