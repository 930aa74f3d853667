"""Response measures of motions against closed forms and against what sampled motions show."""

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.dynamics.response import CONTACTS, compute_response
from gearchaos.flow import Measure


def test_the_response_of_a_sinusoidal_motion():
    """In permanent contact with constant stiffness z − 1 − q0 = Re A e^iωτ, with A = εω²/(1 − ω² + 2iζω)."""
    omega, zeta, q0, eps = 1.7, 0.05, 0.5, 0.02
    model = gc.MeshModel.of(kind="single", omega=omega, zeta=zeta, q0=q0, eps1=eps, chi0=0.0)
    found = gc.regime(model)
    amplitude = eps * omega**2 / abs(1 - omega**2 + 2j * zeta * omega)
    force = amplitude * abs(1 + 2j * zeta * omega)
    assert found.z_rms == pytest.approx(amplitude / np.sqrt(2), rel=1e-9)
    assert found.z_peak_to_peak == pytest.approx(2 * amplitude, rel=1e-9)
    assert found.z_dot_rms == pytest.approx(omega * amplitude / np.sqrt(2), rel=1e-9)
    assert found.z_dot_peak_to_peak == pytest.approx(2 * omega * amplitude, rel=1e-9)
    assert found.v_rms == pytest.approx(omega * amplitude / np.sqrt(2), rel=1e-9)
    assert found.dynamic_factor == pytest.approx((q0 + force) / q0, rel=1e-9)
    assert (found.contact, found.contact_fraction, found.switches_per_period) == ("permanent", 1, 0)


@pytest.mark.parametrize("eps", [1e-10, 1e-8, 1e-6])
def test_the_rms_of_a_small_vibration_about_a_large_deflection(eps):
    """To the rounding of z, 2e-16, in a verdict and on a branch, where it is combined from the periods of an orbit."""
    omega, q0 = 1.3, 0.5
    model = gc.MeshModel.of(kind="single", omega=omega, q0=q0, eps1=eps, chi0=0.0)
    rms = eps * omega**2 / abs(1 - omega**2 + 2j * model.zeta * omega) / np.sqrt(2)
    for found in (gc.regime(model).z_rms, gc.branch(model, "omega=1.3:1.31").z_rms[0]):
        assert float(found) == pytest.approx(rms, rel=1e-9, abs=1e-15)


MOTIONS = {
    "permanent, front": ({"q0": 1.0, "omega": 2.5, "eps1": 0.02}, {1}),
    "permanent, back": ({"q0": -1.0, "omega": 2.5, "eps1": 0.02, "x1": -1.0}, {-1}),
    "one-sided, front": ({"q0": 0.1, "omega": 0.5, "eps1": 0.1}, {0, 1}),
    "one-sided, back": ({"q0": -0.1, "omega": 0.5, "eps1": 0.1, "x1": -1.0}, {0, -1}),
    "two-sided": ({"q0": 0.1, "omega": 1.0, "eps1": 0.206}, {-1, 0, 1}),
    "none": ({"kind": "single", "q0": 0.0, "omega": 1.0, "eps1": 0.1, "z": 0.0}, {0})}


@pytest.mark.parametrize("name", MOTIONS)
def test_the_contact_state_says_which_flanks_are_touched_and_left(name):
    values, flanks = MOTIONS[name]
    model = gc.MeshModel.of(**values)
    verdict = gc.regime(model)
    sampled = gc.steady(model, verdict)
    contact = sampled.contact.values
    assert set(np.unique(contact)) == flanks and verdict.contact == name.split(",")[0]
    assert verdict.contact_fraction == pytest.approx(np.mean(contact != 0), abs=0.02)
    switches = np.abs(np.diff(np.append(contact, contact[0]))).sum() / sampled.sizes["period"]
    assert verdict.switches_per_period == pytest.approx(switches, abs=0.01)
    assert verdict.z_peak_to_peak == pytest.approx(np.ptp(sampled.z.values), rel=0.01)
    assert verdict.z_rms == pytest.approx(float(sampled.z.std()), rel=0.01)
    if model.q1:
        assert verdict.dynamic_factor == pytest.approx(float(abs(sampled.mesh_force).max()) / abs(model.q1), rel=0.01)


def test_contact_lasts_if_no_time_is_free_but_for_rounding():
    """5 − 1e-10 is the sum of many segments between which contact is not lost."""
    front, back = np.array([5.0, 5 - 1e-13, 5 - 1e-10, 4.999, 0, 2.0, 0, 2.5]), np.array([0, 0, 0, 0, 5.0, 0.0, 0, 2.5])
    measures = np.zeros((len(Measure), 8))
    measures[[Measure.FRONT_TIME, Measure.BACK_TIME, Measure.SWITCHES]] = front, back, [0, 2, 0, 2, 0, 2, 0, 4]
    found, _ = compute_response(measures, np.full(8, 5.0), np.ones(8), np.ones((8, 1)))
    words = [CONTACTS[i] for i in found.contact]
    assert words == ["permanent"] * 3 + ["one-sided", "permanent", "one-sided", "none", "two-sided"]
    np.testing.assert_allclose(found.contact_fraction, [1, 1, 1, 0.9998, 1, 0.4, 0, 1], rtol=1e-10)


def test_there_is_no_dynamic_factor_without_load():
    measures = np.zeros((len(Measure), 3))
    measures[Measure.FORCE_MAX], measures[Measure.FORCE_MIN] = 0.2, -0.5
    found, _ = compute_response(measures, np.ones(3), np.ones(3), np.array([[0.1], [-0.1], [0.0]]))
    np.testing.assert_allclose(found.dynamic_factor, [5, 5, np.nan])


def test_of_several_meshes_contact_and_force_are_those_of_the_mesh_where_they_are_worst():
    measures = np.zeros((2, len(Measure), 3))  # three motions: the second mesh is worse, the first one, neither
    measures[:, Measure.FRONT_TIME] = [[2.0, 1.0, 2.0], [1.5, 2.0, 2.0]]
    measures[:, Measure.BACK_TIME] = [[0.0, 0.5, 0.0], [0.0, 0.0, 0.0]]
    measures[:, Measure.FORCE_MAX] = [[3.0, 2.0, 1.0], [4.0, 1.0, 1.0]]
    measures[:, Measure.SWITCHES] = [[0, 4, 0], [2, 0, 0]]
    static = np.array([[1.0, 2.0], [1.0, 2.0], [0.0, -2.0]])
    found, meshes = compute_response(measures.reshape(-1, 3), np.full(3, 2.0), np.ones(3), static)
    assert [CONTACTS[i] for i in found.contact] == ["one-sided", "two-sided", "permanent"]
    assert found.contact_fraction.tolist() == [0.75, 0.75, 1] and found.mesh_force_peak.tolist() == [4, 2, 1]
    assert found.dynamic_factor.tolist() == [3, 2, 0.5] and found.switches_per_period.tolist() == [2, 4, 0]
    np.testing.assert_array_equal(meshes.mesh_dynamic_factor, [[3, 2], [2, 0.5], [np.nan, 0.5]])
