"""Events between two points of a branch: those found over long distances are those found over short ones."""

import json
import math
from functools import cache
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos.continuation.arclength import Settings
from gearchaos.continuation.branch import HALVED, Branch, BranchEnd, follow_branch
from gearchaos.continuation.defining import EventState
from gearchaos.continuation.events import FLIP, GRAZE, find_events, locate
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.orbit import find_cycle
from gearchaos.continuation.shooting import CycleEquations
from gearchaos.continuation.skeleton import Line, line_branches, line_seeds
from gearchaos.continuation.special_points import flip_coefficient
from tests.branches import SINGLE
from tests.event_curves import model_at, state_at

BORN = [
    ("eps1", (0.0, 0.4), {"zeta": 0.038, "q0": 0.218, "eps1": 0.076, "omega": 1.148, "eps3": 0.043}),
    ("q0", (0.0, 0.4), {"zeta": 0.076, "q0": 0.292, "eps1": 0.024, "omega": 1.077, "eps2": 0.098, "theta2": 5.743}),
    ("q0", (0.0, 0.4), {"zeta": 0.034, "q0": 0.063, "eps1": 0.133, "omega": 0.479, "eps2": 0.018, "theta2": 3.482}),
    ("eps1", (0.0, 0.4), {"zeta": 0.043, "q0": 0.157, "eps1": 0.157, "omega": 1.179, "eps3": 0.08})]
"""Models in which two extrema of z are born near a boundary of contact, with an axis and its range."""

TWICE = [
    ("theta1", (0.0, 6.0), {"zeta": 0.047, "q0": 0.084, "eps1": 0.093, "omega": 0.483, "eps2": 0.034, "theta2": 4.502,
                            "eps3": 0.035, "theta1": 3.0}),
    ("omega", (0.2, 1.5), {"zeta": 0.052, "q0": 0.203, "eps1": 0.026, "omega": 0.468}),
    ("omega", (0.2, 1.5), {"zeta": 0.073, "q0": 0.129, "eps1": 0.024, "omega": 1.044, "eps2": 0.016, "theta2": 0.558})]
"""Models of which an extremum of z passes a boundary and soon returns."""


@cache
def fine(number: int) -> Branch:
    name, bounds, values = (BORN + TWICE)[number]
    family, start = find_cycle(gc.MeshModel.of(kind="single", **values), (name,), 1, None)
    return follow_branch(family, start, bounds, Settings())


def check_strides(number: int, strides: list[tuple[int, int]]) -> None:
    """The grazes found in one stride between two points are those of the branch."""
    branch, (low, high) = fine(number), (BORN + TWICE)[number][1]
    equations = CycleEquations(branch.family, 1, high - low)
    assert strides
    for first, last in strides:
        first, last = max(first, 0), min(last, len(branch.points) - 1)
        events = find_events(equations, branch.points[first], branch.points[last])
        found = [e for e in events if e.kind == GRAZE]
        within = [value for i, value in own_grazes(number) if first <= i < last]
        assert sorted(e.point.u[-1] for e in found) == pytest.approx(sorted(within), abs=1e-10)
        assert all(e.defect < 1e-12 and e.boundary in (1, -1) for e in found)


def own_grazes(number: int) -> list[tuple[int, float]]:
    """The point before each graze, and the parameter there."""
    pairs = zip(fine(number).event_positions, fine(number).events, strict=True)
    return [(i, float(e.point.u[-1])) for i, e in pairs if e.kind == GRAZE]


@pytest.mark.parametrize("number", range(len(BORN)))
def test_a_graze_of_new_extrema_is_found_over_longer_distances(number):
    check_strides(number, [(i - reach, i + 1 + reach) for i, _ in own_grazes(number) for reach in (1, 2, 3)])


@pytest.mark.parametrize("number", range(len(BORN), len(BORN) + len(TWICE)))
def test_two_grazes_of_one_extremum_are_found_between_two_points(number):
    check_strides(number, [(i - 1, j + 2) for (i, _), (j, _) in pairwise(own_grazes(number)) if j - i <= 5])


