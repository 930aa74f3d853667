"""Tables from files as programs export them: the columns that are asked for, in SI, from a header with names and units.

Read are text in UTF-8, UTF-16 with a byte order mark or Windows-1252, whatever the separator and the frame,
workbooks, MAT-files, and signals and spectra in the Universal File Format. What could be read in two ways is refused
with the number of its line. What was taken by its meaning is said in a note.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from gearchaos.errors import InputError, unknown_name
from gearchaos.gears.io import units
from gearchaos.gears.io.file_kinds import HEAD, is_mat, no_table
from gearchaos.gears.io.table_cells import (
    DECIMAL_COMMA,
    NUMBER,
    SEPARATORS,
    Rows,
    content_of,
    is_number,
    line_error,
    rows_by_separator,
)
from gearchaos.gears.io.uff_tables import is_uff

MOST_BYTES = 4_000_000  # largest size of a file
# a number that may have a decimal comma or a comma between thousands, such as "1,250"
_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}", re.ASCII)
# forms of a name with a unit: name [unit], name / unit, name in unit, name (unit)
_FORMS = tuple(map(re.compile, (
    r"(.*?)\s*/?\s*\[([^]]*)\]", r"(.*?)\s+(?:/|in)\s+\(?(.*?)\)?", r"(.*?)\s*/?\s*\(((?:[^()]|\([^()]*\))*)\)")))
# stiffness over face width as it is usually written, which pint reads otherwise or not at all
_PER_WIDTH = re.compile(r"(k?N)\s*/\s*\(?\s*mm\s*[*·.⋅/]?\s*([uµμ]m)\s*\)?")
_MOST_NAMED = 5  # most columns that a note names as not used


@dataclass(frozen=True)
class Column:
    """A column that a table may have; upper and lower case are equal in names, and so are spaces, underscores, hyphens.

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
    instead: tuple[tuple[Column, str], ...] = ()

    @property
    def unit(self) -> str:
        """A unit that it may have; empty for a pure number."""
        return next((each.example.split(maxsplit=1)[1] for each in self.scales), "")

    @property
    def example(self) -> str:
        return f"{self.name} [{self.unit}]" if self.scales else self.name

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

    def is_meant(self, name: str, unit: str) -> bool:
        """Whether a header has its name, or its unit with no name or one of its words."""
        return bool(name and _plain(name) in self.names) or bool(
            self.words and self.may_be(name, unit) and (not name or re.search(self.words, _plain(name))))


