"""Values of a train that are varied: as of the train that has them, at every point."""

from __future__ import annotations

import re

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.errors import InputError
from gearchaos.gears.operating import as_model
from gearchaos.model import vary
from gearchaos.model.coordinates import initial_state
from gearchaos.model.switched import switched_system
from tests.oracles.random_trains import SHAPES, random_train

ARRAYS = ("pushes", "damping", "stiffness", "offset", "f_cos", "f_sin", "rows", "rates")


@pytest.mark.parametrize("shape", SHAPES)
def test_every_parameter_varies_as_a_train_with_its_value(shape):
    model = as_model(random_train(shape, np.random.default_rng([1, SHAPES.index(shape)])))
    for name, value in model.parameters().items():
        if name.endswith("torque") or value == 0:
            continue
        batch, own = vary(model, {name: [value, 1.1 * value]}), vary(model.with_values({name: 1.1 * value}), {})
        found, expected = switched_system(batch), switched_system(own)
        of = {n: (getattr(found, n)[1], getattr(expected, n)[0]) for n in ("A", "f0", "static_force")}
        of["start"] = initial_state(batch, found)[1], initial_state(own, expected)[0]
        for array in ARRAYS:
            one, other = getattr(found.contacts, array), getattr(expected.contacts, array)
            of[array] = (one, other) if array in ("rows", "rates") else (one[1], other[0])
        for array, (one, other) in of.items():
            np.testing.assert_allclose(one, other, rtol=1e-11, atol=1e-13 * np.abs(other).max(initial=1.0),
                                       err_msg=f"{array} over {name}")


def two_wheels(**shaft: float) -> gc.Train:
    bodies = [gc.Body(name=name, inertia=1e-3) for name in ("a", "b", "c")]
    mesh = gc.Mesh(between=("a", "b"), teeth=(20, 20), base_radii=(0.03, 0.03), stiffness=2e8, backlash=1e-4)
    return gc.Train(speed=600, bodies=bodies, meshes=[mesh], shafts=[gc.Shaft(
        between=("b", "c"), **{"stop": 0.01, "stop_stiffness": 1e3, **shaft})])


@pytest.mark.parametrize(("name", "rule"), [
    ("a.damping", "must be varied where a body has damping"), ("b-c.stiffness", "must be one of"),
    ("b-c.damping", "must be one of")])
def test_what_would_have_no_effect_or_half_of_it_cannot_be_varied(name, rule):
    with pytest.raises(InputError, match=re.escape(rule)):
        vary(as_model(two_wheels()), {name: [1.0, 2.0]})
    assert vary(as_model(two_wheels(stiffness=1e3)), {"b-c.damping": [0.0, 1.0]}).size == 2
