"""The command that writes a model as a script for another tool."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from gearchaos.cli import completion
from gearchaos.cli.errors import say
from gearchaos.cli.options import Sets, StudyPath, app, read_study
from gearchaos.cli.output import check_output
from gearchaos.errors import unknown_name
from gearchaos.files import write_bytes

TOOLS = {"scipy": "scipy", "julia": "dynamicalsystems.jl"}
"""The tools of `gearchaos.script` by the names of ``--for``."""

_SUFFIXES = {"scipy": ".py", "julia": ".jl"}


@app.command()
def script(
    study: StudyPath = None,
    sets: Sets = None,
    tool: Annotated[
        str, typer.Option("--for", metavar="scipy|julia", help="Tool that runs the script.",
                          autocompletion=completion.choices("scipy", "julia"))
    ] = "scipy",
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Script to write; otherwise on stdout.", readable=False)
    ] = None,
) -> None:
    """Write the model as a stand-alone script for SciPy or DynamicalSystems.jl, to check a result there."""
    if tool not in TOOLS:
        raise unknown_name("--for", tool, TOOLS)
    check_output("--out", out, (_SUFFIXES[tool],))
    from gearchaos.interchange.scripts import script as text_of

    text = text_of(read_study(study, sets).model, TOOLS[tool])
    if out is None:
        print(text, end="")
    else:
        write_bytes(out, text.encode())
        say(f"wrote {out}")
