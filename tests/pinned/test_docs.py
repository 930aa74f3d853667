"""Every script in the documents runs, and prints or finds what the text beside it says."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import pytest

from tests import ROOT
from tests.commands import ask

PAGES = sorted(p for p in (ROOT, ROOT / "docs", ROOT / "examples", ROOT / "benchmarks") for p in p.glob("*.md"))
_SCRIPT = re.compile(r"^```python\n(.*?)^```", re.MULTILINE | re.DOTALL)
_EXAMPLES = (ROOT / "docs" / "cli.md").read_text(encoding="utf-8").split("## Examples")[1]
HOWTO = sorted((ROOT / "docs" / "howto").glob("*.md"))
_BLOCK = re.compile(r"^```(python)?\n(.*?)^```", re.MULTILINE | re.DOTALL)
SCRIPTED = [pytest.param(page, marks=[pytest.mark.exhaustive] if page.name == "proofs.md" else [])  # 20 s of proofs
            for page in PAGES if _SCRIPT.search(page.read_text(encoding="utf-8"))]


def commands(text: str) -> list[str]:
    """The commands in a text, without "gearchaos"; a line that ends in a backslash goes on in the next one."""
    return re.findall(r"^gearchaos (?!examples)(.*)$", text.replace("\\\n", ""), re.MULTILINE)


_FEWER = [  # what takes long, and what runs the same program in less time
    (re.compile(r'(gc\.Axis\([^)]*, |:-?[\d.]+:)\d{2,}(?=[\s)"])'), r"\g<1>12"),
    (re.compile(r'\b500(:|, )(8000|3000)(?=[:,])'), r"1500\g<1>2000"),  # in one range to avoid: no edges to be found
    (re.compile(r"(samples[ =])\d+"), r"\g<1>64"),
    (re.compile(r'(--duration )"\d s"'), r'\g<1>"0.5 s"'),
]


def few(text: str) -> str:
    """A text with twelve values on each longer axis, and less of what else takes long."""
    text += "\n"
    for long, short in _FEWER:
        text = long.sub(short, text)
    return text


def _run(page: Path) -> dict:
    """What the scripts of a page leave behind, one after another."""
    left: dict = {}
    for script in _SCRIPT.findall(page.read_text(encoding="utf-8")):
        exec(compile(few(script), str(page), "exec"), left)
    return left


@pytest.fixture
def examples(tmp_path):
    """The study files of the manual, where its commands look for them."""
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    for file in (tmp_path / "examples").glob("*.toml"):
        file.write_text(few(file.read_text(encoding="utf-8")), encoding="utf-8")


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    """Files go to a folder of their own, figures to no screen."""
    monkeypatch.chdir(tmp_path)
    mpl.use("Agg")


@pytest.mark.slow
@pytest.mark.parametrize("page", SCRIPTED, ids=lambda page: page.name)
def test_scripts_run(page):
    _run(page)


@pytest.mark.slow
def test_example_commands_run(examples, tmp_path):
    """One after another in one folder: some read what others wrote."""
    for line in commands(_EXAMPLES):
        result = ask(*shlex.split(few(line)))
        assert result.exit_code == 0, (line, result.stderr)
        for name in re.findall(r"--(?:out|plot) (\S+)", line):
            assert (tmp_path / name).exists(), line


@pytest.mark.slow
@pytest.mark.parametrize("page", HOWTO, ids=lambda page: page.name)
def test_recipes_run(page, examples, monkeypatch):
    """Scripts and commands of a page, in order and in one folder; `gearchaos examples` would write what is there."""
    monkeypatch.setattr("gearchaos.datasheet.answer.default_speeds", lambda design: "1500:2000:2")
    fewer = str if page.name == "undecided.md" else few  # a map of fewer cells has no undecided one
    left: dict = {}
    for language, block in _BLOCK.findall(page.read_text(encoding="utf-8")):
        if language:
            exec(compile(fewer(block), str(page), "exec"), left)
            plt.close("all")
            continue
        for line in commands(block):
            result = ask(*shlex.split(fewer(line), comments=True))
            assert result.exit_code == 0, (line, result.stderr)


def test_the_first_script_says_what_the_readme_says(tmp_path):
    left = _run(ROOT / "README.md")
    assert left["verdict"].label == "8T"
    assert left["verdict"].contact == "two-sided"
    assert max(abs(m) for m in left["verdict"].multipliers) < 1
    assert (tmp_path / "zones.nc").stat().st_size > 0


@pytest.mark.slow
@pytest.mark.parametrize("whole", [False, pytest.param(True, marks=pytest.mark.exhaustive)])
@pytest.mark.parametrize("page", ["README.md", *(f"docs/{name}.md" for name in ("index", "gears", "cli", "model"))])
def test_a_page_shows_what_commands_print(page, whole):
    """Of `gear` daily what does not depend on the speeds; all takes two minutes. A line of dots stands for others."""
    text = (ROOT / page).read_text(encoding="utf-8").replace("\\\n", "")
    blocks = re.findall(r"^\$ gearchaos ([^\n]*)\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert blocks
    for command, shown in blocks:
        arguments = shlex.split(command.replace("examples/", f"{ROOT / 'examples'}/"))
        part = not whole and arguments[0] == "gear"
        printed = ask(*arguments, *(("--speed", "1500:1510:2") if part else ())).stdout
        lines = [line.rstrip() for line in printed.splitlines()]
        expected = shown.splitlines()
        if part:
            expected = re.split("Tried:|Elsewhere:", shown[max(shown.find("Spur gear pair"), 0):])[0].splitlines()
        assert any(len(line) > 20 for line in expected)
        if "..." in shown:
            assert [line for line in expected if line not in (*lines, "...")] == [], command
        else:
            assert "\n".join(expected) in "\n".join(lines) if part else expected == lines, command


def test_the_checks_of_the_method_print_what_its_table_says(capsys):
    """Rounding, and never nothing: a way compared with itself would print 0."""
    _run(ROOT / "docs" / "method.md")
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert [row[0] for row in rows] == ["single", "torsional", "full", "single"]
    for kind, zeta, median, largest, between in rows:
        assert 0 < float(between) < 1e-13, kind
        if float(zeta) < 1:
            assert float(median) < 2e-15, kind
            assert float(largest) < 1e-12, kind
