"""The commands for given gears: the datasheet of a design, and the map of motions over speed and torque."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearchaos.cli import startup
from gearchaos.cli.errors import announce_compilation, say
from gearchaos.cli.options import Json, Out, Plot, Refine, Sets, StartsPerCell, app, given, load
from gearchaos.cli.output import MapOutput, check_output, print_json
from gearchaos.errors import InputError
from gearchaos.files import write_bytes

if TYPE_CHECKING:
    from collections.abc import Mapping

    from gearchaos.gears.design.gear_design import GearDesign
    from gearchaos.gears.sheet import Entry

GearsPath = Annotated[
    Path, typer.Argument(metavar="GEARS", help="File with \\[design] or \\[gearpair], TOML.", readable=False)
]


@app.command()
def gear(
    design: Annotated[Path, typer.Argument(metavar="DESIGN", help="File with \\[design], TOML.", readable=False)],
    sets: Sets = None,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE.html", help="Page with drawing and curves.", readable=False)
    ] = None,
    speed: Annotated[
        str | None,
        typer.Option(metavar="START:STOP:COUNT", help="Speeds in rpm, for the dynamic factor on the page."),
    ] = None,
    json_out: Json = False,
) -> None:
    """Show every quantity that follows from the drawing of a gear pair, with its formula and source."""
    check_output("--out", out, (".html",))
    if speed is not None and out is None:
        raise InputError("--speed", "needs --out", speed, "The dynamic factor along the speed is drawn on the page.")
    from gearchaos.gears.sheet import datasheet
    from gearchaos.studyfile import load_design, parse_set

    found = load_design(design, parse_set(sets or []))
    entries = datasheet(found)
    if out is not None:
        _write_page(entries, found, speed, out)
    if json_out:
        print_json({"quantities": {n: _entry(e) for n, e in entries.items()}, **_model(found),
                    "warnings": list(found.warnings)})
    else:
        from gearchaos.cli.tables import print_datasheet

        print_datasheet(entries, found.warnings)


def _write_page(entries: Mapping[str, Entry], design: GearDesign, speed: str | None, path: Path) -> None:
    """Write the datasheet as a page, with the dynamic factor along the speed if one is given."""
    from gearchaos.datasheet import sheet_html

    factors = None
    if speed is not None:
        from gearchaos.studies.dynamic_factor import dynamic_factor
        from gearchaos.studies.operating_map import operating_axis

        startup.load_numba()
        announce_compilation()
        factors = dynamic_factor(design, operating_axis("speed", speed, "--speed"), progress=True)
    write_bytes(path, sheet_html(entries, design, factors).encode())
    say(f"wrote {path}")


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
        str, typer.Option(metavar="START:STOP:COUNT", help="Speeds of wheel 1 in rpm, e.g. 500:4500:200.")
    ],
    torque: Annotated[
        str, typer.Option(metavar="START:STOP:COUNT", help="Torques at wheel 1 in N m, e.g. 20:400:150.")
    ],
    out: Out,
    sets: Sets = None,
    starts: StartsPerCell = None,
    refine: Refine = None,
    plot: Plot = None,
    json_out: Json = False,
) -> None:
    """Map the kinds of motion of given gears over speed and torque, in rpm, N m, µm and N."""
    output = MapOutput(out, plot, json_out)
    output.check()
    from gearchaos.studies.operating_map import checked_operating_model, in_operating_units, operating_axis
    from gearchaos.studies.zones import Zones

    axes = {"x": operating_axis("speed", speed, "--speed"), "y": operating_axis("torque", torque, "--torque")}
    loaded = load(gears, sets, physical=True, axes=axes.values())
    study = loaded.study(Zones, **axes, **given(starts=starts, refine=refine))
    dataset = in_operating_units(study.run(progress=True), checked_operating_model(study.model))
    output.write("map", dataset, axes.values())
