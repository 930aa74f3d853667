"""Orbits corrected in one call of a kernel: those that Newton's method in Python finds, and what is left to it."""

import json
from functools import cache
from typing import Any

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.continuation.arclength import LIMITS, Equations, Point, Settings, Stopped, correct, crossing
from gearchaos.continuation.branch import Branch, follow_branch, follow_doubled
from gearchaos.continuation.defining import event_equations, seed_of
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.orbit import find_cycle
from gearchaos.continuation.shooting import CycleEquations, converge, unknowns
from gearchaos.flow import NotConvergedError

MODELS = {
    "d2": gc.MeshModel.of(kind="torsional", omega=0.95, q0=0.1, eps1=0.14),
    "contact": gc.MeshModel.of(kind="torsional", omega=0.95, q0=0.1, eps1=0.14, damping_law="contact"),
    "d4": gc.MeshModel.of(kind="full", kappa=0.5, omega=1.2, q0=0.1, eps1=0.05),
    "d7": gc.MeshModel.of(kind="full", beta1=0.02, kappa1=0.4, omega=1.2, q0=0.1, eps1=0.05)}
NAMES = pytest.mark.parametrize("name", [
    "d2", "contact", "d4", pytest.param("d7", marks=pytest.mark.exhaustive)])  # a kernel that no other test needs
AXIS, SPANS = (0.7, 2.3), (2.3, 0.25)
KINDS = {"d2": {"flip", "graze"}, "contact": {"flip", "graze"}, "d4": {"fold"}, "d7": {"fold"}}


@cache
def branches(name: str) -> list[Branch]:
    """The branch of the motion, along ω, and those of twice the period at its flips."""
    family, cycle = find_cycle(MODELS[name], ("omega",), 1, None)
    own = follow_branch(family, cycle, AXIS, Settings())
    flips = [event for event in own.events if event.kind == "flip"][:1]
    return [own] + [follow_doubled(family, flip, AXIS, Settings(points=60)) for flip in flips]


def without_kernel(equations: Any) -> Any:
    """The same equations, corrected in Python."""
    equations.corrected = lambda *_: None
    return equations


def check_same(quick: Point, slow: Point, weights: np.ndarray) -> None:
    assert quick.residual <= 1e-12
    np.testing.assert_allclose(quick.u, slow.u, atol=3e-10)
    assert np.sum(weights * quick.tangent * slow.tangent) == pytest.approx(1.0, abs=1e-7)


@NAMES
def test_orbits_of_branches_are_those_of_python(name):
    for branch in branches(name):
        equations, python = (CycleEquations(branch.family, branch.period, 0.7) for _ in range(2))
        for point in branch.points[2:-2:5]:
            guess, rows = point.u + 1e-3 * point.tangent, np.tile(equations.weights * point.tangent, (2, 1))
            assert equations.corrected(guess, rows) is not None
            quick, slow = (correct(each, guess, point.tangent, point.tangent)
                           for each in (equations, without_kernel(python)))
            check_same(quick, slow, equations.weights)
            assert quick.orientation == slow.orientation
            for one, other in zip(vars(quick.data.result).values(), vars(slow.data.result).values(), strict=True):
                if one.ndim == 3 and one.shape != other.shape:  # as many records as there is room for
                    other = other[:, : one.shape[1]]
                if one.ndim != 3 or one.shape[2] not in (4, 3 + branch.family.dimension + 1):
                    np.testing.assert_allclose(one, other, atol=1e-7)
            np.testing.assert_allclose(quick.data.extrema, slow.data.extrema, atol=1e-7)
            np.testing.assert_allclose(quick.data.switches, slow.data.switches, atol=1e-7)


@NAMES
def test_events_along_two_parameters_are_those_of_python(name):
    both = ParameterFamily(MODELS[name], ("omega", "eps1"))
    kinds = set()
    for event in (event for branch in branches(name) for event in branch.events):
        if event.kind not in ("fold", "flip", "graze") or not len(event.cycle.switches):  # linear: degenerate
            continue
        seed = seed_of(event, np.array([event.cycle.values[0], MODELS[name].value("eps1")]))
        equations, python = (event_equations(both, seed, SPANS) for _ in range(2))
        u, normal = equations.unknowns(seed), np.ones(equations.size + 2)
        first = correct(equations, u, normal, normal)
        for distance in (-2e-3, 2e-3):
            guess, rows = first.u + distance * first.tangent, np.tile(equations.weights * first.tangent, (2, 1))
            try:
                slow = correct(without_kernel(python), guess, first.tangent, first.tangent)
            except Stopped:
                continue
            assert equations.corrected(guess, rows) is not None
            quick = correct(equations, guess, first.tangent, first.tangent)
            check_same(quick, slow, equations.weights)
            kinds.add(event.kind)
            assert quick.data.extremum == slow.data.extremum
            if event.kind == "graze":
                continue
            product = np.sum(quick.data.covector * slow.data.covector)
            assert abs(product) == pytest.approx(1.0, abs=1e-7)
            if event.kind == "fold":
                assert quick.data.curvature == pytest.approx(np.sign(product) * slow.data.curvature, rel=1e-4, abs=1e-5)
    assert kinds == KINDS[name]


def corrected(model: gc.MeshModel, axis: str, values: list[float]) -> list[Any]:
    """What the kernel finds of the orbit of a motion at values of a parameter, beginning with the exact orbit."""
    family, _ = find_cycle(model, (axis,), 1, None)
    equations, out = CycleEquations(family, 1, 1.0), []
    for value in values:
        cycle = find_cycle(model.with_values({axis: value}), (axis,), 1, None)[1]
        out.append(equations.corrected(unknowns(cycle), np.tile([0.0, 0.0, 1.0], (2, 1))))
    return out


