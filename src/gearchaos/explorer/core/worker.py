"""Who computes for all pages: a thread that takes one step of one job at a time, and the process that it asks.

A job is a generator. The thread has one step of it taken in its process, so that the thread that serves pages is never
blocked, delivers the result, and then chooses the next job. So a new request for a task replaces an older one between
two steps, and no page waits for the whole map of another.

The server uses a `WorkerProcess`; `main` runs in the process. The two exchange pickles over pipes.

======================================== ======================================================================
request ``(action, number, function)``   answer
======================================== ======================================================================
``next``, first with the function        ``(result,)``, None after the last result, or an exception
``urgent``, with the function            the same; the step has full priority in a process of low priority
``close``                                None; the generator is closed
``cancel``                               none; a step under way raises `StoppedError`
======================================== ======================================================================

Before its answer the process sends `COMPILING` if the step has to compile kernels.
"""

from __future__ import annotations

import contextlib
import logging
import os
import pickle
import queue
import subprocess
import sys
import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Generator
from concurrent.futures import ThreadPoolExecutor
from contextvars import Context, copy_context
from dataclasses import dataclass, field
from functools import partial
from itertools import count
from typing import Any, BinaryIO, NamedTuple

from gearchaos.errors import InputError
from gearchaos.execute.machine import cores
from gearchaos.flow import StoppedError, cancel_event, compile_beside, on_compile
from gearchaos.processes import python_command

INTERNAL_ERROR = "something went wrong here; the server's log says what"
"""Message on the page about an error in this program."""

COMPILING = "compiling"  # message that kernels are being compiled, which takes about half a minute
_NICENESS = 15  # niceness of a process of low priority on Unix

_LOW_PRIORITY = getattr(subprocess, "BELOW_NORMAL_PRIORITY_CLASS", 0)
"""Flag of a process of low priority on Windows, where there is no niceness; 0 elsewhere."""

_MALLOC = {"MALLOC_MMAP_THRESHOLD_": "1048576", "MALLOC_TRIM_THRESHOLD_": "1048576"}
"""Environment of the process that computes maps: glibc then returns the memory of large arrays to the system at once.

By default it keeps more and more of it. Maps take 3 % longer with these settings.
"""

GeneratorFunction = Callable[[], Generator[Any]]
"""A function that returns a generator of results; it must be picklable, since it is called in the process."""

log = logging.getLogger(__name__)


@dataclass
class Job:
    """The computation of one task of a page: "map", "diagram", "final verdict" and so on.

    ``show`` is called with each result and ``end`` once after the last, with None or an error message, but not for a
    job that was replaced; ``compiling`` when a step in the process has to compile kernels first. All three are called
    in the worker's thread. ``delay`` is in seconds, in case another request replaces this one. The first step of an
    ``urgent`` job has full priority.
    """

    function: GeneratorFunction
    show: Callable[[Any], None]
    end: Callable[[str | None], None]
    delay: float = 0.0
    compiling: Callable[[], None] = lambda: None
    urgent: bool = False
    due: float = field(default=0.0, init=False)
    running: Generator[Any] | RemoteGenerator | None = field(default=None, init=False)


class Workers(NamedTuple):
    """The workers that compute for all pages."""

    quick: Worker  # the motion at the point, and files
    slow: Worker  # the map, the diagram, basins
    branches: Worker  # branches of motions; each is one step
    curves: Worker  # bifurcation curves, which may take many seconds for a step


class Worker:
    """A thread that runs jobs step by step, in a process or by default in the thread itself."""

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
            tasks = self._jobs.get(owner, OrderedDict()) if task else self._jobs.pop(owner, OrderedDict())
            for name in [task] if task else list(tasks):
                self._cancel_job(tasks.pop(name, None))
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
            if found is not None and self._is_current(*found):
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
                    self._jobs.move_to_end(found[0])
                    self._jobs[found[0]].move_to_end(found[1])
                    return found
                if self._cancelled or self._stopped:
                    return None
                self._change.wait(max(0.0, min(job.due for *_, job in waiting) - now) if waiting else None)

    def _is_current(self, owner: str, task: str, job: Job) -> bool:
        """Whether a job was neither cancelled nor replaced."""
        with self._change:
            return owner in self._jobs and self._jobs[owner].get(task) is job

    def _step(self, owner: str, task: str, job: Job) -> None:
        """Take one step of a job; its result is dropped if the job was cancelled meanwhile."""
        message, over, result = None, False, None
        try:
            if job.running is None:
                process = self._process
                job.running = (job.function() if process is None
                               else process.run(job.function, job.compiling, job.urgent))
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


