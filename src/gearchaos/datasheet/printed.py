"""The report of an assessment for printing: pages of a PDF, the verdict and the picture first, then tables of text."""

from __future__ import annotations

import io
import textwrap
from collections.abc import Iterator
from importlib import metadata
from itertools import zip_longest
from typing import Any

import matplotlib
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure

from gearchaos import plot
from gearchaos.datasheet.assessment import Section, keep_out, scope, sentence
from gearchaos.datasheet.report import Report, differing_inputs

_PAPER = (8.27, 11.69)  # A4, in inches
_WIDTH, _LINES = 100, 84  # characters of a line and lines of a page of text
_LINE = 0.0165  # height of a line on the first page, over that of the page
_FEW_RANGES = 3  # to keep out of, that the first page names beside another report
# widths of columns by their number: usable ranges, differing inputs, ranges to avoid
_COLUMNS = {2: (15, 100), 3: (40, 40, 40), 10: (8, 8, 20, 11, 9, 8, 8, 13, 15, 15)}


def report_pdf(report: Report, against: Report | None = None) -> bytes:
    """The report as a PDF of A4 pages; with another one, both on the first page."""
    reports = [report] if against is None else [report, against]
    content = io.BytesIO()
    style: Any = {"pdf.fonttype": 42, "font.size": 9}
    with matplotlib.rc_context(style), PdfPages(content, metadata={"CreationDate": None}) as pages:
        page, share = Figure(figsize=_PAPER), 0.92 / len(reports)
        for number, each in enumerate(reports):
            top = 0.96 - number * share
            page.text(0.08, top, each.title, fontsize=14, va="top", parse_math=False)
            above = [line for words in each.answer for line in textwrap.wrap(sentence(words), 95)]
            ranges = keep_out(each.found) if against is None else keep_out(each.found, _FEW_RANGES)
            above += _part(Section("Keep out of", items=ranges), 95) if ranges else []
            below = [sentence(each.as_given)] if against else [  # beside another report there is room for a line
                line for section in each.changes for line in _part(section)]
            page.text(0.08, top - 0.03, "\n".join(above), fontsize=9.5, va="top", linespacing=1.4, parse_math=False)
            text_end, under = top - 0.03 - _LINE * len(above), top - share + _LINE * len(below) + 0.01
            plot.assessment(each.found, page.add_axes((0.14, under + 0.06, 0.78, text_end - under - 0.12)))
            page.text(0.08, under, "\n".join(below), fontsize=8.5, va="top", linespacing=1.4, parse_math=False)
        pages.savefig(page)
        lines = [line for each in reports for line in _lines(each)]
        if against is not None:
            lines[:0] = [*_part(differing_inputs(report.found.gears, against.found.gears)), ""]
        lines.append(f"Computed by gearchaos {metadata.version('gearchaos')}.")
        for first in range(0, len(lines), _LINES):
            page = Figure(figsize=_PAPER)
            page.text(0.08, 0.95, "\n".join(lines[first : first + _LINES]), family="monospace", fontsize=7, va="top",
                      linespacing=1.35, parse_math=False)
            pages.savefig(page)
    return content.getvalue()


def _lines(report: Report) -> Iterator[str]:
    """The evidence as lines of text."""
    yield f"{report.title}: {scope(report.found)}"
    for section in report.evidence:
        yield from _part(section)
    yield ""


def _part(section: Section, width: int = _WIDTH) -> Iterator[str]:
    """A part of a report as lines of text, a blank one first."""
    yield from ("", section.heading)
    for row in section.table:
        columns = _COLUMNS[len(row)]
        cells = [textwrap.wrap(value, width - 1) for value, width in zip(row, columns, strict=True)]
        for line in zip_longest(*cells, fillvalue=""):
            yield "".join(f"{value:<{width}}" for value, width in zip(line, columns, strict=True))
    values = (f"{name}: {value}" for name, value in section.values)
    for text in (*map(sentence, section.words), *section.items, *values):
        yield from textwrap.wrap(text, width, subsequent_indent="   ")
