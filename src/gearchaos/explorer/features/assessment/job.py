"""The assessment that a page shows: which speeds the gears at its point are to avoid."""

from __future__ import annotations

from collections.abc import Generator
from functools import partial

from gearchaos.explorer.core.progress import Part, Progress, with_progress
from gearchaos.explorer.core.state import CHANGES
from gearchaos.explorer.features.assessment.speed_line import SpeedLine
from gearchaos.studies.speeds.assess import Assessment, assess


def assessed(line: SpeedLine) -> Generator[Progress | Part | Assessment]:
    """How far it is, again and again, what is to be avoided in operation, then the assessment over a line of speeds.

    It is that of `gearchaos.assess` with its own settings, after the load change that the view names.
    """
    whole, gears, change = assessment_of(line), line.view.operating_point, line.view.change
    if change != "none":
        operation = partial(whole, gears, load_change=None, wide=False, knocks=False)
        words = f"motions {'from' if change == 'wide' else 'after'} {CHANGES[change][0]}"
        yield Part((yield from with_progress(operation)), words)
    yield (yield from with_progress(partial(whole, gears)))


def assessment_of(line: SpeedLine) -> partial[Assessment]:
    """`assess` over a line of speeds, at its torque, with what its view looks at beside operation."""
    (start, stop), change = line.speeds, line.view.change
    return partial(assess, speed=f"{start!r}:{stop!r}", torque=None, load_change=CHANGES[change][1],
                   wide=change == "wide", progress=True)