def test_the_coefficient_of_a_flip_is_unknown_next_to_a_graze():
    """In permanent contact the equations are linear, so that the coefficient is 0, up to the graze at ε1 = 0.0683."""
    model = SINGLE.with_values({"omega": 1.8458643004984736})
    family = ParameterFamily(model, ("omega", "eps1"))

    def coefficient(eps1: float) -> float:
        _, cycle = find_cycle(model.with_values({"eps1": eps1}), ("omega", "eps1"), 1, None)
        return flip_coefficient(EventState(cycle), SimpleNamespace(family=family))

    assert coefficient(0.05) == pytest.approx(0.0, abs=1e-5)
    assert math.isnan(coefficient(0.06828)), "the differences reach across the graze"


TORSIONAL = gc.MeshModel.of(omega=1.0, q0=0.1)


@cache
def parent_flips() -> dict[int, list[float]]:
    """The flips of the orbits of 1, 2 and 8 periods, each from branches of its own."""
    found = {}
    for period, eps1 in ((1, 0.05), (2, 0.119), (8, 0.12401)):
        ds = gc.branch(TORSIONAL.with_values({"eps1": eps1}), "eps1=0:0.3")
        assert set(ds["period"].values.tolist()) == {period}
        found[period] = ds["event_value"].values[ds["event_kind"].values == FLIP].tolist()
    return found


@pytest.mark.parametrize(("eps1", "period", "longest_step"), [
    (0.1, 2, 0.03), (0.11, 2, 0.01), (0.115, 2, 0.03), (0.122, 4, 0.03), (0.12408, 16, 0.03), (0.12408, 16, 0.01)])
