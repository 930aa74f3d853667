"""The exact flow against closed forms, and the invariants that hold to rounding whatever the parameters."""

import json
import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gearchaos.flow import OK, ExactFlow, Measure, combine_measures, near_returns, newton_iteration, start_newton_search
from gearchaos.model import HarmonicStiffness, MeshModel
from tests import ROOT
from tests.flows import flow_of

KINDS = ("single", "torsional", "full")


def random_model(draw):
    kind = draw(st.sampled_from(KINDS))
    number = lambda low, high: draw(st.floats(low, high))  # noqa: E731
    values = {
        "omega": number(0.2, 3.0), "q0": number(-0.2, 0.4), "zeta": number(0.0, 0.1), "eps1": number(0.0, 0.3),
        "theta1": number(0.0, 6.0), "eps2": number(0.0, 0.1), "chi1": number(-0.3, 0.5), "chi2": number(-0.3, 0.5),
        "contact_ratio": number(1.0, 2.0)}
    if kind == "full":
        values["kappa"] = number(0.2, 5.0)
    model = MeshModel.of(kind=kind, **values)
    if draw(st.booleans()):
        harmonics = HarmonicStiffness((number(0.0, 0.5), number(0.0, 0.3)), (number(0.0, 6.0),))
        model = replace(model, stiffness=harmonics)
    return model


models = st.composite(random_model)()


@pytest.mark.slow
@settings(max_examples=50, deadline=None, derandomize=True)
@given(models)
def test_the_monodromy_determinant_and_the_sum_of_the_exponents_have_their_closed_forms(model):
    flow, w = flow_of(model)
    trace, period, unit = flow.system.trace[0], flow.system.period[0], np.eye(flow.dimension)[:, :, None]
    determinant = np.linalg.det(flow.advance(w, 1, tangent=unit.copy()).tangent[:, :, 0])
    assert determinant == pytest.approx(np.exp(trace * period), rel=1e-11)
    growth = flow.advance(w, 20, tangent=unit.copy(), growth=True).growth[:, :, 0]
    assert growth.sum() / (20 * period) == pytest.approx(trace, abs=1e-12)


@settings(max_examples=40, deadline=None, derandomize=True)
@given(models)
def test_turning_everything_around_turns_the_motion_around(model):
    flow, w = flow_of(model)
    turned = model.with_values({"q1": -model.q1, "q2": -model.q2, **{
        f"eps{j}": -a for j, a in enumerate(model.error.amplitudes, 1)}})
    mirror, _ = flow_of(turned)
    here, there = flow.advance(w, 2), mirror.advance(-w, 2)
    np.testing.assert_allclose(here.w, -there.w, rtol=0, atol=1e-12 * max(1.0, np.abs(w).max()))


def test_free_flight():
    model = MeshModel.of(kind="single", omega=0.7, q0=0.0, zeta=0.05, z=-0.6, z_dot=0.05)
    flow, w = flow_of(model)
    tau = model.period * np.arange(1, 6)
    sections = flow.advance(w, 5, sections=5).sections[:, :, 0]
    decay = np.exp(-0.1 * tau)
    np.testing.assert_allclose(sections, np.stack([-0.6 + 0.5 * (1 - decay), 0.05 * decay], axis=1), atol=1e-15)


def test_permanent_contact_with_constant_stiffness():
    """z = 1 + q0 plus the answer of a linear oscillator to −ε''."""
    omega, zeta, q0, eps = 1.7, 0.05, 0.4, 0.05
    model = MeshModel.of(kind="single", omega=omega, zeta=zeta, q0=q0, eps1=eps, theta1=0.4, chi0=0.0)
    flow, w = flow_of(model)
    out = flow.advance(flow.advance(w, 400).w, 1, measured=True)
    answer = eps * omega**2 * np.exp(-0.4j) / (1 - omega**2 + 2j * zeta * omega)
    np.testing.assert_allclose(out.w[:, 0], [1 + q0 + answer.real, (1j * omega * answer).real], atol=1e-14)
    measures, period = out.measures[:, 0], model.period
    assert measures[Measure.FRONT_TIME] == pytest.approx(period, rel=1e-14) and measures[Measure.SWITCHES] == 0
    assert measures[Measure.Z_REFERENCE] + measures[Measure.Z] / period == pytest.approx(1 + q0, rel=1e-13)
    assert measures[Measure.Z_DOT_SQUARE] / period == pytest.approx((omega * abs(answer)) ** 2 / 2, rel=1e-12)
    assert measures[Measure.Z_MAX] == pytest.approx(1 + q0 + abs(answer), rel=1e-13)
    assert measures[Measure.Z_MIN] == pytest.approx(1 + q0 - abs(answer), rel=1e-13)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("omega", [1e-2, 40.0])
def test_far_below_and_above_resonance(kind, omega):
    flow, w = flow_of(MeshModel.of(kind=kind, omega=omega, eps1=0.05))
    out = flow.advance(w, 2, tangent=np.eye(flow.dimension)[:, :, None].copy(), growth=True)
    assert out.status[0] == OK
    rate = out.growth.sum() / (2 * flow.system.period[0])
    assert rate == pytest.approx(flow.system.trace[0], rel=1e-9)


def test_at_rest_on_the_boundary_without_load_stays():
    flow, _ = flow_of(MeshModel.of(kind="single", q0=0.0))
    out = flow.advance(np.array([[1.0, -1.0], [0.0, 0.0]]), 3, points=np.zeros(2, dtype=int))
    np.testing.assert_array_equal(out.w, [[1.0, -1.0], [0.0, 0.0]])
    assert np.all(out.status == OK)


