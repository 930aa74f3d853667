"""Verdicts on motions of known class: periodic orbits, exponents, tori, transient chaos."""

import numpy as np
import pytest

from gearchaos.dynamics import Classification, Label, Reason, classify, orbits, time_series
from gearchaos.dynamics.time_series import amplitudes, exponents_from_growth, spectral_class
from gearchaos.errors import InputError
from gearchaos.flow import ExactFlow, near_returns, newton_iteration, start_newton_search
from gearchaos.model import MeshModel, vary
from gearchaos.model.coordinates import initial_state
from gearchaos.model.switched import SwitchedAffine, switched_system


def verdict(settings=None, values=None, **model):
    batch = vary(MeshModel.of(**model), values or {})
    system = switched_system(batch)
    flow = ExactFlow(system)
    return flow, classify(flow, initial_state(batch, system).T.copy(), settings=settings)


def test_a_linear_motion_has_its_closed_form_multipliers():
    """Permanent contact with constant stiffness: multipliers exp((−ζ ± i sqrt(1 − ζ²)) T)."""
    flow, found = verdict(kind="single", omega=1.7, zeta=0.05, q0=0.5, eps1=0.02, chi0=0.0)
    expected = np.exp((-0.05 + 1j * np.sqrt(1 - 0.05**2)) * flow.system.period[0])
    assert (found.label[0], found.period[0]) == (Label.PERIODIC, 1)
    got = found.multipliers[0][np.argmax(found.multipliers[0].imag)]
    assert abs(got - (expected if expected.imag > 0 else expected.conjugate())) < 1e-12
    np.testing.assert_allclose(found.exponent[:, 0], -0.05, rtol=1e-11)


@pytest.mark.parametrize(("eps1", "period"), [(0.206, 8), (0.208, 16), (0.209, 32), (0.231, 6)])
def test_orbits_are_minimal_converged_and_stable(eps1, period):
    flow, found = verdict(omega=1.0, q0=0.1, eps1=eps1)
    assert found.period[0] == period
    assert found.residual[0] <= 1e-10
    assert np.abs(found.multipliers[0]).max() < 1
    points = orbits.sections(flow, found.w, np.zeros(1, dtype=int), found.period)[0]
    gaps = np.abs(points[:, None] - points[None]).max(axis=2) + np.eye(period)
    assert gaps.min() > 1e-6


def test_exponents_of_every_verdict_sum_to_the_trace():
    flow, found = verdict(kind="full", omega=1.05, values={"eps1": [0.03, 0.04, 0.048, 0.05, 0.205, 0.22]})
    np.testing.assert_allclose(found.exponent.sum(axis=0), flow.system.trace, atol=1e-11)
    names = [Label(v).name for v in found.label]
    assert names == ["PERIODIC", "QUASI_PERIODIC", "CHAOTIC", "PERIODIC", "QUASI_PERIODIC", "CHAOTIC"]


def test_the_exponents_of_a_long_orbit_are_not_lost_in_rounding():
    """32 periods shrink areas by 1e-22, far below the rounding of the monodromy matrix."""
    flow, found = verdict(omega=0.5, q0=0.1, eps1=0.206, values={"omega": np.linspace(0.96, 1.0, 120)})
    long = found.period >= 16
    assert long.any()
    np.testing.assert_allclose(found.exponent[:, long].sum(axis=0), flow.system.trace[long], atol=1e-9)
    np.testing.assert_allclose(
        found.exponent[0, long], np.log(np.abs(found.multipliers[long, 0])) / (found.period * flow.system.period)[long],
        rtol=1e-9,
    )


def test_a_torus_locked_at_a_high_order_keeps_its_orbit():
    """122T between the tori of Fig. 12; its smallest multiplier is below 1e-20."""
    flow, found = verdict(kind="full", omega=1.05, eps1=0.03 + 0.02 * 46 / 60)
    assert found.period[0] == 122
    assert found.exponent[:, 0].sum() == pytest.approx(flow.system.trace[0], abs=1e-12)
    assert found.exponent[0, 0] == pytest.approx(-0.00210316, abs=1e-8)


