"""The examples in docstrings give the results that stand below them."""

import doctest
from importlib import import_module
from pathlib import Path

import matplotlib as mpl
import pytest

import gearchaos
from gearchaos.flow import parallel_compilation

PACKAGE = Path(gearchaos.__file__).parent


def modules_with_examples() -> list[str]:
    """Dotted names of the modules whose source has a doctest."""
    files = [f for f in sorted(PACKAGE.rglob("*.py")) if ">>> " in f.read_text()]
    return [".".join(f.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__") for f in files]


@pytest.fixture(autouse=True)
def _as_before(monkeypatch):
    """Pictures go to no screen, and no kernels are compiled beside others after the example that asks for it."""
    mpl.use("Agg")
    monkeypatch.setattr(parallel_compilation, "_allowed", False)


@pytest.mark.slow
@pytest.mark.parametrize("name", modules_with_examples())
def test_examples_in_docstrings(name):
    result = doctest.testmod(import_module(name))
    assert result.attempted > 0 and result.failed == 0


def test_the_package_itself_has_an_example():
    assert "gearchaos" in modules_with_examples()
