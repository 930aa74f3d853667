"""Ctrl-C and SIGTERM in a command's own process: one message, an exit code, and the end within a second.

A signal raises KeyboardInterrupt in the main thread, so that what is under way is undone. A thread ends the process
where that takes too long: while a kernel is compiled, or the threads of a pool are waited for.
"""

from __future__ import annotations

import os
import signal
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from threading import Event, Thread
from typing import Any

from gearchaos.cli.errors import Terminated, say, say_interrupted

_patience: float | None = 0.7
"""Seconds after a signal until the process is ended by force, which a second signal does at once."""

_stopping = Event()


def finish_what_is_under_way() -> None:
    """Let what the main thread waits for come to its end after a signal, such as the tiles of a run and its lock."""
    global _patience
    _patience = None


@contextmanager
def ended_by_signals() -> Iterator[None]:
    """In the context a signal ends the process. Ctrl-C does nothing where it is ignored, as in a background job."""
    reading, writing = socket.socketpair()
    writing.setblocking(False)
    signal.set_wakeup_fd(writing.detach(), warn_on_full_buffer=False)  # open to the end of the process
    signal.signal(signal.SIGTERM, _interrupt)
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, _interrupt)
    # where Python cannot raise an exception, as in callbacks of the garbage collector, it prints it
    sys.unraisablehook = lambda lost: None if _stopping.is_set() else sys.__unraisablehook__(lost)
    # the semaphores of a pool of processes are removed by a process of `multiprocessing`, which warns of each
    sys.warnoptions.append("ignore::UserWarning:multiprocessing.resource_tracker")
    Thread(target=_watch, args=(reading,), daemon=True).start()
    try:
        yield
    except SystemExit as ended:
        if _stopping.is_set():  # otherwise threads that still compute would be waited for
            _exit(ended.code)
        raise
    except KeyboardInterrupt as interrupt:  # before a command begins, or after it
        _exit(say_interrupted(isinstance(interrupt, Terminated)))


def _interrupt(number: int, _: Any) -> None:
    """Raise KeyboardInterrupt for the first signal; called by Python in the main thread."""
    if not _stopping.is_set():
        _stopping.set()
        raise KeyboardInterrupt if number == signal.SIGINT else Terminated


def _watch(signals: socket.socket) -> None:
    """End the process a time after the first signal, or at once after the second one."""
    number = signals.recv(1)[0]
    if _patience is None:
        say("waiting for what is under way; the same again ends at once")
    signals.settimeout(_patience)
    with suppress(TimeoutError):
        signals.recv(1)
    if sys.stderr is not None and sys.stderr.isatty():
        sys.stderr.write("\x1b[?25h\n")  # a progress bar has hidden the cursor
    _exit(say_interrupted(number == signal.SIGTERM))


def _exit(code: Any) -> None:
    """End the process without waiting for its threads."""
    for stream in filter(None, (sys.stdout, sys.stderr)):
        with suppress(OSError):
            stream.flush()
    os._exit(code)