def test_a_run_whose_exponents_do_not_sum_to_the_trace_is_undecided(monkeypatch):
    """The trace is falsified, since the flow cannot be."""
    trace = SwitchedAffine.trace.fget
    monkeypatch.setattr(SwitchedAffine, "trace", property(lambda system: trace(system) + 1e-4))
    _, found = verdict(kind="full", omega=1.05, values={"eps1": [0.03, 0.04, 0.048]},
                       settings=Classification(longest_transient=0))
    assert set(found.label) == {Label.UNDECIDED}
    assert set(found.reason) == {Reason.INCONSISTENT}
    assert set(found.period) == {0}
    np.testing.assert_allclose(found.trace_error, 1e-4, rtol=1e-4)


def test_complex_multipliers_of_a_planar_orbit_have_the_modulus_that_damping_gives():
    flow, found = verdict(values={"omega": np.linspace(0.3, 2.9, 60)}, eps1=0.05)
    planar = (found.period > 0) & (np.abs(found.multipliers[:, 0].imag) > 1e-6)
    assert planar.sum() > 20
    expected = np.exp(flow.system.trace * found.period * flow.system.period)
    np.testing.assert_allclose(np.abs(found.multipliers[planar, 0]) ** 2, expected[planar], rtol=1e-10)


def test_newton_finds_an_unstable_orbit_too_and_no_verdict_rests_on_it():
    """Beyond the period doubling the 1T orbit lives on, unstable; the motion is the 2T one."""
    flow, found = verdict(omega=1.9, q0=0.1, eps1=0.03)
    assert found.period[0] == 2
    one = orbits.polish(flow, found.w, np.zeros(1, dtype=int), np.array([1]))
    assert one.converged[0]
    assert not one.stable[0]
    assert np.abs(one.multipliers[0]).max() > 1


def test_newton_that_fails_is_data():
    flow, _ = verdict(omega=1.0, eps1=0.1, q0=0.02)
    failed = orbits.polish(flow, np.array([[0.3], [0.1]]), np.zeros(1, dtype=int), np.array([61]))
    assert not failed.converged[0]
    assert not failed.stable[0]


@pytest.mark.parametrize("values", [{"longest_period": 0}, {"transient_lengths": (64,)},
                                    {"transient_lengths": (200.5,)}, {"exponent_run": 10},
                                    {"transient_lengths": (20,), "longest_period": 4, "exponent_run": 10},
                                    {"transient_lengths": (2,), "longest_period": 1},
                                    {"averaging_periods": 0}, {"doublings": -1}])
def test_settings_that_cannot_decide_are_refused(values):
    with pytest.raises(InputError, match=r"classification.* must"):
        Classification(**values)


def test_rest_without_load_is_neutral():
    _, found = verdict(q0=0.0)
    assert (found.label[0], found.period[0], found.reason[0]) == (Label.PERIODIC, 1, Reason.NEUTRAL)


def test_short_runs_yield_undecided_not_a_guess():
    short = Classification(transient_lengths=(40,), longest_period=32, exponent_run=40, doublings=0,
                           averaging_periods=10)
    _, found = verdict(settings=short, kind="full", omega=1.05, eps1=0.04)
    assert found.label[0] == Label.UNDECIDED


def test_running_away_is_a_label():
    _, found = verdict(kind="single", omega=2.0, z=30.0)
    assert (found.label[0], found.reason[0]) == (Label.DIVERGED, Reason.OUT_OF_RANGE)
    assert np.isnan(found.response.v_rms[0])


def test_intervals_cover_the_mean_of_noise():
    rng = np.random.default_rng(0)
    growth = rng.normal(0.3, 1.0, (2000, 1, 200))
    found = exponents_from_growth(growth, np.full(200, 2.0))
    covered = (found.low < 0.15) & (found.high > 0.15)
    assert covered.mean() > 0.95


