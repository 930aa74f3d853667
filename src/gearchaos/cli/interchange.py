"""The commands that write scripts for other tools, and example study files."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Annotated

import typer

from gearchaos.cli import completion
from gearchaos.cli.errors import say
from gearchaos.cli.options import Sets, StudyPath, app, read_study
from gearchaos.cli.output import check_output
from gearchaos.errors import InputError, unknown_name
from gearchaos.files import check_target, read_bytes, write_bytes

TOOLS = {"scipy": "scipy", "julia": "dynamicalsystems.jl"}
"""The tools of `gearchaos.script` by the names of ``--for``."""

_SUFFIXES = {"scipy": ".py", "julia": ".jl"}


@app.command(rich_help_panel="Proof")
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


@app.command(rich_help_panel="Install")
def examples(
    out: Annotated[
        Path, typer.Option("--out", metavar="FOLDER", help="Where they are written; made if it does not exist.")
    ] = Path("examples"),
) -> None:
    """Write the study files that the manual uses: figures of the paper, and gear pairs."""
    if out.exists() and not out.is_dir():
        raise InputError("--out", "must be a folder", str(out), "Choose another name.")
    out.mkdir(parents=True, exist_ok=True)
    folder = Path(str(files("gearchaos"))) / "examples"
    if not folder.is_dir():  # the sources are installed so that they can be edited
        folder = Path(__file__).parents[3] / "examples"
    contents = {out / source.name: source.read_bytes() for source in sorted(folder.iterdir())}
    for file, content in contents.items():
        check_target("--out", file)
        if file.exists() and read_bytes(file) != content:  # its user may have changed it
            raise InputError("--out", "must not have other files of the same names", str(file),
                             "Rename it, or choose another folder.")
    for file, content in contents.items():
        write_bytes(file, content)
    say(f"wrote {len(contents)} files into {out}")
