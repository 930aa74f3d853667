"""The quasi-static ratio: closed forms of the peaks after jumps of the stiffness, and the exact flow at low speed."""

import math

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.studies.operation.quasi_static import quasi_static_ratio

FALL = (1.4, 0.7, 0.84, 1.0, 1.2)
"""Rises of 1.2 at most, and a fall to the half."""


def overshoot(before: float, after: float, zeta: float, inverse_mass: float = 1.0) -> float:
    """Largest force over the static one after a fall of the stiffness, for one degree of freedom: the force of spring
    and damper is m δ'' away from the load, and its first extremum after the jump is where δ''' = 0."""
    ratio = zeta * math.sqrt(inverse_mass / after)  # the damping ratio at the stiffness after the jump
    if ratio < 1:
        angle = math.acos(ratio)
        decay = 2 * ratio * angle / math.sin(angle)
    else:
        decay = 2 * ratio * math.acosh(ratio) / math.sqrt(ratio**2 - 1)
    return 1 + (1 - after / before) * math.exp(-decay)


@pytest.mark.parametrize(("chi1", "chi2"), [(0.4, 0.2), (0.2, 0.3), (0.0, 0.6), (-0.5, -0.5)])
def test_of_two_levels_it_is_the_ratio_of_the_stiffnesses(chi1, chi2):
    high, low = max(1 + chi1, 1 - chi2), min(1 + chi1, 1 - chi2)
    for kind in ("single", "torsional", "full"):
        model = gc.MeshModel.of(kind=kind, q0=0.1, chi1=chi1, chi2=chi2)
        assert quasi_static_ratio(model) == pytest.approx(high / low, rel=1e-12)


@pytest.mark.parametrize("law", ["always", "contact", "unilateral"])
@pytest.mark.parametrize("zeta", [0.01, 0.05, 0.3, 1.5])
def test_a_fall_overshoots_as_the_damped_oscillator(zeta, law):
    model = gc.MeshModel.of(kind="single", q0=0.1, zeta=zeta, damping_law=law, stiffness=gc.SteppedStiffness(
        levels=FALL, starts=(0.0, 0.2, 0.4, 0.6, 0.8)))
    expected = max(1.2, overshoot(1.4, 0.7, zeta))
    assert quasi_static_ratio(model) == pytest.approx(expected, rel=1e-9) and (expected > 1.2) == (zeta < 0.3)


def test_without_a_jump_it_is_one():
    smooth = gc.MeshModel.of(q0=0.1, stiffness=gc.HarmonicStiffness(amplitudes=(0.3, 0.1)))
    assert quasi_static_ratio(smooth) == 1
    assert quasi_static_ratio(gc.MeshModel.of(q0=0.1, chi1=0.0, chi2=0.0)) == 1


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "zeta", "levels"), [
    ("single", 0.05, (1.4, 0.8)), ("single", 0.05, FALL), ("torsional", 0.02, FALL), ("full", 0.05, FALL)])
def test_it_is_the_limit_of_the_exact_flow_at_low_speed(kind, zeta, levels):
    stiffness = gc.SteppedStiffness(levels=levels, starts=tuple((np.arange(len(levels)) / len(levels)).tolist()))
    model = gc.MeshModel.of(kind=kind, q0=0.1, zeta=zeta, eps1=1e-3, omega=5e-4, stiffness=stiffness)
    found = gc.regime(model)
    assert found.contact == "permanent"
    assert quasi_static_ratio(model) == pytest.approx(found.dynamic_factor, rel=1e-6)
