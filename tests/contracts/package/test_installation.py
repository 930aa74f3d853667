"""`gearchaos doctor` and `--version --verbose`: what they say of a good installation and of broken ones; versions."""

import json
import re
import sys
import tempfile
import time
import tomllib
from importlib import metadata
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

from gearchaos import installation
from gearchaos.flow import cache_directory, processor
from gearchaos.flow import target as processor_module
from tests import ROOT
from tests.commands import ask, run_json
from tests.oracles import scipy_oracle

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]


def outcome(name: str) -> installation.Check:
    return next(c for c in installation.checks() if c.name == name)


@pytest.mark.slow
def test_a_good_installation_is_called_good():
    found = run_json("doctor")
    assert found["ok"], found
    required = ["packages", "temporary folder", "clock", "kernel cache", "kernels", "orbit", "files"]
    status = {c["name"]: c["status"] for c in found["checks"]}
    assert list(status)[:7] == required and {status[n] for n in required} == {"ok"}
    assert set(status) - set(required) == {*installation.extras(), "a proof"}
    assert all((c["mend"] == "") == (c["status"] == "ok") for c in found["checks"])
    assert "bit for bit" in outcome("orbit").detail or re.search(r"values to \de-1[3-6]$", outcome("orbit").detail)


def test_what_cannot_be_imported_is_named_with_what_to_do(monkeypatch):
    for name in ("h5netcdf", "flint"):
        monkeypatch.setitem(sys.modules, name, None)
    lines = ask("doctor", code=1).stdout.splitlines()
    assert lines[0].startswith("FAILED   packages: h5netcdf cannot be imported (ModuleNotFoundError: import of")
    assert lines[1] == "         → pip install --upgrade --force-reinstall gearchaos"
    assert re.match(r"failed: packages, files, (docs, )?proof", lines[-1])  # docs depends on proof
    assert '         → pip install "gearchaos[proof]" --upgrade' in lines
    assert any(line.startswith("ok       orbit") for line in lines)


def test_a_cache_that_cannot_be_written_is_named_with_what_to_do(monkeypatch):
    """That kernels are compiled without it is in test_cache.py."""
    monkeypatch.setattr("gearchaos.flow.cache_directory", lambda: Path("/proc/nowhere/sources"))
    monkeypatch.setattr("gearchaos.flow.on_compile", lambda tell: tell())
    found = {c["name"]: c for c in json.loads(ask("doctor", "--json", code=1).stdout)["checks"]}
    assert re.match(r"/proc/nowhere/\w+ cannot be written \(No such file", found["kernel cache"]["detail"])
    assert "set NUMBA_CACHE_DIR to a folder that you may write in" in found["kernel cache"]["mend"]
    assert re.match(r"compiled \d in", found["kernels"]["detail"]) and found["orbit"]["status"] == "ok"


def test_a_wrong_orbit_fails(monkeypatch):
    (z, v), *others = installation.STORED
    for stored, difference in ((((z + 2e-12, v), *others), "2.0e-12"), (((z, v - 1e-3), *others), "1.0e-03"),
                               (installation.STORED[:2], "inf")):
        monkeypatch.setattr(installation, "STORED", stored)
        check = outcome("orbit")
        assert check.status == "failed"
        assert check.detail.startswith(f"it differs by {difference} from its stored values")
        assert "Do not use results of this installation" in check.mend
    monkeypatch.setattr(installation, "STORED", ((z + 5e-13, v), *others))
    assert outcome("orbit").detail == "equal to its stored values to 5e-13"
    monkeypatch.setattr(installation, "computed", lambda: [(np.nan, np.nan)] * 3)
    assert outcome("orbit").status == "failed", "not a number is not near"


def test_the_stored_orbit_is_that_of_the_oracle():
    """Three periods after its first state, of a transmission error of 0.1 at τ = 0, it has been through all of them."""
    z, z_dot = installation.STORED[0]
    found = scipy_oracle.section(installation.model().with_values({"x1": z + 0.1, "x1_dot": z_dot}), 3)
    states = sorted(zip(found["z"].tolist(), found["z_dot"].tolist(), strict=True))
    assert np.abs(np.array(states) - np.array(sorted(installation.STORED))).max() < 1e-11


def test_folders_and_clocks(monkeypatch):
    now = time.time()
    monkeypatch.setattr(time, "time", lambda: now - 3e8)
    assert outcome("clock").status == "failed" and "before this version" in outcome("clock").detail
    monkeypatch.setattr(time, "time", lambda: now + 1000)
    assert re.match("it differs by (99|100)[0-9] s from that", outcome("clock").detail)
    monkeypatch.undo()
    monkeypatch.setattr(tempfile, "tempdir", "/proc/nowhere")
    check = outcome("temporary folder")
    assert check.status == "failed" and check.mend == "Set TMPDIR to a folder that you may write in."


