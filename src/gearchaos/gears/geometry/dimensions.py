"""`Geometry`: the dimensions of a cylindrical gear pair by ISO 21771:2007, also from those of a drawing.

Lengths are in m, angles in rad, and values of both wheels are tuples of two; wheel 1 drives. Contact quantities are
those of the transverse plane along the line of action. Dimensions are nominal: the reduction of the tooth thickness
that makes backlash changes neither root nor form diameters. Symbols, units, formulae and sources of the values stand in
`GEOMETRY_FORMULAS`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

from gearchaos.errors import InputError
from gearchaos.gears.geometry.tooth_root import GeneratedTooth, inverse_involute, involute
from gearchaos.gears.io.fields import Formula
from gearchaos.gears.io.units import Length

Pair = tuple[float, float]  # the values of wheel 1 and wheel 2


@dataclass(frozen=True, kw_only=True)
class Geometry:
    """Dimensions of an external gear pair, ISO 21771:2007, from the fields, which `gearchaos.GearDesign` checks."""

    signs: ClassVar[tuple[int, int]] = (1, 1)  # which ISO 21771 gives to the numbers of teeth: -1 to that of a ring

    teeth: tuple[int, int]
    normal_module: float
    pressure_angle: float  # α_n
    helix_angle: float  # |β| at the reference cylinder
    profile_shift: Pair  # x1, x2 in normal modules
    centre_distance: float  # the working one
    face_width: Pair
    addendum: float = 1.0  # h_aP, h_fP and ρ_fP of the basic rack over m_n: profile A of ISO 53:1998
    dedendum: float = 1.25
    root_radius: float = 0.38
    tip_alteration: Pair = (0.0, 0.0)  # k m_n, negative for a tooth that is shortened at the tip

    @classmethod
    def sum_of(cls, values: Pair) -> float:
        """The sum of a value of both wheels; of an internal pair that of the ring less that of the pinion."""
        return cls.signs[1] * values[0] + values[1]

    @property
    def gear_ratio(self) -> float:
        return self.teeth[1] / self.teeth[0]

    @property
    def transverse_module(self) -> float:
        return self.normal_module / math.cos(self.helix_angle)

    @property
    def transverse_pressure_angle(self) -> float:
        return math.atan(math.tan(self.pressure_angle) / math.cos(self.helix_angle))

    @property
    def base_helix_angle(self) -> float:
        return math.asin(math.sin(self.helix_angle) * math.cos(self.pressure_angle))

    @property
    def reference_diameter(self) -> Pair:
        return self.teeth[0] * self.transverse_module, self.teeth[1] * self.transverse_module

    @cached_property
    def base_diameter(self) -> Pair:
        factor = self.transverse_module * math.cos(self.transverse_pressure_angle)
        return self.teeth[0] * factor, self.teeth[1] * factor

    @cached_property
    def tip_diameter(self) -> Pair:
        shifts, alterations, diameters = self.profile_shift, self.tip_alteration, self.reference_diameter
        heights = [(x + self.addendum) * self.normal_module + k for x, k in zip(shifts, alterations, strict=True)]
        return diameters[0] + 2 * heights[0], diameters[1] + 2 * self.signs[1] * heights[1]

    @property
    def root_diameter(self) -> Pair:
        depths = [(self.dedendum - x) * self.normal_module for x in self.profile_shift]
        return self.reference_diameter[0] - 2 * depths[0], self.reference_diameter[1] - 2 * self.signs[1] * depths[1]

    @property
    def working_pressure_angle(self) -> float:
        return math.atan2(self.tangent_length, sum(self.base_diameter) / 2)

    @property
    def working_diameter(self) -> Pair:
        """Pitch diameters, m."""
        unit = 2 * self.centre_distance / self.sum_of(self.teeth)
        return self.teeth[0] * unit, self.teeth[1] * unit

    @cached_property
    def tangent_length(self) -> float:
        """a sin α_wt, m: the length of the line of action between the points where it touches the base circles."""
        bases = sum(self.base_diameter) / 2
        return math.sqrt((self.centre_distance - bases) * (self.centre_distance + bases))

    @property
    def base_pitch(self) -> float:
        """Transverse base pitch p_bt = p_et, m."""
        return math.pi * self.transverse_module * math.cos(self.transverse_pressure_angle)

    @property
    def common_face_width(self) -> float:
        """b = min(b1, b2), m: the face width of the contact when neither wheel overhangs."""
        return min(self.face_width)

    @cached_property
    def tip_tangents(self) -> Pair:
        """√(r_a² − r_b²): from the base circle's point of tangency to the tip along the line of action."""
        (tip1, tip2), (base1, base2) = self.tip_diameter, self.base_diameter
        return _tangent(tip1, base1), _tangent(tip2, base2)

    def length_to_tip(self, wheel: int, diameter: float) -> float:
        """Length along the line of action between a circle and the tip circle of one wheel; wheel 1 is 0."""
        return self.signs[wheel] * (self.tip_tangents[wheel] - _tangent(diameter, self.base_diameter[wheel]))

    @property
    def least_contact(self) -> str:
        """What there is where the fewest tooth pairs of spur gears are on the path of contact, in words."""
        fewest = math.floor(self.contact_ratio)
        return "single contact" if fewest == 1 else f"contact of {fewest} pairs"

    @property
    def single_contact_diameter(self) -> Pair:
        """Diameters, m, beyond which one tooth pair of spur gears more shares the load: the highest points of single
        contact, or of `least_contact`. A tip relief from there on reaches over the whole of double contact."""
        shared = self.path_of_contact - math.floor(self.contact_ratio) * self.base_pitch
        first, second = (2 * math.hypot(d / 2, tip - sign * shared)
                         for d, tip, sign in zip(self.base_diameter, self.tip_tangents, self.signs, strict=True))
        return first, second

    @property
    def path_of_contact(self) -> float:
        return sum(self.tip_tangents) - self.tangent_length

    @property
    def contact_ratio(self) -> float:
        return self.path_of_contact / self.base_pitch

    @property
    def overlap_ratio(self) -> float:
        return self.common_face_width * math.sin(self.helix_angle) / (math.pi * self.normal_module)

    @property
    def total_contact_ratio(self) -> float:
        return self.contact_ratio + self.overlap_ratio

    @property
    def start_of_active_profile(self) -> Pair:
        """Where contact begins on each root side; NaN where the mate reaches below the base circle, without involute.
        """
        rho = [self.tangent_length - tip for tip in self.tip_tangents[::-1]]
        first, second = (2 * math.hypot(d / 2, r) if r >= 0 else math.nan
                         for d, r in zip(self.base_diameter, rho, strict=True))
        return first, second

    @cached_property
    def root_form_diameter(self) -> Pair:
        """Diameters where the involute begins, m; of the undercut if there is one."""
        return 2 * self.generated_tooth(0).form_radius, 2 * self.generated_tooth(1).form_radius

    @property
    def undercut_shift(self) -> Pair:
        return self.generated_tooth(0).undercut_shift, self.generated_tooth(1).undercut_shift

    def generated_tooth(self, wheel: int) -> GeneratedTooth:
        """The tooth of one wheel as the basic rack generates it; wheel 1 is 0."""
        return GeneratedTooth(
            teeth=self.teeth[wheel], normal_module=self.normal_module, pressure_angle=self.pressure_angle,
            helix_angle=self.helix_angle, profile_shift=self.profile_shift[wheel], dedendum=self.dedendum,
            root_radius=self.root_radius)

    @property
    def tip_clearance(self) -> Pair:
        """Tip clearances, m; the first lies between tip 1 and root 2."""
        (tip1, tip2), (root1, root2) = self.tip_diameter, self.root_diameter
        return self.centre_distance - (tip1 + root2) / 2, self.centre_distance - (tip2 + root1) / 2

    @property
    def tip_thickness(self) -> Pair:
        """Tooth thickness at the tip circle in the normal section, m; negative if pointed."""
        found = []
        for wheel, (tip, base) in enumerate(zip(self.tip_diameter, self.base_diameter, strict=True)):
            angle = math.pi / 2 + 2 * self.profile_shift[wheel] * math.tan(self.pressure_angle)  # s_t/m_t, Eq. (39)
            at_tip, sign = involute(math.atan2(2 * self.tip_tangents[wheel], base)), self.signs[wheel]
            thickness = tip * (angle / self.teeth[wheel] + sign * involute(self.transverse_pressure_angle)
                               - sign * at_tip)
            ratio = tip / self.reference_diameter[wheel]
            found.append(thickness * math.cos(math.atan(ratio * math.tan(self.helix_angle))))
        return found[0], found[1]

    @property
    def virtual_teeth(self) -> Pair:
        factor = math.cos(self.base_helix_angle) ** 2 * math.cos(self.helix_angle)
        return self.teeth[0] / factor, self.teeth[1] / factor

    @property
    def theoretical_backlash(self) -> float:
        """Backlash of teeth of nominal thickness, total, in the transverse plane along the line of action: what the
        pitch of the working circles leaves beside both thicknesses, times cos α_wt. Negative where nominal teeth
        overlap.
        """
        opening = involute(self.working_pressure_angle) - involute(self.transverse_pressure_angle)
        filling = 2 * sum(self.profile_shift) * math.tan(self.pressure_angle)
        return self.base_pitch / math.pi * (self.signs[1] * self.sum_of(self.teeth) * opening - filling)


