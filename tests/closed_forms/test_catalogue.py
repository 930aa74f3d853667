"""Which motions count as one: orbits that share a point, others of the same means and spreads."""

import numpy as np
import pytest
from scipy.special import betaincinv
from scipy.stats import sem

import gearchaos as gc
from gearchaos.dynamics import Label, Reason
from gearchaos.dynamics.initial_conditions import default_box, spread
from gearchaos.studies.motion.attractor_set import Attractor, AttractorSet, _statistics
from tests.flows import flow_of

SINGLE = gc.MeshModel.of(kind="single", omega=2.3, eps1=0.05)


def no_attractors():
    return AttractorSet(flow_of(SINGLE)[0])


def attractor(section, period=0, neutral=False):
    label = Label.PERIODIC if period else Label.CHAOTIC
    return Attractor(label, period, neutral, np.asarray(section, float), {})


def found(label, period, w, neutral=False):
    """What `final_states` finds of motions at w (L, d), as far as they are told apart by it."""
    count = len(w)
    facts = dict.fromkeys(("reason", "lyapunov", "lyapunov_lo", "lyapunov_hi", "trace_error", "residual", "multiplier",
                           "rotation", "periods_spent"), np.zeros(count))
    return {"label": np.full(count, label), "period": np.full(count, period), "neutral": np.full(count, neutral),
            "w": np.asarray(w, float), **facts}


def test_orbits_are_one_if_they_share_a_point_to_a_millionth():
    orbit = attractor([[0.0, 1.0], [2.0, -1.0]], period=2)
    points = np.array([[0.0, 1.0], [2.0, -1.0], [2.0, -1 + 5e-7], [2e-6, 1.0], [0.0, 1.01], [0.0, -1.0], [1.0, 0.0]])
    assert orbit.contains(points.T, np.empty((0, 2, 7))).tolist() == [True, True, True, False, False, False, False]


def test_orbits_a_thousandth_apart_are_two_attractors():
    w = np.array([[0.5, 0.0], [0.501, 0.0], [0.5, 1e-9], [0.501, 1e-9], [0.5, 0.05]])
    attractor_set = no_attractors()
    for label, period, points, numbers in (
            (Label.PERIODIC, 1, w, [0, 1, 0, 1, 2]), (Label.PERIODIC, 2, w[:1], [3]),
            (Label.PERIODIC, 1, w[::-1], [2, 1, 0, 1, 0]), (Label.DIVERGED, 0, w[:2], [-1, -1]),
            (Label.UNDECIDED, 0, w[:2], [-1, -1])):
        assert attractor_set.match(found(label, period, points)).tolist() == numbers


def test_neutral_motions_of_a_period_are_one_and_no_other():
    attractor_set = no_attractors()
    w = np.array([[0.1, 0.0], [0.7, 0.0]])
    assert attractor_set.match(found(Label.PERIODIC, 1, w, neutral=True)).tolist() == [0, 0]
    assert attractor_set.match(found(Label.PERIODIC, 1, w[:1])).tolist() == [1]


def test_motions_without_a_period_are_one_if_means_and_spreads_agree():
    """Within a tenth of the spread and six standard errors, in every coordinate."""
    rng = np.random.default_rng(0)
    noise = rng.normal(size=(1024, 2))
    others = rng.normal(size=(1024, 2, 5))
    others[:, 1, 1] += 1.0  # another mean of one coordinate
    others[:, 0, 2] *= 2.0  # another spread
    others[:, :, 3] += 0.05  # within a tenth
    others[:, 0, 4] -= 0.6
    assert attractor(noise).contains(np.zeros((2, 5)), others).tolist() == [True, False, False, True, False]


def test_standard_errors_are_those_of_eight_blocks():
    sections = np.random.default_rng(1).normal(size=(1027, 2, 3))
    blocks = sections[:1024].reshape(8, 128, 2, 3)
    values, errors = _statistics(sections)
    for found, error, each in zip(values, errors, (blocks.mean(axis=1), blocks.std(axis=1)), strict=True):
        np.testing.assert_allclose(found, each.mean(axis=0), rtol=1e-12)
        np.testing.assert_allclose(error, sem(each, axis=0), rtol=1e-12)


