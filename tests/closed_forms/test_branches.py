"""Branches of periodic orbits: closed forms, laws of bifurcations, symmetries, and other ways to the same orbits."""

import json
import math
from functools import cache

import numpy as np
import pytest
from scipy.optimize import brentq

import gearchaos as gc
from tests.branches import DOUBLED, SINGLE, flip_determinant, resonance
from tests.flows import flow_of

ISOLAS = gc.MeshModel.of(kind="single", omega=2.3, q0=0.1, eps1=0.1)
SYMMETRIC = gc.MeshModel.of(kind="single", zeta=0.03, q0=0.0, eps1=4.0, omega=0.6, c1=0.0)
LINEAR = {"kind": "single", "chi0": 0.0, "J": 2.0, "zeta": 0.05, "q0": 0.1}
"""Constant stiffness, and J1 = J2 = 2: z'' + 2 ζ z' + z − 1 = q0 + ε1 ω² cos ωτ in permanent contact, (2.17)."""


@cache
def isola(period: int):
    return gc.branch(ISOLAS, "omega=1:3", period=period)


@cache
def lopsided():
    """Without static torque z(τ + T/2) = −z(τ) is possible; such an orbit loses its symmetry at a pitchfork."""
    return gc.branch(SYMMETRIC, "omega=0.25:0.9", period=1, pitchforks=True)


def events(ds, *kinds: str) -> np.ndarray:
    """Values of the events of these kinds, in ascending order."""
    return np.sort(ds["event_value"].values[np.isin(ds["event_kind"].values, kinds)])


def test_flips_in_permanent_contact_are_those_of_meissners_equation():
    exact = [brentq(flip_determinant, *ends, xtol=1e-14) for ends in ((1.7, 2.0), (2.0, 2.3))]
    ds = resonance()
    flips = (ds["event_kind"] == "flip") & (ds["event_value"] > 1.5)
    np.testing.assert_allclose(np.sort(ds["event_value"].values[flips]), exact, atol=1e-10)
    assert set(ds["contact_sequence"].values[ds["event_point"].values[flips]]) == {"front"}
    assert np.abs(ds["event_residual"].values[flips]).max() < 1e-12


@pytest.mark.parametrize("omega", [0.6, 1.4, 2.2])
def test_contact_is_lost_where_the_linear_response_reaches_the_boundary(omega):
    exact = 0.1 * math.hypot(1 - omega**2, 2 * 0.05 * omega) / omega**2
    ds = gc.branch(gc.MeshModel.of(omega=omega, eps1=0.3 * exact, **LINEAR), f"eps1=0:{1.2 * exact!r}")
    first = int(np.argmin(ds["event_value"].values))
    assert ds["event_kind"].values[first] == "graze" and ds["event_boundary"].values[first] == 1
    assert ds["event_value"].values[first] == pytest.approx(exact, rel=1e-12)
    assert ds["event_z_min"].values[first] == pytest.approx(1, abs=1e-12)


def test_orbits_meet_at_a_fold_like_the_square_root_of_the_distance():
    fold, apart = events(resonance(), "fold")[-1], []
    for delta in (4e-7, 1e-7):
        pair = orbits_before(fold, delta)
        assert sorted(o.unstable for o in pair) == [0, 1]
        apart.append(np.linalg.norm([pair[0].state[n] - pair[1].state[n] for n in ("z", "z_dot")]))
    assert apart[0] / apart[1] == pytest.approx(2, rel=2e-3) and 1e-4 < apart[1] < 1e-2


def orbits_before(fold: float, delta: float) -> list:
    """The stable and the unstable orbit that meet at a fold, at a distance in the parameter before it."""
    ds, found = resonance(), []
    at = int(np.argmin(np.abs(ds["event_value"].values - fold)))
    for neighbour in ds["event_point"].values[at] + np.arange(2):
        share = float(np.sqrt(delta / (fold - ds["omega"].values[neighbour])))
        near = {n: float((1 - share) * ds[f"event_section_{n}"][at] + share * ds[f"section_{n}"][neighbour, 0])
                for n in ("z", "z_dot")}
        found.append(gc.orbit(SINGLE.with_values({"omega": fold - delta}), period=1, near=near))
    return found


