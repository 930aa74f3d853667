"""Motions that reach orbits known already, against the verdict of each."""

from types import SimpleNamespace

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.dynamics import classify
from gearchaos.dynamics.initial_conditions import default_box, spread
from gearchaos.model import vary
from gearchaos.model.switched import coordinates
from gearchaos.studies.core.initial_value_problems import Motions, initial_states, initial_value_problems
from gearchaos.studies.operation.known_orbits import LONGEST, reach
from gearchaos.studies.operation.load_change import wide_states
from gearchaos.studyfile import load_design, load_study
from tests import EXAMPLES, ONE_SPRING

SPEEDS = np.array([0.8, 1.4, 2.1])


@pytest.fixture(scope="module")
def problem():
    """Random states of the torsional model where orbits coexist, 40 at each of three points, and their verdicts."""
    model = gc.MeshModel.of(q0=0.1, eps1=0.1)
    rng, points = np.random.default_rng(1), np.tile(np.arange(3), 40)
    start = initial_states(model, {"omega": SPEEDS[points], "x1": rng.uniform(-3, 3, 120),
                                   "x1_dot": rng.uniform(-2, 2, 120)}, ("z", "z_dot"))
    flow = initial_value_problems(model, {"omega": SPEEDS}, ("z", "z_dot")).flow
    return Motions(flow, start, points), classify(flow, start.copy(), points=points)


@pytest.fixture(scope="module")
def known(problem):
    """The different orbits of the verdicts at each point."""
    motions, found = problem
    known = [[] for _ in SPEEDS]
    for i, point in enumerate(motions.points):
        points = orbit(motions.flow, found.w[:, i], point, found.period[i])
        if found.period[i] and not any(np.abs(points - each.w).max(axis=1).min() < 1e-6 for each in known[point]):
            known[point].append(SimpleNamespace(period=int(found.period[i]), w=found.w[:, i]))
    return known


def orbit(flow, w, point, period):
    """The stroboscopic points (n, 2) of an orbit, one period after another."""
    points = [w]
    for _ in range(period - 1):
        points.append(flow.advance(points[-1][:, None], 1, points=np.array([point])).w[:, 0])
    return np.array(points)


def test_a_motion_that_reaches_a_known_orbit_is_the_one_of_its_own_verdict(problem, known):
    motions, found = problem
    assert max(map(len, known)) > 1 and any(each.period > 1 for at in known for each in at)
    followed, one = (Motions(motions.flow, motions.w.copy(), motions.points) for _ in range(2))
    reached = reach(followed, known)
    assert (reached >= 0).mean() > 0.5
    for i in np.flatnonzero(reached >= 0):
        point, its_orbit = motions.points[i], known[motions.points[i]][reached[i]]
        own = orbit(motions.flow, its_orbit.w, point, its_orbit.period)
        assert found.period[i] == its_orbit.period and np.abs(own - found.w[:, i]).max(axis=1).min() < 1e-6
    for i in np.flatnonzero(reached < 0)[:5]:
        after = motions.flow.advance(motions.w[:, [i]], LONGEST, points=motions.points[[i]]).w
        assert np.array_equal(after[:, 0], followed.w[:, i])
    # an orbit that is not known is not taken for another
    assert np.array_equal(reach(one, [at[:1] for at in known]) >= 0, reached == 0) and (reached > 0).any()


@pytest.mark.slow
def test_a_search_finds_the_same_without_comparing_with_known_orbits(monkeypatch):
    design = load_design(ONE_SPRING)
    scan = {"speed": "780:900:2", "torque": 100.0, "starts": 24, "spacing": 0.02}
    found = gc.speeds_to_avoid(design, **scan)
    assert found.windows and max(each.random_states.fraction for each in found.windows) < 1
    monkeypatch.setattr("gearchaos.studies.operation.followed_motions.LONGEST_ORBIT", 0)
    each_judged = gc.speeds_to_avoid(design, **scan)
    assert [each.words for each in each_judged.windows] == [each.words for each in found.windows]
    for name in ("random_states", "avoided_states", "contact", "period"):
        assert np.array_equal(each_judged.dataset[name], found.dataset[name])


@pytest.mark.parametrize("study", ["spur_50_50", "spur_27_35", "physical_pair", "train_idler"])
def test_wide_states_are_those_of_random_initial_values(study):
    model = load_study(EXAMPLES / f"{study}.toml").model
    speeds, starts, seed = [500.0, 900.0, 2000.0], 5, (3, 1)
    drawn = wide_states(model, {"speed": np.array(speeds)}, [1.0] * 3, starts, seed)
    each, values = np.repeat(speeds, starts), spread(default_box(model), 15, seed)
    expected = initial_states(model, {"speed": each, **values}, coordinates(vary(model, {})))
    assert drawn.shape == expected.shape and np.abs(drawn - expected).max() < 1e-12 < np.ptp(expected, axis=1).min()
