"""Speeds to avoid: the options that say which count, and what is printed of them."""

from __future__ import annotations

import math
import re
import textwrap
from contextlib import suppress
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gearchaos import catalogue
from gearchaos.cli.errors import PAGE_WIDTH
from gearchaos.cli.output import plain_table, print_table
from gearchaos.errors import InputError

if TYPE_CHECKING:
    from gearchaos.datasheet.assessment import Section

Factor = Annotated[
    float | None,
    typer.Option(metavar="F", help="Also speeds in contact with a dynamic factor above F; where the stiffness jumps, "
                 "above F times that of slowly turning gears."),
]
RootStress = Annotated[
    str | None,
    typer.Option("--root-stress", metavar="S",
                 help="Also speeds in contact with nominal root stress × dynamic factor above S N/mm²."),
]
_LOAD_CHANGE = catalogue.STUDIES["scatter"]["options"]["load_change"]["help"]
LoadChange = Annotated[
    str | None,
    typer.Option("--load-change", metavar="LAMBDA|none", help=_LOAD_CHANGE),
]
Wide = Annotated[bool, typer.Option("--wide", help="Also begin with more energy than any load change stores.")]

REVERSED = "1"
"""The change of the load unless another is given."""


def criteria(
    factor: float | None, root_stress: str | None, load_change: str | None, wide: bool
) -> dict[str, Any]:
    """The options as the functions take them; raises `InputError` for a change of the load that is no number, or has
    no effect."""
    with suppress(ValueError):
        if root_stress is not None and math.isfinite(float(root_stress)):
            root_stress += " N/mm^2"
    if wide and load_change != REVERSED:
        raise InputError("--load-change", "must be left out with --wide", load_change,
                         "Wide ranges of states depend on no change of the load.")
    return {"factor": factor, "root_stress": root_stress, "load_change": change_of(load_change), "wide": wide}


def change_of(text: str | None) -> float | None:
    """The change of the load of ``--load-change``, None for none; raises `InputError` for what is no number, or out of
    bounds."""
    from gearchaos.studies.operation.load_change import LOAD_CHANGES
    from gearchaos.validation import check_rule

    if text in (None, "none"):
        return None
    try:
        change = float(text)
    except ValueError:
        raise InputError("--load-change", "must be a number or none", text, _LOAD_CHANGE) from None
    check_rule("--load-change", change, LOAD_CHANGES)
    return change


def states_after(text: str | None, starts: int | None) -> float | None:
    """The change of the load of ``--load-change`` of a map, which looks at none with one start for each cell."""
    if text == "none" and starts not in (None, 1):
        raise InputError("--load-change", "must be a number with --starts", text,
                         "Leave out both: then each cell has one motion, and no load changes.")
    return change_of(text)


def say_lines(*texts: str) -> None:
    """Print texts in lines of 80 columns."""
    for text in texts:
        whole = re.sub("(?<=[≤≥]) | (?=%|rpm)", "\N{NO-BREAK SPACE}", text)
        print(textwrap.fill(whole, PAGE_WIDTH, subsequent_indent="  ", break_on_hyphens=False).replace(
            "\N{NO-BREAK SPACE}", " "))


def print_avoided(found: Section) -> None:
    """Print the ranges to avoid, with the columns that have room, and what is said below them."""
    from gearchaos.datasheet.assessment import NARROW

    if found.table:
        names, *rows = (row[:NARROW] for row in found.table)
        table = plain_table(*names, left=names[2:4], gap=1)
        for row in rows:
            table.add_row(*row)
        print_table(table)
    say_lines(*found.words)
