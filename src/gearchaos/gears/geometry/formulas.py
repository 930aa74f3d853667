"""Symbols, units, formulae and sources of the values of a `Geometry` and of a `GearDesign`, by the names of properties.

A value of each wheel is a tuple of two; the formula is that of one wheel.
"""

from __future__ import annotations

import math

from gearchaos.gears.formulas import Formula

_ISO = "ISO 21771:2007"
_DEGREES = 180 / math.pi


def _length(symbol: str, text: str, source: str) -> Formula:
    """The formula of a length, shown in mm."""
    return Formula(symbol, "mm", 1e3, text, source)


def _angle(symbol: str, text: str, source: str) -> Formula:
    """The formula of an angle, shown in degrees."""
    return Formula(symbol, "deg", _DEGREES, text, source)


def _ratio(symbol: str, text: str, source: str) -> Formula:
    """The formula of a pure number."""
    return Formula(symbol, "", 1.0, text, source)


GEOMETRY_FORMULAS: dict[str, Formula] = {
    "gear_ratio": _ratio("u", "z2/z1", f"{_ISO} (52)"),
    "centre_distance": _length("a", "(d_b1 + d_b2)/(2 cos α_wt)", f"{_ISO} (54)"),
    "transverse_module": _length("m_t", "m_n/cos β", f"{_ISO} (2)"),
    "transverse_pressure_angle": _angle("α_t", "arctan(tan α_n/cos β)", f"{_ISO} (14)"),
    "working_pressure_angle": _angle("α_wt", "arccos((d_b1 + d_b2)/(2 a))", f"{_ISO} (54)"),
    "base_helix_angle": _angle("β_b", "arcsin(sin β cos α_n)", f"{_ISO} (6)"),
    "reference_diameter": _length("d", "z m_t", f"{_ISO} (1)"),
    "base_diameter": _length("d_b", "d cos α_t", f"{_ISO} (19)"),
    "tip_diameter": _length("d_a", "d + 2 (x m_n + h_aP + k m_n)", f"{_ISO} (33)"),
    "root_diameter": _length("d_f", "d − 2 (h_fP − x m_n)", f"{_ISO} (34)"),
    "working_diameter": _length("d_w", "2 a z/(z1 + z2)", f"{_ISO} (56), (57)"),
    "start_of_active_profile": _length("d_Nf", "√(d_b² + (2 a sin α_wt − √(d_a² − d_b²))²), √(d_a² − d_b²) of the mate",
                                       f"{_ISO} (64), (65)"),
    "root_form_diameter": _length("d_Ff", "√(d_b² + (d sin α_t − 2 (h_FfP − x m_n)/sin α_t)²)", f"{_ISO} (128)"),
    "tip_clearance": _length("c", "a − d_a/2 − d_f/2 of the mate", f"{_ISO} (60)"),
    "tip_thickness": _length("s_an", "d_a (s_t/d + inv α_t − inv α_at) cos β_a", f"{_ISO} 7.9"),
    "base_pitch": _length("p_bt", "π m_t cos α_t", f"{_ISO} (28)"),
    "path_of_contact": _length("g_α", "(√(d_a1² − d_b1²) + √(d_a2² − d_b2²))/2 − a sin α_wt", f"{_ISO} (77)"),
    "contact_ratio": _ratio("ε_α", "g_α/p_bt", f"{_ISO} (90)"),
    "overlap_ratio": _ratio("ε_β", "b sin β/(π m_n)", f"{_ISO} (93)"),
    "total_contact_ratio": _ratio("ε_γ", "ε_α + ε_β", f"{_ISO} (97)"),
    "virtual_teeth": _ratio("z_n", "z/(cos² β_b cos β)", "ISO 6336-1:2006"),
    "undercut_shift": _ratio("x_min", "h_FfP/m_n − z sin² α_t/(2 cos β)", f"{_ISO} 7.7"),
    "theoretical_backlash": _length(
        "j_bt", "m_t cos α_t ((z1 + z2)(inv α_wt − inv α_t) − 2 (x1 + x2) tan α_n)", f"{_ISO} (39), (55)"),
}
"""Of the properties of `Geometry`."""

DESIGN_FORMULAS: dict[str, Formula] = {
    "backlash_line_of_action": Formula(
        "j_bt", "mm", 1e3, "j_wt cos α_wt = j_t cos α_t = j_bn/cos β_b = 2 j_r sin α_wt; total", _ISO,
        words="total backlash along the line of action"),
    "masses": Formula("m", "kg", 1.0, "π ρ b (d_m² − d_i²)/4 with d_m = (d_a + d_f)/2, if not given", "disc"),
    "inertias": Formula("I", "kg*m^2", 1.0, "m (d_m² + d_i²)/8, if not given", "disc"),
    "equivalent_mass": Formula("m", "kg", 1.0, "I1 I2/(I1 r_b2² + I2 r_b1²)", "Łuczko 2008, (2.9)"),
}
"""Of the properties of `GearDesign`."""
