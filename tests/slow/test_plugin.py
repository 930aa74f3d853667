"""The example of a package that adds to gearchaos, installed and not installed, in processes of its own."""

import json
import os
import subprocess
import sys

import pytest

from tests import EXAMPLES, ONE_SPRING, ROOT

FILE = """
[model]
kind = "single"
omega = 0.8
[model.error]
amplitudes = [0.1]
[model.stiffness]
kind = "late pair"
"""
STUDY = """
[study]
kind = "linear_response"
axis = "omega=0.5:1.8:4"
"""
SHOWN = """
import json
from gearchaos.datasheet.quantities import datasheet
from gearchaos.explorer.core.presets import presets
from gearchaos.explorer.web.form import parameter_form
from gearchaos.studyfile import load_design
first = presets()["2"].view
menu = next(menu for menu in parameter_form(first, (), first).menus if menu.name == "stiffness")
design = load_design({path!r}, {{"speed": "1500 rpm", "torque": "100 N*m"}})
print(json.dumps([[name for name, _ in menu.options], [name for name in datasheet(design) if name.startswith("Kv_")]]))
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """A folder in which the package is installed from its sources."""
    pytest.importorskip("hatchling", reason="hatchling is not installed")
    folder = tmp_path_factory.mktemp("plugin")
    subprocess.run([sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-build-isolation",
                    "--no-index", "--target", folder / "site", EXAMPLES / "plugin"], check=True)
    (folder / "model.toml").write_text(FILE)
    (folder / "study.toml").write_text(FILE + STUDY)
    return folder / "site"


def python(site, *arguments, installed=True):
    """What a Python process does in the folder of the study files, with the package installed or not."""
    path = [str(ROOT / "src"), *[str(site)] * installed]
    return subprocess.run([sys.executable, *arguments], cwd=site.parent, capture_output=True, text=True,
                          env={**os.environ, "PYTHONPATH": os.pathsep.join(path)})


def test_an_installed_package_is_known_by_its_names_and_another_is_missed_in_one_message(site):
    command = ("-m", "gearchaos")
    done = python(site, *command, "run", "study.toml", "--out", "s.zarr")
    assert done.returncode == 0, done.stderr
    document = json.loads(python(site, *command, "regime", "model.toml", "--json").stdout)
    assert document["label"] == "1T"
    document = json.loads(python(site, *command, "linear-response", "study.toml", "--json").stdout)
    assert document["study"] == "linear_response"

    missed = {"run": ("study.toml", "study.kind"), "regime": ("model.toml", "model.stiffness.kind")}
    for name, (file, field) in missed.items():
        options = ("--out", "s.zarr") if name == "run" else ()
        done = python(site, *command, name, file, *options, installed=False)
        assert done.returncode == 2 and done.stderr.count("\n") == 1
        assert done.stderr.startswith(f"error: {field} must be one of ")
        assert "No installed package offers it" in done.stderr
    done = python(site, *command, "info", "s.zarr", installed=False)
    assert done.returncode == 2 and done.stderr.count("\n") == 1
    assert "The store was made with gearchaos-example 0.1.0: install it again." in done.stderr


def test_its_stiffness_is_in_the_menu_of_the_explorer_and_its_standard_on_the_datasheet(site):
    pytest.importorskip("bokeh")
    found = {}
    for installed in (True, False):
        done = python(site, "-c", SHOWN.format(path=str(ONE_SPRING)), installed=installed)
        assert done.returncode == 0, done.stderr
        found[installed] = json.loads(done.stdout)
    (kinds, factors), (own_kinds, own_factors) = found[True], found[False]
    assert kinds == [*own_kinds, "late pair"] and set(factors) - set(own_factors) == {"Kv_Barth"}
