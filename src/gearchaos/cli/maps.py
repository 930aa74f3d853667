"""The commands that scan parameters or initial values: bifurcation diagrams, zones and basins."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

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
)
from gearchaos.cli.output import MapOutput
from gearchaos.errors import InputError

if TYPE_CHECKING:
    from gearchaos.studies.axis import Axis
    from gearchaos.studyfile import LoadedStudy


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
    axes = _axes(kind, loaded, given_axes)
    dataset = loaded.study(study_class(kind), **axes, **given(**options)).run(progress=True)
    output.write(kind, in_units(dataset, loaded, physical), axes.values())


def _axes(kind: str, loaded: LoadedStudy, given_axes: list[Axis]) -> dict[str, Axis]:
    """The axes by field of the study. Axes of the command line replace those of the study file with the same name."""
    from gearchaos.studies.axis import axis_example
    from gearchaos.studies.registry import study_class

    names = study_class(kind).axis_fields
    from_file = [axis for name, axis in loaded.options_for(kind).items() if name in names]
    by_name = {a.name: a for a in given_axes}
    if len(given_axes) < len(names) and by_name.keys() <= {a.name for a in from_file}:
        given_axes = [by_name.get(a.name, a) for a in from_file]
    if len(given_axes) != len(names):
        times = "once" if len(names) == 1 else "twice"
        examples = " ".join(f"--axis {axis_example(name)}" for name in _examples(kind, loaded)[: len(names)])
        raise InputError("--axis", f"must be given {times}", sorted(by_name), f"E.g. {examples}.")
    return dict(zip(names, given_axes, strict=True))


def _examples(kind: str, loaded: LoadedStudy) -> tuple[str, str]:
    """Names of axes that suit a study of this kind, for an error message."""
    if kind == "basins":
        return "z", "z_dot"
    return ("omega", "eps1") if loaded.gears is None else ("speed", "torque")
