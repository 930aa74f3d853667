"""Commands in processes of their own, with their time and memory."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

INSTANT = Path(__file__).with_name("instant.py")


@dataclass(frozen=True)
class Spent:
    """What a process took, with its own child processes.

    Attributes
    ----------
    wall, cpu : float
        Seconds.
    peak : int
        Peak resident memory in bytes of the largest process.
    code : int
        Exit code.
    started : float
        Time of its start, in seconds since the epoch.
    stdout, stderr : str
    """

    wall: float
    cpu: float
    peak: int
    code: int
    started: float
    stdout: str
    stderr: str

    def __str__(self) -> str:
        return f"{self.wall:.1f} s ({self.cpu:.1f} s CPU), {self.peak / 1e6:.0f} MB"


def gearchaos(*arguments: object, check: bool = True, prefix: tuple[str, ...] = (), **environment: object) -> Spent:
    """Run ``gearchaos`` with instant computing; raises RuntimeError if it fails, unless ``check`` is false.

    ``prefix`` is a command that runs it, e.g. strace with its options.
    """
    command = [*prefix, sys.executable, str(INSTANT), *map(str, arguments)]
    return run(command, check, {name: str(value) for name, value in environment.items()})


def run(command: list[str], check: bool, environment: dict[str, str]) -> Spent:
    """Run a command and wait for it; see `gearchaos`."""
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        started, begin = time.time(), time.perf_counter()
        process = subprocess.Popen(command, stdout=out, stderr=err, env=os.environ | environment)
        _, status, used = os.wait4(process.pid, 0)
        wall = time.perf_counter() - begin
        process.returncode = os.waitstatus_to_exitcode(status)
        texts = [_text(file) for file in (out, err)]
    if check and process.returncode:
        raise RuntimeError(f"exit code {process.returncode} of {' '.join(command)}: {texts[1][-2000:]}")
    return Spent(wall, used.ru_utime + used.ru_stime, used.ru_maxrss * 1024, process.returncode, started, *texts)


def _text(file) -> str:
    file.seek(0)
    return file.read().decode(errors="replace")
