"""Runs commands in a worker process, and kills and replaces it when it exceeds its time or memory.

The worker, which is this file as a program, runs the commands one after another as a shell would, so that packages load
once. It reads one JSON request per command and answers with its exit code and duration in JSON; after each command it
writes a zero byte to stdout and to stderr to mark the end of the output.
"""

import json
import os
import resource
import selectors
import shlex
import subprocess
import sys
import time
import traceback
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psutil

_POLL = 0.25
"""Seconds between two checks of the worker's time and memory."""

_MEMORY = 6 << 30
_COMPILING, _COMPILING_SECONDS = b"compiling the kernels", 600
"""The message of a command that compiles kernels first, and its time limit in that case."""


@dataclass(frozen=True)
class CommandResult:
    """The exit code of a command, or why it was killed in words; its duration in seconds and its output."""

    command: list[str]
    code: int | str
    seconds: float
    stdout: str = ""
    stderr: str = ""

    def __str__(self) -> str:
        shown = shlex.join(["gearchaos", *self.command])
        return f"$ {shown[:2000]}\nexit {self.code} after {self.seconds:.1f} s\n{self.stderr[-3000:]}"


class CommandRunner:
    """A worker process that runs commands one after another; a context manager."""

    def __init__(self, seconds: float, stop_text: str | None = None) -> None:
        """Give each command so many seconds, and stop it as soon as it writes ``stop_text`` to stderr."""
        self.seconds, self._stop_text = seconds, stop_text
        self._worker: subprocess.Popen[bytes] | None = None
        self._answers = -1

    def __enter__(self) -> "CommandRunner":
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def run(self, command: list[str], folder: Path, largest: int | None = None) -> CommandResult:
        """Run a command in a folder; files that it writes may have ``largest`` bytes (default: no limit)."""
        worker, begin = self._alive(), time.monotonic()
        request = {"command": command, "folder": str(folder), "largest": largest}
        worker.stdin.write(json.dumps(request).encode() + b"\n")
        worker.stdin.flush()
        written = {worker.stdout.fileno(): b"", worker.stderr.fileno(): b"", self._answers: b""}
        why = self._listen(worker, written)
        out, err, answer = (written[stream].rstrip(b"\0").decode(errors="replace") for stream in written)
        if why:
            self._end()
            return CommandResult(command, why, time.monotonic() - begin, out, err)
        return CommandResult(command, stdout=out, stderr=err, **json.loads(answer))

    def _listen(self, worker: Any, written: dict[int, bytes]) -> str | None:
        """Collect the worker's output until it has answered; return None, or why it did not answer in words."""
        begin, process = time.monotonic(), psutil.Process(worker.pid)
        until = begin + self.seconds
        with selectors.DefaultSelector() as ready:
            for stream in written:
                ready.register(stream, selectors.EVENT_READ)
            while not all(v.endswith(b"\n" if p == self._answers else b"\0") for p, v in written.items()):
                for key, _ in ready.select(_POLL):
                    new = os.read(key.fd, 1 << 16)
                    if not new:
                        return f"died with {worker.wait()}"
                    written[key.fd] += new
                if self._stop_text and self._stop_text.encode() in written[worker.stderr.fileno()]:
                    return "stopped"
                if _COMPILING in written[worker.stderr.fileno()]:
                    until = max(until, begin + _COMPILING_SECONDS)
                if time.monotonic() > until:
                    return f"ended: more than {self.seconds:.0f} seconds"
                if process.memory_info().rss > _MEMORY:
                    return f"ended: more than {_MEMORY >> 30} GB of memory"
        return None

    def _alive(self) -> Any:
        if self._worker is None:
            self._answers, answers = os.pipe()
            self._worker = subprocess.Popen(
                [sys.executable, __file__, str(answers)], pass_fds=[answers], stdin=subprocess.PIPE,
                stdout=subprocess.PIPE, stderr=subprocess.PIPE, env={**os.environ, "COLUMNS": "200"},
            )
            os.close(answers)
        return self._worker

    def _end(self) -> None:
        if self._worker is not None:
            self._worker.kill()
            self._worker.communicate()
            os.close(self._answers)
            self._worker = None


def _work(answers: int) -> None:
    for line in sys.stdin:
        begin = time.monotonic()
        code = _run(json.loads(line))
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
            os.write(stream.fileno(), b"\0")
        os.write(answers, json.dumps({"code": code, "seconds": time.monotonic() - begin}).encode() + b"\n")


def _run(request: dict) -> int | str:
    """Run a command in its folder under its limit of file size; return the exit code."""
    from gearchaos.cli import app

    home, limits = os.getcwd(), resource.getrlimit(resource.RLIMIT_FSIZE)
    warnings.resetwarnings()
    warnings.simplefilter("always")  # each time, as in a new process
    for quiet in (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning):
        warnings.simplefilter("ignore", quiet)
    os.chdir(request["folder"])
    try:
        if request["largest"] is not None:  # writing more fails as it does on a full disk
            resource.setrlimit(resource.RLIMIT_FSIZE, (request["largest"], limits[1]))
        app(request["command"], prog_name="gearchaos")
    except SystemExit as end:
        return end.code or 0
    except BaseException:
        traceback.print_exc()
        return 1
    finally:
        if "matplotlib.pyplot" in sys.modules:
            sys.modules["matplotlib.pyplot"].close("all")  # as the end of a process would
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        os.chdir(home)
    return 0


if __name__ == "__main__":
    _work(int(sys.argv[1]))
