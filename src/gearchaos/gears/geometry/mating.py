"""The three dimensions of a drawing that depend on each other: centre distance, profile shifts, tip alteration."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from gearchaos.errors import InputError
from gearchaos.gears.geometry.dimensions import Geometry, Pair
from gearchaos.gears.geometry.tooth_root import inverse_involute, involute
from gearchaos.gears.units import Length

KEEP_CLEARANCE = "keep clearance"
"""The tip alteration that shortens the teeth until the tip clearance is that of the basic rack."""

_NEGLIGIBLE_SHIFT = 1e-3
"""Largest sum of profile shift coefficients that the rounding of a centre distance explains."""


def mating_geometry(
    values: dict[str, Any], centre_distance: float | None, profile_shift: Pair | None, tip_alteration: Pair | str,
    tip_diameter: Pair | None = None,
) -> Geometry:
    """The geometry of a pair, with what is left out computed.

    ``values`` are the other fields of `Geometry`. A centre distance that is left out is that without backlash, ISO
    21771:2007 Eqs. (54) and (55). Profile shifts that are left out are 0. A tip diameter determines the tip alteration
    instead.

    Raises `InputError` if the shifts are left out and the centre distance needs some: how to split their sum is the
    designer's choice. Also if no centre distance fits the shifts, or the base circles overlap.
    """
    shifts = (0.0, 0.0) if profile_shift is None else profile_shift
    distance = math.inf if centre_distance is None else centre_distance
    given = Geometry(**values, profile_shift=shifts, centre_distance=distance)
    if centre_distance is None:
        given = replace(given, centre_distance=_zero_backlash_distance(given))
    least, distance = sum(given.base_diameter) / 2, given.centre_distance
    if distance <= least:  # there would be no line of action
        raise InputError(
            "centre_distance", f"must be greater than {Length(least, distance)}, the sum of the base radii",
            Length(distance, distance),
            f"Without profile shift it is {Length(_reference_distance(given), distance)}.")
    if profile_shift is None and abs(needed := shift_sum(given)) > _NEGLIGIBLE_SHIFT:
        raise InputError(
            "profile_shift", f"must be given with this centre distance, with a sum of {needed:.6g}", None,
            "Split this sum between the wheels, e.g. in favour of the pinion: there is no split that fits every pair. "
            "Or leave out centre_distance; without profile shift it is "
            f"{Length(_reference_distance(given), centre_distance)}.",
        )
    if tip_diameter is not None:
        first, second = ((own - nominal) / 2 for own, nominal in zip(tip_diameter, given.tip_diameter, strict=True))
        return replace(given, tip_alteration=(first, second))
    if not isinstance(tip_alteration, str):
        return replace(given, tip_alteration=tip_alteration)
    approach = given.centre_distance - _reference_distance(given)
    shortening = min(approach - sum(given.profile_shift) * given.normal_module, 0.0)
    return replace(given, tip_alteration=(shortening, shortening))


def shift_sum(geometry: Geometry) -> float:
    """Sum of profile shift coefficients that leaves no backlash at the centre distance, ISO 21771:2007 Eq. (62).

    x1 + x2 = (z1 + z2)(inv α_wt − inv α_t)/(2 tan α_n).
    """
    opening = involute(geometry.working_pressure_angle) - involute(geometry.transverse_pressure_angle)
    return sum(geometry.teeth) * opening / (2 * math.tan(geometry.pressure_angle))


def _reference_distance(geometry: Geometry) -> float:
    """Reference centre distance a_d = (d1 + d2)/2, m."""
    return sum(geometry.reference_diameter) / 2


def _zero_backlash_distance(geometry: Geometry) -> float:
    """Centre distance without backlash, m: a = (d_b1 + d_b2)/(2 cos α_wt), ISO 21771:2007 Eqs. (54) and (55)."""
    if sum(geometry.profile_shift) == 0:
        return _reference_distance(geometry)
    opening = 2 * sum(geometry.profile_shift) * math.tan(geometry.pressure_angle) / sum(geometry.teeth)
    value = involute(geometry.transverse_pressure_angle) + opening
    if value <= 0:
        # at this sum, which is negative, the working pressure angle without backlash is 0
        least = -sum(geometry.teeth) * involute(geometry.transverse_pressure_angle) / (
            2 * math.tan(geometry.pressure_angle))
        raise InputError(
            "profile_shift", f"must have a sum above {least:.4g} for these teeth",
            geometry.profile_shift, "With less the teeth are so thin that no centre distance closes the backlash.",
        )
    return sum(geometry.base_diameter) / (2 * math.cos(inverse_involute(value)))
