"""The transverse section of a gear pair in mesh: outlines of the teeth, line of action and path of contact.

Lengths are in m, angles in rad. The centre of wheel 1, which drives clockwise, is the origin; that of wheel 2 lies
above it at (0, a), that of a ring below it at (0, −a). Distances along the line of action are measured from the point
where it touches the base circle of wheel 1.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from gearchaos.gears.geometry.dimensions import Geometry
from gearchaos.gears.geometry.tooth_root import involute

if TYPE_CHECKING:
    from gearchaos.gears.design.gear_design import GearDesign

# points of an outline along an involute, a fillet and the tip circle of a tooth
FLANK_POINTS, FILLET_POINTS, TIP_POINTS = 24, 12, 5
RIM = 2.0  # thickness of the rim of a ring as it is drawn, in modules
_STEP = 1e-6  # step of the rack's normal, in rad, for the tangents of a fillet


@dataclass(frozen=True)
class TransverseSection:
    """A gear pair in one transverse plane at one instant.

    The teeth are those that the basic rack generates: involute flanks and the trochoids of its rounded tip, also of
    helical gears, whose teeth in other planes are rotated. An outline is a polygon within the tooth, so that drawn
    teeth overlap nowhere unless the gears do; points of contact are corners of it. Where the backlash, total along the
    line of action, m, is larger than that of nominal teeth, the teeth of both wheels are made thinner by equal amounts,
    as far as their tips allow. This changes neither root nor tip circles. The teeth of a ring are involutes to the root
    circle, since nothing says where the fillets of their cutter begin, and since these are concave, chords lie outside
    the tooth by some 1e-4 modules.

    The phase is the instant, as a fraction of the mesh period since a tooth pair entered contact in this plane, in [0,
    1).
    """

    geometry: Geometry
    backlash: float
    phase: float

    @property
    def centres(self) -> np.ndarray:
        """Centres of both wheels, (2, 2)."""
        return np.array([[0.0, 0.0], [0.0, self.geometry.signs[1] * self.geometry.centre_distance]])

    @property
    def outer_radii(self) -> tuple[float, float]:
        """Radii of the circles around both wheels: the tip circle, of a ring the back of its rim."""
        tip, ring = self.geometry.tip_diameter
        if self.geometry.signs[1] < 0:
            ring = self.geometry.root_diameter[1] + 2 * RIM * self.geometry.normal_module
        return tip / 2, ring / 2

    @property
    def direction(self) -> np.ndarray:
        """Unit vector (2,) along the line of action, in which the contact points move."""
        angle = self.geometry.working_pressure_angle
        return np.array([math.cos(angle), math.sin(angle)])

    def on_line(self, distance: float) -> np.ndarray:
        angle, base = self.geometry.working_pressure_angle, self.geometry.base_diameter[0] / 2
        return base * np.array([-math.sin(angle), math.cos(angle)]) + distance * self.direction

    @property
    def start(self) -> float:
        """Distance along the line of action where contact begins, on the tip circle of wheel 2."""
        return self.geometry.signs[1] * (self.geometry.tangent_length - self.geometry.tip_tangents[1])

    @property
    def end(self) -> float:
        """Distance along the line of action where contact ends, on the tip circle of wheel 1."""
        return self.geometry.tip_tangents[0]

    @property
    def line_of_action(self) -> tuple[float, float]:
        """Its ends as they are drawn: where it touches both base circles, of an internal pair that of the ring and E.
        """
        length = self.geometry.tangent_length
        return (0.0, length) if self.geometry.signs[1] > 0 else (-length, self.end)

    @property
    def pitch_point(self) -> np.ndarray:
        """The point (2,) where the working pitch circles touch."""
        return np.array([0.0, self.geometry.working_diameter[0] / 2])

    @cached_property
    def contacts(self) -> np.ndarray:
        """Distances along the line of action of the points where flanks touch at this instant, in increasing order."""
        first, pitch = self.start + self.phase * self.geometry.base_pitch, self.geometry.base_pitch
        count = math.floor((self.end - first) / pitch * (1 + 1e-12)) + 1
        return first + pitch * np.arange(max(count, 0))

    def tooth_axis(self, wheel: int, contact: float) -> float:
        """Direction, from the centre of its wheel, of the axis of the tooth that touches at a distance."""
        base = self.geometry.base_diameter[wheel] / 2
        sign = self.geometry.signs[wheel]
        tangency = self.geometry.working_pressure_angle + (math.pi / 2 if wheel == 0 or sign < 0 else -math.pi / 2)
        return tangency - self._length(wheel, contact) / base + sign * self._base_half_angle(wheel)

    def body(self, wheel: int, teeth: range | None = None, detail: float = 1.0) -> np.ndarray:
        """A closed outline (points, 2) of a wheel, or of a part of it with these teeth: to its centre, of a ring to the
        back of its rim. That of a whole ring is two closed curves, NaN after each."""
        outline = self.outline(wheel, teeth, detail)
        if self.geometry.signs[wheel] > 0:
            return outline if teeth is None else np.vstack([outline, self.centres[wheel]])
        inside = outline - self.centres[wheel]
        angle = np.unwrap(np.arctan2(inside[:, 1], inside[:, 0]))
        angle = np.linspace(angle[-1], angle[0], max(len(inside), 361))
        back = self.centres[wheel] + self.outer_radii[wheel] * np.column_stack([np.cos(angle), np.sin(angle)])
        apart = np.full((int(teeth is None), 2), math.nan)
        return np.vstack([outline, apart, back, apart])

    def outline(self, wheel: int, teeth: range | None = None, detail: float = 1.0) -> np.ndarray:
        """Points (points, 2) of the outline of teeth, counter-clockwise; ``detail`` is a factor on their number.

        Teeth are counted counter-clockwise; the tooth 0 is at the first of the `contacts`. By default all, a closed
        outline.
        """
        z, sign = self.geometry.teeth[wheel], self.geometry.signs[wheel]
        first = 0 if sign > 0 else z // 2  # a ring begins and ends opposite to the mesh
        numbers = range(first, first + z) if teeth is None else teeth
        base, tip = self.geometry.base_diameter[wheel] / 2, self.geometry.tip_diameter[wheel] / 2
        if sign > 0:
            root, fillet = self._fillet(wheel, detail)
            form = max(self.geometry.root_form_diameter[wheel] / 2, base)
        else:
            form = self.geometry.root_diameter[wheel] / 2
            root, fillet = np.full(1, form), np.full(1, math.pi / z)
        ends = (math.sqrt(max(form**2 - base**2, 0.0)), self.geometry.tip_tangents[wheel])
        touching = [self._length(wheel, contact) for contact in self.contacts]
        lengths = np.linspace(*ends, max(round(FLANK_POINTS * detail), 2))
        lengths = np.union1d(lengths, [length for length in touching if min(ends) < length < max(ends)])[::sign]
        flank = self._base_half_angle(wheel) - sign * (lengths / base - np.arctan(lengths / base))
        tip_angle = np.linspace(flank[-1], 0.0, max(round(TIP_POINTS * detail), 1), endpoint=False)[1:]
        # half a tooth, from the root to the middle of the tip: radii, and angles from its axis
        radius = np.concatenate([root, np.hypot(base, lengths), np.full(len(tip_angle), tip)])
        offset = np.concatenate([fillet, flank, tip_angle])
        radii = np.concatenate([radius, radius[::-1]])
        offsets = np.concatenate([-offset, offset[::-1]])
        axis = self.tooth_axis(wheel, float(self.start + self.phase * self.geometry.base_pitch))
        angles = (axis + 2 * math.pi / z * np.array(numbers)[:, None] + offsets).ravel()
        points = np.tile(radii, len(numbers))[:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
        return points + self.centres[wheel]

    def _fillet(self, wheel: int, detail: float) -> tuple[np.ndarray, np.ndarray]:
        """Radii of the corners of a fillet, (n,), and their angles from the axis of the tooth."""
        slopes = np.linspace(math.pi / 2, self.geometry.generated_tooth(wheel).form_slope,
                             max(round(FILLET_POINTS * detail), 2))
        nodes = self._fillet_points(wheel, slopes)
        # the fillet is concave, and its chords would add material, by which a mating tip could seem to cut into it: its
        # corners are its first point, then where its tangents meet
        tangents = self._fillet_points(wheel, slopes - _STEP) - self._fillet_points(wheel, slopes + _STEP)
        steps, turn = np.diff(nodes), np.imag(tangents[:-1].conj() * tangents[1:])
        meeting = nodes[:-1] + tangents[:-1] * np.imag(steps.conj() * tangents[1:]) / turn
        corners = np.concatenate([nodes[:1], meeting])
        return np.abs(corners), math.pi / self.geometry.teeth[wheel] - np.angle(corners) - self._thinning[wheel]

    def _length(self, wheel: int, contact: float) -> float:
        """Length of the tangent from the base circle of a wheel to a point of the line of action."""
        return contact if wheel == 0 else self.geometry.tangent_length - self.geometry.signs[1] * contact

    @cached_property
    def _thinning(self) -> tuple[float, float]:
        """Angle by which each flank of each wheel's teeth lies nearer to their axis than nominal ones. Both teeth lose
        the same thickness, unless one would then be pointed below its tip circle.
        """
        excess = self.backlash - self.geometry.theoretical_backlash
        bases = self.geometry.base_diameter
        half_angles = (
            self._nominal_half_angle(wheel) - sign * involute(math.atan(2 * tangent / base))  # at the tip circles
            for wheel, (base, tangent, sign) in enumerate(zip(
                bases, self.geometry.tip_tangents, self.geometry.signs, strict=True)))
        room = [max(base * angle, 0.0) for base, angle in zip(bases, half_angles, strict=True)]
        first = min(max(excess / 2, excess - room[1]), room[0])
        return first / bases[0], min(excess - first, room[1]) / bases[1]

    def _nominal_half_angle(self, wheel: int) -> float:
        """Angle between the axis of a nominal tooth and the beginning of its involute on the base circle."""
        g = self.geometry
        thickness = math.pi / 2 + 2 * g.profile_shift[wheel] * math.tan(g.pressure_angle)
        return thickness / g.teeth[wheel] + g.signs[wheel] * involute(g.transverse_pressure_angle)

    def _base_half_angle(self, wheel: int) -> float:
        """Angle between the axis of a tooth and the beginning of its involute on the base circle."""
        return self._nominal_half_angle(wheel) - self._thinning[wheel]

    def _fillet_points(self, wheel: int, slopes: np.ndarray) -> np.ndarray:
        """Points of a fillet as complex numbers, (slopes,), with the middle of the tooth space as real axis."""
        tooth = self.geometry.generated_tooth(wheel)
        radii, positions = np.transpose([tooth.fillet(slope) for slope in slopes.tolist()])
        return radii * np.exp(1j * positions)


def transverse_section(design: GearDesign, phase: float | None = None) -> TransverseSection:
    """The section of a design, nominal without a backlash, by default amid the time of most pairs in contact."""
    geometry = design.geometry
    # nominal teeth may overlap by what the rounding of profile shifts explains
    nominal = max(geometry.theoretical_backlash, 0.0)
    backlash = nominal if design.backlash is None else design.backlash_line_of_action
    return TransverseSection(geometry, backlash, geometry.contact_ratio % 1.0 / 2 if phase is None else phase % 1.0)