class WorkerProcess:
    """A process that computes for one thread, and is replaced if it ends unexpectedly.

    It is started by a command, neither forked nor spawned by `multiprocessing`, so that the caller's main module is
    not imported again; with ``on_demand`` by the first request. With ``low_priority`` it gives way to other processes,
    and returns memory early.
    """

    def __init__(self, low_priority: bool = False, on_demand: bool = False) -> None:
        self._low_priority, self._numbers, self._ended = low_priority, count(), False
        self._writing = threading.Lock()
        self._process: Any = None
        if not on_demand:
            self._start()

    def _start(self) -> None:
        niceness = _NICENESS if self._low_priority else 0
        command = python_command(f"from gearchaos.explorer.core.worker import main; main({niceness})")
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                         creationflags=_LOW_PRIORITY if self._low_priority else 0,
                                         env=os.environ | _MALLOC if self._low_priority else None)

    def run(
        self, function: GeneratorFunction, compiling: Callable[[], None] = lambda: None, urgent: bool = False,
    ) -> RemoteGenerator:
        """A generator that is run in the process, its first step with full priority if it is ``urgent``.

        ``compiling`` is called when it has to compile kernels.
        """
        return RemoteGenerator(self, next(self._numbers), function, compiling, urgent)

    def ask(self, action: str, number: int, function: GeneratorFunction | None, compiling: Callable[[], None]) -> Any:
        """Send a request and return its answer, or raise what the step raised.

        If the process ends before it answers, a new one is started and a RuntimeError raised.
        """
        try:
            self.send(action, number, function)
            while (answer := pickle.load(self._process.stdout)) == COMPILING:
                compiling()
        except (OSError, ValueError, EOFError, pickle.UnpicklingError) as error:  # raised for a closed pipe
            self._restart()
            raise RuntimeError("the process that computes has ended") from error
        if isinstance(answer, Exception):
            raise answer
        return answer

    def send(self, action: str, number: int, function: GeneratorFunction | None = None) -> None:
        """Send a request, from any thread; the first one starts a process on demand."""
        request = pickle.dumps((action, number, function), pickle.HIGHEST_PROTOCOL)
        with self._writing:
            if self._process is None and not self._ended:
                self._start()
            self._process.stdin.write(request)
            self._process.stdin.flush()

    def end(self) -> None:
        """Kill the process and do not replace it."""
        self._ended = True
        self._restart()

    def _restart(self) -> None:
        with self._writing:
            if self._process is None:
                return
            self._process.kill()
            self._process.wait()
            for pipe in (self._process.stdin, self._process.stdout):
                with contextlib.suppress(OSError):
                    pipe.close()
            if not self._ended:
                self._start()


class RemoteGenerator:
    """Iterator over the results of a generator that runs in a `WorkerProcess`."""

    def __init__(
        self, process: WorkerProcess, number: int, function: GeneratorFunction, compiling: Callable[[], None],
        urgent: bool,
    ) -> None:
        self._process, self._number, self._function, self._compiling = process, number, function, compiling
        self._first_action = "urgent" if urgent else "next"
        self._started = self._over = False

    def __iter__(self) -> RemoteGenerator:
        return self

    def __next__(self) -> Any:
        if self._over:
            raise StopIteration
        action, function = ("next", None) if self._started else (self._first_action, self._function)
        self._started, found = True, None
        try:
            found = self._process.ask(action, self._number, function, self._compiling)
        finally:
            self._over = found is None
        if found is None:
            raise StopIteration
        return found[0]

    def cancel(self) -> None:
        """From any thread: have a step under way end soon, in a `StoppedError`."""
        if not self._over:
            with contextlib.suppress(OSError, ValueError):
                self._process.send("cancel", self._number)

    def close(self) -> None:
        """Have the process close the generator; only between two steps."""
        if self._started and not self._over:
            self._over = True
            self._process.ask("close", self._number, None, self._compiling)


_LAST = object()


def main(niceness: int) -> None:
    """Answer requests on stdin until it is closed; steps that are not urgent have a priority lower by ``niceness``."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # text that is printed must not get between the answers
    if not niceness and cores() > 1:
        compile_beside()
    with contextlib.suppress(BrokenPipeError):
        _Requests(sys.stdin.buffer, answers).serve(niceness)
    os._exit(0)  # without waiting for threads that still compute


class _Requests:
    """Answers requests in order. A second thread reads them, so that a step under way can be cancelled."""

    def __init__(self, requests: BinaryIO, answers: BinaryIO) -> None:
        self._requests, self._answers = requests, answers
        self._waiting: queue.SimpleQueue[tuple[str, int, Any]] = queue.SimpleQueue()
        self._running: dict[int, tuple[Generator[Any], Context]] = {}
        self._cancelled: dict[int, threading.Event] = {}
        self._writing = threading.Lock()
        on_compile(partial(self._write, pickle.dumps(COMPILING)))
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        while True:
            try:
                action, number, function = pickle.load(self._requests)
            except EOFError:
                os._exit(0)  # the server has ended
            cancelled = self._cancelled.setdefault(number, threading.Event())  # may be set before the start
            if action == "cancel":
                cancelled.set()
            else:
                self._waiting.put((action, number, function))

    def serve(self, niceness: int) -> None:
        """Answer one request after the other. On Linux a thread has its own priority, as have those that it starts."""
        lower = partial(os.nice, niceness) if niceness and hasattr(os, "nice") else None
        patient = ThreadPoolExecutor(1, initializer=lower)
        while True:
            action, number, function = self._waiting.get()
            try:
                step = partial(self._step, action, number, function)
                found = step() if action == "urgent" else patient.submit(step).result()
                answer = pickle.dumps(found, pickle.HIGHEST_PROTOCOL)
            except Exception as error:  # errors are answers too
                found, answer = None, pickle.dumps(error, pickle.HIGHEST_PROTOCOL)
            if found is None:
                self._running.pop(number, None)
                self._cancelled.pop(number, None)
            self._write(answer)

    def _write(self, answer: bytes) -> None:
        with self._writing:  # threads that compile write too
            self._answers.write(answer)
            self._answers.flush()

    def _step(self, action: str, number: int, function: Any) -> tuple[Any] | None:
        """The next result of a generator, in a tuple; None after its last one."""
        if function is not None:
            context = copy_context()
            context.run(cancel_event.set, self._cancelled[number])
            self._running[number] = function(), context
        if number not in self._running:
            return None
        generator, context = self._running[number]
        if action == "close":
            self._cancelled[number].set()
            context.run(generator.close)
            return None
        found = context.run(next, generator, _LAST)
        return None if found is _LAST else (found,)
