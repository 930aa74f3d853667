"""A thread that computes for all pages, one step of one job at a time, in turn.

A job is a generator. The thread takes one step of it in a worker process, delivers the result, and then chooses the
next job. So a new request for a task replaces an older one between two steps, and no page waits for the whole map of
another.
"""

from __future__ import annotations

import logging
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Generator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from gearchaos.errors import InputError
from gearchaos.explorer.jobs.worker_process import GeneratorFunction, RemoteGenerator, WorkerProcess
from gearchaos.flow import StoppedError

INTERNAL_ERROR = "something went wrong here; the server's log says what"
"""Message on the page about an error in this program."""

log = logging.getLogger(__name__)


@dataclass
class Job:
    """The computation of one task of a page: "map", "diagram", "final verdict" and so on.

    Attributes
    ----------
    function : callable
        Returns the generator of results.
    show : callable
        Called with each result, in the worker's thread.
    end : callable
        Called once after the last result, with None or an error message; not called for a job that was replaced.
    delay : float
        Seconds to wait before the first step, in case another request replaces this one.
    compiling : callable
        Called when a step in another process has to compile kernels first.
    """

    function: GeneratorFunction
    show: Callable[[Any], None]
    end: Callable[[str | None], None]
    delay: float = 0.0
    compiling: Callable[[], None] = lambda: None
    due: float = field(default=0.0, init=False)
    running: Generator[Any] | RemoteGenerator | None = field(default=None, init=False)


class Workers(NamedTuple):
    """The workers that compute for all pages."""

    quick: Worker  # the motion at the point, and files
    slow: Worker  # the map, the diagram, basins
    branches: Worker  # branches of motions; each is one step
    curves: Worker  # bifurcation curves, which may take many seconds for a step


class Worker:
    """A thread that runs jobs step by step.

    Parameters
    ----------
    name : str
        Of the thread.
    process : WorkerProcess, optional
        Where steps are computed; by default in the thread itself.
    """

    def __init__(self, name: str, process: WorkerProcess | None = None) -> None:
        self._process, self._stopped = process, False
        self._jobs: OrderedDict[str, OrderedDict[str, Job]] = OrderedDict()
        self._change = threading.Condition()
        self._cancelled: list[Generator[Any] | RemoteGenerator] = []
        threading.Thread(target=self._run, name=name, daemon=True).start()

    def submit(self, owner: str, task: str, job: Job) -> None:
        """Add a job for a task of a page (``owner``); an older job for the same task is cancelled."""
        job.due = time.monotonic() + job.delay
        with self._change:
            tasks = self._jobs.setdefault(owner, OrderedDict())
            self._cancel_job(tasks.get(task))
            tasks[task] = job
            self._change.notify_all()

    def cancel(self, owner: str, task: str | None = None) -> None:
        """Cancel the job of a task, or all jobs of a page."""
        with self._change:
            if task is None:
                for job in self._jobs.pop(owner, OrderedDict()).values():
                    self._cancel_job(job)
            else:
                self._cancel_job(self._jobs.get(owner, OrderedDict()).pop(task, None))
            self._change.notify_all()

    def stop(self) -> None:
        """Take no further step, and end the process."""
        with self._change:
            self._stopped = True
            self._change.notify_all()
        if self._process is not None:
            self._process.end()

    def _cancel_job(self, job: Job | None) -> None:
        """Ask the running step to stop; the generator is closed later by the worker's thread, as it must be."""
        if job is not None and job.running is not None:
            if isinstance(job.running, RemoteGenerator):
                job.running.cancel()
            self._cancelled.append(job.running)

    def _run(self) -> None:
        while not self._stopped:
            found = self._next()
            while self._cancelled:
                self._call(lambda running: running.close(), self._cancelled.pop())
            if found is not None:
                self._step(*found)

    def _next(self) -> tuple[str, str, Job] | None:
        """The job whose turn it is; its page and task go to the end of the queue.

        None if there are cancelled generators to close, or if the worker was stopped.
        """
        with self._change:
            while True:
                now = time.monotonic()
                waiting = [(o, t, job) for o, tasks in self._jobs.items() for t, job in tasks.items()]
                found = next((each for each in waiting if each[2].due <= now), None)
                if found is not None:
                    break
                if self._cancelled or self._stopped:
                    return None
                self._change.wait(max(0.0, min(job.due for *_, job in waiting) - now) if waiting else None)
            owner, task, job = found
            self._jobs.move_to_end(owner)
            self._jobs[owner].move_to_end(task)
            return owner, task, job

    def _is_current(self, owner: str, task: str, job: Job) -> bool:
        """Whether a job was neither cancelled nor replaced."""
        with self._change:
            return owner in self._jobs and self._jobs[owner].get(task) is job

    def _step(self, owner: str, task: str, job: Job) -> None:
        """Take one step of a job; its result is dropped if the job was cancelled meanwhile."""
        if not self._is_current(owner, task, job):
            return
        message, over, result = None, False, None
        try:
            if job.running is None:
                process = self._process
                job.running = job.function() if process is None else process.run(job.function, job.compiling)
            result = next(job.running)
        except (StopIteration, StoppedError):
            over = True
        except InputError as error:
            message, over = str(error), True
        except Exception:
            if self._stopped:
                return
            log.exception("a request could not be answered")
            message, over = INTERNAL_ERROR, True
        if not self._is_current(owner, task, job):
            self._cancel_job(job)
        elif over:
            self.cancel(owner, task)
            self._call(job.end, message)
        else:
            self._call(job.show, result)

    def _call(self, function: Callable[[Any], None], argument: Any) -> None:
        """Call a function; an error in it is logged and does not end this thread."""
        try:
            function(argument)
        except Exception:
            if not self._stopped:
                log.exception("a result could not be delivered")