def test_birkhoff_digits_tell_a_curve_from_a_fractal():
    n = np.arange(1000)
    smooth = np.stack([np.cos(n), np.cos(np.sqrt(2) * n) + 0.3 * np.cos(2 * np.sqrt(2) * n)], axis=1)
    logistic = np.empty((1000, 1))
    logistic[0] = 0.3
    for i in range(999):
        logistic[i + 1] = 3.9 * logistic[i] * (1 - logistic[i])
    assert np.all(time_series.agreeing_digits(smooth) > 6)
    assert np.all(time_series.agreeing_digits(logistic) < 3)


def test_a_rotation_number_is_found_far_beyond_the_resolution_of_the_spectrum():
    n = np.arange(2000)[:, None]
    rho = np.array([0.1234567, (np.sqrt(5) - 1) / 4])
    series = np.cos(2 * np.pi * rho * n) + 0.2 * np.cos(2 * np.pi * 2 * rho * n + 1.0)
    np.testing.assert_allclose(time_series.dominant_frequency(series), rho, atol=1e-10)


def test_a_torus_has_zero_exponent_and_a_rotation_number():
    """Fig. 13a of the paper."""
    flow, found = verdict(kind="full", omega=1.05, eps1=0.04)
    assert found.reason[0] == Reason.SMOOTH_CURVE
    assert abs(found.exponent[0, 0]) < 1e-4
    assert 0 < found.rotation[0] < 0.5
    later = flow.advance(found.w, 4000, sections=4000).sections[:, 0]
    assert found.rotation[0] == pytest.approx(time_series.dominant_frequency(later)[0], abs=1e-7)


def test_transient_chaos_is_followed_to_its_end_and_flagged():
    """8T after a chaotic transient of up to thousands of periods, different from start to start."""
    starts = {"x1": np.linspace(1.0, 1.001, 24)}
    _, found = verdict(omega=1.0, q0=0.1, eps1=0.206, values=starts)
    assert set(found.period[found.label == Label.PERIODIC]) == {8}
    assert found.transient_chaos.any()
    _, short = verdict(omega=1.0, q0=0.1, eps1=0.206, values=starts, settings=Classification(longest_transient=0))
    assert np.sum(short.label == Label.CHAOTIC) > np.sum(found.label == Label.CHAOTIC)


def test_a_motion_that_leaves_a_stable_orbit_is_not_taken_for_it():
    """Near the unstable 1T orbit, whose multipliers are given as stable: what the trajectory does decides."""
    flow, found = verdict(omega=1.9, q0=0.1, eps1=0.03)
    points = np.zeros(1, dtype=int)
    stable = orbits.polish(flow, found.w, points, np.array([2]))
    assert orbits.approaching(flow, stable.w + 1e-4, points, stable, 640)[0]
    unstable = orbits.polish(flow, found.w, points, np.array([1]))
    stretched = orbits.Orbits(
        unstable.w, unstable.period, unstable.residual, unstable.monodromy, 0.9 * unstable.multipliers /
        np.abs(unstable.multipliers).max()
    )
    assert not orbits.approaching(flow, unstable.w + 1e-4, points, stretched, 640)[0]


def test_the_spectral_class():
    n = np.arange(512)[:, None]
    assert spectral_class(np.cos(2 * np.pi * n / 5)) == ("5T", 5)
    assert spectral_class(np.cos(n) + 0.2 * np.cos(2 * n)) == ("quasi-periodic", 0)
    rng = np.random.default_rng(1)
    assert spectral_class(rng.normal(size=(512, 1))) == ("chaotic", 0)


def test_amplitudes_of_whole_periods_have_no_leakage():
    t = np.arange(640) / 64
    orders, spectrum = amplitudes(0.5 + 0.3 * np.cos(2 * np.pi * t) + 0.1 * np.sin(2 * np.pi * 2.5 * t), 10)
    lines = {float(orders[i]): spectrum[i] for i in np.flatnonzero(spectrum > 1e-12)}
    assert lines == pytest.approx({0.0: 0.5, 1.0: 0.3, 2.5: 0.1})


