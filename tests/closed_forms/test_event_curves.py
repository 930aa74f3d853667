"""Curves of events, skeletons and manifolds: closed forms, invariants, and other ways to the same curves and maps."""

import json
import math
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from scipy.linalg import expm
from scipy.optimize import brentq, minimize_scalar

import gearchaos as gc
from gearchaos.continuation.arclength import Settings, between
from gearchaos.continuation.branch import doubled_start, follow_branch
from gearchaos.continuation.corners import roots_on_circle
from gearchaos.continuation.defining import EventState
from gearchaos.continuation.family import ParameterFamily
from gearchaos.continuation.orbit import find_cycle
from gearchaos.continuation.shooting import CycleEquations, converge, evaluate
from gearchaos.continuation.skeleton import Line, line_seeds
from gearchaos.continuation.special_points import flip_coefficient
from gearchaos.dynamics import classify
from gearchaos.flow import ExactFlow
from gearchaos.model.switched import reversed_in_time, velocity_signs
from tests.branches import flip_determinant
from tests.event_curves import FULL, SINGLE, SMALL, folds, model_at, state_at

SADDLES = SINGLE.with_values({"omega": 2.3})
def ends(ds: xr.Dataset) -> list[dict]:
    return json.loads(ds.attrs["ends"])


def system(level: float, omega: float, eps1: float) -> np.ndarray:
    """The matrix of z'' + 2 ζ z' + χ (z − 1) = q0 + ε1 ω² cos ωτ for the state (z − 1, z', cos ωτ, sin ωτ, 1)."""
    return np.array([
        [0, 1, 0, 0, 0], [-level, -2 * SINGLE.zeta, eps1 * omega**2, 0, SINGLE.value("q0")], [0, 0, 0, -omega, 0],
        [0, 0, omega, 0, 0], [0, 0, 0, 0, 0]])


def linear_minimum(omega: float, eps1: float) -> float:
    """The least z − 1 of the periodic motion in permanent contact."""
    stiffness, start = SINGLE.stiffness, np.eye(5)
    first = stiffness.contact_ratio - 1
    parts = [(system(level, omega, eps1), share * 2 * math.pi / omega)
             for level, share in ((1 + stiffness.chi1, first), (1 - stiffness.chi2, 1 - first))]
    for matrix, span in parts:
        start = expm(matrix * span) @ start
    state = np.array([0, 0, 1, 0, 1.0])
    state[:2] = np.linalg.solve(np.eye(2) - start[:2, :2], start[:2, 2:] @ state[2:])
    found = math.inf
    for matrix, span in parts:
        count = 60
        step, values = expm(matrix * span / count), [state]
        for _ in range(count):
            values.append(step @ values[-1])
        at = int(np.argmin([v[0] for v in values]))
        low, high = max(at - 1, 0) * span / count, min(at + 1, count) * span / count
        best = minimize_scalar(lambda t, m=matrix, s=state: (expm(m * t) @ s)[0], bounds=(low, high), method="bounded",
                               options={"xatol": 1e-9})
        found, state = min(found, best.fun, values[0][0], values[-1][0]), values[-1]
    return found


def test_the_flip_curve_in_permanent_contact_is_a_line_of_constant_frequency():
    ds = gc.curve(SINGLE.with_values({"omega": 1.8}), "flip", "omega=1.7:2.0", "eps1=0:0.06", period=1)
    exact = brentq(flip_determinant, 1.7, 2.0, xtol=1e-14)
    assert exact == pytest.approx(1.8458643004984736, abs=1e-12)
    np.testing.assert_allclose(ds["omega"], exact, atol=1e-12)
    assert sorted(end["eps1"] for end in ends(ds)) == [0.0, 0.06], "it ends exactly on the bounds"
    assert ds.sizes["special"] == 0, "its coefficient is 0 throughout: no generalised flip is reported"


