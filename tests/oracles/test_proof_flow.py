"""The flow and the slopes in balls against the exact flow and heyoka, over random mesh periods of all models."""

from dataclasses import dataclass

import numpy as np
import pytest
from flint import arb, arb_mat

from gearchaos.model import HarmonicStiffness, MeshModel, SteppedStiffness, TwoLevelStiffness, state_names, vary
from gearchaos.model.coordinates import from_physical, transmission_error_at_start
from gearchaos.proof.balls import precision
from gearchaos.proof.certificate import UndecidedError
from gearchaos.proof.equations import MeshEquations
from gearchaos.proof.motion import trajectory
from gearchaos.proof.parameters import exact_parameters
from gearchaos.proof.tube import StartTube
from tests.flows import flow_of
from tests.oracles.test_oracles import DIMENSIONS

heyoka_oracle = pytest.importorskip("tests.oracles.heyoka_oracle", exc_type=ImportError)

BITS = 128
ROUNDING = 2e-11
"""Largest error of the floats compared with; balls are widened by it."""
PERIODS = 72
"""Random mesh periods of each of the seven kinds of models below: 504 in all."""
PAIRS = {"J": (1.5, 3), "beta": (0, 0.05), "mu": (2, 6), "kappa": (0.3, 3), "zeta_support": (0, 0.05)}


@dataclass
class Case:
    """A random model, a state and a box about it."""

    model: MeshModel
    state: np.ndarray
    radius: float


def random_case(kind: str, differing: tuple[str, ...], rng: np.random.Generator) -> Case:
    values = {"omega": rng.uniform(0.3, 2.5), "zeta": rng.uniform(0, 0.1), "q1": rng.uniform(0, 0.3),
              "q2": rng.uniform(0, 0.3), "eps1": rng.uniform(0, 0.3), "eps2": rng.uniform(0, 0.1),
              "theta1": rng.uniform(-3, 3), "theta2": rng.uniform(-3, 3)}
    for name, (low, high) in PAIRS.items():
        if kind == "full" or (kind == "torsional" and name in ("J", "beta")):
            pair = rng.uniform(low, high, 2)
            for number in (0, 1):
                values[f"{name}{number + 1}"] = float(pair[number if name in differing else 0])
    initial = {name: float(rng.uniform(-1.2, 1.2)) for name in state_names(kind) if name not in ("z", "z_dot")}
    model = MeshModel.of(kind=kind, **values, **initial, stiffness=random_stiffness(rng))
    return Case(model, flow_of(model)[1][:, 0], 10 ** rng.uniform(-9, -4))


def random_stiffness(rng: np.random.Generator):
    form = rng.integers(3)
    if form == 0:
        return TwoLevelStiffness(*rng.uniform(-0.2, 0.4, 2), rng.uniform(1, 2))
    if form == 1:
        return HarmonicStiffness(tuple(rng.uniform(0, 0.3, 3)), tuple(rng.uniform(-3, 3, 3)))
    count = rng.integers(1, 6)
    return SteppedStiffness(tuple(rng.uniform(0.5, 1.5, count)), tuple(np.sort(rng.uniform(0, 1, count))))


def column(values, radius=0.0):
    return arb_mat(len(values), 1, [arb(v, radius) for v in np.asarray(values).tolist()])


def contains(balls: arb_mat, values: np.ndarray) -> bool:
    """Whether floats lie in balls that are widened by their rounding errors."""
    wide = ROUNDING * (1 + np.abs(values).max())
    flat = np.asarray(values).ravel().tolist()
    return all((b + arb(0, wide)).contains(v) for b, v in zip(balls.entries(), flat, strict=True))


def by_heyoka(model: MeshModel, names: tuple[str, ...]) -> np.ndarray:
    """The state after one mesh period."""
    found = {name: values[:1] for name, values in heyoka_oracle.section(model, 1).items()}
    if model.kind == "single":
        return np.array([found["z"][0], found["z_dot"][0]])
    zero = np.zeros(1)
    x = {name: found.get(name, zero) for name in state_names("full")}
    return from_physical(names, x, *transmission_error_at_start(vary(model, {})))[0]


def check_period(case: Case, rng: np.random.Generator) -> bool:
    """Compare one mesh period with the oracles; false where the tube is not proved."""
    flow, _ = flow_of(case.model)
    starts = np.vstack([case.state, case.state + rng.uniform(-case.radius, case.radius, (4, len(case.state)))])
    images = flow.advance(starts.T.copy(), 1, points=np.zeros(5, int)).w.T
    unit = np.eye(len(case.state))[:, :, None].copy()
    derivative = flow.advance(case.state[:, None].copy(), 1, tangent=unit).tangent[:, :, 0].T
    with precision(BITS):
        equations = MeshEquations(exact_parameters(case.model), bits=BITS)
        assert equations.names == flow.system.names
        try:
            tube = StartTube(equations, column(case.state, case.radius))
        except UndecidedError:
            return False
        assert contains(tube.centre.image, by_heyoka(case.model, equations.names))
        assert contains(tube.centre.image, images[0]) and contains(tube.slopes, derivative)
        assert tube.slopes.contains(tube.centre.derivative)
        assert all(contains(tube.image, image) for image in images)
        exact = [trajectory(equations, column(start)).image for start in starts]
        for first, second in ((0, 1), (1, 2), (2, 3), (3, 4), (1, 4)):  # differences are what the slopes allow
            difference = column(starts[first]) - column(starts[second])
            assert (exact[first] - exact[second]).overlaps(tube.slopes * difference)
            assert tube.image.overlaps(exact[first])
    return True


@pytest.mark.slow
@pytest.mark.parametrize("dimension", DIMENSIONS)
def test_random_periods(dimension):
    kind, differing = DIMENSIONS[dimension]
    rng = np.random.default_rng([len(dimension), int(dimension[0]), 1])
    cases = [random_case(kind, differing, rng) for _ in range(PERIODS)]
    assert len(cases[0].state) == int(dimension[0])
    assert sum(check_period(case, rng) for case in cases) >= 0.9 * PERIODS