def _tangent(diameter: float, base_diameter: float) -> float:
    """Length of the tangent of a base circle from the circle to a point on a larger circle, m; 0 inside the base."""
    return math.sqrt(max(diameter - base_diameter, 0.0) * (diameter + base_diameter)) / 2


# the tip alteration that shortens the teeth until the tip clearance is that of the basic rack
KEEP_CLEARANCE = "keep clearance"
_NEGLIGIBLE_SHIFT = 1e-3  # largest sum of profile shift coefficients that the rounding of a centre distance explains


def mating_geometry(
    values: dict[str, Any], centre_distance: float | None, profile_shift: Pair | None, tip_alteration: Pair | str,
    tip_diameter: Pair | None = None, kind: type[Geometry] = Geometry,
) -> Geometry:
    """The geometry of a pair of this kind, with what is left out computed; ``values`` are its other fields.

    A centre distance that is left out is that without backlash, ISO 21771:2007 Eqs. (54) and (55). Profile shifts that
    are left out are 0. A tip diameter determines the tip alteration instead. Raises `InputError` if the shifts are left
    out and the centre distance needs some: how to split their sum is the designer's choice. Also if no centre distance
    fits the shifts, or the base circles overlap.
    """
    shifts = (0.0, 0.0) if profile_shift is None else profile_shift
    distance = math.inf if centre_distance is None else centre_distance
    given = kind(**values, profile_shift=shifts, centre_distance=distance)
    reference, teeth = kind.sum_of(given.reference_diameter) / 2, kind.signs[1] * kind.sum_of(given.teeth)
    if centre_distance is None:
        distance = reference
        if sum(shifts):  # without backlash a = (d_b1 + d_b2)/(2 cos α_wt)
            at_reference, tangent = involute(given.transverse_pressure_angle), math.tan(given.pressure_angle)
            if (value := at_reference + 2 * sum(shifts) * tangent / teeth) <= 0:
                bound = -teeth * at_reference / (2 * tangent)  # at which α_wt without backlash is 0
                side, thin = ("above", "With less the teeth are so thin that no centre distance closes the backlash.")
                if teeth < 0:
                    side, thin = "below", "With more the teeth of pinion and ring are too thick at any centre distance."
                raise InputError("profile_shift", f"must have a sum {side} {bound:.4g} for these teeth", shifts, thin)
            distance = kind.sum_of(given.base_diameter) / (2 * math.cos(inverse_involute(value)))
        given = replace(given, centre_distance=distance)
    least, distance = kind.sum_of(given.base_diameter) / 2, given.centre_distance
    if distance <= least:  # there would be no line of action
        raise InputError(
            "centre_distance", f"must be greater than {Length(least, distance)}, the "
            f"{'sum' if teeth > 0 else 'difference'} of the base radii", Length(distance, distance),
            f"Without profile shift it is {Length(reference, distance)}.")
    if profile_shift is None and abs(needed := shift_sum(given)) > _NEGLIGIBLE_SHIFT:
        raise InputError(
            "profile_shift", f"must be given with this centre distance, with a sum of {needed:.6g}", None,
            "Split this sum between the wheels, e.g. in favour of the pinion: there is no split that fits every pair. "
            f"Or leave out centre_distance; without profile shift it is {Length(reference, centre_distance)}.")
    if tip_diameter is not None:
        first, second = (sign * (own - nominal) / 2 for sign, own, nominal in zip(
            kind.signs, tip_diameter, given.tip_diameter, strict=True))
        return replace(given, tip_alteration=(first, second))
    if not isinstance(tip_alteration, str):
        return replace(given, tip_alteration=tip_alteration)
    shortening = min(kind.signs[1] * (given.centre_distance - reference) - sum(shifts) * given.normal_module, 0.0)
    return replace(given, tip_alteration=(shortening, shortening))


