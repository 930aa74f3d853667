"""Branches and curves, as JSON and as tables of text."""

from __future__ import annotations

import json
from collections import Counter
from typing import TYPE_CHECKING, Any

from rich.table import Table

from gearchaos.cli.output import facts_table, print_table, shown, unit_after
from gearchaos.datasets import motions
from gearchaos.gears.operation.results import is_physical, scaled_numbers

if TYPE_CHECKING:
    from collections.abc import Mapping

    import xarray as xr

    from gearchaos.gears.mesh.pair import Scales


def branch_document(dataset: xr.Dataset, found: xr.Dataset) -> dict[str, Any]:
    """The JSON document of a branch: number of points, range, ends, events in order, stable intervals, jumps.

    After a cascade it also has the branches of doubled periods and the ratios of successive intervals between flips,
    with ``--pitchforks`` the branches of asymmetric orbits, and in physical units the unit of the parameter. States of
    events are those of ``found``, the dimensionless branch: initial values, as ``--start`` takes them.
    """
    closed, ends_at, ends, stable, neutral = (
        json.loads(dataset.attrs[n]) for n in ("closed", "range", "ends", "stable", "neutral"))
    events, prefix = [], "event_section_"
    for i in range(dataset.sizes["event"]):
        at, start = dataset.isel(event=i), found.isel(event=i)
        parts = (at[f"event_multipliers_{part}"].values.tolist() for part in ("real", "imag"))
        events.append({
            "kind": str(at["event_kind"].item()), "value": at["event_value"].item(),
            "period": at["event_period"].item(), "multipliers": [list(pair) for pair in zip(*parts, strict=True)],
            "boundary": at["event_boundary"].item() or None,
            "state": {str(n).removeprefix(prefix): start[n].item() for n in start.data_vars
                      if str(n).startswith(prefix)},
            "residual": at["event_residual"].item(),
        })
    jumps = []
    for i in range(dataset.sizes["jump"]):
        at = dataset.isel(jump=[i])
        jumps.append({
            "value": at["jump_value"].item(), "direction": {1: "up", -1: "down"}[at["jump_direction"].item()],
            "event": at["jump_event"].item(), "to": motions(at["jump_label"], at["jump_period"])[0],
            "on_branch": at["jump_point"].item() >= 0,
        })
    out = {"points": dataset.sizes["point"], "closed": closed, "range": ends_at, "ends": ends, "events": events,
           "stable": stable, "neutral": neutral, "jumps": jumps}
    settings = json.loads(dataset.attrs["settings"])
    if settings["pitchforks"]:
        out["asymmetric"] = json.loads(dataset.attrs["asymmetric"])
    if settings["cascade"]:
        out |= {name: json.loads(dataset.attrs[name]) for name in ("cascade", "feigenbaum")}
    if is_physical(dataset):
        out["units"] = {"value": dataset["event_value"].attrs["units"]}
    return out


def print_branch(document: dict[str, Any], dataset: xr.Dataset) -> None:
    """Print a branch of periodic orbits: where it ends and is stable, jumps, its events in order."""
    from gearchaos.studies.orbits.branch_lines import axis_of, stability_word, stable_parts

    name, (low, high), events = axis_of(dataset), document["range"], document["events"]
    unit, table = unit_after(dataset, name), facts_table()

    def place(event: int | None) -> str:
        return "end" if event is None else f"event {event + 1}, {events[event]['kind']}"

    table.add_row("branch", f"{document['points']} points, {name} from {_range(low, high, unit)}")
    if document["closed"]:
        table.add_row("ends", "none: it is closed, an isola")
    for end in document["ends"]:
        table.add_row("end", f"{name} = {_number(end['value'], unit)}{unit}: {end['why']}")
    stable_ones = [f"{_range(part.first, part.last, unit)}, from {place(part.first_event)} to {place(part.last_event)}"
                   for part in stable_parts(dataset, document["closed"])]
    word = stability_word(dataset)
    table.add_row(f"{word}, in order\nalong the branch", "\n".join(stable_ones) or "nowhere")
    if word == "neutral":
        table.add_row("stable", "nowhere: no damping decides, multipliers stay on the unit circle")
    jumps = [f"{jump['direction']} at {_number(jump['value'], unit)}{unit}, from event {jump['event'] + 1} to "
             f"{jump['to']}, {'on' if jump['on_branch'] else 'not on'} the branches followed"
             for jump in document["jumps"]]
    if jumps:
        table.add_row("jumps", "\n".join(jumps))
    others = {"doubled": document.get("cascade", []), "asymmetric": document.get("asymmetric", [])}
    for word, branch in ((word, branch) for word, found in others.items() for branch in found):
        kind = "neutral" if branch.get("neutral") else "stable"
        stable = ", ".join(f"{_number(a, unit)} to {_number(b, unit)}" for a, b in branch[kind])
        table.add_row(f"{word}, {branch['period']}T", f"{kind} {stable + unit if stable else 'nowhere'}")
    if document.get("cascade") == []:
        table.add_row("doubled", "none: from its start the branch reaches no flip that changes its stability")
    if document.get("feigenbaum"):
        table.add_row("ratios of intervals", ", ".join(f"{ratio:.6g}" for ratio in document["feigenbaum"]))
    print_table(table)
    if not events:
        return
    table = Table(title="Events, in order along the branch")
    for title in ("", "event", f"{name}{f' ({unit.strip()})' if unit else ''}", "period", "multipliers", "residual"):
        table.add_column(title, justify="left" if title == "event" else "right")
    for number, event in enumerate(events, 1):
        flank = {1: ", front flank", -1: ", back flank"}.get(event["boundary"], "")
        multipliers = ", ".join(f"{a:.4g}{b:+.4g}i" if b else f"{a:.4g}" for a, b in event["multipliers"])
        table.add_row(str(number), f"{event['kind']}{flank}", _number(event["value"], unit, 12), f"{event['period']}T",
                      multipliers, f"{event['residual']:.1e}")
    print_table(table)


