"""Cancelling a long computation from another thread."""

from __future__ import annotations

import threading
from contextvars import ContextVar

cancel_event: ContextVar[threading.Event | None] = ContextVar("cancel_event", default=None)
"""The event that cancels computations of the flow in the current context.

Set the variable in the context in which the computation runs. The computation raises `StoppedError` some hundredths of
a second after the event is set. If the variable is None, it cannot be cancelled.
"""


class StoppedError(Exception):
    """The computation was cancelled."""


def raise_if_cancelled() -> None:
    """Raise `StoppedError` if the event of the current context is set."""
    event = cancel_event.get()
    if event is not None and event.is_set():
        raise StoppedError
