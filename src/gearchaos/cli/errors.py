"""What a command says besides its results: messages, and errors, one line on stderr and an exit code.

Bad input never gives a traceback.
"""

from __future__ import annotations

import errno
import shutil
import sys
import textwrap
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, ClassVar

import typer
from typer.core import TyperGroup

from gearchaos.errors import DesignWarning, InputError

BAD_INPUT, INTERRUPTED, TERMINATED = 2, 130, 143
"""Exit codes; those of signals are as shells give them."""

PAGE_WIDTH = 80
"""Longest line of an answer or a message, in characters."""


class Terminated(KeyboardInterrupt):
    """SIGTERM, by which schedulers end a job; a command ends as after Ctrl-C."""


class Commands(TyperGroup):
    """The group of all commands, which reports their errors.

    A command that it has not is asked of ``more``: it may be that of a study of another package.
    """

    more: ClassVar[Callable[[str], Any]] = lambda name: None

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        return super().get_command(ctx, cmd_name) or type(self).more(cmd_name)

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
    except MemoryError as error:
        from gearchaos.execute.machine import gigabytes, memory

        what = f"; {error}" if str(error) else ""  # NumPy says how much, and for which array
        _fail(f"error: not enough memory, of {gigabytes(memory())} on this machine{what}. Ask for fewer cells, points "
              "or periods.", BAD_INPUT)
    except OSError as error:
        if error.errno == errno.EPIPE:  # the reader of the pipe has ended: typer exits silently
            raise
        full = errno.errorcode.get(error.errno or 0) in ("ENOSPC", "EDQUOT")
        _fail(f"error: {error}" + ". Free space, or write to another place." * full, BAD_INPUT)
    except KeyboardInterrupt as interrupt:
        raise typer.Exit(say_interrupted(isinstance(interrupt, Terminated))) from None


def _fail(message: str, code: int) -> None:
    """Print a message, in a terminal broken between words, and end the command with an exit code."""
    if sys.stderr is not None and sys.stderr.isatty():
        columns = shutil.get_terminal_size().columns
        message = "\n".join(textwrap.fill(line, columns, break_long_words=False, break_on_hyphens=False)
                            for line in message.splitlines())
    say(message)
    raise typer.Exit(code) from None


def say_interrupted(terminated: bool) -> int:
    """Print that a signal has ended the command; gives its exit code."""
    say("terminated" if terminated else "interrupted")
    return TERMINATED if terminated else INTERRUPTED


def say(message: str) -> None:
    """Print a message for the user on stderr, unless that is closed; stdout is for results."""
    if sys.stderr is not None:  # otherwise print would use stdout
        print(message, file=sys.stderr, flush=True)


def warn(text: str) -> None:
    """Print a warning on stderr, in lines of `PAGE_WIDTH`."""
    say(textwrap.fill(f"warning: {text}", PAGE_WIDTH, subsequent_indent="  ", break_on_hyphens=False))
