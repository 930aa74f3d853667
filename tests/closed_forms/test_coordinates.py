"""x and y from the dynamic state and back: the rotation of the wheels at any bearing friction, and in long sweeps."""

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.dynamics import classify
from gearchaos.flow import Measure
from gearchaos.model import COORDINATES, vary
from gearchaos.model.coordinates import initial_state, reset_mean_rotation, to_physical, transmission_error_at_start
from gearchaos.model.switched import switched_system
from gearchaos.studies.core.initial_value_problems import swept_initial_values
from tests.flows import flow_of


def _pair(kind: str, friction: float, **values: float) -> gc.MeshModel:
    """A pair whose motion is regular, with friction in the first bearing alone."""
    return gc.MeshModel.of(
        kind=kind, **{"omega": 1.3, "q0": 0.2, "eps1": 0.05, "zeta": 0.05, **values}, beta1=friction, beta2=0.0)


@pytest.mark.parametrize("friction", [0.0, 1e-30, 1e-14, 1e-8, 1e-4, 1.9e-3, 2.1e-3, 0.05])
@pytest.mark.parametrize("kind", ["torsional", "full"])
def test_the_rotation_is_right_to_twelve_digits_at_any_friction(kind, friction):
    oracle = pytest.importorskip("tests.oracles.heyoka_oracle", reason="heyoka is not installed", exc_type=ImportError)
    model = _pair(kind, friction, x2_dot=0.3, q1=0.21)
    found, wanted = gc.simulate(model, 12, 5), oracle.section(model, 12, 5)
    for name in COORDINATES[kind]:
        size = max(1.0, np.abs(wanted[name]).max())
        np.testing.assert_allclose(found[f"section_{name}"], wanted[name], rtol=0, atol=1e-12 * size, err_msg=name)


@pytest.mark.parametrize("friction", [1e-14, 1e-6, 0.01])
def test_the_rotation_is_right_between_the_sections(friction):
    oracle = pytest.importorskip("tests.oracles.heyoka_oracle", reason="heyoka is not installed", exc_type=ImportError)
    model = _pair("torsional", friction)
    found = gc.simulate(model, 4, 3, samples=7)
    wanted = oracle.trajectory(model, found.tau.values)
    for name in COORDINATES["torsional"]:
        np.testing.assert_allclose(found[name], wanted[name], rtol=0, atol=1e-12, err_msg=name)


def test_the_first_integral_gives_the_rotation_that_is_integrated():
    """With friction in both bearings, and no two values of the wheels the same."""
    model = gc.MeshModel.of(q0=0.2, eps1=0.05, omega=1.3, zeta=0.05, J1=1.2, J2=0.9, beta1=0.03, beta2=0.01, q1=0.21,
                            q2=0.2, x2=0.3, x1_dot=0.2, x2_dot=0.1)
    found, batch = gc.simulate(model, 12), vary(model, {})
    names = switched_system(batch).names
    w = np.stack([found[f"section_{n}"].values for n in names], axis=1)
    given = to_physical(batch, names, w[None], found["tau_section"].values[None], *transmission_error_at_start(batch))
    np.testing.assert_allclose(given["x2"][0], found["section_x2"], rtol=0, atol=1e-10)


def test_a_verdict_does_not_feel_how_friction_vanishes():
    """Sections and levels tend to those without friction, as fast as the friction goes to zero."""
    models = {b: gc.MeshModel.of(beta1=b, beta2=0.0) for b in (0.0, 1e-14, 1e-12, 1e-10, 1e-8, 1e-6, 1e-4)}
    verdicts = {b: gc.regime(m) for b, m in models.items()}
    free = verdicts.pop(0.0)
    for friction, verdict in verdicts.items():
        assert verdict.label == free.label and verdict.v_rms == pytest.approx(free.v_rms, rel=friction + 1e-10)
        for name in COORDINATES["torsional"]:
            assert verdict.section[name] == pytest.approx(free.section[name], abs=100 * friction + 1e-10), name


@pytest.mark.parametrize("friction", [1e-8, 1e-3, 3e-3, 0.05])
def test_sections_of_a_verdict_go_on_from_the_trajectory(friction):
    """To as many digits as the trajectory agrees with its orbit when the verdict stands."""
    model = _pair("torsional", friction)
    verdict = gc.regime(model)
    assert verdict.period == 1
    followed = gc.simulate(model, verdict.periods_spent + 512)
    for name in ("x1", "x2", "z", "z_dot"):
        assert verdict.section[name][0] == pytest.approx(float(followed[f"section_{name}"][-1]), abs=1e-6), name


