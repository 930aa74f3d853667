"""Stepped stiffness against closed forms, against the two levels that it generalises, and under changes of its steps
that leave the motion as it is."""

import json
import os
import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest
from scipy.linalg import expm

import gearchaos as gc
from gearchaos.flow import ExactFlow, Measure
from gearchaos.model import HarmonicStiffness, MeshModel, SteppedStiffness, TwoLevelStiffness, mesh_stiffness, vary
from gearchaos.model.coordinates import initial_state
from gearchaos.model.switched import switched_system

KINDS = {
    2: {"kind": "torsional"}, 3: {"kind": "torsional", "beta1": 0.02}, 4: {"kind": "full"},
    7: {"kind": "full", "kappa1": 0.7, "beta1": 0.02},
}
COUNTS = (1, 2, 5, 64)


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


def unit_vectors(w: np.ndarray) -> np.ndarray:
    """Unit tangent vectors (d, d, L) for states (d, L)."""
    return np.repeat(np.eye(len(w))[:, :, None], w.shape[1], axis=2)


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("dimension", KINDS)
def test_the_monodromy_determinant_and_the_sum_of_exponents_follow_from_the_trace(dimension, count):
    rng = np.random.default_rng(100 * dimension + count)
    system, w = random_motions(random_steps(rng, count), dimension, rng)
    flow = ExactFlow(system)
    out = flow.advance(w, 1, tangent=unit_vectors(w))
    determinant = np.linalg.det(out.tangent.transpose(2, 1, 0))
    np.testing.assert_allclose(determinant, np.exp(system.trace * system.period), rtol=1e-12)
    grown = flow.advance(w, 20, tangent=unit_vectors(w), growth=True).growth.sum(axis=(0, 1))
    np.testing.assert_allclose(grown / (20 * system.period), system.trace, rtol=0, atol=1e-12)


@pytest.mark.parametrize("count", COUNTS)
@pytest.mark.parametrize("omega", [0.35, 0.9, 2.0])
def test_multipliers_in_permanent_contact_are_those_of_a_product_of_exponentials(count, omega):
    """Hill's equation with piecewise constant coefficients, Meissner's with more than two of them."""
    rng = np.random.default_rng(count)
    random = random_steps(rng, count)
    stiffness = SteppedStiffness(tuple(0.7 + 0.4 * c for c in random.levels), random.starts)
    model = MeshModel.of(kind="single", omega=omega, q0=3.0, stiffness=stiffness, z=4.0)
    batch = vary(model, {})
    flow = ExactFlow(switched_system(batch))
    w = initial_state(batch, flow.system).T.copy()
    out = flow.advance(w, 1, tangent=unit_vectors(w), measured=True)
    assert out.measures[Measure.SWITCHES, 0] == 0
    parts = [(stiffness.levels[-1], stiffness.starts[0])]
    parts += [(c, b - a) for c, (a, b) in zip(stiffness.levels, pairwise((*stiffness.starts, 1.0)), strict=True)]
    expected = np.eye(2)
    for level, duration in parts:
        expected = expm(np.array([[0.0, 1.0], [-level, -2 * model.zeta]]) * duration * model.period) @ expected
    np.testing.assert_allclose(out.tangent[:, :, 0].T, expected, atol=1e-13)


@pytest.mark.parametrize("ratio", [1.15, 1.5, 1.6, 1.9])
@pytest.mark.parametrize("dimension", KINDS)
def test_two_steps_are_two_levels_bit_for_bit(dimension, ratio):
    """States, tangent vectors, growth, measures and samples."""
    two = TwoLevelStiffness(0.3, 0.2, ratio)
    steps = SteppedStiffness((1 + two.chi1, 1 - two.chi2), (0.0, two.contact_ratio - 1))
    options = {"sections": 3, "growth": True, "measured": True}
    results = []
    for stiffness in (two, steps):
        system, w = random_motions(stiffness, dimension, np.random.default_rng(dimension))
        run = ExactFlow(system).advance(w, 12, tangent=unit_vectors(w), **options)
        sampled = ExactFlow(system, samples=20).advance(w, 3, sample=True)
        results.append((run, sampled))
    for one, other in zip(*results, strict=True):
        for name in ("w", "tangent", "growth", "sections", "measures", "samples", "status"):
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_studies_of_two_steps_are_those_of_two_levels():
    two = MeshModel.of(omega=0.9, q0=0.1, eps1=0.2)
    steps = two.with_values({"stiffness": SteppedStiffness((1.25, 0.75), (0.0, 0.5))})
    assert gc.regime(steps).to_dict() == gc.regime(two).to_dict()
    axes = gc.Axis("omega", 0.6, 1.4, 12), gc.Axis("eps1", 0.0, 0.3, 8)
    one, other = (gc.zones(model, *axes) for model in (two, steps))
    for name in one.variables:
        np.testing.assert_array_equal(one[name].values, other[name].values)
    one, other = (gc.simulate(model, 20, samples=16) for model in (two, steps))
    for name in one.variables:
        np.testing.assert_array_equal(one[name].values, other[name].values)


