"""The tables of gear designs: the datasheet, and the speeds to avoid."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table

from gearchaos.cli.errors import say
from gearchaos.cli.tables.text import FILE_WIDTH, print_table, shown

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import xarray as xr

    from gearchaos.gears.design.gear_design import GearDesign
    from gearchaos.gears.sheet import Entry

_SHOWN_SPEEDS = 8
"""Number of speeds for which the dynamic factors of the standards are printed."""


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
        print_table(table)
    for warning in warnings:
        say(f"warning: {warning}")


def _cells(value: Any) -> str:
    """One number or several for a table; "–" where there is none, "none" for an empty list."""
    if value is None:
        return "–"
    if value == ():
        return "none"
    return ", ".join(f"{v:.6g}" for v in value) if isinstance(value, tuple) else f"{value:.6g}"


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
        start = f"{near}{shown(each.start)}{', the start of the scan' * each.from_scan_start}"
        stop = f"{shown(each.stop)}{', the end of the scan' * each.to_scan_end}"
        peaks = "; ".join(f"{peak.speed:.0f}: {peak.dynamic_factor:.3g}" for peak in each.peaks)
        table.add_row(start, stop, shown(each.dynamic_factor), shown(each.speed_of_largest), each.criterion, peaks)
    if not found:
        table.add_row("none", "none")
    print_table(table)
    _print_standards(factors)
    lines = [f"Computed from rest at {factors.sizes['speed']} speeds from {computed.start:g} to {computed.stop:g} rpm; "
             f"the largest dynamic factor is {shown(computed.dynamic_factor)}, at "
             f"{shown(computed.speed_of_largest)} rpm.",
             "Other motions may exist at a speed, with other forces: gearchaos attractors DESIGN --set speed=… "
             f"--set torque={torque:g} finds them."]
    if design.exact:
        lines.append("No transmission error was assumed: the gears are taken to be exact.")
    for line in lines:
        Console(width=FILE_WIDTH, highlight=False, markup=False).print(line)


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
        table.add_row(*(shown(float(factors[name][i])) for name in titles))
    print_table(table)
