"""Whether the tip of a tooth enters the root fillet of the mating wheel.

Contact that begins on the involute (d_Nf ≥ d_Ff) does not exclude it: after the first contact the corner between flank
and tip circle moves on towards the root of the mate, along a trochoid, and a large fillet can reach into its path.
"""

from __future__ import annotations

import math
from dataclasses import replace

from gearchaos.gears.geometry.dimensions import Geometry

_FILLET_POINTS = 32
"""Points of a fillet that are compared with the path of the mating tip."""

_ROUNDING = 1e-9
"""Depth, in normal modules, that rounding errors explain."""


def interference_depth(geometry: Geometry, wheel: int) -> float:
    """How deep the tip of the mate enters the fillet of one wheel, m, along the circumference; negative if it does not.

    In the transverse plane, and whatever the backlash: thinner teeth have their fillets nearer to their axes by the
    same angle as their flanks.

    In polar coordinates fixed to the wheel the corner of the mate's tip is at ψ − t z_mate/z, where t is its angle
    from the line of centres about the mate's axis, and ψ about the axis of the wheel. It is on the flank, at the start
    of active profile, at the first contact, and nearest to the fillet between there and the line of centres.

    Parameters
    ----------
    geometry : Geometry
        A pair whose contact begins on the involutes.
    wheel : int
        The wheel with the fillet: 0 for wheel 1, 1 for wheel 2.
    """
    tooth, path = geometry.generated_tooth(wheel), _CornerPath(geometry, wheel)
    first, last = tooth.form_slope, math.pi / 2
    depths = [-math.inf]
    for i in range(_FILLET_POINTS + 1):
        radius, position = tooth.fillet(first + (last - first) * i / _FILLET_POINTS)
        if path.least_radius < radius <= path.start_radius:
            depths.append((path.position(radius) - position) * radius)
    return max(depths)


class _CornerPath:
    """Path of the tip corner of the mate in polar coordinates of a wheel, from the first contact to the centre line.

    The polar angle is measured from the middle of the tooth space towards the flank.
    """

    def __init__(self, geometry: Geometry, wheel: int) -> None:
        mate = 1 - wheel
        self._distance, self._tip = geometry.centre_distance, geometry.tip_diameter[mate] / 2
        self._ratio = geometry.teeth[mate] / geometry.teeth[wheel]
        self.least_radius = self._distance - self._tip
        self.start_radius = geometry.start_of_active_profile[wheel] / 2
        tip_angle = math.atan2(geometry.tip_tangents[mate], geometry.base_diameter[mate] / 2)
        start = tip_angle - geometry.working_pressure_angle
        self._side = math.copysign(1.0, start)
        self._offset = geometry.generated_tooth(wheel).flank_position(self.start_radius) - self._turned(start)

    def _turned(self, angle: float) -> float:
        """ψ − t z_mate/z for the angle t of the corner from the line of centres."""
        along = self._distance - self._tip * math.cos(angle)
        return math.atan2(self._tip * math.sin(angle), along) - self._ratio * angle

    def position(self, radius: float) -> float:
        """Polar angle of the corner where it is at this radius from the axis of the wheel, rad."""
        cosine = (self._distance**2 + self._tip**2 - radius**2) / (2 * self._distance * self._tip)
        return self._offset + self._turned(self._side * math.acos(min(cosine, 1.0)))


def enters_fillet(geometry: Geometry, wheel: int) -> bool:
    """Whether the tip of the mate enters the fillet of one wheel by more than rounding errors."""
    return interference_depth(geometry, wheel) > _ROUNDING * geometry.normal_module


def largest_tip_diameter(geometry: Geometry, wheel: int) -> float:
    """The largest tip diameter of the mate that does not enter the fillet of one wheel, m, by bisection."""
    mate, alterations = 1 - wheel, list(geometry.tip_alteration)
    least, most = alterations[mate] - geometry.normal_module, alterations[mate]
    for _ in range(40):
        alterations[mate] = (least + most) / 2
        if enters_fillet(replace(geometry, tip_alteration=(alterations[0], alterations[1])), wheel):
            most = alterations[mate]
        else:
            least = alterations[mate]
    return geometry.tip_diameter[mate] + 2 * (least - geometry.tip_alteration[mate])
