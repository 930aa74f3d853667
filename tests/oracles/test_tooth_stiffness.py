"""Tooth stiffness compared with a tooth that is cut numerically, and with the published numbers of the package ROSS."""

import math

import numpy as np
import pytest
from scipy.integrate import trapezoid

from gearchaos.gears.geometry.mechanics import STEEL
from gearchaos.gears.stiffness.potential_energy import (
    ToothPairs,
    foundation_compliance,
    hertz_stiffness,
    tooth_compliance,
    tooth_profile,
)
from tests.gear_examples import spur

pytestmark = pytest.mark.slow

BORE = 0.035
SHIFTED = spur(teeth=(17, 45), profile_shift=(0.4, 0.1), centre_distance=2e-3 * 31.45)


def pair_62():
    """The pair in the tests of ROSS; the straight flank of its rack is as deep as the addendum is high."""
    return spur(root_radius=0.25 / (1 - math.sin(math.radians(20))))


def cut_tooth(geometry, wheel, radii):
    """Half angle of the tooth at given radii: the least angle at which any point of the rolling rack passes there.

    Origin of the rack's coordinates is the pitch point: u along the pitch line from the middle of a rack tooth, h deep.
    """
    module, alpha = geometry.normal_module, geometry.pressure_angle
    pitch, rounding = module * geometry.teeth[wheel] / 2, geometry.root_radius * module
    datum = geometry.profile_shift[wheel] * module  # of the rack above the pitch line
    centre = geometry.dedendum * module - rounding
    normals = np.linspace(alpha, math.pi / 2, 1501)
    flank = np.linspace(-geometry.addendum * module, centre + rounding * math.sin(alpha), 1501)
    middle = math.pi / 4 * module - centre * math.tan(alpha) - rounding / math.cos(alpha)
    u = np.concatenate([math.pi / 4 * module - flank * math.tan(alpha), middle + rounding * np.cos(normals)])
    h = np.concatenate([flank, centre + rounding * np.sin(normals)]) - datum
    inside = radii[:, None] ** 2 - (pitch - h) ** 2
    along = np.sqrt(np.where(inside >= 0, inside, np.nan))
    # the wheel turns by (x − u)/r while the rack moves so that its point (u, h) is at x = ±along on the radius
    angles = [np.arctan2(x, pitch - h) - (x - u) / pitch for x in (along, -along)]
    widest = np.nanmax(np.array(angles), axis=(0, 2))  # how far the rack reaches from the middle of the space
    return math.pi / geometry.teeth[wheel] - widest


def numerical_compliance(geometry, wheel, bore, angle):
    """Compliance of a tooth by integrating over the section that was cut, m/N for the width and E of the pair."""
    root, contact = geometry.root_diameter[wheel] / 2, geometry.base_diameter[wheel] / 2 / math.cos(angle)
    near_root = 1e-9 + np.linspace(0, 1, 1000) ** 3 * 0.02
    radii = np.append(root * (1 + near_root), np.linspace(1.02 * root, contact, 1500)[1:])
    half = cut_tooth(geometry, wheel, radii)
    x, y = radii * np.sin(half), radii * np.cos(half)
    slope = angle - half[-1]  # of the normal against the x axis
    cosine, sine = math.cos(slope), math.sin(slope)
    E, G, b = STEEL.E, STEEL.E / (2 * (1 + STEEL.poisson)), geometry.common_face_width
    arm = cosine * (y[-1] - y) - sine * x[-1]
    beam = arm**2 / (E * b * (2 * x) ** 3 / 12) + 1.2 * cosine**2 / (G * b * 2 * x) + sine**2 / (E * b * 2 * x)
    theta, h = half[0], root / (bore / 2)
    star = [a / theta**2 + c * h**2 + d * h / theta + e / theta + f * h + g for a, c, d, e, f, g in (
        (-5.574e-5, -1.9986e-3, -2.3015e-4, 4.7702e-3, 0.0271, 6.8045),
        (60.111e-5, 28.100e-3, -83.431e-4, -9.9256e-3, 0.1624, 0.9086),
        (-50.952e-5, 185.50e-3, 0.0538e-4, 53.300e-3, 0.2895, 0.9236),
        (-6.2042e-5, 9.0889e-3, -4.0964e-4, 7.8297e-3, -0.1472, 0.6904))]
    u = (y[-1] - x[-1] * math.tan(slope) - root) / (2 * root * theta)
    body = cosine**2 * (star[0] * u**2 + star[1] * u + star[2] * (1 + star[3] * math.tan(slope) ** 2)) / (E * b)
    return trapezoid(beam, y) + body


