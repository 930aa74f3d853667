"""Dimensions of a pinion in a ring."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

from gearchaos.gears.geometry.dimensions import Geometry, Pair
from gearchaos.gears.geometry.tooth_root import involute


@dataclass(frozen=True)
class InternalGeometry(Geometry):
    """Dimensions of an internal gear pair, ISO 21771:2007; wheel 2 is the ring.

    Teeth, diameters and the centre distance are positive, where the standard has those of a ring negative. The ring's
    profile shift has the sign of the standard: a positive one moves its teeth inwards. Of the root of a ring, which is
    that of its cutter, the form diameter and the shift without undercut are NaN.
    """

    signs: ClassVar[tuple[int, int]] = (1, -1)

    @property
    def working_pressure_angle(self) -> float:
        """α_wt, NaN where the base circles are too far apart."""
        cosine = self.sum_of(self.base_diameter) / 2 / self.centre_distance
        return math.acos(cosine) if cosine < 1 else math.nan

    @cached_property
    def tangent_length(self) -> float:
        return self.centre_distance * math.sin(self.working_pressure_angle)

    @property
    def path_of_contact(self) -> float:
        own, ring = self.tip_tangents
        return own + self.tangent_length - ring

    @property
    def start_of_active_profile(self) -> Pair:
        """Where contact begins on the root side of the pinion, NaN below its base circle, and ends on that of the ring.
        """
        (base, ring_base), (tip, ring_tip) = self.base_diameter, self.tip_tangents
        own, ring = ring_tip - self.tangent_length, tip + self.tangent_length
        return 2 * math.hypot(base / 2, own) if own >= 0 else math.nan, 2 * math.hypot(ring_base / 2, ring)

    @cached_property
    def root_form_diameter(self) -> Pair:
        return 2 * self.generated_tooth(0).form_radius, math.nan

    @property
    def undercut_shift(self) -> Pair:
        return self.generated_tooth(0).undercut_shift, math.nan

    @property
    def tip_clearance(self) -> Pair:
        (tip, ring_tip), (root, ring_root) = self.tip_diameter, self.root_diameter
        return (ring_root - tip) / 2 - self.centre_distance, (ring_tip - root) / 2 - self.centre_distance

    @property
    def virtual_teeth(self) -> Pair:
        """Those by which stiffnesses are computed: a ring counts as a rack, ISO 6336-1:2006, 9.3.1."""
        return super().virtual_teeth[0], math.inf

    @property
    def tip_gap(self) -> float:
        """Arc on the tip circle of the ring by which the corners of both tips pass each other after the contact of
        nominal teeth without backlash, m; negative where they collide, as with few teeth of difference. It needs a
        positive contact ratio.

        The corners leave the contact at their own ends of the path. Where the tip circles intersect, the corner of the
        pinion is at θ1 from the line of centres about its axis, and at θ2 about that of the ring. From the flanks in
        contact at the pitch point it came there by θ1 + inv α_a1 − inv α_wt, that of the ring by θ2 + inv α_a2 −
        inv α_wt.
        """
        (tip, ring_tip), bases, distance = self.tip_diameter, self.base_diameter, self.centre_distance
        r, ring, working = tip / 2, ring_tip / 2, involute(self.working_pressure_angle)
        own, other = (involute(math.atan2(2 * along, base)) - working
                      for along, base in zip(self.tip_tangents, bases, strict=True))
        at_pinion = math.acos((ring**2 - r**2 - distance**2) / (2 * distance * r))
        at_ring = math.acos((distance**2 + ring**2 - r**2) / (2 * distance * ring))
        return ring * (self.teeth[0] / self.teeth[1] * (at_pinion + own) - at_ring - other)
