"""The dimensionless model: names, defaults, waveforms and every rule that input must obey."""

import pickle

import numpy as np
import pytest

from gearchaos import model as models
from gearchaos.errors import InputError
from gearchaos.model import HarmonicStiffness, MeshModel, TransmissionError, TwoLevelStiffness, vary


def test_short_names_set_pairs_and_any_harmonic():
    """Defaults and short names of every pair are in tests/closed_forms/test_waveforms.py."""
    model = MeshModel.of(q0=0.05, chi0=0.1, eps3=0.02, theta3=0.5)
    assert (model.q1, model.q2, model.stiffness) == (0.05, 0.05, TwoLevelStiffness(0.1, 0.1))
    assert model.error == TransmissionError((0.0, 0.0, 0.02), (0.0, 0.0, 0.5))


def test_amplitudes_of_a_fourier_stiffness_make_it_one():
    assert MeshModel.of(c1=0.2).stiffness == HarmonicStiffness((0.2,))
    assert MeshModel.of(alpha2=0.5, c2=0.1, kind="full").stiffness == HarmonicStiffness((0.0, 0.1), (0.0, 0.5))
    assert MeshModel.of(c1=0.2).with_values({"c1": 0.3, "omega": 2.0}).stiffness == HarmonicStiffness((0.3,))
    assert MeshModel.of(omega=2.0).stiffness == TwoLevelStiffness(0.25, 0.25, 1.5)


def test_short_names_take_whole_waveforms_and_starts():
    two, series, error = TwoLevelStiffness(0.1, 0.2, 1.7), HarmonicStiffness((0.2, 0.1)), TransmissionError((0.1,))
    assert MeshModel.of(stiffness=two).stiffness == two
    model = MeshModel.of(stiffness=series, error=error, initial={"z": 0.5}, kind="single", c1=0.3)
    assert model == MeshModel(kind="single", stiffness=HarmonicStiffness((0.3, 0.1)), error=error, initial={"z": 0.5})
    assert MeshModel().with_values({"stiffness": series}).stiffness == series
    assert MeshModel.of(initial={"x1": 0.5}, x2=0.1).initial == {"x1": 0.5, "x2": 0.1}


@pytest.mark.parametrize(("make", "message", "advice"), [
    (lambda: MeshModel.of(c1=0.2, chi1=0.1), "chi1 must be a parameter of a two-level stiffness", "Fourier series"),
    (lambda: MeshModel.of(stiffness=TwoLevelStiffness(), c1=0.2), "c1 must be a parameter of a Fourier", "two levels"),
    (lambda: MeshModel().with_values({"c1": 0.2}), "c1 must be a parameter of a Fourier stiffness", "MeshModel.of"),
    (lambda: vary(MeshModel(), {"alpha1": [0.1]}), "alpha1 must be a parameter of a Fourier", "HarmonicStiffness"),
    (lambda: vary(MeshModel.of(c1=0.2), {"chi0": [0.1]}), "chi0 must be a parameter of a two-level", "Fourier series"),
    (lambda: MeshModel(stiffness=0.3), "stiffness must be a TwoLevelStiffness, a HarmonicStiffness", "chi1"),
    (lambda: MeshModel.of(stiffness="soft"), "stiffness must be a TwoLevelStiffness, a HarmonicStiffness", "c1"),
    (lambda: MeshModel.of(error=0.1), "error must be a TransmissionError; got 0.1", "eps1"),
    (lambda: MeshModel.of(initial=1.0), "initial must be a mapping of coordinates to values", "x1"),
    (lambda: MeshModel(initial=None), "initial must be a mapping of coordinates to values", "x1"),
])
def test_waveforms_that_contradict_each_other_are_refused_with_what_to_do(make, message, advice):
    with pytest.raises(InputError, match=f"^{message}") as error:
        make()
    assert advice in error.value.advice


def test_the_kind_changes_bearing_friction_only_where_it_was_the_default():
    assert MeshModel().with_values({"kind": "single"}).beta1 == 0.0
    assert MeshModel(kind="single").with_values({"kind": "torsional"}).beta1 == 0.01
    with pytest.raises(InputError, match="must be 0 in the single model"):
        MeshModel.of(beta=0.02).with_values({"kind": "single"})


def test_models_are_values():
    model = MeshModel.of(eps1=0.1, x1=0.5)
    assert pickle.loads(pickle.dumps(model)) == model and hash(model) == hash(MeshModel.of(eps1=0.1, x1=0.5))
    assert repr(model) == (
        "MeshModel(kind='torsional', error=TransmissionError(amplitudes=(0.1,), phases=(0.0,)), initial={'x1': 0.5})")


def test_waveforms_are_those_of_the_paper():
    two = MeshModel(stiffness=TwoLevelStiffness(0.2, 0.1, 1.25))
    assert models.mesh_stiffness(two, np.array([0.0, 1.5, 1.6, 6.2])).tolist() == [1.2, 1.2, 0.9, 0.9]
    assert models.backlash(np.array([-3.0, -1.0, 0.4, 1.0, 2.5])).tolist() == [-2.0, 0.0, 0.0, 0.0, 1.5]


BAD = [
    ({"omega": 0.0}, r"omega must be greater than 0; got 0\.0"),
    ({"omega": float("nan")}, "omega must be a finite number; got nan"),
    ({"q0": float("inf")}, "q1 must be a finite number"), ({"zeta": -0.1}, "zeta must not be negative"),
    ({"beta1": -0.1}, "beta1 must not be negative"), ({"J2": 0.0}, "J2 must be greater than 0"),
    ({"mu1": -4}, "mu1 must be greater than 0"), ({"kappa": 0.0}, "kappa1 must be greater than 0"),
    ({"contact_ratio": 2.1}, r"contact_ratio must lie in \[1, 2\]; got 2\.1"),
    ({"contact_ratio": 0.9}, r"contact_ratio must lie in \[1, 2\]"), ({"chi2": 1.0}, "chi2 must be less than 1"),
    ({"chi1": -1.0}, "chi1 must be greater than -1"), ({"zeta_support": -0.1}, "zeta_support1 must not be negative"),
    ({"x1": float("nan")}, "initial.x1 must be a finite number"), ({"omgea": 1.0}, "Did you mean 'omega'"),
    ({"eps0": 1.0}, "Did you mean 'eps1'"), ({"omega": "fast"}, "omega must be a number; got 'fast'"),
    ({"y1": 1.0}, "initial value|must be one of"), ({"eps99": 0.1}, "order at most 64"),
    ({"kind": "triple"}, "must be one of full, single, torsional"),
]


@pytest.mark.parametrize(("values", "message"), BAD, ids=[str(v) for v, _ in BAD])
def test_bad_values_are_named_with_rule_and_value(values, message):
    with pytest.raises(InputError, match=message):
        MeshModel().with_values(values)


@pytest.mark.parametrize(("kind", "values", "message"), [
    ("torsional", {"omega": [1.0, -2.0]}, r"omega must be greater than 0; got -2\.0"),
    ("torsional", {"omega": [1.0, 2.0], "q0": [1.0, 2.0, 3.0]}, "one common length"),
    ("single", {"z": [1.0, 2.0], "x1": [1.0, 2.0]}, "either z, z_dot or the x coordinates"),
    ("torsional", {"kappa": [1.0, 2.0]}, "must be a parameter of the torsional model"),
])
def test_batches_obey_the_same_rules(kind, values, message):
    assert vary(MeshModel(kind=kind), {"omega": [1.0, 2.0]}).size == 2
    with pytest.raises(InputError, match=message):
        vary(MeshModel(kind=kind), values)
