"""``python -m tests.mutation``: test a random sample of mutants, or resume that, and report how many were killed."""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from hashlib import sha256
from importlib import import_module
from itertools import accumulate
from pathlib import Path
from typing import Annotated, Any

import typer

from tests import ROOT
from tests.mutation.coverage_map import CoverageMap, Measuring
from tests.mutation.mutants import Mutant, sample
from tests.mutation.trial import PLAIN, Outcome, attempt, in_process

SOURCES = ROOT / "src" / "gearchaos"
FIRST_TESTS = {
    "quantities": ("model/test_quantities", "model/test_model"),
    "validation.py": ("cli/test_limits", "model/test_model"),
    "model": ("model/test_model", "test_waveforms", "test_switched", "test_coordinates"),
    "gears": ("gears/test_pair", "plot/test_units"),
    "dynamics": ("test_verdict", "test_reading", "test_spectrum", "test_motion"),
    "studies": ("test_refine", "test_sweeps", "test_catalogue", "test_boundary", "studies/test_records",
                "cli/test_limits", "studies/test_studies"),
    "store": ("contracts/store/",),
}
"""The mutated packages, each with the test files that are run first because they kill most of its mutants."""

_EXCLUDED = ("explorer", "test_paper", "test_cache", "test_docs", "test_fuzz", "test_full_disk", "test_exports.py",
             "test_doctests", "test_dependencies")
"""Test files whose paths have this in them are not used: they are too slow, or test other packages."""

_PRELOADED = (
    "numba", "scipy.stats", "scipy.signal", "scipy.ndimage", "xarray", "zarr", "h5netcdf", "matplotlib.pyplot", "pint",
    "psutil", "typer", "rich.progress",
)
"""Packages imported once, before processes are forked."""


def main(
    count: Annotated[int, typer.Option(help="How many mutants.")] = 300,
    seed: Annotated[int, typer.Option(help="Another seed gives other mutants.")] = 0,
    only: Annotated[str, typer.Option(help="Only files whose path has this in it.")] = "",
    out: Annotated[Path, typer.Option(help="Folder of the results.")] = ROOT / "build" / "mutation",
    seconds: Annotated[float, typer.Option(help="Time for the tests of one mutant, quickest first.")] = 20.0,
    again: Annotated[bool, typer.Option(help="Test the survivors again.")] = False,
) -> None:
    """Test mutants and write a line of JSON for each; those already tested with the same sources are skipped."""
    out.mkdir(parents=True, exist_ok=True)
    coverage_map, mutants = _measured(out), sample(_files(only), count, seed)
    record, known = out / "mutants.jsonl", _known(out / "mutants.jsonl", again)
    _preload()
    _check_without_mutant(coverage_map, out, seconds)
    with record.open("a") as lines:
        for mutant in (m for m in mutants if m.key not in known):
            known[mutant.key] = _tested(mutant, coverage_map, out, seconds)
            lines.write(json.dumps(known[mutant.key]) + "\n")
            lines.flush()
            typer.echo("{end:9}{seconds:6.1f} s  {path}:{line}  {kind}".format(**known[mutant.key]))
    _report([known[m.key] for m in mutants])


def _files(only: str) -> list[Path]:
    every = [f for package in FIRST_TESTS for f in sorted((SOURCES / package).rglob("*.py"))]
    return [f for f in every if only in str(f)]


def _within(tests: list[str], coverage_map: CoverageMap, limit: float) -> list[str]:
    """The first of these tests whose durations add up to less than ``limit`` seconds."""
    ends = accumulate(coverage_map.seconds[test] for test in tests)
    return [test for test, end in zip(tests, ends, strict=True) if end < limit]


def _known(record: Path, again: bool) -> dict[str, dict[str, Any]]:
    """Earlier results by the mutants' keys, without survivors if they are to be tested again."""
    lines = [json.loads(line) for line in record.read_text().splitlines()] if record.is_file() else []
    return {r["key"]: r for r in lines if not (again and r["end"] == "survived")}


