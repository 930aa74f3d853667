"""The assessment that a page shows: which speeds the gears at its point are to avoid."""

from __future__ import annotations

from collections.abc import Generator
from functools import partial

from gearchaos.explorer.jobs.progress import with_progress
from gearchaos.explorer.view.speed_line import SpeedLine
from gearchaos.studies.assess import Assessment, assess


def assessed(line: SpeedLine) -> Generator[float | Assessment]:
    """The share of the present motions from random states, again and again, then the assessment over a line of speeds.

    It is that of `gearchaos.assess` with its own settings.
    """
    start, stop = line.speeds
    found = yield from with_progress(partial(assess, line.view.operating_point, f"{start!r}:{stop!r}", progress=True))
    yield found