SPEED = Column("speed", {units.SPEED: 1.0}, ("n", "n1", "drehzahl", "rotational speed"), r"speed|drehzahl|\brpm\b")
TIME = Column("time", {units.DURATION: 1.0}, ("t", "zeit"), r"\btime|zeit")
"""Columns of measurements and of profiles."""


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
    chosen: Mapping[str, str] | None = None, increasing: bool = False, jumps: bool = False, most: int = MOST_BYTES,
    by_option: bool = False,
) -> Table:
    """Read a table from a regular file of at most ``most`` bytes.

    The header is the first row above one with two numbers or more that has a name or a unit of these columns, or one
    that is chosen, else the first such row, and whatever is above it is left out. It may be a comment, which begins
    with ``#``, and may have its units in a row of their own. The cells are separated by what makes such a header:
    semicolons, else tabs, commas, or spaces; or by that of a first line ``sep=;``. Where there is none, the columns are
    "column 1", "column 2", … and must be chosen.

    A header is a name, followed by its unit: ``roll angle [deg]``, ``stiffness (N/um)``, ``φ / °``, ``order``. Of each
    group the one column is taken that ``chosen`` names, else the one with a known name, else the one by whose words and
    unit, or unit alone, it can be meant: that is said in a note. Other columns are left out. Decimal commas are read
    unless all of them could be commas between thousands ("1,250").

    ``chosen`` are headers in the file by the names of columns. They may be without their unit, or with another one,
    which then holds; ``by_option`` says that an option of commands chooses them, not a file. With ``increasing`` the
    numbers of the first group must increase; with ``jumps`` two of its rows, but not more, may be equal: the values
    before and after a jump.

    Raises `InputError` for a file that cannot be read, and with the number of the line for a row that has not as many
    cells as the header, and for anything that is missing, ambiguous or not a finite number.
    """
    columns = [column for group in groups for column in group]
    cells = _cells(path, field, columns, most, chosen or {}, by_option)
    if cells.bare and not chosen:
        raise cells.error("must be a header with names and units", cells.rows[0][1] if cells.rows else cells.header,
                          f"Write a first line with names such as {', '.join(c.example for c in columns)}."
                          f" {cells.choose(columns[0], 'column 1')} {_advice(groups)}".rstrip())
    choices = _choices(cells, columns, chosen or {})
    options = [_column(cells, group, choices) for group in groups]
    if missing := [group for group, option in zip(groups, options, strict=True) if option is None]:
        raise _missing(cells, missing, [option[1] for option in options if option is not None])
    found = [option for option in options if option is not None]
    for _, i, _ in found:
        if len(same := [column.name for column, other, _ in found if i == other]) > 1:
            raise cells.error(f"must say whether this is {' or '.join(same)}", cells.header[i],
                              cells.choose(found[0][0], cells.header[i]))
    if not cells.rows:
        raise cells.error("must have rows of numbers below the header", cells.header)
    numbers = _numbers(cells, [i for _, i, _ in found])
    factors = []
    for column, i, unit in found:
        if (factor := column.factor(unit)) is None:
            rule = f"must have no unit for {column.name}, a pure number" if not column.scales else (
                f"must have the unit of {' or '.join(d.name for d in column.scales)} for {column.name}" if unit else
                f"must say the unit of {column.name}")
            how = "" if unit or not column.scales else f" {cells.choose(column, cells.header[i])}"
            meant = [text for other, text in column.instead if unit and other.factor(unit) is not None]
            usual = f"{units.grad_advice(unit)}{column.advice} Such a column is e.g. {column.example}.{how}".lstrip()
            raise cells.error(rule, unit, " ".join([*meant, usual]))
        factors.append(factor)
    taken, notes = [i for _, i, _ in found], tuple[str, ...]()
    rest = [repr(cell) for i, cell in enumerate(cells.header) if i not in taken and cell]
    if rest or any(
            _plain(cells.named[i][0]) not in {*c.names, ""} or unit != cells.named[i][1] for c, i, unit in found):
        unused = f"; not used: {', '.join(rest[:_MOST_NAMED])}{', …' * (len(rest) > _MOST_NAMED)}" if rest else ""
        read = ", ".join(f"{column.name} is {cells.header[i]!r}{f' in {unit}' * (unit != cells.named[i][1])}"
                         for column, i, unit in found)
        notes = (f"columns of {Path(cells.path).name}: {read}{unused}",)
    table = Table(
        cells.path, {column.name: numbers[:, k] * factors[k] for k, (column, _, _) in enumerate(found)},
        tuple(n for n, _ in cells.rows), {c.name: (u, f) for (c, _, u), f in zip(found, factors, strict=True)}, notes)
    if increasing:
        _check_increasing(table, found[0][0].name, jumps)
    return table


@dataclass(frozen=True)
class _Cells:
    """The texts of a table: the cells of its header, also as names and units, its line, and rows with as many cells.

    ``bare`` says that the file has no header; ``by_option`` is as in `read_table`.
    """

    path: str
    line: int
    header: list[str]
    named: list[tuple[str, str]]
    rows: Rows
    bare: bool
    by_option: bool

    def error(self, rule: str, value: object, advice: str = "") -> InputError:
        return line_error(self.path, self.line, rule, value, advice)

    def choose(self, column: Column, header: str) -> str:
        """How to choose a header for a column, with a unit if it has none and needs one."""
        name = _plain(column.name).replace(" ", "_")
        if column.scales and not _name_and_unit(header, [column])[1]:
            header = f"{header} [{column.unit}]"
        if self.by_option:
            return f'To choose, give --column {name}="{header}", in Python columns={{"{name}": "{header}"}}.'
        return f"To choose, write columns = {{ {name} = {header!r} }} beside the file."