def test_a_mirrored_mesh_has_the_mirrored_branch():
    mirrored = gc.branch(SINGLE.with_values({"q0": -0.1, "theta1": np.pi, "z": -1.0}), "omega=0.3:2.5")
    ds = resonance()
    np.testing.assert_array_equal(mirrored["event_kind"].values, ds["event_kind"].values)
    np.testing.assert_allclose(mirrored["event_value"].values, ds["event_value"].values, atol=1e-9)
    np.testing.assert_array_equal(mirrored["event_boundary"].values, -ds["event_boundary"].values)
    np.testing.assert_allclose(mirrored["event_section_z"].values, -ds["event_section_z"].values, atol=1e-6)


def test_the_branch_is_the_same_from_either_end():
    forth, back = (gc.branch(SINGLE.with_values({"omega": omega}), "omega=0.3:2.5") for omega in (0.3, 2.5))
    assert forth["omega"].values[0] == back["omega"].values[0] == 0.3
    for ds in (forth, back):
        for kind in ("fold", "flip", "graze"):
            np.testing.assert_allclose(events(ds, kind), events(resonance(), kind), atol=1e-9)


def test_motions_from_rest_settle_on_the_stable_part():
    axis = gc.Axis("omega", 0.85, 2.4, 32)
    diagram, ds = gc.bifurcation(SINGLE, axis, points=1), resonance()
    settled = axis.values[diagram["period"].values == 1]
    assert len(settled) > 12
    assert all(any(a < x < b for a, b in json.loads(ds.attrs["stable"])) for x in settled)


@pytest.mark.parametrize("period", [3, 5])
def test_subharmonic_branches_are_isolas(period):
    ds = isola(period)
    low, high = json.loads(ds.attrs["range"])
    assert json.loads(ds.attrs["closed"]) and not json.loads(ds.attrs["ends"])
    assert 1 < low < 2.3 < high < 3
    assert np.ptp(ds["omega"].values[[0, -1]]) < 1e-9 and np.all(ds["period"].values == period)
    folds = events(ds, "fold")
    assert len(folds) % 2 == 0 and (low, high) == (folds[0], folds[-1])


def test_stable_intervals_of_an_isola_do_not_depend_on_its_start():
    found = gc.orbits(ISOLAS, period=3)
    assert sorted(o.unstable for o in found) == [0, 1]
    parts = [json.loads(gc.branch(ISOLAS, "omega=1:3", period=3, start=o.state).attrs["stable"]) for o in found]
    np.testing.assert_allclose(parts[0], parts[1], atol=1e-9)
    assert any(a < 2.3 < b for a, b in parts[0])


def test_two_coordinates_have_no_neimark_sacker_bifurcation():
    """The product of both multipliers is exp(tr A n T) < 1, so that no pair lies on the unit circle."""
    for ds in (resonance(), isola(3), isola(5)):
        assert not set(ds["event_kind"].values) & {"neimark-sacker", "neutral-saddle"}
        product = np.prod(ds["multipliers_real"].values + 1j * ds["multipliers_imag"].values, axis=1)
        exact = np.exp(-2 * SINGLE.zeta * ds["period"].values * 2 * np.pi / ds["omega"].values)
        np.testing.assert_allclose(product, exact, rtol=1e-6)


def test_a_torus_is_born_where_a_pair_of_multipliers_leaves_the_unit_circle():
    model = gc.MeshModel.of(kind="full", kappa=0.5, omega=1.05, eps1=0.02)
    ds = gc.branch(model, "eps1=0:0.05")
    event = ds.isel(event=np.flatnonzero(ds["event_kind"].values == "neimark-sacker")[-1])
    value = float(event["event_value"])
    assert value == pytest.approx(0.0336555, abs=5e-8)
    state = {str(n)[14:]: float(event[n]) for n in ds.data_vars if str(n).startswith("event_section_")}
    flow, w = flow_of(model.with_values({"eps1": value, **state}))
    out = flow.advance(w, int(event["event_period"]), tangent=np.eye(flow.dimension)[:, :, None])
    assert np.abs(out.w - w).max() < 1e-10
    multipliers = np.linalg.eigvals(out.tangent[:, :, 0].T)
    critical = np.sort(np.abs(multipliers[np.abs(multipliers.imag) > 0.1]))
    np.testing.assert_allclose(critical[-2:], 1, atol=1e-9)
    inside, outside = (gc.regime(model.with_values({"eps1": value + d})).label for d in (-1e-3, 4e-3))
    assert inside == "1T" and outside != "1T"


