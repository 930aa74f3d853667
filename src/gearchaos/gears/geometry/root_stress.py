"""Nominal tooth root stress, ISO 6336-3:2006, method B: that of a static load on teeth without error. That of a ring,
whose root is that of its cutter, is left out.

The tooth is a beam, cut where tangents at 30° to its axis touch the fillets, and bent by the whole force of the mesh at
the outer point of single pair contact. Factors of load, life, size and surface are those of a rating and no part of it;
neither are the rim thickness factor Y_B and the deep tooth factor Y_DT, which are 1 here.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

from gearchaos.errors import InputError
from gearchaos.gears.geometry.dimensions import Geometry
from gearchaos.gears.geometry.tooth_root import involute
from gearchaos.gears.io.fields import Formula, described

NOTCHES = 1.0, 8.0  # notch parameters for which Y_S is given, below the second one; ISO 6336-3:2006, 7.2
LARGEST_OVERLAP, LARGEST_HELIX = 1.0, math.radians(30)  # beyond which ε_β and β count as these in Y_β; 8.2
_FIRST_ANGLE = math.pi / 6  # from which θ is iterated
_MOST_STEPS, _SAME_ANGLE = 100, 1e-12  # of Newton's method, which ends after a few
_CLAUSE = "ISO 6336-3:2006"


class RootSection(NamedTuple):
    """The critical section of a tooth of the virtual spur gear, over the normal module, and the load on it."""

    chord: float  # s_Fn/m_n
    lever: float  # h_Fe/m_n, of the bending moment for load at the outer point of single pair contact
    fillet_radius: float  # ρ_F/m_n, at the critical section
    load_angle: float  # α_Fen, rad

    @property
    def notch(self) -> float:
        """q_s, the notch parameter."""
        return self.chord / (2 * self.fillet_radius)


@dataclass(frozen=True, kw_only=True)
class RootFactors:
    """Factors of the nominal root stress, of both wheels or the pinion of an internal pair, whatever the load."""

    root_form_factor: tuple[float, ...] = described(
        "Y_F", "6 (h_Fe/m_n) cos α_Fen/((s_Fn/m_n)² cos α_n)", f"{_CLAUSE}, 6.2",
        words="form factor of the root, load at the outer point of single pair contact; above a contact ratio of 2 an "
              "assumption: the whole force there")
    root_stress_correction: tuple[float, ...] = described(
        "Y_S", "(1.2 + 0.13 L) q_s^(1/(1.21 + 2.3/L)), L = s_Fn/h_Fe, q_s = s_Fn/(2 ρ_F)", f"{_CLAUSE}, 7.2",
        words="stress correction factor of the root")
    root_helix_factor: float = described(
        "Y_β", "1 − ε_β β/120°, ε_β at most 1, β at most 30°", f"{_CLAUSE}, 8.2",
        words="helix angle factor of the root")


ROOT_STRESS = Formula(
    "σ_F0", "N/mm²", 1e-6, "F_t/(b m_n) Y_F Y_S Y_β, b the common face width; nominal, at the static load: no factors "
    "of load, life, size or surface, and Y_B = Y_DT = 1", f"{_CLAUSE}, 5.2, method B",
    words="nominal tooth root stress")


def root_section(geometry: Geometry, wheel: int) -> RootSection:
    """The critical section of a tooth of one wheel, 0 or 1, and its load.

    Raises `InputError` for a tooth that has no such section, or whose notch is outside the range of the standard.
    """
    z, alpha, x = geometry.virtual_teeth[wheel], geometry.pressure_angle, geometry.profile_shift[wheel]
    rounding, depth = geometry.root_radius, geometry.dedendum
    width = math.pi / 4 - depth * math.tan(alpha) - (1 - math.sin(alpha)) * rounding / math.cos(alpha)  # E/m_n
    below = rounding - depth + x  # G
    turn = 2 / z * (math.pi / 2 - width) - math.pi / 3  # H
    theta = _tangent_angle(geometry, 2 * below / z, turn)
    centre = below / math.cos(theta) - rounding
    chord = z * math.sin(math.pi / 3 - theta) + math.sqrt(3) * centre
    radius = rounding + 2 * below**2 / (math.cos(theta) * (z * math.cos(theta) ** 2 - 2 * below))
    # the load at the outer point of single pair contact of the virtual gear
    base, pitch = z * math.cos(alpha), math.pi * math.cos(alpha)  # d_bn/m_n, π d cos β cos α_n/(z m_n)
    tip = z + (geometry.tip_diameter[wheel] - geometry.reference_diameter[wheel]) / geometry.normal_module
    ratio = geometry.contact_ratio / math.cos(geometry.base_helix_angle) ** 2  # ε_αn
    along = math.sqrt((tip - base) * (tip + base)) / 2 - pitch * (ratio - 1)
    angle = math.atan2(2 * along, base)  # α_en
    gamma = (math.pi / 2 + 2 * x * math.tan(alpha)) / z + involute(alpha) - involute(angle)  # γ_e
    load_angle, diameter = angle - gamma, 2 * math.hypot(along, base / 2)  # α_Fen, d_en/m_n
    lever = ((math.cos(gamma) - math.sin(gamma) * math.tan(load_angle)) * diameter
             - z * math.cos(math.pi / 3 - theta) - centre) / 2
    found = RootSection(chord, lever, radius, load_angle)
    if not NOTCHES[0] <= found.notch < NOTCHES[1]:
        blunt = found.notch < NOTCHES[0]
        least = f"Without undercut profile_shift[{wheel}] is at least {geometry.undercut_shift[wheel]:.4g}. "
        raise InputError(
            "rack.root_radius", f"must make a notch parameter q_s from {NOTCHES[0]:g} to {NOTCHES[1]:g} for a root "
            f"stress by {_CLAUSE}, 7.2", rounding, f"s_Fn/(2 ρ_F) of wheel {wheel + 1} is {found.notch:.4g}. "
            + least * (x < geometry.undercut_shift[wheel])
            + f"Give a {'smaller root_radius or more' if blunt else 'larger root_radius or less'} profile_shift.")
    return found


def _tangent_angle(geometry: Geometry, slope: float, turn: float) -> float:
    """θ = slope tan θ − turn from π/6 on, by Newton's method.

    π/2 − θ is the angle of the rack's profile that cuts the fillet at the 30° tangent: at least α_n, where the rounding
    of the rack begins. It is 30° or more, so that the tangent leaves the fillet at large pressure angles alone.
    """
    theta, step = _FIRST_ANGLE, 1.0
    for _ in range(_MOST_STEPS):
        if abs(step) < _SAME_ANGLE or not 0 < theta < math.pi / 2:
            break
        step = (theta - slope * math.tan(theta) + turn) / (1 - slope / math.cos(theta) ** 2)
        theta -= step
    alpha = geometry.pressure_angle
    if not 0 < theta <= math.pi / 2 - alpha or abs(step) >= _SAME_ANGLE:
        raise InputError(
            "pressure_angle", f"must leave the 30° tangent on the root fillet for a root stress by {_CLAUSE}, 6.2",
            f"{math.degrees(alpha):.6g} deg", "It is on the fillet up to about 30°: give a smaller angle.")
    return theta


@lru_cache(maxsize=256)
def root_factors(geometry: Geometry) -> RootFactors:
    """The factors of the nominal root stress; raises `InputError` as `root_section`."""
    alpha, overlap, factors = geometry.pressure_angle, min(geometry.overlap_ratio, LARGEST_OVERLAP), []
    for section in (root_section(geometry, wheel) for wheel in (0, 1) if geometry.signs[wheel] > 0):
        ratio = section.chord / section.lever
        factors.append((6 * section.lever * math.cos(section.load_angle) / (section.chord**2 * math.cos(alpha)),  # Y_F
                        (1.2 + 0.13 * ratio) * section.notch ** (1 / (1.21 + 2.3 / ratio))))  # Y_S
    form, correction = zip(*factors, strict=True)
    return RootFactors(
        root_form_factor=form, root_stress_correction=correction,
        root_helix_factor=1 - overlap * min(geometry.helix_angle, LARGEST_HELIX) / math.radians(120))


def root_stress(geometry: Geometry, torque: float) -> tuple[float, ...]:
    """The nominal root stress of both wheels, Pa, under a static torque of either sign at wheel 1, N m; of an internal
    pair that of the pinion alone.

    Raises `InputError` as `root_section`.
    """
    found, force = root_factors(geometry), 2 * abs(torque) / geometry.reference_diameter[0]
    nominal = force / (geometry.common_face_width * geometry.normal_module) * found.root_helix_factor
    return tuple(nominal * form * correction for form, correction in zip(
        found.root_form_factor, found.root_stress_correction, strict=True))
