"""Masses and moments of inertia of the wheels, and the equivalent mass of the pair along the line of action."""

from __future__ import annotations

import math

from gearchaos.gears.geometry.dimensions import Geometry, Pair


def disc_diameter(geometry: Geometry) -> Pair:
    """d_m = (d_a + d_f)/2, m: outer diameter of the disc that replaces each toothed wheel, ISO 6336-1:2006 (30)."""
    (tip1, tip2), (root1, root2) = geometry.tip_diameter, geometry.root_diameter
    return (tip1 + root1) / 2, (tip2 + root2) / 2


def disc_mass(diameter: float, bore: float, width: float, density: float) -> float:
    """Mass of a disc with a bore, kg."""
    return math.pi / 4 * density * width * (diameter**2 - bore**2)


def disc_inertia(diameter: float, bore: float, mass: float) -> float:
    """Moment of inertia of a disc with a bore about its axis, kg m²: J = m (d² + d_i²)/8."""
    return mass * (diameter**2 + bore**2) / 8


def equivalent_mass(inertias: Pair, base_radii: Pair) -> float:
    """I1 I2/(I1 R2² + I2 R1²), kg: the mass of the pair along the line of action, (2.9).

    Over the face width it is the reduced mass m_red per face width of ISO 6336-1:2006 (30).
    """
    (inertia1, inertia2), (radius1, radius2) = inertias, base_radii
    return inertia1 * inertia2 / (inertia1 * radius2**2 + inertia2 * radius1**2)
