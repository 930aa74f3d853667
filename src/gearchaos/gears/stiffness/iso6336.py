"""Stiffness by ISO 6336-1:2006, clause 9: single stiffness c′, mesh stiffness c_γα, and its course over the mesh cycle.

c′ and c_γα are per unit face width in the transverse plane, along the line of action, in N/m² here and in
N/(mm µm) = 1e9 N/m² in the standard. c_γα is the mean over the mesh cycle.

The symbols of the standard count wheels by their numbers of teeth: 1 is the pinion, which has the smaller number. Here
wheel 1 is the driving one, so the two are exchanged where wheel 1 is the larger.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gearchaos.errors import InputError
from gearchaos.gears.io.fields import described
from gearchaos.gears.stiffness import (
    TOLERANCE,
    Drawing,
    MeshStiffness,
    StiffnessMethod,
    check_positive,
    other_methods,
    truncation_note,
)
from gearchaos.gears.stiffness.periodic_curves import PeriodicCurve, approximate, truncated_series
from gearchaos.model import TwoLevelStiffness
from gearchaos.validation import MAX_HARMONICS

if TYPE_CHECKING:
    from gearchaos.gears.geometry.dimensions import Geometry

ISO = "ISO 6336-1"
N_PER_MM_UM = 1e9  # one N/(mm µm) in N/m²
STEEL_MODULUS = 206e9  # E_st, Young's modulus of the steel to which the stiffness refers, Pa; ISO 6336-1:2006, (88).
# specific load F_t K_A/b below which the stiffness falls with the load, N/m; ISO 6336-1:2006, (90)
LOW_LINE_LOAD = 100e3
# specific load F_t K_A/b, N/m, below which there is a warning: the rule for low loads has no lower limit, and lets the
# stiffness vanish with the load
DOUBTFUL_LINE_LOAD = 25e3
# limits of b_s/b, and least s_R/m_n, beyond which they count as these limits; ISO 6336-1:2006, (84), (85)
_WEBS, _LEAST_RIM = (0.2, 1.2), 1.0
_CORRECTION = 0.8  # C_M, the ratio of measured to theoretical stiffness for solid disc gears; ISO 6336-1:2006, (83).
_CLAUSE = "ISO 6336-1:2006, 9.3"
_SAME_POSITION = 1e-12  # positions that are closer to each other than this, in mesh periods, are one


@dataclass(frozen=True)
class Blank:
    """The rim and web of a wheel that is no solid disc: s_R, from the root circle inwards, and b_s, m."""

    rim: float
    web: float


@dataclass(frozen=True, kw_only=True)
class ToothStiffness:
    """Stiffness per unit face width, in SI, and in what the pair lies outside the range of the formulae."""

    flexibility: float = described(
        "q′", "C1 + C2/z_n1 + C3/z_n2 + C4 x1 + C5 x1/z_n1 + C6 x2 + C7 x2/z_n2 + C8 x1² + C9 x2²",
        f"{_CLAUSE}.1, (82)", "mm µm/N", N_PER_MM_UM)
    single_stiffness_theoretical: float = described("c′th", "1/q′", f"{_CLAUSE}.1, (81)", "N/(mm µm)", 1 / N_PER_MM_UM)
    correction_factor: float = described("C_M", "0.8", f"{_CLAUSE}.1, (83)")
    blank_factor: float = described("C_R", "1, or 1 + ln(b_s/b)/(5 exp(s_R/(5 m_n)))", f"{_CLAUSE}.1, (84), (85)")
    rack_factor: float = described(
        "C_B", "(1 + 0.5 (1.2 − h_fP/m_n)) (1 − 0.02 (20° − α_Pn))", f"{_CLAUSE}.1, (86), (87)")
    helix_factor: float = described("cos β", "cos β", f"{_CLAUSE}.1, (80)")
    material_factor: float = described("E/E_st", "2 E1 E2/((E1 + E2) E_st)", f"{_CLAUSE}.1, (88), (89)")
    load_factor: float = described("", "1, or (F_t K_A/(100 b))^0.25 below 100 N/mm", f"{_CLAUSE}.1, (90)")
    single_stiffness: float = described(
        "c′", "c′th C_M C_R C_B cos β E/E_st (load factor)", f"{_CLAUSE}.1, (80), (88), (90)",
        "N/(mm µm)", 1 / N_PER_MM_UM)
    mesh_stiffness: float = described(
        "c_γα", "c′ (0.75 ε_α + 0.25)", f"{_CLAUSE}.2, (91)", "N/(mm µm)", 1 / N_PER_MM_UM)
    warnings: tuple[str, ...] = ()


def tooth_stiffness(
    geometry: Geometry, *, line_load: float | None = None,
    youngs_modulus: tuple[float, float] = (STEEL_MODULUS, STEEL_MODULUS),
    blanks: tuple[Blank | None, Blank | None] = (None, None),
) -> ToothStiffness:
    """Single stiffness c′ and mesh stiffness c_γα, ISO 6336-1:2006, 9.3, method B.

    Without a line load F_t K_A/b, N/m, the stiffness is that at 100 N/mm and above, where the standard takes it to be
    independent of the load. The standard allows for one C_R of a pair: the smaller one, of the more flexible wheel, is
    used; None is a solid disc. Raises `InputError` if the transverse contact ratio is below 1, (82) gives no positive
    q′, or a value that must be positive is not. Outside the range of (82), x1 ≥ x2 and −0.5 ≤ x1 + x2 ≤ 2, where 1 is
    the pinion, there is a warning.

    (81)-(86), (88)-(91) were compared with two public codes, and with KISSsoft's reports on the stages of the NREL 5 MW
    gearbox, also outside the range of (82). This range, its deviations for 100 ≤ F_bt/b ≤ 1600 N/mm, and the use of one
    C_R for a pair of unlike wheels could be compared with one source only.
    """
    given = {f"youngs_modulus[{i}]": value for i, value in enumerate(youngs_modulus)}
    given |= {} if line_load is None else {"line_load": line_load}
    for i, blank in enumerate(blanks):
        given |= {} if blank is None else {f"blank[{i}].web": blank.web, f"blank[{i}].rim": blank.rim}
    for name, value in given.items():
        if not 0 < value < math.inf:
            raise InputError(name, "must be a positive finite number", value)
    if geometry.contact_ratio < 1:
        raise InputError(
            "contact_ratio", "must be at least 1 for a stiffness by ISO 6336-1:2006", geometry.contact_ratio,
            "Contact is lost between two tooth pairs: enlarge the addenda or reduce the centre distance.")
    pinion_first = sorted((0, 1), key=lambda i: (geometry.teeth[i], -geometry.profile_shift[i]))
    z1, z2 = (geometry.virtual_teeth[i] for i in pinion_first)
    x1, x2 = (geometry.profile_shift[i] for i in pinion_first)
    flexibility = (
        0.04723 + 0.15551 / z1 + 0.25791 / z2 - 0.00635 * x1 - 0.11654 * x1 / z1 - 0.00193 * x2 - 0.24188 * x2 / z2
        + 0.00529 * x1**2 + 0.00182 * x2**2) / N_PER_MM_UM  # (82)
    if flexibility <= 0:
        raise InputError(
            "profile_shift", "must give a positive flexibility q′ by ISO 6336-1:2006, (82)", geometry.profile_shift,
            f"q′ would be {flexibility * N_PER_MM_UM:.4g} mm µm/N. {other_methods(ISO, geometry)}")
    first, second = youngs_modulus
    (blank1, notes1), (blank2, notes2) = (_blank_effect(geometry, i, blanks[i]) for i in (0, 1))
    factors = {
        "correction_factor": _CORRECTION, "blank_factor": min(blank1, blank2),
        "rack_factor": rack_factor(geometry.dedendum, geometry.pressure_angle),
        "helix_factor": math.cos(geometry.helix_angle),
        "material_factor": 2 * first * second / (first + second) / STEEL_MODULUS,  # (88), (89)
        "load_factor": 1.0 if line_load is None else min(1.0, (line_load / LOW_LINE_LOAD) ** 0.25)}
    single = math.prod(factors.values()) / flexibility
    mean = single * (0.75 * geometry.contact_ratio + 0.25)
    return ToothStiffness(
        flexibility=flexibility, single_stiffness_theoretical=1 / flexibility, **factors, single_stiffness=single,
        mesh_stiffness=mean, warnings=(
            *notes1, *notes2, *_warnings(geometry, x1, x2, line_load, mean, factors["load_factor"])))


def rack_factor(dedendum: float | tuple[float, float], pressure_angle: float) -> float:
    """Basic rack factor C_B, ISO 6336-1:2006, (86), from h_fP/m_n and α_Pn, rad; of the mean of two racks, (87)."""
    pair = dedendum if isinstance(dedendum, tuple) else (dedendum, dedendum)
    return (1 + 0.5 * (1.2 - sum(pair) / 2)) * (1 - 0.02 * (20 - math.degrees(pressure_angle)))


def _blank_effect(geometry: Geometry, wheel: int, blank: Blank | None) -> tuple[float, list[str]]:
    """C_R of one wheel, (84) or (85), and which dimensions count as others, since they lie outside its range."""
    if blank is None:
        return 1.0, []
    web, rim = blank.web / geometry.face_width[wheel], blank.rim / geometry.normal_module
    counted_web, counted_rim = min(max(web, _WEBS[0]), _WEBS[1]), max(rim, _LEAST_RIM)
    found = [f"The {part} of wheel {wheel + 1}, {ratio} = {value:.3g}, counts as {counted:g} in C_R "
             "(ISO 6336-1:2006, (84), (85))" for part, ratio, value, counted in (
                 ("web", "b_s/b", web, counted_web), ("rim", "s_R/m_n", rim, counted_rim)) if value != counted]
    return 1 + math.log(counted_web) / (5 * math.exp(counted_rim / 5)), found


def _warnings(
    geometry: Geometry, x1: float, x2: float, line_load: float | None, mean: float, load_factor: float,
) -> tuple[str, ...]:
    """In what a pair lies outside the ranges of the standard, and a stiffness that a low load makes doubtful."""
    angle = math.degrees(math.asin(math.sin(geometry.working_pressure_angle) * math.cos(geometry.base_helix_angle)))
    helix, ratio = math.degrees(geometry.helix_angle), geometry.contact_ratio
    extrapolated = "The mesh stiffness is extrapolated: ISO 6336-1:2006, (82), is given for"
    load = math.inf if line_load is None else line_load
    base_load = 0.0 if line_load is None else line_load / math.cos(geometry.transverse_pressure_angle)
    found = {
        f"{extrapolated} a pinion with at least the profile shift of its wheel; here they are {x1:g} and {x2:g}":
            x1 < x2,
        f"{extrapolated} sums of the profile shifts from −0.5 to 2; here it is {x1 + x2:.4g}": not -0.5 <= x1 + x2 <= 2,
        f"ISO 6336-1 is validated for normal working pressure angles from 15° to 25°; here it is {angle:.4g}°":
            not 15 <= angle <= 25,
        f"ISO 6336-1 is validated for helix angles up to 30°; here it is {helix:.4g}°": helix > 30,
        f"ISO 6336-1 is validated for transverse contact ratios from 1 to 2.5; here it is {ratio:.4g}": ratio > 2.5,
        "c_γα may be up to 10 % too high, since the transverse contact ratio is below 1.2 (ISO 6336-1:2006, 9.3.2)":
            ratio < 1.2,
        f"q′ was fitted for F_bt/b from 100 N/mm to 1600 N/mm; here it is {base_load / 1e3:.4g} N/mm":
            base_load > 1600e3,
        f"F_t K_A/b is {load / 1e3:.3g} N/mm. By the rule for low loads, ISO 6336-1:2006, (90), the mesh stiffness is "
        f"{load_factor:.3g} of that at 100 N/mm: {mean / N_PER_MM_UM:.3g} instead of "
        f"{mean / load_factor / N_PER_MM_UM:.3g} N/(mm µm). Below {DOUBTFUL_LINE_LOAD / 1e3:g} N/mm this is doubtful: "
        f"the rule lets the stiffness vanish with the load. {other_methods(ISO, geometry).rstrip('.')}":
            load < DOUBTFUL_LINE_LOAD}
    return tuple(text for text, holds in found.items() if holds)


def relative_length(contact_ratio: float, overlap_ratio: float = 0.0) -> PeriodicCurve:
    """Total length of the contact lines over the mesh period, relative to its mean b ε_α/cos β_b.

    In the plane of action, in units of the transverse base pitch p_et, the zone of contact is ε_α long and contact
    lines enter it at intervals of 1. Across the face width each line is inclined by ε_β. Its length is therefore the
    convolution of two rectangles, of widths ε_α and ε_β (M. Maatar and P. Velex, *J. Mech. Des.* 118, 1996, 307-311;
    the quantities are those of ISO 21771:2007).

    At position 0 a tooth pair enters contact, of helical gears at one end of the face width. The curve of spur gears
    has two levels, that of helical gears is continuous; its corners are at 0, ε_α, ε_β and ε_α + ε_β. Raises
    `InputError` for ratios with which contact is lost during a part of the period.
    """
    _check_ratios(contact_ratio, overlap_ratio)
    corners = np.mod([0.0, contact_ratio, overlap_ratio, contact_ratio + overlap_ratio], 1.0)
    knots = np.sort(corners[corners < 1 - _SAME_POSITION])
    knots = np.append(knots[np.diff(knots, prepend=-1.0) > _SAME_POSITION], 1.0)
    if overlap_ratio < _SAME_POSITION:
        pairs = np.ceil(contact_ratio - (knots[:-1] + np.diff(knots) / 2))
        levels = pairs / contact_ratio
        return PeriodicCurve(knots, levels, levels)
    # a line whose leading end is u behind the entry of the zone of contact is in it from max(0, u − ε_β) to min(u, ε_α)
    u = knots[:, None] + np.arange(np.ceil(contact_ratio + overlap_ratio) + 1)
    lengths = np.maximum(np.minimum(u, contact_ratio) - np.maximum(u - overlap_ratio, 0.0), 0.0)
    values = lengths.sum(axis=1) / (contact_ratio * overlap_ratio)
    return PeriodicCurve(knots, values[:-1], np.append(values[1:-1], values[0]))


def fourier_coefficients(contact_ratio: float, overlap_ratio: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Amplitudes c_j ≥ 0 and phases α_j, in (−π, π], of the relative length 1 + Σ c_j cos(2πjt − α_j), in closed form.

    The transform of a rectangle of width ε is sin(πjε)/(πj), that of a convolution the product: c_j = 2 |s(jε_α)
    s(jε_β)| with s(x) = sin(πx)/(πx). α_j is πj(ε_α + ε_β), and π more where the product is negative. Both are arrays
    (count,), from harmonic 1 on.
    """
    _check_ratios(contact_ratio, overlap_ratio)
    j = np.arange(1, count + 1)
    factor = 2 * np.sinc(j * contact_ratio) * np.sinc(j * overlap_ratio)
    phase = np.pi * np.mod(j * (contact_ratio + overlap_ratio) + (factor < 0), 2.0)
    return np.abs(factor), np.where(phase > np.pi, phase - 2 * np.pi, phase)


