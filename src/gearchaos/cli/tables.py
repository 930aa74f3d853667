"""Results as tables of text on stdout."""

from __future__ import annotations

import math
import time
from datetime import timedelta
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table

from gearchaos.cli.errors import say
from gearchaos.cli.output import attractor_list, attractor_units, section, section_units
from gearchaos.gears.scales import Scales, unit_of
from gearchaos.quantities import OPERATION, RESPONSES, VERDICTS, quantity

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    import xarray as xr

    from gearchaos.gears.design.gear_design import GearDesign
    from gearchaos.gears.sheet import Entry
    from gearchaos.proof.certificate import Certificate, Unproved
    from gearchaos.studies import Verdict
    from gearchaos.studyfile import LoadedStudy

_SHOWN_ROWS = 20
"""Most rows of a stroboscopic section that are printed."""

_SHOWN_SPEEDS = 8
"""Number of speeds for which the dynamic factors of the standards are printed."""

_FILE_WIDTH = 160
"""Width of a table in characters where stdout is not a terminal."""


def print_section(dataset: xr.Dataset) -> None:
    """Print the last rows of a stroboscopic section."""
    columns, units = section(dataset), section_units(dataset)
    rows = list(zip(*columns.values(), strict=True))
    table = Table(title=f"Stroboscopic section, last {min(_SHOWN_ROWS, len(rows))} of {len(rows)} periods")
    for name in columns:
        table.add_column(f"{name}\n({units[name]})", justify="right", overflow="fold")
    for row in rows[-_SHOWN_ROWS:]:
        table.add_row(*map(_shown, row))
    _print(table)


def print_datasheet(entries: Mapping[str, Entry], warnings: Sequence[str]) -> None:
    """Print the quantities of a design by group, then its warnings, and what is missing for the others."""
    from gearchaos.gears.sheet import shown_value

    for group in dict.fromkeys(entry.group for entry in entries.values()):
        table = Table(title=group, title_justify="left")
        for column in ("name", "symbol", "value", "unit", "formula", "source"):
            table.add_column(column, justify="right" if column == "value" else "left", overflow="fold")
        for name, e in entries.items():
            if e.group == group:
                table.add_row(name, e.symbol, _cells(shown_value(e)), e.unit, e.reason or e.formula, e.source)
        _print(table)
    for warning in warnings:
        say(f"warning: {warning}")


def print_speeds_to_avoid(
    design: GearDesign, factors: xr.Dataset, factor: float | None, separation: bool
) -> None:
    """Print the ranges of speed to avoid with their dynamic factors, and those of the standards at a few speeds."""
    from gearchaos.studies.speeds_to_avoid import MOST_PEAKS, all_speeds, criterion_in_words, speeds_to_avoid

    found = speeds_to_avoid(factors, factor, separation=separation)
    computed, torque, why = all_speeds(factors), float(factors["torque"]), criterion_in_words(factor, separation)
    table = Table(title=f"Speeds to avoid at {torque:g} N m: {why}", title_justify="left")
    for column in ("from rpm", "to rpm", "largest dynamic factor", "at rpm"):
        table.add_column(column, justify="right")
    for column in ("reason", f"local peaks, rpm: factor (at most the {MOST_PEAKS} largest)"):
        table.add_column(column, overflow="fold")
    for each in found:
        near = "near " * (each.start == each.stop)  # nothing is known of its neighbours
        start = f"{near}{_shown(each.start)}{', the start of the scan' * each.from_scan_start}"
        stop = f"{_shown(each.stop)}{', the end of the scan' * each.to_scan_end}"
        peaks = "; ".join(f"{peak.speed:.0f}: {peak.dynamic_factor:.3g}" for peak in each.peaks)
        table.add_row(start, stop, _shown(each.dynamic_factor), _shown(each.speed_of_largest), each.criterion, peaks)
    if not found:
        table.add_row("none", "none")
    _print(table)
    _print_standards(factors)
    lines = [f"Computed from rest at {factors.sizes['speed']} speeds from {computed.start:g} to {computed.stop:g} rpm; "
             f"the largest dynamic factor is {_shown(computed.dynamic_factor)}, at "
             f"{_shown(computed.speed_of_largest)} rpm.",
             "Other motions may exist at a speed, with other forces: gearchaos attractors DESIGN --set speed=… "
             f"--set torque={torque:g} finds them."]
    if design.exact:
        lines.append("No transmission error was assumed: the gears are taken to be exact.")
    for line in lines:
        Console(width=_FILE_WIDTH, highlight=False, markup=False).print(line)


