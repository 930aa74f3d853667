"""Computing beside the event loop: one thread, the newest request of every panel, sessions in turn.

A job is a generator: the thread takes one step of it, in a process of its own, hands the result back, and looks again
whose turn it is. So a newer request takes the place of an older one between two steps, and no visitor waits for
another's whole map.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import Any

from gearchaos.errors import InputError
from gearchaos.explorer.bounds import SORRY
from gearchaos.explorer.elsewhere import Elsewhere, Steps, Work
from gearchaos.flow import StoppedError

log = logging.getLogger(__name__)


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
    compiling : callable
        Called when a step, taken in another process, has kernels to compile first.
    """

    steps: Steps
    show: Callable[[Any], None]
    end: Callable[[str | None], None]
    delay: float = 0.0
    compiling: Callable[[], None] = lambda: None
    due: float = field(default=0.0, init=False)
    begun: Generator[Any] | Work | None = field(default=None, init=False)


class Worker:
    """A thread that takes jobs step by step.

    Parameters
    ----------
    name : str
        Of the thread.
    place : Elsewhere, optional
        The process in which steps are taken; by default they are taken by the thread itself.
    """

    def __init__(self, name: str, place: Elsewhere | None = None) -> None:
        self._place, self._over = place, False
        self._jobs: OrderedDict[str, OrderedDict[str, Job]] = OrderedDict()
        self._change = threading.Condition()
        self._left: list[Generator[Any] | Work] = []
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

    def stop(self) -> None:
        """Take no step any more, and end the process."""
        with self._change:
            self._over = True
            self._change.notify_all()
        if self._place is not None:
            self._place.end()

    def _leave(self, job: Job | None) -> None:
        """Keep what a job has begun until the thread can close it: threads of its own may have to end first."""
        if job is not None and job.begun is not None:
            if isinstance(job.begun, Work):
                job.begun.leave()
            self._left.append(job.begun)

    def _run(self) -> None:
        while not self._over:
            found = self._next()
            self._close_left()
            if found is not None:
                self._step(*found)

    def _close_left(self) -> None:
        while self._left:
            self._tell(lambda left: left.close(), self._left.pop())

    def _next(self) -> tuple[str, str, Job] | None:
        """The job whose turn it is; whoever is served goes to the end of the line. None if others are to be closed."""
        with self._change:
            while (found := self._ready()) is None:
                if self._left or self._over:
                    return None
                self._change.wait(self._until_due())
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

    def _begun(self, job: Job) -> Generator[Any] | Work:
        return job.steps() if self._place is None else self._place.run(job.steps, job.compiling)

    def _step(self, owner: str, panel: str, job: Job) -> None:
        """One step of a job; a result that a newer request has overtaken is not shown."""
        if not self._current(owner, panel, job):
            return
        message, over = None, False
        try:
            job.begun = job.begun or self._begun(job)
            result = next(job.begun)
        except StopIteration:
            over = True
        except StoppedError:
            over = True
        except InputError as error:
            message, over = str(error), True
        except Exception:
            if self._over:
                return
            log.exception("a request could not be answered")
            message, over = SORRY, True
        if not self._current(owner, panel, job):
            self._leave(job)
        elif over:
            self.drop(owner, panel)
            self._tell(job.end, message)
        else:
            self._tell(job.show, result)

    def _tell(self, whom: Callable[[Any], None], what: Any) -> None:
        """Hand something on; whatever goes wrong there does not end this thread."""
        try:
            whom(what)
        except Exception:
            if not self._over:
                log.exception("a result could not be handed on")
