"""A way out of a long computation, for when nobody waits for it any more."""

from __future__ import annotations

import threading
from contextvars import ContextVar

asked: ContextVar[threading.Event | None] = ContextVar("asked", default=None)
"""Set where the computation runs, it stops within some hundredths of a second once the event is set."""


class StoppedError(Exception):
    """The computation was asked to stop."""


def check() -> None:
    """Raise if the computation is to stop."""
    event = asked.get()
    if event is not None and event.is_set():
        raise StoppedError
