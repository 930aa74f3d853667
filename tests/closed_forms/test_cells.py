"""Equations interpolated along parameters: those of the models, and none where they are not smooth."""

from dataclasses import replace

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.interpolation import Cells
from gearchaos.errors import InputError
from gearchaos.flow import PeriodEquations, SensitivityFlow, fastest_rate

FOURIER = gc.HarmonicStiffness(amplitudes=(0.2, 0.05), phases=(0.3, 1.1))
MODELS = {
    "single": gc.MeshModel.of(kind="single", q0=0.1, eps1=0.05, omega=0.8),
    "torsional": gc.MeshModel.of(q0=0.1, eps1=0.05, theta1=0.7, omega=1.4, beta1=0.02),
    "full": gc.MeshModel.of(kind="full", q0=0.1, eps1=0.05, eps3=0.01, kappa1=0.4, omega=0.6),
    "fourier": gc.MeshModel.of(q0=0.1, eps1=0.05, stiffness=FOURIER, damping_law="unilateral")}
AXES = [("single", "omega"), ("torsional", "J1"), ("torsional", "contact_ratio"), ("torsional", "theta1"),
        ("full", "kappa1"), ("full", "eps3"), ("fourier", "c1"), ("fourier", "zeta"), ("fourier", "omega")]


def family_of(name: str, *axes: str) -> ParameterFamily:
    return ParameterFamily(MODELS[name], axes)


def equations_at(family: ParameterFamily, values: np.ndarray) -> PeriodEquations:
    """Those of the cell of the values."""
    return family.cell(values).equations.at(values.tolist())


@pytest.mark.parametrize(("name", "axis"), AXES)
def test_equations_are_those_of_the_model(name, axis):
    """Values to rounding errors, derivatives as far as those by differences are right."""
    family = family_of(name, axis)
    for factor in (0.93, 1.21):
        values = factor * family.start
        found, model = equations_at(family, values), PeriodEquations.of(family.system(values[None]))
        np.testing.assert_allclose(found.parameters, model.parameters, rtol=1e-13, atol=1e-14)
        np.testing.assert_allclose(found.starts, model.starts, rtol=1e-13, atol=1e-14)
        np.testing.assert_allclose(found.steps, model.steps, rtol=0.05)
        first, last = (family.system((share * values)[None]) for share in (1 - 1e-4, 1 + 1e-4))
        rise = PeriodEquations.of(last).parameters - PeriodEquations.of(first).parameters
        for derivatives, by in (
                (found.derivatives.equations, rise), (found.derivatives.starts, last.starts - first.starts)):
            np.testing.assert_allclose(derivatives[:, 0], by / (2e-4 * values), rtol=1e-6, atol=1e-7)


def test_two_parameters_have_the_derivatives_of_each():
    both = family_of("torsional", "omega", "contact_ratio")
    values = both.start * (1.07, 0.96)
    found = equations_at(both, values).derivatives
    for number, axis in enumerate(both.axes):
        single = ParameterFamily(
            MODELS["torsional"].with_values(dict(zip(both.axes, values.tolist(), strict=True))), (axis,))
        alone = equations_at(single, single.start).derivatives
        np.testing.assert_allclose(found.equations[:, number], alone.equations[:, 0], atol=1e-11)
        np.testing.assert_allclose(found.starts[:, number], alone.starts[:, 0], atol=1e-11)


def test_no_transmission_error_is_none_to_the_bit():
    """The lower end of a cell has the arrays of the model, so that a free motion at z = 1 stays there."""
    family = family_of("single", "omega", "eps1")
    found = equations_at(family, np.array([0.77, 0.0]))
    columns = found.harmonics.columns
    assert not np.any(found.parameters[:, [columns.f_cos, columns.f_sin]])
    corner = np.array([0.5, 0.0])
    assert np.array_equal(equations_at(family, corner).parameters,
                          PeriodEquations.of(family.system(corner[None])).parameters)


