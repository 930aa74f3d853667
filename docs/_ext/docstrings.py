"""Docstrings made ready for Sphinx: the descriptions of constants, and absolute values.

autodoc finds the text below a constant only in the module it is asked about; the constants of `gearchaos.flow`,
`gearchaos.dynamics` and `gearchaos.plot` are documented where they are defined. In reStructuredText |z| is a
substitution, of which there are none here.
"""

from __future__ import annotations

import ast
import inspect
import re
from importlib import import_module
from typing import Any

from sphinx.pycode import ModuleAnalyzer


def defining_module(package: str, name: str) -> str | None:
    """The module from which a package imports a name; None if it imports no such name."""
    for node in ast.parse(inspect.getsource(import_module(package))).body:
        if isinstance(node, ast.ImportFrom) and name in [alias.name for alias in node.names]:
            return node.module
    return None


def described(package: str, name: str) -> list[str]:
    """The lines below the definition of a constant; empty if there are none."""
    module: str | None = package
    while module is not None:
        found = ModuleAnalyzer.for_module(module).find_attr_docs().get(("", name))
        if found:
            return list(found)
        module = defining_module(module, name)
    return []


_LITERAL = re.compile(r"(``.*?``)")


def escaped(line: str) -> str:
    """A line with vertical bars escaped outside of code."""
    if line.lstrip().startswith((">>>", "...")):
        return line
    parts = _LITERAL.split(line)
    return "".join(part if i % 2 else part.replace("|", r"\|") for i, part in enumerate(parts))


def _prepare(app: Any, what: str, name: str, obj: Any, options: Any, lines: list[str]) -> None:
    """Replace the docstring of a constant's type by the constant's own description, and escape vertical bars.

    Fields of named tuples are described in the class, not by their numbers.
    """
    if what == "data" and name.startswith("gearchaos."):
        lines[:] = described(*name.rsplit(".", 1))
    if lines and lines[0].startswith("Alias for field number"):
        lines.clear()
    lines[:] = map(escaped, lines)


def setup(app: Any) -> dict[str, Any]:
    """Run before numpydoc reads the lines."""
    app.connect("autodoc-process-docstring", _prepare, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
