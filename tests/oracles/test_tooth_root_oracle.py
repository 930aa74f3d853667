"""The root form circle against a tooth space that is swept by the points of a rounded rack, one radius at a time."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from gearchaos.gears.geometry.tooth_root import GeneratedTooth
from tests.oracles.involute_oracle import transverse_slope

DEGREE = math.pi / 180
MODULE = 2.5

# teeth, helix angle, profile shift, dedendum, root radius; with undercut
UNDERCUT = [
    (8, 0.0, 0.0, 1.25, 0.38), (10, 0.0, 0.0, 1.25, 0.25), (12, 0.0, -0.2, 1.4, 0.39), (15, 0.0, 0.0, 1.25, 0.0),
    (12, 20 * DEGREE, 0.0, 1.25, 0.38), (9, 30 * DEGREE, -0.1, 1.25, 0.3), (14, 0.0, 0.0, 1.25, 0.38)]
CLEAN = [
    (20, 0.0, 0.0, 1.25, 0.38), (17, 15.8 * DEGREE, 0.145, 1.4, 0.39), (12, 0.0, 0.5, 1.25, 0.38),
    (62, 0.0, 0.0, 1.25, 0.38), (103, 15.8 * DEGREE, 0.0, 1.4, 0.39), (30, 25 * DEGREE, 0.2, 1.25, 0.25)]


def tooth(case):
    teeth, helix_angle, profile_shift, dedendum, root_radius = case
    return GeneratedTooth(teeth=teeth, normal_module=MODULE, pressure_angle=20 * DEGREE, helix_angle=helix_angle,
                          profile_shift=profile_shift, dedendum=dedendum, root_radius=root_radius)


class Sweep:
    """The tooth space that the points of the right side of a rack's tooth leave; its middle has the direction 0.

    Lengths are in normal modules."""

    def __init__(self, case, pressure_angle=20 * DEGREE):
        teeth, self.helix_angle, self.shift, dedendum, self.rounding = case
        self.reference = teeth / math.cos(self.helix_angle) / 2
        slope = transverse_slope(pressure_angle, self.helix_angle)
        self.base = self.reference / math.hypot(1, slope)
        self.normal_slope, self.centre = math.tan(pressure_angle), dedendum - self.rounding  # depth of the arc's centre
        last = self.centre + self.rounding * math.sin(pressure_angle)
        self.aside = math.pi / 4 - last * self.normal_slope - self.rounding * math.cos(pressure_angle)
        self.arc = self.arc_point, np.linspace(pressure_angle, math.pi / 2, 2001)
        self.flank = self.flank_point, np.linspace(-2.0, last, 4001)
        # half the tooth space on the reference circle, where the rack rolls, gives where the involute begins
        half_space = (math.pi / 4 - self.shift * self.normal_slope) / math.cos(self.helix_angle) / self.reference
        self.origin = half_space - (slope - math.atan(slope))

    def arc_point(self, angle):
        """Distance from the middle of the rack's tooth, and depth below the pitch line, of a point of the arc."""
        sideways = (self.aside + self.rounding * np.cos(angle)) / math.cos(self.helix_angle)
        return sideways, self.centre + self.rounding * np.sin(angle) - self.shift

    def flank_point(self, depth):
        """The same for a point of the flank at a depth below the datum line."""
        return (math.pi / 4 - depth * self.normal_slope) / math.cos(self.helix_angle), depth - self.shift

    def widest(self, curve, radius):
        """The greatest polar angle that the points of a curve of the rack reach at a radius, in all its positions."""
        point, parameters = curve

        def reach(parameter, sign):
            sideways, depth = point(parameter)
            height = self.reference - depth
            across = sign * np.sqrt(np.maximum(radius**2 - height**2, 0))
            angle = np.arctan2(across, height) - (across - sideways) / self.reference
            return np.where(np.abs(height) <= radius, angle, -np.inf)

        return max(self._greatest(lambda p, sign=sign: reach(p, sign), parameters) for sign in (1, -1))

    @staticmethod
    def _greatest(function, parameters):
        """The maximum of a function over a range of parameters: the best sample, refined three times."""
        for _ in range(4):
            values = function(parameters)
            best = int(np.argmax(values))
            low, high = parameters[max(best - 1, 0)], parameters[min(best + 1, len(parameters) - 1)]
            parameters = np.linspace(low, high, 401)
        return float(np.max(values))

    def involute(self, radius):
        """Polar angle of the involute at a radius."""
        tangent = math.sqrt(max(radius**2 / self.base**2 - 1, 0.0))
        return self.origin + tangent - math.atan(tangent)


@pytest.mark.parametrize("case", UNDERCUT)
def test_an_undercut_ends_where_the_swept_fillet_crosses_the_involute(case):
    sweep, generated = Sweep(case), tooth(case)
    assert generated.profile_shift < generated.undercut_shift
    crossing = brentq(lambda radius: sweep.widest(sweep.arc, radius) - sweep.involute(radius),
                      sweep.base * (1 + 1e-9), sweep.reference, xtol=1e-13)
    assert generated.form_radius / MODULE == pytest.approx(crossing, rel=1e-9)
    for radius in np.linspace(crossing * 1.0001, sweep.reference * 1.02, 5):  # the flank above is the whole involute
        assert sweep.widest(sweep.flank, radius) == pytest.approx(sweep.involute(radius), abs=1e-9)


@pytest.mark.parametrize("case", CLEAN)
def test_without_undercut_the_flank_of_the_rack_sweeps_the_involute_down_to_the_form_circle(case):
    sweep, generated = Sweep(case), tooth(case)
    assert generated.profile_shift >= generated.undercut_shift
    for radius in np.linspace(generated.form_radius / MODULE * (1 + 1e-7), sweep.reference * 1.02, 5):
        assert sweep.widest(sweep.flank, radius) == pytest.approx(sweep.involute(radius), abs=1e-9)
        assert sweep.widest(sweep.arc, radius) < sweep.involute(radius)
    below = generated.form_radius / MODULE - 0.01
    swept = max(sweep.widest(sweep.flank, below), sweep.widest(sweep.arc, below))
    assert swept < (sweep.involute(below) if below > sweep.base else sweep.origin) - 1e-7


def test_the_limit_of_undercut_is_where_the_form_circle_is_the_base_circle():
    for teeth, helix_angle, _, dedendum, root_radius in CLEAN:
        limit = tooth((teeth, helix_angle, 0.0, dedendum, root_radius)).undercut_shift
        case = (teeth, helix_angle, limit, dedendum, root_radius)
        assert tooth(case).form_radius / MODULE == pytest.approx(Sweep(case).base, rel=1e-12)
