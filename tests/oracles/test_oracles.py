"""The exact flow against independent integrations of the paper's equations, and those against each other."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.flow import OK
from gearchaos.model import HarmonicStiffness, MeshModel, SteppedStiffness, TransmissionError, TwoLevelStiffness
from tests.flows import flow_of

heyoka_oracle = pytest.importorskip("tests.oracles.heyoka_oracle", exc_type=ImportError)
scipy_oracle = pytest.importorskip("tests.oracles.scipy_oracle")

POINTS = 24
STIFFNESSES = {
    "two-level": TwoLevelStiffness(),
    "harmonics": HarmonicStiffness((0.2, 0.1, 0.05), (0.3, 1.0, 2.0)),
    "steps": SteppedStiffness((0.8, 1.4, 0.6, 1.1, 1.3), (0.07, 0.2, 0.45, 0.7, 0.93))}
# dimension of the reduced state -> kind, and which pairs must differ for it
DIMENSIONS = {
    "2 single": ("single", ()),
    "2 torsional": ("torsional", ()),
    "3": ("torsional", ("J", "beta")),
    "4": ("full", ()),
    "5": ("full", ("J", "beta")),
    "6": ("full", ("mu", "kappa", "zeta_support")),
    "7": ("full", ("J", "beta", "mu", "kappa", "zeta_support"))}
RANGES = {
    "J": (1, 4), "beta": (0, 0.05), "mu": (1, 6), "kappa": (0.2, 10), "zeta_support": (0, 0.05),
    "omega": (0.15, 3), "zeta": (0, 0.1), "q1": (-0.1, 0.3), "q2": (-0.1, 0.3), "eps1": (0, 0.4), "eps2": (0, 0.1),
    "theta1": (0, 6), "theta2": (0, 6)}
SPECTRUM = {
    "two-level": {"chi1": (-0.2, 0.8), "chi2": (-0.2, 0.7), "contact_ratio": (1, 2)},
    "harmonics": {"c1": (-0.3, 0.3), "c2": (-0.2, 0.2), "c3": (-0.1, 0.1), "alpha1": (0, 6), "alpha3": (0, 6)},
    "steps": {}}


def _random(case: str, stiffness: str, count: int = POINTS) -> tuple[MeshModel, dict[str, np.ndarray]]:
    """A model and ``count`` seeded random values of its parameters and initial state."""
    kind, differing = DIMENSIONS[case]
    rng = np.random.default_rng(_seed(case + stiffness))
    model = MeshModel(kind=kind, stiffness=STIFFNESSES[stiffness], error=TransmissionError((0.1, 0.05)))
    ranges = {k: v for k, v in RANGES.items() if k not in ("J", "beta", "mu", "kappa", "zeta_support")}
    ranges |= {f"{pair}{n}": RANGES[pair] for pair in differing for n in (1, 2)} | SPECTRUM[stiffness]
    ranges |= dict.fromkeys(_start_names(kind), (-1.3, 1.3))
    return model, {name: rng.uniform(*ends, count) for name, ends in ranges.items()}


def _seed(text: str) -> int:
    """A seed from a name, the same in every process."""
    return sum(ord(c) * 31**i for i, c in enumerate(text)) % 2**32


def _start_names(kind: str) -> tuple[str, ...]:
    return ("z", "z_dot") if kind == "single" else gc.model.COORDINATES[kind]


def _worst(model: MeshModel, values: dict[str, np.ndarray]) -> float:
    """Largest one-period error of any coordinate at any point."""
    flow, w = flow_of(model, values)
    out, worst = flow.advance(w, 1), 0.0
    assert np.all(out.status == OK)
    for i in range(w.shape[1]):
        point = model.with_values({k: float(v[i]) for k, v in values.items()})
        end = dict(heyoka_oracle.section(point, 1))
        if "y1" in end:
            end |= {"y": end["y1"] - end["y2"], "y_dot": end["y1_dot"] - end["y2_dot"]}
        expected = np.array([end[name][-1] for name in flow.system.names])
        worst = max(worst, float(np.abs(out.w[:, i] - expected).max()))
    return worst


@pytest.mark.parametrize("stiffness", STIFFNESSES)
@pytest.mark.parametrize("case", DIMENSIONS)
def test_one_period_from_random_states(case, stiffness):
    model, values = _random(case, stiffness)
    assert len(flow_of(model, values)[1]) == int(case[0]) and _worst(model, values) <= 1e-11


@pytest.mark.parametrize("stiffness", STIFFNESSES)
@pytest.mark.parametrize("case", ["2 single", "2 torsional", "4", "7"])
def test_one_period_from_the_boundary(case, stiffness):
    """z(0) = ±1 at speeds of either sign, down to none at all."""
    model, values = _random(case, stiffness)
    _move_to(model, values, np.resize([1.0, -1.0], POINTS))
    speeds = np.resize([0.0, 1e-12, -1e-12, 1e-9, -1e-9, 1e-6, -1e-6, 0.3, -0.3], POINTS)
    values["z_dot" if model.kind == "single" else "x1_dot"] += speeds - _relative(model, values)[1]
    assert _worst(model, values) <= 1e-11


@pytest.mark.parametrize("stiffness", STIFFNESSES)
def test_one_period_from_a_flat_start(stiffness):
    """z(0) = ±1 at rest or nearly, with hardly any acceleration: the gap opens or closes like τ³."""
    count = 48
    model, values = _random("2 single", stiffness, count)
    rng = np.random.default_rng(_seed(stiffness))
    speed, pull = (rng.choice([-1, 0, 1], count) * 10 ** rng.uniform(-14, top, count) for top in (-6, -2))
    _move_to(model, values, np.resize([1.0, -1.0], count))
    values["z_dot"] = speed
    error2 = -(values["omega"] ** 2) * (
        values["eps1"] * np.cos(values["theta1"]) + 4 * values["eps2"] * np.cos(values["theta2"]))
    values["q2"], values["q1"] = np.zeros(count), 2 * (pull + error2 + 2 * values["zeta"] * speed)
    assert _worst(model, values) <= 1e-11


def _relative(model: MeshModel, values: dict[str, np.ndarray]) -> np.ndarray:
    """z and z' at the start, (2, points)."""
    return flow_of(model, values)[1][:2]


