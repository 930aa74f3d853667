"""The exact flow with a stepped stiffness against independent integrations that stop at every jump."""

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.flow import OK, ExactFlow
from gearchaos.model import MeshModel, SteppedStiffness, vary
from gearchaos.model.switched import switched_system
from tests.oracles import scipy_oracle

KINDS = {
    2: {"kind": "single"}, 4: {"kind": "torsional", "J1": 1.5, "beta1": 0.02, "beta2": 0.005},
    8: {"kind": "full", "J1": 1.5, "beta1": 0.02, "kappa1": 0.7, "mu2": 5.0}}
"""Models by their number of physical coordinates."""

POINTS = 8


def random_points(coordinates: int, count: int) -> list[MeshModel]:
    """Models with ``count`` random levels and random initial values, the first half at a boundary."""
    rng = np.random.default_rng(1000 * coordinates + count)
    models = []
    for i in range(POINTS):
        stiffness = SteppedStiffness(tuple(rng.uniform(0.5, 1.6, count)), tuple(np.sort(rng.uniform(0, 1, count))))
        values = {"omega": rng.uniform(0.3, 2.5), "zeta": rng.uniform(0, 0.05), "q0": rng.uniform(0, 0.3),
                  "eps1": rng.uniform(0, 0.3), "theta1": rng.uniform(0, 6), "eps2": rng.uniform(0, 0.05)}
        model = MeshModel.of(**KINDS[coordinates], stiffness=stiffness, **values)
        names = ("z", "z_dot") if coordinates == 2 else gc.model.COORDINATES[model.kind]
        start = {name: float(rng.uniform(-1, 1)) for name in names}
        if coordinates == 2 and i < POINTS // 2:
            start["z"] = float(rng.choice([-1.0, 1.0]))
        models.append(model.with_values(start))
    return models


def worst(oracle, coordinates: int, count: int) -> float:
    """The largest difference of a coordinate after a mesh period."""
    found = 0.0
    for model in random_points(coordinates, count):
        ours, theirs = gc.simulate(model, 1), oracle.section(model, 1)
        found = max(found, *(abs(float(ours[f"section_{name}"][0]) - v[0]) for name, v in theirs.items()))
    return found


@pytest.fixture
def heyoka_oracle():
    return pytest.importorskip("tests.oracles.heyoka_oracle", exc_type=ImportError)


@pytest.mark.parametrize("count", [1, 3, 16, 64])
@pytest.mark.parametrize("coordinates", KINDS)
def test_one_period_agrees_with_heyoka(heyoka_oracle, coordinates, count):
    assert worst(heyoka_oracle, coordinates, count) <= 2e-13


@pytest.mark.slow
@pytest.mark.parametrize("count", [1, 3, 16])
@pytest.mark.parametrize("coordinates", KINDS)
def test_one_period_agrees_with_scipy(coordinates, count):
    """DOP853 at its smallest tolerance has errors of up to 1e-12 itself."""
    assert worst(scipy_oracle, coordinates, count) <= 2e-12


def test_the_highest_level_sets_the_number_of_steps():
    """With steps for the first levels the Taylor polynomials would be wrong by more than 1e-9."""
    steps = SteppedStiffness((1.0, 1.1, 0.9, 36.0), (0.0, 0.2, 0.5, 0.7))
    model = MeshModel.of(kind="single", omega=0.9, q0=0.5, stiffness=steps, z=1.4)
    ours, theirs = gc.simulate(model, 1), scipy_oracle.section(model, 1)
    np.testing.assert_allclose(ours.section_z[0], theirs["z"][0], rtol=0, atol=2e-12)


def test_samples_agree_with_heyoka(heyoka_oracle):
    for model in random_points(4, 7):
        motion = gc.simulate(model, 1, samples=24)
        for name, values in heyoka_oracle.trajectory(model, motion.tau.values).items():
            np.testing.assert_allclose(motion[name], values, rtol=0, atol=1e-12)


def test_all_trajectories_end_well():
    for model in random_points(2, 64):
        flow = ExactFlow(switched_system(vary(model, {})))
        assert np.all(flow.advance(np.array([[1.0], [0.0]]), 30).status == OK)
