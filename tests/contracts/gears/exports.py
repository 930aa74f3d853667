"""Tables as programs export them: workbooks, and random tables of stiffness and transmission error with their truth.

``python -m tests.contracts.gears.exports SEED FOLDER`` writes the random tables with their designs.
"""

from __future__ import annotations

import io
import math
import sys
import zipfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

_XLSX = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
_LINKS = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
_PACKAGE = "http://schemas.openxmlformats.org/package/2006"
_ODS = "urn:oasis:names:tc:opendocument:xmlns:"


def workbook(kind: str, *sheets: list[list[object]]) -> bytes:
    """A workbook of kind xlsx or ods with these sheets, each a list of rows of numbers and texts."""
    files = _ods(sheets) if kind == "ods" else _xlsx(sheets)
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, text in files.items():
            archive.writestr(name, text)
    return buffer.getvalue()


def _xlsx(sheets: tuple[list[list[object]], ...]) -> dict[str, str]:
    """The files of an .xlsx workbook."""
    names = range(1, len(sheets) + 1)
    out = {
        "[Content_Types].xml": f'<Types xmlns="{_PACKAGE}/content-types"/>',
        "_rels/.rels": f'<Relationships xmlns="{_PACKAGE}/relationships"><Relationship Id="r1" '
                       f'Type="{_LINKS}/officeDocument" Target="xl/workbook.xml"/></Relationships>',
        "xl/workbook.xml": f'<workbook xmlns="{_XLSX}" xmlns:r="{_LINKS}"><sheets>' + "".join(
            f'<sheet name="Sheet{n}" sheetId="{n}" r:id="r{n}"/>' for n in names) + "</sheets></workbook>",
        "xl/_rels/workbook.xml.rels": f'<Relationships xmlns="{_PACKAGE}/relationships">' + "".join(
            f'<Relationship Id="r{n}" Type="{_LINKS}/worksheet" Target="worksheets/sheet{n}.xml"/>' for n in names)
            + "</Relationships>",
    }
    for n, rows in zip(names, sheets, strict=True):
        data = "".join("<row>" + "".join(
            f'<c t="inlineStr"><is><t>{escape(cell)}</t></is></c>' if isinstance(cell, str) else
            f"<c><v>{cell!r}</v></c>" for cell in row) + "</row>" for row in rows)
        out[f"xl/worksheets/sheet{n}.xml"] = f'<worksheet xmlns="{_XLSX}"><sheetData>{data}</sheetData></worksheet>'
    return out


def _ods(sheets: tuple[list[list[object]], ...]) -> dict[str, str]:
    """The files of an .ods workbook."""
    tables = "".join(f'<table:table table:name="Sheet{n}">' + "".join("<table:table-row>" + "".join(
        f'<table:table-cell office:value-type="string"><text:p>{escape(cell)}</text:p></table:table-cell>'
        if isinstance(cell, str) else f'<table:table-cell office:value-type="float" office:value="{cell!r}"/>'
        for cell in row) + "</table:table-row>" for row in rows) + "</table:table>" for n, rows in enumerate(sheets, 1))
    spaces = " ".join(f'xmlns:{name}="{_ODS}{name}:1.0"' for name in ("office", "table", "text"))
    content = (f"<office:document-content {spaces}><office:body><office:spreadsheet>{tables}"
               "</office:spreadsheet></office:body></office:document-content>")
    return {"mimetype": "application/vnd.oasis.opendocument.spreadsheet", "content.xml": content,
            "META-INF/manifest.xml": f'<manifest:manifest xmlns:manifest="{_ODS}manifest:1.0"/>'}


@dataclass(frozen=True)
class Export:
    """A table with what it means.

    Attributes
    ----------
    name : str
        Of its file.
    content : bytes
        Of its file.
    key : {"stiffness", "transmission_error"}
        Of the design.
    file : {"table", "orders"}
        What the file is in the design.
    options : dict of str to object
        What stands beside it in the design.
    teeth : tuple of int
        z1, z2 of the design.
    truth : array
        The stiffness, N/m, at `AT`, or e_j exp(−iθ_j), m, of 8 orders.
    trap : str
        Why the table may be refused; empty if it must be read.
    """

    name: str
    content: bytes
    key: str
    file: str
    options: dict[str, object]
    teeth: tuple[int, int]
    truth: np.ndarray
    trap: str = ""


AT = (np.arange(97) + 0.31) / 97
"""Positions in mesh periods at which stiffnesses are compared; none is a jump."""

MODULE, WIDTH = 3e-3, 25e-3
"""Normal module and face width of the designs, m."""

PRESSURE = math.radians(20)

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
_EXTRA = ("Torque [Nm]", "Contact stress [N/mm²]", "Pressure angle [°]", "Single tooth stiffness [N/µm]", "Nr.",
          "Center distance [mm]", "Pitch error [µm]", "Temperature [°C]")
