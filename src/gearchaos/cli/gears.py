"""The commands for given gears: the map of motions over speed and torque."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from gearchaos.cli.options import Json, Out, Plot, Sets, app, given, load
from gearchaos.cli.output import PLOT_SUFFIXES, check_output, draw, print_json, save, summary
from gearchaos.files import DATA_SUFFIXES

GearsPath = Annotated[
    Path, typer.Argument(metavar="GEARS", help="File with [gearpair], TOML.", readable=False)
]


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
    starts: Annotated[
        int | None, typer.Option(help="Number of initial states in each cell, to find all its motions.")
    ] = None,
    refine: Annotated[
        int | None,
        typer.Option(metavar="N", help="Every N-th row and column; more cells only where neighbours differ."),
    ] = None,
    plot: Plot = None,
    json_out: Json = False,
) -> None:
    """Map the kinds of motion of given gears over speed and torque, in rpm, N m, µm and N."""
    check_output("--out", out, DATA_SUFFIXES)
    check_output("--plot", plot, PLOT_SUFFIXES)
    loaded = load(gears, sets, physical=True)
    from gearchaos.studies.operating_map import checked_operating_model, in_operating_units, operating_axis
    from gearchaos.studies.zones import Zones

    axes = {"x": operating_axis("speed", speed, "--speed"), "y": operating_axis("torque", torque, "--torque")}
    study = loaded.study(Zones, **axes, **given(starts=starts, refine=refine))
    dataset = in_operating_units(study.run(progress=True), checked_operating_model(study.model))
    save(dataset, out)
    draw(dataset, plot)
    if json_out:
        files = {"out": str(out), "plot": None if plot is None else str(plot)}
        described = [{**asdict(axis), "units": dataset[axis.name].attrs["units"]} for axis in axes.values()]
        print_json({"study": "map", **files, "axes": described, **summary(study.kind, dataset)})
