"""Dynamic factor K_v by simple standards: ISO 6336-1 method C, AGMA 2001-D04 and 2101-D04.

K_v is the ratio of the largest tooth force, with its dynamic part, to F_t K_A. Method B of ISO 6336-1 is in
`gearchaos.gears.dynamic_factor_b`. Outside its validity a standard gives no value: the result is `Refused` with the
reason, and its ``value`` is None.

AGMA standards before 2001-C95 defined K_v as the reciprocal, which is below 1; that definition is not offered.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from gearchaos.gears.formulas import described

if TYPE_CHECKING:
    from gearchaos.gears.geometry import Geometry
    from gearchaos.gears.mesh_load import MeshLoad


@dataclass(frozen=True)
class Refused:
    """A dynamic factor that a standard does not give.

    Attributes
    ----------
    method : str
        The standard and its method.
    reason : str
        Why, in a sentence that ends with a full stop.
    """

    method: str
    reason: str
    value: ClassVar[None] = None


METHOD_C = "ISO 6336-1:2006, method C"

_K1 = {
    "spur": {3: 2.1, 4: 3.9, 5: 7.5, 6: 14.9, 7: 26.8, 8: 39.1},
    "helical": {3: 1.9, 4: 3.5, 5: 6.7, 6: 13.3, 7: 23.9, 8: 34.8},
}
"""K1 by accuracy grade, as in IACS UR M56, Table 1.1."""

_K2 = {"spur": 0.0193, "helical": 0.0087}

_K3_VANISHES = 2.071 / 0.357
"""(v z1/100) √(u²/(1 + u²)), m/s, at which K3 is 0."""

_LEAST_LINE_LOAD = 100.0
"""Least F_t K_A/b of method C, N/mm; smaller ones count as this one."""


@dataclass(frozen=True, kw_only=True)
class DynamicFactorC:
    """K_v by method C.

    Attributes
    ----------
    velocity_parameter : float
        (v z1/100) √(u²/(1 + u²)), m/s, where 1 is the pinion and u ≥ 1.
    speed_factor : float
        K3.
    spur, helical : float
        K_vα of a spur and K_vβ of a helical pair with ε_β ≥ 1.
    value : float
        K_v.
    """

    method: ClassVar[str] = METHOD_C
    reason: ClassVar[str] = ""

    velocity_parameter: float = described(
        "v z1/100 √(u²/(1+u²))", "v z1/100 √(u²/(1 + u²))", "ISO 6336-1:2006, 6.5; IACS UR M56, 1.6.3", "m/s")
    speed_factor: float = described(
        "K3", "2 up to 0.2 m/s, else 2.071 − 0.357 v z1/100 √(u²/(1+u²))",
        "ISO 6336-1:2006, 6.5; IACS UR M56, 1.6.3")
    spur: float = described(
        "K_vα", "1 + (K1/(K_A F_t/b) + K2) K3 v z1/100 √(u²/(1+u²))", "ISO 6336-1:2006, 6.5; IACS UR M56, 1.6.3")
    helical: float = described(
        "K_vβ", "1 + (K1/(K_A F_t/b) + K2) K3 v z1/100 √(u²/(1+u²))", "ISO 6336-1:2006, 6.5; IACS UR M56, 1.6.3")
    value: float = described(
        "K_v", "K_vα − ε_β (K_vα − K_vβ), K_vβ from ε_β = 1 on", "ISO 6336-1:2006, 6.5; IACS UR M56, 1.6.3")


def dynamic_factor_c(
    geometry: Geometry, load: MeshLoad, grade: int, *, solid_wheels: bool,
) -> DynamicFactorC | Refused:
    """Dynamic factor by ISO 6336-1:2006, method C, in the form and with the table of IACS UR M56, 1.6.3.

    Parameters
    ----------
    geometry : Geometry
        The gear pair.
    load : MeshLoad
        Its line load and velocity; a line load below 100 N/mm counts as 100 N/mm.
    grade : int
        ISO accuracy grade of the less accurate wheel. ISO 6336-1:2006 refers to ISO 1328-1:1995, IACS UR M56 since 2021
        to ISO 1328-1:2013, with the same numbers.
    solid_wheels : bool
        Whether the wheels are solid discs or have heavy steel rims.

    Returns
    -------
    DynamicFactorC or Refused
        Refused unless 3 ≤ grade ≤ 8 and (v z1/100) √(u²/(1 + u²)) < 10 m/s, the range of the standard, and below 5.8
        m/s, where K3 is positive: K_v would be below 1 beyond. Above 3 m/s also unless z1 < 50,
        β ≤ 30° and the wheels are solid.

    Notes
    -----
    Besides its equation, ISO 6336-1:2006 has diagrams and K1 for grades up to 12. The values beyond grade 8 could
    not be compared with a second source and are not offered. K3 jumps by 0.0004 at 0.2 m/s, as printed.
    """
    pinion, wheel = min(geometry.teeth), max(geometry.teeth)
    ratio = wheel / pinion
    parameter = load.velocity * pinion / 100 * math.sqrt(ratio**2 / (1 + ratio**2))
    reason = _method_c_refusal(geometry, parameter, pinion, grade, solid_wheels)
    if reason:
        return Refused(METHOD_C, reason)
    k3 = 2.0 if parameter <= 0.2 else 2.071 - 0.357 * parameter
    line_load = max(load.line_load / 1e3, _LEAST_LINE_LOAD)
    spur, helical = (1 + (_K1[kind][grade] / line_load + _K2[kind]) * parameter * k3 for kind in ("spur", "helical"))
    value = spur - min(geometry.overlap_ratio, 1.0) * (spur - helical)
    return DynamicFactorC(velocity_parameter=parameter, speed_factor=k3, spur=spur, helical=helical, value=value)


def _method_c_refusal(geometry: Geometry, parameter: float, pinion: int, grade: int, solid_wheels: bool) -> str:
    """Why method C gives no value; empty if it gives one."""
    helix = math.degrees(geometry.helix_angle)
    if grade not in _K1["spur"]:
        return f"K1 is known for accuracy grades 3 to 8; the grade is {grade}."
    if parameter >= 10:
        return f"(v z1/100) √(u²/(1 + u²)) must be below 10 m/s, the subcritical range; it is {parameter:.4g} m/s."
    if parameter >= _K3_VANISHES:
        return (f"From (v z1/100) √(u²/(1 + u²)) = {_K3_VANISHES:.3g} m/s on K3 is negative and K_v would be below 1; "
                f"it is {parameter:.4g} m/s.")
    if parameter < 3:
        return ""
    above = "Where (v z1/100) √(u²/(1 + u²)) is 3 m/s or more,"
    if helix > 30:
        return f"{above} the helix angle must be at most 30°; it is {helix:.4g}°."
    if pinion >= 50:
        return f"{above} the pinion must have fewer than 50 teeth; it has {pinion}."
    return "" if solid_wheels else f"{above} the wheels must be solid discs or have heavy steel rims."


AGMA_METHOD = "ANSI/AGMA 2001-D04"

_AGMA = "ANSI/AGMA 2001-D04 and 2101-D04, clause 8"


@dataclass(frozen=True, kw_only=True)
class DynamicFactorAGMA:
    """K_v by AGMA 2001-D04.

    Attributes
    ----------
    exponent : float
        B.
    velocity_constant : float
        A in the notation with Q_v, C in that with A_v.
    largest_velocity : float
        Largest pitch line velocity for which the standard gives a value, m/s.
    value : float
        K_v.
    """

    method: ClassVar[str] = AGMA_METHOD
    reason: ClassVar[str] = ""

    exponent: float = described("B", "0.25 (12 − Q_v)^(2/3)", _AGMA)
    velocity_constant: float = described("A", "50 + 56 (1 − B)", _AGMA)
    largest_velocity: float = described("v_max", "(A + Q_v − 3)²/200", _AGMA, "m/s")
    value: float = described("K_v", "((A + √(200 v))/A)^B", _AGMA)


def quality_number(accuracy_grade: int) -> int:
    """AGMA quality number Q_v = 17 − A_v of a transmission accuracy grade A_v.

    A_v and the ISO grades fall with better quality, Q_v rises. AGMA's answer to a request for interpretation of
    2001-D04 lets the accuracy grade of pitch and profile by ANSI/AGMA 2015-1-A01 stand for A_v. That grade has the same
    step √2 and nearly the same tolerances as an ISO 1328-1 grade of the same number, which is therefore used here.
    """
    return 17 - accuracy_grade


def dynamic_factor_agma(velocity: float, quality: int) -> DynamicFactorAGMA | Refused:
    """Dynamic factor by AGMA 2001-D04, from the quality number Q_v.

    Parameters
    ----------
    velocity : float
        Pitch line velocity v, m/s.
    quality : int
        Q_v; see `quality_number` for that of an ISO grade.

    Returns
    -------
    DynamicFactorAGMA or Refused
        Refused unless 5 ≤ Q_v ≤ 11 and v ≤ (A + Q_v − 3)²/200.

    Notes
    -----
    In the notation of 2101-D04 with A_v = 17 − Q_v from 6 to 12, B = 0.25 (A_v − 5)^(2/3), C = 50 + 56 (1 − B),
    v_max = (C + 14 − A_v)²/196.85 and K_v = ((C + √(196.85 v))/C)^B. The two differ in the number of ft/min in one m/s
    alone, 196.85, which textbooks round to 200; the rounded number is used here, and raises K_v − 1 by less than 1 %.
    """
    if not 5 <= quality <= 11:
        return Refused(
            AGMA_METHOD, f"The quality number Q_v must lie in [5, 11], A_v = 17 − Q_v in [6, 12]; Q_v is {quality}. "
            "The standard has no formula for more accurate gears, but a range from 1.02 to 1.11 by judgement."
            if quality > 11 else f"The quality number Q_v must lie in [5, 11]; it is {quality}.",
        )
    exponent = 0.25 * (12 - quality) ** (2 / 3)
    constant = 50 + 56 * (1 - exponent)
    largest = (constant + quality - 3) ** 2 / 200
    if velocity > largest:
        return Refused(
            AGMA_METHOD,
            f"The pitch line velocity must be at most {largest:.4g} m/s for Q_v = {quality}; it is {velocity:.4g} m/s.",
        )
    value = ((constant + math.sqrt(200 * velocity)) / constant) ** exponent
    return DynamicFactorAGMA(
        exponent=exponent, velocity_constant=constant, largest_velocity=largest, value=value)
