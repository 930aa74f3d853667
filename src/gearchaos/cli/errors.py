"""What a command raises becomes one line on stderr and an exit code; never a traceback for bad input."""

from __future__ import annotations

import errno
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import typer
from typer.core import TyperGroup

from gearchaos.errors import InputError

BAD_INPUT, INTERRUPTED = 2, 130


class Commands(TyperGroup):
    """The group of all commands, with their errors in words."""

    def make_context(self, *arguments: Any, **options: Any) -> Any:
        with _in_words():  # --version and --help write while arguments are read
            _check_stdout()
            return super().make_context(*arguments, **options)

    def invoke(self, ctx: Any) -> Any:
        with _in_words():
            return super().invoke(ctx)


def _check_stdout() -> None:
    """Raise `InputError` if results would be lost, or go to the first file that is opened in place of stdout."""
    if sys.stdout is None:
        raise InputError("stdout", "must be open", "closed", "Send it to a file, or to /dev/null.")


@contextmanager
def _in_words() -> Iterator[None]:
    try:
        yield
    except InputError as error:
        _fail(f"error: {error}", BAD_INPUT)
    except MemoryError:
        _fail("error: not enough memory. Ask for fewer cells, points or periods.", BAD_INPUT)
    except OSError as error:
        if error.errno == errno.EPIPE:  # the reader of a pipe has gone: typer ends quietly
            raise
        _fail(f"error: {error}", BAD_INPUT)
    except KeyboardInterrupt:
        _fail("interrupted", INTERRUPTED)


def _fail(message: str, code: int) -> None:
    say(message)
    raise typer.Exit(code) from None


def say(message: str) -> None:
    """Print a message for people, unless stderr is closed; stdout is for results."""
    if sys.stderr is not None:  # else print would take stdout
        print(message, file=sys.stderr, flush=True)


def announce_compilation() -> None:
    """Say so if kernels have to be compiled, since nothing else happens meanwhile."""
    from gearchaos.flow import on_compile

    told: list[bool] = []

    def tell() -> None:
        if not told:
            told.append(True)
            say("compiling the kernels, once after an install or an update; gearchaos warmup does it for all models")

    on_compile(tell)
