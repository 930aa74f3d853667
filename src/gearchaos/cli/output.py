"""Output of commands: data files, pictures, certificates, JSON and tables. Paths are checked before anything else."""

from __future__ import annotations

import io
import math
import os
import tempfile
import textwrap
from collections.abc import Iterable
from contextlib import nullcontext, suppress
from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearchaos.cli.errors import PAGE_WIDTH, say
from gearchaos.errors import InputError
from gearchaos.files import check_target, strict_json, write_bytes
from gearchaos.formats import format_of
from gearchaos.quantities import OPERATION, quantity

if TYPE_CHECKING:
    import numpy as np
    import xarray as xr
    from matplotlib.figure import Figure
    from rich.table import Table

    from gearchaos.proof.certificate import Certificate, Unproved
    from gearchaos.proof.families.chaos import ChaoticSet

PLOT_SUFFIXES = (".png", ".pdf", ".svg")

DPI = 150
"""Resolution of pictures in dots per inch."""

FILE_WIDTH = 160
"""Widths in characters where stdout is not a terminal: of a table with rules, and of one without."""

SHOWN_ROWS = 20
"""Most rows of a long table that are printed."""


def check_output(option: str, path: Path | None, suffixes: tuple[str, ...]) -> None:
    """Raise `InputError` unless ``path`` has one of these suffixes, or none, and a file can be written there."""
    if path is None:
        return
    if path.suffix and path.suffix.lower() not in suffixes:
        raise InputError(option, f"must end in {', '.join(suffixes)}", str(path))
    _check_writable(option, path)


def check_files(out: Path | None, plot: Path | None = None, spectra: bool = False) -> None:
    """Raise `InputError` unless ``out`` is that of a format of results, of one for ``spectra`` or for any result,
    ``plot`` that of a picture, and files can be written there."""
    if out is not None:
        format_of("--out", out, spectra).check("--out")
        _check_writable("--out", out)
    check_output("--plot", plot, PLOT_SUFFIXES)


def _check_writable(option: str, path: Path) -> None:
    """Raise `InputError` unless a file can be written at ``path``."""
    check_target(option, path)
    try:
        with tempfile.TemporaryFile(dir=path.parent):
            writable = not path.exists() or os.access(path, os.W_OK)
    except OSError:
        writable = False
    if not writable:
        raise InputError(option, "must be writable", str(path), "Choose a folder you may write in.")


def save(dataset: xr.Dataset, path: Path | None) -> None:
    """Write a Dataset as a complete file, or as tables of text, if there is a path."""
    if path is not None:
        from gearchaos.studies import save as write

        say_written(*write(dataset, path))


def say_written(*paths: Path) -> None:
    """Print on stderr which files were written."""
    for path in paths:
        say(f"wrote {path}")


def write_certificate(result: Certificate | ChaoticSet | Unproved, path: Path | None) -> None:
    """Write a certificate to a path, if there are both, and say so."""
    from gearchaos.proof.certificate import Unproved

    if path is None:
        return
    if isinstance(result, Unproved):
        say(f"no certificate: {result.in_words()}")
    else:
        result.write(path)
        say_written(path)


def draw(
    dataset: xr.Dataset, path: Path | None, *, colour: str | None = None, note: str = "", dpi: int = DPI,
    style: str | None = None, width: str | None = None, hatch: bool = False, over: xr.Dataset | None = None,
    title: str | None = None,
) -> None:
    """Write the picture of a result as a complete file, in the format of its suffix, if there is a path.

    The ``note`` stands below the lower right corner. For ``style`` and ``width``, which may be a number as text, see
    `gearchaos.plot.style`; for the others `gearchaos.plot.result`. One motion, with a ``title``, is drawn as
    history, phase trajectory, portrait and spectrum.
    """
    if path is None:
        return
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    from gearchaos import plot
    from gearchaos.plot.theme import adapt

    in_mm: str | float | None = width
    with suppress(TypeError, ValueError):
        in_mm = float(width)  # type: ignore[arg-type]  # None is one of the values without a number
    with nullcontext() if style is None else plot.style(style, in_mm):
        figure: Any = (plot.result(dataset, colour, hatch=hatch, over=over) if title is None
                       else plot.motion(dataset, title=title))
        if note:
            below = "top" if style is None else "bottom"  # with a style, files have the size of the figure
            figure.text(1, 0, note, ha="right", va=below, color=adapt("0.35"), fontsize="small")
        write_figure(figure, path, **({"dpi": dpi, "bbox_inches": "tight"} if style is None else {}))
    plt.close(figure)


