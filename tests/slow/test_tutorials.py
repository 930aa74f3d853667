"""The tutorials: every cell runs in a real kernel, and shows or prints something sensible."""

from __future__ import annotations

import re
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

FOLDER = Path(__file__).parents[2] / "docs" / "tutorials"
NAMES = ("a_long_run", "coexistence_and_basins", "continuation", "paper_in_ten_figures", "the_explorer_in_a_notebook",
         "your_own_gear")
_CELL = re.compile(r"^```\{code-cell\} python\n(?::tags:[^\n]*\n\n)?(.*?)^```", re.MULTILINE | re.DOTALL)


def executed(name: str, folder: Path) -> list:
    """The outputs of all cells of a tutorial."""
    sources = _CELL.findall((FOLDER / f"{name}.md").read_text(encoding="utf-8"))
    cells = [nbformat.v4.new_code_cell(source.strip()) for source in sources]
    notebook = nbformat.v4.new_notebook(cells=cells)
    resources = {"metadata": {"path": str(folder)}}
    NotebookClient(notebook, timeout=240, kernel_name="python3", resources=resources).execute()
    return [output for cell in notebook.cells for output in cell.outputs]


@pytest.mark.parametrize("name", NAMES)
def test_a_tutorial_runs(name, tmp_path):
    outputs = executed(name, tmp_path)
    pictures = [o for o in outputs if "image/png" in o.get("data", {})]
    cards = [o for o in outputs if "gearchaos-card" in str(o.get("data", {}).get("text/html", ""))]
    printed = "".join(o.text for o in outputs if o.output_type == "stream" and o.name == "stdout")
    assert cards and (pictures or name == "the_explorer_in_a_notebook")
    if name == "paper_in_ten_figures":
        assert len(pictures) == 10
    if name == "a_long_run":
        assert "ended by signal 9\n" in printed and re.search(r"(\d+) of \1 tiles done, 0 failed", printed)
        assert "\nTrue\n" in printed, "the same numbers as without interruption"
        assert "must hold the same study" in printed
