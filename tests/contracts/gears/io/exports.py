"""Tables as programs export them: workbooks, and random tables of stiffness and transmission error with their truth."""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

_XLSX = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
_LINKS = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
_PACKAGE = "http://schemas.openxmlformats.org/package/2006/relationships"
_ODS = "urn:oasis:names:tc:opendocument:xmlns:"


def workbook(kind: str, *sheets: list[list[object]]) -> bytes:
    """A workbook of kind xlsx or ods with these sheets, each a list of rows of numbers and texts."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, text in (_ods(sheets) if kind == "ods" else _xlsx(sheets)).items():
            archive.writestr(name, text)
    return buffer.getvalue()


def _rows(rows: list[list[object]], row: str, text: str, number: str) -> str:
    """The rows of a sheet in XML, by forms of a row, a cell with a text and one with a number."""
    return "".join(row.format("".join(text.format(escape(cell)) if isinstance(cell, str) else number.format(cell)
                                      for cell in cells)) for cells in rows)


def _xlsx(sheets: tuple[list[list[object]], ...]) -> dict[str, str]:
    names = range(1, len(sheets) + 1)
    book = "".join(f'<sheet name="Sheet{n}" sheetId="{n}" r:id="r{n}"/>' for n in names)
    links = "".join(f'<Relationship Id="r{n}" Type="{_LINKS}/worksheet" Target="worksheets/sheet{n}.xml"/>'
                    for n in names)
    form = ("<row>{}</row>", '<c t="inlineStr"><is><t>{}</t></is></c>', "<c><v>{!r}</v></c>")
    return {
        "_rels/.rels": f'<Relationships xmlns="{_PACKAGE}"><Relationship Id="r1" Type="{_LINKS}/officeDocument" '
                       'Target="xl/workbook.xml"/></Relationships>',
        "xl/workbook.xml": f'<workbook xmlns="{_XLSX}" xmlns:r="{_LINKS}"><sheets>{book}</sheets></workbook>',
        "xl/_rels/workbook.xml.rels": f'<Relationships xmlns="{_PACKAGE}">{links}</Relationships>',
        **{f"xl/worksheets/sheet{n}.xml":
           f'<worksheet xmlns="{_XLSX}"><sheetData>{_rows(rows, *form)}</sheetData></worksheet>'
           for n, rows in zip(names, sheets, strict=True)},
    }


def _ods(sheets: tuple[list[list[object]], ...]) -> dict[str, str]:
    form = ("<table:table-row>{}</table:table-row>",
            '<table:table-cell office:value-type="string"><text:p>{}</text:p></table:table-cell>',
            '<table:table-cell office:value-type="float" office:value="{!r}"/>')
    tables = "".join(f'<table:table table:name="Sheet{n}">{_rows(rows, *form)}</table:table>'
                     for n, rows in enumerate(sheets, 1))
    spaces = " ".join(f'xmlns:{name}="{_ODS}{name}:1.0"' for name in ("office", "table", "text"))
    return {"mimetype": "application/vnd.oasis.opendocument.spreadsheet", "META-INF/manifest.xml": "<m/>",
            "content.xml": f"<office:document-content {spaces}><office:body><office:spreadsheet>{tables}"
                           "</office:spreadsheet></office:body></office:document-content>"}


@dataclass(frozen=True)
class Export:
    """A file with a table and what it means."""

    name: str
    content: bytes
    key: str  # of the table in transmission_error of a design, or "stiffness"
    options: dict[str, object]  # what stands beside it there
    teeth: tuple[int, int]
    truth: np.ndarray  # the stiffness, N/m, at `AT`, or e_j exp(−iθ_j), m, of 8 orders
    trap: str  # why the table may be refused; empty if it must be read


AT = (np.arange(97) + 0.31) / 97
"""Positions in mesh periods at which stiffnesses are compared; none is a jump."""

MODULE, WIDTH = 3e-3, 25e-3
"""Normal module and face width of the designs, m."""

_ANGLES = {"deg": math.degrees(1), "°": math.degrees(1), "rad": 1.0, "mrad": 1e3, "arcmin": math.degrees(60)}
_STIFFNESSES = {"N/um": 1e-6, "N/µm": 1e-6, "N/m": 1.0, "kN/mm": 1e-6, "N/mm": 1e-3, "N/(mm·µm)": 1e-9 / WIDTH,
                "N/mm/µm": 1e-9 / WIDTH}
_LENGTHS = {"um": 1e6, "µm": 1e6, "mm": 1e3, "m": 1.0}
_SMALL_ANGLES = {"arcsec": math.degrees(3600), "µrad": 1e6, "mrad": 1e3, "deg": math.degrees(1)}
_NAMES = {
    "roll angle": ("roll angle", "Angle of rotation", "Drehwinkel", "Pinion rotation angle", "Drehwinkel Ritzel"),
    "stiffness": ("stiffness", "Stiffness curve", "Eingriffssteifigkeit", "Mesh stiffness, total", "Zahnsteifigkeit"),
    "level": ("level", "stiffness level"),
    "error": ("error", "Transmission error", "Drehfehler", "TE unloaded", "Drehwegabweichung"),
    "order": ("order", "Ordnung"), "peak": ("peak",), "peak to peak": ("peak to peak", "Peak-to-peak"),
    "phase": ("phase", "Phase angle", "Phasenwinkel"),
}
_EXTRA = ("Torque [Nm]", "Drehmoment [Nm]", "Contact stress [N/mm²]", "Pressure angle [°]", "Nr.", "Temperature [°C]",
          "Single tooth stiffness [N/µm]", "Center distance [mm]", "Pitch error [µm]")
_TRAPS = ("thousands", "decimal commas between commas", "two columns", "Grad", "missing value", "angle of wheel 2",
          "teeth", "DOS", "blanks in a column of texts", "half a period")

_OF_WHEEL_2 = ("angle of wheel 2", "teeth")
_Columns = dict[str, tuple[np.ndarray, str]]


def exports(seed: int, stiffnesses: int, errors: int) -> Iterator[Export]:
    """Random tables of random make; every third one has a trap."""
    draw = np.random.default_rng(seed)
    for number in range(stiffnesses + errors):
        trap = str(draw.choice(_TRAPS)) if number % 3 == 2 else ""
        teeth = tuple(int(z) for z in draw.choice(np.arange(17, 60), 2, replace=False))
        passed = teeth[trap in _OF_WHEEL_2]  # mesh periods in a turn of the angle of the table
        if number < stiffnesses:
            key, options, (columns, truth) = "stiffness", {}, _stiffness(draw, passed, trap)
        else:
            key = "table" if draw.random() < 0.7 else "orders"
            truth = np.append(draw.uniform(1e-7, 4e-6, 3) * np.exp(-1j * draw.uniform(-3, 3, 3)), np.zeros(5))
            unit, factor, options = _error_unit(draw, teeth)
            make = _curve if key == "table" else _orders
            columns = make(draw, truth, unit, factor, passed, trap)
        yield Export(*_written(draw, f"table{number}", key, columns, trap), key, options, teeth, truth, trap)


def _pick(draw: np.random.Generator, choices: Any) -> Any:
    return list(choices)[draw.integers(len(choices))]


def _stiffness(draw: np.random.Generator, passed: int, trap: str) -> tuple[_Columns, np.ndarray]:
    """Points or levels of a stiffness, and the stiffness."""
    count, cycles = int(draw.integers(12, 40)), int(_pick(draw, (1, 1, 2, passed)))
    knots = np.arange(count + 1) / count
    smooth = (350 + 60 * np.cos(2 * np.pi * knots - 0.7) + 20 * np.cos(4 * np.pi * knots + 2)) * 1e6
    x, y = np.add.outer(np.arange(cycles), knots[:-1]).ravel(), np.tile(smooth[:-1], cycles)
    if draw.random() < 0.3 and trap not in _OF_WHEEL_2:  # where the last level ends is not in a table
        kind, truth = "level", smooth[np.searchsorted(knots, AT) - 1]
    else:
        kind, truth = "stiffness", np.interp(AT, knots, smooth)
        if draw.random() < 0.6:  # the end is the beginning
            x, y = np.append(x, cycles), np.append(y, smooth[0])
    unit, angle = _pick(draw, _STIFFNESSES), _pick(draw, _ANGLES)
    x = x / 2 if trap == "half a period" else x
    return {"roll angle": (x * 2 * np.pi / passed * _ANGLES[angle], angle), kind: (y * _STIFFNESSES[unit], unit)}, truth


def _error_unit(draw: np.random.Generator, teeth: tuple[int, ...]) -> tuple[str, float, dict[str, object]]:
    """The unit of an error, what 1 m along the line of action is in it, and the wheel whose angle it is, if any."""
    if draw.random() < 0.5:
        return (unit := _pick(draw, _LENGTHS)), _LENGTHS[unit], {}
    unit, wheel = _pick(draw, _SMALL_ANGLES), int(draw.integers(1, 3))
    radius = MODULE * teeth[wheel - 1] * math.cos(math.radians(20)) / 2
    return unit, _SMALL_ANGLES[unit] / radius, {"wheel": wheel}


def _curve(draw: np.random.Generator, truth: np.ndarray, unit: str, factor: float, passed: int, trap: str) -> _Columns:
    """An error over the roll angle, of one mesh period or of a whole turn with runout."""
    count, turn, angle = int(draw.integers(20, 50)), draw.random() < 0.5, _pick(draw, _ANGLES)
    tau = np.arange(count * (passed if turn else 1) + (draw.random() < 0.5)) / count
    y = sum((c * np.exp(2j * np.pi * j * tau)).real for j, c in enumerate(truth, 1)) + 2e-6
    y = y + turn * 5e-6 * np.cos(2 * np.pi * tau / passed)
    tau = tau / 2 if trap == "half a period" and not turn else tau
    return {"roll angle": (tau * 2 * np.pi / passed * _ANGLES[angle], angle), "error": (y * factor, unit)}


def _orders(draw: np.random.Generator, truth: np.ndarray, unit: str, factor: float, *_: object) -> _Columns:
    """An error by its orders."""
    kind, angle = _pick(draw, ("peak", "peak to peak")), _pick(draw, _ANGLES)
    return {"order": (np.arange(1.0, 4.0), ""), kind: (np.abs(truth[:3]) * factor * (1 + (kind != "peak")), unit),
            "phase": (-np.angle(truth[:3]) * _ANGLES[angle], angle)}


def _written(draw: np.random.Generator, name: str, key: str, columns: _Columns, trap: str) -> tuple[str, bytes]:
    """Name and content of a file with columns, each with its unit, in one of many forms."""
    encoding = "cp437" if trap == "DOS" else _pick(draw, ("utf-8", "utf-8-sig", "cp1252", "utf-16"))
    separator = "," if "commas" in trap else _pick(draw, (";", ",", "\t", " "))
    comma = "commas" in trap or (separator != "," and draw.random() < 0.5)
    heads, cells, first = [], [], next(iter(columns))
    for column, (values, unit) in columns.items():
        of_wheel_2 = column == first and trap == "angle of wheel 2" and key == "table"
        head = "Rotation of wheel 2" if of_wheel_2 else _pick(draw, _NAMES[column])
        heads.append((head, "Grad" if trap == "Grad" and unit in ("deg", "°") else unit))
        cells.append([_number(value, comma, trap == "thousands" and column != first) for value in values.tolist()])
    blanks = trap.startswith("blanks")
    for _ in range(int(draw.integers(0, 3)) + 2 * blanks):
        at = int(draw.integers(len(heads) + 1))
        head, _, unit = _pick(draw, _EXTRA).rstrip("]").partition(" [")
        heads.insert(at, (head, unit))
        cells.insert(at, [_pick(draw, ("ok", "not ok")) if blanks else _number(draw.uniform(0, 90), comma, False)
                          for _ in cells[0]])
    if trap == "two columns":
        heads.append((_pick(draw, (f"{heads[-1][0]} B", heads[-1][0])), heads[-1][1]))
        cells.append(cells[-1][::-1])
    rows = [list(row) for row in zip(*cells, strict=True)]
    if trap == "missing value":
        rows[-1][int(draw.integers(len(heads)))] = _pick(draw, ("", "NaN", "-", "1.#IND"))
    if draw.random() < 0.25 and separator != " ":
        top = [[head for head, _ in heads], [f"[{unit or '-'}]" for _, unit in heads]]
    else:
        form = _pick(draw, ("{} [{}]", "{} ({})", "{} / {}", "{} in {}") if separator != " " else ("{} [{}]",))
        top = [[form.format(head, unit) if unit else head for head, unit in heads]]
    if not trap and draw.random() < 0.15:
        sheet: list[list[object]] = [*top, *([float(cell.replace(",", ".")) for cell in row] for row in rows)]
        return f"{name}.xlsx", workbook("xlsx", [["Report"], *sheet] if draw.random() < 0.5 else sheet)
    return f"{name}.csv", _text(draw, name, [*top, *rows], separator, trap).encode(encoding, "replace")


def _text(draw: np.random.Generator, name: str, rows: list[list[str]], separator: str, trap: str) -> str:
    """The rows as text, with lines above or below."""
    end = separator if separator != " " and draw.random() < 0.3 else ""
    if separator == " ":
        widths = [max(map(len, column)) + 3 for column in zip(*rows, strict=True)]
        lines = ["".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in rows]
    else:
        quoted = '{}' if "commas" in trap else '"{}"'
        lines = [separator.join(quoted.format(c) if separator in c else c for c in row) + end for row in rows]
    if draw.random() < 0.3:
        lines[:0] = ["Contact analysis", f"File: {name}", ""]
    elif draw.random() < 0.2:
        lines[:0] = ["# exported", "#"]
    elif draw.random() < 0.3 and separator != " ":
        lines[:0] = [f"sep={separator}"]
    return str(_pick(draw, ("\n", "\r\n"))).join(lines) + "\n"


def _number(value: float, comma: bool, thousands: bool) -> str:
    text = f"{value:,.13g}" if thousands else f"{value:.13g}"
    return text.translate(str.maketrans(",.", ".,")) if comma else text
