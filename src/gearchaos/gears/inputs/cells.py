"""Tables as programs export them: header and rows as texts, whatever the encoding, the separator and the frame.

Read are text in UTF-8, UTF-16 with a byte order mark or Windows-1252, and workbooks.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gearchaos.errors import InputError, missing_package
from gearchaos.files import read_bytes

MOST_BYTES = 4_000_000
"""Largest size of a file."""

NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?", re.ASCII)
DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?", re.ASCII)

_SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas", " ": "spaces", "": "columns of a workbook"}
_COMMENT = re.compile(r"^\s*#.*|\s#(?:\s.*|$)")
_WAYS = (re.compile(r"\S+(?:\s\S+)*"), re.compile(r"[^\s\[(]+(?:\s*(?:\[[^]]*\]|\([^)]*\)))?"),
         re.compile(r"[^\s\[][^\[]*\[[^]]*\]"))
"""How headers are told apart where spaces separate: by two spaces, by words with their units, or by units."""

_WORKBOOKS = (b"PK\3\4", b"\xd0\xcf\x11\xe0")
"""How files of spreadsheets begin: .xlsx and .ods, .xls."""


@dataclass(frozen=True)
class Cells:
    """The texts of a table: the names with units of its header and their line, and the cells of each row with its line.

    Each row has as many cells as the header.
    """

    path: str
    header: list[str]
    line: int
    rows: list[tuple[int, list[str]]]


def line_error(path: str, line: int, rule: str, value: object, advice: str = "") -> InputError:
    """The error for a line of a file."""
    return InputError(f"{path}, line {line},", rule, value, advice)


def is_number(cell: str) -> bool:
    """Whether a cell is a number, with a decimal point or a decimal comma."""
    return bool(NUMBER.fullmatch(cell) or DECIMAL_COMMA.fullmatch(cell))


def read_cells(path: Any, field: str, is_unit: Callable[[str], bool]) -> Cells:
    """The texts of a table in a regular file of at most `MOST_BYTES`.

    The header is the row above the first row with two numbers or more, and whatever is above it is left out. It may be
    a comment, which begins with ``#``, and may have its units in a row of their own. The cells are separated by what
    makes such a header: semicolons, else tabs, commas, or spaces; or by that of a first line ``sep=;``. ``is_unit``
    says whether a text is a unit of one of the columns.

    Raises `InputError` for a file that cannot be read, and with the line for a row that has not as many cells as the
    header.
    """
    if not isinstance(path, (str, Path)):
        raise InputError(field, "must be the path of a file", path)
    try:
        content = read_bytes(Path(path), MOST_BYTES)
    except (OSError, ValueError) as error:  # ValueError for a path with a null character
        why = f"{getattr(error, 'strerror', None) or error}.".replace("..", ".")
        raise InputError(field, "must be a file that can be read", str(path), why) from None
    grids = _grids(str(path), content, field)
    if not any(grids.values()):
        raise InputError(field, "must have a header and rows of numbers", str(path), "The file is empty.")
    starts = ((separator, _above_numbers(rows)) for separator, rows in grids.items())
    separator, first = next((start for start in starts if start[1] >= 0), (None, 0))
    if separator is None:  # no row of numbers fits: the first row says what is wrong
        separator = next(s for s, rows in grids.items() if rows and (len(rows[0][1]) > 1 or s in (" ", "")))
    rows = grids[separator]
    line, header = rows[first][0], _trimmed(rows[first][1])
    known = [cell for cell in header if is_unit(cell.strip("[]()"))]
    like = [cell for cell in header if cell in known or re.fullmatch(r"\[.*\]|\(.*\)|-?", cell)]
    if first and known and 2 * len(like) >= len(header) and len(_trimmed(rows[first - 1][1])) == len(header):
        header = [f"{name} [{unit.strip('[]()')}]" for name, unit in zip(rows[first - 1][1], header, strict=False)]
    for n, cells in rows[first + 1:]:
        if not len(_trimmed(cells)) <= len(header) <= len(cells):
            advice = f"The header has {len(header)} cells, separated by {_SEPARATORS[separator]}."
            if separator == ",":
                advice += " For decimal commas separate the cells, also those of the header, by semicolons."
            raise line_error(str(path), n, f"must have {len(header)} cells, as the header has", cells, advice)
    return Cells(str(path), header, line, [(n, cells[: len(header)]) for n, cells in rows[first + 1:]])


_Grid = list[tuple[int, list[str]]]


def _grids(path: str, content: bytes, field: str) -> Mapping[str, _Grid]:
    """For each separator the rows that are not empty, with their lines; for a workbook those of its only sheet."""
    if content.startswith(_WORKBOOKS):
        return {"": _workbook(path, content, field)}
    lines = re.split(r"\r\n|\r|\n", _text(path, content, field))
    said = re.fullmatch(r"sep=(.)", lines[0].strip(" ;,"), re.IGNORECASE)
    separators = (said[1],) if said and said[1] in _SEPARATORS else (";", "\t", ",", " ")
    given = ["" if said else lines[0], *lines[1:]]
    lines = [_COMMENT.sub("", line) for line in given]
    first = next((i for i, line in enumerate(lines) if line.strip()), 0)
    comments = [i for i in range(first) if given[i].strip("# \t")]
    if comments and re.match(r'\s*"?[-+]?[.,]?\d', lines[first]):  # the comment is the header, as NumPy writes it
        lines[comments[-1]] = given[comments[-1]].lstrip("# \t")
    return {s: _by_spaces(lines) if s == " " else _separated(path, lines, s) for s in separators}


def _text(path: str, content: bytes, field: str) -> str:
    """The text of a file."""
    utf16 = content.startswith((b"\xff\xfe", b"\xfe\xff"))
    text = ""
    for encoding in ("utf-16",) if utf16 else ("utf-8-sig", "cp1252"):
        try:
            text = content.decode(encoding)
            break
        except UnicodeDecodeError as error:
            wrong = error
    else:
        line = len(re.findall(rb"\r\n|\r|\n", content[: wrong.start])) + 1
        raise line_error(path, line, "must be text in UTF-8, UTF-16 or Windows-1252", content[wrong.start: wrong.end],
                         "Write the units without signs such as µ and °: um, deg.")
    if "\0" in text:
        raise InputError(field, "must be a text file", path, "It has null characters: export it as CSV.")
    return text


def _workbook(path: str, content: bytes, field: str) -> _Grid:
    """The rows of the only sheet of a workbook that has any."""
    try:
        from python_calamine import CalamineWorkbook
    except ImportError:
        raise missing_package(f"{path}, a workbook,", "python-calamine", "tables") from None
    try:
        book = CalamineWorkbook.from_filelike(io.BytesIO(content))
        sheets = {name: book.get_sheet_by_name(name).to_python(skip_empty_area=False) for name in book.sheet_names}
    except Exception as error:  # the package raises many, also for zipped files of any other kind
        raise InputError(field, "must be a workbook that can be read, or a text file", path,
                         f"{error}. Save the sheet as CSV.") from None
    grids = {name: [(n, row) for n, cells in enumerate(rows, 1) if any(row := [str(c).strip() for c in cells])]
             for name, rows in sheets.items()}
    filled = [name for name, rows in grids.items() if rows]
    if len(filled) > 1:
        raise InputError(field, "must be a workbook with one sheet that is not empty", filled,
                         f"Save the sheet of the table as CSV, or delete the others of {path}.")
    return grids[filled[0]] if filled else []


def _separated(path: str, lines: list[str], separator: str) -> _Grid:
    """The rows of lines with a separator."""
    reader = csv.reader(lines, delimiter=separator, skipinitialspace=True)
    try:
        rows = [(reader.line_num, [" ".join(cell.split()) for cell in cells]) for cells in reader]
    except csv.Error as error:
        raise line_error(path, reader.line_num, "must have cells that end", str(error),
                         "A quotation mark opens a cell that is never closed.") from None
    return [(n, cells) for n, cells in rows if any(cells)]


def _by_spaces(lines: list[str]) -> _Grid:
    """The rows of lines whose cells spaces separate: a header has as many as the line below it has words."""
    texts = [(n, line) for n, line in enumerate(lines, 1) if line.strip()]
    counts = [len(line.split()) for _, line in texts]
    return [
        (n, next((w for way in _WAYS if len(w := [c.strip() for c in way.findall(line)]) == count), line.split())
         if not is_number(line.split()[0]) else line.split())
        for (n, line), count in zip(texts, [*counts[1:], 0], strict=False)
    ]


def _above_numbers(rows: _Grid) -> int:
    """The index of the row without numbers above the first one with two or more; -1 if there is none."""
    for i, (_, cells) in enumerate(rows[1:]):
        header = _trimmed(rows[i][1])
        if sum(map(is_number, cells)) > 1 and len(_trimmed(cells)) <= len(header) and not any(map(is_number, header)):
            return i
    return -1


def _trimmed(cells: list[str]) -> list[str]:
    """The cells without empty ones at the end."""
    return cells[: next((i for i in range(len(cells), 0, -1) if cells[i - 1]), 0)]
