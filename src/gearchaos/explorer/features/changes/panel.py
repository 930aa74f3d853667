"""Changed designs in words, and the drawings with these changes."""

from __future__ import annotations

from typing import NamedTuple

from gearchaos.datasheet import assessment as in_words
from gearchaos.datasheet.report import Report, changed_in_words
from gearchaos.explorer.core.drawing import Drawing
from gearchaos.explorer.core.opened import address_of
from gearchaos.studies.speeds.changed_designs import improvements


class ChangesText(NamedTuple):
    """What stands on changed designs: sentences, and each change in words with the address of a page that has it."""

    sentences: list[str]
    rows: list[tuple[str, str]]


def changes_text(report: Report, drawing: Drawing | None) -> ChangesText:
    """Which changes widen the usable speeds, then all that were tried; with a drawing they can be taken."""
    best = report.helps_most
    tried = len(report.improvements or ())
    words = "with one input changed:" if best else f"none of the {tried} changes tried widens the usable speeds"
    sentences = [in_words.sentence(each) for each in (report.as_given, *([words] if tried else []))]
    fields = {(each.name, each.value): each.fields for each in improvements(report.found.gears)}
    ordered = [*best, *(each for each in report.improvements or () if each not in best)]
    return ChangesText(sentences, [(
        in_words.sentence(changed_in_words(each, report.found)),
        "" if drawing is None or each.assessment is None else
        address_of(drawing.changed(fields[each.name, each.value]), drawing)) for each in ordered])
