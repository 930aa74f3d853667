"""The public names as users, type checkers and editors see them."""

import ast
import inspect
import os
import re
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

import gearchaos
from gearchaos.studies.core import generate
from gearchaos.studies.core.registry import STUDIES
from tests import ROOT

PACKAGE = Path(gearchaos.__file__).parent
SCRIPT = """
import gearchaos as gc

model: gc.MeshModel = gc.MeshModel.of(omega=1.0)
reveal_type(gc.zones)
reveal_type(gc.plot.zones)
gc.zones(model, "omega=0.5:1:3", "q0=0:1:3", strats=2)
gc.nonsense
"""
VALUES = """
import gearchaos as gc

def use(pair: gc.GearPair) -> None:
    x, y = gc.Axis("omega", 0.5, 1.0, 3), "q0=0:1:3"
    reveal_type(gc.run(gc.Regime(pair)))
    reveal_type(gc.run(gc.Zones(pair, x, y, starts=2)))
    reveal_type(gc.run(gc.Zones(pair, x, y), out="zones.zarr"))
    gc.Simulate(pair, 10, 5), gc.Bifurcation(pair, "omega=1:2:3"), gc.Basins(pair, "z=0:1:3", "v=0:1:3")
    gc.Attractors(pair, 4, sweep="omega=1:2:3")
    gc.Zones(gc.GearDesign(teeth=(20, 40), module="3 mm", face_width="20 mm"), x, y)
    gc.Zones(pair, x, y, 2)
"""


def test_the_files_made_from_the_studies_are_those_that_are_checked_in():
    """After a change of a study: python -m gearchaos.studies.core.generate."""
    for path, text in generate.files().items():
        assert path.read_text(encoding="utf-8") == text, path


def test_every_study_is_found_wherever_it_stands_below_the_studies(monkeypatch, tmp_path):
    (tmp_path / "room_of_a_test").mkdir()
    (tmp_path / "room_of_a_test" / "__init__.py").touch()
    (tmp_path / "room_of_a_test" / "study_of_a_test.py").write_text(
        "from gearchaos.studies.core.study import Study\n\n\nclass Own(Study):\n    kind = 'own'\n")
    every = {"attractors", "basins", "bifurcation", "branch", "curve", "edge_state", "fit", "manifolds", "orders",
             "rattle", "regime", "runup", "scatter", "simulate", "skeleton", "zones"}
    assert {study.kind for study in generate.all_studies()} == set(STUDIES) == every
    monkeypatch.setattr(gearchaos.studies, "__path__", [*gearchaos.studies.__path__, str(tmp_path)])
    assert {study.kind for study in generate.all_studies()} == {*every, "own"}


def test_the_stub_has_every_public_name():
    body = ast.parse((PACKAGE / "__init__.pyi").read_text()).body
    imported = [a for node in body if isinstance(node, ast.ImportFrom) for a in node.names]
    defined = [node.name for node in body if isinstance(node, (ast.FunctionDef, ast.ClassDef))]
    assert sorted([*(a.asname for a in imported if a.asname == a.name), *defined, "__version__"]) == sorted(
        gearchaos.__all__)


@pytest.mark.parametrize("kind", STUDIES)
def test_a_function_has_the_arguments_of_its_study_and_those_of_a_run(kind):
    study, function = STUDIES[kind], inspect.signature(getattr(gearchaos, kind)).parameters
    fields, of_run = inspect.signature(study).parameters, {option.name for option in study.run_options}
    expected = {name: (parameter.default, parameter.kind) for name, parameter in fields.items()}
    assert {n: (p.default, p.kind) for n, p in function.items() if n not in of_run} == expected
    assert of_run <= set(function) and of_run.isdisjoint(fields)


@pytest.mark.parametrize("name", gearchaos.__all__)
def test_every_public_name_is_there(name):
    assert getattr(gearchaos, name) is not None and name in dir(gearchaos)


