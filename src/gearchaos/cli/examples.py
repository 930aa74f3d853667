"""The command that writes the example study files."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Annotated

import typer

from gearchaos.cli.errors import say
from gearchaos.cli.options import app
from gearchaos.errors import InputError
from gearchaos.files import check_target, read_bytes, write_bytes


@app.command()
def examples(
    out: Annotated[
        Path, typer.Option("--out", metavar="FOLDER", help="Where they are written; made if it does not exist.")
    ] = Path("examples"),
) -> None:
    """Write the study files that the manual uses: figures of the paper, and gear pairs."""
    if out.exists() and not out.is_dir():
        raise InputError("--out", "must be a folder", str(out), "Choose another name.")
    out.mkdir(parents=True, exist_ok=True)
    contents = {out / source.name: source.read_bytes() for source in _sources()}
    for file, content in contents.items():
        _check(file, content)
    for file, content in contents.items():
        write_bytes(file, content)
    say(f"wrote {len(contents)} files into {out}")


def _check(file: Path, content: bytes) -> None:
    """Raise `InputError` if a file of this name has another content, which its user may have changed."""
    check_target("--out", file)
    if file.exists() and read_bytes(file) != content:
        raise InputError("--out", "must not have other files of the same names", str(file),
                         "Rename it, or choose another folder.")


def _sources() -> list[Path]:
    """The files as they are installed, with a page that lists them."""
    folder = Path(str(files("gearchaos"))) / "examples"
    if not folder.is_dir():  # the sources are installed so that they can be edited
        folder = Path(__file__).parents[3] / "examples"
    return sorted(folder.iterdir())
