"""The command for branches of periodic orbits."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearchaos.cli import completion
from gearchaos.cli.options import (
    Json,
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
def branch(
    study: StudyPath = None,
    sets: Sets = None,
    axis: Annotated[
        list[str] | None,
        typer.Option("--axis", metavar="NAME=START:STOP", help="The parameter and its range, once.",
                     autocompletion=completion.ranges),
    ] = None,
    period: Annotated[
        int | None, typer.Option(help="Minimal period; by default that of the motion that the start leads to.")
    ] = None,
    start: Starts = None,
    cascade: Annotated[int, typer.Option(help="Period doublings to follow from the first flip.")] = 0,
    pitchforks: Annotated[bool, typer.Option("--pitchforks", help="Follow both branches at each pitchfork.")] = False,
    out: OutIfWanted = None,
    plot: Plot = None,
    json_out: Json = False,
    physical: Physical = False,
) -> None:
    """Follow a branch of periodic orbits along one parameter, stable or not, with all its events."""
    check_output("--out", out, DATA_SUFFIXES)
    check_output("--plot", plot, PLOT_SUFFIXES)
    (chosen,), loaded = load_over(axis, ["eps1=0:0.3"], study, sets, physical)
    from gearchaos.studies.branch import branch as follow

    found = follow(loaded.model, chosen, start=initial_values(start or []), period=period, cascade=cascade,
                   pitchforks=pitchforks)
    dataset = in_units(found, loaded, physical)
    save(dataset, out)
    draw(dataset, plot)
    document = branch_document(dataset, found)
    if json_out:
        print_json(document)
    else:
        from gearchaos.cli.tables.branches import print_branch

        print_branch(document, dataset)


def branch_document(dataset: xr.Dataset, found: xr.Dataset) -> dict[str, Any]:
    """The JSON document of a branch: number of points, range, ends, events in order, stable intervals, jumps.

    After a cascade it also has the branches of doubled periods and the ratios of successive intervals between flips,
    with ``--pitchforks`` the branches of asymmetric orbits, and in physical units the unit of the
    parameter.

    Parameters
    ----------
    dataset : Dataset
        The branch, in physical units if these are wanted.
    found : Dataset
        The dimensionless branch: states are initial values, as ``--start`` takes them.
    """
    from gearchaos.gears.results import is_physical

    whole = {name: json.loads(dataset.attrs[name]) for name in ("closed", "range", "ends", "stable")}
    events = [_event(dataset, found, i) for i in range(dataset.sizes["event"])]
    out = {"points": dataset.sizes["point"], "closed": whole.pop("closed"), "range": whole["range"],
           "ends": whole["ends"], "events": events, "stable": whole["stable"],
           "jumps": [_jump(dataset, i) for i in range(dataset.sizes["jump"])]}
    settings = json.loads(dataset.attrs["settings"])
    if settings["pitchforks"]:
        out["asymmetric"] = json.loads(dataset.attrs["asymmetric"])
    if settings["cascade"]:
        out |= {name: json.loads(dataset.attrs[name]) for name in ("cascade", "feigenbaum")}
    if is_physical(dataset):
        out["units"] = {"value": dataset["event_value"].attrs["units"]}
    return out


def _event(dataset: xr.Dataset, found: xr.Dataset, number: int) -> dict[str, Any]:
    """One event of a branch as JSON."""
    at, start = dataset.isel(event=number), found.isel(event=number)
    prefix = "event_section_"
    parts = (at[f"event_multipliers_{part}"].values.tolist() for part in ("real", "imag"))
    return {
        "kind": str(at["event_kind"].item()), "value": at["event_value"].item(), "period": at["event_period"].item(),
        "multipliers": [list(pair) for pair in zip(*parts, strict=True)],
        "boundary": at["event_boundary"].item() or None,
        "state": {str(n).removeprefix(prefix): start[n].item() for n in start.data_vars if str(n).startswith(prefix)},
        "residual": at["event_residual"].item(),
    }


def _jump(dataset: xr.Dataset, number: int) -> dict[str, Any]:
    """One jump from a branch as JSON."""
    from gearchaos.studies import motions

    at = dataset.isel(jump=[number])
    return {
        "value": at["jump_value"].item(), "direction": {1: "up", -1: "down"}[at["jump_direction"].item()],
        "event": at["jump_event"].item(), "to": motions(at["jump_label"], at["jump_period"])[0],
        "on_branch": at["jump_point"].item() >= 0,
    }
