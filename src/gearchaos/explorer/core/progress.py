"""How far a study is whose length is not known to its job: it runs in a thread that reports."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor, wait
from contextvars import copy_context
from typing import Any, NamedTuple, TypeVar

from gearchaos.execute.progress import on_progress, told_end
from gearchaos.studies.core.cost import duration

_INTERVAL = 0.3  # seconds between two reports of progress
_TOLD = 0.03  # share of the work from which it tells how long the rest takes

_T = TypeVar("_T")


class Progress(NamedTuple):
    """The share of a work that is done, and the seconds that are left; NaN before they are known."""

    share: float
    left: float = math.nan

    @property
    def words(self) -> str:
        left = "" if math.isnan(self.left) else f", about {duration(self.left)} left"
        return f"{100 * self.share:.0f} %{left}"


class Part(NamedTuple):
    """A result that lacks something which is computed next, in words."""

    found: Any
    lacks: str


def with_progress(study: Callable[[], _T], number: int = 0, count: int = 1) -> Generator[Progress, None, _T]:
    """Call a study that shows progress bars; yields, again and again, how far the present bar is.

    Returns what the study returns. It is cancelled as the job is. Of ``count`` studies that take as long it is the one
    with a ``number``, and the progress that of all.
    """
    shares, begun = [0.0], time.monotonic()
    context = copy_context()  # where a request to cancel is seen
    context.run(on_progress.set, shares.append)
    with ThreadPoolExecutor(1) as pool:
        future = pool.submit(context.run, study)
        while not wait([future], _INTERVAL).done:
            now, share, told = time.monotonic(), shares[-1], context.get(told_end)
            left = math.nan if share < _TOLD else (now - begun) * (1 - share) / share
            if told is not None and told > now:
                left = told - now
            if count > 1:
                left += (count - 1 - number) * (left + now - begun)
            yield Progress((number + share) / count, left)
        return future.result()
