"""``python -m tests.mutation``: try a random sample of mutants, or go on with it, and say how many were found."""

from __future__ import annotations

import json
import time
from collections import Counter
from collections.abc import Iterator
from functools import partial
from hashlib import sha256
from importlib import import_module
from itertools import accumulate
from pathlib import Path
from typing import Annotated, Any

import typer
from tests.mutation.covering import Covering, Measuring
from tests.mutation.mutants import Mutant, sample
from tests.mutation.trial import PLAIN, Outcome, attempt, in_process

ROOT = Path(__file__).parents[2]
SOURCES = ROOT / "src" / "gearchaos"
FLOORS = {
    "quantities": ("quantities", "model"), "validation.py": ("limits", "model"),
    "model": ("model", "waveforms", "switched", "coordinates"),
    "gears": ("gearpair", "plot_units"), "dynamics": ("verdict", "reading", "spectrum", "motion"),
    "studies": ("refine", "sweeps", "catalogue", "boundary", "coordinates", "records", "limits", "studies"),
    "store": ("progress", "engines", "stores", "runs"),
}
"""What is mutated, and the tests that are tried first, since most of its mutants die of them."""

_LEFT_OUT = ("app", "explorer", "paper", "cache", "docs", "fuzz", "full_disk")
"""Beginnings of the names of tests that are too slow, or of other floors."""

_WARM = (
    "numba", "scipy.stats", "scipy.signal", "scipy.ndimage", "xarray", "zarr", "h5netcdf", "matplotlib.pyplot", "pint",
    "psutil", "typer", "rich.progress",
)
"""Imported once, before processes are forked."""


def main(
    count: Annotated[int, typer.Option(help="How many mutants.")] = 300,
    seed: Annotated[int, typer.Option(help="Another seed gives other mutants.")] = 0,
    only: Annotated[str, typer.Option(help="Only files whose path has this in it.")] = "",
    out: Annotated[Path, typer.Option(help="Folder of the results.")] = ROOT / "build" / "mutation",
    seconds: Annotated[float, typer.Option(help="Of tests to run against a mutant: the quickest first.")] = 20.0,
    again: Annotated[bool, typer.Option(help="Try those again that survived.")] = False,
) -> None:
    """Try mutants and write a line of JSON for each; those tried before with the same sources are not tried again."""
    out.mkdir(parents=True, exist_ok=True)
    covering, mutants = _covering(out), sample(_files(only), count, seed)
    record, known = out / "mutants.jsonl", _known(out / "mutants.jsonl", again)
    _warm_up()
    _control(covering, out, seconds)
    with record.open("a") as lines:
        for mutant in (m for m in mutants if m.key not in known):
            known[mutant.key] = _tried(mutant, covering, out, seconds)
            lines.write(json.dumps(known[mutant.key]) + "\n")
            lines.flush()
            typer.echo("{end:9}{seconds:6.1f} s  {path}:{line}  {kind}".format(**known[mutant.key]))
    _report([known[m.key] for m in mutants])


def _files(only: str) -> list[Path]:
    every = [f for floor in FLOORS for f in sorted((SOURCES / floor).glob("*.py")) or [SOURCES / floor]]
    return [f for f in every if only in str(f)]


def _enough(tests: list[str], covering: Covering, limit: float) -> list[str]:
    """The first of these tests, as far as the time goes."""
    ends = accumulate(covering.seconds[test] for test in tests)
    return [test for test, end in zip(tests, ends, strict=True) if end < limit]


def _known(record: Path, again: bool) -> dict[str, dict[str, Any]]:
    """Earlier results by the mutants' keys."""
    lines = [json.loads(line) for line in record.read_text().splitlines()] if record.is_file() else []
    return {r["key"]: r for r in lines if not (again and r["end"] == "survived")}


def _covering(out: Path) -> Covering:
    """Which tests run which lines: measured anew for a file of tests if it, or any source, has changed."""
    found, sources = Covering(), b"".join(f.read_bytes() for f in sorted(SOURCES.rglob("*.py")))
    for tests in sorted((ROOT / "tests").glob("test_*.py")):
        path = out / f"{tests.stem}-{sha256(sources + tests.read_bytes()).hexdigest()[:16]}.json"
        if tests.stem[5:].startswith(_LEFT_OUT):
            continue
        if not path.is_file():
            typer.echo(f"measuring which lines {tests.name} runs")
            in_process(partial(_measure, tests, path))
        found.add(Covering.read(path))
    return found


def _measure(tests: Path, path: Path) -> None:
    Measuring(SOURCES).run([*PLAIN, str(tests)]).write(path)


def _warm_up() -> None:
    for name in _WARM:
        import_module(name)


def _control(covering: Covering, out: Path, seconds: float) -> None:
    """Without a fault all tests must pass here, too."""
    sound = Mutant(SOURCES / "model.py", 1, "", "", (SOURCES / "model.py").read_text())
    outcome = attempt(sound, _enough(list(covering.seconds), covering, seconds), covering.seconds, out)
    if outcome.end != "survived":
        raise SystemExit(f"without a fault {outcome.by} fails in a process of its own")


def _tried(mutant: Mutant, covering: Covering, out: Path, seconds: float) -> dict[str, Any]:
    """A line of the record."""
    begin, count, outcome = time.perf_counter(), 0, Outcome("survived", "", 0)
    for tests in _in_turn(mutant, covering):
        if outcome.end == "survived":
            outcome = _attempted(mutant, _enough(tests, covering, seconds), covering.seconds, out)
            count += outcome.tests
    return {
        "key": mutant.key, "path": str(mutant.path.relative_to(SOURCES)), "line": mutant.line, "kind": mutant.kind,
        "change": mutant.change, "end": outcome.end, "by": outcome.by, "tests": count,
        "seconds": round(time.perf_counter() - begin, 1),
    }


def _in_turn(mutant: Mutant, covering: Covering) -> tuple[list[str], list[str]]:
    """The tests that may find a mutant: those of its own floor, then the others."""
    tests, own = covering.tests(mutant.path, mutant.line), FLOORS[mutant.path.relative_to(SOURCES).parts[0]]
    first = [t for t in tests if Path(t.split("::")[0]).stem[5:] in own]
    return first, [t for t in tests if t not in first]


def _attempted(mutant: Mutant, tests: list[str], seconds: dict[str, float], out: Path) -> Outcome:
    """A hang counts if it happens twice: a busy machine may have been to blame."""
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
