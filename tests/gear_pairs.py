"""Gear pairs that tests share."""

import math
from types import SimpleNamespace

from gearchaos.gears.geometry import Geometry

STEEL = SimpleNamespace(E=206e9, poisson=0.3)

SHARP_CORNER = 0.25 / (1 - math.sin(math.radians(20)))
"""Root radius of the basic rack, in modules, whose straight flank is as deep as the addendum is high."""

BORE = (0.035, 0.035)
"""Bores of `pair_62`, m."""


def spur_pair(teeth=(62, 62), module=2e-3, shift=(0.0, 0.0), distance=None, width=0.02, **rack):
    """A pair of spur gears; with the centre distance of unshifted wheels unless it is given."""
    return Geometry(
        teeth=teeth, normal_module=module, pressure_angle=math.radians(20), helix_angle=0.0, profile_shift=shift,
        centre_distance=distance or module * sum(teeth) / 2, face_width=(width, width), **rack,
    )


def pair_62(**changes):
    """The pair of spur gears with 62 teeth each, m = 2 mm, b = 20 mm, that the package ROSS uses in its tests."""
    return spur_pair(**{"root_radius": SHARP_CORNER, **changes})


def helical_pair():
    """Example 1 of ISO/TR 6336-30:2017."""
    return Geometry(
        teeth=(17, 103), normal_module=8e-3, pressure_angle=math.radians(20), helix_angle=math.radians(15.8),
        profile_shift=(0.145, 0.0), centre_distance=0.5, face_width=(0.1, 0.1), dedendum=1.4, root_radius=0.39,
    )
