"""How far a study is whose length is not known to its job: it runs in a thread that reports."""

from __future__ import annotations

from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor, wait
from contextvars import copy_context
from typing import TypeVar

from gearchaos.execute.progress import on_progress

_INTERVAL = 0.3  # seconds between two reports of progress

_T = TypeVar("_T")


def with_progress(study: Callable[[], _T]) -> Generator[float, None, _T]:
    """Call a study that shows progress bars; yields, again and again, the share of the present bar that is done.

    Returns what the study returns. It is cancelled as the job is.
    """
    shares = [0.0]
    context = copy_context()  # where a request to cancel is seen
    context.run(on_progress.set, shares.append)
    with ThreadPoolExecutor(1) as pool:
        future = pool.submit(context.run, study)
        while not wait([future], _INTERVAL).done:
            yield shares[-1]
        return future.result()
