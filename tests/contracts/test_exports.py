"""The public names as users, type checkers and editors see them."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

import gearchaos

PACKAGE = Path(gearchaos.__file__).parent
ROOT = Path(__file__).parents[2]
SCRIPT = """
import gearchaos as gc

model: gc.MeshModel = gc.MeshModel.of(omega=1.0)
reveal_type(gc.zones)
reveal_type(gc.plot.zones)
gc.zones(model, "omega=0.5:1:3", "q0=0:1:3", strats=2)
gc.nonsense
"""


def stub() -> dict[str, str]:
    """The names that the stub exports, each with the module it is from."""
    imports = [n for n in ast.parse((PACKAGE / "__init__.pyi").read_text()).body if isinstance(n, ast.ImportFrom)]
    assert all(a.asname == a.name for n in imports for a in n.names), "a stub exports what it imports `as` itself"
    return {a.name: n.module for n in imports for a in n.names}


def test_the_stub_agrees_with_what_is_imported_on_first_use():
    modules = {name: f"gearchaos.{module}" for name, module in gearchaos._MODULES.items()}
    assert stub() == modules | dict.fromkeys(gearchaos._SUBPACKAGES, "gearchaos")


@pytest.mark.parametrize("name", gearchaos.__all__)
def test_every_public_name_is_there(name):
    assert getattr(gearchaos, name) is not None and name in dir(gearchaos)


def test_a_type_checker_sees_names_and_signatures(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    command = [sys.executable, "-m", "mypy", "--config-file", "pyproject.toml", str(script)]
    environment = {**os.environ, "MYPYPATH": str(PACKAGE.parent)}
    run = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=300)
    lines = run.stdout.splitlines()
    assert "def (model: gearchaos.model" in lines[0] and "starts: int" in lines[0], run.stdout + run.stderr
    assert lines[0].endswith('-> xarray.core.dataset.Dataset"')
    assert 'Revealed type is "def (' in lines[1]
    assert 'Unexpected keyword argument "strats"' in run.stdout and 'no attribute "nonsense"' in run.stdout
    assert "Found 2 errors" in lines[-1]


def test_a_wheel_holds_types_templates_and_data():
    wheel = pytest.importorskip("hatchling.builders.wheel", reason="hatchling is not installed")
    packed = {file.distribution_path for file in wheel.WheelBuilder(str(ROOT)).recurse_included_files()}
    sources = {
        f.relative_to(PACKAGE.parent).as_posix() for f in PACKAGE.rglob("*")
        if f.is_file() and "__pycache__" not in f.parts
    }
    assert {"gearchaos/py.typed", "gearchaos/__init__.pyi", "gearchaos/paper/settings.toml"} <= packed
    assert packed == sources
