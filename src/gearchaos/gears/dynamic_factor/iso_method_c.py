"""Dynamic factor K_v by ISO 6336-1:2006, method C."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from gearchaos.gears.dynamic_factor import Refused, Standard, velocity_parameter
from gearchaos.gears.io.fields import described

if TYPE_CHECKING:
    from gearchaos.gears.geometry.dimensions import Geometry
    from gearchaos.gears.geometry.mechanics import MeshLoad

_CLAUSE = "ISO 6336-1:2006, 6.5; IACS UR M56, 1.6.3"
# K1 by accuracy grade, as in IACS UR M56, Table 1.1
_K1 = {
    "spur": {3: 2.1, 4: 3.9, 5: 7.5, 6: 14.9, 7: 26.8, 8: 39.1},
    "helical": {3: 1.9, 4: 3.5, 5: 6.7, 6: 13.3, 7: 23.9, 8: 34.8}}
_K2 = {"spur": 0.0193, "helical": 0.0087}
_K3_VANISHES = 2.071 / 0.357  # (v z1/100) √(u²/(1 + u²)), m/s, at which K3 is 0
_LEAST_LINE_LOAD = 100.0  # least F_t K_A/b of method C, N/mm; smaller ones count as this one


@dataclass(frozen=True, kw_only=True)
class DynamicFactorC:
    """K_v by method C, velocities in m/s, where 1 is the pinion, u ≥ 1: of spur pairs, of helical ones with ε_β ≥ 1."""

    reason: ClassVar[str] = ""

    velocity_parameter: float = described("v z1/100 √(u²/(1+u²))", "v z1/100 √(u²/(1 + u²))", _CLAUSE, "m/s")
    speed_factor: float = described("K3", "2 up to 0.2 m/s, else 2.071 − 0.357 v z1/100 √(u²/(1+u²))", _CLAUSE)
    spur: float = described("K_vα", "1 + (K1/(K_A F_t/b) + K2) K3 v z1/100 √(u²/(1+u²))", _CLAUSE)
    helical: float = described("K_vβ", "1 + (K1/(K_A F_t/b) + K2) K3 v z1/100 √(u²/(1+u²))", _CLAUSE)
    value: float = described("K_v", "K_vα − ε_β (K_vα − K_vβ), K_vβ from ε_β = 1 on", _CLAUSE)


def dynamic_factor_c(geometry: Geometry, load: MeshLoad, grade: int, *, solid_wheels: bool) -> DynamicFactorC | Refused:
    """Dynamic factor by ISO 6336-1:2006, method C, in the form and with the table of IACS UR M56, 1.6.3.

    A line load below 100 N/mm counts as 100 N/mm. The grade is that of the less accurate wheel. ISO 6336-1:2006 refers
    to ISO 1328-1:1995, IACS UR M56 since 2021 to ISO 1328-1:2013, with the same numbers. Solid discs count as solid
    wheels, and so do heavy steel rims.

    Refused unless 3 ≤ grade ≤ 8 and (v z1/100) √(u²/(1 + u²)) < 10 m/s, the range of the standard, and below 5.8 m/s,
    where K3 is positive: K_v would be below 1 beyond. Above 3 m/s also unless z1 < 50, β ≤ 30° and the wheels are
    solid.

    Besides its equation, ISO 6336-1:2006 has diagrams and K1 for grades up to 12. The values beyond grade 8 could not
    be compared with a second source and are not offered. K3 jumps by 0.0004 at 0.2 m/s, as printed.
    """
    parameter = velocity_parameter(geometry, load.velocity)
    above, fast = "Where (v z1/100) √(u²/(1 + u²)) is 3 m/s or more,", parameter >= 3
    helix, pinion = math.degrees(geometry.helix_angle), min(geometry.teeth)
    refusals = {
        f"K1 is known for accuracy grades 3 to 8; the grade is {grade}.": grade not in _K1["spur"],
        f"(v z1/100) √(u²/(1 + u²)) must be below 10 m/s, the subcritical range; it is {parameter:.4g} m/s.":
            parameter >= 10,
        f"From (v z1/100) √(u²/(1 + u²)) = {_K3_VANISHES:.3g} m/s on K3 is negative and K_v would be below 1; it is "
        f"{parameter:.4g} m/s.": parameter >= _K3_VANISHES,
        f"{above} the helix angle must be at most 30°; it is {helix:.4g}°.": fast and helix > 30,
        f"{above} the pinion must have fewer than 50 teeth; it has {pinion}.": fast and pinion >= 50,
        f"{above} the wheels must be solid discs or have heavy steel rims.": fast and not solid_wheels}
    if reason := next((text for text, holds in refusals.items() if holds), ""):
        return Refused(reason)
    k3 = 2.0 if parameter <= 0.2 else 2.071 - 0.357 * parameter
    line_load = max(load.line_load / 1e3, _LEAST_LINE_LOAD)
    spur, helical = (1 + (_K1[kind][grade] / line_load + _K2[kind]) * parameter * k3 for kind in ("spur", "helical"))
    value = spur - min(geometry.overlap_ratio, 1.0) * (spur - helical)
    return DynamicFactorC(velocity_parameter=parameter, speed_factor=k3, spur=spur, helical=helical, value=value)


# the wheels of a design count as solid discs unless it has a blank, also where their inertias are given
STANDARD = Standard(
    name="Kv_ISO_C", label="ISO method C", words="ISO 6336-1, method C", result=DynamicFactorC,
    compute=lambda design: dynamic_factor_c(
        design.geometry, design.load, design.quality.coarsest, solid_wheels=not any(design.blanks)))
