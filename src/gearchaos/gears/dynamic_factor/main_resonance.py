"""The main resonance of a mesh, where the mesh frequency is its natural frequency, and the range of speeds around."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum

from gearchaos.gears.io.fields import described

_RPM = 30 / math.pi  # one rad/s in revolutions per minute
# resonance ratios N where main resonance ends and the supercritical range begins; ISO 6336-1:2006, 6.4.2.
MAIN_END, SUPERCRITICAL_START = 1.15, 1.5
_CLAUSE = "ISO 6336-1:2006, 6.4.2"


class ResonanceRange(Enum):
    """Range of the running speed relative to the main resonance, ISO 6336-1:2006, 6.4.2."""

    SUBCRITICAL = "subcritical"
    MAIN_RESONANCE = "main resonance"
    INTERMEDIATE = "intermediate"
    SUPERCRITICAL = "supercritical"


@dataclass(frozen=True, kw_only=True)
class Resonance:
    """Main resonance of the mesh in terms of the speed of wheel 1; values in SI, speeds in rad/s."""

    reduced_mass: float = described("m_red", "I1 I2/((I1 r_b2² + I2 r_b1²) b)", f"{_CLAUSE}, (7), (8)", "kg/mm", 1e-3)
    resonance_speed: float = described("n_E1", "30000/(π z1) √(c_γα/m_red)", f"{_CLAUSE}, (6)", "rpm", _RPM)
    lower_limit_ratio: float = described(
        "N_S", "0.85, or 0.5 + 0.35 √(F_t K_A/(100 b)) below 100 N/mm", f"{_CLAUSE}, (11), (12)",
        words="resonance ratio where main resonance begins")
    main_start: float = described("", "N_S n_E1", _CLAUSE, "rpm", _RPM, words="start of the main resonance")
    main_end: float = described("", "1.15 n_E1", _CLAUSE, "rpm", _RPM, words="end of the main resonance")
    supercritical_start: float = described(
        "", "1.5 n_E1", _CLAUSE, "rpm", _RPM, words="start of the supercritical range")

    def ratio(self, speed: float) -> float:
        """Resonance ratio N = n1/n_E1, (9), at a speed of wheel 1 in rad/s."""
        return abs(speed) / self.resonance_speed

    def range_at(self, speed: float) -> ResonanceRange:
        ratio = self.ratio(speed)
        if ratio <= self.lower_limit_ratio:
            return ResonanceRange.SUBCRITICAL
        if ratio <= MAIN_END:
            return ResonanceRange.MAIN_RESONANCE
        return ResonanceRange.INTERMEDIATE if ratio < SUPERCRITICAL_START else ResonanceRange.SUPERCRITICAL


def resonance(teeth1: int, mesh_stiffness: float, reduced_mass: float, line_load: float) -> Resonance:
    """Main resonance of the mesh, ISO 6336-1:2006, 6.4.2, from c_γα, N/m², m_red, kg/m, and F_t K_A/b, N/m, for N_S.

    m_red is the equivalent mass of the pair over the common face width, (7), (8). With the inertias of discs it is that
    of 6.4.8, (30).
    """
    speed = math.sqrt(mesh_stiffness / reduced_mass) / teeth1
    lower = lower_limit_ratio(line_load)
    return Resonance(
        reduced_mass=reduced_mass, resonance_speed=speed, lower_limit_ratio=lower, main_start=lower * speed,
        main_end=MAIN_END * speed, supercritical_start=SUPERCRITICAL_START * speed)


def lower_limit_ratio(line_load: float) -> float:
    """N_S at a line load in N/m, ISO 6336-1:2006, 6.4.2, (11), (12)."""
    return 0.5 + 0.35 * math.sqrt(min(line_load / 100e3, 1.0))
