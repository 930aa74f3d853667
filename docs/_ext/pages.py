"""What the generators of reference pages share: Markdown tables, and files written only when they change."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table; vertical bars within cells are escaped."""
    lines = [list(header), ["---"] * len(header), *(list(row) for row in rows)]
    return "\n".join("| " + " | ".join(cell.replace("|", r"\|") for cell in line) + " |" for line in lines) + "\n"


def code(text: object) -> str:
    """A text as code; nothing stays nothing."""
    return f"`{text}`" if str(text) else ""


def write(path: Path, text: str) -> None:
    """Write a page unless the file has this text already, so that Sphinx does not read it again."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if not path.exists() or path.read_text(encoding="utf-8") != text:
        path.write_text(text, encoding="utf-8")


def generated(app: Any, name: str, page: Callable[[], str]) -> None:
    """Write the page docs/generated/reference/NAME.md when a build begins."""
    target = Path(app.srcdir) / "generated" / "reference" / f"{name}.md"
    app.connect("builder-inited", lambda _: write(target, page()), priority=100)
