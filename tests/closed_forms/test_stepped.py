"""Stepped stiffness against closed forms, against the two levels that it generalises, and under changes of its steps
that leave the motion as it is."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.linalg import expm

import gearchaos as gc
from gearchaos.flow import ExactFlow, Measure
from gearchaos.model import MeshModel, SteppedStiffness, TwoLevelStiffness, mesh_stiffness, vary
from gearchaos.model.switched import switched_system
from tests.flows import flow_of, unit_vectors

KINDS = {
    2: {"kind": "torsional"}, 3: {"kind": "torsional", "beta1": 0.02}, 4: {"kind": "full"},
    7: {"kind": "full", "kappa1": 0.7, "beta1": 0.02}}


def random_steps(rng: np.random.Generator, count: int, wrapped: bool = True) -> SteppedStiffness:
    """``count`` random levels; unless ``wrapped`` the first begins at 0."""
    starts = np.sort(rng.uniform(0, 1, count))
    starts[0] *= wrapped
    return SteppedStiffness(tuple(rng.uniform(0.5, 1.6, count)), tuple(starts))


def random_motions(stiffness, dimension: int, rng: np.random.Generator, count: int = 40):
    """A system with this stiffness at random points, and random states (d, L), a third of them near a boundary."""
    model = MeshModel.of(stiffness=stiffness, eps2=0.03, **KINDS[dimension])
    values = {"omega": rng.uniform(0.3, 3, count), "q0": rng.uniform(0, 0.3, count), "eps1": rng.uniform(0, 0.3, count),
              "theta1": rng.uniform(0, 6, count), "zeta": rng.uniform(0, 0.05, count)}
    system = switched_system(vary(model, values))
    w = rng.uniform(-1.5, 1.5, (dimension, count))
    w[0, ::3] = rng.choice([-1.0, 1.0], len(w[0, ::3]))
    assert system.dimension == dimension
    return system, w


@pytest.mark.parametrize(("dimension", "count"), [(2, 1), (2, 64), (3, 5), (4, 2), (7, 5)])
def test_the_monodromy_determinant_and_the_sum_of_exponents_follow_from_the_trace(dimension, count):
    rng = np.random.default_rng(100 * dimension + count)
    system, w = random_motions(random_steps(rng, count), dimension, rng)
    flow = ExactFlow(system)
    out = flow.advance(w, 1, tangent=unit_vectors(w))
    determinant = np.linalg.det(out.tangent.transpose(2, 1, 0))
    np.testing.assert_allclose(determinant, np.exp(system.trace * system.period), rtol=1e-12)
    grown = flow.advance(w, 20, tangent=unit_vectors(w), growth=True).growth.sum(axis=(0, 1))
    np.testing.assert_allclose(grown / (20 * system.period), system.trace, rtol=0, atol=1e-12)


@pytest.mark.parametrize(("count", "omega"), [(1, 0.9), (2, 0.35), (5, 2.0), (64, 0.9)])
def test_multipliers_in_permanent_contact_are_those_of_a_product_of_exponentials(count, omega):
    """Hill's equation with piecewise constant coefficients, Meissner's with more than two of them."""
    random = random_steps(np.random.default_rng(count), count)
    stiffness = SteppedStiffness(tuple(0.7 + 0.4 * c for c in random.levels), random.starts)
    model = MeshModel.of(kind="single", omega=omega, q0=3.0, stiffness=stiffness, z=4.0)
    flow, w = flow_of(model)
    out = flow.advance(w, 1, tangent=unit_vectors(w), measured=True)
    assert out.measures[Measure.SWITCHES, 0] == 0
    parts = [(stiffness.levels[-1], stiffness.starts[0])]
    parts += [(c, b - a) for c, (a, b) in zip(stiffness.levels, pairwise((*stiffness.starts, 1.0)), strict=True)]
    expected = np.eye(2)
    for level, duration in parts:
        expected = expm(np.array([[0.0, 1.0], [-level, -2 * model.zeta]]) * duration * model.period) @ expected
    np.testing.assert_allclose(out.tangent[:, :, 0].T, expected, atol=1e-13)


@pytest.mark.parametrize(("dimension", "ratio"), [(2, 1.15), (3, 1.5), (4, 1.6), (7, 1.9)])
def test_two_steps_are_two_levels_bit_for_bit(dimension, ratio):
    """States, tangent vectors, growth, measures and samples: what is true of these kernels for two levels is so for
    steps (test_flow.py, test_any_batch.py)."""
    two = TwoLevelStiffness(0.3, 0.2, ratio)
    results = []
    for stiffness in (two, SteppedStiffness((1 + two.chi1, 1 - two.chi2), (0.0, two.contact_ratio - 1))):
        system, w = random_motions(stiffness, dimension, np.random.default_rng(dimension))
        results.append((
            ExactFlow(system).advance(w, 12, tangent=unit_vectors(w), sections=3, growth=True, measured=True),
            ExactFlow(system, samples=20).advance(w, 3, sample=True)))
    for one, other in zip(*results, strict=True):
        for name in ("w", "tangent", "growth", "sections", "measures", "samples", "status"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def divided(stiffness: SteppedStiffness, which: int, parts: int) -> SteppedStiffness:
    """The same stiffness with one of its levels, not the last one, written as equal parts."""
    a, b = stiffness.starts[which : which + 2]
    starts = (*stiffness.starts[:which], *np.linspace(a, b, parts, endpoint=False), *stiffness.starts[which + 1 :])
    levels = (*stiffness.levels[:which], *[stiffness.levels[which]] * parts, *stiffness.levels[which + 1 :])
    return SteppedStiffness(levels, starts)


@pytest.mark.parametrize("dimension", KINDS)
def test_dividing_a_level_leaves_the_motion_as_it_is(dimension):
    whole = random_steps(np.random.default_rng(dimension), 5)
    results = []
    for stiffness in (whole, divided(divided(whole, 3, 7), 0, 3)):
        system, w = random_motions(stiffness, dimension, np.random.default_rng(10 + dimension))
        results.append(ExactFlow(system).advance(w, 1, tangent=unit_vectors(w), measured=True))
    one, other = results
    np.testing.assert_allclose(one.w, other.w, rtol=0, atol=1e-13)
    np.testing.assert_allclose(one.tangent, other.tangent, rtol=1e-13, atol=1e-13 * np.abs(one.tangent).max())
    np.testing.assert_array_equal(one.measures[Measure.SWITCHES], other.measures[Measure.SWITCHES])
    np.testing.assert_allclose(one.measures, other.measures, rtol=1e-12, atol=1e-12)


def test_a_sample_beside_a_jump_is_taken_at_its_own_instant():
    """A jump 1e-10 of a period before a sample is not mistaken for it."""
    late, early = (MeshModel.of(
        kind="single", omega=0.5, q0=0.0, zeta=0.0, z=0.0, z_dot=0.5,  # it strikes the flank before
        stiffness=SteppedStiffness((1.3, 0.7), (0.1, 0.5 - before))) for before in (1e-10, 0.0))
    motions = [gc.simulate(model, 1, samples=2).z for model in (late, early)]
    np.testing.assert_allclose(*motions, rtol=0, atol=1e-14)


def test_stiffness_lasts_from_its_start_and_wraps_round():
    model = MeshModel.of(omega=1.3, stiffness=SteppedStiffness((1.4, 0.9, 0.6), (0.25, 0.5, 0.75)))
    share = np.array([0.0, 0.2, 0.25, 0.4, 0.5, 0.74, 0.75, 0.99, 1.0, 1.3, -0.1, -0.9])
    expected = [0.6, 0.6, 1.4, 1.4, 0.9, 0.9, 0.6, 0.6, 0.6, 1.4, 0.6, 0.6]
    np.testing.assert_array_equal(mesh_stiffness(model, share * model.period), expected)
