"""Dynamic factor K_v by ISO 6336-1:2006, method B (clause 6.4; clause 6.5 in the edition of 2019): a mass on a spring.

It follows from N = n1/n_E1 and from three parameters of the deviations, B_p, B_f and B_k, with C_v1 to C_v7.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, NamedTuple

from gearchaos.errors import InputError
from gearchaos.gears.dynamic_factor import Refused, Standard, velocity_parameter
from gearchaos.gears.dynamic_factor.main_resonance import (
    MAIN_END,
    SUPERCRITICAL_START,
    Resonance,
    ResonanceRange,
    resonance,
)
from gearchaos.gears.io.fields import described
from gearchaos.gears.io.units import RPM
from gearchaos.gears.transmission_error import tolerances

if TYPE_CHECKING:
    from gearchaos.gears.design.gear_design import GearDesign
    from gearchaos.gears.geometry.dimensions import Geometry
    from gearchaos.gears.geometry.mechanics import MeshLoad
    from gearchaos.gears.stiffness.iso6336 import ToothStiffness
    from gearchaos.gears.transmission_error import Tolerances

_CLAUSE = "ISO 6336-1:2006, 6.4"
_LEAST_GRADE_WITHOUT_RELIEF = 6  # from this grade on, tip relief has no effect in method B: B_k = 1


@dataclass(frozen=True)
class FlankMaterial:
    """What running-in depends on.

    The group is "through hardened" (St, V, GGG perlitic or bainitic, GTS), "cast iron" (GG, GGG ferritic) or "surface
    hardened" (Eh, IF, NT, NV); the limit σ_Hlim, the allowable stress number for contact stress, Pa; ISO 6336-5.
    """

    group: str
    contact_limit: float

    def __post_init__(self) -> None:
        if self.group not in _RUNNING_IN:
            raise InputError("flank.group", f"must be one of {', '.join(_RUNNING_IN)}", self.group)
        if not 0 < self.contact_limit < math.inf:
            raise InputError("flank.contact_limit", "must be a positive finite number", self.contact_limit)


# share of a deviation that running-in removes, and its largest values in µm for v up to 5 m/s, 10 m/s, and above; ISO
# 6336-1:2006, 8.3.5.1. Of through hardened steel all are divided by σ_Hlim in N/mm².
_RUNNING_IN = {
    "through hardened": (160.0, (math.inf, 12800.0, 6400.0)), "cast iron": (0.275, (math.inf, 22.0, 11.0)),
    "surface hardened": (0.075, (3.0, 3.0, 3.0))}


def running_in_allowance(deviation: float, material: FlankMaterial, velocity: float) -> float:
    """y_α of one wheel, m; ISO 6336-1:2006, 8.3.5.1. With f_pb it is y_p, with f_fα y_f; the velocity is in m/s."""
    share, limits = _RUNNING_IN[material.group]
    divisor = material.contact_limit / 1e6 if material.group == "through hardened" else 1.0
    limit = limits[0 if velocity <= 5 else 1 if velocity <= 10 else 2]
    return min(share / divisor * deviation, limit / divisor * 1e-6, deviation)


def relief_from_running_in(material: FlankMaterial) -> float:
    """C_ay = (σ_Hlim/97 − 18.45)²/18 + 1.5 µm, in m: tip relief that running-in produces; ISO 6336-1:2006, Table 4."""
    return ((material.contact_limit / 1e6 / 97 - 18.45) ** 2 / 18 + 1.5) * 1e-6


@dataclass(frozen=True, kw_only=True)
class Deviations:
    """Deviations of a pair in method B, m, less what running-in removes; tip relief does not count from some grade on.
    """

    base_pitch: float = described("f_pb", "max f_pt cos α_t", f"{_CLAUSE}.3", "µm", 1e6)
    profile_form: float = described("f_fα", "max f_fα", f"{_CLAUSE}.3", "µm", 1e6)
    base_pitch_allowance: float = described("y_p", "y_α of f_pb", "ISO 6336-1:2006, 8.3.5.1", "µm", 1e6)
    profile_allowance: float = described("y_f", "y_α of f_fα", "ISO 6336-1:2006, 8.3.5.1", "µm", 1e6)
    tip_relief: float = described("C_a", "given, or C_ay = (σ_Hlim/97 − 18.45)²/18 + 1.5", f"{_CLAUSE}.3", "µm", 1e6)
    relief_counts: bool = True


def deviations(
    geometry: Geometry, limits: tuple[Tolerances, Tolerances], grade: int, *, velocity: float = 0.0,
    tip_relief: tuple[float, float] | None = None, flanks: tuple[FlankMaterial, FlankMaterial] | None = None,
) -> Deviations:
    """The deviations of a pair for method B, ISO 6336-1:2006, 6.4.3.

    Of both wheels the larger f_pt and f_fα count, which are usually those of the larger wheel. The grade is that of the
    less accurate wheel; from 6 on tip relief does not count. The limits of running-in depend on the velocity, m/s.
    ``tip_relief`` is C_a of each wheel, m, of which the mean counts. Left out, it is C_ay of the flanks, or none where
    these are not given. Without flanks running-in removes nothing, y_p = y_f = 0, which raises K_v.
    """
    base_pitch = max(t.single_pitch for t in limits) * math.cos(geometry.transverse_pressure_angle)
    form = max(t.profile_form for t in limits)
    relief, allowances = tip_relief or (0.0, 0.0), (0.0, 0.0)
    if flanks is not None:
        pitch, profile = (
            sum(running_in_allowance(f, flank, velocity) for flank in flanks) / 2 for f in (base_pitch, form))
        allowances = (pitch, profile)
        relief = tip_relief or (relief_from_running_in(flanks[0]), relief_from_running_in(flanks[1]))
    return Deviations(
        base_pitch=base_pitch, profile_form=form, base_pitch_allowance=allowances[0], profile_allowance=allowances[1],
        tip_relief=sum(relief) / 2, relief_counts=grade < _LEAST_GRADE_WITHOUT_RELIEF)


class Constants(NamedTuple):
    """C_v1 to C_v7, ISO 6336-1:2006, Table 4."""

    C_v1: float
    C_v2: float
    C_v3: float
    C_v4: float
    C_v5: float
    C_v6: float
    C_v7: float


def constants(total_contact_ratio: float) -> Constants:
    """C_v1 to C_v7 for ε_γ > 1, ISO 6336-1:2006, Table 4. As printed, C_v2, C_v3, C_v4 and C_v6 jump at ε_γ = 2."""
    eps = total_contact_ratio
    seventh = 0.125 * math.sin(math.pi * (min(max(eps, 1.5), 2.5) - 2)) + 0.875
    if eps <= 2:
        return Constants(0.32, 0.34, 0.23, 0.90, 0.47, 0.47, seventh)
    return Constants(
        0.32, 0.57 / (eps - 0.3), 0.096 / (eps - 1.56), (0.57 - 0.05 * eps) / (eps - 1.44), 0.47, 0.12 / (eps - 1.74),
        seventh)


@dataclass(frozen=True, kw_only=True)
class DynamicFactorB:
    """K_v by method B with all that it is computed from, and what the standard says of this range and load."""

    reason: ClassVar[str] = ""

    resonance: Resonance
    constants: Constants
    speed_range: ResonanceRange
    resonance_ratio: float = described("N", "n1/n_E1", f"{_CLAUSE}.2, (9)")
    pitch_parameter: float = described("B_p", "c′ (f_pb − y_p)/(K_A F_t/b)", f"{_CLAUSE}.3, (15), (18)")
    profile_parameter: float = described("B_f", "c′ (f_fα − y_f)/(K_A F_t/b)", f"{_CLAUSE}.3, (16), (19)")
    relief_parameter: float = described("B_k", "|1 − c′ C_a/(K_A F_t/b)|, or 1 from grade 6 on", f"{_CLAUSE}.3, (17)")
    value: float = described(
        "K_v", "N (C_v1 B_p + C_v2 B_f + C_v3 B_k) + 1 below the main resonance", f"{_CLAUSE}.3 to 6.4.6, (13)-(22)")
    warnings: tuple[str, ...] = ()


def dynamic_factor_b(
    geometry: Geometry, load: MeshLoad, speed: float, stiffness: ToothStiffness, reduced_mass: float, given: Deviations,
) -> DynamicFactorB | Refused:
    """Dynamic factor by ISO 6336-1:2006, method B, at an angular velocity of wheel 1 in rad/s; m_red is in kg/m.

    The stiffness is c′ and c_γα at the line load. Refused without load, and for a total contact ratio of 1 or below.
    K_v is continuous at N = 1.15 and 1.5. At N = N_S it jumps, as the standard has it. In the supercritical range (21)
    may be below 1, as printed. All equations were compared with two public codes; the remarks on the ranges and on
    loads below 50 N/mm could be compared with one source only.
    """
    if load.line_load == 0:
        return Refused("Without load there is no ratio of forces.")
    if geometry.total_contact_ratio <= 1:
        return Refused(f"The total contact ratio must be above 1; it is {geometry.total_contact_ratio:.4g}.")
    found = resonance(geometry.teeth[0], stiffness.mesh_stiffness, reduced_mass, load.line_load)
    per_length = stiffness.single_stiffness / load.line_load
    pitch = per_length * (given.base_pitch - given.base_pitch_allowance)
    profile = per_length * (given.profile_form - given.profile_allowance)
    relief = abs(1 - per_length * given.tip_relief) if given.relief_counts else 1.0
    c, ratio, where = constants(geometry.total_contact_ratio), found.ratio(speed), found.range_at(speed)
    deviation, above = c.C_v1 * pitch + c.C_v2 * profile, c.C_v5 * pitch + c.C_v6 * profile + c.C_v7
    main = deviation + c.C_v4 * relief + 1
    value = {
        ResonanceRange.SUBCRITICAL: ratio * (deviation + c.C_v3 * relief) + 1,  # (13), (14)
        ResonanceRange.MAIN_RESONANCE: main,  # (20)
        ResonanceRange.INTERMEDIATE: above + (main - above) * (SUPERCRITICAL_START - ratio) / (
            SUPERCRITICAL_START - MAIN_END),  # (22)
        ResonanceRange.SUPERCRITICAL: above}[where]  # (21)
    remarks = {
        "Below 50 N/mm there is a danger of vibration with separation of the flanks, which K_v does not cover":
            load.line_load < 50e3,
        "Operation in the main resonance range should be avoided; the true K_v may differ by up to 40 %":
            where is ResonanceRange.MAIN_RESONANCE,
        "In the intermediate range the standard recommends a refined analysis, method A":
            where is ResonanceRange.INTERMEDIATE,
        "Below (v z1/100) √(u²/(1 + u²)) = 3 m/s method B is outside the range recommended in 6.3.2; see method C":
            velocity_parameter(geometry, load.velocity) < 3}
    return DynamicFactorB(resonance=found, constants=c, speed_range=where, resonance_ratio=ratio, pitch_parameter=pitch,
                          profile_parameter=profile, relief_parameter=relief, value=value,
                          warnings=tuple(text for text, holds in remarks.items() if holds))


def of_design(
    design: GearDesign, flanks: tuple[FlankMaterial, FlankMaterial] | None = None,
) -> DynamicFactorB | Refused:
    """`dynamic_factor_b` of a design with quality, speed and torque; without ``flanks`` running-in removes nothing."""
    geometry, load, quality = design.geometry, design.load, design.quality
    if load.line_load == 0:
        return Refused("Without load there is no ratio of forces.")
    try:
        stiffness = design.tooth_stiffness
        mass = design.equivalent_mass / geometry.common_face_width
        limits = tolerances(quality, geometry)
    except InputError as error:
        return Refused(str(error))
    relief = None if design.tip_relief is None else design.tip_relief.amount
    given = deviations(geometry, limits, quality.coarsest, velocity=load.velocity, tip_relief=relief, flanks=flanks)
    return dynamic_factor_b(geometry, load, design.speed * RPM, stiffness, mass, given)


STANDARD = Standard(
    name="Kv_ISO_B", label="ISO method B", words="ISO 6336-1, method B", result=DynamicFactorB, compute=of_design,
    beside={"resonance_ratio_ISO_B": "resonance_ratio",
            **{name: name for name in ("pitch_parameter", "profile_parameter", "relief_parameter")}})
