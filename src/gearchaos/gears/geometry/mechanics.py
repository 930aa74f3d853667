"""Mechanics of a gear pair: materials, masses and moments of inertia of the wheels, and the load of the mesh."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from gearchaos.errors import InputError, unknown_name
from gearchaos.gears.io.fields import Reader, Record, described, number, one, read_by, record
from gearchaos.gears.io.units import DENSITY, PRESSURE, STRESS
from gearchaos.quantities import Rule

if TYPE_CHECKING:
    from gearchaos.gears.geometry.dimensions import Geometry, Pair

_SOURCE = "ISO 6336-1:2006, 4.2"


@dataclass(frozen=True, kw_only=True)
class Material(Record):
    """An isotropic elastic material: modulus of elasticity in Pa, Poisson's ratio, density in kg/m³, and the nominal
    stress that the root of a tooth bears, in N/mm²."""

    E: Any = field(metadata=read_by(one(PRESSURE, between=(1e7, 1.2e12))))
    poisson: float = field(metadata=read_by(number(
        Rule(lambda v: (v >= 0) & (v < 0.5), "must be at least 0 and less than 0.5"))))
    density: Any = field(metadata=read_by(one(DENSITY, between=(100.0, 25e3))))
    root_strength: Any = field(default=None, metadata=read_by(one(STRESS, between=(1.0, 1e4))))


# steel: E and ν of ISO 6336-2:2006, Table 1; density of ISO 6336-1:2006
STEEL = Material(E=206e9, poisson=0.3, density=7830.0)
# The strength is the least tensile strength of the strongest grade, of plastics the yield stress. Metals: E and ν of
# ISO 6336-2:2006, Table 1 (bronze: cast tin bronze; aluminium: EN 1999-1-1:2007, 3.2.5); strength of EN 1563 (900-2),
# EN 1561 (350), EN 1982 (CC483K, centrifugally cast), EN 755-2 (7075-T6). Plastics at 23 °C: E (ISO 527) and strength
# of the data sheets of Hostaform C 9021, Zytel 103HSL, dry and at equilibrium with 50 % humidity, and of usual PLA.
_NAMED = {"steel": STEEL, **{name: Material(E=E * 1e9, poisson=poisson, density=density, root_strength=strength)
                             for name, E, poisson, density, strength in (
    ("nodular cast iron", 173, 0.3, 7100, 900), ("grey cast iron", 118, 0.3, 7200, 350),
    ("bronze", 103, 0.3, 8800, 280), ("aluminium", 70, 0.3, 2700, 540), ("POM", 2.85, 0.35, 1410, 64),
    ("PA66", 1.4, 0.41, 1140, 55), ("PA66 dry", 3.1, 0.41, 1140, 85), ("PLA", 3.5, 0.36, 1240, 60))}}
PLASTIC_MODULUS = 20e9
"""E, Pa, below which a material is taken for a plastic."""


def _read_material(field: str, value: Any) -> Material:
    """The material of a wheel: a name, a `Material`, or a table with its values."""
    if not isinstance(value, str):
        return record(Material, "must be a name or a table with E, poisson and density", "E.g. 'steel'.")(field, value)
    if value not in _NAMED:
        error = unknown_name("material", value, _NAMED)
        table = "Another material is a table: material = { E = '3 GPa', poisson = 0.4, density = '1300 kg/m^3' }."
        raise InputError(error.field, error.rule, value, f"{error.advice} {table}".lstrip())
    return _NAMED[value]


read_material = Reader(_read_material, names=tuple(_NAMED))


def disc_diameter(geometry: Geometry) -> Pair:
    """d_m = (d_a + d_f)/2, m: outer diameter of the disc that replaces each toothed wheel, ISO 6336-1:2006 (30)."""
    (tip1, tip2), (root1, root2) = geometry.tip_diameter, geometry.root_diameter
    return (tip1 + root1) / 2, (tip2 + root2) / 2


def disc_mass(diameter: float, bore: float, width: float, density: float) -> float:
    return math.pi / 4 * density * width * (diameter**2 - bore**2)


def disc_inertia(diameter: float, bore: float, mass: float) -> float:
    """Moment of inertia of a disc with a bore about its axis, kg m²: J = m (d² + d_i²)/8."""
    return mass * (diameter**2 + bore**2) / 8


def equivalent_mass(inertias: Pair, base_radii: Pair) -> float:
    """I1 I2/(I1 R2² + I2 R1²), kg, (2.9): along the line of action; b m_red of ISO 6336-1:2006 (30)."""
    (inertia1, inertia2), (radius1, radius2) = inertias, base_radii
    return inertia1 * inertia2 / (inertia1 * radius2**2 + inertia2 * radius1**2)


@dataclass(frozen=True, kw_only=True)
class MeshLoad:
    """Nominal load and speed of the mesh, referred to the reference circles, in SI; b is the common face width."""

    tangential_force: float = described("F_t", "2000 T1/d1", _SOURCE, "N")
    line_load: float = described("F_t K_A/b", "F_t K_A/b", _SOURCE, "N/mm", 1e-3)
    velocity: float = described("v", "d1 ω1/2000", _SOURCE, "m/s")


def mesh_load(geometry: Geometry, speed: float, torque: float, application_factor: float) -> MeshLoad:
    """The load of a mesh from the angular velocity, rad/s, and the torque, N m, of wheel 1: their magnitudes matter.
    K_A, greater than 0, is the ratio of the largest external load to the nominal one; 1 for a uniform load.
    """
    for name, value in (("speed", speed), ("torque", torque), ("application_factor", application_factor)):
        if not math.isfinite(value):
            raise InputError(name, "must be a finite number", value)
    if application_factor <= 0:
        advice = "Use 1 for a uniform load."
        raise InputError("application_factor", "must be greater than 0", application_factor, advice)
    diameter = geometry.reference_diameter[0]
    force = 2 * abs(torque) / diameter
    return MeshLoad(tangential_force=force, line_load=force * application_factor / geometry.common_face_width,
                    velocity=abs(speed) * diameter / 2)