def _move_to(model: MeshModel, values: dict[str, np.ndarray], z: np.ndarray) -> None:
    """Turn the first wheel until z(0) = ``z``."""
    values["z" if model.kind == "single" else "x1"] += z - _relative(model, values)[0]


@pytest.mark.slow
@pytest.mark.parametrize("depth", [0.0, 1e-13, -1e-13, 1e-11, 1e-9, -1e-9, 1e-6])
@pytest.mark.parametrize("case", ["2 single", "2 torsional", "4", "7"])
def test_one_period_with_a_grazing_contact(case, depth):
    """A free flight whose summit comes to 1 + ``depth`` within the period: free flight knows no place, so lift it."""
    model, values = _random(case, "two-level", 4)
    values["omega"] = np.linspace(0.6, 1.8, 4)
    values["eps1"], values["theta1"] = np.full(4, 0.4), np.full(4, 2.0)
    _rest(model, values)
    _move_to(model, values, np.zeros(4))
    summit = [heyoka_oracle.summit(model.with_values({k: float(v[i]) for k, v in values.items()})) for i in range(4)]
    _move_to(model, values, 1.0 + depth - np.array(summit))
    assert _worst(model, values) <= 1e-11


def _rest(model: MeshModel, values: dict[str, np.ndarray]) -> None:
    """Small torques and a start at rest but for the error's own speed."""
    for name in _start_names(model.kind):
        values[name] = np.zeros(len(values["omega"]))
    values["q1"], values["q2"] = values["q1"] / 50, values["q2"] / 50
    if model.kind == "single":
        values["z_dot"] = _relative(MeshModel(kind="single", error=model.error), {
            k: v for k, v in values.items() if k[0] in "eto"
        } | {"x1": np.zeros(len(values["omega"]))})[1]


REGULAR = {
    "single 1T": MeshModel.of(kind="single", omega=2.3, eps1=0.05),
    "single 5T": MeshModel.of(kind="single", omega=2.3, eps1=0.05, z=2.2, z_dot=-1.8),
    "single, unequal wheels": MeshModel.of(kind="single", omega=1.2, eps1=0.1, J1=1.5, J2=3.5, q1=0.12, q2=0.05),
    "torsional 8T": MeshModel.of(omega=1.0, eps1=0.206),
    "torsional 2T": MeshModel.of(omega=1.0, eps1=0.1, q0=0.0507),
    "torsional, unequal torques": MeshModel.of(omega=1.3, eps1=0.05, eps2=0.02, theta2=0.7, q1=0.16, q2=0.1, J2=3.0),
    "full 1T": MeshModel.of(kind="full", omega=1.05, eps1=0.03),
    "full 2T": MeshModel.of(kind="full", omega=1.05, eps1=0.19),
    "full, unequal": MeshModel.of(
        kind="full", omega=0.7, eps1=0.06, eps3=0.01, J1=1.6, beta2=0.03, mu1=3.0, kappa1=0.8, kappa2=2.0, q1=0.2,
        q2=0.18)}
REGULAR |= {f"{name}, harmonics": replace(m, stiffness=HarmonicStiffness((0.3, 0.05), (0.0, 1.0)))
            for name, m in REGULAR.items() if "unequal" in name}


