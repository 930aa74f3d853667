"""What runs in a worker process; see `gearchaos.explorer.jobs.worker_process` for the requests and answers."""

from __future__ import annotations

import contextlib
import os
import pickle
import queue
import signal
import sys
import threading
from collections.abc import Generator
from contextvars import Context, copy_context
from functools import partial
from typing import Any, BinaryIO

from gearchaos.explorer.jobs.worker_process import COMPILING
from gearchaos.flow import cancel_event, on_compile

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
