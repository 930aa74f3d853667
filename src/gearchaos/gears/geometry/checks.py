"""Whether a pair of wheels with given dimensions can run, and what its designer should know about it."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Any

from gearchaos.errors import InputError
from gearchaos.gears.geometry.dimensions import Geometry, shift_sum
from gearchaos.gears.geometry.internal import InternalGeometry
from gearchaos.gears.io.units import Length

LEAST_TIP_THICKNESS = 0.2  # tip thickness in normal modules below which there is a warning, ISO 21771:2007 7.9
# tip clearance in normal modules below which there is a warning; that of profile A of ISO 53:1998 is 0.25
LEAST_TIP_CLEARANCE = 0.1
LARGE_BACKLASH = 0.1  # theoretical backlash, in normal modules, above which there is a warning
# theoretical backlash, in normal modules, that the rounding of profile shifts to two decimals explains
SHIFT_TOLERANCE = 0.01
_FILLET_POINTS = 32  # points of a fillet that are compared with the path of the mating tip
_ROUNDING = 1e-9  # depth, in normal modules, that rounding errors explain


def check_rack(rack: Any, pressure_angle: float) -> None:
    """Raise `InputError` unless a rack has a straight flank and room for its fillet, DIN 867:1986, ISO 53:1998."""
    sine, tangent = math.sin(pressure_angle), math.tan(pressure_angle)
    deepest = math.pi / 4 / tangent
    if rack.dedendum >= deepest:
        raise InputError("rack.dedendum", f"must be less than {deepest:.4g} modules", rack.dedendum,
                         "At that depth the flanks of the rack intersect.")
    largest = (math.pi / 4 - rack.dedendum * tangent) * math.cos(pressure_angle) / (1 - sine)
    largest = min(largest, rack.dedendum / (1 - sine))
    if rack.root_radius > largest:
        raise InputError("rack.root_radius", f"must be at most {largest:.4g} modules", rack.root_radius,
                         "A larger fillet does not fit between the flanks of the rack.")


def check_geometry(geometry: Geometry) -> None:
    """Raise `InputError` if the pair cannot run; its field is an input, or a property of `Geometry` out of bounds."""
    if geometry.theoretical_backlash < -SHIFT_TOLERANCE * geometry.normal_module:
        raise InputError(
            "profile_shift", f"must have a sum of at most {shift_sum(geometry):.6g} at this centre distance",
            geometry.profile_shift,
            f"Teeth of nominal thickness overlap by {-geometry.theoretical_backlash * 1e6:.4g} µm along the line of "
            "action. Leave out centre_distance to have it computed from the shifts.")
    shown = partial(Length, like=geometry.normal_module)
    for wheel in (0, 1):
        root, tip, base = geometry.root_diameter[wheel], geometry.tip_diameter[wheel], geometry.base_diameter[wheel]
        if geometry.signs[wheel] > 0 and (root <= 0 or tip <= max(base, root)):
            raise InputError(
                f"tip_diameter[{wheel}]", f"must be greater than those of the base circle, {shown(base)}, and of the "
                f"root, {shown(root)}, and these greater than 0", shown(tip),
                "Check the rack, profile_shift and tip_alteration.")
        if (thickness := geometry.tip_thickness[wheel]) <= 0:
            raise InputError(
                f"tip_thickness[{wheel}]", "must be greater than 0", shown(thickness),
                "The flanks of the tooth meet below its tip. Give a smaller profile_shift or addendum, or shorten the "
                "tooth by a negative tip_alteration.")
        if (clearance := geometry.tip_clearance[wheel]) <= 0:
            raise InputError(
                f"tip_clearance[{wheel}]", "must be greater than 0", shown(clearance),
                f"The tip of wheel {wheel + 1} touches the root of wheel {2 - wheel}. Shorten the teeth by a negative "
                "tip_alteration or 'keep clearance', or give smaller profile shifts or tip diameters.")
        start, form = geometry.start_of_active_profile[wheel], geometry.root_form_diameter[wheel]
        if geometry.signs[wheel] < 0:
            continue  # a ring's fillet is that of its cutter
        if not start >= form:  # also if start is not a number
            undercut = geometry.profile_shift[wheel] < (least := geometry.undercut_shift[wheel])
            base, ring = (d / 2 for d in geometry.base_diameter)
            inner = 2 * math.hypot(ring, geometry.tangent_length + math.sqrt(max(form**2 / 4 - base**2, 0.0)))
            raise InputError(
                f"start_of_active_profile[{wheel}]", f"must not be below the root form diameter, {shown(form)}",
                "a contact below the base circle" if math.isnan(start) else shown(start),
                f"The tip of wheel {2 - wheel} meets the root of wheel {wheel + 1} where its flank is no involute. "
                f"Give wheel {wheel + 1} a larger profile_shift, or shorten the teeth of wheel {2 - wheel} by "
                "tip_alteration." + f" Without undercut profile_shift[{wheel}] is at least {least:.4g}." * undercut
                + f" The ring clears it with a tip_diameter from {shown(inner)} on." * (geometry.signs[1] < 0))
        if enters_fillet(geometry, wheel):
            mate, depth = 1 - wheel, interference_depth(geometry, wheel) * 1e6
            raise InputError(
                f"tip_diameter[{mate}]",
                f"must be at {'most' if geometry.signs[mate] > 0 else 'least'} "
                f"{shown(largest_tip_diameter(geometry, wheel))}",
                shown(geometry.tip_diameter[mate]),
                f"After the first contact the tip of wheel {mate + 1} enters the root fillet of wheel {wheel + 1}, "
                f"by {depth:.3g} µm. Shorten the teeth of wheel {mate + 1} by tip_alteration, or give a rack with a "
                "smaller root_radius or a larger dedendum.")
    if geometry.contact_ratio < 1:
        raise InputError("contact_ratio", "must be at least 1", geometry.contact_ratio,
                         "Between two pairs of teeth there would be none in contact. Give more addendum, a "
                         f"{'smaller' if geometry.signs[1] > 0 else 'larger'} centre_distance or a smaller sum of "
                         "profile_shift.")
    if isinstance(geometry, InternalGeometry) and geometry.tip_gap <= 0:
        raise InputError("teeth", "must leave the tips room to pass each other after contact", list(geometry.teeth),
                         f"They collide by {-geometry.tip_gap * 1e6:.4g} µm on the tip circle of the ring. Give the "
                         "ring more teeth, shorten the teeth by a negative tip_alteration, or give a larger "
                         "centre_distance with shifts for it.")


def geometry_warnings(geometry: Geometry) -> tuple[str, ...]:
    """Sentences about dimensions that are possible but unusual."""
    found, backlash, module = [], geometry.theoretical_backlash, geometry.normal_module
    if backlash > LARGE_BACKLASH * module:
        found.append(f"Teeth of nominal thickness have a backlash of {backlash * 1e3:.4g} mm along the line of action; "
                     f"without it profile_shift would have the sum {shift_sum(geometry):.4g} at this centre distance.")
    for wheel, name in enumerate(("wheel 1", "wheel 2")):
        if (thickness := geometry.tip_thickness[wheel]) < LEAST_TIP_THICKNESS * module:
            found.append(f"The teeth of {name} are {thickness * 1e3:.4g} mm thick at the tip, less than "
                         f"{LEAST_TIP_THICKNESS} m_n (ISO 21771:2007, 7.9).")
        if geometry.profile_shift[wheel] < (least := geometry.undercut_shift[wheel]):
            found.append(f"The teeth of {name} are undercut: profile_shift[{wheel}] is "
                         f"{geometry.profile_shift[wheel]:.4g}, and without undercut at least {least:.4g}.")
        if (clearance := geometry.tip_clearance[wheel]) < LEAST_TIP_CLEARANCE * module:
            found.append(f"Between the tip of {name} and the root of wheel {2 - wheel} there are "
                         f"{clearance * 1e3:.4g} mm, less than {LEAST_TIP_CLEARANCE} m_n.")
    return tuple(found)


def interference_depth(geometry: Geometry, wheel: int) -> float:
    """How deep the tip of the mate enters the fillet of a wheel, m, along the circumference; negative if not.

    Contact that begins on the involute (d_Nf ≥ d_Ff) does not exclude it: after the first contact the corner between
    flank and tip circle moves on towards the root of the mate, along a trochoid, and a large fillet can reach into its
    path.

    In the transverse plane, and whatever the backlash: thinner teeth have their fillets nearer to their axes by the
    same angle as their flanks. In polar coordinates of the wheel, from the middle of its tooth space towards the flank,
    the corner is at ψ − t z_mate/z, where t is its angle from the line of centres about the mate's axis, and ψ about
    the axis of the wheel. It is on the flank, at the start of active profile, at the first contact, and nearest to the
    fillet between there and the line of centres.
    """
    mate, tooth = 1 - wheel, geometry.generated_tooth(wheel)
    distance, tip = geometry.centre_distance, geometry.tip_diameter[mate] / 2
    start_radius, ratio = geometry.start_of_active_profile[wheel] / 2, geometry.teeth[mate] / geometry.teeth[wheel]

    def turned(angle: float) -> float:
        """ψ − t z_mate/z for the angle t of the corner from the line of centres."""
        return math.atan2(tip * math.sin(angle), sign * (distance - tip * math.cos(angle))) - ratio * angle

    sign = geometry.signs[mate]
    start = math.atan2(geometry.tip_tangents[mate], geometry.base_diameter[mate] / 2) - geometry.working_pressure_angle
    start *= sign
    offset = tooth.flank_position(start_radius) - turned(start)
    first, last, depth = tooth.form_slope, math.pi / 2, -math.inf
    for i in range(_FILLET_POINTS + 1):
        radius, position = tooth.fillet(first + (last - first) * i / _FILLET_POINTS)
        if abs(distance - tip) < radius <= start_radius:
            cosine = (distance**2 + tip**2 - radius**2) / (2 * distance * tip)
            angle = math.copysign(1.0, start) * math.acos(min(cosine, 1.0))
            depth = max(depth, (offset + turned(angle) - position) * radius)
    return depth


def enters_fillet(geometry: Geometry, wheel: int) -> bool:
    """Whether the tip of the mate enters the fillet of one wheel by more than rounding errors."""
    return interference_depth(geometry, wheel) > _ROUNDING * geometry.normal_module


def largest_tip_diameter(geometry: Geometry, wheel: int) -> float:
    """The largest tip diameter of the mate, of a ring the smallest, that does not enter the fillet of one wheel, m, by
    bisection."""
    mate, own = 1 - wheel, geometry.tip_alteration
    least, most = own[mate] - geometry.normal_module, own[mate]
    for _ in range(40):
        middle = (least + most) / 2
        shortened = replace(geometry, tip_alteration=(own[0], middle) if mate else (middle, own[1]))
        least, most = (least, middle) if enters_fillet(shortened, wheel) else (middle, most)
    return geometry.tip_diameter[mate] + 2 * geometry.signs[mate] * (least - own[mate])
