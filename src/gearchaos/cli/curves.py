"""The commands for curves of events in two parameters: one curve, or all curves in a window."""

from __future__ import annotations

import json
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearchaos.cli import completion
from gearchaos.cli.options import (
    Json,
    Out,
    OutIfWanted,
    Physical,
    Plot,
    Sets,
    Starts,
    StudyPath,
    app,
    in_units,
    initial_values,
    load_over,
)
from gearchaos.cli.output import PLOT_SUFFIXES, check_output, draw, print_json, save
from gearchaos.files import DATA_SUFFIXES

if TYPE_CHECKING:
    import xarray as xr


@app.command()
def curve(
    study: StudyPath = None,
    sets: Sets = None,
    event: Annotated[
        str,
        typer.Option(metavar="fold|flip|neimark-sacker|graze", help="The event whose curve is followed.",
                     autocompletion=completion.choices("fold", "flip", "neimark-sacker", "graze")),
    ] = "",
    axis: Annotated[
        list[str] | None,
        typer.Option("--axis", metavar="NAME=START:STOP", help="A parameter; first x, then y.",
                     autocompletion=completion.ranges),
    ] = None,
    period: Annotated[
        int | None, typer.Option(help="Minimal period; by default that of the motion that the start leads to.")
    ] = None,
    start: Starts = None,
    out: OutIfWanted = None,
    plot: Plot = None,
    json_out: Json = False,
    physical: Physical = False,
) -> None:
    """Follow the curve of an event of periodic orbits over two parameters."""
    check_output("--out", out, DATA_SUFFIXES)
    check_output("--plot", plot, PLOT_SUFFIXES)
    (x, y), loaded = load_over(axis, ["omega=0.2:2.5", "eps1=0:0.3"], study, sets, physical)
    from gearchaos.studies.curve import curve as follow

    found = follow(loaded.model, event, x, y, start=initial_values(start or []), period=period)
    dataset = in_units(found, loaded, physical)
    save(dataset, out)
    draw(dataset, plot)
    document = curve_document(dataset, x.name, y.name)
    if json_out:
        print_json(document)
    else:
        from gearchaos.cli.tables.branches import print_curve

        print_curve(document, dataset, x.name, y.name)


@app.command()
def skeleton(
    out: Out,
    study: StudyPath = None,
    sets: Sets = None,
    axis: Annotated[
        list[str] | None,
        typer.Option("--axis", metavar="NAME=START:STOP:COUNT",
                     help="First x, then y; COUNT places at which motions are searched, 48 and 24 if left out.",
                     autocompletion=completion.ranges),
    ] = None,
    period: Annotated[int, typer.Option(help="Largest period of the orbits.")] = 4,
    lines: Annotated[
        tuple[int, int], typer.Option(help="Numbers of lines along x and along y on which events are searched.")
    ] = (8, 5),
    starts: Annotated[int, typer.Option(help="Initial states at each place, besides the model's own.")] = 3,
    workers: Annotated[int | None, typer.Option(help="Processes, by default one per core.")] = None,
    plot: Plot = None,
    json_out: Json = False,
    physical: Physical = False,
) -> None:
    """Find all curves of events in a window of two parameters. Interrupted, the same command goes on from there."""
    check_output("--out", out, DATA_SUFFIXES)
    check_output("--plot", plot, PLOT_SUFFIXES)
    _, loaded = load_over(axis, ["omega=0.2:2.5:48", "eps1=0:0.3:24"], study, sets, physical)
    from gearchaos.studies.skeleton import skeleton as find

    journal = Path(f"{out}.part")
    found = find(loaded.model, *(axis or []), period=period, lines=lines, starts=starts, journal=journal, progress=True,
                 workers=workers)
    dataset = in_units(found, loaded, physical)
    save(dataset, out)
    journal.unlink(missing_ok=True)
    draw(dataset, plot)
    document = skeleton_document(dataset)
    if json_out:
        print_json({"study": "skeleton", "out": str(out), "plot": None if plot is None else str(plot), **document})
    else:
        from gearchaos.cli.tables.branches import print_skeleton

        print_skeleton(document)


def curve_document(dataset: xr.Dataset, x: str, y: str) -> dict[str, Any]:
    """The JSON document of a curve: its points, its points of codimension 2, and its ends, none if it is closed.

    It has the units of both parameters if the curve is in physical ones.
    """
    points = zip(dataset[x].values.tolist(), dataset[y].values.tolist(), strict=True)
    special = zip(*(dataset[f"special_{name}"].values.tolist() for name in ("kind", x, y)), strict=True)
    out = {
        "points": [{x: a, y: b} for a, b in points],
        "codimension2": [{"kind": kind, x: a, y: b} for kind, a, b in special],
        "ends": json.loads(dataset.attrs["ends"]),
    }
    from gearchaos.gears.results import is_physical

    if is_physical(dataset):
        out["units"] = {name: dataset[name].attrs["units"] for name in (x, y)}
    return out


def skeleton_document(dataset: xr.Dataset) -> dict[str, Any]:
    """The JSON document of a skeleton: numbers of curves by kind and period, of points, of events without curve."""
    kinds = zip(dataset["curve_kind"].values.tolist(), dataset["curve_period"].values.tolist(), strict=True)
    counts = sorted(Counter(kinds).items(), key=lambda item: (item[0][1], item[0][0]))
    return {
        "curves": [{"kind": kind, "period": period, "count": count} for (kind, period), count in counts],
        "points": dataset.sizes["point"], "codimension2": dict(Counter(dataset["special_kind"].values.tolist())),
        "failed": json.loads(dataset.attrs["failed"]),
    }
