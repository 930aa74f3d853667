"""The command line: commands that write files, and print one JSON document or a table of text."""

from __future__ import annotations

import sys
import warnings
from typing import Annotated

import typer

from gearchaos.cli import completion, process
from gearchaos.cli.errors import warn
from gearchaos.cli.interrupts import ended_by_signals
from gearchaos.cli.options import app
from gearchaos.errors import InputError

# isort: off
# Importing a module adds its commands to the application; --help lists its groups, and what is in them, in this order.
from gearchaos.cli import gears, assess, modes, studies, explore, runs, proofs, installation  # noqa: F401
# isort: on

__all__ = ["app", "main"]


def main() -> None:
    """Entry point of the ``gearchaos`` command, in a process of its own."""
    process.own_process = True
    process.collect_garbage(imported=False)  # until `process.load_kernels` has imported Numba
    if sys.stdout is not None:  # it may be closed
        sys.stdout.reconfigure(errors="replace")  # type: ignore[union-attr]
    warnings.showwarning = lambda text, *_: warn(str(text))  # without the line of the program it comes from
    completion.join_words()
    with ended_by_signals():
        app(prog_name="gearchaos")


@app.callback(invoke_without_command=True)
def _options(
    context: typer.Context,
    version: Annotated[bool, typer.Option("--version", help="Show the version and exit.")] = False,
    verbose: Annotated[
        bool, typer.Option("--verbose", help="With --version: packages, processor, kernel cache, for error reports.")
    ] = False,
    json_out: Annotated[bool, typer.Option("--json", help="With --version: as one JSON document.")] = False,
) -> None:
    """Options before the command."""
    if version:
        installation.print_version(verbose, json_out)
        raise typer.Exit()
    for option, given in {"--verbose": verbose, "--json": json_out}.items():
        if given:
            raise InputError(option, "needs --version before the command", True,
                             "Options of a command are given after its name.")
    if context.invoked_subcommand is None:
        context.fail("Missing command.")
