"""Pages of the manual that are files of the repository outside docs/, with their links made to fit.

The files are copied when a build begins, and links from the pages in docs/ to these files lead to the copies.
"""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import Any

from pages import generated

ROOT = Path(__file__).parents[2]
COPIES = {
    "benchmarks/README.md": "benchmarks",
    "examples/README.md": "examples",
    "CHANGELOG.md": "changes",
    "CONTRIBUTING.md": "contributing",
}
"""Files of the repository, and the names of their pages."""

_LINK = re.compile(r"(?<!!)\[([^\]]*)\]\(([^)#\s]*)(#[^)\s]*)?\)")


def relinked(text: str, folder: Path) -> str:
    """A text of a file in ``folder`` with each link to a page of the manual made absolute; links to other files of the
    repository become code."""
    return _LINK.sub(partial(_relinked, folder=folder), text)


def _relinked(match: re.Match[str], folder: Path) -> str:
    """One link."""
    words, target, anchor = match[1], match[2], match[3] or ""
    if not target or "://" in target or target.startswith("/"):
        return match[0]
    path = (folder / target).resolve()
    if not path.is_relative_to(ROOT) or not path.exists():
        return match[0]  # left as it is, for Sphinx to warn of
    name = path.relative_to(ROOT).as_posix()
    if name in COPIES:
        return f"[{words}](/generated/reference/{COPIES[name]}.md{anchor})"
    if name.startswith("docs/"):
        return f"[{words}](/{name.removeprefix('docs/')}{anchor})"
    return words if words.startswith("`") else f"{words} (`{name}`)" if words != name else f"`{name}`"


def copied(file: str) -> str:
    """The text of a page that is a copy."""
    source = ROOT / file
    return relinked(source.read_text(encoding="utf-8"), source.parent)


def _read(app: Any, docname: str, content: list[str]) -> None:
    """Links of the pages in docs/ to files outside."""
    source = Path(app.env.doc2path(docname))
    if source.suffix == ".md" and "generated" not in docname:
        content[0] = relinked(content[0], source.parent)


def setup(app: Any) -> dict[str, Any]:
    """Copy the files before Sphinx reads the sources."""
    for file, name in COPIES.items():
        generated(app, name, partial(copied, file))
    app.connect("source-read", _read)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