def _number(value: float, unit: str, digits: int = 10) -> str:
    """The value of a parameter to so many digits, or with a unit to six, more than drawings support."""
    return f"{value:.{6 if unit else digits}g}"


def _range(first: float, last: float, unit: str) -> str:
    """Two values of a parameter with its unit."""
    return f"{_number(first, unit)} to {_number(last, unit)}{unit}"


def curve_document(dataset: xr.Dataset, x: str, y: str) -> dict[str, Any]:
    """The JSON document of a curve: its points, its points of codimension 2, and its ends, none if it is closed.

    It has the units of both parameters if the curve is in physical ones.
    """
    points = zip(dataset[x].values.tolist(), dataset[y].values.tolist(), strict=True)
    special = zip(*(dataset[f"special_{name}"].values.tolist() for name in ("kind", x, y)), strict=True)
    out = {
        "points": [{x: a, y: b} for a, b in points],
        "codimension2": [{"kind": kind, x: a, y: b} for kind, a, b in special],
        "ends": json.loads(dataset.attrs["ends"]),
    }
    if is_physical(dataset):
        out["units"] = {name: dataset[name].attrs["units"] for name in (x, y)}
    return out


def print_curve(document: dict[str, Any], dataset: xr.Dataset) -> None:
    """Print a curve of events over two parameters: its range, where it ends, its points of codimension 2 in order."""
    table, units = facts_table(), {name: unit_after(dataset, name) for name in document["points"][0]}
    ranges = ", ".join(f"{name} from {_range(min(v), max(v), unit)}" for name, unit in units.items()
                       for v in [[point[name] for point in document["points"]]])
    table.add_row("curve", f"{len(document['points'])} points, {ranges}")
    if not document["ends"]:
        table.add_row("ends", "none: it is closed")

    def place(point: Mapping[str, Any]) -> str:
        return ", ".join(f"{name} = {_number(point[name], unit)}{unit}" for name, unit in units.items())

    for end in document["ends"]:
        table.add_row("end", f"{place(end)}: {end['why']}")
    for special in document["codimension2"]:
        table.add_row(special["kind"], place(special))
    print_table(table)


def skeleton_document(dataset: xr.Dataset) -> dict[str, Any]:
    """The JSON document of a skeleton: numbers of curves by kind and period, of points, of events without curve."""
    kinds = zip(dataset["curve_kind"].values.tolist(), dataset["curve_period"].values.tolist(), strict=True)
    counts = sorted(Counter(kinds).items(), key=lambda item: (item[0][1], item[0][0]))
    return {
        "curves": [{"kind": kind, "period": period, "count": count} for (kind, period), count in counts],
        "points": dataset.sizes["point"], "codimension2": dict(Counter(dataset["special_kind"].values.tolist())),
        "failed": json.loads(dataset.attrs["failed"]),
    }


def print_skeleton(document: dict[str, Any]) -> None:
    """Print the numbers of curves of each kind and period, and of events whose curve could not be followed."""
    table = Table(title="Curves")
    for title in ("event", "period", "curves"):
        table.add_column(title, justify="left" if title == "event" else "right")
    for row in document["curves"]:
        table.add_row(row["kind"], f"{row['period']}T", str(row["count"]))
    print_table(table)
    for why, count in document["failed"].items():
        print(f"{count} events without curve: {why}")


def edge_document(dataset: xr.Dataset, scales: Scales[float] | None) -> dict[str, Any]:
    """The JSON document of an edge state: its saddle, None if it is not periodic, and the states on the boundary in
    order of time; with scales in their units."""
    states = {str(name).removeprefix("section_"): v.values.tolist() for name, v in dataset.data_vars.items()}
    saddle, orbit = None, json.loads(dataset.attrs["orbit"])
    if orbit is not None:
        state = orbit["state"] if scales is None else scaled_numbers(orbit["state"], scales)[0]
        saddle = {**{n: orbit[n] for n in ("period", "unstable", "multipliers", "residual")}, "state": state}
    units = {name: dataset[f"section_{name}"].attrs["units"] for name in states}
    return {"saddle": saddle, "states": states} | ({} if scales is None else {"units": units})


def print_edge(document: dict[str, Any]) -> None:
    """Print the saddle between two basins: its period, multipliers and first point."""
    table, saddle, units = facts_table(), document["saddle"], document.get("units", {})
    count = len(next(iter(document["states"].values()), ()))
    table.add_row("edge state", "not periodic" if saddle is None else
                  f"a saddle of period {saddle['period']}T, unstable in {saddle['unstable']} "
                  f"direction{'s' * (saddle['unstable'] > 1)}")
    if saddle is not None:
        table.add_row("Floquet multipliers", "\n".join(f"{a:+.6f} {b:+.6f}i" for a, b in saddle["multipliers"]))
        table.add_row("first point", ", ".join(
            f"{name} = {value:.6g} {units.get(name, '')}".rstrip() for name, value in saddle["state"].items()))
        table.add_row("residual of the orbit", shown(saddle["residual"]))
    table.add_row("states on the boundary", str(count))
    print_table(table)
