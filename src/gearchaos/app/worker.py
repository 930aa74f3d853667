"""Computing beside the event loop: one thread, the newest request of every panel, sessions in turn.

A job is an iterator: the thread takes one step of it, hands the result back, and looks again whose turn it is. So a
newer request takes the place of an older one between two steps, and no visitor waits for another's whole map.
"""

from __future__ import annotations

import contextlib
import logging
import os
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import Any

from gearchaos.errors import InputError

_PATIENCE = 0.5
"""So many seconds slow work waits for quick work before it takes its next step all the same."""

_SORRY = "something went wrong here; the server's log says what"

_POLITE = 10

log = logging.getLogger(__name__)


_ending = threading.Event()


def end() -> None:
    """Say that the process ends: work that breaks off now is no error."""
    _ending.set()


def _give_way() -> None:
    """Let other threads have the processor first, where the system has priorities for threads (Linux).

    Threads begun by this one take after it.
    """
    if hasattr(os, "setpriority") and os.path.isdir("/proc/self/task"):
        with contextlib.suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), _POLITE)


@dataclass
class Job:
    """What one panel asked for.

    Attributes
    ----------
    steps : callable
        Begins the work: an iterator of results.
    show : callable
        Takes a result; called in the worker's thread.
    end : callable
        Called once after the last result, with None or the message of what went wrong; not called for a job that a
        newer one replaced.
    delay : float
        Seconds to wait before the first step, since another request may follow at once.
    """

    steps: Callable[[], Generator[Any]]
    show: Callable[[Any], None]
    end: Callable[[str | None], None]
    delay: float = 0.0
    due: float = field(default=0.0, init=False)
    begun: Generator[Any] | None = field(default=None, init=False)


class Worker:
    """A thread that takes jobs step by step.

    Parameters
    ----------
    name : str
        Of the thread.
    after : Worker, optional
        One whose work goes first.
    """

    def __init__(self, name: str, after: Worker | None = None) -> None:
        self._after = after
        self._jobs: OrderedDict[str, OrderedDict[str, Job]] = OrderedDict()
        self._change = threading.Condition()
        self._working = False
        self._left: list[Generator[Any]] = []
        threading.Thread(target=self._run, name=name, daemon=True).start()

    def submit(self, owner: str, panel: str, job: Job) -> None:
        """Take on a job for a panel of a session; an older one of the same panel is dropped."""
        job.due = time.monotonic() + job.delay
        with self._change:
            panels = self._jobs.setdefault(owner, OrderedDict())
            self._leave(panels.get(panel))
            panels[panel] = job
            self._change.notify_all()

    def drop(self, owner: str, panel: str | None = None) -> None:
        """Forget a panel's job, or all of a session."""
        with self._change:
            if panel is None:
                for job in self._jobs.pop(owner, OrderedDict()).values():
                    self._leave(job)
            else:
                self._leave(self._jobs.get(owner, OrderedDict()).pop(panel, None))
            self._change.notify_all()

    def _leave(self, job: Job | None) -> None:
        """Keep what a job has begun until the thread can close it: threads of its own may have to end first."""
        if job is not None and job.begun is not None:
            self._left.append(job.begun)

    def wait_idle(self, seconds: float) -> None:
        """Return once there is nothing to do, or after so many seconds."""
        with self._change:
            self._change.wait_for(lambda: not self._working and not any(self._jobs.values()), seconds)

    def _run(self) -> None:
        if self._after is not None:
            _give_way()
        while True:
            found = self._next()
            self._close_left()
            if found is None:
                continue
            self.give_way()
            self._step(*found)
            with self._change:
                self._working = False
                self._change.notify_all()

    def give_way(self) -> None:
        """Wait a little for work that goes first, if there is any."""
        if self._after is not None:
            self._after.wait_idle(_PATIENCE)

    def _close_left(self) -> None:
        while self._left:
            self._left.pop().close()

    def _next(self) -> tuple[str, str, Job] | None:
        """The job whose turn it is; whoever is served goes to the end of the line. None if others are to be closed."""
        with self._change:
            while (found := self._ready()) is None:
                if self._left:
                    return None
                self._change.wait(self._until_due())
            self._working = True
            owner, panel, job = found
            self._jobs.move_to_end(owner)
            self._jobs[owner].move_to_end(panel)
            return owner, panel, job

    def _ready(self) -> tuple[str, str, Job] | None:
        now = time.monotonic()
        for owner, panels in self._jobs.items():
            for panel, job in panels.items():
                if job.due <= now:
                    return owner, panel, job
        return None

    def _until_due(self) -> float | None:
        due = [job.due for panels in self._jobs.values() for job in panels.values()]
        return max(0.0, min(due) - time.monotonic()) if due else None

    def _current(self, owner: str, panel: str, job: Job) -> bool:
        with self._change:
            return owner in self._jobs and self._jobs[owner].get(panel) is job

    def _step(self, owner: str, panel: str, job: Job) -> None:
        """One step of a job; a result that a newer request has overtaken is not shown."""
        if not self._current(owner, panel, job):
            return
        message, over = None, False
        try:
            job.begun = job.begun or job.steps()
            result = next(job.begun)
        except StopIteration:
            over = True
        except InputError as error:
            message, over = str(error), True
        except Exception:
            if _ending.is_set():  # nothing can be computed any more
                return
            log.exception("a request could not be answered")
            message, over = _SORRY, True
        if self._current(owner, panel, job):
            if over:
                self.drop(owner, panel)
                job.end(message)
            else:
                job.show(result)
