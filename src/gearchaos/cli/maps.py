"""The commands that scan parameters or initial values: bifurcation diagrams, zones and basins."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from gearchaos.cli import completion
from gearchaos.cli.options import (
    AxisTexts,
    Json,
    Out,
    Physical,
    Plot,
    Refine,
    Sets,
    StartsPerCell,
    StudyPath,
    app,
    given,
    in_units,
    load,
    parse_axes,
    study_axes,
)
from gearchaos.cli.output import MapOutput


@app.command()
def bifurcation(
    out: Out,
    study: StudyPath = None,
    sets: Sets = None,
    axis: AxisTexts = None,
    points: Annotated[
        int | None, typer.Option(min=0, help="Stroboscopic points per column; 0 for verdicts only.")
    ] = None,
    mode: Annotated[
        str | None,
        typer.Option(metavar="fixed|up|down", help="Columns from the model's initial values, or a sweep.",
                     autocompletion=completion.choices("fixed", "up", "down")),
    ] = None,
    plot: Plot = None,
    json_out: Json = False,
    physical: Physical = False,
) -> None:
    """Scan one parameter: stroboscopic points, verdicts and exponents."""
    output = MapOutput(out, plot, json_out)
    _run("bifurcation", study, sets, axis, output, physical, points=points, mode=mode)


@app.command()
def zones(
    out: Out,
    study: StudyPath = None,
    sets: Sets = None,
    axis: AxisTexts = None,
    starts: StartsPerCell = None,
    refine: Refine = None,
    prove: Annotated[bool, typer.Option("--prove", help="Prove the periodic motions in ball arithmetic.")] = False,
    certificates: Annotated[
        str | None, typer.Option(metavar="DIR", help="Write a certificate for each proved cell to this folder.")
    ] = None,
    plot: Plot = None,
    json_out: Json = False,
    physical: Physical = False,
) -> None:
    """Map the kinds of motion over two parameters."""
    output = MapOutput(out, plot, json_out)
    options = {"starts": starts, "refine": refine, "prove": prove or None, "certificates": certificates}
    _run("zones", study, sets, axis, output, physical, **options)


@app.command()
def basins(
    out: Out,
    study: StudyPath = None,
    sets: Sets = None,
    axis: AxisTexts = None,
    plot: Plot = None,
    json_out: Json = False,
    physical: Physical = False,
) -> None:
    """Map the basins of attraction over two initial values."""
    output = MapOutput(out, plot, json_out)
    _run("basins", study, sets, axis, output, physical)


def _run(
    kind: str, study: Path | None, sets: list[str] | None, texts: list[str] | None, output: MapOutput,
    physical: bool, **options: Any,
) -> None:
    """Check everything, compute the study, and write its files."""
    output.check()
    given_axes = parse_axes(texts)
    from gearchaos.studies.registry import study_class

    loaded = load(study, sets, physical, given_axes)
    axes = study_axes(kind, loaded, given_axes)
    dataset = loaded.study(study_class(kind), **axes, **given(**options)).run(progress=True)
    output.write(kind, in_units(dataset, loaded, physical), axes.values())
