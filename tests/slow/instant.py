"""Maps whose cells take no time to compute, in processes of the command ``gearchaos`` that begin at once.

``python -m tests.slow.instant`` is a process that has imported everything and forks for each command; `Nursery` starts
it and speaks to it. Processes that the commands start import this file as their main module, and so compute the same.

Environment variables of a command:

- ``INSTANT_SECONDS``: how long a tile takes.
- ``INSTANT_LOG``: a file that gets a line for each tile that is computed: the number of its first cell.
- ``INSTANT_RECORD``: a file for what the process did to the files below its folder; see `power_failure`.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import gearchaos as gc
from gearchaos.store import tiles
from gearchaos.studies.maps.zones import Zones
from tests import ROOT

STUDY = '[model]\nq0 = 0.1\n[study]\nkind = "zones"\nx = "omega=0.5:1.1:30"\ny = "eps1=0.05:0.3:20"\n'
MAP = gc.Zones(gc.MeshModel.of(q0=0.1), "omega=0.5:1.1:30", "eps1=0.05:0.3:20")
"""The same study: 40 tiles in 10 blocks."""

TILE = 16
_LARGEST_VALUES = {"label": 5, "period": 8, "reason": 5, "v_rms": 101}
_DTYPES = {"label": "i1", "period": "i4", "reason": "i1", "v_rms": "f8"}


def compute(self, items: np.ndarray, *, progress: bool = False, threads: int | None = None) -> dict[str, np.ndarray]:
    """The results of cells follow from their numbers; none is zero or a fill value."""
    if len(items) > 1:  # single cells are computed when a store is made
        if path := os.environ.get("INSTANT_LOG"):
            with open(path, "a") as file:
                file.write(f"{items[0]}\n")
        time.sleep(float(os.environ.get("INSTANT_SECONDS", 0)))
    return {name: (items % most + 1).astype(_DTYPES[name]) for name, most in _LARGEST_VALUES.items()}


def install(patch=setattr) -> None:
    """Let maps be instant in this process, blocks have few tiles, and a disk synchronise at once."""
    patch(Zones, "compute", compute)
    patch(tiles, "_SMALLEST_BLOCK", 0)
    patch(os, "fsync", lambda file: None)


@dataclass
class Command:
    """A command in a process of its own, the first one of a process group."""

    nursery: Nursery
    pid: int
    output: Path
    code: int | None = None

    def alive(self) -> bool:
        if self.code is None:
            self.code = self.nursery.ask("poll", self.pid)
        return self.code is None

    def kill(self) -> None:
        assert self.alive(), self.output.read_text()
        os.killpg(self.pid, signal.SIGKILL)
        self.wait(-signal.SIGKILL)

    def wait(self, *codes: int) -> str:
        """What the command has written, after it has ended with one of these codes."""
        wait_until(lambda: not self.alive())
        said = self.output.read_text()
        assert self.code in (codes or (0,)), said
        return said

    def until(self, condition) -> None:
        """Wait for a condition that must hold before the command ends."""
        def held() -> bool:
            running = self.alive()
            if condition():
                return True
            assert running, self.output.read_text()
            return False

        wait_until(held)


def wait_until(condition) -> None:
    until = time.monotonic() + 120
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.002)


class Nursery:
    """The process that forks for each command; a context manager."""

    def __enter__(self) -> Nursery:
        self._started, self._outputs = list[Command](), tempfile.TemporaryDirectory()
        self._process = subprocess.Popen([sys.executable, "-m", "tests.slow.instant"], text=True, cwd=ROOT,
                                         stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        return self

    def __exit__(self, *_) -> None:
        for command in self._started:
            if command.alive():
                command.kill()
        with self._process as process:
            process.stdin.close()
        self._outputs.cleanup()

    def ask(self, *request):
        self._process.stdin.write(json.dumps(request) + "\n")
        self._process.stdin.flush()
        return json.loads(self._process.stdout.readline())

    def start(self, folder: Path, *arguments: object, **environment: object) -> Command:
        output = Path(self._outputs.name, str(len(self._started)))
        output.touch()
        variables = {name: str(value) for name, value in environment.items()}
        pid = self.ask("start", str(folder), list(map(str, arguments)), str(output), variables)
        self._started.append(Command(self, pid, output))
        return self._started[-1]

    def run(self, path: Path | str, *options: object, folder: Path | None = None, **environment: object) -> Command:
        """Begin to compute the map into a store; the study file is in the ``folder``, by default that of the store."""
        folder = folder or Path(path).parent
        (folder / "study.toml").write_text(STUDY)
        return self.start(folder, "run", "study.toml", "--out", path, "--tile", TILE, *options, **environment)


def _serve() -> None:
    """Answer requests of `Nursery`; in the processes that are forked it returns."""
    for line in sys.stdin:
        match json.loads(line):
            case "poll", pid:
                ended, status = os.waitpid(pid, os.WNOHANG)
                answer = os.waitstatus_to_exitcode(status) if ended else None
            case "start", folder, arguments, output, variables:
                answer = os.fork()
                os.setpgid(answer, 0)
                if not answer:
                    os.chdir(folder)
                    os.environ.update(variables)
                    for number, name in enumerate((os.devnull, output, output)):
                        os.dup2(os.open(name, os.O_RDWR | os.O_CREAT | os.O_APPEND), number)
                    sys.argv[1:] = arguments
                    return
        print(json.dumps(answer), flush=True)
    sys.exit()


if __name__ in ("__main__", "__mp_main__"):
    install()

if __name__ == "__main__":
    from gearchaos.cli import main, runs  # noqa: F401
    from gearchaos.store import read, run  # noqa: F401
    from tests.slow.power_failure import recorded

    _serve()
    signal.signal(signal.SIGINT, signal.default_int_handler)  # it is ignored in the background of a shell
    with recorded(os.environ.get("INSTANT_RECORD")):
        sys.exit(main())
