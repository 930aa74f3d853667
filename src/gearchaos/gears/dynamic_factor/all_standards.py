"""The dynamic factors of a `GearDesign` by all standards.

The dynamic factor K_v is the ratio of the largest tooth force, with its dynamic part, to F_t K_A.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from gearchaos.errors import InputError
from gearchaos.gears.dynamic_factor.agma import AGMA_METHOD, DynamicFactorAGMA, dynamic_factor_agma, quality_number
from gearchaos.gears.dynamic_factor.iso_method_b import (
    METHOD_B,
    DynamicFactorB,
    FlankMaterial,
    deviations,
    dynamic_factor_b,
)
from gearchaos.gears.dynamic_factor.iso_method_c import METHOD_C, DynamicFactorC, dynamic_factor_c
from gearchaos.gears.dynamic_factor.refused import Refused
from gearchaos.gears.stiffness.iso6336 import tooth_stiffness
from gearchaos.gears.transmission_error.quality import tolerances
from gearchaos.gears.units import RPM

if TYPE_CHECKING:
    from gearchaos.gears.design.gear_design import GearDesign


@dataclass(frozen=True, kw_only=True)
class DynamicFactors:
    """Dynamic factors of a pair; each has a ``value``, which is None with a ``reason`` where it is `Refused`.

    Attributes
    ----------
    iso_b, iso_c : DynamicFactorB or DynamicFactorC or Refused
        By ISO 6336-1:2006, methods B and C.
    agma : DynamicFactorAGMA or Refused
        By ANSI/AGMA 2001-D04.
    """

    iso_b: DynamicFactorB | Refused
    iso_c: DynamicFactorC | Refused
    agma: DynamicFactorAGMA | Refused


def dynamic_factors(
    design: GearDesign, flanks: tuple[FlankMaterial, FlankMaterial] | None = None,
) -> DynamicFactors:
    """The dynamic factors of a gear pair at its speed and torque.

    Parameters
    ----------
    design : GearDesign
        Its wheels count as solid discs, also where their inertias are given.
    flanks : tuple of FlankMaterial, optional
        For running-in in method B; left out, running-in removes nothing.

    Returns
    -------
    DynamicFactors
        A factor is `Refused` where an input that it needs was left out of the design, and outside its validity.
    """
    missing = [name for name in ("quality", "speed", "torque") if getattr(design, name) is None]
    if missing:
        reason = f"The design gives no {' and no '.join(missing)}."
        return DynamicFactors(
            iso_b=Refused(METHOD_B, reason), iso_c=Refused(METHOD_C, reason), agma=Refused(AGMA_METHOD, reason))
    grade = design.quality.coarsest
    return DynamicFactors(
        iso_b=_method_b(design, flanks),
        iso_c=dynamic_factor_c(design.geometry, design.load, grade, solid_wheels=True),
        agma=dynamic_factor_agma(design.load.velocity, quality_number(grade)),
    )


def _method_b(
    design: GearDesign, flanks: tuple[FlankMaterial, FlankMaterial] | None,
) -> DynamicFactorB | Refused:
    """Method B of a design with quality, speed and torque."""
    geometry, load, quality = design.geometry, design.load, design.quality
    if load.line_load == 0:
        return Refused(METHOD_B, "Without load there is no ratio of forces.")
    relief = None if design.tip_relief is None else design.tip_relief.amount
    first, second = design.material
    try:
        stiffness = tooth_stiffness(geometry, line_load=load.line_load, youngs_modulus=(first.E, second.E))
        mass = design.equivalent_mass / geometry.common_face_width
        limits = tolerances(quality, geometry)
    except InputError as error:
        return Refused(METHOD_B, str(error))
    given = deviations(
        geometry, limits, quality.coarsest, velocity=load.velocity, tip_relief=relief, flanks=flanks)
    return dynamic_factor_b(geometry, load, design.speed * RPM, stiffness, mass, given)
