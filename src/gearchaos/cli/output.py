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
from gearchaos.quantities import parse, quantity

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
    from gearchaos.plot._theme import adapt

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


def attractor_list(dataset: xr.Dataset) -> dict[str, Any]:
    """The JSON document of the attractors of one operating point.

    It has an entry for each attractor, the fraction of initial states that diverge or stay undecided, the number of
    initial states, and the index of the attractor in which each sweep ends.
    """
    from gearchaos.dynamics.response import CONTACTS
    from gearchaos.studies import motions

    rows = []
    for i, label in enumerate(motions(dataset["attractor_label"], dataset["attractor_period"])):
        one = {n: dataset[f"attractor_{n}"].values[i].item() for n in _ATTRACTOR_FIELDS}
        period, contact = int(dataset["attractor_period"][i]), CONTACTS[int(dataset["attractor_contact"][i])]
        rows.append({"label": label, "period": period or None, "contact": contact, **one, **_kick(dataset, i)})
    undecided = float((dataset["attractor"] < 0).mean())
    ends = {n: int(dataset[f"attractor_{n}"]) for n in ("up", "down") if f"attractor_{n}" in dataset}
    swept = {f"swept_{n}": i if i >= 0 else None for n, i in ends.items()}
    return {"attractors": rows, "undecided_fraction": undecided, "starts": int(dataset.sizes["start"]), **swept}


def _kick(dataset: xr.Dataset, number: int) -> dict[str, Any]:
    """The smallest destabilising perturbation of one attractor; empty if it was not computed."""
    if "attractor_kick" not in dataset:
        return {}
    parts = ("attractor_kick_change", "attractor_kick_point")
    names = dataset["coordinate"].values.tolist()
    change, point = (dict(zip(names, dataset[n].values[number].tolist(), strict=True)) for n in parts)
    return {"kick": dataset["attractor_kick"].values[number].item(), "kick_change": change, "kick_point": point}


_ATTRACTOR_FIELDS = (
    "fraction", "fraction_lo", "fraction_hi", "v_rms", "contact_fraction", "dynamic_factor", "lyapunov",
    "lyapunov_lo", "lyapunov_hi", "multiplier", "residual",
)
"""The variables ``attractor_<name>`` that are keys of the JSON of an attractor."""


def attractor_units(dataset: xr.Dataset) -> dict[str, str]:
    """The physical units in `attractor_list`, by key; empty for a dimensionless result."""
    units = {name: dataset[f"attractor_{name}"].attrs["units"] for name in _ATTRACTOR_FIELDS}
    return {name: unit for name, unit in units.items() if unit != quantity(name).unit}


def section(dataset: xr.Dataset) -> dict[str, list[float]]:
    """The stroboscopic section of a simulation: τ and every coordinate by name, one value per mesh period."""
    return {short: dataset[name].values.tolist() for short, name in _section_names(dataset).items()}


def section_units(dataset: xr.Dataset) -> dict[str, str]:
    """The units of `section`, by the same names."""
    return {short: dataset[name].attrs["units"] for short, name in _section_names(dataset).items()}


def _section_names(dataset: xr.Dataset) -> dict[str, str]:
    """The names of the variables of a stroboscopic section, by the names of their coordinates."""
    parts = map(parse, map(str, dataset.data_vars))
    return {"tau": "tau_section", **{name.base: str(name) for name in parts if name.prefix == "section_"}}


def proof_summary(dataset: xr.Dataset) -> dict[str, Any]:
    """How many cells of a map are proved, as the value of ``proofs``; empty if no proofs were asked for."""
    if "proved" not in dataset:
        return {}
    from gearchaos.studies.proved_cells import proof_counts

    return {"proofs": proof_counts([dataset])}


def say_proofs(summary: dict[str, Any]) -> None:
    """Print on stderr how many cells of a map are proved, from its `proof_summary`."""
    from gearchaos.studies.proved_cells import proof_counts_in_words

    for counts in summary.values():
        say(proof_counts_in_words(counts))
