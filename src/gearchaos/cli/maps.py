"""The commands that scan parameters or initial values: bifurcation diagrams, zones and basins."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass
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
    study_axes,
)
from gearchaos.cli.output import PLOT_SUFFIXES, check_output, draw, print_json, proof_summary, save, say_proofs
from gearchaos.files import DATA_SUFFIXES
from gearchaos.quantities import quantity

if TYPE_CHECKING:
    import xarray as xr

    from gearchaos.studies.axis import Axis


@dataclass(frozen=True)
class MapOutput:
    """What a command makes of a map: the file of its data, its picture if there is a path, and what was found."""

    out: Path
    plot: Path | None
    json_out: bool

    def check(self) -> None:
        """Raise `InputError` unless both files can be written."""
        check_output("--out", self.out, DATA_SUFFIXES)
        check_output("--plot", self.plot, PLOT_SUFFIXES)

    def write(self, kind: str, dataset: xr.Dataset, axes: Iterable[Axis]) -> None:
        """Write the files of a map, and print what was found, in two lines or as JSON."""
        save(dataset, self.out)
        draw(dataset, self.plot)
        say_proofs(proof_summary(dataset))
        found = _summary(kind, dataset)
        if not self.json_out:
            from gearchaos.cli.tables.maps import print_map

            print_map(found, dataset)
        else:
            files = {"out": str(self.out), "plot": None if self.plot is None else str(self.plot)}
            described = [{**asdict(axis), "units": quantity(axis.name).unit} for axis in axes]
            print_json({"study": kind, **files, "axes": described, **found})


def _summary(kind: str, dataset: xr.Dataset) -> dict[str, Any]:
    """The JSON summary of a map: the numbers of cells with each motion and each contact state, and the largest dynamic
    factor; for basins, the attractors and their shares, and how finely the basins are mixed."""
    from gearchaos.dynamics.response import CONTACTS
    from gearchaos.studies import motions

    if kind == "basins":
        shares = dataset["attractor_fraction"].values.tolist()
        names = motions(dataset["attractor_label"], dataset["attractor_period"])
        measures = {name: dataset[name].item() for name in ("basin_entropy", "uncertainty_exponent")}
        return {"attractors": [{"label": n, "fraction": s} for n, s in zip(names, shares, strict=True)], **measures}
    names = motions(dataset["label"], dataset["period"])
    codes = dataset["contact_worst" if "contact_worst" in dataset else "contact"].values.ravel().tolist()
    return {
        "cells": {name: names.count(name) for name in sorted(set(names))},
        "contact": {CONTACTS[code]: codes.count(code) for code in sorted({code for code in codes if code >= 0})},
        "largest": _largest(dataset), **proof_summary(dataset),
    }


def _largest(dataset: xr.Dataset) -> dict[str, Any] | None:
    """The largest dynamic factor, or without static load V_RMS, of a map, and where; None if all diverge."""
    for name in ("dynamic_factor", "v_rms"):
        known = dataset[name].where(abs(dataset[name]) < math.inf)
        if known.notnull().any():
            at, names = dataset[name].isel(known.argmax(...)), reversed(dataset[name].dims)
            return {"quantity": name, "value": at.item(), "at": {str(n): at[n].item() for n in names}}
    return None


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
