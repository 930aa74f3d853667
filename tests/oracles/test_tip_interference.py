"""Tips that enter the mate's fillet, compared with the outlines of the teeth in many positions of the wheels."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gearchaos.gears.design.transverse_section import TransverseSection
from gearchaos.gears.geometry.checks import enters_fillet, interference_depth, largest_tip_diameter
from gearchaos.gears.geometry.dimensions import Geometry, mating_geometry

DEGREE = math.pi / 180
PAIRS = {
    "20/40, long teeth": {"teeth": (20, 40), "tip_alteration": (0.0, 0.5e-3)},
    "40/20, long teeth": {"teeth": (40, 20), "tip_alteration": (0.5e-3, 0.0)},
    "24/21, shifted": {"teeth": (24, 21), "profile_shift": (0.775, 0.594), "addendum": 0.9, "dedendum": 1.1,
                       "root_radius": 0.3},
    "15/50, helical": {"teeth": (15, 50), "helix_angle": 25 * DEGREE, "profile_shift": (0.123, 0.928),
                       "addendum": 1.09, "dedendum": 1.18, "root_radius": 0.29}}


def pair(**changes) -> Geometry:
    """A pair of module 3 mm without backlash."""
    values = {"normal_module": 3e-3, "pressure_angle": 20 * DEGREE, "helix_angle": 0.0, "face_width": (0.03, 0.03),
              "profile_shift": (0.0, 0.0), "tip_alteration": (0.0, 0.0), **changes}
    return mating_geometry(values, None, values.pop("profile_shift"), values.pop("tip_alteration"))


def tip_in_fillet(geometry: Geometry, wheel: int) -> float:
    """How deep, along the circumference, corners of the mate's tip lie within the teeth of a wheel, m.

    From the outlines of both, in positions along a mesh period on either side of the first contact."""
    depths = [-math.inf]
    for phase in np.arange(0, 1, 1 / 128):
        section = TransverseSection(geometry, max(geometry.theoretical_backlash, 0.0), float(phase))
        centre = section.centres[wheel]
        teeth = np.array(section.outline(wheel, range(-3, 4), detail=40.0)) - centre
        tips = np.array(section.outline(1 - wheel, range(-3, 4), detail=0.0)) - centre
        reach = np.hypot(*(tips + centre - section.centres[1 - wheel]).T)
        tips = tips[reach > geometry.tip_diameter[1 - wheel] / 2 * (1 - 1e-9)]
        for x, y in tips[np.hypot(*tips.T) < geometry.root_form_diameter[wheel] / 2]:
            radius, angle = math.hypot(x, y), math.atan2(y, x)
            depths.append(circumferential_depth(teeth, radius, angle))
    return max(depths)


def circumferential_depth(teeth: np.ndarray, radius: float, angle: float) -> float:
    """How far a point within a tooth is from the nearest side of the outline on the same circle; negative outside."""
    radii, angles = np.hypot(*teeth.T), np.unwrap(np.arctan2(teeth[:, 1], teeth[:, 0]))
    crossing = np.flatnonzero((radii[:-1] - radius) * (radii[1:] - radius) <= 0)
    share = (radius - radii[crossing]) / (radii[crossing + 1] - radii[crossing])
    sides = angles[crossing] + share * (angles[crossing + 1] - angles[crossing])
    away = (sides - angle + math.pi) % (2 * math.pi) - math.pi
    nearest = int(np.argmin(np.abs(away)))
    rising = radii[crossing[nearest] + 1] > radii[crossing[nearest]]
    within = away[nearest] < 0 if rising else away[nearest] > 0
    return float(np.abs(away[nearest]) * radius * (1 if within else -1))


@pytest.mark.slow
@pytest.mark.parametrize("name", PAIRS)
def test_the_depth_is_that_of_the_outlines(name):
    geometry = pair(**PAIRS[name])
    wheel = int(interference_depth(geometry, 1) > interference_depth(geometry, 0))
    assert enters_fillet(geometry, wheel)
    depth = interference_depth(geometry, wheel)
    assert depth > 5e-6 and tip_in_fillet(geometry, wheel) == pytest.approx(depth, rel=0.02)


@pytest.mark.parametrize("name", PAIRS)
def test_the_largest_tip_diameter_only_just_passes(name):
    geometry = pair(**PAIRS[name])
    wheel = int(interference_depth(geometry, 1) > interference_depth(geometry, 0))
    largest = largest_tip_diameter(geometry, wheel)
    for excess, enters in ((-1e-6, False), (1e-6, True)):
        alterations = list(geometry.tip_alteration)
        alterations[1 - wheel] += (largest + excess - geometry.tip_diameter[1 - wheel]) / 2
        changed = replace(geometry, tip_alteration=tuple(alterations))
        assert changed.tip_diameter[1 - wheel] == pytest.approx(largest + excess, rel=1e-12)
        assert enters_fillet(changed, wheel) is enters


def test_teeth_of_the_basic_rack_pass():
    for teeth in ((18, 18), (20, 40), (17, 103), (62, 62)):
        for wheel in (0, 1):
            assert not enters_fillet(pair(teeth=teeth, profile_shift=(0.1, -0.1)), wheel)
