"""A process for long computations, so that they do not block the thread that serves pages.

The server uses a `WorkerProcess`; `main` runs in the process. The two exchange pickles over pipes.

======================================== ======================================================================
request ``(action, number, function)``   answer
======================================== ======================================================================
``start``, ``next``                      ``(result,)``, None after the last result, or an exception
``close``                                None; the generator is closed
``cancel``                               none; a step under way raises `StoppedError`
======================================== ======================================================================

Before its answer the process sends `COMPILING` if the step has to compile kernels.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Generator
from contextvars import Context, copy_context
from functools import partial
from itertools import count
from typing import Any, BinaryIO

from gearchaos.flow import cancel_event, on_compile

COMPILING = "compiling"
"""Message that kernels are being compiled, which takes about half a minute."""

_NICENESS = 15
"""Niceness of a process of low priority on Unix."""

_LOW_PRIORITY = getattr(subprocess, "BELOW_NORMAL_PRIORITY_CLASS", 0)
"""Flag of a process of low priority on Windows, where there is no niceness; 0 elsewhere."""

_MALLOC = {"MALLOC_MMAP_THRESHOLD_": "1048576", "MALLOC_TRIM_THRESHOLD_": "1048576"}
"""Environment of the process that computes maps: glibc then returns the memory of large arrays to the system at once.

By default it keeps more and more of it. Maps take 3 % longer with these settings.
"""

GeneratorFunction = Callable[[], Generator[Any]]
"""A function that returns a generator of results; it must be picklable, since it is called in the process."""


class LostError(RuntimeError):
    """The process ended while a step was under way."""


class WorkerProcess:
    """A process that computes for one thread, and is replaced if it ends unexpectedly.

    It is started by a command, neither forked nor spawned by `multiprocessing`, so that the caller's main module is
    not imported again.

    Parameters
    ----------
    low_priority : bool
        Give way to other processes, and return memory early.
    on_demand : bool
        Start with the first request.
    """

    def __init__(self, low_priority: bool = False, on_demand: bool = False) -> None:
        self._low_priority, self._numbers, self._ended = low_priority, count(), False
        self._writing = threading.Lock()
        self._process: Any = None
        if not on_demand:
            self._start()

    def _start(self) -> None:
        niceness = _NICENESS if self._low_priority else 0
        code = f"from gearchaos.explorer.jobs.worker_process import main; main({niceness})"
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            creationflags=_LOW_PRIORITY if self._low_priority else 0,
            env=os.environ | _MALLOC if self._low_priority else None,
        )

    def run(self, function: GeneratorFunction, compiling: Callable[[], None] = lambda: None) -> RemoteGenerator:
        """A generator that is run in the process; ``compiling`` is called when it has to compile kernels."""
        return RemoteGenerator(self, next(self._numbers), function, compiling)

    def ask(self, action: str, number: int, function: GeneratorFunction | None, compiling: Callable[[], None]) -> Any:
        """Send a request and return its answer.

        Raises
        ------
        LostError
            If the process ends before it answers; a new one is then started.
        Exception
            Whatever the step raised.
        """
        with self._writing:
            if self._process is None and not self._ended:
                self._start()
        try:
            self.send(action, number, function)
            while (answer := pickle.load(self._process.stdout)) == COMPILING:
                compiling()
        except (OSError, ValueError, EOFError, pickle.UnpicklingError) as error:  # raised for a closed pipe
            self._restart()
            raise LostError("the process that computes has ended") from error
        if isinstance(answer, Exception):
            raise answer
        return answer

    def send(self, action: str, number: int, function: GeneratorFunction | None = None) -> None:
        """Send a request, from any thread."""
        request = pickle.dumps((action, number, function), pickle.HIGHEST_PROTOCOL)
        with self._writing:
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
        self, process: WorkerProcess, number: int, function: GeneratorFunction, compiling: Callable[[], None]
    ) -> None:
        self._process, self._number, self._function, self._compiling = process, number, function, compiling
        self._started = self._over = False

    def __iter__(self) -> RemoteGenerator:
        return self

    def __next__(self) -> Any:
        if self._over:
            raise StopIteration
        try:
            action, function = ("next", None) if self._started else ("start", self._function)
            self._started = True
            found = self._process.ask(action, self._number, function, self._compiling)
        except BaseException:
            self._over = True
            raise
        if found is None:
            self._over = True
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
    """Answer requests on stdin until it is closed; priority is lowered by ``niceness`` after the first answer."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the server, whose end closes the pipe
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # text that is printed must not get between the answers
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
        """Answer one request after the other. The first one has full priority, since every page waits for it."""
        while True:
            self._write(self._answer(*self._waiting.get()))
            if niceness and hasattr(os, "nice"):
                os.nice(niceness)
                niceness = 0

    def _write(self, answer: bytes) -> None:
        with self._writing:  # threads that compile write too
            self._answers.write(answer)
            self._answers.flush()

    def _answer(self, action: str, number: int, function: Any) -> bytes:
        """The pickled answer to a request; errors are answers too."""
        try:
            found = self._step(action, number, function)
            if found is None:
                self._forget(number)
            return pickle.dumps(found, pickle.HIGHEST_PROTOCOL)
        except Exception as error:
            self._forget(number)
            return pickle.dumps(error, pickle.HIGHEST_PROTOCOL)

    def _step(self, action: str, number: int, function: Any) -> tuple[Any] | None:
        """The next result of a generator, in a tuple; None after its last one."""
        if action == "start":
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

    def _forget(self, number: int) -> None:
        self._running.pop(number, None)
        self._cancelled.pop(number, None)
