"""What a command says besides its results: errors, one line on stderr and an exit code, and that kernels are compiled.

Bad input never gives a traceback.
"""

from __future__ import annotations

import errno
import gc
import itertools
import shutil
import sys
import textwrap
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import typer
from typer.core import TyperGroup

from gearchaos.errors import DesignWarning, InputError

BAD_INPUT, INTERRUPTED = 2, 130
"""Exit codes."""


class Commands(TyperGroup):
    """The group of all commands, which reports their errors."""

    def make_context(self, *arguments: Any, **options: Any) -> Any:
        with reported():  # --version and --help print while arguments are parsed
            if sys.stdout is None:  # results would be lost, or written to the next file that is opened
                raise InputError("stdout", "must be open", "closed", "Send it to a file, or to /dev/null.")
            return super().make_context(*arguments, **options)

    def invoke(self, ctx: Any) -> Any:
        with reported(), warnings.catch_warnings():
            warnings.simplefilter("ignore", DesignWarning)  # commands print them in their own words
            return super().invoke(ctx)


@contextmanager
def reported() -> Iterator[None]:
    """Report errors that concern the user as a message and an exit code."""
    try:
        yield
    except InputError as error:
        _fail(f"error: {error}", BAD_INPUT)
    except MemoryError:
        _fail("error: not enough memory. Ask for fewer cells, points or periods.", BAD_INPUT)
    except OSError as error:
        if error.errno == errno.EPIPE:  # the reader of the pipe has ended: typer exits silently
            raise
        _fail(f"error: {error}", BAD_INPUT)
    except KeyboardInterrupt:
        _fail("interrupted", INTERRUPTED)


def _fail(message: str, code: int) -> None:
    """Print a message, in a terminal broken between words, and end the command with an exit code."""
    if sys.stderr is not None and sys.stderr.isatty():
        columns = shutil.get_terminal_size().columns
        message = "\n".join(textwrap.fill(line, columns, break_long_words=False, break_on_hyphens=False)
                            for line in message.splitlines())
    say(message)
    raise typer.Exit(code) from None


def say(message: str) -> None:
    """Print a message for the user on stderr, unless that is closed; stdout is for results."""
    if sys.stderr is not None:  # otherwise print would use stdout
        print(message, file=sys.stderr, flush=True)


own_process = False
"""Whether this process runs a command and nothing else; `gearchaos.cli.main` says so."""

COLLECTION = gc.get_threshold()
"""How often garbage is collected where something is computed: of what is imported before, nothing is garbage."""

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
    if own_process:
        gc.freeze()  # what is imported is in use to the end
        gc.set_threshold(*COLLECTION)
