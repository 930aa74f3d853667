"""The commands for given gears: the datasheet of a design, and the map of motions over speed and torque."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearchaos.cli import startup
from gearchaos.cli.errors import announce_compilation, say
from gearchaos.cli.maps import MapOutput
from gearchaos.cli.options import Json, Out, Plot, Refine, Sets, StartsPerCell, app, given, load
from gearchaos.cli.output import PLOT_SUFFIXES, check_output, draw, print_json
from gearchaos.errors import InputError
from gearchaos.files import write_bytes

if TYPE_CHECKING:
    from collections.abc import Mapping

    import xarray as xr

    from gearchaos.gears.design.gear_design import GearDesign
    from gearchaos.gears.sheet import Entry

GearsPath = Annotated[
    Path, typer.Argument(metavar="GEARS", help="File with \\[design] or \\[gearpair], TOML.", readable=False)
]


DesignPath = Annotated[Path, typer.Argument(metavar="DESIGN", help="File with \\[design], TOML.", readable=False)]
Page = Annotated[
    Path | None, typer.Option("--out", metavar="FILE.html", help="Page with drawing and curves.", readable=False)
]
Speeds = Annotated[
    str | None,
    typer.Option(metavar="START:STOP:COUNT", help="Speeds in rpm: which to avoid, and the dynamic factor there."),
]
Torque = Annotated[
    str | None, typer.Option(metavar="TORQUE", help="At wheel 1, in N m or with a unit; by default that of the design.")
]
Factor = Annotated[
    float | None,
    typer.Option(metavar="F", help="With --speed: also speeds with a dynamic factor above F, although in contact."),
]
FactorAlone = Annotated[
    bool, typer.Option("--factor-alone", help="With --factor: its speeds alone, whether the teeth separate or not.")
]
FactorPlot = Annotated[
    Path | None,
    typer.Option("--plot", metavar="FILE", help="Picture of the dynamic factor along --speed: .png, .pdf or .svg.",
                 readable=False),
]


@app.command()
def gear(
    design: DesignPath, sets: Sets = None, out: Page = None, speed: Speeds = None, torque: Torque = None,
    plot: FactorPlot = None, factor: Factor = None, factor_alone: FactorAlone = False, json_out: Json = False,
) -> None:
    """Show every quantity that follows from the drawing of a gear pair, and which speeds to avoid."""
    check_output("--out", out, (".html",))
    check_output("--plot", plot, PLOT_SUFFIXES)
    if plot is not None and speed is None:
        raise InputError("--plot", "needs --speed", str(plot), "It shows the dynamic factor along the speed.")
    _check_factor(factor, speed, factor_alone)
    from gearchaos.gears.sheet import datasheet, with_scanned_speeds

    found = _design(design, sets, torque)
    factors = None if speed is None else _dynamic_factor(found, speed)
    notes = (*found.warnings, *found.assumptions)
    entries = datasheet(found) if factors is None else with_scanned_speeds(datasheet(found))
    if out is not None:
        _write_page(entries, found, factors, out)
    if factors is not None:
        draw(factors, plot)
    if json_out:
        speeds = None if factors is None else _speeds_document(found, factors, factor, not factor_alone)
        print_json({"quantities": {n: _entry(e) for n, e in entries.items()}, **_model(found),
                    "warnings": list(notes), "speeds_to_avoid": speeds})
        return
    from gearchaos.cli.tables.gears import print_datasheet, print_speeds_to_avoid

    print_datasheet(entries, notes)
    if factors is not None:
        print_speeds_to_avoid(found, factors, factor, not factor_alone)


def _check_factor(factor: float | None, speed: str | None, alone: bool) -> None:
    """Raise `InputError` for a limit of the dynamic factor without speeds, or one that is not greater than 0."""
    if factor is not None and speed is None:
        raise InputError("--factor", "needs --speed", factor, "It is a limit of the dynamic factor along the speed.")
    if factor is not None and not factor > 0:
        raise InputError("--factor", "must be greater than 0", factor)
    if alone and factor is None:
        raise InputError("--factor-alone", "needs --factor", True, "It lists the speeds with a higher dynamic factor.")


def _design(path: Path, sets: list[str] | None, torque: str | None) -> GearDesign:
    """The design of a file with the values of ``--set`` and ``--torque``."""
    from gearchaos.studyfile import load_design, parse_set, parse_value

    values = parse_set(sets or [])
    if torque is not None:
        values.pop("torque", None)
        values["torque"] = parse_value(torque)  # last, so that it replaces operation.torque too
    return load_design(path, values)


def _dynamic_factor(design: GearDesign, speed: str) -> xr.Dataset:
    """The dynamic factor of a design along the speeds of the command line."""
    from gearchaos.studies.dynamic_factor import dynamic_factor
    from gearchaos.studies.operating_map import operating_axis

    axis = operating_axis("speed", speed, "--speed")
    startup.load_numba()
    announce_compilation()
    return dynamic_factor(design, axis, progress=True)


def _write_page(entries: Mapping[str, Entry], design: GearDesign, factors: xr.Dataset | None, path: Path) -> None:
    """Write the datasheet as a page, with the dynamic factor along the speed if it is given."""
    from gearchaos.datasheet import sheet_html

    write_bytes(path, sheet_html(entries, design, factors).encode())
    say(f"wrote {path}")


def _speeds_document(
    design: GearDesign, factors: xr.Dataset, factor: float | None, separation: bool
) -> dict[str, Any]:
    """The speeds to avoid as JSON."""
    from gearchaos.studies.dynamic_factor import STANDARDS
    from gearchaos.studies.speeds_to_avoid import all_speeds, criterion_in_words, speeds_to_avoid

    return {
        "criterion": criterion_in_words(factor, separation), "units": {"speed": "rpm", "torque": "N*m"},
        "torque": float(factors["torque"]), "transmission_error": design.error_harmonics.source,
        "computed": {**asdict(all_speeds(factors)), "count": factors.sizes["speed"]},
        "ranges": [asdict(each) for each in speeds_to_avoid(factors, factor, separation=separation)],
        "along_speed": {n: factors[n].values.tolist() for n in ("speed", "dynamic_factor", *STANDARDS)},
    }


def _entry(entry: Entry) -> dict[str, Any]:
    """One quantity of a datasheet as JSON, with the reason where it has no value."""
    keys = ("value", "unit", "symbol", "formula", "source")
    return {key: getattr(entry, key) for key in keys} | ({"reason": entry.reason} if entry.reason else {})


def _model(design: GearDesign) -> dict[str, Any]:
    """The dimensionless model of a design as JSON; null, with the reason, where an input for it is missing."""
    import json

    from gearchaos.datasets import model_json

    try:
        return {"model": json.loads(model_json(design.to_model()))}
    except InputError as error:
        return {"model": None, "model_reason": str(error)}


@app.command("map")
def operating_map(
    gears: GearsPath,
    speed: Annotated[
        str, typer.Option(metavar="START:STOP:COUNT", help="Speeds of wheel 1 in rpm, or with units: 500:4500:200.")
    ],
    torque: Annotated[
        str, typer.Option(metavar="START:STOP:COUNT", help="Torques at wheel 1 in N m, or with units: 20:400:150.")
    ],
    out: Out,
    sets: Sets = None,
    starts: StartsPerCell = None,
    refine: Refine = None,
    plot: Plot = None,
    json_out: Json = False,
) -> None:
    """Map where the teeth of given gears separate, and their motions, over speed and torque in rpm and N m."""
    output = MapOutput(out, plot, json_out)
    output.check()
    from gearchaos.studies.operating_map import checked_operating_model, in_operating_units, operating_axis
    from gearchaos.studies.zones import Zones

    axes = {"x": operating_axis("speed", speed, "--speed"), "y": operating_axis("torque", torque, "--torque")}
    loaded = load(gears, sets, physical=True, axes=axes.values())
    study = loaded.study(Zones, **axes, **given(starts=starts, refine=refine))
    dataset = in_operating_units(study.run(progress=True), checked_operating_model(study.model))
    output.write("map", dataset, axes.values())
