"""The commands that scan parameters or initial values: bifurcation diagrams, zones and basins."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearchaos.cli.options import (
    AxisTexts,
    Json,
    Out,
    Physical,
    Plot,
    Sets,
    StudyPath,
    app,
    axis_starts,
    given,
    in_units,
    load,
)
from gearchaos.cli.output import PLOT_SUFFIXES, check_output, draw, print_json, save, summary
from gearchaos.errors import InputError
from gearchaos.files import DATA_SUFFIXES

if TYPE_CHECKING:
    import xarray as xr

    from gearchaos.studies.axis import Axis
    from gearchaos.studies.study import Study
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
        str | None, typer.Option(metavar="fixed|up|down", help="Columns from the model's initial values, or a sweep.")
    ] = None,
    plot: Plot = None,
    json_out: Json = False,
    physical: Physical = False,
) -> None:
    """Scan one parameter: stroboscopic points, verdicts and exponents."""
    output = _Output(out, plot, json_out, physical)
    _run("bifurcation", study, sets, axis, output, points=points, mode=mode)


@app.command()
def zones(
    out: Out,
    study: StudyPath = None,
    sets: Sets = None,
    axis: AxisTexts = None,
    starts: Annotated[
        int | None, typer.Option(help="Number of initial states in each cell, to find all its motions.")
    ] = None,
    refine: Annotated[
        int | None,
        typer.Option(metavar="N", help="Every N-th row and column; more cells only where neighbours differ."),
    ] = None,
    plot: Plot = None,
    json_out: Json = False,
    physical: Physical = False,
) -> None:
    """Map the kinds of motion over two parameters."""
    output = _Output(out, plot, json_out, physical)
    _run("zones", study, sets, axis, output, starts=starts, refine=refine)


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
    output = _Output(out, plot, json_out, physical)
    _run("basins", study, sets, axis, output)


@dataclass(frozen=True)
class _Output:
    """Options for the output of a map."""

    out: Path
    plot: Path | None
    json_out: bool
    physical: bool


def _run(
    kind: str, study: Path | None, sets: list[str] | None, axis: list[str] | None, output: _Output, **options: Any
) -> None:
    """Check everything, compute the study, and write its files."""
    check_output("--out", output.out, DATA_SUFFIXES)
    check_output("--plot", output.plot, PLOT_SUFFIXES)
    loaded = load(study, sets, output.physical, axis_starts(axis or []))
    from gearchaos.studies.registry import study_class

    chosen = loaded.study(study_class(kind), **_axes(kind, loaded, axis or []), **given(**options))
    _finish(chosen, chosen.run(progress=True), loaded, output)


def _axes(kind: str, loaded: LoadedStudy, texts: list[str]) -> dict[str, Axis]:
    """The axes by field of the study. Axes of the command line replace those of the study file with the same name."""
    from gearchaos.studies.axis import parse_axis
    from gearchaos.studies.registry import study_class

    names = study_class(kind).axis_fields
    from_file = [axis for name, axis in loaded.options_for(kind).items() if name in names]
    parsed = [parse_axis(text, "--axis") for text in texts]
    by_name = {a.name: a for a in parsed}
    if len(parsed) < len(names) and by_name.keys() <= {a.name for a in from_file}:
        parsed = [by_name.get(a.name, a) for a in from_file]
    if len(parsed) != len(names):
        examples = ("--axis z=-3:3:200", "--axis z_dot=-2:2:200")
        if kind != "basins":
            examples = ("--axis omega=0.2:3:200", "--axis eps1=0:0.3:200")
        times = "once" if len(names) == 1 else "twice"
        raise InputError("--axis", f"must be given {times}", texts, f"E.g. {' '.join(examples[: len(names)])}.")
    return dict(zip(names, parsed, strict=True))


def _finish(study: Study, dataset: xr.Dataset, loaded: LoadedStudy, output: _Output) -> None:
    """Write the files of a map, and print its JSON summary if it is wanted."""
    dataset = in_units(dataset, loaded, output.physical)
    save(dataset, output.out)
    draw(dataset, output.plot)
    if output.json_out:
        files = {"out": str(output.out), "plot": None if output.plot is None else str(output.plot)}
        axes = [asdict(getattr(study, name)) for name in study.axis_fields]
        print_json({"study": study.kind, **files, "axes": axes, **summary(study.kind, dataset)})
