"""Mesh stiffness of spur gears by the potential-energy method.

A tooth is a beam of variable section from the root circle to the point of contact, loaded along the line of action. The
compliances by bending, shear and axial compression (D. C. H. Yang and J. Y. Lin, *J. Mech. Trans. Autom. Des.* 109,
1987, 189-196; X. Tian, 2004, for shear), of the wheel body under the tooth (P. Sainsot, P. Velex and O. Duverger, *J.
Mech. Des.* 126, 2004, 748-752) and of the Hertz contact (D. C. H. Yang and Z. S. Sun, 1985) add up. The section is
that which the basic rack generates (H. Ma et al., *Eng. Fail. Anal.* 44, 2014, 179-194), whether the base circle is
larger or smaller than the root circle.

A cracked tooth is a beam that is thinner there (S. Wu, M. J. Zuo and A. Parey, *J. Sound Vib.* 317, 2008, 608-624).

Tooth pairs in contact at the same time add up as parallel springs. Each deforms the wheel body under its neighbour too,
which this neglects; finite elements give less stiffness in double contact (Ma et al., 2014). Accepted methods differ by
20 % and more.

All stiffnesses are along the line of action, in the transverse plane.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gearchaos.errors import InputError
from gearchaos.gears.io.units import Length, Shown
from gearchaos.gears.stiffness import Drawing, MeshStiffness, StiffnessMethod, from_curve
from gearchaos.gears.stiffness.periodic_curves import PeriodicCurve, periodic_curve

if TYPE_CHECKING:
    from gearchaos.gears.geometry.dimensions import Geometry
    from gearchaos.gears.geometry.mechanics import Material

_NAME = "potential energy"
_PARTS = 16  # parts of the path of contact on which the stiffness of one pair is constant
CRACK_ANGLE = math.pi / 4  # between a crack and the axis of the tooth
CRITICAL_ANGLE = math.pi / 6  # between the tangent of the fillet and that axis, where a crack begins: ISO 6336-3
SHEAR_FACTOR = 1.2  # shear energy of a rectangular section over that of a uniform shear stress

# coefficients A to F (columns) of L*, M*, P* and Q* (rows), Sainsot et al. (2004), Table 1
_SAINSOT = np.array([
    [-5.574e-5, -1.9986e-3, -2.3015e-4, 4.7702e-3, 0.0271, 6.8045],
    [60.111e-5, 28.100e-3, -83.431e-4, -9.9256e-3, 0.1624, 0.9086],
    [-50.952e-5, 185.50e-3, 0.0538e-4, 53.300e-3, 0.2895, 0.9236],
    [-6.2042e-5, 9.0889e-3, -4.0964e-4, 7.8297e-3, -0.1472, 0.6904]])
BODY_RATIOS = (1.4, 7.0)  # range of h = r_f/r_bore for which Sainsot et al. (2004) fitted the coefficients
ROOT_ANGLES = (0.01, 0.12)  # range of θ_f, rad, for which Sainsot et al. (2004) fitted the coefficients
_COMPARED_RATIO = 6.0  # at which a note compares the stiffness with that at the end of the range of h
# Gauss nodes along the fillet and the flank, with which integrals converge to about 1e-12
_FILLET_NODES, _FLANK_NODES = 48, 24


class Stations(NamedTuple):
    """Nodes of a quadrature over the height of a tooth, (..., nodes), m: the integral of f over it is Σ weight f."""

    height: np.ndarray
    half_thickness: np.ndarray
    weight: np.ndarray


@dataclass(frozen=True)
class ToothProfile:
    """Half of a tooth that is symmetric about its axis; radii in m, angles in rad."""

    base_radius: float
    root_radius: float
    base_half_angle: float  # θ_b: half the angle between the flanks at the base circle, π/(2z) + 2 x tan α/z + inv α
    root_half_angle: float  # θ_f: half the angle of the tooth at the root circle, where the fillet begins
    form_angle: float  # pressure angle of the involute where it begins
    rack: Rack

    def slope(self, pressure_angle: np.ndarray) -> np.ndarray:
        """Angle between the normal of the flank and the x axis at points of given pressure angle, tan α_K − θ_b."""
        return np.tan(pressure_angle) - self.base_half_angle

    def flank(self, slope: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Half thickness and height of points of the involute, by their slope."""
        roll, sine, cosine = slope + self.base_half_angle, np.sin(slope), np.cos(slope)
        return self.base_radius * (roll * cosine - sine), self.base_radius * (roll * sine + cosine)

    def flank_stations(self, pressure_angle: np.ndarray) -> Stations:
        """Stations from the beginning of the involute to points of given pressure angle, (..., nodes)."""
        start, end = self.slope(np.array(self.form_angle)), self.slope(pressure_angle)[..., None]
        slope, weight = _gauss(start, end, _FLANK_NODES)
        x, y = self.flank(slope)
        return Stations(y, x, weight * self.base_radius * (slope + self.base_half_angle) * np.cos(slope))

    @property
    def critical_point(self) -> tuple[float, float]:
        """Half thickness and height of the point of the fillet whose tangent makes 30° with the axis of the tooth, the
        critical section of ISO 6336-3, or of its beginning at the flank."""
        from scipy.optimize import brentq  # here, since most of what is computed of gears does not need it

        low = self.rack.flank_normal(self)
        if self.rack.tangent_angle(low) < CRITICAL_ANGLE:
            low = float(brentq(lambda normal: self.rack.tangent_angle(normal) - CRITICAL_ANGLE, low, math.pi / 2))
        x, y = self.rack.fillet(np.array(low))
        return float(x), float(y)

    def fillet_stations(self) -> Stations:
        """Stations from the root circle to the beginning of the involute, (nodes,)."""
        normal, weight = _gauss(np.array(math.pi / 2), np.array(self.rack.flank_normal(self)), _FILLET_NODES)
        x, y = self.rack.fillet(normal)
        return Stations(y, x, weight * self.rack.height_rate(normal))