@pytest.mark.parametrize("friction", [1e-14, 1e-11, 1e-8, 1e-7])
def test_an_orbit_turns_with_the_mean_velocity_that_friction_allows(friction):
    """Over a round x1' has the mean (q1 − q2)/(2β1 + 2β2), 0 here; Newton alone misses it by rounding over friction."""
    flow, w = flow_of(gc.MeshModel.of(beta1=friction, beta2=0.0))
    found = classify(flow, w)
    assert found.period[0] == 1
    out = flow.advance(found.w, 1, measured=True)
    assert abs(out.measures[Measure.VELOCITY][0]) < 1e-13 and np.abs(out.w - found.w).max() < 1e-13


@pytest.mark.parametrize("kind", ["torsional", "full"])
def test_the_rms_velocity_without_friction_leaves_the_mean_rotation_out_beside_points_with_friction(kind):
    model = gc.MeshModel.of(kind=kind, q0=0.3, eps1=0.05, omega=1.4, beta=0.0, x1_dot=0.4)
    flow, w = flow_of(model, {"beta1": [0.0, 0.01]})
    together = classify(flow, w)
    assert "x2_dot" in flow.system.names
    assert together.response.v_rms[0] == pytest.approx(gc.regime(model).v_rms, rel=1e-9)


@pytest.mark.parametrize("friction", [{"beta": 0.0}, {"beta": 1e-9}, {"beta1": 1e-14, "beta2": 0.0}])
@pytest.mark.parametrize("up", [True, False])
def test_a_sweep_carries_z_whatever_the_mean_rotation_does(up, friction):
    """Without friction the relative equation is the whole truth; x1 and x2 grow by 10^5 a column if torques differ."""
    axis = gc.Axis("omega", 1.0, 1.4, 12)
    torques = {"q1": 0.14, "q2": 0.1, "eps1": 0.05, "zeta": 0.05}
    pair = gc.MeshModel.of(**torques, **friction)
    z = swept_initial_values(gc.MeshModel.of(kind="single", **torques, x1=1.0), axis, up)["z"]
    x = swept_initial_values(pair, axis, up)
    error, _ = transmission_error_at_start(vary(pair, {}))
    np.testing.assert_allclose(x["x1"] - x["x2"] - error, z, rtol=0, atol=2e-6 if friction.get("beta") else 1e-11)
    assert max(np.abs(x[n]).max() for n in ("x1", "x2")) < 10


@pytest.mark.parametrize("kind", ["torsional", "full"])
def test_a_state_without_its_drift_is_the_same_relative_motion(kind):
    model = gc.MeshModel.of(kind=kind, q1=0.2, q2=0.1, eps1=0.1, beta1=0.02, x1=0.7, x2=0.2, x1_dot=0.3)
    (flow, w), batch = flow_of(model), vary(model, {})
    w, system = flow.advance(w, 50).w.T, flow.system
    kept = reset_mean_rotation(batch, system.names, w, *transmission_error_at_start(batch))
    there = {name: w[:, i] for i, name in enumerate(system.names) if name.startswith("y")}
    if kind == "full":
        there = {"y1": w[:, 3], "y1_dot": w[:, 4], "y2": 0 * w[:, 3], "y2_dot": 0 * w[:, 4]}
    pair = gc.MeshModel.of(kind=kind, q1=0.2, q2=0.1, eps1=0.1, beta1=0.02)
    again = initial_state(vary(pair, {**kept, **there}), system)
    np.testing.assert_allclose(again, w, rtol=0, atol=1e-14)
    assert (kept["x1"] + kept["x2"]) / 2 == pytest.approx(0.45)


@pytest.mark.parametrize("values", [{"q1": 0.11, "beta": 0.0}, {"beta1": 1e-12, "beta2": 0.0}])
def test_the_steady_motion_is_the_one_of_the_verdict(values):
    """Torques that differ turn both wheels by 10^5 before the verdict stands; z keeps all its digits."""
    model = gc.MeshModel.of(eps1=0.05, **values)
    verdict = gc.regime(model)
    assert verdict.period
    shown = gc.steady(model, verdict)
    assert float(shown.section_z[-1]) == pytest.approx(verdict.section["z"][-1], abs=1e-12)