def test_attractors_are_listed_by_kind_period_and_share():
    attractor_set = no_attractors()
    orbits = ((3, 0.1, 1), (1, 0.2, 1), (1, 0.3, 4), (2, 0.4, 2))  # period, z, how many starts lead there
    index = np.concatenate([attractor_set.match(found(Label.PERIODIC, p, [[z, 0.0]] * n)) for p, z, n in orbits])
    attractor_set.count_starts(index)
    assert [a.count for a in attractor_set.members] == [1, 1, 4, 2] and attractor_set.order() == [2, 1, 3, 0]
    assert attractor_set.ranks().tolist() == [3, 1, 0, 2, -1]


def test_shares_have_the_interval_of_clopper_and_pearson():
    """95 %: of k in n starts the 0.025 quantile of Beta(k, n − k + 1) to the 0.975 one of Beta(k + 1, n − k)."""
    data = gc.attractors(SINGLE, 64)
    assert data.sizes["number"] > 1
    k, n = np.bincount(data.attractor), 64
    np.testing.assert_allclose(data.attractor_fraction, k / n, rtol=1e-15)
    np.testing.assert_allclose(data.attractor_fraction_lo, betaincinv(k, n - k + 1, 0.025), rtol=1e-9)
    np.testing.assert_allclose(data.attractor_fraction_hi, betaincinv(k + 1, n - k, 0.975), rtol=1e-9)


def test_each_start_leads_to_the_attractor_it_names():
    """Classified by itself, an initial state has the period and the rms velocity of the attractor it is assigned to."""
    data = gc.attractors(SINGLE, 24, seed=3)
    for lane in range(0, 24, 4):
        own = SINGLE.with_values({n: float(data[f"start_{n}"][lane]) for n in ("z", "z_dot")})
        verdict, number = gc.regime(own), int(data.attractor[lane])
        assert verdict.period == int(data.attractor_period[number])
        assert verdict.v_rms == pytest.approx(float(data.attractor_v_rms[number]), rel=1e-6)
        z = data.attractor_section_z[number].values
        assert np.nanmin(np.abs(z - verdict.section["z"][-1])) < 1e-6


@pytest.mark.parametrize(("model", "box"), [
    ({"kind": "single"}, {"z": 3, "z_dot": 2}), ({"kind": "torsional"}, {"x1": 3, "x1_dot": 2}),
    ({"kind": "torsional", "beta1": 0.02}, {"x1": 3, "x1_dot": 2, "x2_dot": 2}),
    ({"kind": "full"}, {"x1": 3, "x1_dot": 2, "y1": 3, "y1_dot": 2}),
    ({"kind": "full", "kappa1": 0.6}, {"x1": 3, "x1_dot": 2, "y1": 3, "y1_dot": 2, "y2": 3, "y2_dot": 2})])
def test_starts_fill_three_half_backlashes_and_velocities_of_two_both_ways(model, box):
    widths = default_box(gc.MeshModel.of(**model))
    assert widths == {n: (-w, w) for n, w in box.items()}
    for name, values in spread(widths, 256, 0).items():
        counts, _ = np.histogram(values, 16, (-box[name], box[name]))
        assert counts.tolist() == [16] * 16  # as a Sobol sequence does


def test_undamped_motions_are_one_neutral_attractor():
    """In permanent contact at ω = 1, without damping, every start has an orbit of its own of one mesh period."""
    model = gc.MeshModel.of(kind="single", omega=1.0, q0=3.0, chi0=0.0, zeta=0.0)
    data = gc.attractors(model, 16, box={"z": (3.5, 4.5), "z_dot": (-0.3, 0.3)})
    assert data.attractor_period.values.tolist() == [1]
    assert data.attractor_reason.values.tolist() == [Reason.NEUTRAL]
    assert float(data.attractor_fraction[0]) == 1.0


def test_the_smallest_perturbation_is_the_smallest_to_a_few_per_cent():
    """No perturbation of 0.95 of its length leaves, in 90 directions from every section point of three attractors."""
    data, attractor_set = gc.attractors(SINGLE, 32, kicks=12), no_attractors()
    turn = np.linspace(0, 2 * np.pi, 90, endpoint=False)
    ring = np.stack([np.cos(turn), np.sin(turn)])
    for number in range(3):
        size, period = float(data.attractor_kick[number]), int(data.attractor_period[number])
        section = np.stack([data[f"attractor_section_{n}"][number, :period] for n in ("z", "z_dot")])
        lengths = size * np.array([0.6, 0.8, 0.95])
        starts = section[:, :, None, None] + lengths[:, None] * ring[:, None, None, :]
        ends = attractor_set.find(np.concatenate([section, starts.reshape(2, -1)], axis=1))
        assert np.mean(ends == ends[0]) > 0.995