def _cells(path: Any, field: str, columns: Sequence[Column], most: int, chosen: Mapping[str, str],
           by_option: bool) -> _Cells:
    if not isinstance(path, (str, Path)):
        raise InputError(field, "must be the path of a file", path)
    if what := no_table(content_of(path, field, HEAD, cut=True)):
        raise InputError(field, "must be a table: text, a workbook, .uff or .mat", str(path), what)
    content = content_of(path, field, most)
    shown = f"{path}, as a table" if is_uff(content) or is_mat(content) else str(path)  # that has no lines of its own
    grids = rows_by_separator(str(path), content, field)
    if not any(grids.values()):
        raise InputError(field, "must have a header and rows of numbers", str(path), "The file is empty.")
    # rows without numbers above one with two or more: the first of them with a name or a unit that is sought
    fitting = [(separator, i) for separator, rows in grids.items() for i, (_, cells) in enumerate(rows[1:])
               if sum(map(is_number, cells)) > 1 and len(_trimmed(cells)) <= len(header := _trimmed(rows[i][1]))
               and not any(map(is_number, header))]
    found = next((each for each in fitting if _has_sought(grids[each[0]][each[1]][1], columns, chosen)),
                 fitting[0] if fitting else None)
    bare = found is None and not any(
        _has_sought(cells, columns, chosen) for rows in grids.values() for _, cells in rows
        if not any(map(is_number, cells)))
    if bare:  # from the first row of numbers alone
        found = next(((separator, i) for separator, rows in grids.items() for i, (_, cells) in enumerate(rows)
                      if len(_trimmed(cells)) > 1 and all(map(is_number, _trimmed(cells)))), None)
        bare = found is not None
    # if no row of numbers fits, the first row says what is wrong
    separator, first = found or (next(s for s, rows in grids.items() if rows and (
        len(rows[0][1]) > 1 or s in (" ", ""))), 0)
    rows = grids[separator]
    line, header = rows[first][0], _trimmed(rows[first][1])
    if bare:
        header, first = [f"column {k}" for k in range(1, len(header) + 1)], first - 1
    known = [cell for cell in header if any(column.fits(cell.strip("[]()")) for column in columns)]
    like = [cell for cell in header if cell in known or re.fullmatch(r"\[.*\]|\(.*\)|-?", cell)]
    if first and known and 2 * len(like) >= len(header) and len(_trimmed(rows[first - 1][1])) == len(header):
        header = [f"{name} [{unit.strip('[]()')}]" for name, unit in zip(rows[first - 1][1], header, strict=False)]
    for n, cells in rows[first + 1:]:
        if not len(_trimmed(cells)) <= len(header) <= len(cells):
            advice = f"The header has {len(header)} cells, separated by {SEPARATORS[separator]}."
            if separator == ",":
                advice += " For decimal commas separate the cells, also those of the header, by semicolons."
            raise line_error(shown, n, f"must have {len(header)} cells, as the header has", f"{len(cells)} cells",
                              advice)
    return _Cells(shown, line, header, [_name_and_unit(cell, columns) for cell in header],
                  [(n, cells[: len(header)]) for n, cells in rows[first + 1:]], bare, by_option)


def _has_sought(header: list[str], columns: Sequence[Column], chosen: Mapping[str, str]) -> bool:
    """Whether a row has a name or a unit of these columns, or a header that is chosen."""
    names = {_plain(_name_and_unit(text, columns)[0]) for text in chosen.values()}
    named = [_name_and_unit(cell, columns) for cell in header]
    return any(_plain(name) in names or any(c.is_meant(name, unit) for c in columns) for name, unit in named)


def has_column(path: str | Path, column: Column, field: str, most: int = MOST_BYTES) -> bool:
    """Whether the header of a table has the name of a column; raises `InputError` for a file that is no table."""
    return any(_plain(name) in column.names for name, _ in _cells(path, field, [column], most, {}, False).named)


def _trimmed(cells: list[str]) -> list[str]:
    """The cells without empty ones at the end."""
    return cells[: next((i for i in range(len(cells), 0, -1) if cells[i - 1]), 0)]


def _plain(name: str) -> str:
    """A name in the form in which names are compared."""
    return " ".join(re.split(r"[\s_-]+", name.strip().casefold()))


_Found = tuple[Column, int, str]  # a column, where it is in the header, and its unit