_TRAPS = ("thousands", "decimal commas between commas", "two columns", "Grad", "no unit", "missing value", "mean below",
          "angle of wheel 2", "teeth", "DOS", "blanks in a column of texts", "unknown name", "half a period")


def exports(seed: int, stiffnesses: int, errors: int) -> Iterator[Export]:
    """Random tables of random make; every third one has a trap."""
    draw = np.random.default_rng(seed)
    for number in range(stiffnesses + errors):
        make = _stiffness if number < stiffnesses else _curve if draw.random() < 0.7 else _orders
        trap = str(draw.choice(_TRAPS)) if number % 3 == 2 else ""
        yield make(draw, f"table{number}", trap)


def _pick(draw: np.random.Generator, choices: Iterable[Any]) -> Any:
    """One of several things."""
    return list(choices)[draw.integers(len(list(choices)))]


def _teeth(draw: np.random.Generator, trap: str) -> tuple[tuple[int, int], int]:
    """z1 and z2 of the design, and the number of mesh periods in a turn of the angle of the table."""
    z1, z2 = (int(z) for z in draw.choice(np.arange(17, 60), 2, replace=False))
    wrong = trap == "teeth" or trap == "angle of wheel 2"
    return (z1, z2), z2 if wrong else z1


def _stiffness(draw: np.random.Generator, name: str, trap: str) -> Export:
    """A table of points or levels of a stiffness."""
    teeth, passed = _teeth(draw, trap)
    count, cycles = int(draw.integers(12, 40)), int(_pick(draw, (1, 1, 2, passed)))
    knots = np.arange(count + 1) / count
    smooth = (350 + 60 * np.cos(2 * np.pi * knots - 0.7) + 20 * np.cos(4 * np.pi * knots + 2)) * 1e6
    unit = _pick(draw, _STIFFNESSES)
    x = np.add.outer(np.arange(cycles), knots[:-1]).ravel()
    if draw.random() < 0.3:
        kind, truth, y = "level", smooth[np.searchsorted(knots, AT) - 1], np.tile(smooth[:-1], cycles)
    else:
        kind, truth = "stiffness", np.interp(AT, knots, smooth)
        closed = draw.random() < 0.6
        x, y = (np.append(x, cycles), np.tile(smooth[:-1], cycles)) if closed else (x, np.tile(smooth[:-1], cycles))
        y = np.append(y, smooth[0]) if closed else y
    if trap == "half a period":
        x = x / 2
    angle = _pick(draw, _ANGLES)
    columns = {"roll angle": (x * 2 * np.pi / passed * _ANGLES[angle], angle), kind: (y * _STIFFNESSES[unit], unit)}
    return _written(draw, name, "stiffness", columns, {}, teeth, truth, trap)


def _harmonics(draw: np.random.Generator) -> np.ndarray:
    """e_j exp(−iθ_j) of 8 orders, of which 3 are not 0, in m."""
    sizes = draw.uniform(1e-7, 4e-6, 3) * np.exp(-1j * draw.uniform(-3, 3, 3))
    return np.append(sizes, np.zeros(5))


def _error_unit(draw: np.random.Generator, teeth: tuple[int, int]) -> tuple[str, float, dict[str, object]]:
    """The unit of an error, what 1 m along the line of action is in it, and the wheel whose angle it is, if any."""
    if draw.random() < 0.5:
        unit = _pick(draw, _LENGTHS)
        return unit, _LENGTHS[unit], {}
    unit, wheel = _pick(draw, _SMALL_ANGLES), int(draw.integers(1, 3))
    radius = MODULE * teeth[wheel - 1] * math.cos(PRESSURE) / 2
    return unit, _SMALL_ANGLES[unit] / radius, {"wheel": wheel}


def _curve(draw: np.random.Generator, name: str, trap: str) -> Export:
    """A table of an error over the roll angle, over a whole turn with runout."""
    teeth, passed = _teeth(draw, trap)
    truth, count, turn = _harmonics(draw), int(draw.integers(20, 50)), draw.random() < 0.5
    tau = np.arange(count * (passed if turn else 1) + (draw.random() < 0.5)) / count
    y = sum((c * np.exp(2j * np.pi * j * tau)).real for j, c in enumerate(truth, 1)) + 2e-6
    y = y + turn * 5e-6 * np.cos(2 * np.pi * tau / passed)
    unit, factor, options = _error_unit(draw, teeth)
    angle = _pick(draw, _ANGLES)
    if trap == "half a period" and not turn:
        tau = tau / 2
    columns = {"roll angle": (tau * 2 * np.pi / passed * _ANGLES[angle], angle), "error": (y * factor, unit)}
    return _written(draw, name, "transmission_error", columns, options, teeth, truth, trap)