@pytest.mark.parametrize(("geometry", "wheel", "bore", "angles"), [
    (pair_62(), 0, 0.035, (0.28, 0.35, 0.42)),
    (SHIFTED, 0, 0.01, (0.25, 0.40, 0.55)),
    (SHIFTED, 1, 0.03, (0.30, 0.45)),
    (spur(teeth=(13, 60)), 0, 0.008, (0.25, 0.40, 0.50)),
    (spur(teeth=(30, 50), root_radius=0.1, profile_shift=(-0.2, 0.2)), 0, 0.02, (0.30, 0.40)),
], ids=["62", "17 shifted", "45 shifted", "13 undercut", "30 sharp"])
def test_compliance_is_that_of_the_tooth_that_the_rack_cuts(geometry, wheel, bore, angles):
    profile = tooth_profile(geometry, wheel)
    for angle in angles:
        found = tooth_compliance(profile, bore, STEEL, geometry.common_face_width, np.array(angle)).total
        assert float(found) == pytest.approx(numerical_compliance(geometry, wheel, bore, angle), rel=1e-5)


class Ross:
    """The pair 62/62 with the conventions of ROSS 2.3, which differ from those here in three points.

    Half the root angle θ_f is (π/2 + 2 tan α (h_a − ρ) + 2 ρ/cos α)/z, smaller than that of the cut tooth; the lever of
    the load on the wheel body ends at the point of contact instead of at the line of action; and the pressure angle
    instead of the rotation advances linearly, from the beginning of the involute instead of that of contact."""

    def __init__(self):
        self.pair = pair_62()
        self.profile = tooth_profile(self.pair, 0)
        alpha, rounding = self.pair.pressure_angle, self.pair.root_radius
        self.theta = (math.pi / 2 + 2 * math.tan(alpha) * (1 - rounding) + 2 * rounding / math.cos(alpha)) / 62

    def compliance(self, angle):
        """Compliance of one tooth, m/N."""
        slope = self.profile.slope(angle)
        lever = self.profile.flank(slope)[1] - self.profile.root_radius
        body = foundation_compliance(self.profile.root_radius, self.theta, BORE, lever, slope) / (STEEL.E * 0.02)
        return sum(tooth_compliance(self.profile, BORE, STEEL, 0.02, angle)[:3]) + body

    def pair_stiffness(self, advance):
        """Stiffness of a tooth pair, N/m, by the pressure angle from the beginning of the involute of wheel 1."""
        tip = math.acos(self.profile.base_radius / 0.064)
        first, second = self.profile.form_angle + advance, tip - advance
        return 1 / (1 / hertz_stiffness((STEEL, STEEL), 0.02) + self.compliance(first) + self.compliance(second))

    def curve(self, fractions):
        """Mesh stiffness, N/m."""
        ratio = self.pair.contact_ratio
        period = (math.acos(self.profile.base_radius / 0.064) - self.profile.form_angle) / ratio
        second = np.where(fractions <= ratio - 1, self.pair_stiffness(period * (fractions + 1)), 0.0)
        return self.pair_stiffness(period * fractions) + second


def test_the_numbers_of_ross_are_reproduced_with_its_conventions():
    """The tests of ROSS 2.3 hold the contact ratio, the Hertz stiffness and the first five values of the curve."""
    ross = Ross()
    assert ross.pair.contact_ratio == pytest.approx(1.7897798668330458, rel=1e-14)
    assert hertz_stiffness((STEEL, STEEL), 0.02) == pytest.approx(3555868607.9093266, rel=1e-14)
    assert ross.profile.form_angle == pytest.approx(0.2577380345253824, rel=1e-12)
    assert ross.profile.base_half_angle == pytest.approx(0.04023980849306058, rel=1e-14)
    assert ross.theta == pytest.approx(0.0456584787349235, rel=1e-14)
    curve = ross.curve(np.linspace(0, 1, 1000))
    assert curve[:5] == pytest.approx(
        [396622921.3581085, 396738680.0375346, 396854147.2919756, 396969323.136738, 397084207.5865779], rel=1e-12)
    assert [curve.max(), curve.min(), curve.mean()] == pytest.approx([419.57e6, 229.32e6, 373.51e6], rel=2e-5)
    here = ToothPairs(pair_62(), (STEEL, STEEL), (BORE, BORE)).curve()
    assert [here.mean, here.first.max()] == pytest.approx([390.43e6, 437.96e6], rel=2e-5)  # as checked.md says
