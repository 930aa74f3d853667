"""The events at which orbits that are followed side by side end, beside those of pseudo-arclength continuation."""

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.continuation.events import critical_event
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.natural import Follower, Path
from tests.branches import DOUBLED, SINGLE

SYMMETRIC = gc.MeshModel.of(kind="single", chi0=0, q0=0, zeta=0.05, omega=0.6, eps1=2.0)
CASES = [  # kind, model, parameter, from, to
    ("fold", SINGLE, "omega", 0.46, 0.48), ("flip", SINGLE, "omega", 2.2, 2.1),
    ("flip", DOUBLED, "eps1", 0.05, 0.1), ("pitchfork", SYMMETRIC, "omega", 0.36, 0.34)]


def path(model: gc.MeshModel, parameter: str, start: float, until: float, holds=lambda orbits, i: True) -> Path:
    orbit = gc.orbit(model.with_values({parameter: start}))
    family = ParameterFamily(orbit.model, (parameter,))
    return Path({}, start, until, orbit.period, family.initial_states(family.start[None])[0], holds)


@pytest.mark.parametrize(("kind", "model", "parameter", "start", "until"), CASES)
def test_an_orbit_ends_at_the_event_of_its_branch(kind, model, parameter, start, until):
    ((end, w),) = Follower(model, parameter).ends([path(model, parameter, start, until)])
    low, high = sorted((start, until))
    branch = gc.branch(model.with_values({parameter: start}), f"{parameter}={low - 0.01 * low}:{high + 0.01 * high}")
    events = branch.event_value.values[branch.event_kind.values == kind]
    assert end.kind == kind and end.resolution == 0.0 and np.isfinite(w).all()
    assert np.abs(events - end.value).min() < 1e-10


def test_several_orbits_are_followed_side_by_side_as_each_alone():
    paths = [path(SINGLE, "omega", 2.2, until) for until in (2.1, 2.18, 2.3)]
    follower = Follower(SINGLE, "omega")
    together = follower.ends(paths)
    assert [end for end, _ in together] == [follower.ends([one])[0][0] for one in paths]
    assert [end.kind for end, _ in together] == ["flip", "", ""] and together[1][0].value == 2.18


def test_an_orbit_is_followed_as_long_as_it_is_of_a_kind():
    touches = path(SINGLE, "omega", 1.6, 1.4, lambda orbits, i: orbits.contact[i] == 0)
    ((end, _),) = Follower(SINGLE, "omega").ends([touches])
    branch = gc.branch(SINGLE.with_values({"omega": 1.6}), "omega=1.4:1.7")
    grazes = branch.event_value.values[branch.event_kind.values == "graze"]
    assert end.kind == "graze" and np.abs(grazes - end.value).min() < 1e-10


@pytest.mark.parametrize(("multipliers", "kinds"), [
    ([0.99999, 0.3], ("fold", "pitchfork")), ([-0.99999, 0.3], ("flip", "flip")), ([0.9, 0.3], ("", "")),
    ([0.6 + 0.8j, 0.6 - 0.8j], ("neimark-sacker", "neimark-sacker"))])
def test_an_event_is_named_by_the_critical_multiplier_and_by_what_is_beyond(multipliers, kinds):
    assert tuple(critical_event(np.array(multipliers, complex), exists) for exists in (False, True)) == kinds
