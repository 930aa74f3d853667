"""Every condition of a verdict in docs/verdicts.md, tested by a motion that fails that condition alone."""

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.dynamics import (
    REASONS,
    Classification,
    ClassificationState,
    Label,
    Reason,
    classify,
    orbits,
    time_series,
)
from gearchaos.dynamics.orbits import candidates
from gearchaos.dynamics.settings import SINGLE_MOTION
from gearchaos.errors import DesignWarning
from gearchaos.gears.operation.operating import as_model
from gearchaos.model import MeshModel
from gearchaos.studies.maps.bifurcation import Bifurcation
from gearchaos.studies.maps.zones import Zones
from gearchaos.studies.motion.attractors import Attractors
from gearchaos.studies.motion.basins import Basins
from tests import flows

SHORT = Classification(transient_lengths=(80,), longest_period=8, exponent_run=21, doublings=0, longest_transient=0,
                       averaging_periods=8)


def flow_of(**model):
    return flows.flow_of(MeshModel.of(**model))


def state_at(flow, w, periods=9):
    """A state with one motion at w (d, 1), and its sections from there on."""
    sections = flow.advance(w, periods, sections=periods).sections
    return ClassificationState(flow, np.zeros(1, dtype=int), Classification(), sections[-1].copy()), sections


@cache
def doubled():
    """A flow whose 1T orbit is beyond its period doubling, and the verdict: 2T."""
    flow, w = flow_of(omega=1.9, q0=0.1, eps1=0.03)
    found = classify(flow, w)
    assert found.period[0] == 2
    return flow, found


def test_a_motion_that_leaves_an_orbit_is_never_classified_as_on_it(monkeypatch):
    """Even with falsified multipliers that make every orbit stable."""
    flow, found = doubled()
    found = orbits.polish(flow, found.w, np.zeros(1, dtype=int), np.array([1]))
    assert found.converged[0] and not found.stable[0] and np.abs(found.multipliers[0]).max() > 1
    true = orbits.floquet_multipliers
    monkeypatch.setattr(orbits, "floquet_multipliers", lambda matrix: 0.9 * true(matrix) / np.abs(true(matrix)).max())
    state, sections = state_at(flow, found.w + 1e-5, 3)
    assert candidates(sections, 1, 1)[0, 0] == 1
    assert orbits.polish(flow, sections[-1], state.points, np.array([1])).stable[0]
    state.classify_returning(np.zeros(1, dtype=int), sections, 1)
    assert state.verdicts.label[0] == 0


@pytest.mark.parametrize("block", [
    [[0.3, 0.8], [-0.8, 0.3]], [[-0.2, -1.1], [1.1, -0.2]], [[2.0, 0.0], [0.0, -0.4]], [[-0.8, 0.0], [0.0, -1.0]],
    [[0.5, 0.0], [0.0, -0.5]], [[0.0, 0.7], [-0.7, 0.0]], [[0.7, 1.0], [0.0, 0.7]], [[3e3, 0.0], [0.0, 2e-4]],
    [[0.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], [0.0, -0.6]]])
def test_multipliers_of_two_coordinates_are_those_of_a_similar_matrix(block):
    (a, b), (c, d) = block
    expected = sorted([a, d] if c == 0 else [complex(a, abs(b)), complex(a, -abs(b))], key=lambda m: -abs(m))
    base = np.array([[2.0, 1.0], [3.0, 2.0]])  # its determinant is 1
    found = orbits.floquet_multipliers(base @ np.array(block) @ np.linalg.inv(base))
    assert found.dtype == complex
    np.testing.assert_allclose(found, expected, atol=1e-7 if b == 1 else 1e-12 * max(1, abs(a)))  # 1e-7: a double one


def test_an_orbit_of_just_the_longest_period_is_recognised():
    flow, found = doubled()
    state = state_at(flow, found.w)[0]
    state.classify_long_orbits(np.zeros(1, dtype=int), 2)
    assert (state.verdicts.label[0], state.verdicts.period[0]) == (Label.PERIODIC, 2)


def test_newton_gives_up_0_15_away_and_at_a_multiplier_of_ten(monkeypatch):
    limits, true = [], orbits.polish

    def polish(*arguments, **options):
        limits.append(options)
        return true(*arguments, **options)

    monkeypatch.setattr(orbits, "polish", polish)
    assert classify(*flow_of(omega=1.9, q0=0.1, eps1=0.03), response=False).period[0] == 2
    assert limits[0] == {"reach": pytest.approx(0.15), "expansion": 10.0}


