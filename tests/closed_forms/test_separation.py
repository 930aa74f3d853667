"""The torque at which permanent contact ends: the closed form, and the project's own classification beside the line."""

import math

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.gears.io.units import RPM
from gearchaos.gears.operation.separation import separation_torque
from gearchaos.model import DAMPING_LAWS

PAIR = {"teeth1": 25, "base_radius1": 0.03, "stiffness": 4e8, "mass": 0.25, "damping_ratio": 0.05}
NATURAL = math.sqrt(PAIR["stiffness"] / PAIR["mass"]) / PAIR["teeth1"] / RPM


def test_one_harmonic():
    ratio = np.array([0.1, 0.5, 1.0, 2.0, 10.0])
    expected = 0.03 * 4e8 * 3e-6 * ratio**2 / np.sqrt((1 - ratio**2) ** 2 + 4 * 0.05**2 * ratio**2)
    assert separation_torque(ratio * NATURAL, **PAIR, amplitudes=(3e-6,)) == pytest.approx(expected, rel=1e-12)
    shifted = separation_torque(NATURAL, **PAIR, amplitudes=(3e-6,), phases=(1.0,))
    assert shifted == pytest.approx(expected[2], rel=1e-12)
    second = separation_torque(ratio * NATURAL / 2, **PAIR, amplitudes=(0.0, 3e-6))
    assert second == pytest.approx(expected, rel=1e-12)


def test_shapes_and_special_cases():
    speeds = np.linspace(10, 400, 6).reshape(2, 3)
    assert separation_torque(speeds, **PAIR, amplitudes=(1e-6, 1e-6)).shape == (2, 3)
    assert separation_torque(100.0, **PAIR, amplitudes=(1e-6,)).shape == ()
    assert separation_torque(0.0, **PAIR, amplitudes=(1e-6, 2e-6)) == 0
    assert separation_torque(speeds, **PAIR, amplitudes=()).max() == 0
    undamped = {**PAIR, "damping_ratio": 0.0, "mass": 1.0, "stiffness": 1.0, "teeth1": 1}
    assert separation_torque(1 / RPM, **undamped, amplitudes=(1e-6,)) == np.inf
    assert separation_torque(np.array([1.0, 2.0]) / RPM, **undamped, amplitudes=(1e-6, 1e-6)).tolist()[0] == np.inf


@pytest.mark.parametrize("unilateral", [False, True])
def test_several_harmonics_by_brute_force(unilateral):
    rng = np.random.default_rng(1)
    tau = np.linspace(0, 2 * np.pi, 200_001)
    for _ in range(5):
        e, theta = rng.uniform(0, 3e-6, 4), rng.uniform(-3, 3, 4)
        ratio = rng.uniform(0.1, 2)
        s = ratio * np.arange(1, 5)
        response = e * s**2 / (1 - s**2 + 2j * 0.05 * s) * np.exp(-1j * theta)
        response *= 1 + 2j * 0.05 * s if unilateral else 1  # the force that ends contact, over c0
        drop = -np.real(response[:, None] * np.exp(1j * np.arange(1, 5)[:, None] * tau)).sum(axis=0)
        found = separation_torque(
            ratio * NATURAL, **PAIR, amplitudes=tuple(e), phases=tuple(theta), unilateral=unilateral)
        assert found == pytest.approx(0.03 * 4e8 * drop.max(), rel=1e-8)
        assert found >= 0.03 * 4e8 * drop.max() * (1 - 1e-12)


def contact_fraction(ratio: float, torque: float, half_backlash: float, amplitudes, phases, law="always") -> float:
    """The project's own share of the time in contact, from a start in the permanent contact of the linear mesh."""
    load = torque / (0.03 * 4e8 * half_backlash)
    eps = np.array(amplitudes) / half_backlash
    s = ratio * np.arange(1, len(eps) + 1)
    response = eps * s**2 / (1 - s**2 + 2j * 0.05 * s) * np.exp(-1j * np.array(phases))
    model = gc.MeshModel.of(
        kind="single", damping_law=law, omega=ratio, zeta=0.05, J=2.0, q0=load, beta=0.0, chi0=0.0,
        z=1 + load + response.real.sum(), z_dot=(1j * s * response).real.sum(),
        **{f"eps{j}": float(v) for j, v in enumerate(eps, 1)}, **{f"theta{j}": v for j, v in enumerate(phases, 1)})
    return float(gc.regime(model).contact_fraction)


@pytest.mark.parametrize("law", DAMPING_LAWS)
@pytest.mark.parametrize(("ratio", "amplitudes", "phases"), [
    (0.3, (2e-6, 1e-6), (0.4, 2.0)), (0.9, (3e-6,), (0.0,)), (1.0, (2e-6, 1e-6), (0.4, 2.0)), (1.8, (3e-6,), (0.0,))])
def test_the_classified_contact_ends_at_this_torque(ratio: float, amplitudes, phases, law: str):
    line = float(separation_torque(
        ratio * NATURAL, **PAIR, amplitudes=amplitudes, phases=phases, unilateral=law == "unilateral"))
    assert contact_fraction(ratio, 1.001 * line, 50e-6, amplitudes, phases, law) == 1.0
    assert contact_fraction(ratio, 0.999 * line, 50e-6, amplitudes, phases, law) < 1.0
