"""Proofs from Python and from the command line: what they return, write and refuse."""

import json
import math
import subprocess
import sys
from fractions import Fraction

import numpy as np
import pytest
from flint import ctx

import gearchaos as gc
from gearchaos.errors import InputError
from gearchaos.model import HarmonicStiffness, SteppedStiffness, TransmissionError
from gearchaos.proof.balls import from_text, precision, to_text
from gearchaos.proof.certificate import REASONS, Certificate, Unproved, checksum
from gearchaos.proof.parameters import exact_parameters
from gearchaos.proof.prove import at_phase, prove_orbit
from tests.commands import ask, refused, run_json

EIGHT = ("--set", "omega=1", "--set", "q0=0.1", "--set", "eps1=0.206")
EIGHT_MODEL = gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206)
KEYS = {"format", "version", "theorem", "model", "coordinates", "phase", "period", "points", "radius", "bits",
        "switches", "stability", "margins", "versions", "sha256"}
SINGLE = {"kind": "single", "zeta": 0.025, "q0": 0.1, "eps1": 0.05, "omega": 2.3}


@pytest.fixture(scope="module")
def eight():
    """The proof of the paper's 8T motion."""
    result = gc.prove(EIGHT_MODEL)
    assert isinstance(result, Certificate)
    return result


def test_certificate_has_the_documented_form(eight):
    document = json.loads(json.dumps(eight.document))
    assert set(document) == KEYS and (document["format"], document["version"]) == ("gearchaos certificate", 1)
    assert document["sha256"] == checksum(document)
    assert (document["period"], document["coordinates"], document["phase"]) == (8, ["z", "z_dot"], "0x0p+0")
    assert np.shape(document["points"]) == (8, 2) and np.shape(document["stability"]["Q"]) == (8, 2, 2)
    assert len(document["switches"]) == 8
    assert (document["stability"]["inside"], document["stability"]["outside"]) == (2, 0)
    assert set(document["margins"]) == {"existence", "separation", "contact", "stability"}
    assert all(from_text(value) > 0 for value in document["margins"].values())


def test_theorem_in_words(eight):
    assert eight.theorem.startswith(
        "For the torsional model with the parameters below, in the coordinates z, z_dot, there is exactly one orbit of "
        f"period 8 mesh periods whose states at tau = k T (k = 0 ... 7) lie within {eight.document['radius']} of the ")
    assert "It repeats after no smaller number of mesh periods." in eight.theorem
    stable = "All 2 of its multipliers lie inside the unit circle: it is stable in these coordinates."
    assert eight.theorem.endswith(stable)
    verdict = gc.regime(EIGHT_MODEL)
    assert gc.prove(verdict).theorem == gc.prove(gc.orbit(verdict.model)).theorem == eight.theorem


@pytest.mark.slow
@pytest.mark.parametrize(("period", "stable", "unstable"), [(1, 1, 0), (3, 1, 1), (4, 2, 2), (5, 1, 1)])
def test_orbits_of_the_single_model(period, stable, unstable):
    """All orbits of the paper's figure 4, and the saddles beside them."""
    found = [gc.prove(orbit) for orbit in gc.orbits(gc.MeshModel.of(**SINGLE), period=period)]
    assert all(found) and all(isinstance(result, Certificate) and result.period == period for result in found)
    assert sorted(result.outside for result in found) == [0] * stable + [1] * unstable
    assert all("unstable" in result.theorem for result in found if result.outside)


@pytest.mark.parametrize("values", [
    {"kind": "full", "kappa": 1.0, "omega": 1.0, "q0": 0.17, "eps1": 0.1},
    {"kind": "full", "kappa1": 0.5, "kappa2": 0.6, "beta1": 0.02, "omega": 1.05, "q0": 0.1, "eps1": 0.03},
    {"kind": "full", "kappa1": 0.5, "kappa2": 0.6, "omega": 1.05, "q0": 0.1, "eps1": 0.03},
    {"kind": "full", "kappa": 0.5, "beta1": 0.02, "omega": 1.05, "q0": 0.1, "eps1": 0.03},
    {"beta1": 0.02, "omega": 1.3, "q0": 0.1, "eps1": 0.05},
    {"omega": 1.0, "q0": 0.1, "eps1": 0.1, "c1": 0.2, "c2": 0.05, "alpha1": 0.5},
    {"omega": 1.0, "q0": 0.1, "eps1": 0.05, "eps4": 0.02, "theta4": 1.0},
    {"omega": 1.3, "q0": 0.1, "eps1": 0.05, "stiffness": SteppedStiffness((1.25, 0.7, 1.1), (0.1, 0.4, 0.8))},
    {"omega": 1.2, "q0": 0.2, "error": TransmissionError(tuple(0.02 / j for j in range(1, 13)))},
    {"omega": 1.2, "q0": 0.2, "eps1": 0.02, "stiffness": HarmonicStiffness(tuple(0.1 / j for j in range(1, 9)))},
], ids=["full 11T", "d=7", "d=6", "d=5", "d=3", "fourier", "two harmonics", "steps", "12 harmonics",
        "series of 8"])
