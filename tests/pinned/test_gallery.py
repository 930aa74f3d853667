"""The gallery: each script asks a question, and is short. The manual runs them and shows their pictures."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

from tests import ROOT

SCRIPTS = sorted((ROOT / "docs" / "gallery").glob("plot_*.py"))
MOST_LINES = 40


def test_there_are_enough_pictures():
    assert len(SCRIPTS) >= 20


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_a_script_asks_a_question_and_answers_it_in_a_few_lines(script):
    text = script.read_text(encoding="utf-8")
    title, rule, empty, *words = (ast.get_docstring(ast.parse(text)) or "").splitlines()
    assert title.endswith("?") and rule == "=" * len(title) and not empty and " ".join(words)
    code = [line for line in text.split('"""', 2)[2].splitlines() if line.strip() and not line.startswith("#")]
    assert len(code) <= MOST_LINES
    assert script.stem == "plot_" + re.sub(r"\W+", "_", title.lower()).strip("_"), "named by its question"


def test_the_readme_shows_six_pictures_of_the_gallery_that_load_fast():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    shown = re.findall(r"\]\((docs/pictures/\w+\.png)\)", readme)
    assert len(shown) == len(set(shown)) == 6
    for path in shown:
        assert (ROOT / path).stat().st_size < 100_000
        script = f"docs/gallery/plot_{Path(path).stem}.py"
        assert f"]({script})" in readme and (ROOT / script).exists()
    shelves = (ROOT / "docs", ROOT / "docs/explanation")
    pages = "".join(page.read_text(encoding="utf-8") for shelf in shelves for page in shelf.glob("*.md"))
    drawn = {path for path in (ROOT / "docs/pictures").glob("*.png") if f"pictures/{path.name})" not in pages}
    assert drawn == {ROOT / path for path in shown}
