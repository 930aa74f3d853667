"""Tables from files: the columns that are asked for, in SI, from a header with names and units.

What could be read in two ways is refused with the number of its line. What was taken by its meaning is said in a note.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from gearchaos.errors import InputError, unknown_name
from gearchaos.gears import units
from gearchaos.gears.inputs.cells import DECIMAL_COMMA, NUMBER, Cells, line_error, read_cells

_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}", re.ASCII)
"""A number that may have a decimal comma or a comma between thousands, such as "1,250"."""

_FORMS = tuple(map(re.compile, (
    r"(.*?)\s*/?\s*\[([^]]*)\]", r"(.*?)\s+(?:/|in)\s+\(?(.*?)\)?", r"(.*?)\s*/?\s*\(((?:[^()]|\([^()]*\))*)\)")))
"""Forms of a name with a unit: name [unit], name / unit, name in unit, name (unit)."""

_PER_WIDTH = re.compile(r"(k?N)\s*/\s*\(?\s*mm\s*[*·.⋅/]?\s*([uµμ]m)\s*\)?")
"""Stiffness over face width as it is usually written, which pint reads otherwise or not at all."""

_MOST_NAMED = 5
"""Most columns that a note names as not used."""


@dataclass(frozen=True)
class Column:
    """A column that a table may have; upper and lower case are equal in names, and so are spaces, underscores and
    hyphens.

    ``scales`` are the dimensions that its unit in the header may have, and by what its values in SI are then
    multiplied; empty for pure numbers. ``words`` are a regular expression, in lower case, found in other names by which
    it may be taken if their unit fits, too. Then a unit alone may be its header as well; empty for a column that must
    have its name. ``other`` is found in names of something else, whatever their unit; ``advice`` says what to do if its
    unit does not fit.
    """

    name: str
    scales: Mapping[units.Dimension, float] = field(default_factory=dict)
    aliases: tuple[str, ...] = ()
    words: str = ""
    other: str = ""
    advice: str = ""

    @property
    def example(self) -> str:
        """An example of its header."""
        return f"{self.name} [{next(iter(self.scales)).example.split(maxsplit=1)[1]}]" if self.scales else self.name

    @property
    def names(self) -> set[str]:
        """The names in the header, in the form in which they are compared."""
        return {_plain(name) for name in (self.name, *self.aliases)}

    def factor(self, unit: str) -> float | None:
        """What a number in a unit is multiplied by; None for a unit that does not fit."""
        if not self.scales:
            return 1.0 if unit in ("", "1", "-") else None
        for dimension, scale in self.scales.items():
            if unit and (dimension is units.ANGLE or unit not in ('"', "'")):  # an inch, or a second of arc
                with suppress(InputError):
                    return units.to_si("unit", "1 " + _PER_WIDTH.sub(r"\1/mm/\2", unit), dimension) * scale
        return None

    def fits(self, unit: str) -> bool:
        """Whether a unit is one of this column, which is no pure number."""
        return bool(self.scales) and self.factor(unit) is not None

    def may_be(self, name: str, unit: str) -> bool:
        """Whether a header has a unit of this column, and no name of something else."""
        return self.fits(unit) and not (self.other and re.search(self.other, _plain(name)))


@dataclass(frozen=True, eq=False)
class Table:
    """The numbers of a table: columns (rows,) in SI by their names, in the order of the groups.

    ``lines`` are the numbers of the lines in the file, from 1 on; ``units`` the unit of each column in the header, and
    what it multiplies the numbers by. The notes say what was taken by its meaning or left out.
    """

    path: str
    columns: dict[str, np.ndarray]
    lines: tuple[int, ...]
    units: dict[str, tuple[str, float]]
    notes: tuple[str, ...]

    def error(self, row: int, rule: str, value: object, advice: str = "") -> InputError:
        """The error for a row that breaks a rule, with the number of its line."""
        return line_error(self.path, self.lines[row], rule, value, advice)

    def shown(self, name: str, value: float) -> str:
        """A number in SI as the file would have it, with the unit of its column."""
        unit, factor = self.units[name]
        return f"{value / factor:.9g} {unit}".rstrip()


def read_table(
    path: str | Path, groups: Sequence[Sequence[Column]], *, field: str = "table",
    chosen: Mapping[str, str] | None = None, increasing: bool = False, jumps: bool = False,
) -> Table:
    """Read a table from a file; see `gearchaos.gears.inputs.cells.read_cells` for the forms of files.

    A header is a name, followed by its unit: ``roll angle [deg]``, ``stiffness (N/um)``, ``φ / °``, ``order``. Of each
    group the one column is taken that ``chosen`` names, else the one with a known name, else the one by whose words and
    unit, or unit alone, it can be meant: that is said in a note. Other columns are left out. Decimal commas are read
    unless all of them could be commas between thousands ("1,250").

    ``chosen`` are headers in the file by the names of columns. They may be without their unit, or with another one,
    which then holds. With ``increasing`` the numbers of the first group must increase; with ``jumps`` two of its rows,
    but not more, may be equal: the values before and after a jump.

    Raises `InputError` for a file that cannot be read, and with the number of the line for anything that is missing,
    ambiguous or not a finite number.
    """
    columns = [column for group in groups for column in group]
    cells = read_cells(path, field, lambda text: any(column.fits(text) for column in columns))
    header = [_name_and_unit(cell, columns) for cell in cells.header]
    if any(NUMBER.fullmatch(cell) or DECIMAL_COMMA.fullmatch(cell) for cell in cells.header):
        raise line_error(cells.path, cells.line, "must be a header with names and units", cells.header,
                         f"Write a first line with names such as {', '.join(c.example for c in columns)}.")
    choices = _choices(cells, header, columns, chosen or {})
    found = [_column(cells, header, group, choices) for group in groups]
    for _, i, _ in found:
        if sum(i == other for _, other, _ in found) > 1:
            names = " or ".join(column.name for column, other, _ in found if i == other)
            raise line_error(cells.path, cells.line, f"must say whether this is {names}", cells.header[i],
                             _choose(found[0][0], cells.header[i]))
    if not cells.rows:
        raise line_error(cells.path, cells.line, "must have rows of numbers below the header", cells.header)
    numbers = _numbers(cells, [i for _, i, _ in found])
    factors = [_checked_factor(cells, column, unit) for column, _, unit in found]
    table = Table(
        cells.path, {column.name: numbers[:, k] * factors[k] for k, (column, _, _) in enumerate(found)},
        tuple(n for n, _ in cells.rows), {c.name: (u, f) for (c, _, u), f in zip(found, factors, strict=True)},
        _notes(cells, header, found))
    if increasing:
        _check_increasing(table, found[0][0].name, jumps)
    return table


_Found = tuple[Column, int, str]
"""A column, where it is in the header, and its unit."""


def _plain(name: str) -> str:
    """A name in the form in which names are compared."""
    return " ".join(re.split(r"[\s_-]+", name.strip().casefold()))


def _name_and_unit(cell: str, columns: Iterable[Column]) -> tuple[str, str]:
    """Name and unit of a header; a unit of a column alone has no name."""
    found = [(match[1].strip(), match[2].strip()) for form in _FORMS if (match := form.fullmatch(cell))]
    if found:
        return next((each for each in found if any(column.fits(each[1]) for column in columns)), found[0])
    named = any(_plain(cell) in column.names for column in columns)
    return ("", cell) if not named and any(column.fits(cell) for column in columns) else (cell, "")


def _choose(column: Column, header: str) -> str:
    """The advice to choose a column."""
    return f"To choose, write columns = {{ {_plain(column.name).replace(' ', '_')} = {header!r} }} beside the file."


def _choices(cells: Cells, header: list[tuple[str, str]], columns: list[Column], chosen: Mapping[str, str]
             ) -> list[_Found]:
    """The columns that the user has chosen."""
    out = []
    for key, text in chosen.items():
        column = next((c for c in columns if _plain(key) in c.names), None)
        if column is None:
            raise unknown_name("columns", key, (c.name.replace(" ", "_") for c in columns))
        name, unit = _name_and_unit(text, columns)
        same = [i for i, cell in enumerate(cells.header) if _plain(cell) == _plain(text)]
        same = same or [i for i, (own, _) in enumerate(header) if _plain(own) == _plain(name)]
        if len(same) != 1:
            raise line_error(cells.path, cells.line, f"must have the column that is chosen as {key} once", text,
                             f"It has {', '.join(map(repr, cells.header))}.")
        out.append((column, same[0], unit or header[same[0]][1]))
    return out


def _column(cells: Cells, header: list[tuple[str, str]], group: Sequence[Column], choices: list[_Found]) -> _Found:
    """The one column of a group: that which was chosen, else the one by its name, else by its words and unit."""
    picked = [choice for choice in choices if choice[0] in group]
    if len(picked) > 1:
        raise line_error(cells.path, cells.line, "must have one column among "
                         f"{', '.join(column.name for column in group)}", [column.name for column, _, _ in picked])
    if picked:
        return picked[0]
    named = [(c, i, unit) for c in group for i, (name, unit) in enumerate(header) if name and _plain(name) in c.names]
    fitting = [each for each in named if each[0].factor(each[2]) is not None]
    meant = [(c, i, unit) for c in group for i, (name, unit) in enumerate(header)
             if c.words and c.may_be(name, unit) and (not name or re.search(c.words, _plain(name)))]
    options = fitting or named or meant
    if len(options) == 1:
        return options[0]
    wanted = " or ".join(column.example for column in group)
    if options:
        names = [cells.header[i] for _, i, _ in options]
        several = " or ".join(dict.fromkeys(column.name for column, _, _ in options))
        raise line_error(cells.path, cells.line, f"must have exactly one column for {several}", names,
                         _choose(options[0][0], names[0]))
    near = next(((c, cells.header[i]) for c in group for i, each in enumerate(header) if c.may_be(*each)), None)
    advice = _choose(*near) if near else " ".join(
        ["Write its name with its unit in brackets.", *dict.fromkeys(c.advice for c in group if c.advice)])
    raise line_error(cells.path, cells.line, f"must have the column {wanted}", cells.header, advice)


def _checked_factor(cells: Cells, column: Column, unit: str) -> float:
    """What the numbers of a column are multiplied by; raises `InputError` for a unit that does not fit."""
    factor = column.factor(unit)
    if factor is not None:
        return factor
    if not column.scales:
        rule = f"must have no unit for {column.name}, a pure number"
    elif not unit:
        rule = f"must say the unit of {column.name}"
    else:
        rule = f"must have the unit of {' or '.join(d.name for d in column.scales)} for {column.name}"
    raise line_error(cells.path, cells.line, rule, unit,
                     f"{units.grad_advice(unit)}{column.advice} Such a column is e.g. {column.example}.".lstrip())


def _notes(cells: Cells, header: list[tuple[str, str]], found: list[_Found]) -> tuple[str, ...]:
    """What was taken, unless all columns have their names and no other is there."""
    taken = [i for _, i, _ in found]
    rest = [repr(cell) for i, cell in enumerate(cells.header) if i not in taken and cell]
    plain = all(_plain(header[i][0]) in {*column.names, ""} and unit == header[i][1] for column, i, unit in found)
    if plain and not rest:
        return ()
    unused = f"; not used: {', '.join(rest[:_MOST_NAMED])}{', …' * (len(rest) > _MOST_NAMED)}" if rest else ""
    read = ", ".join(f"{column.name} is {cells.header[i]!r}{f' in {unit}' * (unit != header[i][1])}"
                     for column, i, unit in found)
    return (f"columns of {Path(cells.path).name}: {read}{unused}",)


def _numbers(cells: Cells, taken: list[int]) -> np.ndarray:
    """The numbers of the columns that are taken, (rows, columns)."""
    texts = [(n, cell) for n, row in cells.rows for cell in row]
    commas = [(n, cell) for n, cell in texts if DECIMAL_COMMA.fullmatch(cell)]
    if commas:
        line, first = commas[0]
        cure = f"Write {first.replace(',', '.')}, or {first.replace(',', '')} if the comma separates thousands."
        if any(NUMBER.fullmatch(cell) and "." in cell for _, cell in texts):
            raise line_error(cells.path, line, "must have a decimal point, as other numbers of this file have", first,
                             cure)
        if all(_THOUSANDS.fullmatch(cell) for _, cell in commas):
            raise line_error(cells.path, line, "must not have a comma that may be a decimal comma or separate "
                             "thousands", first, cure)
    out = np.empty((len(cells.rows), len(taken)))
    for row, (n, own) in enumerate(cells.rows):
        for k, i in enumerate(taken):
            text = own[i].replace(",", ".") if commas else own[i]
            out[row, k] = float(text) if NUMBER.fullmatch(text) else math.nan
            if not math.isfinite(out[row, k]):
                advice = "Write e.g. 1234.5: no unit, nothing between thousands." if text else "The cell is empty."
                raise line_error(cells.path, n, "must have finite numbers", own[i], advice)
    return out


def _check_increasing(table: Table, column: str, jumps: bool) -> None:
    """Raise `InputError` unless the numbers of a column increase, up to two equal ones where there are jumps."""
    values = table.columns[column].tolist()
    rows = list(zip(*(numbers.tolist() for numbers in table.columns.values()), strict=True))
    for i in range(1, len(values)):
        line, shown = table.lines[i - 1], table.shown(column, values[i])
        if values[i] < values[i - 1]:
            rule = f"must have a greater {column} than line {line}, which has {table.shown(column, values[i - 1])}"
            raise table.error(i, rule, shown, f"Sort the rows by {column}.")
        third = i > 1 and values[i - 2] == values[i]
        if values[i] == values[i - 1] and (not jumps or third or rows[i] == rows[i - 1]):
            advice = "Two rows with the same one are a jump: the values before and after it." if jumps else (
                "Remove the row.")
            raise table.error(i, f"must not repeat the {column} of line {line}", shown, advice)
