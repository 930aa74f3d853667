"""A design with one input changed at a time, each assessed as the design itself."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import replace
from functools import partial
from typing import Any

from gearchaos.datasheet.report import Report
from gearchaos.explorer.core.progress import Part, Progress, with_progress
from gearchaos.explorer.features.assessment.job import assessment_of
from gearchaos.explorer.features.assessment.speed_line import SpeedLine
from gearchaos.studies.speeds.changed_designs import assess_changes, improvements


def changed_designs(line: SpeedLine) -> Generator[Progress | Part | Report]:
    """How far it is, again and again, and after each change what is known; in the end the report with all changes.

    They are those of ``gearchaos assess --improve``, over a line of speeds.
    """
    design: Any = line.view.gears
    changes = list(improvements(design))
    count, assessed = len(changes) + 1, assessment_of(line)
    report = Report((yield from with_progress(partial(assessed, design), 0, count)), improvements=[])
    for number, change in enumerate(changes, 1):
        yield Part(report, f"{count - number} of {len(changes)} changes")
        one = partial(next, assess_changes(design, [change], **assessed.keywords))
        found = yield from with_progress(one, number, count)
        report = replace(report, improvements=[*(report.improvements or ()), found])
    yield report