def test_the_steps_of_the_period_follow_the_frequency():
    """Orbits at both ends of a cell have 14 and 16 steps; one after the other is corrected with its own."""
    values = [1.05, 1.95, 1.06]
    for value, found in zip(values, corrected(gc.MeshModel.of(q0=0.1, eps1=0.01), "omega", values), strict=True):
        assert found[0].residual <= 1e-12 and found[0].u[-1] == value


@pytest.mark.parametrize(("model", "axis"), [
    (gc.MeshModel.of(q0=0.1, eps1=0.01, omega=1.3), "contact_ratio"),  # moves the stiffness jumps
    (gc.MeshModel.of(q0=0.1, eps1=0.01, omega=1.3, damping_law="unilateral"), "eps1"),
    (gc.MeshModel.of(q0=0.1, eps1=0.0, omega=1.3), "eps1"),  # at the end of a cell
], ids=["starts", "unilateral", "end of a cell"])
def test_what_the_kernel_does_not_take_is_left_to_python(model, axis):
    assert corrected(model, axis, [model.value(axis)]) == [None]
    family, cycle = find_cycle(model, (axis,), 1, None)
    branch = follow_branch(family, cycle, tuple(model.value(axis) + np.array([0.0, 0.02])), Settings())
    assert len(branch.points) > 2


def test_long_orbits_are_left_to_python():
    """The same orbit counted 32 and 33 times; both corrections find it."""
    family, cycle = find_cycle(gc.MeshModel.of(q0=0.1, eps1=0.01, omega=1.3), ("omega",), 1, None)
    for count, taken in ((32, True), (33, False)):
        u = np.append(np.tile(cycle.points, (count, 1)).ravel(), cycle.values)
        normal = np.append(np.zeros(len(u) - 1), 1.0)
        equations = CycleEquations(family, count, 1.0)
        assert (equations.corrected(u, np.tile(normal, (2, 1))) is not None) == taken
        found = correct(equations, u + 1e-5 * (1 - normal), normal, normal)
        np.testing.assert_allclose(found.u, u, atol=1e-11)


def test_newtons_method_that_does_not_converge_says_so():
    family, cycle = find_cycle(MODELS["d2"], ("omega",), 1, None)
    cell = family.cell(cycle.values)
    with pytest.raises(NotConvergedError):  # a plane without a normal
        cell.equations.correct(unknowns(cycle) + 1e-3, np.zeros((2, 3)), 1, LIMITS)
    with pytest.raises(Stopped, match="does not converge"):
        correct(CycleEquations(family, 1, 1.0), unknowns(cycle) + 1e-3, np.zeros(3), np.ones(3))


def test_newtons_method_ends_where_it_goes_to_and_fro_across_a_jump():
    class Jump(Equations):
        weights, evaluated = np.ones(2), 0

        def evaluate(self, u):
            self.evaluated += 1
            return np.array([u[0] + np.copysign(1.0, u[0])]), np.array([[1.0, 0.0]]), None

    equations, normal = Jump(), np.array([0.0, 1.0])
    with pytest.raises(Stopped, match="does not converge"):
        correct(equations, np.array([0.5, 0.0]), normal, normal)
    assert equations.evaluated < LIMITS.iterations


def test_the_end_of_an_axis_is_met_exactly():
    branch = branches("d2")[0]
    equations = CycleEquations(branch.family, 1, 0.7)
    assert sorted(end.value for end in branch.ends) == [*AXIS]
    assert {branch.points[0].u[-1], branch.points[-1].u[-1]} == {*AXIS}
    first, last = branch.points[10:12]
    value = 0.3 * first.u[-1] + 0.7 * last.u[-1]
    found = crossing(equations, first, last, 2, value)
    assert found.u[-1] == value
    alone = converge(branch.family, found.data.points + 1e-4, np.array([value]))
    np.testing.assert_allclose(found.data.points, alone.points, atol=1e-10)
    assert crossing(equations, first, last, 2, 2 * last.u[-1] - first.u[-1]) is None


def test_a_fold_curve_that_touches_the_graze_curve_is_followed_beyond():
    """It arrives at the graze from one side and leaves on the other, at a tangent to itself."""
    model = gc.MeshModel.of(kind="torsional", q0=0.1, omega=1.0481962416721007, eps1=0.234375)
    start = {"x1": 0.557204250170881, "x1_dot": -0.0887991584842113}
    ds = gc.curve(model, "fold", "omega=0.2:2.5", "eps1=0:0.25", period=4, start=start)
    ends = json.loads(ds.attrs["ends"])
    assert [(end["why"], end["eps1"]) for end in ends] == 2 * [("end of the axis", 0.25)]
    assert sorted(end["omega"] for end in ends) == pytest.approx([1.018328, 1.023699], abs=1e-5)


def test_a_curve_that_comes_back_to_a_corner_ends_there():
    """Along its graze this flip curve leaves the corner so flat that it is met again; then it would go back along
    itself."""
    model = gc.MeshModel.of(
        kind="single", zeta=0.01, omega=2.082, damping_law="contact", q0=0.2, eps1=0.098, eps2=0.057, theta2=-1.17,
        stiffness=gc.TwoLevelStiffness(chi1=0.28804952826654273, chi2=0.11434795850151508,
                                       contact_ratio=1.8248389744958646))
    ds = gc.curve(model, "flip", "omega=0.25:2.4", "eps1=0:0.3", period=2, max_points=250)
    first, last = ([end["omega"], end["eps1"]] for end in json.loads(ds.attrs["ends"]))
    assert np.abs(np.subtract(first, last)).max() > 0.1, "not twice the same end"
