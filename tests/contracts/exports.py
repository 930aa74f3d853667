"""Tables as programs export them: workbooks, and random tables of stiffness and transmission error with their truth.

``python -m tests.contracts.exports SEED FOLDER`` writes the random tables with their designs.
"""

from __future__ import annotations

import io
import zipfile
from xml.sax.saxutils import escape

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
