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
    """The computation was cancelled through `cancel_event`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> import threading
    >>> from gearchaos.flow import StoppedError, cancel_event
    >>> event = threading.Event()
    >>> token = cancel_event.set(event)
    >>> event.set()
    >>> try:
    ...     gc.simulate(gc.MeshModel.of(q0=0.1), periods=100)
    ... except StoppedError:
    ...     print("stopped")
    stopped
    >>> cancel_event.reset(token)
    """


def raise_if_cancelled() -> None:
    """Raise `StoppedError` if the event of the current context is set."""
    event = cancel_event.get()
    if event is not None and event.is_set():
        raise StoppedError
