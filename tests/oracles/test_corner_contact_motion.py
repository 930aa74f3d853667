"""Motions with corner contact against an integration of the pair's own equations, made from its drawing by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline

import gearchaos as gc
from tests.oracles.test_corner_contact import SPUR, construct, searched

TEETH, MODULE, WIDTH, BORE, ALPHA = 50, 3e-3, 0.02, 0.03, math.radians(20)
BASE, HALF_BACKLASH, ZETA, TORQUE = TEETH * MODULE / 2 * math.cos(ALPHA), 0.06e-3, 0.05, 300.0
PITCH = math.pi * MODULE * math.cos(ALPHA)
PATH = 2 * (math.sqrt((TEETH * MODULE / 2 + MODULE) ** 2 - BASE**2) - BASE * math.tan(ALPHA))
SINGLE = 0.8 * 0.975 / (0.04723 + (0.15551 + 0.25791) / TEETH) * 1e9 * WIDTH
"""c′ b of ISO 6336-1:2006, 9.3, N/m: C_M 0.8, C_B 0.975 of a dedendum of 1.25."""
MEAN = SINGLE * (0.75 * PATH / PITCH + 0.25)
INERTIA = math.pi / 32 * 7830 * WIDTH * ((TEETH * MODULE - 0.25 * MODULE) ** 4 - BORE**4)
MASS = INERTIA / (2 * BASE**2)
SAMPLES = 400  # in a mesh period


class Pair:
    """u'' = (F₀ − F)/m − e'', where u is the deflection with half the backlash; both flanks are mirror images."""

    def __init__(self, error: str, speed: float) -> None:
        self.design = replace(SPUR, transmission_error=error).at(speed=speed, torque=TORQUE)
        self.period = 60 / (TEETH * speed)
        beyond = np.linspace(0, 0.9 * MODULE, 60)
        flanks = construct(self.design.geometry)
        self.gap = CubicSpline(beyond, [searched(flanks, x, True) for x in beyond])
        self.most = beyond[-1]

    def penetrating(self, at: float, depth: float) -> float:
        """The force of all pairs of one flank; the flanks would be ``depth`` in each other without gaps."""
        total = 0.0
        for way in (at % 1 + np.arange(-2, 4)) * PITCH:
            beyond = max(-way, way - PATH, 0.0)
            alone = PATH - PITCH < way < PITCH
            if beyond < self.most:
                total += (1.0 if alone else 0.875) * SINGLE * max(0.0, depth - float(self.gap(beyond)))
        return total

    def force(self, t: float, u: float, velocity: float) -> float:
        at = t / self.period
        front, back = self.penetrating(at, u - HALF_BACKLASH), self.penetrating(at - 0.5, -u - HALF_BACKLASH)
        damper = 2 * ZETA * math.sqrt(MEAN * MASS) * velocity if front or back else 0.0
        return front - back + damper

    def acceleration(self, t: float, u: float, velocity: float) -> float:
        error, w = self.design.error_harmonics, 2 * math.pi / self.period
        driven = sum(-e * (j * w) ** 2 * math.cos(j * w * t - phase)
                     for j, (e, phase) in enumerate(zip(error.amplitudes, error.phases, strict=True), 1))
        return (TORQUE / BASE - self.force(t, u, velocity)) / MASS - driven

    def integrated(self, start: np.ndarray, times: np.ndarray) -> np.ndarray:
        """u and its velocity, m and m/s, at times in s, from 0 on."""
        return solve_ivp(lambda t, w: [w[1], self.acceleration(t, *w)], (0.0, times[-1]), start, t_eval=times,
                         rtol=1e-8, atol=[1e-13, 1e-9], max_step=self.period / 200).y


@pytest.mark.slow
@pytest.mark.parametrize(("error", "speed", "label", "contact", "factor"), [
    ("none", 2000.0, "1T", "permanent", 1.404), ("from quality (typical)", 5500.0, "1T", "one-sided", 2.240),
    ("from quality", 2700.0, "1T", "one-sided", 5.958), ("from quality", 7000.0, "chaotic", "two-sided", None)])
def test_motions_and_their_dynamic_factors(error, speed, label, contact, factor):
    """Within the 2·10⁻⁴ half backlashes by which the gap may differ from its pieces, in the first period; impacts make
    more of it in the next two. From rest the last motion hits the back flanks; the periods begin before such a hit."""
    pair = Pair(error, speed)
    found = gc.regime(pair.design)
    assert (found.label, found.contact) == (label, contact)
    motion = gc.simulate(pair.design, 60, transient=400, samples=SAMPLES)
    z, rate = (motion[name].values.ravel()[: 60 * SAMPLES].reshape(60, SAMPLES) for name in ("z", "z_dot"))
    first = min(max(int(np.argmin(z.min(axis=1))) - 1, 0), 57)
    taken = slice(first, first + 3)
    assert (z[taken].min() < -1) == (contact == "two-sided")
    start = np.array([z[first, 0], rate[first, 0] * math.sqrt(MEAN / MASS)]) * HALF_BACKLASH
    times = np.arange(3 * SAMPLES) * pair.period / SAMPLES
    u, velocity = pair.integrated(start, times)
    off = np.abs(u / HALF_BACKLASH - z[taken].ravel())
    assert off[:SAMPLES].max() < 2e-4 and off.max() < 1e-3
    if factor:
        largest = max(pair.force(*each) for each in zip(times, u, velocity, strict=True)) * BASE / TORQUE
        assert largest == pytest.approx(found.dynamic_factor, rel=2e-3) and largest == pytest.approx(factor, abs=2e-3)