def shift_sum(geometry: Geometry) -> float:
    """x1 + x2 = (z1 + z2)(inv α_wt − inv α_t)/(2 tan α_n): the sum without backlash, ISO 21771:2007 Eq. (62)."""
    opening = involute(geometry.working_pressure_angle) - involute(geometry.transverse_pressure_angle)
    return geometry.signs[1] * geometry.sum_of(geometry.teeth) * opening / (2 * math.tan(geometry.pressure_angle))


_ISO = "ISO 21771:2007"
_UNITS = {"mm": 1e3, "deg": 180 / math.pi, "": 1.0}


def _formula(symbol: str, unit: str, text: str, source: str) -> Formula:
    return Formula(symbol, unit, _UNITS[unit], text, source)


# of the values of a `Geometry`, by name. A value of each wheel is a tuple of two; the formula is that of one wheel.
GEOMETRY_FORMULAS: dict[str, Formula] = {
    "gear_ratio": _formula("u", "", "z2/z1", f"{_ISO} (52)"),
    "centre_distance": _formula("a", "mm", "(d_b1 + d_b2)/(2 cos α_wt)", f"{_ISO} (54)"),
    "transverse_module": _formula("m_t", "mm", "m_n/cos β", f"{_ISO} (2)"),
    "transverse_pressure_angle": _formula("α_t", "deg", "arctan(tan α_n/cos β)", f"{_ISO} (14)"),
    "working_pressure_angle": _formula("α_wt", "deg", "arccos((d_b1 + d_b2)/(2 a))", f"{_ISO} (54)"),
    "base_helix_angle": _formula("β_b", "deg", "arcsin(sin β cos α_n)", f"{_ISO} (6)"),
    "reference_diameter": _formula("d", "mm", "z m_t", f"{_ISO} (1)"),
    "base_diameter": _formula("d_b", "mm", "d cos α_t", f"{_ISO} (19)"),
    "tip_diameter": _formula("d_a", "mm", "d + 2 (x m_n + h_aP + k m_n)", f"{_ISO} (33)"),
    "root_diameter": _formula("d_f", "mm", "d − 2 (h_fP − x m_n)", f"{_ISO} (34)"),
    "working_diameter": _formula("d_w", "mm", "2 a z/(z1 + z2)", f"{_ISO} (56), (57)"),
    "start_of_active_profile": _formula(
        "d_Nf", "mm", "√(d_b² + (2 a sin α_wt − √(d_a² − d_b²))²), √(d_a² − d_b²) of the mate", f"{_ISO} (64), (65)"),
    "root_form_diameter": _formula("d_Ff", "mm", "√(d_b² + (d sin α_t − 2 (h_FfP − x m_n)/sin α_t)²)", f"{_ISO} (128)"),
    "tip_clearance": _formula("c", "mm", "a − d_a/2 − d_f/2 of the mate", f"{_ISO} (60)"),
    "tip_thickness": _formula("s_an", "mm", "d_a (s_t/d + inv α_t − inv α_at) cos β_a", f"{_ISO} 7.9"),
    "base_pitch": _formula("p_bt", "mm", "π m_t cos α_t", f"{_ISO} (28)"),
    "path_of_contact": _formula("g_α", "mm", "(√(d_a1² − d_b1²) + √(d_a2² − d_b2²))/2 − a sin α_wt", f"{_ISO} (77)"),
    "contact_ratio": _formula("ε_α", "", "g_α/p_bt", f"{_ISO} (90)"),
    "overlap_ratio": _formula("ε_β", "", "b sin β/(π m_n)", f"{_ISO} (93)"),
    "total_contact_ratio": _formula("ε_γ", "", "ε_α + ε_β", f"{_ISO} (97)"),
    "virtual_teeth": _formula("z_n", "", "z/(cos² β_b cos β)", "ISO 6336-1:2006"),
    "undercut_shift": _formula("x_min", "", "h_FfP/m_n − z sin² α_t/(2 cos β)", f"{_ISO} 7.7"),
    "theoretical_backlash": _formula(
        "j_bt", "mm", "m_t cos α_t ((z1 + z2)(inv α_wt − inv α_t) − 2 (x1 + x2) tan α_n)", f"{_ISO} (39), (55)"),
}

# of the properties of `GearDesign`
DESIGN_FORMULAS: dict[str, Formula] = {
    "backlash_line_of_action": Formula(
        "j_bt", "mm", 1e3, "j_wt cos α_wt = j_t cos α_t = j_bn/cos β_b = 2 j_r sin α_wt; total", _ISO,
        words="total backlash along the line of action"),
    "masses": Formula("m", "kg", 1.0, "π ρ b (d_m² − d_i²)/4 with d_m = (d_a + d_f)/2, if not given", "disc"),
    "inertias": Formula("I", "kg*m^2", 1.0, "m (d_m² + d_i²)/8, if not given", "disc"),
    "equivalent_mass": Formula("m", "kg", 1.0, "I1 I2/(I1 r_b2² + I2 r_b1²)", "Łuczko 2008, (2.9)"),
}
