"""Output of commands: data files, pictures and JSON. Paths are checked before anything is computed."""

from __future__ import annotations

import io
import json
import math
import os
import tempfile
from collections.abc import Iterable
from contextlib import nullcontext, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gearchaos.cli.errors import say
from gearchaos.errors import InputError
from gearchaos.files import check_target, write_bytes

if TYPE_CHECKING:
    import xarray as xr

PLOT_SUFFIXES = (".png", ".pdf", ".svg")

_DPI = 150
"""Resolution of pictures in dots per inch."""


def check_output(option: str, path: Path | None, suffixes: tuple[str, ...]) -> None:
    """Raise `InputError` unless ``path`` has one of these suffixes, or none, and a file can be written there."""
    if path is None:
        return
    if path.suffix and path.suffix.lower() not in suffixes:
        raise InputError(option, f"must end in {', '.join(suffixes)}", str(path))
    check_target(option, path)
    if not _writable(path):
        raise InputError(option, "must be writable", str(path), "Choose a folder you may write in.")


def _writable(path: Path) -> bool:
    """Whether this process may create or replace a file at a path."""
    try:
        with tempfile.TemporaryFile(dir=path.parent):
            return not path.exists() or os.access(path, os.W_OK)
    except OSError:
        return False


def save(dataset: xr.Dataset, path: Path | None) -> None:
    """Write a Dataset as a complete file, or as tables of text, if there is a path."""
    if path is not None:
        from gearchaos.studies import save as write

        say_written(write(dataset, path))


def say_written(paths: Iterable[Path]) -> None:
    """Print on stderr which files were written."""
    for path in paths:
        say(f"wrote {path}")


def draw(
    dataset: xr.Dataset, path: Path | None, *, colour: str | None = None, note: str = "", dpi: int = _DPI,
    style: str | None = None, width: str | None = None, hatch: bool = False, over: xr.Dataset | None = None,
) -> None:
    """Write the picture of a result as a complete file, if there is a path.

    Parameters
    ----------
    dataset : Dataset
        From any study.
    path : Path or None
        Its suffix sets the format.
    colour : str, optional
        See `gearchaos.plot.result`.
    note : str
        Text below the lower right corner.
    dpi : int
        Resolution in dots per inch.
    style, width : str, optional
        See `gearchaos.plot.style`; the width may be a number as text.
    hatch, over
        See `gearchaos.plot.result`.
    """
    if path is None:
        return
    import matplotlib

    matplotlib.use("Agg")
    from gearchaos import plot
    from gearchaos.plot.theme import adapt

    with nullcontext() if style is None else plot.style(style, _width(width)):
        figure = plot.result(dataset, colour, hatch=hatch, over=over)
        if note:
            below = "top" if style is None else "bottom"  # with a style, files have the size of the figure
            figure.text(1, 0, note, ha="right", va=below, color=adapt("0.35"), fontsize="small")
        _write_picture(figure, path, {"dpi": dpi, "bbox_inches": "tight"} if style is None else {})


def _width(text: str | None) -> str | float | None:
    """A width by its name or, if it is one, as a number of mm."""
    with suppress(TypeError, ValueError):
        return float(text)  # type: ignore[arg-type]  # None is one of the values without a number
    return text


def draw_dossier(dataset: xr.Dataset, title: str, path: Path) -> None:
    """Write the picture of one motion (history, phase trajectory, portrait, spectrum) as a complete file."""
    import matplotlib

    matplotlib.use("Agg")
    from gearchaos import plot

    _write_picture(plot.dossier(dataset, title=title), path, {"dpi": 150, "bbox_inches": "tight"})


def _write_picture(figure: Any, path: Path, options: dict[str, Any]) -> None:
    """Write a figure as a complete file, with these options of ``savefig``, and close it."""
    import matplotlib.pyplot as plt

    picture = io.BytesIO()
    figure.savefig(picture, format=path.suffix.lstrip(".").lower() or "png", **options)
    plt.close(figure)
    write_bytes(path, picture.getvalue())
    say(f"wrote {path}")


def print_json(document: dict[str, Any]) -> None:
    """Print one JSON document on stdout, with null for NaN and infinity."""
    print(json.dumps(_finite(document), allow_nan=False))


def _finite(value: Any) -> Any:
    """A value with None for each number in it that is not finite."""
    if isinstance(value, dict):
        return {key: _finite(v) for key, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(v) for v in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def say_proofs(document: dict[str, Any]) -> None:
    """Print on stderr how many cells of a map are proved, if its document says so."""
    from gearchaos.studies.proved_cells import proof_counts_in_words

    if "proofs" in document:
        say(proof_counts_in_words(document["proofs"]))


def print_version(verbose: bool, json_out: bool) -> None:
    """Print the version on stdout; ``verbose`` adds what a report of an error should say of the installation."""
    from importlib.metadata import version

    from gearchaos.installation.packages import report

    found = report() if verbose else {"gearchaos": version("gearchaos")}
    if json_out:
        print(json.dumps(found))
    elif verbose:
        print("\n".join(_lines(found)))
    else:
        print(f"gearchaos {found['gearchaos']}")


def _lines(found: dict[str, Any]) -> list[str]:
    """A report of the installation as lines of text."""
    cpu, cache = found["processor"], found["kernel_cache"]
    fma = "with" if cpu["fma"] else "without"
    rows = {
        "gearchaos": found["gearchaos"], "Python": found["python"], "platform": found["platform"],
        "processor": f"{cpu['name']}, {cpu['instruction_set']} ({cpu['vector_bits']} bits), {fma} fused multiply-add",
        "cores": str(found["cores"]), "memory": f"{found['memory'] / 2**30:.1f} GiB",
        "kernel cache": f"{cache['folder']} ({cache['kernels']} kernels, {cache['bytes'] / 2**20:.0f} MiB)",
        **{f"${name}": value for name, value in found["environment"].items()},
        **{name: value or "missing" for name, value in found["packages"].items()},
    }
    width = max(map(len, rows))
    return [f"{name:{width}}  {value}" for name, value in rows.items()]