def _print_standards(factors: xr.Dataset) -> None:
    """Print the computed dynamic factor beside those of the standards at a few of the speeds, both ends included."""
    count = factors.sizes["speed"]
    few = sorted({round(i * (count - 1) / (_SHOWN_SPEEDS - 1)) for i in range(_SHOWN_SPEEDS)})
    titles = {"speed": "rpm", "dynamic_factor": "computed", "Kv_ISO_B": "K_v ISO B", "Kv_ISO_C": "K_v ISO C",
              "Kv_AGMA": "K_v AGMA"}
    table = Table(title="Dynamic factor at a few of the speeds", title_justify="left")
    for title in titles.values():
        table.add_column(title, justify="right")
    for i in few:
        table.add_row(*(_shown(float(factors[name][i])) for name in titles))
    _print(table)


def _cells(value: Any) -> str:
    """One number or several for a table; "–" where there is none, "none" for an empty list."""
    if value is None:
        return "–"
    if value == ():
        return "none"
    return ", ".join(f"{v:.6g}" for v in value) if isinstance(value, tuple) else f"{value:.6g}"


def print_run(found: dict[str, Any]) -> None:
    """Print the progress of a run.

    ``found`` is from `gearchaos.store.reading.info.summary`; its ``pieces`` are work items.
    """
    table = Table(show_header=False)
    table.add_row("study", found["study"])
    table.add_row("state", _state(found))
    for row in _tiles_rows(found):
        table.add_row(*row)
    if found["pieces_per_second"] is not None and found["seconds_left"]:
        table.add_row("rate", f"{found['pieces_per_second']:,.0f} work items a second")
        table.add_row("left, at that rate", f"{timedelta(seconds=round(found['seconds_left']))}")
    table.add_row("computed", f"{timedelta(seconds=round(found['seconds']))}, added up over all workers")
    table.add_row("machines", ", ".join(found["machines"]) or "none yet")
    table.add_row("on disk", f"{found['bytes'] / 1e6:,.1f} MB")
    for number, error in found["failed"].items():
        table.add_row(f"tile {number} failed", error)
    for row in _missing_rows(found):
        table.add_row(*row)
    _print(table)