def _check_ratios(contact_ratio: float, overlap_ratio: float) -> None:
    """Raise `InputError` unless contact is never lost and no ratio is negative."""
    if not 0 <= overlap_ratio < np.inf:
        raise InputError("overlap_ratio", "must be a finite number, at least 0", overlap_ratio)
    if not 0 < contact_ratio < np.inf or contact_ratio + overlap_ratio < 1:
        raise InputError("contact_ratio", "must be at least 1 together with the overlap ratio", contact_ratio,
                         "Otherwise no teeth are in contact during a part of the mesh period.")


def from_iso(geometry: Geometry, mesh_stiffness: float, *, tolerance: float = TOLERANCE) -> MeshStiffness:
    """Mesh stiffness with the mean c_γα b of ISO 6336-1:2006, 9.3; ``mesh_stiffness`` is c_γα, N/m².

    The standard gives the mean alone, c_γα = c′ (0.75 ε_α + 0.25). The waveform is an assumption: the same law at each
    instant, c′ b (0.75 n + 0.25), where n is the number of tooth pairs in contact, of helical gears the total length of
    the contact lines over that of one pair across the whole face width (`relative_length`). The mean of n is ε_α. Spur
    gears have two levels, for ε_α < 2 c′ b and 1.75 c′ b, helical gears a Fourier series, unless ε_β is so small that
    steps are more exact; their waveform tends to that of spur gears as β tends to 0.

    Raises `InputError` if no teeth are in contact during a part of the period, or a value is not a positive number.
    """
    check_positive("mesh_stiffness", mesh_stiffness)
    check_positive("tolerance", tolerance)
    ratio, overlap = geometry.contact_ratio, geometry.overlap_ratio
    share = 0.75 * ratio / (0.75 * ratio + 0.25)  # of the mean stiffness that is proportional to the number of pairs
    length = relative_length(ratio, overlap)
    curve = PeriodicCurve(length.knots, 1 + share * (length.first - 1), 1 + share * (length.last - 1))
    reference = mesh_stiffness * geometry.common_face_width
    if overlap == 0 and ratio < 2:
        single = 1 / (0.75 * ratio + 0.25)
        return MeshStiffness(reference, TwoLevelStiffness(1.75 * single - 1, 1 - single, ratio), 0.0, ISO)
    series = None
    if overlap:
        amplitudes, phases = fourier_coefficients(ratio, overlap, MAX_HARMONICS)
        series = truncated_series(curve, share * amplitudes, phases, tolerance)
    waveform, error = series if series and series[1] <= tolerance else approximate(curve, tolerance)
    return MeshStiffness(reference, waveform, error, ISO, truncation_note(error, tolerance))


