"""Every public name has a page in the manual and a docstring with all that a reader needs, a tested example included.

The examples themselves are run by tests/pinned/test_doctests.py.
"""

from __future__ import annotations

import ast
import inspect
import re
import sys
from importlib import import_module
from typing import Any

import pytest

import gearchaos as gc
from tests import ROOT

sys.path.insert(0, str(ROOT / "docs" / "_ext"))
from docstring_sections import entries, sections

SUBPACKAGES = ("plot", "flow", "dynamics", "studies")
EXAMPLE = re.compile(r"^\s*>>> (?!import |from )(?!.*\+SKIP).*$", re.MULTILINE)


def public_names() -> dict[str, Any]:
    """Every public object by its name; an object that two packages export has the name of the first."""
    names = [f"gearchaos.{name}" for name in gc.__all__ if name not in SUBPACKAGES]
    names += [f"gearchaos.{package}.{name}" for package in SUBPACKAGES for name in getattr(gc, package).__all__]
    out: dict[str, Any] = {}
    for name in names:
        package, _, last = name.rpartition(".")
        value = getattr(import_module(package), last)
        if not any(value is other for other in out.values() if callable(other)):
            out[name] = value
    return out


PUBLIC = public_names()
DESCRIBED = {name: value for name, value in PUBLIC.items() if callable(value)}
CONSTANTS = [name for name in PUBLIC if name not in DESCRIBED and name != "gearchaos.__version__"]


def test_every_public_name_has_one_page():
    """The page of the interface lists what is exported, and nothing else; Sphinx writes a page for each entry."""
    text = (ROOT / "docs" / "reference" / "api.rst").read_text(encoding="utf-8")
    assert sorted(re.findall(r"^   (gearchaos\.[\w.]+)$", text, re.MULTILINE)) == sorted(PUBLIC)


@pytest.mark.parametrize("name", DESCRIBED)
def test_a_docstring_says_all(name):
    """One line, every argument, what is returned, and an example that is run."""
    value = DESCRIBED[name]
    found = sections(inspect.getdoc(value) or "")
    assert found[""].split("\n\n")[0].endswith("."), "the first sentence says what it is"
    assert EXAMPLE.search(found.get("Examples", "")), "no example that is run"
    if inspect.isfunction(value):
        listed = {n for entry in entries(found.get("Parameters", "")) for n in entry.names}
        assert listed >= set(inspect.signature(value).parameters)
        assert "Returns" in found or inspect.signature(value).return_annotation == "None"


def _described(package: str, name: str) -> bool:
    """Whether a text stands below the definition of a constant, in the module that defines it."""
    body = ast.parse(inspect.getsource(import_module(package))).body
    for node, after in zip(body, [*body[1:], None], strict=True):
        if isinstance(node, ast.ImportFrom) and name in [alias.name for alias in node.names]:
            return _described(str(node.module), name)
        targets = getattr(node, "targets", [getattr(node, "target", None)])
        assigned = [n for target in targets if target is not None for n in ast.walk(target) if isinstance(n, ast.Name)]
        if name in [n.id for n in assigned]:
            return isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
    return False


@pytest.mark.parametrize("name", CONSTANTS)
def test_a_constant_is_described_where_it_is_defined(name):
    assert _described(*name.rsplit(".", 1))
