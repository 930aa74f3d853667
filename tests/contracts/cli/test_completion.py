"""Completion in shells: what Bash's own function answers, and the protocols of Zsh and Fish."""

import os
import shutil
import subprocess
import sys
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

import gearchaos as gc
from gearchaos.cli import app, completion
from gearchaos.model import KINDS, MeshModel
from gearchaos.proof.families.events import KINDS as EVENTS
from gearchaos.studies.core.axis import as_range, parse_axis
from tests import EXAMPLES

PROGRAM = f'#!/bin/sh\nexec {sys.executable} -c "from gearchaos.cli import main; main()" "$@"\n'


@pytest.fixture
def environment(tmp_path):
    """An environment in which the command `gearchaos` is that of these sources."""
    (tmp_path / "bin").mkdir()
    program = tmp_path / "bin" / "gearchaos"
    program.write_text(PROGRAM)
    program.chmod(0o755)
    return {**os.environ, "PATH": f"{program.parent}:{os.environ['PATH']}", "HOME": str(tmp_path)}


def ask(words: list[str], monkeypatch) -> list[str]:
    """What is completed where Bash has split a line into these words, of which the last one is incomplete."""
    monkeypatch.setenv("_GEARCHAOS_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", "\n".join(["gearchaos", *words]))
    monkeypatch.setenv("COMP_CWORD", str(len(words)))
    monkeypatch.setattr(completion, "_name_before", "")
    completion.join_words()
    run = CliRunner().invoke(app, [], prog_name="gearchaos", env=dict(os.environ), catch_exceptions=False)
    return run.stdout.split()


@pytest.mark.parametrize(("line", "expected"), [
    ("regi", "regime"), ("regime --ph", "--physical"), ("regime --set omeg", "omega=1"), ("regime --set c1", "c1=0"),
    ("regime --set ki", "kind=single kind=torsional kind=full"), ("regime --set kind =", "single torsional full"),
    ("regime --set kind = si", "single"), ("regime --set speed", "speed=1500"),
    ("regime --set damping_law = c", "contact"), ("regime --set x1_", "x1_dot=0"), ("regime --set nothing = 1", ""),
    ("regime --set omega = 1 --set chi", "chi0= chi1= chi2="), ("regime --set omega = 2", ""),
    ("zones --axis omega = 0 : 1 : 3 --axis eps", "eps1=0:0.3:200"), ("zones --axis omega = 0.2 :", "0.2:3:200"),
    ("basins --axis z_", "z_dot=-3:3:200"),
    ("branch --axis omeg", "omega=0.2:3"), ("branch --start z_", "z_dot=0"), ("branch --start omega", ""),
    ("curve --event f", "fold flip"), ("paper --quality d", "draft"), ("bifurcation --mode u", "up"),
    ("plot map.nc --colour dyn", "dynamic_factor"), ("script --for j", "julia"), ("plot map.nc --style s", "slides"),
    ("plot map.nc --style paper --width c", "column"),
    ("attractors --sweep zet", "zeta= zeta_support= zeta_support1= zeta_support2=")])
def test_bash_gets_what_follows_its_word_breaks(line, expected, monkeypatch):
    assert ask(line.split(), monkeypatch) == expected.split()


def test_values_of_gears_are_those_of_the_study_file(monkeypatch):
    line = f"regime {EXAMPLES / 'spur_50_50.toml'} --set"
    assert ask([*line.split(), "design.q"], monkeypatch) == ["design.quality.standard=", "design.quality.grade="]
    assert ask([*line.split(), "design.quality.g"], monkeypatch) == ["design.quality.grade=6"]
    assert ask([*line.split(), "design.modu"], monkeypatch) == ["design.module="]
    assert ask(["regime", "none.toml", "--set", "design.q"], monkeypatch) == []


def test_colours_are_variables_of_the_result(monkeypatch, tmp_path):
    found = gc.zones(gc.MeshModel.of(q0=0.1), "omega=0.9:1.1:2", "eps1=0.1:0.2:2")
    gc.save(found[["label", "period", "v_rms"]], tmp_path / "map.nc")
    assert ask(["plot", f"{tmp_path}/map.nc", "--colour", ""], monkeypatch) == ["motion", "v_rms", "label", "period"]
    gc.run(gc.Zones(gc.MeshModel.of(q0=0.1), "omega=0.9:1.1:2", "eps1=0.1:0.2:2"), out=tmp_path / "map.zarr")
    names = ask(["plot", f"{tmp_path}/map.zarr", "--colour", ""], monkeypatch)
    assert set(names[1:]) <= set(found.data_vars) and "attractors" not in names and "contact" in names


def test_choices_are_those_that_commands_take():
    assert completion._KINDS == KINDS
    found = completion.choices("fold", "flip", "neimark-sacker", "graze")
    assert set(found(None, "")) == set(EVENTS)


def test_what_is_completed_is_accepted():
    names = [row.rstrip("=") for row in completion.values(SimpleNamespace(params={}, args=[]), "")]
    for name in names:
        for assignment in completion.values(SimpleNamespace(params={}, args=[]), f"{name}="):
            given, _, value = assignment.partition("=")
            if given not in ("kind", "speed", "torque"):
                found = value if given == "damping_law" else float(value)
                MeshModel.of(kind="single" if given in ("z", "z_dot") else "full", **{given: found})
    for name in [row.rstrip("=") for row in completion.axes(None, "")]:
        assert parse_axis(completion.axes(None, f"{name}=")[0], "--axis").name == name
    for name in [row.rstrip("=") for row in completion.ranges(None, "")]:
        assert as_range(completion.ranges(None, f"{name}=")[0], "--axis").name == name


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("bash") is None, reason="Bash is not installed")
def test_bash_completes_by_the_function_that_is_shown(environment):
    script = """
eval "$(gearchaos --show-completion bash)"
answer() { COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); _gearchaos_completion gearchaos; echo "${COMPREPLY[@]}"; }
answer gearchaos reg
answer gearchaos regime --set kind = si
answer gearchaos zones --axis om
"""
    run = subprocess.run(["bash", "--norc", "-c", script], env=environment, capture_output=True, text=True, timeout=120)
    assert (run.stdout.splitlines(), run.stderr) == (["regime", "single", "omega=0.2:3:200"], "")


@pytest.mark.slow
def test_zsh_and_fish_are_answered(environment):
    def answer(shell, **more):
        asked = {"_GEARCHAOS_COMPLETE": f"complete_{shell}", "_TYPER_COMPLETE_ARGS": "gearchaos regime --set kind=si"}
        return subprocess.run(["gearchaos"], env={**environment, **asked, **more}, capture_output=True, text=True,
                              timeout=120).stdout

    assert "kind=single" in answer("zsh")
    assert answer("fish", _TYPER_COMPLETE_FISH_ACTION="get-args") == "kind=single\n"


@pytest.mark.slow
@pytest.mark.parametrize(("shell", "file"), [
    ("bash", ".bash_completions/gearchaos.sh"), ("zsh", ".zfunc/_gearchaos"),
    ("fish", ".config/fish/completions/gearchaos.fish")])
def test_completion_is_installed(environment, tmp_path, shell, file):
    environment["_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION"] = "1"
    subprocess.run(["gearchaos", "--install-completion", shell], env=environment, capture_output=True, check=True)
    assert "_GEARCHAOS_COMPLETE" in (tmp_path / file).read_text()
