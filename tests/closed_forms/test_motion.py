"""Verdicts on motions of known class: periodic orbits, exponents, tori, transient chaos."""

import numpy as np
import pytest

from gearchaos.dynamics import Classification, Label, Reason, classify, orbits, time_series
from gearchaos.errors import InputError
from gearchaos.flow import near_returns, newton_iteration, start_newton_search
from gearchaos.model import MeshModel
from gearchaos.model.switched import SwitchedAffine
from tests.flows import flow_of


def verdict(settings=None, values=None, **model):
    flow, w = flow_of(MeshModel.of(**model), values)
    return flow, classify(flow, w, settings=settings)


def test_a_linear_motion_has_its_closed_form_multipliers():
    """Permanent contact with constant stiffness: multipliers exp((−ζ ± i sqrt(1 − ζ²)) T)."""
    flow, found = verdict(kind="single", omega=1.7, zeta=0.05, q0=0.5, eps1=0.02, chi0=0.0)
    expected = np.exp((-0.05 + 1j * np.sqrt(1 - 0.05**2)) * flow.system.period[0])
    assert (found.label[0], found.period[0]) == (Label.PERIODIC, 1)
    got = found.multipliers[0][np.argmax(found.multipliers[0].imag)]
    assert abs(got - (expected if expected.imag > 0 else expected.conjugate())) < 1e-12
    np.testing.assert_allclose(found.exponent[:, 0], -0.05, rtol=1e-11)


def test_orbits_are_minimal_converged_and_stable_and_their_exponents_not_lost_in_rounding():
    """32 periods shrink areas by 1e-22, far below the rounding of the monodromy matrix."""
    flow, found = verdict(omega=1.0, q0=0.1, values={"eps1": [0.206, 0.208, 0.209, 0.231]})
    assert found.period.tolist() == [8, 16, 32, 6]
    assert np.all(found.residual <= 1e-10) and np.all(np.abs(found.multipliers[:, 0]) < 1)
    for points in orbits.sections(flow, found.w, np.arange(4), found.period):
        gaps = np.abs(points[:, None] - points[None]).max(axis=2) + np.eye(len(points))
        assert gaps.min() > 1e-6
    np.testing.assert_allclose(found.exponent.sum(axis=0), flow.system.trace, atol=1e-9)
    growth = np.log(np.abs(found.multipliers[:, 0]))
    np.testing.assert_allclose(found.exponent[0], growth / (found.period * flow.system.period), rtol=1e-9)


@pytest.mark.parametrize(("off", "trusted"), [(2e-6, False), (5e-7, True)])
def test_a_verdict_whose_exponents_miss_their_sum_by_a_millionth_is_not_trusted(monkeypatch, off, trusted):
    """Of an orbit, a torus and chaos. The trace is falsified, since the flow cannot be."""
    trace = SwitchedAffine.trace.fget
    monkeypatch.setattr(SwitchedAffine, "trace", property(lambda system: trace(system) + off))
    flow, found = verdict(kind="full", omega=1.05, values={"eps1": [0.03, 0.04, 0.048]},
                          settings=Classification(longest_transient=0))
    np.testing.assert_allclose(found.exponent.sum(axis=0), trace(flow.system), atol=1e-11)
    np.testing.assert_allclose(found.trace_error, off, rtol=1e-3)
    known = [Label.PERIODIC, Label.QUASI_PERIODIC, Label.CHAOTIC]
    assert found.label.tolist() == (known if trusted else [Label.UNDECIDED] * 3)
    assert np.all((found.reason == Reason.INCONSISTENT) != trusted)
    assert np.all(found.period[1 if trusted else 0:] == 0)


def test_a_torus_locked_at_a_high_order_keeps_its_orbit():
    """122T between the tori of Fig. 12; its smallest multiplier is below 1e-20. Its exponents are those of any later
    round: the vectors have turned to where they belong within the first one, in which they grow otherwise."""
    flow, found = verdict(kind="full", omega=1.05, eps1=0.03 + 0.02 * 46 / 60)
    assert found.period[0] == 122
    assert found.exponent[:, 0].sum() == pytest.approx(flow.system.trace[0], abs=1e-12)
    assert found.exponent[0, 0] == pytest.approx(-0.00210316, abs=1e-8)
    run = flow.advance(found.w, 3 * 122, tangent=orbits.tangent_frame(4, 1), growth=True)
    later = run.growth[-122:, :, 0].sum(axis=0) / (122 * flow.system.period[0])
    np.testing.assert_allclose(found.exponent[:, 0], later, atol=2e-6)


def test_newton_that_fails_is_data():
    flow, _ = verdict(omega=1.0, eps1=0.1, q0=0.02)
    failed = orbits.polish(flow, np.array([[0.3], [0.1]]), np.zeros(1, dtype=int), np.array([61]))
    assert not failed.converged[0] and not failed.stable[0]


@pytest.mark.parametrize("values", [
    {"longest_period": 0}, {"transient_lengths": (64,)}, {"transient_lengths": (200.5,)}, {"exponent_run": 10},
    {"transient_lengths": (20,), "longest_period": 4, "exponent_run": 10}, {"averaging_periods": 0}, {"doublings": -1},
    {"transient_lengths": (2,), "longest_period": 1}])
def test_settings_that_cannot_decide_are_refused(values):
    with pytest.raises(InputError, match=r"classification.* must"):
        Classification(**values)


def test_short_runs_yield_undecided_not_a_guess():
    short = Classification(transient_lengths=(40,), longest_period=32, exponent_run=40, doublings=0,
                           averaging_periods=10)
    _, found = verdict(settings=short, kind="full", omega=1.05, eps1=0.04)
    assert found.label[0] == Label.UNDECIDED


def test_running_away_is_a_label():
    _, found = verdict(kind="single", omega=2.0, z=30.0)
    assert (found.label[0], found.reason[0]) == (Label.DIVERGED, Reason.OUT_OF_RANGE)
    assert np.isnan(found.response.v_rms[0])


def test_a_torus_has_zero_exponent_and_a_rotation_number():
    """Fig. 13a of the paper."""
    flow, found = verdict(kind="full", omega=1.05, eps1=0.04)
    assert found.reason[0] == Reason.SMOOTH_CURVE and abs(found.exponent[0, 0]) < 1e-4
    assert 0 < found.rotation[0] < 0.5
    later = flow.advance(found.w, 4000, sections=4000).sections[:, 0]
    assert found.rotation[0] == pytest.approx(time_series.dominant_frequency(later)[0], abs=1e-7)


def test_transient_chaos_is_followed_to_its_end_and_flagged():
    """8T after a chaotic transient of up to thousands of periods, different from start to start; chaos is tested every
    2560 periods."""
    starts = {"x1": np.linspace(1.0, 1.001, 24)}
    _, found = verdict(omega=1.0, q0=0.1, eps1=0.206, values=starts)
    assert set(found.period[found.label == Label.PERIODIC]) == {8}
    later = found.transient_chaos & (found.periods_run > 2560) & (found.periods_run < 9000)
    assert later.any() and np.all(found.periods_run[later] % 2560 == 0)
    _, short = verdict(omega=1.0, q0=0.1, eps1=0.206, values=starts, settings=Classification(longest_transient=0))
    assert np.sum(short.label == Label.CHAOTIC) > np.sum(found.label == Label.CHAOTIC)


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
    assert busy.tolist() == [0, 6] and np.isinf(search.residual[3])
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
