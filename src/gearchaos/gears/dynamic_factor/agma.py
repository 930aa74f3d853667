"""Dynamic factor K_v by AGMA 2001-D04 and 2101-D04.

AGMA standards before 2001-C95 defined K_v as the reciprocal, which is below 1; that definition is not offered.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from gearchaos.gears.dynamic_factor import Refused, Standard
from gearchaos.gears.io.fields import described

FEET_PER_MINUTE = 196.85  # ft/min in one m/s, as 2101-D04 prints it
_AGMA = "ANSI/AGMA 2001-D04 and 2101-D04, clause 8"


@dataclass(frozen=True, kw_only=True)
class DynamicFactorAGMA:
    """K_v by AGMA 2001-D04, velocities in m/s: none above the largest. With A_v the constant A is called C."""

    reason: ClassVar[str] = ""

    exponent: float = described("B", "0.25 (12 − Q_v)^(2/3)", _AGMA)
    velocity_constant: float = described("A", "50 + 56 (1 − B)", _AGMA)
    largest_velocity: float = described("v_max", "(A + Q_v − 3)²/196.85", _AGMA, "m/s")
    value: float = described("K_v", "((A + √(196.85 v))/A)^B, √v_t with v_t in ft/min", _AGMA)


def quality_number(accuracy_grade: int) -> int:
    """AGMA quality number Q_v = 17 − A_v of a transmission accuracy grade A_v.

    A_v and the ISO grades fall with better quality, Q_v rises. AGMA's answer to a request for interpretation of
    2001-D04 lets the accuracy grade of pitch and profile by ANSI/AGMA 2015-1-A01 stand for A_v. That grade has the same
    step √2 and nearly the same tolerances as an ISO 1328-1 grade of the same number, which is therefore used here.
    """
    return 17 - accuracy_grade


def dynamic_factor_agma(velocity: float, quality: int) -> DynamicFactorAGMA | Refused:
    """Dynamic factor by AGMA 2001-D04 at a pitch line velocity v, m/s, from Q_v; see `quality_number` for an ISO grade.

    Refused unless 5 ≤ Q_v ≤ 11 and v ≤ (A + Q_v − 3)²/196.85. 2001-D04 prints K_v = ((A + √v_t)/A)^B and v_t max = (A +
    Q_v − 3)² with v_t in ft/min; 2101-D04 prints, with v in m/s and A_v = 17 − Q_v from 6 to 12, B = 0.25 (A_v −
    5)^(2/3), C = 50 + 56 (1 − B), K_v = ((C + √(196.85 v))/C)^B, v_max = (C + 14 − A_v)²/196.85. Textbooks round 196.85
    to 200, which raises K_v − 1 by less than 1 %.
    """
    if not 5 <= quality <= 11:
        return Refused(
            f"The quality number Q_v must lie in [5, 11], A_v = 17 − Q_v in [6, 12]; Q_v is {quality}. "
            "The standard has no formula for more accurate gears, but a range from 1.02 to 1.11 by judgement."
            if quality > 11 else f"The quality number Q_v must lie in [5, 11]; it is {quality}.")
    exponent = 0.25 * (12 - quality) ** (2 / 3)
    constant = 50 + 56 * (1 - exponent)
    largest = (constant + quality - 3) ** 2 / FEET_PER_MINUTE
    if velocity > largest:
        return Refused(
            f"The pitch line velocity must be at most {largest:.4g} m/s for Q_v = {quality}; it is {velocity:.4g} m/s.")
    value = ((constant + math.sqrt(FEET_PER_MINUTE * velocity)) / constant) ** exponent
    return DynamicFactorAGMA(exponent=exponent, velocity_constant=constant, largest_velocity=largest, value=value)


STANDARD = Standard(
    name="Kv_AGMA", label="AGMA", words="AGMA 2001-D04", result=DynamicFactorAGMA,
    compute=lambda design: dynamic_factor_agma(design.load.velocity, quality_number(design.quality.coarsest)))
