"""Tables in text files: a header with units, numbers below, separated by commas, semicolons, tabs or spaces.

What could be read in two ways is refused with the number of its line, never guessed.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gearchaos.errors import InputError, unknown_name
from gearchaos.files import read_bytes
from gearchaos.gears import units

MOST_BYTES = 4_000_000
"""Largest size of a file."""

_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?", re.ASCII)
_DECIMAL_COMMA = re.compile(r"[-+]?(?:\d+,\d*|,\d+)(?:[eE][-+]?\d+)?", re.ASCII)
_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}", re.ASCII)
"""A number that may have a decimal comma or a comma between thousands, such as "1,250"."""

_NAME_AND_UNIT = re.compile(r"(.*?)\s*/?\s*(?:\[([^]]*)\]|\(([^)]*)\))")
_WORD = re.compile(r"[^\s\[(]+(?:\s*(?:\[[^]]*\]|\([^)]*\)))?")
_ANGLE_UNITS = frozenset((
    "rad", "mrad", "radian", "radians", "deg", "degree", "degrees", "°", "grad", "gon", "turn", "turns", "revolution",
    "revolutions", "arcmin", "arcsec",
))
"""The units of angles. Pint would also take pure numbers such as "%" for angles, in radians."""

_SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas", "": "spaces"}


@dataclass(frozen=True)
class Column:
    """A column that a table may have.

    Attributes
    ----------
    name : str
        Its name in the header, where upper and lower case are equal, and so are spaces, underscores and hyphens.
    dimension : Dimension or None
        Physical dimension of its unit in the header; None for pure numbers, which have no unit.
    aliases : tuple of str
        Other names in the header.
    required : bool
        Whether the table must have it.
    by_unit : bool
        Whether a unit alone, which fits the dimension, may be its header.
    """

    name: str
    dimension: units.Dimension | None = None
    aliases: tuple[str, ...] = ()
    required: bool = True
    by_unit: bool = True

    @property
    def example(self) -> str:
        """An example of its header."""
        return self.name if self.dimension is None else f"{self.name} [{self.dimension.example.split(maxsplit=1)[1]}]"


@dataclass(frozen=True, eq=False)
class Table:
    """The numbers of a table.

    Attributes
    ----------
    path : str
        The file.
    columns : dict of str to array (rows,)
        The numbers of each column in SI, by the names of the `Column` objects.
    lines : tuple of int
        Number of the line in the file of each row, from 1 on.
    """

    path: str
    columns: dict[str, np.ndarray]
    lines: tuple[int, ...]

    def error(self, row: int, rule: str, value: object, advice: str = "") -> InputError:
        """The error for a row that breaks a rule, with the number of its line."""
        return _error(self.path, self.lines[row], rule, value, advice)


def read_table(
    path: str | Path, columns: Sequence[Column], *, field: str = "table", abscissa: Sequence[str] = (),
    jumps: bool = False, least_rows: int = 1,
) -> Table:
    """Read a table from a text file.

    The first line that is neither empty nor a comment, from ``#`` on, is the header. A header is a name, followed by
    its unit in brackets for a column with a dimension: ``roll angle [deg]``, ``stiffness (N/um)``, ``order``. A unit
    alone, such as ``um``, is the header of the one column that it can belong to. The header decides what separates the
    cells: semicolons, else tabs, else commas, else spaces. Decimal commas are read where semicolons or tabs separate,
    unless all of them could be commas between thousands ("1,250"). The text is UTF-8, or UTF-16 with a byte order mark.

    Parameters
    ----------
    path : str or Path
        A regular file of at most `MOST_BYTES`.
    columns : sequence of Column
        The columns that the table may have, in any order; all others are refused.
    field : str
        Name of the path in error messages.
    abscissa : sequence of str
        Names of columns exactly one of which the table must have. Its numbers must increase.
    jumps : bool
        Whether two rows, but not more, may have the same abscissa: the values before and after a jump.
    least_rows : int
        Least number of rows.

    Raises
    ------
    InputError
        For a file that cannot be read, and with the number of the line for anything that is missing, ambiguous or not
        a finite number.
    """
    name, text = _text(path, field)
    lines = [(n, line.split("#")[0].strip(" ")) for n, line in enumerate(re.split(r"\r\n|\r|\n", text), 1)]
    lines = [(n, line) for n, line in lines if line.strip()]
    if not lines:
        raise InputError(field, "must have a header and rows of numbers", name, "The file is empty.")
    header_line, header = lines[0]
    separator = next((s for s in (";", "\t", ",") if s in header), "")
    found = _header(name, header_line, _cells(header, separator, _WORD), columns)
    _check_columns(name, header_line, [column for column, _ in found], columns, abscissa)
    numbers = _numbers(name, lines[1:], separator, len(found))
    if len(numbers) < least_rows:
        rule = f"must have at least {least_rows} row{'s' * (least_rows > 1)} of numbers below the header"
        raise _error(name, lines[-1][0], rule, len(numbers))
    scaled = np.array(numbers) * [factor for _, factor in found]
    table = Table(name, {column.name: scaled[:, i] for i, (column, _) in enumerate(found)}, tuple(
        n for n, _ in lines[1:]))
    for column in abscissa:
        if column in table.columns:
            _check_increasing(table, column, jumps)
    return table


def _error(path: str, line: int, rule: str, value: object, advice: str = "") -> InputError:
    """The error for a line of a file."""
    return InputError(f"{path}, line {line},", rule, value, advice)


def _text(path: Any, field: str) -> tuple[str, str]:
    """The path as a text, and the content of the file."""
    if not isinstance(path, (str, Path)):
        raise InputError(field, "must be the path of a file", path)
    try:
        content = read_bytes(Path(path), MOST_BYTES)
    except (OSError, ValueError) as error:  # ValueError for a path with a null character
        why = f"{getattr(error, 'strerror', None) or error}.".replace("..", ".")
        raise InputError(field, "must be a file that can be read", str(path), why) from None
    encoding = "utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        text = content.decode(encoding)
    except UnicodeDecodeError as error:
        line = len(re.findall(rb"\r\n|\r|\n", content[: error.start])) + 1
        raise _error(str(path), line, "must be text in UTF-8", content[error.start: error.end],
                     "Save the file as UTF-8, or write um instead of µm.") from None
    if "\0" in text:
        raise InputError(field, "must be a text file", str(path), "It has null characters.")
    return str(path), text


def _cells(line: str, separator: str, word: re.Pattern[str]) -> list[str]:
    """The cells of a line, without surrounding spaces and quotation marks."""
    parts = line.split(separator) if separator else word.findall(line)
    cells = (part.strip() for part in parts)
    return [c[1:-1].strip() if len(c) > 1 and c[0] == c[-1] == '"' else c for c in cells]


def _plain(name: str) -> str:
    """A name in the form in which names are compared."""
    return " ".join(re.split(r"[\s_-]+", name.strip().casefold()))


def _header(path: str, line: int, cells: list[str], columns: Sequence[Column]) -> list[tuple[Column, float]]:
    """Each column of the header, with its unit in SI."""
    names = {_plain(name): column for column in columns for name in (column.name, *column.aliases)}
    found = []
    for cell in cells:
        match = _NAME_AND_UNIT.fullmatch(cell)
        text, unit = (match[1], (match[2] or match[3] or "").strip()) if match else (cell, "")
        if _NUMBER.fullmatch(cell.replace(",", ".")):
            raise _error(path, line, "must be a header with names and units", cell, "The first line has names such as "
                         f"{', '.join(c.example for c in columns)}, and no #, which begins a comment.")
        column = names.get(_plain(text))
        if column is None:
            found.append(_by_unit(path, line, cell, columns))
        else:
            found.append((column, _factor(path, line, column, unit)))
    return found


def _by_unit(path: str, line: int, cell: str, columns: Sequence[Column]) -> tuple[Column, float]:
    """The one column that a header which is a unit alone can belong to, with its unit in SI."""
    factors = ((column, _in_si(column.dimension, cell)) for column in columns if column.dimension and column.by_unit)
    fitting = [(column, factor) for column, factor in factors if factor is not None]
    if len(fitting) > 1:
        names = " or ".join(column.name for column, _ in fitting)
        advice = f"Write e.g. {fitting[0][0].name} [{cell}]."
        raise _error(path, line, f"must say whether this is {names}", cell, advice)
    if not fitting:
        unknown = unknown_name("column", cell, (column.name for column in columns))
        raise _error(path, line, f"must have columns among {', '.join(column.example for column in columns)}", cell,
                     f"{unknown.advice} Remove other columns; put each unit in brackets.".strip())
    return fitting[0]


def _factor(path: str, line: int, column: Column, unit: str) -> float:
    """One unit of a column in SI."""
    advice = f"Write {column.example}."
    if column.dimension is None:
        if unit not in ("", "1", "-"):
            raise _error(path, line, f"must have no unit for {column.name}, a pure number", unit, advice)
        return 1.0
    if not unit:
        raise _error(path, line, f"must say the unit of {column.name}", "", advice)
    factor = _in_si(column.dimension, unit)
    if factor is None:
        raise _error(path, line, f"must have the unit of {column.dimension.name} for {column.name}", unit, advice)
    return factor


def _in_si(dimension: units.Dimension, unit: str) -> float | None:
    """One unit in SI; None if it is no unit of this dimension."""
    if not unit or (dimension is units.ANGLE and unit not in _ANGLE_UNITS):
        return None
    try:
        return units.to_si("unit", f"1 {unit}", dimension)
    except InputError:
        return None


def _check_columns(
    path: str, line: int, found: list[Column], columns: Sequence[Column], abscissa: Sequence[str],
) -> None:
    """Raise `InputError` for a column that is missing or there twice, and unless there is exactly one abscissa."""
    names = [column.name for column in found]
    for name in names:
        if names.count(name) > 1:
            raise _error(path, line, f"must have {name} once", names.count(name))
    for column in columns:
        if column.required and column.name not in names:
            raise _error(path, line, f"must have the column {column.example}", names)
    if abscissa and sum(name in names for name in abscissa) != 1:
        raise _error(path, line, f"must have exactly one of the columns {', '.join(abscissa)}", names)


def _numbers(path: str, lines: list[tuple[int, str]], separator: str, count: int) -> list[list[float]]:
    """The numbers of the rows."""
    rows = [(n, _cells(line, separator, re.compile(r"\S+"))) for n, line in lines]
    for n, cells in rows:
        if len(cells) != count:
            advice = f"The header says that {_SEPARATORS[separator]} separate the cells."
            if separator == ",":
                advice += " For decimal commas separate the cells, also those of the header, by semicolons."
            raise _error(path, n, f"must have {count} cells, as the header has", cells, advice)
    if _decimal_commas(path, rows, separator):
        rows = [(n, [cell.replace(",", ".") for cell in cells]) for n, cells in rows]
    return [[_number(path, n, cell) for cell in cells] for n, cells in rows]


def _decimal_commas(path: str, rows: Iterable[tuple[int, list[str]]], separator: str) -> bool:
    """Whether commas are decimal commas; raises `InputError` where that is ambiguous."""
    cells = [(n, cell) for n, row in rows for cell in row]
    commas = [(n, cell) for n, cell in cells if _DECIMAL_COMMA.fullmatch(cell)]
    if not commas:
        return False
    line, first = commas[0]
    if not separator:
        raise _error(path, line, "must have no commas where spaces separate the cells", first,
                     f"Write {first.replace(',', '.')}, or separate all cells, also of the header, by semicolons.")
    if any(_NUMBER.fullmatch(cell) and "." in cell for _, cell in cells):
        raise _error(path, line, "must have a decimal point, as other numbers of this file have", first,
                     f"Write {first.replace(',', '.')}, or {first.replace(',', '')} if the comma separates thousands.")
    if all(_THOUSANDS.fullmatch(cell) for _, cell in commas):
        raise _error(path, line, "must not have a comma that may be a decimal comma or separate thousands", first,
                     f"Write {first.replace(',', '.')} or {first.replace(',', '')}.")
    return True


def _number(path: str, line: int, cell: str) -> float:
    """The number in a cell."""
    number = float(cell) if _NUMBER.fullmatch(cell) else math.nan
    if not math.isfinite(number):
        advice = "Write e.g. 1234.5: no unit, no separators between thousands." if cell else "The cell is empty."
        raise _error(path, line, "must have finite numbers", cell, advice)
    return number


def _check_increasing(table: Table, column: str, jumps: bool) -> None:
    """Raise `InputError` unless the numbers of the abscissa increase, up to two equal ones where there are jumps."""
    values = table.columns[column].tolist()
    rows = list(zip(*(numbers.tolist() for numbers in table.columns.values()), strict=True))
    for i in range(1, len(values)):
        line = table.lines[i - 1]
        if values[i] < values[i - 1]:
            rule = f"must have a greater {column} (in SI) than line {line}, which has {values[i - 1]:.9g}"
            raise table.error(i, rule, values[i], f"Sort the rows by {column}.")
        third = i > 1 and values[i - 2] == values[i]
        if values[i] == values[i - 1] and (not jumps or third or rows[i] == rows[i - 1]):
            advice = "Two rows with the same one are a jump: the values before and after it." if jumps else ""
            raise table.error(i, f"must not repeat the {column} of line {line}", values[i], advice)
