"""Run the tests of a mutant in a process of its own until one fails."""

from __future__ import annotations

import multiprocessing
import os
import resource
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import pytest

from tests.mutation.mutants import Mutant

PLAIN = ["-q", "-x", "-p", "no:cacheprovider", "-p", "no:xdist", "-W", "ignore::pytest.PytestAssertRewriteWarning"]
"""Assertions of modules loaded before pytest are not rewritten; none of these modules is a test."""

_MEMORY = 8 << 30
_SLACK, _FACTOR = 15.0, 10.0
"""A test hangs if it takes longer than _SLACK seconds plus _FACTOR times its duration without a mutant."""

_FORK = multiprocessing.get_context("fork")


@dataclass(frozen=True)
class Outcome:
    """The end of a mutant ("killed", "timeout" or "survived"), the test that caused it, and how many tests were run."""

    end: str
    by: str
    tests: int


class _Mutated(SourceFileLoader):
    """Loads the source of the mutant instead of the file."""

    mutant: Mutant

    def get_code(self, fullname: str) -> Any:
        return compile(self.mutant.source, self.path, "exec", dont_inherit=True)


class _Finder(MetaPathFinder):
    def __init__(self, mutant: Mutant) -> None:
        self.mutant = mutant

    def find_spec(self, fullname: str, path: Any, target: Any = None) -> ModuleSpec | None:
        if not fullname.startswith("gearchaos"):
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        if spec and spec.origin == str(self.mutant.path):
            spec.loader = _Mutated(fullname, spec.origin)
            spec.loader.mutant = self.mutant
        return spec


class _Chosen:
    """A pytest plugin that runs only these tests, in this order, and reports which one begins and which one fails."""

    def __init__(self, tests: list[str], said: Connection) -> None:
        self.place, self.said = {test: i for i, test in enumerate(tests)}, said

    def pytest_collection_modifyitems(self, items: list[Any]) -> None:
        items[:] = sorted((i for i in items if i.nodeid in self.place), key=lambda i: self.place[i.nodeid])

    def pytest_runtest_logstart(self, nodeid: str) -> None:
        self.said.send(("begun", nodeid))

    def pytest_runtest_logreport(self, report: Any) -> None:
        if report.failed:
            self.said.send(("failed", report.nodeid))

    def pytest_collectreport(self, report: Any) -> None:
        if report.failed:
            self.said.send(("failed", f"import of {report.nodeid}"))


def attempt(mutant: Mutant, tests: list[str], seconds: dict[str, float], folder: Path) -> Outcome:
    """Run the tests against a mutant; ``seconds`` are their durations without one."""
    if not tests:
        return Outcome("survived", "", 0)
    listening, said = _FORK.Pipe(duplex=False)
    process = _FORK.Process(target=_child, args=(mutant, tests, folder, said))
    process.start()
    said.close()
    try:
        return _listen(listening, seconds)
    finally:
        _end(process)


def _listen(listening: Connection, seconds: dict[str, float]) -> Outcome:
    """Read the reports of the process until it ends or hangs."""
    test, count = "import", 0
    while listening.poll(_SLACK + _FACTOR * seconds.get(test, 3.0)):
        try:
            what, name = listening.recv()
        except EOFError:  # the process has died
            return Outcome("killed", f"{test}, with the process", count)
        if what == "ended":
            return Outcome("killed" if name else "survived", test if name else "", count)
        if what == "failed":
            return Outcome("killed", name, count)
        test, count = name, count + 1
    return Outcome("timeout", test, count)


def _end(process: Any) -> None:
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.join()


def _child(mutant: Mutant, tests: list[str], folder: Path, said: Connection) -> None:
    _isolate(folder / "last.txt")
    sys.meta_path.insert(0, _Finder(mutant))
    said.send(("ended", int(pytest.main(_arguments(tests, folder), plugins=[_Chosen(tests, said)]))))


def _arguments(tests: list[str], folder: Path) -> list[str]:
    return [*PLAIN, f"--basetemp={folder / 'tmp'}", *dict.fromkeys(test.split("::")[0] for test in tests)]


def _isolate(log: Path) -> None:
    """Start a new process group with a memory limit, and redirect the output to a file."""
    os.setsid()
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    with log.open("w") as file:
        for stream in (1, 2):
            os.dup2(file.fileno(), stream)


def in_process(work: Callable[[], None]) -> None:
    """Call ``work`` in a forked process, so that modules it imports are not kept in this one."""
    process = _FORK.Process(target=work)
    process.start()
    process.join()