def test_the_graze_in_permanent_contact_is_that_of_the_linear_response():
    ds = gc.curve(SINGLE.with_values({"omega": 1.5}), "graze", "omega=1.3:2.5", "eps1=0.001:0.1", period=1)
    assert ds.attrs["boundary"] == 1
    for i in np.linspace(0, ds.sizes["point"] - 1, 7).astype(int):
        omega, eps1 = float(ds["omega"][i]), float(ds["eps1"][i])
        exact = brentq(lambda e, o=omega: linear_minimum(o, e), 0.5 * eps1, 1.5 * eps1, xtol=1e-13)
        assert eps1 == pytest.approx(exact, abs=1e-10)


def check_same_ends(one: xr.Dataset, other: xr.Dataset) -> None:
    own, others = (sorted((e["eps1"], e["omega"]) for e in ends(ds)) for ds in (one, other))
    np.testing.assert_allclose(own, others, atol=1e-8)


def test_axes_can_be_exchanged():
    ds = folds()
    middle = ds.sizes["point"] // 3
    other = gc.curve(model_at(SINGLE, ds, middle), "fold", "eps1=0.02:0.08", "omega=0.5:1.2", period=1,
                     start=state_at(ds, middle))
    check_same_ends(ds, other)
    order = np.argsort(ds["eps1"].values)
    line = np.interp(other["eps1"], ds["eps1"].values[order], ds["omega"].values[order])
    np.testing.assert_allclose(other["omega"], line, atol=2e-4)


@cache
def flips() -> xr.Dataset:
    return gc.curve(SINGLE.with_values({"omega": 1.8}), "flip", "omega=1.5:2.0", "eps1=0.02:0.08", period=1)


@pytest.mark.parametrize(("event", "share"), [("fold", 0.0), ("fold", 0.7), ("flip", 0.3), ("flip", 1.0)])
def test_every_point_is_a_start_of_the_same_curve(event, share):
    ds, x = (folds(), "omega=0.5:1.2") if event == "fold" else (flips(), "omega=1.5:2.0")
    i = int(share * (ds.sizes["point"] - 1))
    again = gc.curve(model_at(SINGLE, ds, i), event, x, "eps1=0.02:0.08", period=1, start=state_at(ds, i))
    check_same_ends(ds, again)


def test_the_neimark_sacker_curve_has_multipliers_of_modulus_one_and_its_strong_resonances():
    ds = gc.curve(FULL, "neimark-sacker", "eps1=0:0.3", "omega=0.6:1.5", period=1)
    multipliers = ds["multipliers_real"].values + 1j * ds["multipliers_imag"].values
    critical = np.exp(1j * ds["angle"].values)
    np.testing.assert_allclose(np.abs(multipliers - critical[:, None]).min(axis=1), 0, atol=1e-9)
    third = np.flatnonzero(ds["special_kind"].values == "1:3 resonance")
    at = float(ds["special_eps1"][third[0]]), float(ds["special_omega"][third[0]])
    assert at == pytest.approx((0.123942, 0.757782), abs=1e-6)
    for i in np.linspace(0, ds.sizes["point"] - 1, 4).astype(int):  # by the exact flow
        family = ParameterFamily(model_at(FULL, ds, i).with_values(state_at(ds, i)), ())
        w, flow = family.initial_states(family.start[None]).T.copy(), family.exact_flow(family.start[None])
        np.testing.assert_allclose(flow.advance(w, 1).w, w, atol=1e-10)
        beside = w + 1e-6 * np.hstack([np.eye(family.dimension), -np.eye(family.dimension)])
        ahead, back = np.hsplit(flow.advance(beside, 1, points=np.zeros(2 * family.dimension, int)).w, 2)
        assert np.abs(np.linalg.eigvals((ahead - back) / 2e-6) - critical[i]).min() < 1e-7


def test_a_skeleton_explains_its_map():
    skeleton = gc.skeleton(SMALL, "omega=1.7:2.3:12", "eps1=0.03:0.09:6", period=2, lines=(3, 2), starts=1, workers=1)
    zones = gc.zones(SMALL, "omega=1.7:2.3:25", "eps1=0.03:0.09:16")
    found = gc.agreement(skeleton, zones)
    assert set(zones["period"].values[zones["label"].values == 1]) >= {1, 2}
    assert found.sizes["side"] > 20 and found.attrs["explained"] == 1
    assert (found["orbit_sides"].sel(cause_name="unexplained") == 0).all()
    flips = ((skeleton["curve_kind"] == "flip") & (skeleton["curve_period"] == 1)).values
    assert found["curve_seen"].values[flips].any()
    without = skeleton.assign(curve_kind=("number", np.where(flips, "graze", skeleton["curve_kind"].values)))
    assert gc.agreement(without, zones).attrs["explained"] < 1, "at a graze no motion needs to end"


