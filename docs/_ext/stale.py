"""Generated pages whose source is gone are removed before a build; Sphinx would warn of them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any


def stale(docs: Path) -> Iterator[Path]:
    """Pages of scripts that the gallery no longer has, and of names that the interface no longer has."""
    scripts = {script.stem for script in (docs / "gallery").glob("plot_*.py")}
    for file in (docs / "generated" / "gallery").rglob("*plot_*"):
        stem = re.match(r"(?:sphx_glr_)?(plot_\w+?)(?:_\d{3}|_thumb|_codeobj)?\.", file.name)
        if stem and stem[1] not in scripts:
            yield file
    named = set((docs / "reference" / "api.rst").read_text(encoding="utf-8").split())
    for file in (docs / "generated" / "api").glob("*.rst"):
        if file.stem.removesuffix("-class") not in named:
            yield file


def _remove(app: Any) -> None:
    """Remove them."""
    for file in stale(Path(app.srcdir)):
        file.unlink()


def setup(app: Any) -> dict[str, Any]:
    """Remove them before the other extensions write theirs."""
    app.connect("builder-inited", _remove, priority=10)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
