"""The paper's defaults, waveforms at any phase, and the least value of a stiffness series."""

import numpy as np
import pytest

from gearchaos.errors import InputError
from gearchaos.model import HarmonicStiffness, MeshModel, TransmissionError, mesh_stiffness, transmission_error, vary


def test_all_defaults_are_those_of_the_documentation():
    """As docs/model.md lists them."""
    pairs = {"J": 2.0, "q": 0.1, "beta": 0.01, "mu": 4.0, "kappa": 0.5, "zeta_support": 0.01, "chi": 0.25}
    expected = {"omega": 1.0, "zeta": 0.025, "eps1": 0.0, "theta1": 0.0, "contact_ratio": 1.5,
                **{f"{name}{n}": value for name, value in pairs.items() for n in (1, 2)}}
    for kind in ("torsional", "full"):
        assert MeshModel(kind=kind).parameters() == expected
    assert MeshModel(kind="single").parameters() == {**expected, "beta1": 0.0, "beta2": 0.0}


@pytest.mark.parametrize("name", ["q0", "J", "beta", "mu", "kappa", "zeta_support", "chi0"])
def test_a_short_name_sets_both_of_its_pair_and_nothing_else(name):
    both = {f"{name.removesuffix('0')}{n}": 0.37 for n in (1, 2)}
    full = MeshModel(kind="full").parameters()
    assert MeshModel.of(kind="full", **{name: 0.37}).parameters() == {**full, **both}


@pytest.mark.parametrize("phase", np.linspace(0, 6, 5))
def test_a_stiffness_below_zero_at_any_phase_is_refused_with_its_least_value(phase):
    with pytest.raises(InputError) as refusal:
        HarmonicStiffness((1.2,), (phase,))
    assert refusal.value.value == pytest.approx(-0.2, abs=1e-3) and refusal.value.value <= -0.2


def test_large_harmonics_are_allowed_where_they_cancel():
    """1 + a cos θ + b cos 2θ with c = cos θ is 1 − b + ac + 2bc², least at c = −a/4b: 1 − b − a²/8b."""
    for a, b in ((0.8, 0.3), (0.7, 0.7), (1.0, 0.4)):
        least = 1 - b - a**2 / (8 * b)
        assert least > 0.05
        HarmonicStiffness((a, b))
        scale = 1.02 / (1 - least)  # so that the least value is just below zero
        with pytest.raises(InputError) as refusal:
            HarmonicStiffness((a * scale, b * scale))
        assert refusal.value.value == pytest.approx(1 - scale * (1 - least), abs=2e-3)


def test_each_point_of_a_batch_has_its_own_least_stiffness():
    model = MeshModel(stiffness=HarmonicStiffness((0.5, 0.1)))
    vary(model, {"c1": [0.8, 0.9], "c2": [0.3, 0.3]})
    with pytest.raises(InputError) as refusal:
        vary(model, {"c1": [0.1, 0.8, 1.5], "c2": [0.1, 0.3, 0.3], "alpha1": [0.0, 0.0, 2.0]})
    theta = np.linspace(0, 2 * np.pi, 100_001)
    least = (1 + 1.5 * np.cos(theta - 2.0) + 0.3 * np.cos(2 * theta)).min()
    assert refusal.value.value == pytest.approx(least, abs=2e-3)
    with pytest.raises(InputError, match="above 0"):
        vary(model, {"c1": [0.9, 0.9], "c2": [0.05, 0.2], "alpha2": [0.0, np.pi]})


def test_waveforms_of_several_harmonics_and_their_second_derivative():
    model = MeshModel(omega=1.7, error=TransmissionError((0.1, 0.0, 0.05), (0.3, 0.0, 1.1)),
                      stiffness=HarmonicStiffness((0.2, 0.1), (0.5,)))
    tau, w = np.linspace(0, 9, 60), 1.7
    error = 0.1 * np.exp(1j * (w * tau - 0.3)), 0.05 * np.exp(1j * (3 * w * tau - 1.1))
    for n in (0, 1, 2):
        expected = (error[0] * (1j * w) ** n + error[1] * (3j * w) ** n).real
        np.testing.assert_allclose(transmission_error(model, tau, n), expected, atol=1e-13)
    chi = 1 + 0.2 * np.cos(w * tau - 0.5) + 0.1 * np.cos(2 * w * tau)
    np.testing.assert_allclose(mesh_stiffness(model, tau), chi, atol=1e-14)


def test_harmonics_left_out_are_none():
    model = MeshModel.of(eps3=0.05, theta3=1.0)
    assert model.error == TransmissionError((0.0, 0.0, 0.05), (0.0, 0.0, 1.0))
    assert model.with_values({"theta1": 0.5}).error == TransmissionError((0.0, 0.0, 0.05), (0.5, 0.0, 1.0))
    amplitudes, phases = vary(MeshModel(), {"eps2": [0.1, 0.2]}).harmonics("eps", "theta")
    np.testing.assert_array_equal(amplitudes, [[0, 0], [0.1, 0.2]])
    np.testing.assert_array_equal(phases, np.zeros((2, 2)))


def test_a_start_in_z_replaces_one_in_x_and_the_other_way_round():
    model = MeshModel.of(kind="single", x1=0.5, x1_dot=0.2)
    turned = model.with_values({"z": 2.0})
    assert dict(turned.initial) == {"z": 2.0}
    assert dict(turned.with_values({"z_dot": 1.0}).initial) == {"z": 2.0, "z_dot": 1.0}
    assert dict(turned.with_values({"x2": 1.0}).initial) == {"x2": 1.0}
    assert dict(model.with_values({"omega": 2.0}).initial) == {"x1": 0.5, "x1_dot": 0.2}


def test_another_kind_keeps_what_was_chosen():
    torsional = MeshModel.of(kind="full", beta1=0.03, kappa=0.7).with_values({"kind": "torsional"})
    assert (torsional.beta1, torsional.beta2, torsional.kappa1) == (0.03, 0.01, 0.7)


@pytest.mark.parametrize("values", ["0.1", b"0.1", 0.1, None])
def test_amplitudes_must_be_a_list(values):
    with pytest.raises(InputError, match=r"error\.amplitudes must be a list of numbers"):
        TransmissionError(values)
    with pytest.raises(InputError, match=r"stiffness\.phases must be a list of numbers"):
        HarmonicStiffness((0.1,), values)
