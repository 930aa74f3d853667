"""Images of segments of states in balls against the exact flow in floating point, and the sets of a chaotic set."""

from fractions import Fraction

import numpy as np
import pytest
from flint import arb, arb_mat

from gearchaos.flow import ExactFlow
from gearchaos.model import HarmonicStiffness, MeshModel, SteppedStiffness, TwoLevelStiffness, vary
from gearchaos.model.switched import switched_system
from gearchaos.proof.balls import precision
from gearchaos.proof.certificate import UndecidedError
from gearchaos.proof.equations import MeshEquations
from gearchaos.proof.families.chaos import Parallelogram, prove_covering
from gearchaos.proof.parameters import exact_parameters
from gearchaos.proof.tube import segment_image

ROUNDING = 1e-11
"""Largest error of the floats compared with."""

STIFFNESSES = {
    "two-level": TwoLevelStiffness(0.2, 0.2, 1.5), "stepped": SteppedStiffness((1.3, 0.8, 1.1), (0.1, 0.35, 0.7)),
    "fourier": HarmonicStiffness((0.2, 0.1), (0.3, -1.0))}


def images(model: MeshModel, states: np.ndarray) -> np.ndarray:
    """The states (N, 2) after one mesh period."""
    flow = ExactFlow(switched_system(vary(model, {})))
    return flow.advance(np.ascontiguousarray(states.T), 1, points=np.zeros(len(states), int)).w.T


@pytest.mark.slow
@pytest.mark.parametrize("stiffness", STIFFNESSES)
@pytest.mark.parametrize("tolerance", [0.0, 1e-4])
def test_images_of_random_segments_contain_the_exact_flow(stiffness, tolerance):
    rng, shares, undecided = np.random.default_rng(1), np.linspace(-1, 1, 101), 0
    for _ in range(60):
        model = MeshModel.of(
            kind="single" if rng.random() < 0.5 else "torsional", omega=rng.uniform(0.4, 2.5), zeta=rng.uniform(0, 0.1),
            q0=rng.uniform(0, 0.2), eps1=rng.uniform(0, 0.3), stiffness=STIFFNESSES[stiffness])
        centre, half = rng.uniform([-2.0, -0.7], [2.0, 0.7]), rng.normal(size=2)
        half *= 10 ** rng.uniform(-6, -0.5) / np.linalg.norm(half)
        with precision(128):
            equations = MeshEquations(exact_parameters(model), bits=128)
            change = equations.forcing_change({1: Fraction(tolerance)})
            try:
                image, along = segment_image(equations, *(arb_mat(2, 1, v.tolist()) for v in (centre, half)), change)
            except UndecidedError:
                undecided += 1
                continue
            for eps1 in {model.value("eps1"), model.value("eps1") + tolerance, model.value("eps1") - tolerance}:
                moved = model.with_values({"eps1": eps1})
                for share, state in zip(shares, images(moved, centre + shares[:, None] * half), strict=True):
                    for i in (0, 1):
                        assert (image[i, 0] + along[i, 0] * share + arb(0, ROUNDING)).contains(arb(state[i]))
    assert undecided <= 2


def test_change_is_close_for_short_segments():
    """Away from grazes the vector is near the derivative times the half segment."""
    model = MeshModel.of(omega=1.6, q0=0.1, eps1=0.12)
    half = np.array([1e-6, -2e-6])
    rng = np.random.default_rng(2)
    ratios = []
    with precision(128):
        equations = MeshEquations(exact_parameters(model), bits=128)
        for _ in range(30):
            centre = rng.uniform([-1.0, -0.5], [1.5, 0.5])
            _, along = segment_image(equations, *(arb_mat(2, 1, v.tolist()) for v in (centre, half)))
            ratios.append(max(float(along[i, 0].rad()) for i in (0, 1)) / np.linalg.norm(half))
    assert np.median(ratios) < 1e-3


def parallelogram(*vectors):
    """Its centre, and half its unstable and stable edges."""
    return Parallelogram(*(tuple(map(Fraction, v)) for v in vectors))


def square(centre):
    return parallelogram(centre, (1, 0), (0, 1))


def test_a_set_covers_another_only_if_the_map_stretches_it_enough():
    """Free flight with friction: z' decays and z grows by it, so that a tall set covers in z a narrow one."""
    model = MeshModel.of(kind="single", omega=6.0, zeta=0.0, q0=0.0, eps1=0.0)
    with precision(128):
        equations = MeshEquations(exact_parameters(model), bits=128)
        time = 2 * np.pi / 6.0  # P(z, z') = (z + T z', z')
        tall, edges = parallelogram((0, 0), (0, 0.5), (0.01, 0)), ((0.45 * time, 0.45), (0.02, 0))
        shear = parallelogram((0, 0), *edges)
        assert prove_covering(equations, tall, shear, Fraction(1, 100)) > 0
        wide = parallelogram((0, 0), (0, 0.5), (0.1, 0))  # its image has |b| > 1
        aside, far = (parallelogram(at, *edges) for at in ((1, 0), (2 * time, 2)))  # both edges of the latter: a < -1
        longer = parallelogram((0, 0), (0.499 * time, 0.499), (0.02, 0))  # stretched by 0.2 % only
        for first, second in ((shear, tall), (wide, shear), (tall, aside), (tall, far), (tall, longer)):
            with pytest.raises(UndecidedError):
                prove_covering(equations, first, second, Fraction(1, 100))


def test_sets_apart_are_told_from_sets_that_touch():
    first, diamond = square((0, 0)), parallelogram((2, 2), (0.5, 0.5), (0.5, -0.5))
    assert first.is_apart_from(square((2.5, 0)))
    assert not first.is_apart_from(square((2, 2))) and not first.is_apart_from(square((1.5, 1.5)))
    assert first.is_apart_from(diamond)  # an edge of the diamond separates them, none of the square


@pytest.mark.slow
def test_floats_confirm_each_covering_of_a_chaotic_set():
    """Points of all edges, mapped by the exact flow at both ends of the interval of eps1."""
    from gearchaos.proof.balls import from_text
    from tests.chaotic_set import CHAOTIC, robust_chaos

    model, document = MeshModel.of(**CHAOTIC), robust_chaos().document
    sets = [[np.array([float(from_text(t)) for t in s[n]]) for n in ("centre", "unstable", "stable")]
            for s in document["sets"]]
    t = np.linspace(-1, 1, 401)[:, None]
    for first, second in document["transitions"]:
        (c, p, q), (d, *axes) = sets[first], sets[second]
        for eps1 in (0.12 - 1e-6, 0.12 + 1e-6):
            left, right, *others = (
                np.linalg.solve(np.column_stack(axes), (images(model.with_values({"eps1": eps1}), edge) - d).T)
                for edge in (c - p + t * q, c + p + t * q, c + t * p - q, c + t * p + q))
            sign = np.sign(right[0, 0])
            assert (sign * right[0]).min() > 1.01 and (sign * left[0]).max() < -1.01
            a, b = np.concatenate(others, axis=1)
            assert np.abs(b[np.abs(a) <= 1.01]).max(initial=0) < 0.99