def test_near_returns_are_those_of_their_definition():
    random = np.random.default_rng(3)
    sections = np.cumsum(random.normal(size=(41, 3, 150)), axis=0) / 10
    for lane in range(0, 150, 2):  # every other one returns, more or less closely
        n = random.integers(1, 21)
        sections[:, :, lane] = sections[:n, :, lane][np.arange(41) % n]
        sections[:, :, lane] += random.normal(size=(41, 3)) * 10 ** random.uniform(-6, -1)
    scale = np.maximum(np.ptp(sections, axis=0), 1.0)

    def gap(i, j):
        return np.abs((sections[-1 - i] - sections[-1 - j]) / scale).max(axis=0)

    close = np.array([(gap(0, n) < 1e-3) & (gap(n, 2 * n) < 0.01) for n in range(1, 21)])
    wanted = [(np.flatnonzero(lane) + 1)[:3] for lane in close.T]
    found = near_returns(sections, 20, 1e-3, 0.01, 3)
    assert [list(lane[lane > 0]) for lane in found.T] == [list(lane) for lane in wanted]
    assert 0 < close.any(axis=0).sum() < 150 and close.sum(axis=0).max() > 3


def newton_round(matrix, at, end, *, reach=10.0, expansion=np.inf, residual=None):
    """A search (its second round, with a residual given) after a round of lanes that end there, and who goes on."""
    search, busy = start_newton_search(at), np.arange(at.shape[1])
    if residual is not None:
        search.residual[:] = residual
    status = np.zeros(len(busy), dtype=np.int64)
    tangent = np.ascontiguousarray(matrix.transpose(2, 1, 0))
    count = newton_iteration(search, busy, end, tangent, status, reach, expansion)
    return search, busy[:count]


@pytest.mark.parametrize("d", [1, 2, 4, 7])
def test_a_newton_step_finds_the_fixed_point_of_an_affine_map_at_once(d):
    random = np.random.default_rng(d)
    matrix, fixed, at = (random.normal(size=s) for s in ((200, d, d), (d, 200), (d, 200)))
    at = fixed + at / 10
    end = fixed + np.einsum("lij,jl->il", matrix, at - fixed)
    search, busy = newton_round(matrix, at, end, reach=1e3)
    assert busy.tolist() == list(range(200))
    np.testing.assert_allclose(search.at, fixed, atol=1e-9)
    np.testing.assert_allclose(search.residual, np.abs(end - at).max(axis=0))


@pytest.mark.slow
def test_newton_goes_on_only_where_it_may_succeed():
    half = np.broadcast_to(np.eye(2) / 2, (7, 2, 2)).copy()
    half[5] = np.eye(2)  # I - M is singular
    at, end = np.zeros((2, 7)), np.full((2, 7), 0.1)
    end[:, 1], end[:, 2], end[0, 3], end[:, 4] = 0.0, 0.9e-13, np.nan, 20.0
    search, busy = newton_round(half, at, end)
    assert busy.tolist() == [0, 6]
    assert np.isinf(search.residual[3])
    np.testing.assert_array_equal(search.monodromy[2], half[2])
    _, busy = newton_round(half[:1], at[:, :1], end[:, :1], residual=0.15)  # it halts for the first time
    assert len(busy) == 1
    _, busy = newton_round(half[:1], at[:, :1], end[:, :1], residual=1e-11)  # no better than an orbit it has
    assert len(busy) == 0


@pytest.mark.parametrize("d", [2, 4, 7])
def test_newton_leaves_orbits_beside_which_neighbours_part_too_fast(d):
    """A fifth of a per cent beside the limit it must know: of random matrices and of one that is defective."""
    random = np.random.default_rng(d)
    matrix = random.normal(size=(101, d, d)) * 10 ** random.uniform(-2, 2, (101, 1, 1))
    matrix *= 10 / np.abs(np.linalg.eigvals(matrix)).max(axis=1)[:, None, None]
    matrix[-1] = 10 * np.eye(d) + 1000 * np.eye(d, k=1)
    at, end = np.zeros((d, 101)), np.full((d, 101), 1e-4)
    assert len(newton_round(matrix * 1.002, at, end, reach=np.inf, expansion=10.0)[1]) == 0
    assert len(newton_round(matrix / 1.002, at, end, reach=np.inf, expansion=10.0)[1]) == 101
