"""Which tests execute a line, and how long each takes, measured by a run of the tests under coverage."""

from __future__ import annotations

import ast
import json
import time
from collections.abc import Generator, Iterable
from dataclasses import asdict, dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from coverage import Coverage

_TIERS = (0.2, 1.0, 4.0)


@dataclass
class CoverageMap:
    """The tests that execute each line of each file, and the duration of each test in seconds."""

    lines: dict[str, dict[str, list[str]]] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)

    @classmethod
    def read(cls, path: Path) -> CoverageMap:
        return cls(**json.loads(path.read_text()))

    def write(self, path: Path) -> None:
        path.write_text(json.dumps(asdict(self)))

    def add(self, other: CoverageMap) -> None:
        """Merge the measurements of other tests into this one."""
        self.seconds |= other.seconds
        for path, lines in other.lines.items():
            mine = self.lines.setdefault(path, {})
            for line, tests in lines.items():
                mine[line] = mine.get(line, []) + tests

    def tests(self, path: Path, line: int) -> list[str]:
        """The tests that may detect a change of this line, quick ones first.

        Code outside functions, such as a constant, is executed on import. For it these are the tests of all functions
        that mention its name, in any file, and the tests that mention the name themselves.
        """
        statement = _statement(path, line)
        inside = _function_around(path, statement)
        if inside:
            return self._sorted(self._running(path, _lines(statement)))
        names = _names(statement) | _class_around(path, statement)
        users = {test for other in self.lines for f in _functions(Path(other)) if _mentions(f, names)
                 for test in self._running(Path(other), _lines(f))}
        return self._sorted(users | {test for test in self.seconds if _test_mentions(test, frozenset(names))})

    def _running(self, path: Path, lines: Iterable[int]) -> set[str]:
        by_line = self.lines.get(str(path), {})
        return {test for line in lines for test in by_line.get(str(line), ())}

    def _sorted(self, tests: Iterable[str]) -> list[str]:
        """Tests by classes of duration; within a class they keep their order, so that they share module fixtures."""
        order = {test: i for i, test in enumerate(self.seconds)}
        return sorted(set(tests), key=lambda t: (sum(self.seconds[t] > limit for limit in _TIERS), order[t]))


@cache
def _tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text())


@cache
def _functions(path: Path) -> list[ast.FunctionDef]:
    return [node for node in ast.walk(_tree(path)) if isinstance(node, ast.FunctionDef)]


def _lines(node: ast.stmt) -> range:
    """The lines of a statement; for a compound statement its header, for a function its body."""
    last = node.end_lineno or node.lineno
    body = getattr(node, "body", None)
    if isinstance(node, ast.FunctionDef):
        return range(node.body[0].lineno, last + 1)
    return range(node.lineno, body[0].lineno if body else last + 1)


def _statement(path: Path, line: int) -> ast.stmt:
    """The innermost statement that contains a line."""
    around = [n for n in ast.walk(_tree(path)) if isinstance(n, ast.stmt) and _begin(n) <= line <= (n.end_lineno or 0)]
    return min(around, key=lambda n: (n.end_lineno or 0) - _begin(n))


def _begin(node: ast.stmt) -> int:
    return min([node.lineno, *(d.lineno for d in getattr(node, "decorator_list", []))])


def _function_around(path: Path, statement: ast.stmt) -> bool:
    """Whether a statement is in the body of a function."""
    return any(statement is not f and f.lineno <= statement.lineno <= (f.end_lineno or 0) for f in _functions(path))


def _class_around(path: Path, statement: ast.stmt) -> set[str]:
    """The name of the class whose body contains a statement, if any: fields are mentioned less often than classes."""
    return {node.name for node in ast.walk(_tree(path)) if isinstance(node, ast.ClassDef) and statement in node.body}


def _names(statement: ast.stmt) -> set[str]:
    """The names that a statement outside functions binds."""
    if isinstance(statement, ast.FunctionDef | ast.ClassDef):
        return {statement.name}
    stored = (n for n in ast.walk(statement) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store))
    return {n.id for n in stored}


def _mentions(function: ast.FunctionDef, names: set[str]) -> bool:
    nodes = list(ast.walk(function))
    said = {getattr(n, attribute, None) for n in nodes for attribute in ("id", "attr", "arg", "name")}
    return bool(said & names)


@cache
def _test_mentions(test: str, names: frozenset[str]) -> bool:
    """Whether the source of a test mentions one of these names."""
    path, _, function = test.partition("::")
    return any(f.name == function.split("[")[0] and _mentions(f, set(names)) for f in _functions(Path(path)))


class Measuring:
    """A pytest plugin that tells coverage which test runs; lines executed by a fixture count for all its users."""

    def __init__(self, sources: Path) -> None:
        self.coverage = Coverage(source=[str(sources)], data_file=None, messages=False)
        self.users: dict[str, list[str]] = {}
        self.found = CoverageMap()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: Any) -> Generator[None, Any, Any]:
        for name in item.fixturenames:
            self.users.setdefault(name, []).append(item.nodeid)
        self.coverage.switch_context(item.nodeid)
        begin = time.perf_counter()
        result = yield
        self.found.seconds[item.nodeid] = time.perf_counter() - begin
        return result

    @pytest.hookimpl(wrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any, request: Any) -> Generator[None, Any, Any]:
        test = request._pyfuncitem.nodeid
        self.coverage.switch_context(f"fixture {fixturedef.argname}")
        try:
            return (yield)
        finally:
            self.coverage.switch_context(test)

    def run(self, arguments: list[str]) -> CoverageMap:
        self.coverage.start()
        try:
            code = pytest.main(arguments, plugins=[self])
        finally:
            self.coverage.stop()
        if code != pytest.ExitCode.OK:
            raise SystemExit("mutation testing needs tests that all pass")
        data = self.coverage.get_data()
        self.found.lines = {f: self._tests(data.contexts_by_lineno(f)) for f in data.measured_files()}
        return self.found

    def _tests(self, contexts: dict[int, list[str]]) -> dict[str, list[str]]:
        """The tests by line; a fixture is replaced by the tests that use it."""
        return {str(line): sorted({t for c in said for t in self.users.get(c.removeprefix("fixture "), [c])} - {""})
                for line, said in contexts.items()}