def test_all_kinds_of_models(values):
    result = gc.prove(gc.MeshModel.of(**values))
    assert isinstance(result, Certificate), result


def test_symmetry_decided_on_fractions():
    """β1/J1 = β2/J2 holds to rounding but not exactly: the proof has a coordinate more than the computation."""
    model = gc.MeshModel.of(J1=3.0, J2=1.5, q1=0.3, q2=0.15, beta1=0.3, beta2=0.15 + 3e-17, omega=1.3, eps1=0.05)
    assert gc.regime(model).period == 1 and gc.prove(model).document["coordinates"] == ["z", "z_dot", "x2_dot"]


def test_section_on_the_contact_boundary():
    """If z = 1 at the section of an orbit, another phase is chosen."""
    points = np.array([[1.0, 0.3]])
    result = prove_orbit(EIGHT_MODEL, points)
    assert isinstance(result, Unproved)
    assert (result.reason, result.bits) == ("section on the contact boundary", 512)
    assert at_phase(EIGHT_MODEL, points, 0.375).shape == (1, 2)


def test_another_phase_proves_the_same_orbit(eight):
    points = np.array([[float.fromhex(v) for v in point] for point in eight.document["points"]])
    result = prove_orbit(EIGHT_MODEL, at_phase(EIGHT_MODEL, points, 0.375), phase=0.375)
    assert isinstance(result, Certificate)
    assert (result.period, result.inside, result.document["phase"]) == (8, 2, to_text(Fraction(3, 8)))
    assert sum(map(len, result.document["switches"])) == sum(map(len, eight.document["switches"]))
    assert "tau = (k + 0.375) T" in result.theorem


def test_more_bits_are_tried():
    """An orbit known to 1e-6 with 53 bits to begin with."""
    model = gc.MeshModel.of(**SINGLE)
    orbit = gc.orbits(model, period=3)[0]
    points = np.stack([orbit.points["z"], orbit.points["z_dot"]], axis=1)
    assert isinstance(prove_orbit(model, points + 1e-6), Certificate)
    assert isinstance(prove_orbit(model, points, 53), (Certificate, Unproved))
    assert prove_orbit(model, points, 256).bits == 256


def test_precision_is_restored():
    before = ctx.prec
    with precision(77), precision(99):
        assert ctx.prec == 99
    with pytest.raises(ZeroDivisionError), precision(77):
        raise ZeroDivisionError
    assert ctx.prec == before


def test_numbers_as_text_are_exact():
    for value in (0.1, 1.0, -3.5, 0.0, 5e-324, float(2**70 + 2**30)):
        text = to_text(Fraction(value))
        assert from_text(text) == Fraction(value) and float.fromhex(text) == value
    assert from_text("0.1") == Fraction(1, 10) and from_text("-2.50e-3") == Fraction(-1, 400)
    for wrong in ("", "1.", ".5", "0x1", "1e", "nan", "inf", "1_0", "0X1p0", "1e99999", "0x1p99999", " 1"):
        with pytest.raises(ValueError, match="not a number"):
            from_text(wrong)


def test_parameters_are_the_exact_floats():
    model = gc.MeshModel.of(kind="full", omega=0.1, eps2=0.3, theta2=1.0, c1=0.1)
    exact = exact_parameters(model)
    assert from_text(exact["omega"]) == Fraction(0.1) and [float.fromhex(v) for v in exact["eps"]] == [0.0, 0.3]
    assert exact["stiffness"] == {"form": "fourier", "c": [to_text(Fraction(0.1))], "alpha": ["0x0p+0"]}
    assert set(exact_parameters(gc.MeshModel.of())).isdisjoint({"mu1", "kappa1"})


def test_unproved_is_data():
    result = Unproved("neutral", -0.5, 128)
    assert result.to_dict() == {
        "proved": False, "reason": "neutral", "meaning": REASONS["neutral"], "margin": -0.5, "bits": 128}
    assert not result.proved and not result
    assert "not proved, neutral" in result.in_words()


@pytest.mark.parametrize(("values", "label"), [
    ({"omega": 1.0, "q0": 0.1, "eps1": 0.21}, "chaotic"),
    ({"kind": "full", "kappa": 0.5, "omega": 1.05, "q0": 0.1, "eps1": 0.04}, "quasi-periodic")])
def test_motions_that_are_not_periodic(values, label):
    with pytest.raises(InputError, match=rf"prove must be given a periodic motion; got '{label}'"):
        gc.prove(gc.MeshModel.of(**values))


@pytest.mark.parametrize(("arguments", "words"), [
    ({"bits": 52}, "bits must be a whole number of at least 53"), ({"bits": 801}, "bits must be at most 800"),
    ({"phase": 1.0}, "phase must be in"), ({"phase": math.nan}, "phase must be in"),
    ({"points": [1.0, 2.0]}, "points must be an array"), ({"points": [[1.0, math.nan]]}, "points must be finite"),
    ({"points": [[1.0]]}, "points must have the 2 coordinates")])