def test_a_motion_near_a_stable_orbit_is_classified_as_on_it():
    flow, found = doubled()
    state, sections = state_at(flow, found.w + 1e-4, 5)
    state.classify_returning(np.zeros(1, dtype=int), sections, 2)
    found = state.verdicts
    assert (found.label[0], found.period[0], found.reason[0]) == (Label.PERIODIC, 2, Reason.ORBIT)


@pytest.mark.parametrize("away", [0.5, 0.3, 0.07])
def test_a_motion_is_at_its_orbit_only_within_a_twentieth(away):
    """A slow spiral in permanent contact: after n periods it is exp(−ζnT) as far from rest at z = 1 + q0 as before."""
    zeta, q0 = 2e-4, 3.0
    flow, w = flow_of(kind="single", omega=1.0, zeta=zeta, q0=q0, chi0=0.0, z=1 + q0 + away)
    found = classify(flow, w, response=False)
    assert (found.label[0], found.period[0], found.reason[0]) == (Label.PERIODIC, 1, Reason.ORBIT)
    np.testing.assert_allclose(found.w[:, 0], [1 + q0, 0], atol=1e-9)
    distance = away * np.exp(-zeta * found.periods_run[0] * flow.system.period[0])
    assert 0.02 < distance < 0.05 * (1 + zeta)


@pytest.mark.parametrize(("value", "low", "label"), [
    (0.1, 0.05, Label.CHAOTIC), (0.1, -0.001, Label.UNDECIDED), (0.9e-3, 0.8e-3, Label.UNDECIDED),
    (1.1e-3, 0.8e-3, Label.CHAOTIC)])
def test_chaos_needs_an_exponent_of_a_thousandth_and_its_whole_interval(monkeypatch, value, low, label):
    """The exponent is made up, on a motion that does not return."""
    flow, w = flow_of(omega=1.0, q0=0.1, eps1=0.26)

    def from_growth(growth, period):
        values = np.array([[value], [flow.system.trace[0] - value]])
        return time_series.Exponents(values, np.full((2, 1), low), np.full((2, 1), 2 * value - low))

    monkeypatch.setattr(time_series, "exponents_from_growth", from_growth)
    found = classify(flow, w, settings=SHORT, response=False)
    assert (found.label[0], found.period[0], found.exponent_low[0, 0]) == (label, 0, low)


def test_exponents_have_the_mean_of_blocks_and_students_interval():
    """Over 20 blocks: t = 2.860935 (0.995 quantile, 19 degrees of freedom) standard errors to either side."""
    rng = np.random.default_rng(4)
    growth, period = rng.normal(0.3, 1.0, (407, 2, 5)), np.linspace(1.0, 3.0, 5)
    found = time_series.exponents_from_growth(growth, period)
    blocks = growth[7:].reshape(20, 20, 2, 5).mean(axis=1) / period
    half = 2.860935 * blocks.std(axis=0, ddof=1) / np.sqrt(20)
    np.testing.assert_allclose(found.value, blocks.mean(axis=0), rtol=1e-12)
    np.testing.assert_allclose(found.high - found.value, half, rtol=1e-6)
    np.testing.assert_allclose(found.value - found.low, half, rtol=1e-6)


def orbits_with(moduli):
    n = len(moduli)
    return orbits.Orbits(np.zeros((2, n)), np.ones(n, dtype=int), np.zeros(n), np.zeros((n, 2, 2)),
                        np.stack([moduli, np.zeros(n)], axis=1).astype(complex))


def test_neutral_is_on_the_unit_circle_to_a_billionth_and_stable_inside_it():
    """Inside by more than rounding."""
    found = orbits_with(np.array([1.0, 1 + 5e-10, 1 - 5e-10, 1 + 2e-9, 1 - 2e-9, 0.5, 2.0, 1 - 4e-15]))
    assert found.neutral.tolist() == [True, True, True, False, False, False, False, True]
    assert found.stable.tolist() == [False, False, True, False, True, True, False, False]


def test_multipliers_of_large_monodromy_matrices_are_known_less_well():
    """On the undamped orbit of a mass between stops the largest modulus comes out as 1 − 1.4e-14."""
    found = replace(orbits_with(np.array([1 - 1.1e-13, 1 - 9e-12, 1 - 1.1e-11])), monodromy=np.full((3, 2, 2), 50.0))
    assert found.stable.tolist() == [False, False, True]
    train = gc.Train(speed=431.5, bodies=[
        gc.Body(name="frame", motion=[]),
        gc.Body(name="mass", inertia=1, torque_orders=[{"order": 1, "amplitude": 8.62}])], shafts=[
        gc.Shaft(name="wall", between=("mass", "frame"), stop=0.01, stop_stiffness=7.01e5, stiffness=7.01e5 / 50)])
    with pytest.warns(DesignWarning, match="hardly damped"):
        found = gc.orbits(train, period=1)
        assert len(found) > 0 and all(orbit.stability in ("neutral", "1 unstable") for orbit in found)
        verdicts = [gc.regime(as_model(train).with_values(orbit.state)) for orbit in found]
    assert not any(verdict.reason == REASONS[Reason.ORBIT] for verdict in verdicts)