def test_a_branch_of_doubled_orbits_ends_at_the_flip_of_the_others(eps1, period, longest_step):
    ds = gc.branch(TORSIONAL.with_values({"eps1": eps1}), "eps1=0:0.3", longest_step=longest_step)
    assert set(ds["period"].values.tolist()) == {period}
    joined = [e["value"] for e in json.loads(ds.attrs["ends"]) if e["why"] == "joins a branch of half the period"]
    assert joined
    others = ds["event_value"].values[np.isin(ds["event_kind"].values, ["fold", "pitchfork"])]
    intervals = np.array(json.loads(ds.attrs["stable"]))
    for value in joined:
        assert min(abs(value - flip) for flip in parent_flips()[period // 2]) < 1e-12
        assert all(abs(value - other) > 1e-7 for other in others), "the flip is no event of the branch"
        assert np.abs(intervals - value).min() < 1e-12, "stable up to the flip"


def test_a_cascade_begins_from_an_unstable_orbit():
    ds = gc.branch(TORSIONAL.with_values({"eps1": 0.206}), "eps1=0:0.3", period=1, cascade=2)
    assert [b["period"] for b in json.loads(ds.attrs["cascade"])] == [2, 4]


def half_differences(ds: xr.Dataset) -> np.ndarray:
    """Distances of the first points of orbits of an even period from those half a period later."""
    period = ds["curve_period"].values[ds["curve"].values]
    out = np.full(ds.sizes["point"], np.inf)
    for i in np.flatnonzero(period % 2 == 0):
        names = [n for n in ds.data_vars if str(n).startswith("section_x1")]
        out[i] = max(abs(float(ds[n][i, 0] - ds[n][i, period[i] // 2])) for n in names)
    return out


def test_no_curve_of_doubled_orbits_is_one_of_the_others():
    ds = gc.skeleton(TORSIONAL, "omega=0.9:1.05:12", "eps1=0.1:0.2:8", period=4, lines=(3, 2), workers=1)
    assert np.any((ds["curve_kind"].values == "fold") & (ds["curve_period"].values == 4)) or ds.sizes["number"] > 3
    distance = half_differences(ds)
    for curve in range(ds.sizes["number"]):
        inner = distance[ds["curve"].values == curve][1:-1]
        assert np.all(inner > 1e-6), (curve, str(ds["curve_kind"].values[curve]))


def test_a_graze_curve_ends_where_its_extremum_vanishes():
    """A maximum and a minimum of z merge on the boundary."""
    model = TORSIONAL.with_values({"omega": 2.121, "eps1": 0.2})
    start = {"x1": 1.07, "x1_dot": 0.16, "x2": -0.07, "x2_dot": -0.16}
    ds = gc.curve(model, "graze", "omega=1.8:2.5", "eps1=0.05:0.3", period=3, start=start)
    number = next(i for i, e in enumerate(json.loads(ds.attrs["ends"])) if e["why"].startswith("the extremum of z"))
    orbit = gc.orbit(model_at(TORSIONAL, ds, -number), period=3, near=state_at(ds, -number))
    touching = [e for e in orbit.extrema if abs(e.z - 1) < 1e-5]
    assert [e.maximum for e in touching] in ([True, False], [False, True])
    assert abs(touching[0].time - touching[1].time) < 2e-3


def test_an_unstable_branch_is_unstable_up_to_the_flip_that_it_joins():
    """There its multiplier is 1, the square of −1."""
    def point(value: float, multiplier: float) -> SimpleNamespace:
        return SimpleNamespace(u=np.array([0.0, value]), data=SimpleNamespace(multipliers=np.array([multiplier, 0.1])))

    points = [point(0.1, 1.3), point(0.2, 1.1), point(0.3, 1.0)]
    branch = Branch(SimpleNamespace(), 2, points, ends=[BranchEnd(0.1, "end of the axis"), BranchEnd(0.3, HALVED)])
    assert branch.unstable.tolist() == [1, 1, 1] and branch.stable_intervals() == []


def test_branches_are_followed_beyond_the_ends_of_a_line():
    """The fold of the resonance lies outside the line; the unstable arm inside is joined to it there."""
    model, bounds = SINGLE.with_values({"omega": 0.9}), (0.55, 0.75)
    line = Line(model, ("omega", "eps1"), (bounds, (0.02, 0.08)), 0, 0.05, 6, 2, 1)
    folds = [e.cycle.values[0] for branch in line_branches(line)[1] for e in branch.events if e.kind == "fold"]
    assert any(0.75 < value < 0.8 for value in folds), folds
    assert all(bounds[0] <= seed.values[0] <= bounds[1] for seed in line_seeds(line))


def test_a_point_of_codimension_2_at_a_corner_is_listed_once():
    ds = gc.curve(TORSIONAL.with_values({"omega": 1.22, "eps1": 0.12}), "flip", "omega=0.9:1.3", "eps1=0.1:0.25",
                  period=3)
    corner = ds["special_kind"].values == "grazing-flip"
    assert corner.sum() == 1
    assert float(ds["special_omega"].values[corner][0]) == pytest.approx(1.2081625162836, abs=1e-9)


HIDDEN = {
    "kind": "full", "omega": 0.42575456071205064, "zeta": 0.03259977604780645, "eps1": 0.13086893752598683,
    "theta1": 5.57162066414749, "q0": 0.02535247282463463, "chi1": 0.34506112441382186, "chi2": 0.4276813150161783,
    "contact_ratio": 1.2829697548857468, "beta1": 0.011942317249235085, "beta2": 0.022562684938836067,
    "kappa": 0.9447287919875895}
"""A model with a Neimark–Sacker bifurcation next to a neutral saddle: both change the sign of one test function."""

HIDDEN_START = {
    "x1": 1.038952951523017, "x1_dot": 0.028441364795450456, "x2": -0.014193189974980425,
    "x2_dot": -0.02858631682664987, "y1": 0.03999085659358606, "y1_dot": -0.037150380199150256,
    "y2": -0.03999085659358606, "y2_dot": 0.037150380199150256}


@pytest.mark.exhaustive  # the kernel that corrects orbits of five coordinates is that of no other test
def test_a_bifurcation_next_to_a_neutral_saddle_is_found():
    ds = gc.branch(gc.MeshModel.of(**HIDDEN), "q0=-0.3:0.4", period=1, start=HIDDEN_START)
    for kind, value in (("neimark-sacker", -0.0191027271), ("neutral-saddle", -0.0190924917)):
        values = ds["event_value"].values[ds["event_kind"].values == kind]
        assert np.abs(values - value).min() < 1e-9


def test_no_graze_is_reported_where_extrema_are_matched_wrongly():
    values = {
        "omega": 1.82273808743797, "zeta": 0.025173863735527616, "eps1": 0.09662540622418077,
        "theta1": 3.2504181582165925, "q0": 0.10530715879037605, "eps3": 0.03068892794747089,
        "theta3": 0.23124833690309732, "chi1": 0.10499800250586228, "chi2": 0.49584309800723236,
        "contact_ratio": 1.70378217530502}
    ds = gc.branch(gc.MeshModel.of(kind="single", **values), "theta1=-7:13", period=3,
                   start={"z": 0.6391463715558077, "z_dot": -0.12229316993668578})
    grazes = ds["event_kind"].values == "graze"
    assert grazes.any() and ds["event_residual"].values[grazes].max() < 1e-9


def test_events_are_located_by_changes_of_sign_however_small():
    """Products over the pairs of seven multipliers may be 1e-20 everywhere."""
    branch = fine(0)
    equations, (first, last) = CycleEquations(branch.family, 1, 0.4), branch.points[:2]
    root = 0.7 * first.u[-1] + 0.3 * last.u[-1]
    found = locate(equations, first, last, lambda point: 1e-20 * (point.u[-1] ** 3 - root**3))
    assert found.u[-1] == pytest.approx(root, rel=1e-13)
    at_ends = {id(first): -1.0, id(last): 1.0}  # and no value between
    for function in (lambda point: 1.0, lambda point: at_ends.get(id(point), math.nan)):
        assert locate(equations, first, last, function) is None


@pytest.mark.exhaustive  # that of seven coordinates, too
def test_a_neimark_sacker_point_at_a_high_frequency_has_multipliers_of_modulus_one():
    model = gc.MeshModel.of(
        kind="full", beta1=1e-4, beta2=2e-4, zeta=1e-3, zeta_support=5e-4, omega=12.0, q0=1.0, eps1=1e-3, c1=0.45,
        kappa1=40.0, kappa2=55.0, mu1=0.5, mu2=0.6)
    ds = gc.branch(model, "omega=10.4:12", period=1)
    assert set(ds["event_kind"].values) == {"neimark-sacker"}
    moduli = np.hypot(ds["event_multipliers_real"], ds["event_multipliers_imag"]).values
    np.testing.assert_allclose(np.abs(moduli - 1.0).min(axis=1), 0.0, atol=1e-9)


FOLDS = gc.MeshModel.of(kind="single", zeta=0.05, omega=0.53, damping_law="contact", q0=0.1, eps1=0.107, theta1=-2.79,
                        eps3=0.006, theta3=-0.17, c1=0.323)


@cache
def fold_curve(longest_step: float) -> xr.Dataset:
    return gc.curve(FOLDS, "fold", "omega=0.25:2.4", "q0=0.01:0.5", period=1, longest_step=longest_step)


def test_a_fold_curve_does_not_turn_back_at_a_graze():
    """Some steps before a corner, another extremum is nearer to the boundary than the one that touches it there."""
    ds = fold_curve(0.03)
    assert sorted(ds["special_kind"].values) == ["cusp", *4 * ["grazing-fold"]]
    assert sorted(end["omega"] for end in json.loads(ds.attrs["ends"])) == pytest.approx([0.25, 0.338991], abs=1e-6)


def test_corners_that_a_step_passes_are_found():
    """They lie where they lie, whatever the steps are."""
    found = []
    for ds in (fold_curve(0.03), fold_curve(0.012)):
        corners = ds["special_kind"].values == "grazing-fold"
        found.append(np.column_stack([ds["special_omega"].values[corners], ds["special_q0"].values[corners]]))
    np.testing.assert_allclose(*found, atol=1e-9)


def test_a_curve_that_passes_the_ends_of_both_axes_in_one_step_ends_at_the_first():
    omega, q0 = (fold_curve(0.03)[name].values[-5:-3] for name in ("omega", "q0"))
    low = 0.8 * omega[0] + 0.2 * omega[1]
    ds = gc.curve(FOLDS, "fold", f"omega={low}:2.4", f"q0={q0[0]}:0.5", period=1)
    for end in json.loads(ds.attrs["ends"]):
        assert end["why"] == "end of the axis"
        assert end["omega"] >= low - 1e-12 and end["q0"] >= q0[0] - 1e-12
