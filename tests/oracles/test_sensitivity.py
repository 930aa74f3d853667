"""Monodromy matrices and parameter derivatives of a mesh period against differences of an independent integration."""

from dataclasses import replace

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.continuation.family import ParameterFamily
from gearchaos.model import HarmonicStiffness, MeshModel, SteppedStiffness
from tests.flows import central_difference

heyoka_oracle = pytest.importorskip("tests.oracles.heyoka_oracle", exc_type=ImportError)

STEP = 1e-3
"""Of differences of sixth order: their error is below 1e-11 where no switch is near a graze."""

SINGLE = gc.MeshModel.of(kind="single", omega=0.8, zeta=0.03, q0=0.1, eps1=0.15, theta1=0.4, z=1.3, z_dot=0.2)
FULL = gc.MeshModel.of(kind="full", omega=0.7, q0=0.12, eps1=0.2, x1=1.1, x1_dot=0.1, y1=0.05, y1_dot=-0.1)
MODELS = {
    "levels": SINGLE, "harmonics": replace(SINGLE, stiffness=HarmonicStiffness((0.2, 0.1), (0.3, 1.0))),
    "steps": replace(SINGLE, stiffness=SteppedStiffness((0.8, 1.4, 0.6, 1.1), (0.07, 0.2, 0.45, 0.7)))}


def difference(model: MeshModel, name: str, value: float) -> np.ndarray:
    """Derivative of z and z' after one mesh period by a parameter or initial value, (2,)."""
    def end(change: float) -> np.ndarray:
        found = heyoka_oracle.section(model.with_values({name: value + change}), 1)
        return np.array([found["z"][0], found["z_dot"][0]])

    return central_difference(end, STEP)


def period(model: MeshModel, axes: tuple[str, ...] = ()):
    """One mesh period of the motion of a model, with derivatives by parameters."""
    family = ParameterFamily(model, axes)
    values = family.start[None]
    return family.names, family.flow(values).advance(family.initial_states(values))


@pytest.mark.parametrize(("stiffness", "name"), [
    *(("levels", name) for name in ("omega", "zeta", "q1", "eps1", "theta1", "chi1", "chi2", "contact_ratio", "J1")),
    ("harmonics", "c1"), ("harmonics", "alpha2"), ("harmonics", "omega"), ("steps", "omega"), ("steps", "zeta")])
def test_derivatives_by_parameters(stiffness, name):
    model = MODELS[stiffness]
    _, out = period(model, (name,))
    assert out.switch_count[0] > 0, "the motion must change its contact state"
    exact = difference(model, name, model.value(name))
    np.testing.assert_allclose(out.sensitivity[0, :, 0], exact, rtol=1e-8, atol=1e-9)


def test_the_derivative_by_an_instant_of_a_stiffness_jump_in_contact():
    """Without contact at that instant the derivative would be 0."""
    model = SINGLE.with_values({"z": 1.8, "z_dot": -1.0})
    _, out = period(model, ("contact_ratio",))
    assert np.abs(out.sensitivity).max() > 0.1
    exact = difference(model, "contact_ratio", model.value("contact_ratio"))
    np.testing.assert_allclose(out.sensitivity[0, :, 0], exact, rtol=1e-8, atol=1e-9)


@pytest.mark.parametrize("name", ["kappa", "mu", "beta", "omega"])
def test_derivatives_by_parameters_of_the_full_model(name):
    _, out = period(FULL, (name,))
    assert out.w.shape[1] == 4 and out.switch_count[0] > 0
    exact = difference(FULL, name, FULL.value(name))
    np.testing.assert_allclose(out.sensitivity[0, :2, 0], exact, rtol=1e-8, atol=1e-9)


def test_monodromy_of_the_single_model():
    _, out = period(SINGLE)
    exact = np.stack([difference(SINGLE, name, SINGLE.initial[name]) for name in ("z", "z_dot")], axis=1)
    np.testing.assert_allclose(out.monodromy[0], exact, rtol=1e-8, atol=1e-9)


def test_monodromy_of_the_full_model():
    """A displacement of x1 changes z alone; one of y1 changes z and the lateral coordinate y1 − y2."""
    names, out = period(FULL)
    column = {name: out.monodromy[0][:2, i] for i, name in enumerate(names)}
    assert set(column) == {"z", "z_dot", "y", "y_dot"}
    exact = {name: difference(FULL, name, FULL.initial[name]) for name in ("x1", "x1_dot", "y1", "y1_dot")}
    for suffix in ("", "_dot"):
        np.testing.assert_allclose(column[f"z{suffix}"], exact[f"x1{suffix}"], rtol=1e-8, atol=1e-9)
        both = column[f"z{suffix}"] + column[f"y{suffix}"]
        np.testing.assert_allclose(both, exact[f"y1{suffix}"], rtol=1e-8, atol=1e-9)