def test_an_undamped_motion_is_neutral_where_it_repeats():
    """In permanent contact at ω = 1 every motion has the mesh period; the damped one beside it comes to rest.

    Rounding alone decides whether a multiplier on the unit circle comes out below or above 1."""
    still = {"kind": "single", "omega": 1.0, "q0": 3.0, "chi0": 0.0, "z": 4.3}
    free, damped = (classify(*flow_of(zeta=zeta, **still)) for zeta in (0.0, 0.02))
    assert (free.label[0], free.reason[0]) == (Label.PERIODIC, Reason.NEUTRAL)
    assert (damped.label[0], damped.reason[0]) == (Label.PERIODIC, Reason.ORBIT)
    assert free.response.z_peak_to_peak[0] == pytest.approx(0.6, rel=1e-9)
    assert damped.response.z_peak_to_peak[0] == pytest.approx(0.0, abs=1e-9)


def test_the_minimal_period_is_the_first_return():
    """The orbit of period 2 found as one of 4, 6 and 8."""
    flow, found = doubled()
    same = np.repeat(found.w, 4, axis=1)
    periods = orbits.minimal_period(flow, same, np.zeros(4, dtype=int), np.array([2, 4, 6, 8]))
    assert periods.tolist() == [2, 2, 2, 2]


@pytest.mark.parametrize(("last", "before", "size", "returns"), [
    (0.9e-3, 0.0, 0.5, True), (1.1e-3, 0.0, 0.5, False), (0.9e-2, 0.0, 10.0, True), (1.1e-2, 0.0, 10.0, False),
    (0.0, 0.9e-2, 0.5, True), (0.0, 1.1e-2, 0.5, False), (0.0, 0.9e-1, 10.0, True), (0.0, 1.1e-1, 10.0, False)])
def test_a_near_return_is_within_a_thousandth_of_the_size_and_the_one_before_a_hundredth(last, before, size, returns):
    """Of three rounds of period 2 the newest state is off by ``last`` from the one a round before, that by ``before``
    from the first; sizes below 1 count as 1."""
    record = np.tile(np.array([[[0.0], [0.0]], [[size], [size]]]), (4, 1, 1))[:7]
    record[4, 1] += before
    record[6, 1] += before + last
    assert (candidates(record, 2, 1)[0, 0] == 2) == returns


@pytest.mark.parametrize(("off", "shortest"), [(1e-5, 4), (5e-7, 2)])
def test_an_orbit_returns_early_only_if_it_does_so_to_a_millionth(off, shortest):
    sections = np.array([0.3, off, 0.3, 0.0])[:, None, None] * np.ones((1, 2, 1))
    flow = SimpleNamespace(advance=lambda *_, **__: SimpleNamespace(sections=sections))
    found = orbits.minimal_period(flow, np.zeros((2, 1)), np.zeros(1, dtype=int), np.array([4]))
    assert found.tolist() == [shortest]


def followed(modulus, most, left, period=1):
    """For how many periods the motion at a distance 1 from an orbit is followed, and whether, at this distance left, it
    counts as approaching."""
    asked, found = [], orbits_with(np.array([modulus]))
    found.period[:] = period

    def advance(w, periods, points):
        asked.extend(periods)
        return SimpleNamespace(w=np.full((2, 1), left))

    approaches = orbits.approaching(
        SimpleNamespace(advance=advance), np.ones((2, 1)), np.zeros(1, dtype=int), found, most)[0]
    return asked, approaches


@pytest.mark.parametrize(("exponents", "digits", "label"), [
    ((4e-4, -4e-4), 4.1, Label.QUASI_PERIODIC), ((6e-4, 1e-4), 4.1, Label.UNDECIDED),
    ((1e-4, -6e-4), 4.1, Label.UNDECIDED), ((1e-4, 1e-4), 3.9, Label.UNDECIDED)])
