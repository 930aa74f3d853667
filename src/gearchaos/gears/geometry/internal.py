"""Dimensions of a pinion in a ring."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from gearchaos.gears.geometry.dimensions import Geometry, Pair


def _of_external_gears(self: InternalGeometry) -> Pair:
    raise NotImplementedError("the formula is that of external gears")


@dataclass(frozen=True)
class InternalGeometry(Geometry):
    """Dimensions of an internal gear pair, ISO 21771:2007; wheel 2 is the ring.

    Teeth and diameters are positive. The ring's profile shift has the sign of the standard, where its number of teeth
    is negative: a positive one moves its teeth inwards. What has no formula here raises `NotImplementedError`.
    """

    working_diameter = single_contact_diameter = start_of_active_profile = property(_of_external_gears)
    tip_clearance = tip_thickness = theoretical_backlash = property(_of_external_gears)

    @cached_property
    def tip_diameter(self) -> Pair:
        height = (self.profile_shift[1] + self.addendum) * self.normal_module + self.tip_alteration[1]
        return super().tip_diameter[0], self.reference_diameter[1] - 2 * height

    @property
    def root_diameter(self) -> Pair:
        depth = (self.dedendum - self.profile_shift[1]) * self.normal_module
        return super().root_diameter[0], self.reference_diameter[1] + 2 * depth

    @property
    def working_pressure_angle(self) -> float:
        """α_wt, NaN where the base circles are too far apart."""
        first, second = self.base_diameter
        cosine = (second - first) / 2 / self.centre_distance
        return math.acos(cosine) if cosine < 1 else math.nan

    @cached_property
    def tangent_length(self) -> float:
        return self.centre_distance * math.sin(self.working_pressure_angle)

    @property
    def path_of_contact(self) -> float:
        own, ring = self.tip_tangents
        return own + self.tangent_length - ring

    @property
    def virtual_teeth(self) -> Pair:
        """Those by which stiffnesses are computed: a ring counts as a rack, ISO 6336-1:2006, 9.3.1."""
        return super().virtual_teeth[0], math.inf
