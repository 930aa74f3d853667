"""The cells of tables in files: text with any separator, workbooks, MAT-files, the Universal File Format."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Mapping
from pathlib import Path

from gearchaos.errors import InputError, missing_package
from gearchaos.files import read_bytes
from gearchaos.gears.io.file_kinds import is_mat
from gearchaos.gears.io.mat_tables import mat_rows
from gearchaos.gears.io.uff_tables import is_uff, uff_rows

NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?", re.ASCII)
DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?", re.ASCII)
SEPARATORS = {";": "semicolons", "\t": "tabs", ",": "commas", " ": "spaces", "": "columns"}
_COMMENT = re.compile(r"^\s*#.*|\s#(?:\s.*|$)")
# how headers are told apart where spaces separate: by two spaces, by words with their units, or by units
_WAYS = (re.compile(r"\S+(?:\s\S+)*"), re.compile(r"[^\s\[(]+(?:\s*(?:\[[^]]*\]|\([^)]*\)))?"),
         re.compile(r"[^\s\[][^\[]*\[[^]]*\]"))
_WORKBOOKS = (b"PK\3\4", b"\xd0\xcf\x11\xe0")  # how files of spreadsheets begin: .xlsx and .ods, .xls

Rows = list[tuple[int, list[str]]]  # the cells of rows, each with its line


def content_of(path: str | Path, field: str, most: int, cut: bool = False) -> bytes:
    """The content of a file, or its first bytes; raises `InputError` if it cannot be read or has more than ``most``."""
    try:
        return read_bytes(Path(path), most, cut)
    except (OSError, ValueError) as error:  # ValueError for a path with a null character
        why = f"{getattr(error, 'strerror', None) or error}.".replace("..", ".")
        raise InputError(field, "must be a file that can be read", str(path), why) from None


def rows_by_separator(path: str, content: bytes, field: str) -> Mapping[str, Rows]:
    """For each separator the rows that are not empty, with their lines; for a workbook those of its only sheet;
    for a file in the Universal File Format those that it has as a table."""
    if content.startswith(_WORKBOOKS):
        return {"": _workbook(path, content, field)}
    if is_mat(content):
        return {"": [*enumerate(mat_rows(content, path, field), 1)]}
    if is_uff(content):
        return {"": [*enumerate(uff_rows(Path(path), field), 1)]}
    lines = re.split(r"\r\n|\r|\n", _text(path, content, field))
    said = re.fullmatch(r"sep=(.)", lines[0].strip(" ;,"), re.IGNORECASE)
    separators = (said[1],) if said and said[1] in SEPARATORS else (";", "\t", ",", " ")
    given = ["" if said else lines[0], *lines[1:]]
    lines = [_COMMENT.sub("", line) for line in given]
    first = next((i for i, line in enumerate(lines) if line.strip()), 0)
    comments = [i for i in range(first) if given[i].strip("# \t")]
    if comments and re.match(r'\s*"?[-+]?[.,]?\d', lines[first]):  # the comment is the header, as NumPy writes it
        lines[comments[-1]] = given[comments[-1]].lstrip("# \t")
    # where spaces separate, a header has as many cells as the line below it has words
    texts = [(n, line) for n, line in enumerate(lines, 1) if line.strip()]
    counts = [*(len(line.split()) for _, line in texts[1:]), -1]  # below the last line there is none
    spaced = [
        (n, next((w for way in _WAYS if len(w := [c.strip() for c in way.findall(line)]) == count), line.split())
         if not is_number(line.split()[0]) else line.split()) for (n, line), count in zip(texts, counts, strict=False)]
    grids = {}
    for separator in separators:
        reader = csv.reader(lines, delimiter=separator, skipinitialspace=True)
        try:
            rows = spaced if separator == " " else [
                (reader.line_num, [" ".join(cell.split()) for cell in cells]) for cells in reader]
        except csv.Error as error:
            raise line_error(path, reader.line_num, "must have cells that end", str(error),
                              "A quotation mark opens a cell that is never closed.") from None
        grids[separator] = [(n, cells) for n, cells in rows if any(cells)]
    return grids


def _text(path: str, content: bytes, field: str) -> str:
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


def _workbook(path: str, content: bytes, field: str) -> Rows:
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


def line_error(path: str, line: int, rule: str, value: object, advice: str = "") -> InputError:
    return InputError(f"{path}, line {line},", rule, value, advice)


def is_number(cell: str) -> bool:
    """Whether a cell is a number, with a decimal point or a decimal comma."""
    return bool(NUMBER.fullmatch(cell) or DECIMAL_COMMA.fullmatch(cell))
