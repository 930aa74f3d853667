"""Has commands tried in a child, and ends and replaces it where it takes too long or too much."""

import json
import os
import selectors
import shlex
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psutil

_CHILD = Path(__file__).with_name("child.py")
_BEAT = 0.25
_MEMORY = 6 << 30
_COMPILES, _COMPILED = b"compiling the kernels", 600
"""What a command says that has to compile kernels first, and the seconds that it then has instead."""


@dataclass(frozen=True)
class Tried:
    """What became of a command: its exit code, or in words why it had to be ended; and what it wrote."""

    command: list[str]
    code: int | str
    seconds: float
    stdout: str = ""
    stderr: str = ""

    def __str__(self) -> str:
        shown = shlex.join(["gearchaos", *self.command])
        return f"$ {shown[:2000]}\nexit {self.code} after {self.seconds:.1f} s\n{self.stderr[-3000:]}"


class Trials:
    """A child that tries commands one after another; a context manager."""

    def __init__(self, seconds: float, said: str | None = None) -> None:
        """A command may take so long; once it has ``said`` a certain thing it is ended at once."""
        self.seconds, self._said = seconds, said
        self._child: subprocess.Popen[bytes] | None = None
        self._answers = -1

    def __enter__(self) -> "Trials":
        return self

    def __exit__(self, *_: object) -> None:
        self._end()

    def run(self, command: list[str], folder: Path, largest: int | None = None) -> Tried:
        """Try a command in a folder, where it may write files of so many bytes."""
        child, begin = self._alive(), time.monotonic()
        request = {"command": command, "folder": str(folder), "largest": largest}
        child.stdin.write(json.dumps(request).encode() + b"\n")
        child.stdin.flush()
        written = {child.stdout.fileno(): b"", child.stderr.fileno(): b"", self._answers: b""}
        why = self._listen(child, written)
        out, err, answer = (written[place].rstrip(b"\0").decode(errors="replace") for place in written)
        if why:
            self._end()
            return Tried(command, why, time.monotonic() - begin, out, err)
        return Tried(command, stdout=out, stderr=err, **json.loads(answer))

    def _listen(self, child: Any, written: dict[int, bytes]) -> str | None:
        """Gather what the child writes until it has answered; in words what kept it from that."""
        begin, process = time.monotonic(), psutil.Process(child.pid)
        until = begin + self.seconds
        with selectors.DefaultSelector() as ready:
            for place in written:
                ready.register(place, selectors.EVENT_READ)
            while not all(v.endswith((b"\0", b"\n" if p == self._answers else b"\0")) for p, v in written.items()):
                for key, _ in ready.select(_BEAT):
                    new = os.read(key.fd, 1 << 16)
                    if not new:
                        return f"died with {child.wait()}"
                    written[key.fd] += new
                if self._said and self._said.encode() in written[child.stderr.fileno()]:
                    return "said"
                if _COMPILES in written[child.stderr.fileno()]:
                    until = max(until, begin + _COMPILED)
                if time.monotonic() > until:
                    return f"ended: more than {self.seconds:.0f} seconds"
                if process.memory_info().rss > _MEMORY:
                    return f"ended: more than {_MEMORY >> 30} GB of memory"
        return None

    def _alive(self) -> Any:
        if self._child is None:
            self._answers, answers = os.pipe()
            self._child = subprocess.Popen(
                [sys.executable, str(_CHILD), str(answers)], pass_fds=[answers], stdin=subprocess.PIPE,
                stdout=subprocess.PIPE, stderr=subprocess.PIPE, env={**os.environ, "COLUMNS": "200"},
            )
            os.close(answers)
        return self._child

    def _end(self) -> None:
        if self._child is not None:
            self._child.kill()
            self._child.communicate()
            os.close(self._answers)
            self._child = None