@pytest.mark.slow
def test_a_type_checker_sees_names_and_signatures_and_knows_what_studies_accept_and_a_run_returns(tmp_path):
    for name, script in (("names", SCRIPT), ("values", VALUES)):
        (tmp_path / f"{name}.py").write_text(script)
    command = [sys.executable, "-m", "mypy", "--config-file", "pyproject.toml", *map(str, sorted(tmp_path.iterdir()))]
    environment = {**os.environ, "MYPYPATH": str(PACKAGE.parent)}
    run = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=300)
    *lines, found = run.stdout.splitlines()
    names, values = ([line for line in lines if f"{name}.py:" in line] for name in ("names", "values"))
    assert "def (model: gearchaos.model" in names[0] and "starts: int" in names[0], names
    assert names[0].endswith('-> xarray.core.dataset.Dataset"') and 'Revealed type is "def (' in names[1]
    assert 'Unexpected keyword argument "strats"' in names[2] and 'no attribute "nonsense"' in names[-1]
    assert [line.split('"')[1].split(".")[-1] for line in values[:3]] == ["Dataset", "Dataset", "Outcome"], values
    assert [line for line in values if "error" in line] == [values[3]] and "Too many positional arguments" in values[3]
    assert "Found 3 errors" in found


def test_a_wheel_holds_types_templates_and_data():
    wheel = pytest.importorskip("hatchling.builders.wheel", reason="hatchling is not installed")
    packed = {file.distribution_path for file in wheel.WheelBuilder(str(ROOT)).recurse_included_files()}
    sources = {f.relative_to(PACKAGE.parent).as_posix() for f in PACKAGE.rglob("*")
               if f.is_file() and "__pycache__" not in f.parts}
    assert {"gearchaos/py.typed", "gearchaos/__init__.pyi", "gearchaos/paper/settings.toml"} <= packed
    assert packed == sources | {f"gearchaos/{file.relative_to(ROOT)}" for file in (ROOT / "examples").rglob("*")
                                if file.is_file() and "__pycache__" not in file.parts}
    assert {Path(name).suffix for name in sources} <= {".py", ".pyi", ".typed", ".toml", ".j2", ".css", ".js"}


def test_the_source_distribution_builds_the_same_wheel(tmp_path):
    """From what is in it alone, and with the same content, byte for byte; it holds no file that git ignores."""
    sdist = pytest.importorskip("hatchling.builders.sdist", reason="hatchling is not installed")
    wheel = pytest.importorskip("hatchling.builders.wheel")
    (archive,) = sdist.SdistBuilder(str(ROOT)).build(directory=str(tmp_path / "sdist"))
    with tarfile.open(archive) as file:
        file.extractall(tmp_path, filter="data")
    (unpacked,) = tmp_path.glob("gearchaos-*")
    assert {"tests", "docs", "examples", "Makefile", "constraints.txt", "LICENSE"} <= set(os.listdir(unpacked))
    assert not {".venv", "dist", "report", "build"} & set(os.listdir(unpacked))
    built = []
    for number, source in enumerate((ROOT, unpacked)):
        (made,) = wheel.WheelBuilder(str(source)).build(directory=str(tmp_path / str(number)))
        with zipfile.ZipFile(made) as file:
            built.append({name: file.read(name) for name in file.namelist()})
    assert built[0] == built[1]


def test_every_function_that_the_flow_exports_is_called_above_it():
    above = "\n".join(p.read_text() for p in PACKAGE.rglob("*.py") if PACKAGE / "flow" not in p.parents)
    functions = {name for name in gearchaos.flow.__all__ if inspect.isfunction(getattr(gearchaos.flow, name))}
    assert "near_returns" in functions and all(re.search(rf"\b{name}\b", above) for name in functions)


def test_pictures_compute_no_spectra_of_their_own():
    assert not any("fft." in p.read_text() for p in (PACKAGE / "plot").glob("*.py"))