@dataclass(frozen=True)
class Rack:
    """The tip of the generating rack, which rolls with its pitch line on the pitch circle of the wheel; lengths in m.
    """

    pitch_radius: float  # m z/2
    pressure_angle: float
    radius: float  # of the rounding
    depth: float  # of the centre of the rounding below the pitch line
    offset: float  # of that centre from the axis of the tooth when this is perpendicular to the pitch line

    def fillet(self, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Half thickness and height of points of the fillet, each by that of the rounding with this normal.

        It makes an angle from α at the flank to π/2 at the tip with the pitch line, when it passes the pitch point.
        """
        turn, reach, _ = self._position(normal)
        return (self.pitch_radius * np.sin(turn) - reach * np.cos(normal - turn),
                self.pitch_radius * np.cos(turn) - reach * np.sin(normal - turn))

    def height_rate(self, normal: np.ndarray) -> np.ndarray:
        """Derivative of the height of points of the fillet with respect to the normal, m/rad."""
        turn, reach, advance = self._position(normal)
        falling = reach * np.cos(normal - turn) * (1 + advance / self.pitch_radius)
        return advance * (np.sin(turn) + np.cos(normal) * np.sin(normal - turn)) - falling

    def tangent_angle(self, normal: float) -> float:
        """The angle between the tangent of the fillet and the axis of the tooth, rad, at the point of this normal."""
        return float(normal - self._position(np.array(normal))[0])

    def flank_normal(self, profile: ToothProfile) -> float:
        """The normal where the fillet meets the involute: α, or more if the fillet undercuts the involute."""
        radius = profile.base_radius / math.cos(profile.form_angle)
        low, high = self.pressure_angle, math.pi / 2
        if math.hypot(*self.fillet(np.array(low))) <= radius * (1 + 1e-9):
            return low
        while (middle := (low + high) / 2) not in (low, high):
            low, high = (low, middle) if math.hypot(*self.fillet(np.array(middle))) < radius else (middle, high)
        return low

    def _position(self, normal: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rotation of the wheel, distance of the generated point from the pitch point, and −r d(rotation)/d(normal)."""
        turn = (self.depth / np.tan(normal) + self.offset) / self.pitch_radius
        return turn, self.depth / np.sin(normal) + self.radius, self.depth / np.sin(normal) ** 2


def _gauss(start: np.ndarray, end: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights of the Gauss quadrature from ``start`` to ``end``, (..., count)."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    half = (end - start) / 2
    return start + half * (nodes + 1), half * weights


def tooth_profile(geometry: Geometry, wheel: int) -> ToothProfile:
    """The tooth of a spur wheel, generated by the basic rack, of nominal thickness, with no allowance for backlash."""
    if geometry.helix_angle != 0:
        raise InputError("helix_angle", "must be 0 for the potential-energy method",
                         Shown(geometry.helix_angle, geometry.helix_angle),
                         "It is implemented for spur gears only: use ISO 6336-1 or a table for helical gears.")
    # distance of the centre of the rack's rounding from the middle of the rack's space, in modules
    offset = (math.pi / 4 + (geometry.dedendum - geometry.root_radius) * math.tan(geometry.pressure_angle)
              + geometry.root_radius / math.cos(geometry.pressure_angle))
    if offset > math.pi / 2 * (1 + 1e-12):
        raise InputError("root_radius", "must leave the basic rack a tip that is not pointed", geometry.root_radius,
                         "Reduce the root radius or the dedendum.")
    if geometry.tip_thickness[wheel] <= 0:
        raise InputError(f"tip_thickness[{wheel}]", "must be greater than 0", Length(geometry.tip_thickness[wheel]),
                         "The tooth is pointed: reduce its profile shift or its tip diameter.")
    module, alpha, z = geometry.normal_module, geometry.pressure_angle, geometry.teeth[wheel]
    shift, rounding = geometry.profile_shift[wheel], geometry.root_radius
    centre = geometry.dedendum - rounding  # depth of the centre of the rounding below the datum line, in modules
    base_radius = geometry.base_diameter[wheel] / 2
    return ToothProfile(base_radius=base_radius, root_radius=geometry.root_diameter[wheel] / 2,
                        base_half_angle=(math.pi / 2 + 2 * shift * math.tan(alpha)) / z + math.tan(alpha) - alpha,
                        root_half_angle=2 * offset / z,
                        form_angle=math.acos(min(2 * base_radius / geometry.root_form_diameter[wheel], 1.0)),
                        rack=Rack(module * z / 2, alpha, rounding * module, (centre - shift) * module, offset * module))


class Load(NamedTuple):
    """Point of the load on a tooth, m, and its direction, rad; arrays of equal shape."""

    height: np.ndarray
    half_thickness: np.ndarray
    slope: np.ndarray  # between the force and the perpendicular to the axis of the tooth


class Compliance(NamedTuple):
    """Compliances of one tooth along the line of action, m/N: of the beam by its three modes, and of the wheel body."""

    bending: np.ndarray
    shear: np.ndarray
    axial: np.ndarray
    foundation: np.ndarray | float = 0.0

    @property
    def total(self) -> np.ndarray:
        return self.bending + self.shear + self.axial + self.foundation


def beam_compliance(stations: Stations, load: Load, material: Material, width: float) -> Compliance:
    """Compliance, along the direction of the load, of the part of a tooth of width b that the stations cover.

    1/k_b = ∫ (cos β (y_K − y) − x_K sin β)²/(E I) dy, 1/k_s = ∫ 1.2 cos² β/(G A) dy, 1/k_a = ∫ sin² β/(E A) dy with the
    rectangular sections A = 2 x b, I = 2 x³ b/3 and G = E/(2 (1 + ν)) (Ma et al., 2014, (10)-(16)). Stations are arrays
    (nodes,) or (..., nodes), the load arrays (...).
    """
    cosine, sine = np.cos(load.slope)[..., None], np.sin(load.slope)[..., None]
    arm = cosine * (load.height[..., None] - stations.height) - load.half_thickness[..., None] * sine
    per_area = stations.weight / (2 * stations.half_thickness * width * material.E)
    bending = per_area * 3 * (arm / stations.half_thickness) ** 2
    shear = per_area * SHEAR_FACTOR * cosine**2 * 2 * (1 + material.poisson)
    return Compliance(bending.sum(-1), shear.sum(-1), (per_area * sine**2).sum(-1))


def foundation_compliance(
    root_radius: float, root_half_angle: float, bore: float, lever: np.ndarray, slope: np.ndarray,
) -> np.ndarray:
    """Compliance of the wheel body under a tooth times E b, along the direction of the load: Sainsot et al. (2004).

    E b/k_f = cos² β (L* (u/S)² + M* u/S + P* (1 + Q* tan² β)) with S = 2 r_f θ_f. L*, M*, P* and Q* are polynomials of
    h = r_f/r_bore and θ_f. The body is fixed at the bore. ``lever`` is u, m: the distance along the axis of the tooth
    from the root circle to the line of action. ``slope`` is β: the angle between the force and the perpendicular to
    that axis.
    """
    h, theta = 2 * root_radius / bore, root_half_angle
    deep, linear, constant, tangent = _SAINSOT @ np.array([1 / theta**2, h**2, h / theta, 1 / theta, h, 1.0])
    ratio = lever / (2 * root_radius * theta)
    return np.cos(slope) ** 2 * (deep * ratio**2 + linear * ratio + constant * (1 + tangent * np.tan(slope) ** 2))


def tooth_compliance(
    profile: ToothProfile, bore: float, material: Material, width: float, pressure_angle: np.ndarray,
    crack: float = 0.0,
) -> Compliance:
    """Compliance (...) of a tooth, m/N, loaded at points of its flank with pressure angles (...), rad.

    A crack of a depth in m begins at the critical section of the root and goes down into the tooth, at 45° to its axis.
    Above its end, what is farther from the axis bears no bending and shear, but compression (Wu et al., 2008).
    """
    slope = profile.slope(pressure_angle)
    half_thickness, height = profile.flank(slope)
    load = Load(height, half_thickness, slope)
    stations = profile.fillet_stations(), profile.flank_stations(pressure_angle)
    bending, shear, axial = np.zeros((3, *np.shape(slope)))
    for each in stations:
        axial = axial + beam_compliance(each, load, material, width).axial
        if crack:
            left, bottom = np.array(profile.critical_point) - crack * np.array([
                math.sin(CRACK_ANGLE), math.cos(CRACK_ANGLE)])
            dead = np.where(each.height >= bottom, np.maximum(each.half_thickness - left, 0.0), 0.0)
            each = each._replace(half_thickness=each.half_thickness - dead / 2)
        part = beam_compliance(each, load, material, width)
        bending, shear = bending + part.bending, shear + part.shear
    lever = profile.base_radius / np.cos(slope) - profile.root_radius  # the line of action touches the base circle
    body = foundation_compliance(profile.root_radius, profile.root_half_angle, bore, lever, slope)
    return Compliance(bending, shear, axial, body / (material.E * width))


def hertz_stiffness(materials: tuple[Material, Material], width: float) -> float:
    """π b/(2 ((1 − ν1²)/E1 + (1 − ν2²)/E2)), N/m, whatever the load and curvatures (Yang and Sun, 1985)."""
    return math.pi * width / (2 * sum((1 - m.poisson**2) / m.E for m in materials))


@dataclass(frozen=True)
class ToothPairs:
    """The tooth pairs of a spur gear pair: their stiffness and their positions on the path of contact; lengths in m."""

    geometry: Geometry
    materials: tuple[Material, Material]
    bore: tuple[float, float]

    def __post_init__(self) -> None:
        geometry = self.geometry
        if geometry.contact_ratio < 1:
            raise InputError("contact_ratio", "must be at least 1", geometry.contact_ratio,
                             "Otherwise no teeth are in contact during a part of the mesh period.")
        for wheel, (active, form) in enumerate(
                zip(geometry.start_of_active_profile, geometry.root_form_diameter, strict=True)):
            if not active >= form * (1 - 1e-9):
                raise InputError(
                    f"start_of_active_profile[{wheel}]", f"must be at least the root form diameter, {Length(form)}",
                    Length(active), "The tip of the mating tooth reaches below the involute: shorten it or raise the "
                    "profile shift.")
        for wheel in (0, 1):
            profile, bore = tooth_profile(geometry, wheel), self.bore[wheel]
            if bore > (most := 2 * profile.root_radius / BODY_RATIOS[0]):
                raise InputError(
                    f"bore[{wheel}]", f"must be at most {Length(most, bore)} for the potential-energy method",
                    Length(bore, bore), "The compliance of the wheel body is known where the root diameter is at least "
                    f"{BODY_RATIOS[0]:g} bores (Sainsot et al., 2004). Use ISO 6336-1 or a table.")
            if profile.root_half_angle < ROOT_ANGLES[0]:
                raise InputError(
                    f"teeth[{wheel}]", f"must make a tooth root half angle of at least {ROOT_ANGLES[0]} rad for the "
                    "potential-energy method", profile.root_half_angle,
                    "Wheels with more teeth are beyond Sainsot's coefficients. Use ISO 6336-1 or a table.")

    @cached_property
    def body_bore(self) -> tuple[float, float]:
        """The bores of the bodies that bend, m: a body with a smaller bore is taken at the end of Sainsot's range."""
        first, second = (max(bore, 2 * tooth_profile(self.geometry, wheel).root_radius / BODY_RATIOS[1])
                         for wheel, bore in enumerate(self.bore))
        return first, second

    @property
    def notes(self) -> tuple[str, ...]:
        """Where the pair is beyond the range to which the coefficients of the foundation were fitted."""
        angles = [tooth_profile(self.geometry, wheel).root_half_angle for wheel in (0, 1)]
        small = [wheel for wheel in (0, 1) if self.body_bore[wheel] > self.bore[wheel]]
        wide = [f"wheel {n}: half the angle of the tooth at the root circle is {angle:.3g} rad; Sainsot's compliance "
                f"of the wheel body is fitted up to {ROOT_ANGLES[1]} rad only"
                for n, angle in enumerate(angles, 1) if angle > ROOT_ANGLES[1]]
        notes, taken, most = [], list(self.body_bore), BODY_RATIOS[1]
        for wheel in small:  # what is taken for their bodies, and how much the bore matters there
            wider = [*taken[:wheel], taken[wheel] * most / _COMPARED_RATIO, *taken[wheel + 1:]]
            one, other = (ToothPairs(self.geometry, self.materials, (first, second)).curve().mean
                          for first, second in (taken, wider))
            notes.append(
                f"wheel {wheel + 1}: the root diameter is more than {most:g} bores, beyond Sainsot's compliance of the "
                f"wheel body; it is that of a bore of {1e3 * taken[wheel]:.3g} mm. One of {1e3 * wider[wheel]:.3g} mm "
                f"would change the mean stiffness by {other / one - 1:+.1%}")
        return (*notes, *wide)

    def stiffness(
        self, first: np.ndarray, second: np.ndarray, cracks: tuple[float, float] = (0.0, 0.0)
    ) -> np.ndarray:
        """Stiffness of one tooth pair, N/m, by the pressure angles of the points of contact on both flanks, rad, and
        the depths of cracks in both teeth, m."""
        width = self.geometry.common_face_width
        one, two = (
            tooth_compliance(tooth_profile(self.geometry, wheel), self.body_bore[wheel], self.materials[wheel], width,
                             angle, cracks[wheel])
            for wheel, angle in enumerate((first, second)))
        return 1 / (1 / hertz_stiffness(self.materials, width) + one.total + two.total)

    def pressure_angles(self, progress: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pressure angles of the point of contact on both flanks, rad, at mesh periods since the contact began."""
        geometry = self.geometry
        distance = geometry.tangent_length - geometry.tip_tangents[1] + progress * geometry.base_pitch
        first, second = (d / 2 for d in geometry.base_diameter)
        return np.arctan(distance / first), np.arctan((geometry.tangent_length - distance) / second)

    def lost_by_crack(self, wheel: int, depth: float) -> float:
        """The share of the mean stiffness of a pair that a crack in its tooth of a wheel, 0 or 1, takes away."""
        most = tooth_profile(self.geometry, wheel).critical_point[0] / math.sin(CRACK_ANGLE)
        if depth >= most:
            raise InputError("crack_depth", f"must be less than {Length(most, depth)}, the middle of the tooth",
                             Length(depth, depth), "For a broken tooth give stiffness_loss = 1.")
        angles = self.pressure_angles(self.geometry.contact_ratio * (np.arange(_PARTS * 8) + 0.5) / (_PARTS * 8))
        cracked = self.stiffness(*angles, (depth, 0.0) if wheel == 0 else (0.0, depth))
        return float(1 - cracked.mean() / self.stiffness(*angles).mean())

    def curve(self, points: int = 512) -> PeriodicCurve:
        """Mesh stiffness, N/m, of all pairs in contact, at about ``points`` points. It jumps where one enters or
        leaves.
        """
        full, rest = divmod(self.geometry.contact_ratio, 1.0)
        positions, values = [], []
        for start, end, pairs in ((0.0, rest, int(full) + 1), (rest, 1.0, int(full))):
            if end > start:
                t = np.linspace(start, end, max(round(points * (end - start)), 2) + 1)
                progress = np.minimum(t + np.arange(pairs)[:, None], self.geometry.contact_ratio)
                positions.append(t)
                values.append(self.stiffness(*self.pressure_angles(progress)).sum(axis=0))
        return periodic_curve(np.concatenate(positions), np.concatenate(values))


@lru_cache(maxsize=64)
def from_energy(geometry: Geometry, materials: tuple[Material, Material], bore: tuple[float, float]) -> MeshStiffness:
    """Mesh stiffness of spur gears with wheel bodies fixed at bores of these diameters, m; errors are those of
    `ToothPairs`.
    """
    pairs = ToothPairs(geometry, materials, bore)
    return from_curve(pairs.curve(), _NAME, pairs.notes)


def _one_pair(design: Drawing) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Means of the stiffness of a pair over equal parts of its path, over the mean of the sum of all pairs."""
    pairs, ratio = ToothPairs(design.geometry, design.material, design.given("bore")), design.geometry.contact_ratio
    progress = ratio * (np.arange(_PARTS * 8) + 0.5) / (_PARTS * 8)
    means = pairs.stiffness(*pairs.pressure_angles(progress)).reshape(_PARTS, 8).mean(axis=1)
    means /= from_energy(design.geometry, design.material, design.given("bore")).reference
    return tuple(means.tolist()), tuple((np.arange(_PARTS) / _PARTS).tolist())


METHOD = StiffnessMethod(
    name=_NAME, pair=_one_pair, needs=("bore",), spur_only=True, external_only=True,
    compute=lambda design: from_energy(design.geometry, design.material, design.given("bore")))