def _orders(draw: np.random.Generator, name: str, trap: str) -> Export:
    """A table of orders."""
    teeth, truth = _teeth(draw, "")[0], _harmonics(draw)
    unit, factor, options = _error_unit(draw, teeth)
    kind, angle = _pick(draw, ("peak", "peak to peak")), _pick(draw, _ANGLES)
    columns = {"order": (np.arange(1.0, 4.0), ""),
               kind: (np.abs(truth[:3]) * factor * (1 + (kind != "peak")), unit),
               "phase": (-np.angle(truth[:3]) * _ANGLES[angle], angle)}
    return _written(draw, name, "transmission_error", columns, options, teeth, truth, trap)


def _written(
    draw: np.random.Generator, name: str, key: str, columns: dict[str, tuple[np.ndarray, str]],
    options: dict[str, object], teeth: tuple[int, int], truth: np.ndarray, trap: str,
) -> Export:
    """An export of columns, each with its unit, in one of many forms."""
    encoding = "cp437" if trap == "DOS" else _pick(draw, ("utf-8", "utf-8-sig", "cp1252", "utf-16"))
    separator = "," if "commas" in trap else _pick(draw, (";", ",", "\t", " "))
    comma = "commas" in trap or (separator != "," and draw.random() < 0.5)
    heads, cells, first = [], [], next(iter(columns))
    for column, (values, unit) in columns.items():
        head = _pick(draw, _NAMES[column])
        if column == first and trap == "angle of wheel 2" and key == "transmission_error":
            head = "Rotation of wheel 2"
        if column != first and trap == "unknown name":
            head = "Output 1"
        if trap == "Grad" and unit in ("deg", "°"):
            unit = "Grad"
        heads.append((head, "" if trap == "no unit" and column != first else unit))
        cells.append([_number(value, comma, trap == "thousands" and column != first) for value in values.tolist()])
    for _ in range(int(draw.integers(0, 3)) + 2 * (trap == "blanks in a column of texts")):
        at = int(draw.integers(len(heads) + 1))
        head, _, unit = _pick(draw, _EXTRA).rstrip("]").partition(" [")
        heads.insert(at, (head, unit))
        blanks = trap.startswith("blanks")
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
        form = _pick(draw, ("{} [{}]", "{} ({})", "{} / {}", "{}  in {}") if separator != " " else ("{} [{}]",))
        top = [[form.format(head, unit).replace("  ", " ") if unit else head for head, unit in heads]]
    return Export(*_file(draw, name, [*top, *rows], len(top), separator, encoding, trap), key,
                  "orders" if "order" in columns else "table", options, teeth, truth, trap)


def _file(
    draw: np.random.Generator, name: str, rows: list[list[str]], top: int, separator: str, encoding: str, trap: str,
) -> tuple[str, bytes]:
    """Name and content of a file: text, or a workbook."""
    if not trap and draw.random() < 0.15:
        sheet: list[list[object]] = [[_value(cell) for cell in row] for row in rows]
        return f"{name}.xlsx", workbook("xlsx", [["Report"], *sheet] if draw.random() < 0.5 else sheet)
    end = separator if separator != " " and draw.random() < 0.3 else ""
    if separator == " ":
        widths = [max(map(len, column)) + 3 for column in zip(*rows, strict=True)]
        lines = ["".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) for row in rows]
    else:
        quoted = '{}' if "commas" in trap else '"{}"'
        lines = [separator.join(quoted.format(c) if separator in c else c for c in row) + end for row in rows]
    if trap == "mean below":
        lines.append(separator.join(["Mean", *rows[-1][1:]]))
    if draw.random() < 0.3:
        lines[:0] = ["Contact analysis", f"File: {name}", ""]
    elif draw.random() < 0.2:
        lines[:0] = ["# exported", "#"]
    elif draw.random() < 0.3 and separator != " ":
        lines[:0] = [f"sep={separator}"]
    text = str(_pick(draw, ("\n", "\r\n"))).join(lines) + "\n"
    return f"{name}.csv", text.encode(encoding, "replace")


def _number(value: float, comma: bool, thousands: bool) -> str:
    """A number as a program prints it."""
    text = f"{value:,.13g}" if thousands else f"{value:.13g}"
    return text.translate(str.maketrans(",.", ".,")) if comma else text


def _value(cell: str) -> object:
    """A cell of a workbook."""
    try:
        return float(cell.replace(",", "."))
    except ValueError:
        return cell


if __name__ == "__main__":
    for export in exports(int(sys.argv[1]), 40, 20):
        Path(sys.argv[2], export.name).write_bytes(export.content)
        print(export.name, export.key, export.options, export.teeth, export.trap or "must be read")
