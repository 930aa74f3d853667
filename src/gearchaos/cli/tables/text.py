"""Tables of text, and numbers in them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table

from gearchaos.quantities import OPERATION, quantity

if TYPE_CHECKING:
    import xarray as xr

FILE_WIDTH, PAGE_WIDTH = 160, 80
"""Widths in characters where stdout is not a terminal: of a table with rules, and of one without."""


def print_table(table: Table) -> None:
    """Print a table in the width of the terminal, without blanks at the ends of lines."""
    console = Console()
    width = console.width if console.is_terminal else FILE_WIDTH if table.box else PAGE_WIDTH
    console = Console(width=width, markup=False)  # a unit in brackets, "[um]", is no markup
    with console.capture() as lines:
        console.print(table)
    print(*(line.rstrip() for line in lines.get().splitlines()), sep="\n", flush=True)


def plain_table(gap: int = 2) -> Table:
    """A table without rules, which leaves more of the width to its columns, with ``gap`` spaces between them."""
    return Table(box=None, padding=(0, gap, 0, 0))


def shown(value: Any) -> str:
    """A value as text; "none" for None and NaN."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "none"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def unit_after(dataset: xr.Dataset, name: str) -> str:
    """The unit of a parameter with a space before it; empty for a dimensionless one."""
    unit = dataset[name].attrs["units"]
    dimensional = unit != quantity(name).unit or name in {q.name for q in OPERATION}
    return f" {unit.replace('*', ' ')}" if dimensional else ""
