"""Estimates of a scatter beside known values: Sobol's indices of test functions, coverage of intervals, correlations,
truncated shares, and the probability of contact loss of a linear model."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm, spearmanr, truncnorm

import gearchaos as gc
from gearchaos.flow import ExactFlow
from gearchaos.model import vary
from gearchaos.model.switched import switched_system
from gearchaos.studies.uncertainty.distributions import (
    SCRAMBLES,
    Scattered,
    correlated,
    correlation_factor,
    probabilities,
)
from gearchaos.studies.uncertainty.scatter_estimates import at_best, at_half, jackknife, probability, sobol_indices
from gearchaos.studies.uncertainty.scattered_models import in_contact
from tests.closed_forms.linear_gears import SPUR

G = np.array([0, 1, 4.5, 9, 99, 99, 99, 99])


def ishigami(u):
    x = np.pi * (2 * u - 1)
    return np.sin(x[..., 0]) + 7 * np.sin(x[..., 1]) ** 2 + 0.1 * x[..., 2] ** 4 * np.sin(x[..., 0])


def sobols_g(u):
    return np.prod((np.abs(4 * u - 2) + G) / (1 + G), axis=-1)


@pytest.mark.slow
@pytest.mark.parametrize(("function", "inputs", "first", "total"), [
    (ishigami, 3, [0.3139, 0.4424, 0], [0.5576, 0.4424, 0.2437]),
    (sobols_g, 8, [0.7162, 0.1791, 0.0237, 0.0072, *[0.0001] * 4], [0.7871, 0.2422, 0.0343, 0.0105, *[0.0001] * 4])])
def test_indices_of_test_functions(function, inputs, first, total):
    a, b, *mixed = function(probabilities(1 << 17, inputs, 0, True))
    for (value, low, high), known in zip(sobol_indices(a, b, np.array(mixed)), (first, total), strict=True):
        np.testing.assert_allclose(value, known, atol=3e-3)
        assert np.all(high - low < 0.02)
        assert np.all((low - 2e-4 < known) & (known < high + 2e-4))  # known to four digits


def test_an_output_that_does_not_vary_has_no_indices():
    constant = np.full((SCRAMBLES, 8), 0.3)
    assert all(np.isnan(each).all() for each in sobol_indices(constant, constant, constant[None]))


def test_indices_are_shares():
    """Of few samples the estimates alone lie beyond where one input has nearly the whole effect."""
    a, b, *mixed = probabilities(512, 2, 0, True) @ np.array([1.0, 0.01])
    for each in sobol_indices(a, b, np.array(mixed)):
        assert each.min() >= 0 and each.max() == 1


def drawn(seed, count=512):
    u = probabilities(count, 2, seed, False)[0]
    return u, u.sum(axis=-1) > 1.2, np.ones(u.shape[:2], bool)


def index(seed):
    """Of u in u + 2 v."""
    a, b, *mixed = probabilities(512, 2, seed, True) @ np.array([1.0, 2.0])
    return sobol_indices(a, b, np.array(mixed))[0][:, 0]


def held(seed):
    """With u in its best eighth."""
    u, likely, every = drawn(seed, 1024)
    return at_half(likely, every, u[..., 0], Scattered("x", low=0.0, high=1.0))


@pytest.mark.slow
@pytest.mark.parametrize(("estimate", "truth"), [
    (lambda seed: probability(*drawn(seed)[1:]), 0.32), (index, 0.2), (held, 0.3)], ids=["likely", "index", "held"])
def test_intervals_cover_as_often_as_they_say(estimate, truth):
    """Of 100 intervals at 95 % at most 13 miss but once in a thousand times; at least one misses."""
    found = [estimate(seed) for seed in range(100)]
    assert 87 <= sum(low <= truth <= high for _, low, high in found) <= 99


def test_rare_events_have_an_interval_that_is_not_empty():
    rare = np.zeros((SCRAMBLES, 32), bool)
    value, low, high = probability(rare, np.ones(rare.shape, bool))
    assert value == low == 0 and high == pytest.approx(1 - 0.025 ** (1 / 512))  # Clopper and Pearson
    value, low, high = probability(~rare, np.ones(rare.shape, bool))
    assert value == high == 1 and low == pytest.approx(0.025 ** (1 / 512))
    assert np.isnan(probability(rare, rare)).all()
    regular = np.arange(32) < 16  # the same in every scrambling
    value, low, high = probability(np.tile(regular, (SCRAMBLES, 1)), np.ones(rare.shape, bool))
    assert value == 0.5 and high - low == pytest.approx(2 * (1 - 0.025 ** (1 / 512)))


def test_the_jackknife_of_a_mean_is_that_of_students_t():
    values = np.random.default_rng(1).normal(size=SCRAMBLES)
    value, low, high = jackknife(lambda m: m, values)
    half = 2.131449546 * values.std(ddof=1) / 4
    np.testing.assert_allclose([value, low, high], values.mean() + half * np.array([0, -1, 1]), rtol=1e-9)


def test_the_best_part_is_not_flattered():
    """Of noise alone no part is better: where it is chosen, the best of eight would seem to be."""
    rng, u = np.random.default_rng(2), probabilities(512, 1, 0, False)[0][..., 0]
    every, found = np.ones(u.shape, bool), []
    for _ in range(200):
        estimate, _ = at_best(rng.random(u.shape), every, u, Scattered("x", low=0.0, high=8.0))
        found.append(estimate)
    value, low, high = np.transpose(found)
    assert value.mean() == pytest.approx(0.5, abs=0.01) and 180 <= np.sum((low <= 0.5) & (high >= 0.5)) <= 199
    (value, low, high), ends = at_best(u > 0.2, every, u, Scattered("x", low=0.0, high=8.0))
    assert value == low == 0 and high < 0.12 and ends == pytest.approx((0, 1), abs=1e-3)
    (value, *_), ends = at_best(u < 0.6, every, u, Scattered("x", low=0.0, high=8.0))
    assert value == 0 and ends == pytest.approx((5, 8), abs=1e-3)  # all that are as good
    _, ends = at_best(u < 0.6, every, u, Scattered("x", items=("a", "b", "c")))
    assert ends == (2, 2)


@pytest.mark.parametrize(("scattered", "share"), [
    (Scattered("x", low=0.0, high=4.0), 0.25),  # x > 2.5 in 1 to 3
    (Scattered("x", mean=2.0, sd=1.0), 1 - norm.cdf(1.0)),
    (Scattered("x", mean=2.0, sd=1.0, low=0.0, high=3.4),  # limits 1 to 2.7
     (norm.cdf(1.4) - norm.cdf(1.0)) / (norm.cdf(1.4) - norm.cdf(-2.0)))])
def test_half_the_spread(scattered, share):
    u = probabilities(1 << 14, 1, 0, False)[0][..., 0]
    value, low, high = at_half(scattered.at(u) > 2.5, np.ones(u.shape, bool), u, scattered)
    assert value == pytest.approx(share, abs=1e-3) and low <= share <= high
    assert np.isnan(at_half(u > 2, u > 0, u, Scattered("x", items=("a", "b")))).all()


def test_correlations_are_reproduced():
    inputs = [Scattered("a", mean=1.0, sd=2.0), Scattered("b", low=0.0, high=3.0), Scattered("c", mean=0.0, sd=1.0),
              Scattered("d", low=0.0, high=1.0)]
    factor = correlation_factor(inputs, [("a", "c", 0.6), ("a", "b", -0.5)])
    plain = probabilities(1 << 14, 4, 0, False)[0].reshape(-1, 4)
    u = correlated(plain, factor)
    a, b, c, d = (each.at(u[:, i]) for i, each in enumerate(inputs))
    assert np.corrcoef(a, c)[0, 1] == pytest.approx(0.6, abs=3e-3)
    assert spearmanr(a, b).statistic == pytest.approx(6 / np.pi * np.arcsin(-0.25), abs=3e-3)  # of a Gaussian copula
    assert np.corrcoef(b, c)[0, 1] == pytest.approx(0, abs=5e-3)
    assert np.array_equal(u[:, 3], plain[:, 3]) and abs(np.corrcoef(a, d)[0, 1]) < 5e-3
    for values, mean, sd in ((a, 1, 2), (b, 1.5, 3 / np.sqrt(12)), (c, 0, 1)):  # each keeps its own distribution
        assert values.mean() == pytest.approx(mean, abs=5e-3) and values.std() == pytest.approx(sd, rel=5e-3)


def test_limits_cut_a_normal_distribution():
    cut = Scattered.parse("x=normal(0.05, 0.01, 0.04, 0.08)")
    assert cut.cut == pytest.approx(norm.cdf(-1) + 1 - norm.cdf(3), rel=1e-12)
    values = cut.at(probabilities(1 << 14, 1, 0, False).ravel())
    assert 0.04 <= values.min() < 0.0401 and values.max() <= 0.08
    inside = norm.cdf(3) - norm.cdf(-1)
    assert values.mean() == pytest.approx(0.05 + 0.01 * (norm.pdf(-1) - norm.pdf(3)) / inside, rel=1e-4)
    assert Scattered.parse("x=0.05±0.01").cut == Scattered.parse("x=0.04:0.08").cut == 0


LINEAR = gc.MeshModel.of(kind="single", omega=0.820631, q0=0.1, chi0=0, zeta=0.05, eps1=0.045)


def test_contact_loss_of_a_linear_model():
    """The amplitude is ε1 ω²/|1 − ω² + 2iζω|, which is ε1 q0/0.05 here: contact is lost where ε1 > 0.05."""
    assert 0.1 * abs(1 - LINEAR.omega**2 + 0.1j * LINEAR.omega) / LINEAR.omega**2 == pytest.approx(0.05, rel=1e-6)
    found, from_rest = (gc.scatter(LINEAR, ["eps1=0.045±0.005"], "omega=0.820631:0.820631:1", **options).squeeze() for
                        options in ({"samples": 1024, "start": "steady contact"}, {"samples": 64}))
    lost = found.sel(outcome="contact loss")
    assert float(lost.probability_lo) <= 1 - norm.cdf(1) <= float(lost.probability_hi)
    assert float(lost.probability) == pytest.approx(0.158655, abs=2e-3)
    assert float(found.if_halved.isel(aim=0)) == pytest.approx(1 - norm.cdf(2), abs=5e-3)
    # the transient leads to the motion with contact loss beside it
    assert float(from_rest.sel(outcome="contact loss").probability) > 0.9


WITHIN = "quality.deviations=within the grade"


def test_deviations_are_drawn_within_the_grade():
    """Of each wheel they are normal, with the permissible one at three standard deviations, and none beyond it."""
    made = gc.Scatter(SPUR, [WITHIN], "speed=1000:1100:2", samples=1 << 14, indices=False)
    first, second = made.values.reshape(-1, 2).T
    for drawn in (first, second):
        assert np.abs(drawn).max() <= 1 and np.abs(drawn).max() > 0.98
        for share in (1 / 6, 1 / 3, 2 / 3):
            expected = (2 * norm.cdf(3 * share) - 1) / (2 * norm.cdf(3) - 1)
            assert np.mean(np.abs(drawn) < share) == pytest.approx(expected, abs=1e-3)
    assert np.mean(first > 0) == pytest.approx(0.5, abs=1e-3) and np.corrcoef(first, second)[0, 1] == pytest.approx(
        0, abs=5e-3)
    # the root mean square of the errors is that of a typical pair, but for what is cut off beyond three
    one, two = made.models.models((1.0, 0.0))[0].value("eps1"), made.models.models((0.0, 1.0))[0].value("eps1")
    typical = replace(SPUR, transmission_error="from quality (typical)", speed=1000).to_model().value("eps1")
    cut = np.sqrt(1 - 6 * norm.pdf(3) / (2 * norm.cdf(3) - 1))
    assert np.sqrt(np.mean((first * one + second * two) ** 2)) == pytest.approx(cut * typical, rel=2e-3)


def test_deviations_scale_with_the_grade_that_is_drawn():
    made = gc.Scatter(SPUR, [WITHIN, "quality.grade=5:9"], "speed=1000:1100:2", samples=32, indices=False)
    for item, grade in enumerate(range(5, 10)):
        (model,) = made.models.models((0.3, 0.5, item))
        bound = replace(SPUR, quality={"standard": "ISO 1328-1:1995", "grade": grade}, speed=1000).to_model()
        of_one = bound.value("eps1") / np.sqrt(2)  # the wheels are alike
        assert model.value("eps1") == pytest.approx(0.8 * of_one, rel=1e-12)
        assert model.value("theta1") == bound.value("theta1")
        turned = made.models.models((-0.3, -0.5, item))[0].value("theta1")
        assert turned == pytest.approx(bound.value("theta1") + np.pi)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:The mesh stiffness of the table is constant")
def test_contact_loss_by_deviations_within_the_grade_of_a_linear_pair(tmp_path):
    """In permanent contact z − 1 is the sum of the responses to the harmonics, in proportion to the sum of both
    deviations: contact is lost where that is above one limit, or, turned over, below another."""
    table = tmp_path / "constant.csv"
    table.write_text("roll angle [deg],stiffness [N/um]\n" + "\n".join(f"{0.36 * n},350" for n in range(21)))
    design = replace(SPUR, stiffness={"table": str(table)}, torque=70, speed=2600)
    model = replace(design, quality={"standard": "ISO 1328-1:1995", "grade": 6, "deviations": (1, 0)}).to_model()
    j, tau = np.arange(1, 4), np.arange(2000) / 2000
    eps, theta = np.array([[model.value(f"{name}{n}") for n in j] for name in ("eps", "theta")])
    response = (j * model.omega) ** 2 * eps * np.exp(-1j * theta) / (
        1 - (j * model.omega) ** 2 + 2j * model.zeta * j * model.omega)
    z = (response * np.exp(2j * np.pi * j * tau[:, None])).sum(axis=1).real  # by a deviation 1 of one wheel
    above, below = model.q1 / -z.min(), -model.q1 / z.max()
    one, other = truncnorm(-3, 3, scale=1 / 3), np.linspace(-1, 1, 4001)
    density = one.pdf(other) / one.pdf(other).sum()
    expected = np.sum(density * (one.sf(above - other) + one.cdf(below - other)))
    assert 0.1 < expected < 0.5 and abs(above + below) > 0.05
    found = gc.scatter(design, [WITHIN], "speed=2600:2601:2", samples=512, start="steady contact")
    lost = found.sel(outcome="contact loss").isel(torque=0, speed=0)
    assert float(lost.probability) == pytest.approx(expected, abs=0.01)
    assert [float(found[f"{end}_speed_lost"][0, 1]) for end in ("lowest", "highest")] == [2600, 2601]  # medians
    shares = found.total_index.sel(output="share of speeds with contact loss").values[0]
    assert shares[0] == pytest.approx(shares[1], abs=0.1) and shares.sum() > 1  # wheels alike, and it takes both


@pytest.mark.parametrize("law", ["always", "contact"])
@pytest.mark.parametrize("kind", ["single", "torsional", "full"])
def test_steady_contact_is_the_motion_in_permanent_contact(kind, law):
    model = gc.MeshModel.of(kind=kind, omega=0.9, q0=0.2, chi0=0, zeta=0.05, eps1=0.01, eps2=0.005, theta2=1.0,
                            damping_law=law)
    system = switched_system(vary(model, {}))
    state = in_contact(system, True).T
    np.testing.assert_allclose(ExactFlow(system).advance(state.copy(), 1).w, state, atol=1e-9)
    at_rest = in_contact(system, False)[0]
    assert at_rest[0] == pytest.approx(1 + float(system.static_force[0, 0])) and at_rest[1] == 0