def cells_with(change, check=lambda values: None) -> Cells:
    """Cells of the equations along ω, in which one stiffness level is a function of it."""
    family = family_of("torsional", "omega")

    def models(values: np.ndarray) -> PeriodEquations:
        own = PeriodEquations.of(family.system(values))
        parameters = own.parameters.copy()
        parameters[:, own.harmonics.columns.levels] = change(values[:, 0])
        return replace(own, parameters=parameters)

    return Cells(models, check, np.array([True]))


@pytest.mark.parametrize("change", [lambda x: np.abs(x - 1.3), lambda x: np.where(x < 1.3, 1.0, 1.001),
                                    lambda x: 1.0 + 1e-9 * (x > 1.3)], ids=["kink", "jump", "small jump"])
def test_nothing_is_interpolated_across_a_kink_or_a_jump(change):
    cells = cells_with(change)
    assert cells.cell(np.array([1.3])) is None
    for value in (1.05, 1.9):
        cell = cells.cell(np.array([value]))
        assert not cell.contains([1.3])
        own = cell.equations.at([value])
        assert own.parameters[0, own.harmonics.columns.levels] == pytest.approx(change(np.array([value]))[0], abs=1e-14)


def test_values_that_the_model_does_not_have_are_left_out():
    """Cells with values for which there are no equations are divided; those with values it refuses are checked."""
    def change(omega):
        if np.any(omega > 1.3):
            raise InputError("omega", "must be at most 1.3", float(omega.max()))
        return omega

    def check(values):
        if np.any(values < 1.1):
            raise InputError("omega", "must be at least 1.1", float(values.min()))

    cells = cells_with(change, check)
    assert cells.cell(np.array([1.31])) is None and not cells.cell(np.array([1.05])).accepted
    assert cells.cell(np.array([1.26])).accepted
    with pytest.raises(InputError, match="contact_ratio must"):
        family_of("torsional", "contact_ratio").check(np.array([[2.5]]))


@pytest.mark.parametrize("axis", ["beta", "beta1"])
def test_equations_at_a_divisor_of_0_are_those_of_the_model(axis):
    """The octaves of a parameter by which the equations divide have no 0."""
    model = gc.MeshModel.of(q0=0.1, eps1=0.05, omega=1.4, beta1=0.0)
    family = ParameterFamily(model, (axis,))
    w = np.array([[1.2, 0.1, 0.0]])[:, : family.dimension]
    family.check(family.start[None])
    found = family.flow(family.start[None]).advance(w)
    assert np.array_equal(found.w, SensitivityFlow(family.system(family.start[None])).advance(w).w)


@pytest.mark.parametrize("value", [np.inf, -np.inf, np.nan])
@pytest.mark.parametrize("axis", ["omega", "q1"])
def test_values_that_are_not_finite_are_refused(axis, value):
    with pytest.raises(InputError, match=f"{axis} must"):
        ParameterFamily(gc.MeshModel.of(q0=0.1, eps1=0.05), (axis,)).check(np.array([[value]]))


def test_a_branch_takes_no_model_at_its_points(monkeypatch):
    """It has hundreds of evaluations; models are computed at the nodes of a few cells."""
    batches = []
    own = ParameterFamily.system
    monkeypatch.setattr(ParameterFamily, "system", lambda self, at: batches.append(len(at)) or own(self, at))
    found = gc.branch(MODELS["single"], "omega=0.55:1.6")
    assert found.sizes["point"] > 50 and len(batches) < 15


def test_a_flow_of_arrays_is_that_of_the_system():
    """With a grid of steps for each point."""
    family = family_of("fourier", "omega")
    system = family.system(np.array([[0.3], [1.5]]))
    assert np.ptp(fastest_rate(system) / system.omega) > 1
    w = np.array([[1.2, 0.1], [1.1, -0.2], [-1.3, 0.0], [0.2, 0.1]])
    points = np.array([1, 0, 0, 1])
    first, second = (SensitivityFlow(each).advance(w, points) for each in (system, PeriodEquations.of(system)))
    assert np.array_equal(first.w, second.w)
    for lane, point in enumerate(points):
        alone = SensitivityFlow(system.take(np.array([point]))).advance(w[[lane]])
        assert np.array_equal(alone.w[0], first.w[lane])