def _tiles_rows(found: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """How many tiles are done, and how many of them have lost results."""
    lost, share = found["tiles_lost"], found["pieces_done"] / found["pieces"]
    whole = f"; {found['tiles_done']} are whole" if lost else ""
    done = f"{found['tiles_done'] + lost} of {found['tiles']}"
    yield "tiles done", f"{done}{whole} ({share:.1%} of the work items)"
    if lost:
        from gearchaos.store.reading.missing_words import listed

        arrays = listed(found["missing"]["arrays"])
        yield "to be computed again", f"{lost} tiles that were done: files of {arrays} are missing or damaged"


def _state(found: dict[str, Any]) -> str:
    """Whether a run is finished or running, and otherwise the command that continues it."""
    store, writers, damaged = found["store"], found["writers"], bool(found["missing"]["files"])
    if found["finished"]:
        return "finished"
    if any(writer["running"] for writer in writers.values()):
        return "running"
    if found["tiles_done"] + found["tiles_lost"] == found["tiles"]:
        return f"{'damaged' if damaged else 'not finished'}; to continue: gearchaos finish {store}"
    shard = " --shard I/N" if writers and "all" not in writers else ""
    return f"not finished; to continue: gearchaos run STUDY.toml --out {store}{shard}"


def _missing_rows(found: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """What is missing of a store: work items, files, and the writers that are not done."""
    missing = found["missing"]
    if found["tiles_done"] and missing["pieces"]:
        yield "without results,\nby position from 0", "\n".join(
            ", ".join(f"{name} {first}:{stop}" for name, (first, stop) in block.items()) for block in missing["pieces"])
    if missing["files"]:
        more = missing["file_count"] - len(missing["files"])
        yield "missing or damaged", "\n".join([*missing["files"], *[f"and {more} more files"] * (more > 0)])
    if not found["finished"]:
        for name, writer in found["writers"].items():
            if not writer["ended"]:
                yield f"writer {name}", _activity(writer)


def _activity(writer: dict[str, Any]) -> str:
    """Whether a writer that has not ended is running."""
    if writer["running"] is None:
        return "has begun and not ended; its lock does not tell whether it is running"
    if not writer["running"]:
        return "not running; it stopped before its end, e.g. since it was killed"
    return f"running, last entry in its journal {timedelta(seconds=max(0, round(time.time() - writer['at'])))} ago"


def print_regime(
    verdict: Verdict, loaded: LoadedStudy, physical: bool, proof: Certificate | Unproved | None = None
) -> None:
    """Print the verdict at one operating point: the motion, its proof, its evidence, and quantities with a title."""
    values, scales = verdict.to_dict(), None if loaded.pair is None else loaded.pair.scales
    table = Table(show_header=False)
    table.add_row("motion", f"{verdict.label}: {verdict.reason}")
    if proof is not None:
        table.add_row("proof", proof.in_words())
    if scales is not None:
        table.add_row(quantity("omega").title, _measured("omega", loaded.model.omega, scales, physical))
    table.add_row("Lyapunov exponents", _exponents(values, scales if physical else None))
    table.add_row("Floquet multipliers", "\n".join(f"{a:+.6f} {b:+.6f}i" for a, b in values["multipliers"]))
    for q in (*RESPONSES, *VERDICTS):
        if q.title:
            table.add_row(q.title, _measured(q.name, values[q.name], scales, physical))
    _print(table)


def _measured(name: str, value: Any, scales: Scales | None, physical: bool) -> str:
    """A value with its value in physical units in brackets, if it has one; with ``physical`` only the latter."""
    unit = None if scales is None or value is None else unit_of(name, scales)
    if unit is None:
        return _shown(value)
    measured = f"{_shown(value * unit[0])} {unit[1]}"
    return measured if physical else f"{_shown(value)} ({measured})"


def print_attractors(dataset: xr.Dataset) -> None:
    """Print the attractors of an operating point, one per row."""
    found = attractor_list(dataset)
    table = Table(title=f"Attractors found from {found['starts']} starts: {len(found['attractors'])}")
    units = {name: f" ({unit})" for name, unit in attractor_units(dataset).items()}
    exponent = f"λ1{units.get('lyapunov', '')}"
    numbers = {"dynamic factor": "dynamic_factor", exponent: "lyapunov", "max |μ|": "multiplier"}
    if "attractor_kick" in dataset:
        numbers["smallest kick"] = "kick"
    for title in ("motion", "share of the starts (95 %)", f"V_RMS{units.get('v_rms', '')}", "contact", *numbers):
        table.add_column(title, justify="left" if title in ("motion", "contact") else "right")
    for a in found["attractors"]:
        share = f"{a['fraction']:.1%} ({a['fraction_lo']:.1%} to {a['fraction_hi']:.1%})"
        table.add_row(a["label"], share, _shown(a["v_rms"]), a["contact"], *(_shown(a[n]) for n in numbers.values()))
    if found["undecided_fraction"]:
        table.add_row("diverged or undecided", f"{found['undecided_fraction']:.1%}")
    for way in ("up", "down"):
        if f"swept_{way}" in found:
            end = found[f"swept_{way}"]
            label = "none" if end is None else f"{found['attractors'][end]['label']}, row {end + 1}"
            table.add_row(f"swept {way}", label)
    _print(table)


def print_branch(document: dict[str, Any], dataset: xr.Dataset) -> None:
    """Print a branch of periodic orbits: where it ends and is stable, jumps, its events in order."""
    from gearchaos.studies.branch_lines import axis_of

    name, (low, high) = axis_of(dataset), document["range"]
    unit = _after(dataset, name)
    table = Table(show_header=False)
    table.add_row("branch", f"{document['points']} points, {name} from {low:.10g} to {high:.10g}{unit}")
    if document["closed"]:
        table.add_row("ends", "none: it is closed, an isola")
    for end in document["ends"]:
        table.add_row("end", f"{name} = {end['value']:.10g}{unit}: {end['why']}")
    table.add_row("stable, in order\nalong the branch", "\n".join(_stable_parts(document, dataset, unit)) or "nowhere")
    jumps = [f"{jump['direction']} at {jump['value']:.10g}{unit}, from event {jump['event'] + 1} to {_target(jump)}"
             for jump in document["jumps"]]
    if jumps:
        table.add_row("jumps", "\n".join(jumps))
    others = [("doubled", branch) for branch in document.get("cascade", [])]
    others += [("asymmetric", branch) for branch in document.get("asymmetric", [])]
    for word, branch in others:
        stable = ", ".join(f"{a:.10g} to {b:.10g}" for a, b in branch["stable"])
        table.add_row(f"{word}, {branch['period']}T", f"stable {stable + unit if stable else 'nowhere'}")
    if document.get("cascade") == []:
        table.add_row("doubled", "none: from its start the branch reaches no flip that changes its stability")
    if document.get("feigenbaum"):
        table.add_row("ratios of intervals", ", ".join(f"{ratio:.6g}" for ratio in document["feigenbaum"]))
    _print(table)
    _print_events(document["events"], f"{name}{f' ({unit.strip()})' if unit else ''}")


def _after(dataset: xr.Dataset, name: str) -> str:
    """The unit of a parameter with a space before it; empty for a dimensionless one."""
    unit = dataset[name].attrs["units"]
    dimensional = unit != quantity(name).unit or name in {q.name for q in OPERATION}
    return f" {unit.replace('*', ' ')}" if dimensional else ""


def _stable_parts(document: dict[str, Any], dataset: xr.Dataset, unit: str) -> list[str]:
    """The stable parts of a branch in order along it, with the events between which they lie."""
    from gearchaos.studies.branch_lines import stable_parts

    def place(event: int | None) -> str:
        return "end" if event is None else f"event {event + 1}, {document['events'][event]['kind']}"

    return [f"{part.first:.10g} to {part.last:.10g}{unit}, from {place(part.first_event)} to {place(part.last_event)}"
            for part in stable_parts(dataset, document["closed"])]


def _target(jump: Mapping[str, Any]) -> str:
    """The motion to which a jump leads, in words."""
    return f"{jump['to']}, {'on' if jump['on_branch'] else 'not on'} the branches followed"


def _print_events(events: Sequence[Mapping[str, Any]], name: str) -> None:
    """Print the events of a branch in order, one per row."""
    if not events:
        return
    table = Table(title="Events, in order along the branch")
    for title in ("", "event", name, "period", "multipliers", "residual"):
        table.add_column(title, justify="left" if title == "event" else "right")
    for number, event in enumerate(events, 1):
        flank = {1: ", front flank", -1: ", back flank"}.get(event["boundary"], "")
        multipliers = ", ".join(f"{a:.4g}{b:+.4g}i" if b else f"{a:.4g}" for a, b in event["multipliers"])
        table.add_row(str(number), f"{event['kind']}{flank}", f"{event['value']:.12g}", f"{event['period']}T",
                      multipliers, f"{event['residual']:.1e}")
    _print(table)


def print_curve(document: dict[str, Any], dataset: xr.Dataset, x: str, y: str) -> None:
    """Print a curve of events over two parameters: its range, where it ends, its points of codimension 2 in order."""
    table, units = Table(show_header=False), {name: _after(dataset, name) for name in (x, y)}
    ranges = ", ".join(f"{name} from {min(v):.10g} to {max(v):.10g}{units[name]}" for name in (x, y)
                       for v in [[point[name] for point in document["points"]]])
    table.add_row("curve", f"{len(document['points'])} points, {ranges}")
    if not document["ends"]:
        table.add_row("ends", "none: it is closed")
    for end in document["ends"]:
        place = ", ".join(f"{name} = {end[name]:.10g}{units[name]}" for name in (x, y))
        table.add_row("end", f"{place}: {end['why']}")
    for special in document["codimension2"]:
        table.add_row(special["kind"], ", ".join(f"{name} = {special[name]:.10g}{units[name]}" for name in (x, y)))
    _print(table)


def print_skeleton(document: dict[str, Any]) -> None:
    """Print the numbers of curves of each kind and period, and of events whose curve could not be followed."""
    table = Table(title="Curves")
    for title in ("event", "period", "curves"):
        table.add_column(title, justify="left" if title == "event" else "right")
    for row in document["curves"]:
        table.add_row(row["kind"], f"{row['period']}T", str(row["count"]))
    _print(table)
    for why, count in document["failed"].items():
        print(f"{count} events without curve: {why}")


def _print(table: Table) -> None:
    """Print a table in the width of the terminal."""
    console = Console()
    width = console.width if console.is_terminal else _FILE_WIDTH
    Console(width=width, markup=False).print(table)  # a unit in brackets, "[um]", is no markup


def _exponents(values: dict[str, Any], scales: Scales | None) -> str:
    """A line for each Lyapunov exponent with its interval, per unit of τ; with scales, per second."""
    factor, unit = (1.0, "") if scales is None else (scales.rate, " 1/s")
    digits = 5 if scales is None else 1
    rows = zip(values["lyapunov"], values["lyapunov_ci"], strict=True)
    numbers = [[f"{factor * n:+.{digits}f}" for n in (v, *ends)] for v, ends in rows]
    return "\n".join(f"{v}  ({low} to {high}){unit}" for v, low, high in numbers)


def _shown(value: Any) -> str:
    """A value as text; "none" for None and NaN."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "none"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
