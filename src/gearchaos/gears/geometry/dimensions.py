"""`Geometry`: the dimensions of an external cylindrical gear pair by ISO 21771:2007.

Lengths are in m, angles in rad, and values of both wheels are tuples of two; wheel 1 drives. Contact quantities are
those of the transverse plane along the line of action. Dimensions are nominal: the reduction of the tooth thickness
that makes backlash changes neither root nor form diameters.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from gearchaos.gears.geometry.tooth_root import GeneratedTooth, involute

Pair = tuple[float, float]
"""The values of wheel 1 and wheel 2."""


@dataclass(frozen=True, kw_only=True)
class Geometry:
    """Dimensions of an external spur or helical gear pair, ISO 21771:2007.

    The fields determine all other values, which are properties. They are not checked here:
    `gearchaos.GearDesign` refuses pairs that cannot run.

    Parameters
    ----------
    teeth : tuple of int
        z1, z2.
    normal_module : float
        m_n, m.
    pressure_angle, helix_angle : float
        α_n and the magnitude of β at the reference cylinder, rad.
    profile_shift : tuple of float
        Profile shift coefficients x1, x2, in normal modules.
    centre_distance : float
        Working centre distance a, m.
    face_width : tuple of float
        b1, b2, m.
    addendum, dedendum, root_radius : float, optional
        h_aP, h_fP and ρ_fP of the basic rack over m_n; by default those of profile A of ISO 53:1998.
    tip_alteration : tuple of float, optional
        k m_n of each wheel, m; negative for a tooth that is shortened at the tip. By default 0.
    """

    teeth: tuple[int, int]
    normal_module: float
    pressure_angle: float
    helix_angle: float
    profile_shift: Pair
    centre_distance: float
    face_width: Pair
    addendum: float = 1.0
    dedendum: float = 1.25
    root_radius: float = 0.38
    tip_alteration: Pair = (0.0, 0.0)

    @property
    def gear_ratio(self) -> float:
        """u = z2/z1, ISO 21771:2007 Eq. (52); below 1 where the driven wheel is the smaller one."""
        return self.teeth[1] / self.teeth[0]

    @property
    def transverse_module(self) -> float:
        """m_t = m_n/cos β, m, ISO 21771:2007 4.2.7, Eq. (2)."""
        return self.normal_module / math.cos(self.helix_angle)

    @property
    def transverse_pressure_angle(self) -> float:
        """α_t with tan α_t = tan α_n/cos β, rad, ISO 21771:2007 4.3.5, Eq. (14)."""
        return math.atan(math.tan(self.pressure_angle) / math.cos(self.helix_angle))

    @property
    def base_helix_angle(self) -> float:
        """β_b with sin β_b = sin β cos α_n, rad, ISO 21771:2007 Eq. (6)."""
        return math.asin(math.sin(self.helix_angle) * math.cos(self.pressure_angle))

    @property
    def reference_diameter(self) -> Pair:
        """d = z m_t, m, ISO 21771:2007 4.2.4, Eq. (1)."""
        return self.teeth[0] * self.transverse_module, self.teeth[1] * self.transverse_module

    @cached_property
    def base_diameter(self) -> Pair:
        """d_b = d cos α_t, m, ISO 21771:2007 4.3.10, Eq. (19)."""
        factor = self.transverse_module * math.cos(self.transverse_pressure_angle)
        return self.teeth[0] * factor, self.teeth[1] * factor

    @cached_property
    def tip_diameter(self) -> Pair:
        """d_a = d + 2 (x m_n + h_aP + k m_n), m, ISO 21771:2007 4.5.3, Eq. (33)."""
        shifts, alterations, diameters = self.profile_shift, self.tip_alteration, self.reference_diameter
        heights = [(x + self.addendum) * self.normal_module + k for x, k in zip(shifts, alterations, strict=True)]
        return diameters[0] + 2 * heights[0], diameters[1] + 2 * heights[1]

    @property
    def root_diameter(self) -> Pair:
        """d_f = d − 2 (h_fP − x m_n), m, ISO 21771:2007 4.5.4, Eq. (34)."""
        depths = [(self.dedendum - x) * self.normal_module for x in self.profile_shift]
        return self.reference_diameter[0] - 2 * depths[0], self.reference_diameter[1] - 2 * depths[1]

    @property
    def working_pressure_angle(self) -> float:
        """α_wt with cos α_wt = (d_b1 + d_b2)/(2 a), rad, ISO 21771:2007 Eq. (54)."""
        return math.atan2(self.tangent_length, sum(self.base_diameter) / 2)

    @property
    def working_diameter(self) -> Pair:
        """Pitch diameters d_w = 2 a z/(z1 + z2), m, ISO 21771:2007 Eqs. (56) and (57)."""
        unit = 2 * self.centre_distance / sum(self.teeth)
        return self.teeth[0] * unit, self.teeth[1] * unit

    @cached_property
    def tangent_length(self) -> float:
        """a sin α_wt, m: the length of the line of action between the points where it touches the base circles."""
        bases = sum(self.base_diameter) / 2
        return math.sqrt((self.centre_distance - bases) * (self.centre_distance + bases))

    @property
    def base_pitch(self) -> float:
        """Transverse base pitch p_bt = p_et = π m_t cos α_t, m, ISO 21771:2007 Eqs. (28) and (30)."""
        return math.pi * self.transverse_module * math.cos(self.transverse_pressure_angle)

    @property
    def common_face_width(self) -> float:
        """b = min(b1, b2), m: the face width of the contact when neither wheel overhangs."""
        return min(self.face_width)

    @cached_property
    def tip_tangents(self) -> Pair:
        """√(r_a² − r_b²), m: the distance from the base circle's point of tangency to the tip along the line of action.
        """
        return _tangent(self.tip_diameter[0], self.base_diameter[0]), _tangent(
            self.tip_diameter[1], self.base_diameter[1])

    def length_to_tip(self, wheel: int, diameter: float) -> float:
        """Length along the line of action, m, between a circle and the tip circle of one wheel; wheel 1 is 0."""
        return self.tip_tangents[wheel] - _tangent(diameter, self.base_diameter[wheel])

    @property
    def path_of_contact(self) -> float:
        """g_α = √(r_a1² − r_b1²) + √(r_a2² − r_b2²) − a sin α_wt, m, ISO 21771:2007 Eq. (77)."""
        return sum(self.tip_tangents) - self.tangent_length

    @property
    def contact_ratio(self) -> float:
        """Transverse contact ratio ε_α = g_α/p_et, ISO 21771:2007 Eq. (90)."""
        return self.path_of_contact / self.base_pitch

    @property
    def overlap_ratio(self) -> float:
        """ε_β = b sin β/(π m_n), ISO 21771:2007 Eq. (93)."""
        return self.common_face_width * math.sin(self.helix_angle) / (math.pi * self.normal_module)

    @property
    def total_contact_ratio(self) -> float:
        """ε_γ = ε_α + ε_β, ISO 21771:2007 Eq. (97)."""
        return self.contact_ratio + self.overlap_ratio

    @property
    def start_of_active_profile(self) -> Pair:
        """Diameters d_Nf where the contact begins on each wheel's root side, m, ISO 21771:2007 5.4.1, Eqs. (64), (65).

        NaN for a wheel whose mate reaches below its base circle, where there is no involute.
        """
        rho = [self.tangent_length - tip for tip in self.tip_tangents[::-1]]
        first, second = (2 * math.hypot(d / 2, r) if r >= 0 else math.nan
                         for d, r in zip(self.base_diameter, rho, strict=True))
        return first, second

    @cached_property
    def root_form_diameter(self) -> Pair:
        """Diameters d_Ff where the involute begins, m, ISO 21771:2007 7.6, Eq. (128); of the undercut if there is one.
        """
        return 2 * self.generated_tooth(0).form_radius, 2 * self.generated_tooth(1).form_radius

    @property
    def undercut_shift(self) -> Pair:
        """Least profile shift coefficients without undercut, ISO 21771:2007 7.7."""
        return self.generated_tooth(0).undercut_shift, self.generated_tooth(1).undercut_shift

    def generated_tooth(self, wheel: int) -> GeneratedTooth:
        """The tooth of one wheel as the basic rack generates it; wheel 1 is 0."""
        return GeneratedTooth(
            teeth=self.teeth[wheel], normal_module=self.normal_module, pressure_angle=self.pressure_angle,
            helix_angle=self.helix_angle, profile_shift=self.profile_shift[wheel], dedendum=self.dedendum,
            root_radius=self.root_radius)

    @property
    def tip_clearance(self) -> Pair:
        """c = a − d_a/2 − d_f/2 of the mate, m, ISO 21771:2007 Eq. (60); c1 lies between tip 1 and root 2."""
        (tip1, tip2), (root1, root2) = self.tip_diameter, self.root_diameter
        return self.centre_distance - (tip1 + root2) / 2, self.centre_distance - (tip2 + root1) / 2

    @property
    def tip_thickness(self) -> Pair:
        """Tooth thickness s_an at the tip circle in the normal section, m, ISO 21771:2007 7.9; negative if pointed."""
        return self._tip_thickness(0), self._tip_thickness(1)

    def _tip_thickness(self, wheel: int) -> float:
        """s_an = d_a (s_t/d + inv α_t − inv α_at) cos β_a of one wheel; wheel 1 is 0."""
        tip, base, reference = self.tip_diameter[wheel], self.base_diameter[wheel], self.reference_diameter[wheel]
        angle = math.pi / 2 + 2 * self.profile_shift[wheel] * math.tan(self.pressure_angle)  # s_t/m_t, Eq. (39)
        at_tip = involute(math.atan2(2 * self.tip_tangents[wheel], base))
        thickness = tip * (angle / self.teeth[wheel] + involute(self.transverse_pressure_angle) - at_tip)
        return thickness * math.cos(math.atan(tip / reference * math.tan(self.helix_angle)))

    @property
    def virtual_teeth(self) -> Pair:
        """Numbers of teeth of the virtual spur gears, z_n = z/(cos² β_b cos β), ISO 6336-1:2006."""
        factor = math.cos(self.base_helix_angle) ** 2 * math.cos(self.helix_angle)
        return self.teeth[0] / factor, self.teeth[1] / factor

    @property
    def theoretical_backlash(self) -> float:
        """Backlash of teeth of nominal thickness, m: total, in the transverse plane along the line of action.

        j_bt = m_t cos α_t ((z1 + z2)(inv α_wt − inv α_t) − 2 (x1 + x2) tan α_n): what the working circles' pitch leaves
        beside both tooth thicknesses, ISO 21771:2007 Eqs. (39) and (55), times cos α_wt. Negative where nominal teeth
        overlap, 0 where the profile shifts fit the centre distance.
        """
        opening = involute(self.working_pressure_angle) - involute(self.transverse_pressure_angle)
        filling = 2 * sum(self.profile_shift) * math.tan(self.pressure_angle)
        return self.base_pitch / math.pi * (sum(self.teeth) * opening - filling)


def _tangent(diameter: float, base_diameter: float) -> float:
    """Length of the tangent of a base circle from the circle to a point on a larger circle, m; 0 inside the base."""
    return math.sqrt(max(diameter - base_diameter, 0.0) * (diameter + base_diameter)) / 2
