"""Processes that this one starts, which never outlive it, however it ends."""

from __future__ import annotations

import os
import signal
import sys
import time
from multiprocessing import parent_process
from threading import Thread

_INTERVAL = 0.2
"""Seconds between two looks at the parent process; it is to be noticed within a second that it has ended."""


def python_command(statement: str) -> list[str]:
    """The command of a Python process that runs a statement, and ends as soon as this process does.

    It watches from its first moment on, before it imports what the statement needs. Where the system does not say that
    a parent has ended, as Windows, it goes on.
    """
    watch = f"from gearchaos.processes import end_with_parent; end_with_parent({os.getpid()})"
    return [sys.executable, "-P", "-c", f"{watch}; {statement}"]


def end_with_parent(parent: int | None = None) -> None:
    """End this process, whatever it does, as soon as its parent has ended, to whom Ctrl-C is left.

    Parameters
    ----------
    parent : int, optional
        The number of the parent process; if left out, that which `multiprocessing` knows, which need not have started
        this one itself.
    """

    def watch() -> None:
        if parent is not None:
            while os.getppid() == parent:
                time.sleep(_INTERVAL)
        elif (known := parent_process()) is not None:
            known.join()
        os._exit(1)

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=watch, daemon=True).start()
