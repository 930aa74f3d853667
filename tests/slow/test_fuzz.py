"""Whatever is typed, written into a study file or done to a store: a result or one message, soon, and no traceback.

Cases are drawn from a seed (``GEARCHAOS_SEED``, 0 by default) by `fuzzing.cases`, which can also reproduce one.
"""

import json
import os
import re
import shutil

import pytest

from tests.slow.fuzzing import cases
from tests.slow.fuzzing.runner import CommandResult, CommandRunner

SEED = int(os.environ.get("GEARCHAOS_SEED", "0"))
FEW = {"command_line": 30, "operating_point": 5, "study_file": 15, "store": 12}
MANY = {"command_line": 800, "operating_point": 500, "study_file": 500, "store": 400}
"""How many cases of each kind are tried, in every run of the tests and in ``make slow``."""

_BAD = re.compile(r"Traceback|\b\w*Warning\b|Exception ignored|HDF5-DIAG|Segmentation|core dumped")


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """A folder with the stores, and a process that runs commands."""
    folder = tmp_path_factory.mktemp("fuzz")
    with CommandRunner(20.0, "this takes about") as trials:

        def sound(command):
            tried = trials.run(command, folder)
            assert tried.code == (3 if "--shard" in command else 0), tried

        cases.make_stores(folder, sound)
        yield trials, folder


def complaint(tried: CommandResult, folder) -> str | None:
    if tried.code == "stopped":
        return None
    if tried.code not in (0, 1, 2, 3):
        return "it must end by itself, with 0, 1, 2 or 3"
    if found := _BAD.search(tried.stderr + tried.stdout):
        return f"{found[0]} is not for users"
    errors = len(re.findall(r"^error: |^.{0,3}Error\b|^Usage: ", tried.stderr, re.MULTILINE))
    if tried.code == 2 and not errors:
        return "it must say what is wrong"
    if tried.code == 1 and tried.command[0] not in ("run", "paper", "check"):
        return "1 is for tiles that failed, for claims that do not hold and for damage"
    if tried.code == 3 and tried.command[0] not in ("run", "finish"):
        return "3 is for stores that are not finished"
    if tried.code == 0 and "--json" in tried.command and tried.command[-1] != "--help":
        json.loads(tried.stdout)
    drafts = [p.name for p in folder.rglob("*") if p.name.endswith(".partial") or p.name.startswith(".gearchaos-")]
    return f"it leaves {drafts}" if drafts else None


def tried(trials: CommandRunner, folder, kind: str, numbers: range) -> list[str]:
    wrong = []
    for number in numbers:
        here = folder / "case"
        shutil.rmtree(here, ignore_errors=True)
        here.mkdir()
        result = trials.run(cases.make(kind, SEED, number, here), here)
        if why := complaint(result, here):
            wrong.append(f"{kind} {SEED} {number}: {why}\n{result}")
    return wrong


@pytest.mark.parametrize(("kind", "count"), [
    *FEW.items(), *(pytest.param(*case, marks=pytest.mark.exhaustive) for case in MANY.items())])
def test_nothing_ends_in_a_traceback(kind, count, place):
    wrong = tried(*place, kind, range(count))
    assert not wrong, f"{len(wrong)} of {count}\n" + "\n\n".join(wrong[:20])


@pytest.mark.parametrize(("code", "said", "why"), [
    ("ended: more than 20 seconds", "", "must end by itself"), ("died with -11", "", "must end by itself"),
    (1, "", "1 is for tiles"), (2, "", "must say what is wrong"), (0, "Exception ignored in", "not for users"),
    (0, "Traceback (most recent call last)", "not for users"), (0, "x.py:1: RuntimeWarning: x", "not for users"),
    (0, "", "it leaves")])
def test_what_must_not_happen_is_noticed(code, said, why, tmp_path):
    (tmp_path / ".o.nc.1.partial").touch()
    assert why in complaint(CommandResult(["regime"], code, 0.1, stderr=said), tmp_path)
