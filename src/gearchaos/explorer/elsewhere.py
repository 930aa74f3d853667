"""A process of its own for what takes long: the page's thread never waits for Python that computes.

The process takes one step of one generator at a time, as its `Worker` asks over a pipe. It is begun by a command of its
own, neither forked nor spawned, so that nothing of the caller's program runs again.
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

_POLITE = 15
_LOW = getattr(subprocess, "BELOW_NORMAL_PRIORITY_CLASS", 0)
"""Windows' way to say the same."""

_LEAN = {"MALLOC_MMAP_THRESHOLD_": "1048576", "MALLOC_TRIM_THRESHOLD_": "1048576"}
"""Has glibc give large arrays back at once, where it otherwise keeps ever more of them for a while. Maps take 3 %
longer for it; what little the process for points keeps is not worth that."""

_LAST = object()

_COMPILING = "compiling"
"""What the process says before the answer to a step that has kernels to compile, which takes half a minute."""

Steps = Callable[[], Generator[Any]]
"""Begins some work, a generator of results. It is sent to the process, so that it must be one that can be pickled."""


class LostError(RuntimeError):
    """The process ended in the middle of a step."""


class Elsewhere:
    """A process that works for one thread.

    Parameters
    ----------
    polite : bool
        Let others have the processor first.
    """

    def __init__(self, polite: bool = False) -> None:
        self._polite, self._numbers, self._over = polite, count(), False
        self._writing = threading.Lock()
        self._begin()

    def _begin(self) -> None:
        code = f"from gearchaos.explorer.elsewhere import serve; serve({_POLITE if self._polite else 0})"
        self._process: Any = subprocess.Popen(
            [sys.executable, "-P", "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            creationflags=_LOW if self._polite else 0, env=os.environ | _LEAN if self._polite else None,
        )

    def run(self, steps: Steps, compiling: Callable[[], None] = lambda: None) -> Work:
        """Work to be done there; ``compiling`` is called when it has kernels to compile first."""
        return Work(self, next(self._numbers), steps, compiling)

    def ask(self, what: str, number: int, steps: Steps | None, compiling: Callable[[], None]) -> Any:
        """What the process answers: (result,), or None after the last one.

        Raises
        ------
        LostError
            If the process ends before it answers; the next work finds a new one.
        """
        try:
            self.tell(what, number, steps)
            while (answer := pickle.load(self._process.stdout)) == _COMPILING:
                compiling()
        except (OSError, ValueError, EOFError, pickle.UnpicklingError) as error:  # closed, in short
            self._renew()
            raise LostError("the process that computes has ended") from error
        if isinstance(answer, Exception):
            raise answer
        return answer

    def tell(self, what: str, number: int, steps: Steps | None = None) -> None:
        """Send a request."""
        request = pickle.dumps((what, number, steps), pickle.HIGHEST_PROTOCOL)
        with self._writing:
            self._process.stdin.write(request)
            self._process.stdin.flush()

    def end(self) -> None:
        """End the process for good, whatever it does."""
        self._over = True
        self._renew()

    def _renew(self) -> None:
        with self._writing:
            self._process.kill()
            self._process.wait()
            for pipe in (self._process.stdin, self._process.stdout):
                with contextlib.suppress(OSError):
                    pipe.close()
            if not self._over:
                self._begin()


class Work:
    """An iterator over the results of work that is done in another process."""

    def __init__(self, place: Elsewhere, number: int, steps: Steps, compiling: Callable[[], None]) -> None:
        self._place, self._number, self._steps, self._compiling = place, number, steps, compiling
        self._begun = self._over = False

    def __iter__(self) -> Work:
        return self

    def __next__(self) -> Any:
        if self._over:
            raise StopIteration
        try:
            found = self._ask()
        except BaseException:
            self._over = True
            raise
        if found is None:
            self._over = True
            raise StopIteration
        return found[0]

    def _ask(self) -> Any:
        what, steps = ("next", None) if self._begun else ("begin", self._steps)
        self._begun = True
        return self._place.ask(what, self._number, steps, self._compiling)

    def leave(self) -> None:
        """Say, from any thread, that nobody waits for it: a step under way soon ends in a `StoppedError`."""
        if not self._over:
            with contextlib.suppress(OSError, ValueError):
                self._place.tell("leave", self._number)

    def close(self) -> None:
        """Have the process forget the work; only between steps."""
        if self._begun and not self._over:
            self._over = True
            self._place.ask("close", self._number, None, self._compiling)


def serve(nice: int) -> None:
    """Take steps as they are asked for, until nobody is there to ask."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the server, whose end closes the pipe
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what prints must not get among the answers
    with contextlib.suppress(BrokenPipeError):
        _Server(sys.stdin.buffer, answers).serve(nice)
    os._exit(0)  # whatever still computes is for nobody


class _Server:
    """The other end of the pipe: one thread reads, so that work can be left in the middle of a step."""

    def __init__(self, requests: BinaryIO, answers: BinaryIO) -> None:
        self._requests, self._answers = requests, answers
        self._waiting: queue.SimpleQueue[tuple[str, int, Any]] = queue.SimpleQueue()
        self._running: dict[int, tuple[Generator[Any], Context]] = {}
        self._asked: dict[int, threading.Event] = {}
        self._writing = threading.Lock()
        on_compile(partial(self._write, pickle.dumps(_COMPILING)))
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        while True:
            try:
                what, number, steps = pickle.load(self._requests)
            except EOFError:
                os._exit(0)  # nobody is there any more
            asked = self._asked.setdefault(number, threading.Event())  # a work may be left before it begins
            if what == "leave":
                asked.set()
            else:
                self._waiting.put((what, number, steps))

    def serve(self, nice: int) -> None:
        """Answer one request after the other; be nice from the second on, since everybody waits for the first."""
        while True:
            self._write(self._answer(*self._waiting.get()))
            if nice and hasattr(os, "nice"):
                os.nice(nice)
                nice = 0

    def _write(self, answer: bytes) -> None:
        with self._writing:  # threads that compile write too
            self._answers.write(answer)
            self._answers.flush()

    def _answer(self, what: str, number: int, steps: Any) -> bytes:
        try:
            found = self._step(what, number, steps)
            if found is None:
                self._forget(number)
            return pickle.dumps(found, pickle.HIGHEST_PROTOCOL)
        except Exception as error:
            self._forget(number)
            return pickle.dumps(error, pickle.HIGHEST_PROTOCOL)

    def _step(self, what: str, number: int, steps: Any) -> tuple[Any] | None:
        """The next result of a work, in a tuple; None after its last one."""
        if what == "begin":
            context = copy_context()
            context.run(cancel_event.set, self._asked[number])
            self._running[number] = steps(), context
        if number not in self._running:
            return None
        generator, context = self._running[number]
        if what == "close":
            self._asked[number].set()
            context.run(generator.close)
            return None
        found = context.run(next, generator, _LAST)
        return None if found is _LAST else (found,)

    def _forget(self, number: int) -> None:
        self._running.pop(number, None)
        self._asked.pop(number, None)