def test_measuring_and_sampling_do_not_change_the_motion():
    flow, w = flow_of(MeshModel.of(eps1=0.1, omega=0.95))
    plain, measured = flow.advance(w, 5), flow.advance(w, 5, measured=True)
    sampled = ExactFlow(flow.system, samples=50).advance(w, 5, sample=True)
    np.testing.assert_array_equal(measured.w, plain.w)
    np.testing.assert_allclose(sampled.w, plain.w, atol=1e-13)
    z, contact = sampled.samples[:, :, 0, 0], sampled.samples[:, :, -1, 0]
    np.testing.assert_array_equal(contact, np.where(z > 1, 1, np.where(z < -1, -1, 0)))
    share = measured.measures[Measure.FRONT_TIME, 0] / (5 * flow.system.period[0])
    assert share == pytest.approx(contact.mean(), abs=0.03)


@pytest.mark.parametrize("values", [{"kind": "torsional"}, {"kind": "full", "kappa1": 0.5, "kappa2": 0.8}])
def test_measures_are_those_of_a_densely_sampled_motion(values):
    """Twenty motions, impacts and all; samples miss an extreme by no more than their largest second difference."""
    rng, periods = np.random.default_rng(5), 12
    flow, w = flow_of(MeshModel.of(q0=0.05, **values),
                      {"omega": rng.uniform(0.5, 2.5, 20), "eps1": rng.uniform(0, 0.3, 20)})
    found = flow.advance(w, periods, measured=True).measures
    sampled = ExactFlow(flow.system, samples=1500).advance(w, periods, sample=True)
    z, z_dot = (np.vstack([sampled.samples[:, :, i].reshape(-1, 20), sampled.w[i]]) for i in (0, 1))
    assert found[Measure.SWITCHES].max() > 20
    for highest, series in ((Measure.Z_MAX, z), (Measure.Z_DOT_MAX, z_dot)):
        missed = np.abs(np.diff(series, 2, axis=0)).max(axis=0)
        above, below = found[highest] - series.max(axis=0), series.min(axis=0) - found[highest + 1]
        assert np.all(above > -1e-12) and np.all(below > -1e-12)
        assert np.all(above < missed) and np.all(below < missed)
    for integral, series in ((Measure.Z, z - w[0]), (Measure.Z_SQUARE, (z - w[0]) ** 2),
                             (Measure.Z_DOT_SQUARE, z_dot**2)):
        mean = (series[1:] + series[:-1]).mean(axis=0) / 2
        assert found[integral] / (flow.system.period * periods) == pytest.approx(mean, rel=1e-4, abs=1e-6)


def test_measures_of_parts_are_combined_to_those_of_the_motion():
    """Ten motions in parts of 3, 1 and 5 periods: sums, extremes, and integrals of z about one reference."""
    flow, w = flow_of(MeshModel.of(q0=0.05, eps1=0.2), {"omega": np.linspace(0.5, 2.5, 10)})
    whole, parts, at = flow.advance(w, 9, measured=True).measures, [], w
    for periods in (3, 1, 5):
        part = flow.advance(at, periods, measured=True)
        parts.append(part.measures)
        at = part.w
    each = np.stack(parts, axis=2).reshape(len(Measure), 30)
    duration = (flow.system.period[:, None] * [3, 1, 5]).ravel()
    found = combine_measures(each, duration, np.arange(0, 30, 3))
    assert np.ptp(each[Measure.Z_REFERENCE].reshape(10, 3), axis=1).min() > 1e-3
    np.testing.assert_array_equal(found[Measure.Z_REFERENCE], w[0])
    np.testing.assert_allclose(found, whole, rtol=1e-12, atol=1e-12)


def results():
    """What each kernel gives, with two levels of stiffness and with harmonics, and with each law of damping."""
    model = MeshModel.of(kind="torsional", omega=2.0, eps1=0.2, x1=1.2, x1_dot=0.1)
    laws = [MeshModel.of(kind="single", omega=2.0, zeta=0.3, eps1=0.2, q0=0.05, z=1.4, z_dot=-0.8, damping_law=law)
            for law in ("contact", "unilateral")]
    return [results_of(each) for each in (model, replace(model, stiffness=HarmonicStiffness((0.3,), ())), *laws)]


def results_of(model):
    flow, w = flow_of(model)
    unit = np.eye(2)[:, :, None]
    out, grown = flow.advance(w, 2, tangent=unit, measured=True), flow.advance(w, 2, tangent=unit, growth=True)
    search, busy = start_newton_search(w), np.arange(1)
    newton_iteration(search, busy, out.w, out.tangent, out.status, 10.0, 1e9)
    returns = near_returns(flow.advance(w, 5, sections=5).sections, 2, 1e9, 1e9, 2)
    return [a.ravel().tolist() for a in (out.measures, out.w, out.tangent, grown.growth, search.at, returns)]


@pytest.mark.slow
def test_every_kernel_does_the_same_with_the_compiler_off():
    """To rounding: without the compiler a product and a sum are rounded one after the other."""
    code = "import json; from tests.closed_forms.test_flow import results; print(json.dumps(results()))"
    plain = subprocess.run([sys.executable, "-c", code], env={**os.environ, "NUMBA_DISABLE_JIT": "1"}, cwd=ROOT,
                           capture_output=True, text=True, check=True)
    compiled = results()
    for ours, theirs in zip(json.loads(plain.stdout), compiled, strict=True):
        for mine, other in zip(ours, theirs, strict=True):
            np.testing.assert_allclose(mine, other, rtol=1e-11, atol=1e-12)
    assert all(each[0][Measure.SWITCHES] > 0 for each in compiled)  # else they are not resolved