def divided(stiffness: SteppedStiffness, which: int, parts: int) -> SteppedStiffness:
    """The same stiffness with one of its levels, not the last one, written as equal parts."""
    a, b = stiffness.starts[which : which + 2]
    starts = (*stiffness.starts[:which], *np.linspace(a, b, parts, endpoint=False), *stiffness.starts[which + 1 :])
    levels = (*stiffness.levels[:which], *[stiffness.levels[which]] * parts, *stiffness.levels[which + 1 :])
    return SteppedStiffness(levels, starts)


@pytest.mark.parametrize("dimension", KINDS)
def test_dividing_a_level_leaves_the_motion_as_it_is(dimension):
    rng = np.random.default_rng(dimension)
    whole = random_steps(rng, 5)
    pieces = divided(divided(whole, 3, 7), 0, 3)
    seed, results = int(rng.integers(1000)), []
    for stiffness in (whole, pieces):
        system, w = random_motions(stiffness, dimension, np.random.default_rng(seed))
        results.append(ExactFlow(system).advance(w, 1, tangent=unit_vectors(w), measured=True))
    one, other = results
    np.testing.assert_allclose(one.w, other.w, rtol=0, atol=1e-13)
    np.testing.assert_allclose(one.tangent, other.tangent, rtol=1e-13, atol=1e-13 * np.abs(one.tangent).max())
    np.testing.assert_array_equal(one.measures[Measure.SWITCHES], other.measures[Measure.SWITCHES])
    np.testing.assert_allclose(one.measures, other.measures, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("same", [SteppedStiffness((1.0,), (0.0,)), SteppedStiffness((1.0,), (0.3,)),
                                  SteppedStiffness((1.0, 1.0, 1.0), (0.1, 0.4, 0.8)), TwoLevelStiffness(0.0, 0.0)])
def test_a_constant_stiffness_is_one_however_it_is_written(same):
    system, w = random_motions(HarmonicStiffness(), 4, np.random.default_rng(0))
    expected = ExactFlow(system).advance(w, 1).w
    system, w = random_motions(same, 4, np.random.default_rng(0))
    np.testing.assert_allclose(ExactFlow(system).advance(w, 1).w, expected, rtol=0, atol=1e-13)


@pytest.mark.parametrize("shift", [0.13, 0.5, 0.8])
@pytest.mark.parametrize("dimension", [2, 4, 7])
def test_shifting_the_starts_shifts_the_motion(dimension, shift):
    """χ(τ − sT) with ε(τ − sT) is the same motion later: the flow over the first sT of a period comes first."""
    rng = np.random.default_rng(dimension)
    stiffness = random_steps(rng, 6)
    pairs = zip(stiffness.starts, stiffness.levels, strict=True)
    starts, levels = zip(*sorted(((start + shift) % 1, level) for start, level in pairs), strict=True)
    values = {"omega": 0.9, "q0": 0.1, "eps1": 0.15, "eps2": 0.05, "theta1": 0.4, "theta2": 1.0, **KINDS[dimension]}
    here = MeshModel.of(stiffness=stiffness, **values)
    there = here.with_values({
        "stiffness": SteppedStiffness(levels, starts),
        "theta1": here.error.phases[0] + 2 * np.pi * shift, "theta2": here.error.phases[1] + 4 * np.pi * shift,
    })
    tau = np.linspace(0, 3, 1000) * here.period
    np.testing.assert_array_equal(mesh_stiffness(there, tau + shift * here.period), mesh_stiffness(here, tau))
    w = rng.uniform(-1.2, 1.2, (dimension, 5))
    systems = [switched_system(vary(model, {"q0": np.full(5, 0.1)})) for model in (here, there)]
    late = ExactFlow(systems[1], samples=100).advance(w, 2, sample=True).samples
    start = late[0, round(100 * shift), :dimension]  # τ = sT there is τ = 0 here
    early = ExactFlow(systems[0], samples=100).advance(start, 1, sample=True).samples[0]
    following = late.reshape(200, dimension + 1, 5)[round(100 * shift) :][:100]
    np.testing.assert_allclose(early, following, rtol=0, atol=1e-12)


@pytest.mark.parametrize("dimension", KINDS)
def test_turning_everything_around_turns_the_motion_around(dimension):
    rng = np.random.default_rng(dimension)
    model = MeshModel.of(stiffness=random_steps(rng, 9), omega=0.8, eps1=0.2, q0=0.1, **KINDS[dimension])
    turned = model.with_values({"q0": -0.1, "eps1": -0.2})
    w = rng.uniform(-1.5, 1.5, (dimension, 1))
    here, there = (ExactFlow(switched_system(vary(m, {}))).advance(s * w, 3) for m, s in ((model, 1), (turned, -1)))
    np.testing.assert_allclose(here.w, -there.w, rtol=0, atol=1e-12)


@pytest.mark.parametrize("dimension", KINDS)
def test_a_lane_does_not_feel_its_neighbours(dimension):
    """Bit for bit the same alone, in another order, and for another number of periods in one call."""
    system, w = random_motions(random_steps(np.random.default_rng(1), 20), dimension, np.random.default_rng(2), 300)
    flow = ExactFlow(system)
    options = {"tangent": unit_vectors(w), "measured": True}
    together = flow.advance(w, 9, **options)
    order = np.random.default_rng(3).permutation(300)
    shuffled = flow.advance(w[:, order], 9, points=order, measured=True)
    np.testing.assert_array_equal(shuffled.w, together.w[:, order])
    np.testing.assert_array_equal(shuffled.measures, together.measures[:, order])
    for i in (0, 17, 299):
        alone = ExactFlow(system.take(np.array([i]))).advance(w[:, [i]], 9, tangent=unit_vectors(w[:, [i]]))
        np.testing.assert_array_equal(alone.w[:, 0], together.w[:, i])
        np.testing.assert_array_equal(alone.tangent[:, :, 0], together.tangent[:, :, i])
    state = w
    for _ in range(9):
        state = flow.advance(state, 1).w
    np.testing.assert_array_equal(state, together.w)


@pytest.mark.parametrize("count", [5, 64])
def test_samples_and_measures_are_those_of_one_motion(count):
    rng = np.random.default_rng(count)
    model = MeshModel.of(stiffness=random_steps(rng, count), omega=0.95, eps1=0.1, q0=0.05)
    batch = vary(model, {})
    system = switched_system(batch)
    w, periods = initial_state(batch, system).T.copy(), 10
    plain, measured = ExactFlow(system).advance(w, periods), ExactFlow(system).advance(w, periods, measured=True)
    np.testing.assert_array_equal(measured.w, plain.w)
    assert measured.measures[Measure.SWITCHES, 0] > 5
    motion = gc.simulate(model, periods, samples=2000)
    np.testing.assert_allclose(motion.section_z[-1], plain.w[0, 0], rtol=0, atol=1e-11)
    measures = measured.measures[:, 0]
    for row, name in ((Measure.Z_MAX, "z"), (Measure.Z_DOT_MAX, "z_dot"), (Measure.FORCE_MAX, "mesh_force")):
        highest, lowest = float(motion[name].max()), float(motion[name].min())
        assert measures[row] == pytest.approx(highest, abs=2e-2) and measures[row] > highest - 1e-11
        assert measures[row + 1] == pytest.approx(lowest, abs=2e-2) and measures[row + 1] < lowest + 1e-11
    square = float(((motion.z - w[0, 0]) ** 2).mean())
    assert measures[Measure.Z_SQUARE] / (periods * model.period) == pytest.approx(square, rel=1e-3)
    assert measures[Measure.FRONT_TIME] / (periods * model.period) == pytest.approx(
        float((motion.contact == 1).mean()), abs=2e-3)


def test_a_sample_beside_a_jump_is_taken_at_its_own_instant():
    """A jump 1e-10 of a period before a sample is not mistaken for it."""
    starts = (0.1, 0.5 - 1e-10)
    model = MeshModel.of(kind="single", omega=0.5, stiffness=SteppedStiffness((1.3, 0.7), starts), z=0.0, z_dot=0.5,
                         q0=0.0, zeta=0.0)
    motion = gc.simulate(model, 1, samples=2)
    free = 0.5 * model.period / 2
    assert free > 1  # it has struck the flank before
    early = model.with_values({"stiffness": SteppedStiffness((1.3, 0.7), (0.1, 0.5))})
    np.testing.assert_allclose(motion.z, gc.simulate(early, 1, samples=2).z, rtol=0, atol=1e-14)


def test_stiffness_lasts_from_its_start_and_wraps_round():
    model = MeshModel.of(omega=1.3, stiffness=SteppedStiffness((1.4, 0.9, 0.6), (0.25, 0.5, 0.75)))
    share = np.array([0.0, 0.2, 0.25, 0.4, 0.5, 0.74, 0.75, 0.99, 1.0, 1.3, -0.1, -0.9])
    expected = [0.6, 0.6, 1.4, 1.4, 0.9, 0.9, 0.6, 0.6, 0.6, 1.4, 0.6, 0.6]
    np.testing.assert_array_equal(mesh_stiffness(model, share * model.period), expected)


@pytest.mark.slow
def test_the_kernels_do_the_same_with_the_compiler_off():
    code = (
        "import gearchaos as gc; s = gc.SteppedStiffness((1.3, 0.6, 1.1), (0.2, 0.5, 0.9));"
        "print(gc.simulate(gc.MeshModel.of(omega=2.0, eps1=0.1, stiffness=s), 2).section_z.values.tolist())"
    )
    plain, compiled = (
        json.loads(subprocess.run([sys.executable, "-c", code], env={**os.environ, "NUMBA_DISABLE_JIT": off},
                                  capture_output=True, text=True, check=True).stdout)
        for off in "10"
    )
    np.testing.assert_allclose(plain, compiled, rtol=0, atol=1e-13)