def test_misuse_is_named(arguments, words):
    with pytest.raises(InputError, match=words):
        prove_orbit(gc.MeshModel.of(), **{"points": [[1.5, 0.0]], **arguments})


def test_bits_of_prove_are_checked_first():
    with pytest.raises(InputError, match="bits must be at most"):
        gc.prove(gc.MeshModel.of(), bits=10**6)


def test_flint_missing_is_named(monkeypatch):
    monkeypatch.setattr("gearchaos.studies.proofs.proofs.find_spec", lambda name: None)
    for prove in (gc.prove, lambda model: gc.Zones(model, "omega=1:2:2", "eps1=0:0.1:2", prove=True)):
        with pytest.raises(InputError, match=r'pip install "gearchaos\[proof\]"'):
            prove(gc.MeshModel.of())
    for command in (("regime", *EIGHT, "--prove"), ("verify", "x.json")):
        assert 'pip install "gearchaos[proof]"' in refused(*command)


def test_import_loads_no_flint_and_its_absence_is_named_by_the_package():
    code = ("import sys, gearchaos, gearchaos.cli, gearchaos.studies.proofs.proofs; assert 'flint' not in sys.modules\n"
            "sys.modules['flint'] = None\n"
            "try:\n    import gearchaos.proof.balls\nexcept ModuleNotFoundError as error:\n    print(error)")
    found = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert 'pip install "gearchaos[proof]"' in found.stdout


def test_regime_proves_and_writes(tmp_path):
    path = tmp_path / "eight.json"
    result = ask("regime", *EIGHT, "--prove", "--certificate", path, "--json", code=0)
    assert result.stderr.splitlines()[-1] == f"wrote {path}"
    proof, document = json.loads(result.stdout)["proof"], json.loads(path.read_text())
    assert proof["proved"] is True and proof["sha256"] == document["sha256"] == checksum(document)
    assert (proof["period"], proof["inside"], proof["outside"], proof["bits"]) == (8, 2, 0, 128)
    assert "proof" not in run_json("regime", *EIGHT)
    assert "proved with 128 bits" in ask("regime", *EIGHT, "--prove").stdout


def test_regime_says_why_there_is_no_proof(tmp_path):
    """Undamped free oscillations about a linear response fill a plane with 7T orbits: none of them is isolated."""
    values = {"kind": "single", "omega": 1.75, "zeta": 0, "q0": 0.25, "chi1": 0, "chi2": 0, "eps1": 0.0625,
              "z": 1.1666666, "z_dot": 0}
    path = tmp_path / "none.json"
    sets = [part for name, value in values.items() for part in ("--set", f"{name}={value}")]
    result = ask("regime", *sets, "--prove", "--certificate", path, "--json", code=0)
    document = json.loads(result.stdout)
    assert (document["label"], document["proof"]["proved"]) == ("7T", False)
    assert document["proof"]["reason"] == "Krawczyk not contracting"
    assert "no certificate: not proved, Krawczyk not contracting" in result.stderr and not path.exists()


@pytest.mark.parametrize(("arguments", "words"), [
    (("regime", *EIGHT, "--certificate", "a.json"), "--certificate needs --prove"),
    (("regime", *EIGHT, "--prove", "--certificate", "a.txt"), "--certificate must end in .json"),
    (("regime", *EIGHT, "--prove", "--certificate", "/nowhere/a.json"), "--certificate"),
    (("verify", "/nowhere/a.json"), "FILE must be a file")])
def test_commands_refuse(arguments, words):
    assert words in refused(*arguments)


@pytest.mark.parametrize(("values", "points", "reason"), [
    ({"omega": 1e-6}, [[1.1, 0.0]], "too many steps"),
    ({"omega": 1.7, "zeta": 0.0, "chi1": 0.0, "chi2": 0.0, "eps1": 0.0}, [[1.1, 0.0]], "neutral")])
def test_what_cannot_be_proved_has_a_reason(values, points, reason):
    """The second is the equilibrium of an undamped oscillator: its multipliers lie on the unit circle."""
    found = prove_orbit(gc.MeshModel.of(kind="single", q0=0.1, **values), np.array(points))
    assert not found.proved and found.reason == reason


def test_the_period_of_an_orbit_is_counted_in_mesh_periods():
    """With the second harmonic alone the equations have the period T/2, and this orbit 1.5 T."""
    model = gc.MeshModel.of(kind="single", omega=0.5239661637741589, zeta=0.025, q0=0.1, chi1=0.0, chi2=0.0,
                            eps2=0.07512675781710818)
    found = gc.prove(gc.orbit(model, period=3, near={"z": 1.27447736, "z_dot": -0.06112976}))
    assert found.proved and "It repeats after no smaller number of mesh periods." in found.theorem
    assert "minimal" not in found.theorem
