"""Main resonance of a gear pair by ISO 6336-1:2006, 6.4.2 and 6.4.8: reduced mass, resonance speed, ratio N, ranges."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING

from gearchaos.errors import InputError
from gearchaos.gears.formulas import described

if TYPE_CHECKING:
    from gearchaos.gears.geometry import Geometry

RPM = 30 / math.pi
"""One rad/s in revolutions per minute."""

MAIN_END, SUPERCRITICAL_START = 1.15, 1.5
"""Resonance ratios N where main resonance ends and the supercritical range begins; ISO 6336-1:2006, 6.4.2."""

_CLAUSE = "ISO 6336-1:2006, 6.4.2"


class SpeedRange(Enum):
    """Range of the speed relative to the main resonance."""

    SUBCRITICAL = "subcritical"
    MAIN_RESONANCE = "main resonance"
    INTERMEDIATE = "intermediate"
    SUPERCRITICAL = "supercritical"


@dataclass(frozen=True, kw_only=True)
class Resonance:
    """Main resonance of the mesh in terms of the speed of wheel 1, in rad/s.

    Attributes
    ----------
    reduced_mass : float
        m_red, equivalent mass of the pair along the line of action per unit face width, kg/m.
    resonance_speed : float
        Speed of wheel 1 at which the mesh frequency equals the natural frequency of the mesh, n_E1.
    lower_limit_ratio : float
        N_S, resonance ratio where the main resonance range begins.
    main_start, main_end, supercritical_start : float
        Speeds of wheel 1 at N = N_S, 1.15 and 1.5.
    """

    reduced_mass: float = described("m_red", "J1* J2*/(J1* r_b2² + J2* r_b1²)", f"{_CLAUSE}, (7)", "kg/mm", 1e-3)
    resonance_speed: float = described("n_E1", "30000/(π z1) √(c_γα/m_red)", f"{_CLAUSE}, (6)", "rpm", RPM)
    lower_limit_ratio: float = described(
        "N_S", "0.85, or 0.5 + 0.35 √(F_t K_A/(100 b)) below 100 N/mm", f"{_CLAUSE}, (11), (12)")
    main_start: float = described("", "N_S n_E1", _CLAUSE, "rpm", RPM)
    main_end: float = described("", "1.15 n_E1", _CLAUSE, "rpm", RPM)
    supercritical_start: float = described("", "1.5 n_E1", _CLAUSE, "rpm", RPM)

    def ratio(self, speed: float) -> float:
        """Resonance ratio N = n1/n_E1, (9), at a speed of wheel 1 in rad/s."""
        return abs(speed) / self.resonance_speed

    def range_at(self, speed: float) -> SpeedRange:
        """The range in which a speed of wheel 1 (rad/s) lies."""
        ratio = self.ratio(speed)
        if ratio <= self.lower_limit_ratio:
            return SpeedRange.SUBCRITICAL
        if ratio <= MAIN_END:
            return SpeedRange.MAIN_RESONANCE
        return SpeedRange.INTERMEDIATE if ratio < SUPERCRITICAL_START else SpeedRange.SUPERCRITICAL


def resonance(teeth1: int, mesh_stiffness: float, reduced_mass: float, line_load: float) -> Resonance:
    """Main resonance of the mesh, ISO 6336-1:2006, 6.4.2.

    Parameters
    ----------
    teeth1 : int
        Number of teeth of wheel 1.
    mesh_stiffness : float
        c_γα, N/m².
    reduced_mass : float
        m_red, kg/m; see `reduced_mass_of_discs` and `reduced_mass_of_inertias`.
    line_load : float
        F_t K_A/b, N/m, on which N_S depends.
    """
    speed = math.sqrt(mesh_stiffness / reduced_mass) / teeth1
    lower = 0.5 + 0.35 * math.sqrt(min(line_load / 100e3, 1.0))
    return Resonance(
        reduced_mass=reduced_mass, resonance_speed=speed, lower_limit_ratio=lower, main_start=lower * speed,
        main_end=MAIN_END * speed, supercritical_start=SUPERCRITICAL_START * speed,
    )


def reduced_mass_of_discs(
    geometry: Geometry, densities: tuple[float, float], inner_diameters: tuple[float, float] = (0.0, 0.0),
) -> float:
    """m_red of two discs or rims, kg/m; ISO 6336-1:2006, 6.4.8, (30)-(32).

    A wheel counts as a ring from ``inner_diameters`` to the mean diameter d_m = (d_a + d_f)/2, so that
    m* = (π/8) (d_m²/d_b)² ρ (1 − q⁴) with q = d_i/d_m. Webs and hubs inside the ring are neglected.

    Parameters
    ----------
    geometry : Geometry
        Gives the tip, root and base diameters.
    densities : tuple of float
        ρ of each wheel, kg/m³.
    inner_diameters : tuple of float
        d_i of each wheel, m: the inner diameter of the rim, or the bore of a disc. 0, the default, is a solid disc.

    Raises
    ------
    InputError
        If an inner diameter is negative or reaches the root circle.

    Notes
    -----
    (30) is written with d_m1/d_b1 for both wheels. Here each wheel has its own ratio, which differs where the profile
    shifts differ. (32) as printed has d_i1 for both wheels; each wheel's own is meant.
    """
    masses = []
    for i, (density, inner) in enumerate(zip(densities, inner_diameters, strict=True)):
        if not 0 <= inner < geometry.root_diameter[i]:
            rule = f"must be at least 0 and below the root diameter {geometry.root_diameter[i]:.6g} m"
            raise InputError(f"bore[{i}]", rule, inner)
        mean = (geometry.tip_diameter[i] + geometry.root_diameter[i]) / 2
        base = geometry.base_diameter[i]
        masses.append(math.pi / 8 * density * (mean**2 / base) ** 2 * (1 - (inner / mean) ** 4))
    return masses[0] * masses[1] / (masses[0] + masses[1])


def reduced_mass_of_inertias(geometry: Geometry, inertias: tuple[float, float]) -> float:
    """m_red from the moments of inertia (kg m²) of the whole wheels, kg/m; ISO 6336-1:2006, 6.4.2, (7), (8).

    The inertias are divided by the common face width, to which c_γα refers.
    """
    equivalent = [inertia / (d / 2) ** 2 for inertia, d in zip(inertias, geometry.base_diameter, strict=True)]
    return equivalent[0] * equivalent[1] / (equivalent[0] + equivalent[1]) / geometry.common_face_width
