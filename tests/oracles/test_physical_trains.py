"""Random trains in the flow, against an integration of all physical coordinates that shares no code."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.flow import OK, Measure, of_meshes
from gearchaos.gears.operating import as_model
from gearchaos.quantities import parameter_owner
from gearchaos.studies.initial_value_problems import initial_value_problems
from tests.oracles.physical_trains import Contacts, Oracle
from tests.oracles.random_trains import SHAPES, random_state, random_train

QUICK = [("chain", 1), ("chain", 3), ("branched", 0), ("stages", 1), ("stops", 1), ("supported", 1), ("internal", 0),
         ("driven", 1), ("driven", 3), ("pairs", 0), ("pairs", 1), ("star", 1), ("planetary", 0), ("planetary", 3),
         ("split", 0)]
"""Shapes and seeds whose states have few dimensions, since each dimension is compiled for itself."""


@pytest.mark.slow
@pytest.mark.parametrize(("shape", "seed"), QUICK)
def test_random_trains_agree_with_an_independent_integration(shape, seed):
    assert difference(shape, seed) < 1e-11


@pytest.mark.exhaustive
@pytest.mark.parametrize("seed", [*range(4), *range(20, 30)])
@pytest.mark.parametrize("shape", SHAPES)
def test_many_random_trains_agree_with_an_independent_integration(shape, seed):
    assert difference(shape, seed, 2) < 1e-10


def difference(shape: str, seed: int, periods: int = 1) -> float:
    """The largest difference of coordinates after common periods, relative to the growth of a disturbance."""
    rng = np.random.default_rng([seed, SHAPES.index(shape)])
    train = random_train(shape, rng)
    oracle = Oracle(train, train.period)
    model, state = as_model(train), random_state(oracle, rng)
    w = in_coordinates(oracle, train, model, 0.0, state)
    out = initial_value_problems(model).flow.advance(w[:, None], periods, tangent=np.eye(len(w))[:, :, None])
    expected = in_coordinates(oracle, train, model, periods * train.period, oracle.after(state, periods))
    assert out.status[0] == OK
    assert oracle.switches
    growth = max(1.0, np.abs(out.tangent).max(), np.abs(w).max())
    return float(np.abs(out.w[:, 0] - expected).max()) / growth


@pytest.mark.slow
@pytest.mark.parametrize(("shape", "seed"), [
    ("chain", 1), ("chain", 3), ("stages", 1), ("stops", 1), ("driven", 3), ("supported", 1), ("planetary", 3)])
def test_what_is_measured_of_meshes_agrees_with_an_independent_integration(shape, seed):
    rng = np.random.default_rng([seed, SHAPES.index(shape)])
    train = random_train(shape, rng)
    oracle, model = Oracle(train, train.period), as_model(train)
    state = random_state(oracle, rng)
    w = in_coordinates(oracle, train, model, 0.0, state)
    out = initial_value_problems(model).flow.advance(w[:, None], 1, measured=True)
    oracle.after(state, 1)
    found, units = of_meshes(out.measures)[:, :, 0], model.units
    for own, expected in zip(found, oracle.measured, strict=False):  # stops are no meshes
        assert own[Measure.FRONT_TIME] == pytest.approx(expected.front_time * units.rate, rel=1e-10, abs=1e-10)
        assert own[Measure.BACK_TIME] == pytest.approx(expected.back_time * units.rate, rel=1e-10, abs=1e-10)
        assert own[Measure.FORCE_SQUARE] == pytest.approx(
            expected.force_square * units.rate / units.force**2, rel=1e-7, abs=1e-12)
        assert own[Measure.CONTACT_FORCE] == pytest.approx(expected.force * units.rate / units.force, rel=1e-7)
        size = max(abs(expected.largest), abs(expected.smallest)) / units.force
        assert own[Measure.FORCE_MAX] == pytest.approx(expected.largest / units.force, abs=1e-5 * size)
        assert own[Measure.FORCE_MIN] == pytest.approx(expected.smallest / units.force, abs=1e-5 * size)
        assert own[Measure.SWITCHES] == expected.switches


def in_coordinates(oracle: Oracle, train: gc.Train, model: Any, t: float, w: np.ndarray) -> np.ndarray:
    """A state (q, q') as the coordinates of the model: deflections by name, and the speed of turning as a whole."""
    units, out = model.units, []
    known = {**{c.name: c for c in oracle.contacts}, **{s.name: s for s in oracle.springs}}
    known = {parameter_owner(name): element for name, element in known.items()}
    for name in model.state_names:
        owner = name.removesuffix("_dot").rpartition(".")[0] or next(iter(known))
        if name.startswith("rotation"):
            out.append(oracle.turning(w) * train.meshes[0].base_radii[0] / (units.length * units.rate))
            continue
        element = known[owner]
        s, rate = oracle.deflection(element, t, w)
        play = backlash(train, element.name) / 2 if isinstance(element, Contacts) else 0.0
        out.append(rate / (units.length * units.rate) if name.endswith("_dot") else (s + play) / units.length)
    return np.array(out)


def backlash(train: Any, name: str) -> float:
    return next((mesh.backlash for mesh in train.meshes if mesh.name == name), 0.0)