def test_a_torus_has_both_halves_at_zero_and_four_digits(monkeypatch, exponents, digits, label):
    """Exponents of the halves and digits are made up, on a torus."""
    true = time_series.half_averages

    def halves(series):
        if series.ndim == 2:
            return true(series)
        out = true(series)
        for half, exponent in zip(out, exponents, strict=True):
            change = exponent * 2 * np.pi / 1.05 - half[0]
            half[0], half[-1] = half[0] + change, half[-1] - change  # their sum stays the trace
        return out

    flow, w = flow_of(kind="full", omega=1.05, eps1=0.04)
    monkeypatch.setattr(time_series, "half_averages", halves)
    monkeypatch.setattr(time_series, "agreeing_digits", lambda series: np.full(series.shape[1], digits))
    found = classify(flow, w, settings=Classification(doublings=0), response=False)
    assert found.label[0] == label
    if label == Label.QUASI_PERIODIC:
        ends = (found.exponent_low[0, 0], found.exponent_high[0, 0], found.exponent[0, 0])
        np.testing.assert_allclose(ends, [-4e-4, 4e-4, 0.0], atol=1e-15)


@pytest.mark.parametrize("period", [1, 2, 5])
def test_a_return_shows_in_a_record_of_two_rounds_and_no_shorter_one(period):
    once = np.random.default_rng(period).normal(size=(period, 2, 1))
    record = np.tile(once, (9, 1, 1))
    for longest in (period, 8):
        assert candidates(record[: 2 * period + 1], longest, 1)[0, 0] == period
        assert candidates(record[: 2 * period], longest, 1)[0, 0] == 0
    assert candidates(record, period, 3)[:, 0].tolist() == [period, 0, 0]


def test_the_first_twentieth_of_a_run_is_dropped(monkeypatch):
    lengths, true = [], time_series.exponents_from_growth

    def from_growth(growth, period):
        lengths.append(len(growth))
        return true(growth, period)

    monkeypatch.setattr(time_series, "exponents_from_growth", from_growth)
    flow, w = flow_of(omega=1.0, q0=0.1, eps1=0.26)
    classify(flow, w, settings=Classification(exponent_run=400, longest_transient=0), response=False)
    assert lengths[0] == 380


@pytest.mark.parametrize(("modulus", "period", "most", "periods"), [
    (0.5, 1, 640, 1), (0.9, 3, 640, 21), (0.9999, 2, 640, 640), (0.9999, 2, 1, 2), (0.9999, 3, 640, 639),
    (0.01, 5, 640, 5)])
def test_an_orbit_is_followed_until_its_distance_should_halve(modulus, period, most, periods):
    """0.9^7 < 1/2 < 0.9^6; not for more than so many periods, but for a round at least."""
    assert followed(modulus, most, 0.0, period) == ([periods], True)


@pytest.mark.parametrize(("left", "approaches"), [(0.74, True), (0.76, False), (1.0, False)])
def test_a_distance_must_fall_by_half_of_what_the_multipliers_predict(left, approaches):
    """In a round it should halve; a quarter less is enough."""
    assert followed(0.5, 640, left)[1] == approaches


def test_settings_are_those_of_the_documentation():
    """docs/verdicts.md, Settings."""
    common = {"transient_lengths": (80, 80, 160, 320, 640), "longest_period": 64}
    assert Classification() == Classification(exponent_run=250, doublings=4, longest_transient=10_000,
                                              averaging_periods=96, **common)
    assert all(study.default_settings == Classification() for study in (Zones, Basins, Attractors))
    assert Bifurcation.default_settings == Classification(exponent_run=1000, doublings=2, longest_transient=10_000,
                                                          averaging_periods=96, **common)
    assert Classification(exponent_run=2000, doublings=2, longest_transient=20_000,
                                             averaging_periods=1000, **common) == SINGLE_MOTION


def test_the_response_is_computed_unless_it_is_not_wanted():
    flow, found = doubled()
    assert np.isfinite(found.response.v_rms[0])
    assert np.isnan(classify(flow, found.w, response=False).response.v_rms[0])


@pytest.mark.parametrize("friction", [1e-14, 1e-6])
def test_a_rotation_hardly_braked_makes_no_torus(friction):
    """Torques that differ speed it up all the while: its exponent near zero says nothing of the relative motion."""
    settings = Classification(transient_lengths=(80, 160), exponent_run=1000, doublings=0)
    flow, w = flow_of(omega=1.0, eps1=0.206, q1=0.1, q2=0.11, beta1=friction, beta2=0.0)
    found = classify(flow, w, settings=settings, response=False)
    assert abs(found.exponent[0, 0]) < 5e-4 and found.label[0] == Label.UNDECIDED