@cache
def _settled(name: str) -> MeshModel:
    """The model, started on its attractor: from the paper's start some pass through chaos first, where rounding grows.

    Both wheels are turned back together, which changes nothing but the size of x1 and x2."""
    model = REGULAR[name]
    data = gc.simulate(model, periods=1, transient=5000)
    state = {n: round(data[f"section_{n}"].item(), 9) for n in _start_names(model.kind)}
    if "x2" in state:
        state |= {"x1": state["x1"] - state["x2"], "x2": 0.0}
    return model.with_values(state)


@pytest.mark.slow
@pytest.mark.parametrize("name", REGULAR)
def test_the_oracles_agree_over_fifty_periods(name):
    model = _settled(name)
    one, other = scipy_oracle.section(model, 10, 40), heyoka_oracle.section(model, 10, 40)
    assert one.keys() == other.keys()
    for key, values in one.items():
        np.testing.assert_allclose(values, other[key], rtol=0, atol=1e-10, err_msg=key)


@pytest.mark.parametrize("name", REGULAR)
def test_fifty_periods_of_regular_motion(name):
    model = _settled(name)
    data, expected = gc.simulate(model, periods=10, transient=40), heyoka_oracle.section(model, 10, 40)
    for key, values in expected.items():
        np.testing.assert_allclose(data[f"section_{key}"], values, rtol=0, atol=1e-9, err_msg=key)


MEAN_MOTIONS = {
    "rotation without friction": {"kind": "torsional", "q1": 0.2, "q2": 0.1, "beta": 0.0, "x2_dot": 0.3},
    "rotation braked alike": {"kind": "torsional", "q1": 0.2, "q2": 0.1, "J2": 3.0, "beta2": 0.015, "x2_dot": 0.3},
    "rotation braked unlike": {"kind": "torsional", "q1": 0.2, "q2": 0.1, "J2": 3.0, "x2_dot": 0.3},
    "one wheel braked": {"kind": "full", "q1": 0.2, "q2": 0.1, "beta1": 0.0, "x2": 0.5, "y2_dot": 0.2},
    "alike supports": {"kind": "full", "mu2": 8.0, "kappa2": 2.0, "y1": 0.5, "y2_dot": 0.2},
    "critical supports": {"kind": "full", "mu": 4.0, "kappa": 1.0, "zeta_support": 0.5, "y1": 0.5, "y2_dot": 0.2},
    "overdamped supports": {"kind": "full", "zeta_support": 2.0, "y1": 0.5, "y2_dot": 0.2}}


@pytest.mark.parametrize("name", MEAN_MOTIONS)
def test_mean_motions_in_closed_form(name):
    model = MeshModel.of(omega=1.3, eps1=0.05, **MEAN_MOTIONS[name])
    data, expected = gc.simulate(model, periods=5), heyoka_oracle.section(model, 5)
    for key, values in expected.items():
        np.testing.assert_allclose(data[f"section_{key}"], values, rtol=0, atol=1e-11, err_msg=key)


@pytest.mark.parametrize("name", [
    "single, unequal wheels", "torsional, unequal torques",
    pytest.param("full, unequal, harmonics", marks=pytest.mark.exhaustive)])  # kernels of eight coordinates
def test_a_sampled_trajectory(name):
    data = gc.simulate(REGULAR[name], periods=3, transient=2, samples=24)
    expected = heyoka_oracle.trajectory(REGULAR[name], data.tau.values)
    for key, values in expected.items():
        np.testing.assert_allclose(data[key], values, rtol=0, atol=1e-10, err_msg=key)
    np.testing.assert_array_equal(data.contact, np.sign(data.z) * (np.abs(data.z) > 1))


@pytest.mark.slow
def test_an_orbit_of_40_periods_that_nearly_returns_after_10_20_and_30():
    """The shortest near returns are tried first, and none of the three is the period."""
    model = MeshModel.of(q0=0.1, eps1=0.1, omega=1.57889447, zeta=0.05272727)
    z = heyoka_oracle.section(model, 81, 20_000)["z"]
    changes = [np.abs(z[n:] - z[:-n]).max() for n in range(1, 41)]
    assert [n for n, change in enumerate(changes, 1) if change < 1e-3] == [10, 20, 30, 40]
    assert [n for n, change in enumerate(changes, 1) if change < 1e-9] == [40]
    verdict = gc.regime(model)
    assert verdict.label == "40T" and max(abs(mu) for mu in verdict.multipliers) < 1
    np.testing.assert_allclose(np.sort(verdict.section["z"]), np.sort(z[-40:]), rtol=0, atol=1e-9)