def _measured(out: Path) -> CoverageMap:
    """Which tests execute which lines, measured again for a test file if it or any source has changed."""
    sources = b"".join(f.read_bytes() for f in sorted(SOURCES.rglob("*.py")))
    paths = {tests: out / f"{tests.stem}-{sha256(sources + tests.read_bytes()).hexdigest()[:16]}.json"
             for tests in sorted((ROOT / "tests").rglob("test_*.py")) if not any(e in str(tests) for e in _EXCLUDED)}
    missing = [each for each in paths.items() if not each[1].is_file()]
    typer.echo(f"measuring which lines {len(missing)} test files run")
    with ThreadPoolExecutor() as pool:
        list(pool.map(lambda each: in_process(partial(_measure, *each)), missing))
    found = CoverageMap()
    for path in paths.values():
        found.add(CoverageMap.read(path))
    return found


def _measure(tests: Path, path: Path) -> None:
    Measuring(SOURCES).run([*PLAIN, str(tests)]).write(path)


def _preload() -> None:
    for name in _PRELOADED:
        import_module(name)


def _check_without_mutant(coverage_map: CoverageMap, out: Path, seconds: float) -> None:
    """Exit unless the tests pass in a process of their own when nothing is mutated."""
    unchanged = Mutant(SOURCES / "errors.py", 1, "", "", (SOURCES / "errors.py").read_text())
    outcome = attempt(unchanged, _within(list(coverage_map.seconds), coverage_map, seconds), coverage_map.seconds, out)
    if outcome.end != "survived":
        raise SystemExit(f"without a mutant {outcome.by} fails in a process of its own")


def _tested(mutant: Mutant, coverage_map: CoverageMap, out: Path, seconds: float) -> dict[str, Any]:
    """Run the tests that execute the line of a mutant; return a line of the record."""
    begin, count, outcome = time.perf_counter(), 0, Outcome("survived", "", 0)
    for tests in _first_and_others(mutant, coverage_map):
        if outcome.end == "survived":
            outcome = _attempted(mutant, _within(tests, coverage_map, seconds), coverage_map.seconds, out)
            count += outcome.tests
    return {
        "key": mutant.key, "path": str(mutant.path.relative_to(SOURCES)), "line": mutant.line, "kind": mutant.kind,
        "change": mutant.change, "end": outcome.end, "by": outcome.by, "tests": count,
        "seconds": round(time.perf_counter() - begin, 1),
    }


def _first_and_others(mutant: Mutant, coverage_map: CoverageMap) -> tuple[list[str], list[str]]:
    """The tests that execute the line of a mutant: those of `FIRST_TESTS`, and the others."""
    tests, own = coverage_map.tests(mutant.path, mutant.line), FIRST_TESTS[mutant.path.relative_to(SOURCES).parts[0]]
    first = [t for t in tests if any(name in t for name in own)]
    return first, [t for t in tests if t not in first]


def _attempted(mutant: Mutant, tests: list[str], seconds: dict[str, float], out: Path) -> Outcome:
    """Run tests against a mutant; a timeout is repeated once, because a busy machine may have caused it."""
    outcome = attempt(mutant, tests, seconds, out)
    return attempt(mutant, tests, seconds, out) if outcome.end == "timeout" else outcome


def _report(results: list[dict[str, Any]]) -> None:
    for result in _survivors(results):
        typer.echo("\nsurvived: {path}:{line}  {kind}, {tests} tests\n{change}".format(**result))
    found = Counter(r["end"] for r in results)
    killed = found["killed"] + found["timeout"]
    typer.echo(f"\n{killed} of {len(results)} mutants killed ({killed / len(results):.1%}), "
               f"{found['timeout']} of them by hanging")


def _survivors(results: list[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    return (r for r in results if r["end"] == "survived")


if __name__ == "__main__":
    typer.run(main)