def _one_pair(design: Drawing) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """The stiffness of one pair over c_γα b, and where on its path each part begins.

    Where n pairs are on the path it is an nth of what they have together by the law of `from_iso`, c′ b
    (0.75 + 0.25/n): c′ b alone, 0.875 c′ b beside one other, 0.833 c′ b beside two. So the mean of the sum over the
    mesh period is c_γα b at every contact ratio.
    """
    ratio = design.geometry.contact_ratio
    single, fewest = 1 / (0.75 * ratio + 0.25), math.floor(ratio)
    # one pair more is on the path from the beginning of each mesh period until the first one leaves
    parts = [(at / ratio, (0.75 + 0.25 / pairs) * single) for k in range(fewest + 1) for at, pairs in (
        (k, fewest + 1), (k + (ratio - fewest), fewest))]
    ends = [start for start, _ in parts[1:]]  # the last part would begin at the end of the path
    kept = [part for part, end in zip(parts, ends, strict=False) if end - part[0] > _SAME_POSITION]
    starts, levels = zip(*kept, strict=True)
    return levels, (0.0, *starts[1:])


METHOD = StiffnessMethod(
    name=ISO, pair=_one_pair, compute=lambda design: from_iso(design.geometry, design.tooth_stiffness.mesh_stiffness),
    warnings=lambda design: design.tooth_stiffness.warnings)
