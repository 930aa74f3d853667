"""The assessment that a page shows: which speeds the gears at its point are to avoid."""

from __future__ import annotations

from collections.abc import Generator
from functools import partial

from gearchaos.explorer.core.progress import with_progress
from gearchaos.explorer.core.state import CHANGES
from gearchaos.explorer.features.assessment.speed_line import SpeedLine
from gearchaos.studies.speeds.assess import Assessment, assess


def assessed(line: SpeedLine) -> Generator[float | Assessment]:
    """The share of the present motions from random states, again and again, then the assessment over a line of speeds.

    It is that of `gearchaos.assess` with its own settings, after the load change that the view names.
    """
    (start, stop), change = line.speeds, line.view.change
    found = yield from with_progress(partial(
        assess, line.view.operating_point, f"{start!r}:{stop!r}", load_change=CHANGES[change][1], wide=change == "wide",
        progress=True))
    yield found
