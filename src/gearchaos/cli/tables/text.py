"""Tables of text, and numbers in them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table

from gearchaos.quantities import OPERATION, quantity

if TYPE_CHECKING:
    import xarray as xr

FILE_WIDTH = 160
"""Width of a table in characters where stdout is not a terminal."""


def print_table(table: Table) -> None:
    """Print a table in the width of the terminal."""
    console = Console()
    width = console.width if console.is_terminal else FILE_WIDTH
    Console(width=width, markup=False).print(table)  # a unit in brackets, "[um]", is no markup


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