def write_figure(figure: Figure, path: Path, **size: Any) -> None:
    """Write a figure as a complete file, in the format of its suffix; ``size`` as for its ``savefig``."""
    picture = io.BytesIO()
    figure.savefig(picture, format=path.suffix.lstrip(".").lower() or "png", **size)
    write_bytes(path, picture.getvalue())
    say_written(path)


def print_json(document: dict[str, Any]) -> None:
    """Print one JSON document on stdout, with null for NaN and infinity."""
    print(strict_json(document))


def say_proofs(document: dict[str, Any]) -> None:
    """Print on stderr how many cells of a map are proved, if its document says so."""
    from gearchaos.studies.proofs.proved_cells import proof_counts_in_words

    if "proofs" in document:
        say(proof_counts_in_words(document["proofs"]))


def print_wrapped(text: str) -> None:
    """Print a text in lines of at most 79 characters."""
    print("\n".join(textwrap.wrap(text, 79, subsequent_indent="  ")))


def print_table(table: Table) -> None:
    """Print a table in the width of the terminal, without blanks at the ends of lines."""
    from rich.console import Console

    console = Console()
    width = console.width if console.is_terminal else FILE_WIDTH if table.box else PAGE_WIDTH
    console = Console(width=width, markup=False)  # a unit in brackets, "[um]", is no markup
    with console.capture() as lines:
        console.print(table)
    print(*(line.rstrip() for line in lines.get().splitlines()), sep="\n", flush=True)


def facts_table() -> Table:
    """A table with rules whose rows are names and values."""
    from rich.table import Table

    return Table(show_header=False)


def plain_table(*titles: str, left: Iterable[str] = (), gap: int = 2) -> Table:
    """A table without rules, which leaves more of the width to its columns, with ``gap`` spaces between them.

    Its columns are on the right but for those whose titles are in ``left``; without titles its rows have any columns.
    """
    from rich.table import Table

    table = Table(box=None, padding=(0, gap, 0, 0), show_header=bool(titles))
    for title in titles:
        table.add_column(title, justify="left" if title in left else "right", overflow="fold")
    return table


def shown_rows(count: int) -> list[int]:
    """The indices of the rows that are printed of a table with many, the first and the last among them."""
    return sorted({round(i * (count - 1) / (SHOWN_ROWS - 1)) for i in range(SHOWN_ROWS)})


def ranges(where: Iterable[bool], values: np.ndarray) -> list[list[float]]:
    """First and last of the values in each run of neighbours for which a condition holds."""
    runs = ([i for i, _ in run] for holds, run in groupby(enumerate(where), lambda each: bool(each[1])) if holds)
    return [[float(values[run[0]]), float(values[run[-1]])] for run in runs]


def edges_in_words(first: float, last: float) -> str:
    """The ends of a range of `ranges`."""
    return f"{first:.5g} to {last:.5g}" if first != last else f"{first:.5g}"


def shown(value: Any) -> str:
    """A value as text; "none" for None and NaN."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "none"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def unit_after(dataset: xr.Dataset, name: str) -> str:
    """The unit of a parameter with a space before it; empty for a dimensionless one."""
    unit = dataset[name].attrs["units"]
    dimensional = unit != quantity(name).unit or name in {q.name for q in OPERATION}
    return f" {unit.replace('*', ' ')}" if dimensional else ""
