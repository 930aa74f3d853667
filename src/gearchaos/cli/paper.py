"""The commands that reproduce the paper, and compile all kernels."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gearchaos.cli import completion
from gearchaos.cli.errors import say
from gearchaos.cli.options import app
from gearchaos.errors import InputError


@app.command(rich_help_panel="Install")
def warmup() -> None:
    """Compile all kernels now, so that no later command has to."""
    from gearchaos.studies.warmup import MODELS
    from gearchaos.studies.warmup import warmup as run

    say(f"compiling the kernels of models with {min(MODELS)} to {max(MODELS)} coordinates; this happens once")
    for dimension, seconds in run():
        say(f"{dimension} coordinates: ready after {seconds:.0f} s")


@app.command(rich_help_panel="Proof")
def paper(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder of the report.", readable=False)],
    figures: Annotated[str | None, typer.Option(metavar="2,6,9", help="Only these figures.")] = None,
    quality: Annotated[str, typer.Option(
        metavar="draft|paper", help="Number of cells and columns.", autocompletion=completion.choices("draft", "paper"),
    )] = "paper",
) -> None:
    """Reproduce the 2008 paper: a report with every figure, and every claim compared with computed values."""
    try:
        numbers = None if figures is None else [int(part) for part in figures.split(",")]
    except ValueError:
        rule = "must be numbers with commas between"
        raise InputError("--figures", rule, figures, "E.g. --figures 2,6,9.") from None
    from gearchaos.flow import cache_is_empty
    from gearchaos.paper.report import build
    from gearchaos.paper.settings import chosen_figures
    from gearchaos.studies.warmup import warmup as compile_kernels

    chosen_figures(numbers)  # checked before anything is compiled
    if cache_is_empty():
        say("compiling the kernels, once after an install or an update")
        list(compile_kernels((2, 4)))  # those of both of the paper's models at the same time, one core each
    raise typer.Exit(build(out, figures=numbers, quality=quality, progress=True))