def test_an_unexpected_error_is_an_outcome(monkeypatch):
    monkeypatch.setattr(installation, "computed", lambda: 1 / 0)
    assert outcome("kernels").detail == "ZeroDivisionError: division by zero"
    assert "gearchaos --version --verbose" in outcome("kernels").mend


def test_a_missing_part_is_no_failure(monkeypatch):
    version, missing = metadata.version, Mock(side_effect=metadata.PackageNotFoundError)
    monkeypatch.setattr(metadata, "version", lambda name: (missing if name == "distributed" else version)(name))
    run = ask("doctor", code=0)
    assert run.stdout.splitlines()[-1] == "all that is required works"
    assert ("missing  cluster: runs on Dask and Slurm (gearchaos run --scheduler, --cluster): distributed is missing\n"
            '         → pip install "gearchaos[cluster]"\n') in run.stdout


def test_a_version_that_is_too_old_is_a_problem(monkeypatch):
    monkeypatch.setattr(metadata, "version", lambda name: "0.1")
    assert "numba 0.1 is installed, but numba<0.69,>=0.63 is needed" in outcome("packages").detail
    assert outcome("app").status == "failed"


def test_every_extra_is_either_described_or_for_developers():
    declared, developers = set(PROJECT["optional-dependencies"]), set(installation.DEVELOPERS_EXTRAS)
    assert developers <= declared and declared - developers <= set(installation.EXTRAS)
    assert set(installation.extras()) == installation.EXTRAS.keys() and "docs" not in installation.EXTRAS


def test_the_requirements_are_those_of_the_project():
    named = {re.match(r"[\w-]+", r)[0] for r in PROJECT["dependencies"]}
    found = {r.name for r in installation.requirements()}
    assert found and found <= named
    assert {r.name for r in installation.requirements("app")} == {"bokeh", "tomlkit"}
    assert not installation.requirements("nothing")


def test_a_report_has_versions_processor_and_cache():
    found = installation.report()
    assert found["packages"]["numba"] == metadata.version("numba") and "llvmlite" in found["packages"]
    assert found["kernel_cache"]["folder"] == str(cache_directory())
    files = list(cache_directory().rglob("*.nb[ic]"))
    assert found["kernel_cache"]["bytes"] == sum(f.stat().st_size for f in files)
    assert json.loads(json.dumps(found)) == found
    assert run_json("--version", "--verbose")["packages"] == found["packages"]
    lines = ask("--version", "--verbose").stdout.splitlines()
    assert lines[0].split() == ["gearchaos", metadata.version("gearchaos")]
    assert any(re.fullmatch(rf"kernel cache +{re.escape(str(cache_directory()))} \(\d+ kernels, \d+ MiB\)", line)
               for line in lines)


@pytest.mark.parametrize(("features", "expected"), [
    ("+avx512f,+avx2,+fma", ("AVX-512", 512, True)), ("+avx2,-fma,-avx512f", ("AVX2", 256, False)),
    ("+neon", ("NEON", 128, True)), ("", ("unknown", 0, False)),
])
def test_the_processor_is_the_one_that_kernels_are_compiled_for(monkeypatch, features, expected):
    for name, value in (("CPU_FEATURES", features), ("CPU_NAME", "generic")):
        monkeypatch.setattr(processor_module.config, name, value)
    found = processor()
    assert (found.name, found.instruction_set, found.vector_bits, found.fma) == ("generic", *expected)


@pytest.mark.parametrize("option", ["--verbose", "--json"])
def test_options_of_the_version_need_it(option):
    assert f"error: {option} needs --version before the command" in ask(option, "regime", code=2).stderr


def test_the_version_is_stated_once():
    """pyproject.toml has it; what cannot read it from there says the same."""
    version = PROJECT["version"]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    headings = re.findall(r"^## ([\d.]+)", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert headings[0] == version
    sources = (ROOT / "src").rglob("*.py")
    assert not [f for f in sources if re.search(rf"[\"']{re.escape(version)}[\"']", f.read_text(encoding="utf-8"))]
    installed = metadata.version("gearchaos")
    assert ask("--version").stdout == f"gearchaos {installed}\n"
    assert run_json("--version") == {"gearchaos": installed}


def test_the_examples_of_the_manual_are_written_and_what_is_there_is_kept(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    expected = {file.name: file.read_bytes() for file in (ROOT / "examples").iterdir() if file.is_file()}
    folder = Path("examples")
    for _ in range(2):
        ask("examples", code=0)
        assert {file.name: file.read_bytes() for file in folder.iterdir()} == expected
    (folder / "fig02.toml").write_text("[model]\n")
    (folder / "fig03.toml").unlink()
    said = ask("examples", code=2).stderr
    assert "--out must not have other files of the same names; got 'examples/fig02.toml'" in said
    assert (folder / "fig02.toml").read_text() == "[model]\n" and not (folder / "fig03.toml").exists()
    ask("examples", "--out", "examples/fig04.toml", code=2)