def _name_and_unit(cell: str, columns: Iterable[Column]) -> tuple[str, str]:
    """Name and unit of a header; a unit of a column alone has no name."""
    found = [(match[1].strip(), match[2].strip()) for form in _FORMS if (match := form.fullmatch(cell))]
    if found:
        return next((each for each in found if any(column.fits(each[1]) for column in columns)), found[0])
    named = any(_plain(cell) in column.names for column in columns)
    return ("", cell) if not named and any(column.fits(cell) for column in columns) else (cell, "")


def _choices(cells: _Cells, columns: list[Column], chosen: Mapping[str, str]) -> list[_Found]:
    out = []
    for key, text in chosen.items():
        column = next((c for c in columns if _plain(key) in c.names), None)
        if column is None:
            raise unknown_name("columns", key, (c.name.replace(" ", "_") for c in columns))
        name, unit = _name_and_unit(text, columns)
        same = [i for i, cell in enumerate(cells.header) if _plain(cell) == _plain(text)]
        same = same or [i for i, (own, _) in enumerate(cells.named) if _plain(own) == _plain(name)]
        if len(same) != 1:
            raise cells.error(f"must have the column that is chosen as {key} once", text,
                              f"It has {', '.join(map(repr, cells.header))}.")
        out.append((column, same[0], unit or cells.named[same[0]][1]))
    return out


def _column(cells: _Cells, group: Sequence[Column], choices: list[_Found]) -> _Found | None:
    """The one column of a group: that which was chosen, else the one by its name, else by its words and unit; None if
    there is none."""
    picked = [choice for choice in choices if choice[0] in group]
    if len(picked) > 1:
        raise cells.error(f"must have one column among {', '.join(column.name for column in group)}",
                          [column.name for column, _, _ in picked])
    if picked:
        return picked[0]
    pairs = [(c, i, *each) for c in group for i, each in enumerate(cells.named)]
    named = [(c, i, unit) for c, i, name, unit in pairs if name and _plain(name) in c.names]
    fitting = [each for each in named if each[0].factor(each[2]) is not None]
    options = fitting or named or [(c, i, unit) for c, i, name, unit in pairs if c.is_meant(name, unit)]
    if len(options) > 1:
        names = [cells.header[i] for _, i, _ in options]
        several = " or ".join(dict.fromkeys(column.name for column, _, _ in options))
        raise cells.error(f"must have exactly one column for {several}", names, cells.choose(options[0][0], names[0]))
    return options[0] if options else None


def _missing(cells: _Cells, groups: list[Sequence[Column]], taken: list[int]) -> InputError:
    """The error for groups without a column: all of them, what there is in their place, and how to choose it."""
    rest = [(cells.header[i], *each) for i, each in enumerate(cells.named) if i not in taken and any(each)]
    advice = [f"{header!r}: {text}" for group in groups for column in group for other, text in column.instead
              for header, name, unit in rest if other.is_meant(name, unit) or other.fits(unit)][:1]
    near = [cells.choose(column, header) for group in groups for column in group for header, name, unit in rest
            if column.may_be(name, unit)][:1]
    bare = [cells.choose(groups[0][0], header) for header, _, unit in rest if not unit][:1]
    own = near or ["Write its name with its unit in brackets.", *bare]
    names = " and ".join(" or ".join(column.example for column in group) for group in groups)
    return cells.error(f"must have the column{'s' * (len(groups) > 1)} {names}", cells.header,
                       " ".join([*advice, *own, *([] if near and len(groups) == 1 else [_advice(groups)])]).rstrip())


def _advice(groups: Sequence[Sequence[Column]]) -> str:
    """The advice of all columns of groups."""
    return " ".join(dict.fromkeys(c.advice for group in groups for c in group if c.advice))


def _numbers(cells: _Cells, taken: list[int]) -> np.ndarray:
    """The numbers of the columns that are taken, (rows, columns)."""
    commas = [(n, cell) for n, row in cells.rows for cell in row if DECIMAL_COMMA.fullmatch(cell)]
    if commas:
        line, first = commas[0]
        cure = f"Write {first.replace(',', '.')}, or {first.replace(',', '')} if the comma separates thousands."
        if any(NUMBER.fullmatch(cell) and "." in cell for _, row in cells.rows for cell in row):
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
            raise table.error(i, f"must not repeat the {column} of line {line}", shown,
                              "Two rows with the same one are a jump: the values before and after it." if jumps else
                              "Remove the row.")
