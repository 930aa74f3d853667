"""The commands that scan parameters or initial values: diagrams, maps, basins."""

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
        int | None, typer.Option(min=0, help="Stroboscopic points per column; 0 for the verdicts alone.")
    ] = None,
    mode: Annotated[
        str | None, typer.Option(metavar="fixed|up|down", help="Same start, or the state carried along.")
    ] = None,
    plot: Plot = None,
    json_out: Json = False,
    physical: Physical = False,
) -> None:
    """Scan one parameter: stroboscopic points, verdicts and exponents."""
    target = _Target(out, plot, json_out, physical)
    _run("bifurcation", study, sets, axis, target, points=points, mode=mode)


@app.command()
def zones(
    out: Out,
    study: StudyPath = None,
    sets: Sets = None,
    axis: AxisTexts = None,
    starts: Annotated[int | None, typer.Option(help="Starts in each cell, to find all its motions.")] = None,
    refine: Annotated[
        int | None, typer.Option(metavar="N", help="Every N-th row and column first, finer where neighbours differ.")
    ] = None,
    plot: Plot = None,
    json_out: Json = False,
    physical: Physical = False,
) -> None:
    """Map the kinds of motion over two parameters."""
    target = _Target(out, plot, json_out, physical)
    _run("zones", study, sets, axis, target, starts=starts, refine=refine)


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
    target = _Target(out, plot, json_out, physical)
    _run("basins", study, sets, axis, target)


@dataclass(frozen=True)
class _Target:
    """Where a map goes, and in which form."""

    out: Path
    plot: Path | None
    json_out: bool
    physical: bool


def _run(
    kind: str, study: Path | None, sets: list[str] | None, axis: list[str] | None, target: _Target, **options: Any
) -> None:
    """Check everything, compute the study, and write its files."""
    check_output("--out", target.out, DATA_SUFFIXES)
    check_output("--plot", target.plot, PLOT_SUFFIXES)
    loaded = load(study, sets, target.physical)
    from gearchaos.studies.registry import study_class

    chosen = loaded.study(study_class(kind), **_axes(kind, loaded, axis or []), **given(**options))
    _finish(chosen, chosen.run(progress=True), loaded, target)


def _axes(kind: str, loaded: LoadedStudy, texts: list[str]) -> dict[str, Axis]:
    """The axes of the command line by field; fewer than needed replace those of the study file by name."""
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


def _finish(study: Study, dataset: xr.Dataset, loaded: LoadedStudy, target: _Target) -> None:
    """Write the files, and print what is in them."""
    dataset = in_units(dataset, loaded, target.physical)
    save(dataset, target.out)
    draw(dataset, target.plot)
    if target.json_out:
        files = {"out": str(target.out), "plot": None if target.plot is None else str(target.plot)}
        axes = [asdict(getattr(study, name)) for name in study.axis_fields]
        print_json({"study": study.kind, **files, "axes": axes, **summary(study.kind, dataset)})
