"""Proofs of chaotic sets from Python and from the command line: what they return, write and refuse."""

import json

import pytest

import gearchaos as gc
from gearchaos.errors import InputError
from gearchaos.proof.balls import from_text
from gearchaos.proof.certificate import Unproved
from gearchaos.proof.families.chaos import ChaoticSet
from gearchaos.proof.verifier import growth
from gearchaos.studies.proofs import chaos_proof
from tests.chaotic_set import CHAOTIC, robust_chaos
from tests.commands import ask, run_json

OPTIONS = ("--set", "omega=1.6", "--set", "q0=0.1", "--set", "eps1=0.12")


@pytest.fixture(scope="module")
def robust():
    """A chaotic set for every eps1 within 1e-6 of 0.12."""
    result = robust_chaos()
    assert isinstance(result, ChaoticSet)
    return result


@pytest.mark.slow
def test_chaotic_set_for_an_interval_of_a_parameter(robust):
    assert robust.entropy >= 0.1 and robust.slack == 0.01
    assert robust.document["tolerances"] == {"eps1": "1e-06"} and min(map(len, robust.loops)) == 1
    assert all(word not in robust.theorem for word in ("attractor", "verdict", "chaotic motion"))
    assert "need not attract" in robust.theorem and "for every eps1 within 1e-6 of its value" in robust.theorem


@pytest.mark.slow
def test_file_is_verified(robust, tmp_path):
    robust.write(tmp_path / "set.json")
    ask("verify", tmp_path / "set.json", code=0)


def test_entropy_bound_is_below_the_root_for_two_loops(robust):
    """With loops of lengths a and L the growth is at most the root of λ^-a + λ^-L = 1."""
    weights = [from_text(text) for text in robust.document["weights"]]
    bound = float(growth(robust.document["transitions"], weights))
    lengths = [len(loop) for loop in robust.loops]
    assert sum(bound**-n for n in lengths) == pytest.approx(1, abs=1e-12)


def test_without_a_saddle_nothing_is_proved(monkeypatch):
    """The example in the docstring searches for saddles."""
    monkeypatch.setattr(chaos_proof, "saddles", lambda *_: [])
    result = gc.prove_chaos(gc.MeshModel.of(**CHAOTIC))
    assert isinstance(result, Unproved) and result.reason == "no saddle" and "no saddle" in result.in_words()


def test_more_than_two_coordinates_are_an_error():
    with pytest.raises(InputError, match="two coordinates"):
        gc.prove_chaos(gc.MeshModel.of(kind="full"))


@pytest.mark.parametrize("tolerances", [{"omega": 1e-6}, {"theta1": 1e-6}, {"eps1": -1.0}, {"eps1": "x"}])
def test_tolerances_of_other_names_or_values_are_errors(tolerances):
    with pytest.raises(InputError, match="tolerances"):
        gc.prove_chaos(gc.MeshModel.of(**CHAOTIC), tolerances=tolerances)


def test_command_proves_what_it_is_given_and_writes_a_file(robust, monkeypatch, tmp_path):
    asked = {}
    monkeypatch.setattr(chaos_proof, "prove_chaos", lambda model, **given: asked.update(given, model=model) or robust)
    path = tmp_path / "set.json"
    document = run_json("prove-chaos", *OPTIONS, "--tolerance", "eps1=1e-6", "--certificate", path)
    assert asked == {"model": gc.MeshModel.of(**CHAOTIC), "tolerances": {"eps1": 1e-6}}
    assert document["proved"] is True and document["entropy"] >= 0.1
    assert json.loads(path.read_text())["sha256"] == document["sha256"]


def test_command_refuses_a_tolerance_without_a_value():
    ask("prove-chaos", *OPTIONS, "--tolerance", "eps1", code=2)