@cache
def manifolds() -> xr.Dataset:
    return gc.manifolds(SADDLES, period=3, length=12, spacing=0.01)


def branch(ds: xr.Dataset, number: int) -> tuple[np.ndarray, np.ndarray]:
    """The points (P, 2) of one branch of a manifold, and those (n, 2) of its saddle."""
    own, of = ds["manifold"].values == number, int(ds["manifold_saddle"][number])
    points = np.column_stack([ds[f"saddle_section_{n}"].values[of] for n in ("z", "z_dot")])
    return np.column_stack([ds["z"].values[own], ds["z_dot"].values[own]]), points[np.isfinite(points[:, 0])]


def flow_beside_saddles() -> ExactFlow:
    family = ParameterFamily(SADDLES, ())
    return family.exact_flow(family.start[None])


def distance(line: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Distances of points (P, 2) from a polyline."""
    start, direction = line[:-1], np.diff(line, axis=0)
    square = np.maximum((direction**2).sum(1), 1e-300)
    share = np.clip(((points[:, None] - start) * direction).sum(2) / square, 0, 1)
    return np.linalg.norm(points[:, None] - start - share[..., None] * direction, axis=2).min(axis=1)


def test_manifolds_begin_at_their_saddles():
    assert manifolds().sizes["saddle_number"] > 0
    for number in range(manifolds().sizes["number"]):
        line, saddle = branch(manifolds(), number)
        assert np.linalg.norm(saddle - line[0], axis=1).min() < 1.1e-5


@pytest.mark.parametrize("stable", [False, True])
def test_images_of_a_manifold_lie_on_it(stable):
    ds = manifolds()
    number = int(np.flatnonzero(ds["manifold_stable"].values == stable)[0])
    line, saddle = branch(ds, number)
    assert (ds["saddle_multipliers_real"][int(ds["manifold_saddle"][number])] > 0).all(), "no change of side"
    points = line[len(line) // 10 : len(line) // 2 : 7]
    images = flow_beside_saddles().advance(points.T.copy(), len(saddle), points=np.zeros(len(points), int)).w.T
    assert distance(line, images).max() < (1e-4 if stable else 1e-3)


def test_stable_manifolds_separate_basins():
    line, _ = branch(manifolds(), int(np.flatnonzero(manifolds()["manifold_stable"].values)[0]))
    tangent = np.diff(line, axis=0)[20:800:10]
    normal = np.column_stack([-tangent[:, 1], tangent[:, 0]]) / np.linalg.norm(tangent, axis=1)[:, None]
    starts = np.concatenate([line[20:800:10] + side * normal for side in (1e-5, -1e-5)])
    found = classify(flow_beside_saddles(), starts.T.copy(), np.zeros(len(starts), int), response=False)
    one, other = np.split(found.period, 2)
    assert np.all(one != other), "motions on either side lead to different attractors"
    assert len(set(one)) == len(set(other)) == 1


@pytest.mark.parametrize(("d", "values"), [
    (2, {"q0": 0.1}), (2, {"kind": "single"}), (3, {"beta1": 0.02}), (4, {"kind": "full"}),
    (5, {"kind": "full", "beta1": 0.02}), (5, {"kind": "full", "J1": 1.5}), (6, {"kind": "full", "kappa1": 0.6}),
    (4, {"kind": "full", "mu1": 4.0, "kappa2": 1.0, "mu2": 8.0}), (7, {"kind": "full", "kappa1": 0.6, "beta1": 0.02})])
def test_the_flow_in_reversed_time_is_the_inverse(d, values):
    """Of the dimension that follows from the symmetry of the wheels; other laws of damping are in test_damping_laws."""
    family = ParameterFamily(gc.MeshModel.of(omega=0.9, eps1=0.1, **values), ())
    assert family.dimension == d
    system = family.system(family.start[None])
    w = np.random.default_rng(d).uniform(-2, 2, (d, 60))
    sign, points = velocity_signs(family.names)[:, None], np.zeros(60, int)
    there = ExactFlow(system).advance(w, 1, points=points).w
    back = sign * ExactFlow(reversed_in_time(system)).advance((sign * there).copy(), 1, points=points).w
    np.testing.assert_allclose(back, w, atol=1e-12)


def test_linear_motions_have_no_folds():
    """In permanent contact all orbits of doubled period exist at one frequency, that of the flip, as a continuum."""
    seeds = line_seeds(Line(SMALL, ("omega", "eps1"), ((1.7, 2.3), (0.0, 0.09)), 0, 0.05, 8, 0, 2))
    family = ParameterFamily(SMALL, ("omega", "eps1"))
    without_switches = {s.kind for s in seeds if len(evaluate(family, s.points, s.values).switches) == 0}
    assert "flip" in without_switches and "fold" not in without_switches


def test_a_point_between_two_that_are_equal_to_rounding_is_one_of_them():
    family, cycle = find_cycle(SINGLE, ("omega",), 1, None)
    equations = CycleEquations(family, 1, 0.2)
    first, last = follow_branch(family, cycle, (0.9, 1.1), Settings(points=2)).points[:2]
    middle = between(equations, first, last, 1e-3)
    again = between(equations, first, last, 1e-3, (middle, middle))
    np.testing.assert_allclose(again.u, middle.u, rtol=0, atol=1e-13)


def test_a_test_function_without_value_has_no_root_there():
    assert list(roots_on_circle(lambda v: math.nan if 0.4 < v < 0.6 else v - 0.5, float, np.array([0.0, 1.0]))) == []


def test_grazes_at_neutral_saddles_are_no_points_of_codimension_2():
    """Where the product of two real multipliers is 1 no torus is born."""
    model = gc.MeshModel.of(kind="torsional", omega=0.744, zeta=0.013, q0=0.178, eps1=0.265, beta1=0.02, beta2=0.005)
    start = {"x1": 0.6780226339581599, "x1_dot": 0.13198493138942619, "x2": 0.48841919838794884,
             "x2_dot": -0.12798748006052912}
    ds = gc.curve(model, "graze", "omega=0.3:2.4", "eps1=0.01:0.4", period=3, start=start, max_points=150)
    for i in np.flatnonzero(ds["special_kind"].values == "grazing-neimark-sacker"):
        away = np.hypot(*(ds[n].values - float(ds[f"special_{n}"][i]) for n in ("omega", "eps1")))
        assert np.abs(ds["multipliers_imag"].values[np.argmin(away)]).max() > 1e-3, i


def test_a_graze_of_linear_motions_has_no_points_of_codimension_2():
    """At the flip of the linear equations orbits of twice the period have any amplitude up to their graze, with a
    multiplier that is 1 to rounding errors of either sign."""
    model = gc.MeshModel.of(q0=0.1, omega=1.8492625656182369, eps1=0.015625)
    start = {"x1": 1.0128586091534064, "x1_dot": 0.06073542556278667}  # of one that grazes
    ds = gc.curve(model, "graze", "omega=1.7:2", "eps1=0.001:0.06", period=2, start=start)
    assert np.ptp(ds["omega"].values) < 1e-8, "the frequency of the flip"
    assert ds.sizes["point"] > 10 and "grazing-fold" not in ds["special_kind"].values.tolist()


def test_a_graze_curve_of_the_doubled_period_ends_at_the_flip_of_the_linear_response():
    """Where the multiplier of the linear response is −1 and its least z is 1."""
    start = {"z": 0.9776004797919187, "z_dot": 0.0013682960100234443}
    model = SINGLE.with_values({"omega": 2.073068739979441, "eps1": 0.08285644957624927})
    ds = gc.curve(model, "graze", "omega=1.7:2.2", "eps1=0.05:0.09", period=2, start=start)
    found = [end for end in ends(ds) if end["why"] == "joins the flip curve of half the period"]
    assert len(found) == 1
    omega = brentq(flip_determinant, 2.1, 2.2, xtol=1e-14)
    eps1 = brentq(lambda e: linear_minimum(omega, e), 0.05, 0.1, xtol=1e-13)
    assert (found[0]["omega"], found[0]["eps1"]) == pytest.approx((omega, eps1), abs=1e-10)
    assert "grazing-flip" in ds["special_kind"].values.tolist()


def test_a_fold_curve_ends_where_the_coefficient_of_the_flip_of_half_the_period_vanishes():
    """Both parameters are even functions of the distance of the two halves of the orbit, which vanishes there."""
    start = {"x1": 1.0347392068060262, "x1_dot": 0.007524720780782741}
    model = SMALL.with_values({"omega": 2.0822382446043908, "eps1": 0.0805184998510676})
    fold = gc.curve(model, "fold", "omega=2.081:2.1", "eps1=0.06:0.09", period=2, start=start, longest_step=1e-3)
    end = next(end for end in ends(fold) if end["why"] == "joins the flip curve of half the period")
    halves = fold["section_x1"].values[:, 0] - fold["section_x1"].values[:, 1]
    near = (np.abs(halves) > 5e-4) & (np.abs(halves) < 4e-3)
    assert near.sum() > 5
    for name in ("omega", "eps1"):
        limit = np.polynomial.Polynomial.fit(halves[near] ** 2, fold[name].values[near], 3)(0.0)
        assert end[name] == pytest.approx(limit, abs=2e-9)
    flip = gc.curve(SMALL.with_values({"omega": 2.0, "eps1": 0.08}), "flip", "omega=2:2.2", "eps1=0.07:0.09", period=1)
    names = flip["special_kind"].values.tolist()
    assert float(flip["special_omega"][names.index("generalised flip")]) == pytest.approx(end["omega"], abs=1e-9)


def test_a_kink_is_no_zero_of_the_coefficient_of_a_flip():
    """Where a contact switch falls on a jump of the stiffness the coefficient jumps."""
    start = {"x1": 0.9867867895315381, "x1_dot": -0.05935109643671831}
    model = SMALL.with_values({"omega": 1.9052372869850638, "eps1": 0.08709116449983616})
    ds = gc.curve(model, "flip", "omega=1.89:1.91", "eps1=0.08:0.1", period=2, start=start)
    assert ds.sizes["special"] == 0


def test_the_coefficient_of_a_flip_is_that_of_the_doubled_orbits():
    """In the critical direction the doubled orbits lie at ±a where −(μ + 1) = c a² to leading order, with μ the
    multiplier of the orbit of half the period and c the coefficient."""
    model = gc.MeshModel.of(kind="torsional", omega=0.95, q0=0.1, eps1=0.14)
    family, cycle = find_cycle(model, ("omega",), 1, None)
    flip = next(e for e in follow_branch(family, cycle, (0.7, 2.3), Settings()).events
                if e.kind == "flip" and len(e.cycle.switches))
    doubled = doubled_start(family, flip, 1.6)[1].data
    critical = min(converge(family, flip.cycle.points, doubled.values).multipliers, key=lambda v: abs(v + 1)).real
    v, w = (vectors[:, np.argmin(np.abs(values + 1))].real
            for values, vectors in map(np.linalg.eig, (flip.cycle.monodromy, flip.cycle.monodromy.T)))
    a = w @ (doubled.points[0] - doubled.points[1]) / 2 / (w @ v)
    coefficient = flip_coefficient(EventState(flip.cycle), SimpleNamespace(family=family))
    assert coefficient == pytest.approx(-(critical + 1) / a**2, rel=0.01)
    at_a_fold = SimpleNamespace(monodromy=np.diag([-1.0, 1.0]), values=cycle.values, points=cycle.points, period=1,
                                switches=cycle.switches)
    assert math.isnan(flip_coefficient(EventState(at_a_fold), SimpleNamespace(family=family)))
