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
from gearchaos.datasheet.report import Report, changed_in_words, differing_inputs, inputs_of, usable_share
from gearchaos.datasheet.verdict import (
    at_no_speed,
    beyond_in_words,
    decision,
    headings,
    jumps,
    keep_out,
    knocks_in_words,
    rows,
    scanned,
    torques_in_words,
    usable_in_words,
    worst,
)

_PAPER = (8.27, 11.69)  # A4, in inches
_WIDTH, _LINES = 100, 84  # characters of a line and lines of a page of text
_LINE = 0.0165  # height of a line on the first page, over that of the page
_FEW_RANGES = 3  # to keep out of, that the first page names beside another report
_COLUMNS = (8, 8, 20, 11, 9, 8, 8, 13, 15, 15)  # widths of a table of ranges to avoid


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
            above, below = list(_above(each, len(reports) == 1)), list(_below(each, len(reports) == 1))
            page.text(0.08, top - 0.03, "\n".join(above), fontsize=9.5, va="top", linespacing=1.4, parse_math=False)
            text_end, under = top - 0.03 - _LINE * len(above), top - share + _LINE * len(below) + 0.01
            plot.assessment(each.found, page.add_axes((0.14, under + 0.06, 0.78, text_end - under - 0.12)))
            page.text(0.08, under, "\n".join(below), fontsize=8.5, va="top", linespacing=1.4, parse_math=False)
        pages.savefig(page)
        lines = [line for each in reports for line in _lines(each)]
        if against is not None:
            lines[:0] = ["What differs in the inputs", *(line for name, *values in differing_inputs(
                report.found.gears, against.found.gears) for line in _wrapped(f"{name}: {' / '.join(values)}")), ""]
        lines.append(f"Computed by gearchaos {metadata.version('gearchaos')}.")
        for first in range(0, len(lines), _LINES):
            page = Figure(figsize=_PAPER)
            page.text(0.08, 0.95, "\n".join(lines[first : first + _LINES]), family="monospace", fontsize=7, va="top",
                      linespacing=1.35, parse_math=False)
            pages.savefig(page)
    return content.getvalue()


def _above(report: Report, alone: bool) -> Iterator[str]:
    """What the first page says above the picture: beside another report fewer ranges."""
    found = report.found
    for text in (*decision(found), worst(found), f"tried: {found.tried}"):
        yield from textwrap.wrap(f"{text[0].upper()}{text[1:]}.", 95)
    if found.avoid:
        yield from ("", "Keep out of")
    for text in keep_out(found, *[] if alone else [_FEW_RANGES]):
        yield from textwrap.wrap(text, 95, initial_indent="   ", subsequent_indent="      ")


def _below(report: Report, alone: bool) -> Iterator[str]:
    """What the first page says below the picture: beside another report there is room for a line."""
    yield f"As given: {usable_share(report.found)}."
    if not alone:
        return
    yield "Inputs that matter most"
    if report.sensitivity is None:
        yield "Not computed: the command does so with --sensitivity."
    elif not report.matters_most:
        yield f"None of the {len(report.sensitivity)} changes alters it by more than the search leaves open."
    for each in report.matters_most:
        yield from textwrap.wrap(changed_in_words(each, report.found), 100, subsequent_indent="   ")
    if report.improvements is not None:
        yield from ("", "What to change")
        for each in report.helps_most:
            yield from textwrap.wrap(changed_in_words(each, report.found), 100, subsequent_indent="   ")
        if not report.helps_most:
            yield f"None of the {len(report.improvements)} changes that were tried widens the usable speeds."


def _lines(report: Report) -> Iterator[str]:
    """The evidence as lines of text."""
    found = report.found
    yield f"{report.title}: {scanned(found)} at {torques_in_words(found)}"
    for at in found.at:
        yield from ("", f"To avoid at {at.torque:.6g} N m{f' ({at_no_speed(at)})' if at_no_speed(at) else ''}")
        for row in [headings(at), *rows(at, found.gears)] if at.windows else []:
            cells = [textwrap.wrap(value, width - 1) for value, width in zip(row, _COLUMNS, strict=True)]
            for line in zip_longest(*cells, fillvalue=""):
                yield "".join(f"{value:<{width}}" for value, width in zip(line, _COLUMNS, strict=True))
        if not at.windows:
            yield "Nothing to avoid was found."
        for text in (*filter(None, [beyond_in_words(at)]), *knocks_in_words(at)):
            yield from _wrapped(text)
        yield from _wrapped(f"Usable: {', '.join(usable_in_words(at.usable, found.speeds)) or 'nothing'}")
        yield from _wrapped(f"Tried: {at.tried}")
    sections = {
        "Jumps of a slow run-up and run-down": jumps(found) or ["none were found"],
        "Assumed inputs varied one at a time": [changed_in_words(e, found) for e in report.sensitivity or ()],
        "Changes of the design that were tried": [changed_in_words(e, found) for e in report.improvements or ()],
        "Inputs": [f"{name}: {value}" for name, value in inputs_of(found.gears).items()],
        "Assumptions": found.assumptions}
    for heading, texts in sections.items():
        if texts:
            yield from ("", heading)
            for text in texts:
                yield from _wrapped(text)
    yield ""


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(text, _WIDTH, subsequent_indent="   ")