@pytest.mark.parametrize("step", [0.03, 0.01])
def test_a_symmetric_orbit_loses_its_symmetry_at_a_pitchfork(step):
    """Without load and with constant stiffness z(τ + T/2) = −z(τ) solves the equations: here z_min = −z_max."""
    model = gc.MeshModel.of(kind="single", chi0=0, q0=0, zeta=0.05, omega=0.6, eps1=2.0)
    ds = gc.branch(model, "omega=0.3:0.65", period=1, start={"z": 3.0307, "z_dot": 0.606}, longest_step=step)
    np.testing.assert_allclose(ds["z_max"].values, -ds["z_min"].values, atol=1e-6)
    assert ds["event_kind"].values.tolist() == ["pitchfork"]
    value = float(ds["event_value"][0])
    assert value == pytest.approx(0.348540, abs=1e-6)
    assert np.abs(ds["event_multipliers_real"].values[0] - 1).min() < 1e-6
    np.testing.assert_array_equal(ds["unstable"].values, (ds["omega"].values < value).astype(int))
    beyond = gc.orbits(model.with_values({"omega": value - 2e-3}), period=1)
    lopsided = [o for o in beyond if abs(max(e.z for e in o.extrema) + min(e.z for e in o.extrema)) > 1e-3]
    assert len(lopsided) >= 2


def test_orbits_finds_stable_and_unstable_ones():
    found = gc.orbits(SINGLE.with_values({"omega": 0.7}), period=1)
    assert sorted(o.unstable for o in found) == [0, 0, 1]


def test_period_doublings_follow_feigenbaum():
    """The flips are a regression; the limit of the ratios is Feigenbaum's constant 4.669…"""
    ds = gc.branch(DOUBLED, "eps1=0:0.3", cascade=4)
    flips = events(ds, "flip")
    known = [0.206988838, 0.208041000, 0.208096881, 0.208109531, 0.208112261]
    np.testing.assert_allclose(flips, known, atol=1e-9)
    assert ds["event_period"].values[ds["event_kind"].values == "flip"].tolist() == [8, 16, 32, 64, 128]
    ratios = json.loads(ds.attrs["feigenbaum"])
    assert ratios[-1] == pytest.approx(4.6692, rel=0.01) and abs(ratios[-1] - 4.6692) < abs(ratios[0] - 4.6692)
    np.testing.assert_allclose(ratios, np.diff(flips)[:-1] / np.diff(flips)[1:], rtol=1e-12)


def test_the_users_events_are_located():
    middle = float(gc.branch(SINGLE, "omega=0.8:1.4")["section_z"].values[[0, -1]].mean())
    ds = gc.branch(SINGLE, "omega=0.8:1.4", events={"half": lambda orbit: orbit.state["z"] - middle})
    at = np.flatnonzero(ds["event_kind"].values == "half")
    assert len(at) % 2 == 1
    np.testing.assert_allclose(ds["event_section_z"].values[at], middle, atol=1e-12)


def test_a_pitchfork_begins_two_branches_that_are_mirror_images():
    main, left, right = (lopsided().isel(event=lopsided().event_branch.values == k) for k in range(3))
    for kind in ("fold", "flip"):
        values = [events(side, kind) for side in (left, right)]
        assert len(values[0]) > 0
        np.testing.assert_allclose(*values, rtol=0, atol=1e-10)
    for branch in json.loads(lopsided().attrs["asymmetric"]):
        assert branch["ends"][0] == {"value": events(main, "pitchfork")[0], "why": "joins a branch at a pitchfork"}
    z = [lopsided().isel(point=lopsided().branch.values == k) for k in (1, 2)]
    np.testing.assert_allclose(z[0].z_max.max(), -z[1].z_min.min(), rtol=1e-3)  # the points of both are not the same


def test_a_branch_of_asymmetric_orbits_ends_at_its_pitchfork():
    side = lopsided().isel(point=np.flatnonzero(lopsided().branch.values == 1)[40:41])
    start = {"z": float(side.section_z[0, 0]), "z_dot": float(side.section_z_dot[0, 0])}
    found = gc.branch(SYMMETRIC.with_values({"omega": float(side.omega[0])}), "omega=0.25:0.9", period=1, start=start)
    assert "joins a branch at a pitchfork" in [end["why"] for end in json.loads(found.attrs["ends"])]
    assert "pitchfork" not in found.event_kind.values
