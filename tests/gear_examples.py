"""Gear pairs of published examples, as geometries."""

import math
from dataclasses import replace
from typing import Any

from gearchaos.gears.geometry.dimensions import Geometry

ISO_TR_EXAMPLE_1 = Geometry(
    teeth=(17, 103), normal_module=8e-3, pressure_angle=math.radians(20), helix_angle=math.radians(15.8),
    profile_shift=(0.145, 0.0), centre_distance=0.5, face_width=(0.1, 0.1), dedendum=1.4, root_radius=0.39)
"""ISO/TR 6336-30:2017, example 1, with tip diameters that are not rounded."""

SPUR_62 = Geometry(
    teeth=(62, 62), normal_module=2e-3, pressure_angle=math.radians(20), helix_angle=0.0, profile_shift=(0.0, 0.0),
    centre_distance=0.124, face_width=(0.02, 0.02))
"""Two equal spur gears with the standard basic rack."""


def spur(**changes: Any) -> Geometry:
    """The pair of two equal spur gears with other values; without a centre distance, at the reference one."""
    pair = replace(SPUR_62, **changes)
    if "centre_distance" in changes:
        return pair
    return replace(pair, centre_distance=sum(pair.reference_diameter) / 2)
