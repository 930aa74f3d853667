"""The commands that scan parameters or initial values: diagrams, maps, basins."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

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
    in_units,
    load,
    options_of,
)
from gearchaos.cli.output import PLOT_SUFFIXES, check_output, draw, print_json, save, summary
from gearchaos.errors import InputError
from gearchaos.files import DATA_SUFFIXES

if TYPE_CHECKING:
    import xarray as xr

    from gearchaos.studies import Axis
    from gearchaos.studyfile import Study


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
    loaded, axes = _map_inputs("bifurcation", study, sets, axis, target)
    options = options_of(loaded, "bifurcation", points=points, mode=mode)
    from gearchaos.studies import bifurcation as run

    _finish("bifurcation", run(loaded.model, *axes, progress=True, **options), axes, loaded, target)


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
    loaded, axes = _map_inputs("zones", study, sets, axis, target)
    from gearchaos.studies import zones as run

    options = options_of(loaded, "zones", starts=starts, refine=refine)
    _finish("zones", run(loaded.model, *axes, **options, progress=True), axes, loaded, target)


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
    loaded, axes = _map_inputs("basins", study, sets, axis, target)
    from gearchaos.studies import basins as run

    _finish("basins", run(loaded.model, *axes, **options_of(loaded, "basins"), progress=True), axes, loaded, target)


@dataclass(frozen=True)
class _Target:
    """Where a map goes, and in which form."""

    out: Path
    plot: Path | None
    json_out: bool
    physical: bool


def _map_inputs(
    kind: str, study: Path | None, sets: list[str] | None, axis: list[str] | None, target: _Target
) -> tuple[Study, tuple[Axis, ...]]:
    """Everything a map needs, checked before anything is computed."""
    check_output("--out", target.out, DATA_SUFFIXES)
    check_output("--plot", target.plot, PLOT_SUFFIXES)
    loaded = load(study, sets, target.physical)
    return loaded, _axes(kind, loaded.settings_for(kind).axes, axis or [])


def _axes(kind: str, from_file: tuple[Axis, ...], texts: list[str]) -> tuple[Axis, ...]:
    """The axes of the command line; fewer than needed replace those of the study file by name."""
    from gearchaos.studies.axis import parse_axis
    from gearchaos.studyfile import AXIS_KEYS

    given = tuple(parse_axis(text, "--axis") for text in texts)
    needed, by_name = len(AXIS_KEYS[kind]), {a.name: a for a in given}
    if len(given) < needed and by_name.keys() <= {a.name for a in from_file}:
        given = tuple(by_name.get(a.name, a) for a in from_file)
    if len(given) != needed:
        examples = ("--axis z=-3:3:200", "--axis z_dot=-2:2:200")
        if kind != "basins":
            examples = ("--axis omega=0.2:3:200", "--axis eps1=0:0.3:200")
        times = "once" if needed == 1 else "twice"
        raise InputError("--axis", f"must be given {times}", texts, f"E.g. {' '.join(examples[:needed])}.")
    return given


def _finish(kind: str, dataset: xr.Dataset, axes: tuple[Axis, ...], loaded: Study, target: _Target) -> None:
    """Write the files, then say what is in them."""
    dataset = in_units(dataset, loaded, target.physical)
    save(dataset, target.out)
    draw(dataset, target.plot)
    if target.json_out:
        files = {"out": str(target.out), "plot": None if target.plot is None else str(target.plot)}
        scanned = [{"name": a.name, "start": a.start, "stop": a.stop, "count": a.count} for a in axes]
        print_json({"study": kind, **files, "axes": scanned, **summary(kind, dataset)})
