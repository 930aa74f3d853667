"""`Drawing`: what follows from the inputs of a gear design: load sharing, stiffness, transmission error."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from gearchaos.errors import InputError
from gearchaos.gears.design import values
from gearchaos.gears.design.inputs import Inputs
from gearchaos.gears.design.values import ErrorFile, OrdersFile, TableFile
from gearchaos.gears.geometry.corner_contact import CornerGap, corner_contact
from gearchaos.gears.mesh.helical import Strips
from gearchaos.gears.mesh.tooth_pairs import CornerContact, Relief, ToothPairs, back_phase
from gearchaos.gears.stiffness import MeshStiffness, methods
from gearchaos.gears.stiffness.potential_energy import ToothPairs as EnergyPairs
from gearchaos.gears.stiffness.table import from_table as stiffness_from_table
from gearchaos.gears.train.faults import Fault
from gearchaos.gears.transmission_error import tolerances
from gearchaos.gears.transmission_error.harmonics import ErrorHarmonics, added, from_quality
from gearchaos.gears.transmission_error.pitch import drawn_pitch
from gearchaos.gears.transmission_error.tables import from_orders
from gearchaos.gears.transmission_error.tables import from_table as error_from_table
from gearchaos.gears.transmission_error.tip_relief import TipRelief, from_tip_relief, unrelieved_length
from gearchaos.model.stiffness.tooth_pairs import CONTACT_RATIO

_NO_RELIEF = 1e-13  # length over the path of contact of a relief of no depth
NO_ERROR = ErrorHarmonics(amplitudes=(), phases=(), source="none: the gears are taken to be exact")


@dataclass(frozen=True, kw_only=True)
class Drawing(Inputs):
    """The inputs of a `gearchaos.GearDesign`, which describes and checks them, and what follows from them."""

    @property
    def mesh_stiffness(self) -> MeshStiffness:
        """Mesh stiffness over the mesh period by the method of the design.

        That by ISO 6336-1 depends on the torque by the rule for low loads; the others do not.
        """
        return self.strips.stiffness if self.under_load else self.nominal_stiffness

    @property
    def nominal_stiffness(self) -> MeshStiffness:
        """That of teeth on their nominal path, whatever the load makes of it."""
        if isinstance(self.stiffness, TableFile):
            return _table_stiffness(self.stiffness, self.teeth[0], self.geometry.common_face_width)
        return methods()[self.stiffness].compute(self)

    @property
    def shares_load(self) -> bool:
        """Whether each tooth pair is a spring with a gap of its own: as ``load_sharing`` says; left out, where a model
        can have that.
        """
        return not self.one_spring if self.load_sharing is None else self.load_sharing == "tooth pairs"

    @property
    def in_strips(self) -> bool:
        """Whether a helical pair is one spring whose stiffness and error are those of strips at rest under a torque: as
        ``load_sharing`` says; left out, where a model can have that.
        """
        if self.load_sharing is None:
            return bool(self.helix_angle) and not self.no_tooth_pairs
        return self.load_sharing == "under load"

    @property
    def under_load(self) -> bool:
        """Whether the strips are at rest under the torque of the design; without one it is that of teeth on their path.
        """
        return self.in_strips and bool(self.torque)

    @property
    def one_spring(self) -> str:
        """Why the mesh can only be one spring, in words; empty if tooth pairs can share the load."""
        if self.helix_angle:
            return "helical teeth enter contact bit by bit"
        return self.no_tooth_pairs

    @property
    def no_tooth_pairs(self) -> str:
        """Why nothing is known of single tooth pairs, in words; empty if it is."""
        if not CONTACT_RATIO.holds(self.geometry.contact_ratio):
            return f"the contact ratio is {self.geometry.contact_ratio:.4g}, and tooth pairs need 1 to 4"
        if self._one_pair is None:
            return "a table has the stiffness of all pairs together"
        if self.law.releases:
            return f"with the damping law {self.damping_law} each tooth pair would need a damper of its own"
        return ""

    @property
    def has_gaps(self) -> bool:
        """Whether the gaps of tooth pairs act: of springs of their own, or in strips across the width."""
        return self.shares_load or self.in_strips

    @property
    def has_corner_contact(self) -> bool:
        """Whether tooth pairs touch beyond their path: as ``corner_contact`` says; left out, where corners can."""
        if not self.has_gaps:
            return False
        return not self.no_corner_contact if self.corner_contact is None else self.corner_contact

    @property
    def no_corner_contact(self) -> str:
        """Why tooth pairs cannot touch beyond their path, in words; empty if they can."""
        try:
            _ = self.corner_gaps
        except InputError as error:
            return error.advice
        return ""

    @cached_property
    def corner_gaps(self) -> tuple[CornerGap, CornerGap]:
        """Gaps beyond the path, leaving and entering; raises `InputError` where the corners do not meet involutes."""
        leaving, entering = (corner_contact(self.geometry, leaving=each) for each in (True, False))
        return leaving, entering

    @property
    def sharing_in_words(self) -> str:
        """How the tooth pairs share the load, and why by one spring where they cannot have springs of their own."""
        contact = "with corner contact" if self.has_corner_contact else "on their nominal path alone"
        if self.shares_load:
            return f"tooth pairs {contact}"
        if self.in_strips:
            return f"under load, in strips across the width {contact}"
        return f"one spring, since {self.no_tooth_pairs}" if self.no_tooth_pairs else "prescribed, one spring"

    @property
    def _one_pair(self) -> Callable[[Any], tuple[tuple[float, ...], tuple[float, ...]]] | None:
        """How the method of the stiffness finds that of one tooth pair over c0; None if it has the sum alone."""
        return None if isinstance(self.stiffness, TableFile) else methods()[self.stiffness].pair

    @property
    def tooth_pairs(self) -> ToothPairs | None:
        """The tooth pairs that share the load, None for one spring; raises `InputError` where an input is missing."""
        return self._pairs(self.mesh_stiffness.reference) if self.shares_load else None

    @cached_property
    def strips(self) -> Strips:
        """A helical pair in strips under its torque; raises `InputError` where an input is missing."""
        reference, geometry = self.nominal_stiffness.reference, self.geometry
        pairs = self._pairs(reference)
        assert pairs is not None
        return Strips(pairs=pairs, reference=reference, overlap=geometry.overlap_ratio,
                      face_width=geometry.common_face_width, crowning=self.lead_crowning, slope=self.lead_slope,
                      force=self.given("torque") / (geometry.base_diameter[0] / 2))

    def _pairs(self, reference: float) -> ToothPairs | None:
        """The tooth pairs of the transverse section, with the mean stiffness ``reference``, N/m, on their path."""
        if self._one_pair is None:
            return None
        path, given = self.geometry.contact_ratio * self.geometry.base_pitch, self.tip_relief
        levels, starts = self._one_pair(self)
        found = None
        left_out = given is None or not any(given.amount) or self.relief_left_out
        if (relief := None if left_out else self.path_relief) is not None:
            unrelieved_length(self.geometry, relief)  # raises where the reliefs overlap
            lengths = [min(length / path, 1.0) or _NO_RELIEF for length in relief.length]
            found = Relief(amount=relief.amount, length=lengths, shape=relief.shape)
        stiffness = [level * reference for level in levels]
        corner = None
        if self.has_corner_contact:
            corner = CornerContact(length=[end.length / path for end in self.corner_gaps], gap=[
                [a * path ** (k + 2) for k, a in enumerate(end.gap)] for end in self.corner_gaps])
        return ToothPairs(stiffness=stiffness, starts=starts, contact_ratio=self.geometry.contact_ratio, relief=found,
                          back_phase=back_phase(self.geometry), corner=corner)

    @property
    def relief_left_out(self) -> bool:
        """Whether tooth pairs, which share the load by default, have no relief since nothing says where it begins."""
        relief = self.tip_relief
        return (self.has_gaps and self.load_sharing is None and relief is not None and any(relief.amount)
                and relief.start_diameter is None)

    @property
    def comparable_stiffnesses(self) -> tuple[MeshStiffness, ...]:
        """The mesh stiffness of the model, then by the method of the design and all others that it can have."""
        found = [self.mesh_stiffness, *[self.nominal_stiffness] * self.under_load]
        for method in methods().values():
            if method.name != self.stiffness:
                with suppress(InputError):  # without a bore, or for helical gears
                    found.append(method.compute(self))
        return tuple(found)

    @property
    def path_relief(self) -> TipRelief | None:
        """The tip relief along the path of contact, None without one; raises `InputError` if it has no start."""
        if self.tip_relief is None:
            return None
        if self.tip_relief.start_diameter is None:
            raise InputError("tip_relief.start_diameter", "must be given", None,
                             "What a relief does depends on where it begins.")
        starts = enumerate(zip(self.tip_relief.start_diameter, self.tip_relief.amount, strict=True))
        first, second = (self.geometry.length_to_tip(wheel, d) if amount else 0.0 for wheel, (d, amount) in starts)
        return TipRelief(self.tip_relief.amount, (first, second), self.tip_relief.shape)

    @property
    def late_teeth(self) -> tuple[tuple[float, ...], tuple[float, ...]]:
        """By how much each tooth of both wheels comes too late along the line of action, m; empty for none."""
        found, geometry = self.pitch_errors, self.geometry
        if isinstance(found, values.DrawnPitch):
            rng = np.random.default_rng(found.seed)
            found = [drawn_pitch(each, z, rng).tolist() for each, z in zip(
                tolerances(self.given("quality"), geometry), self.teeth, strict=True)]
        factor = math.cos(geometry.transverse_pressure_angle)
        first, second = (tuple(factor * value for value in wheel) for wheel in found)
        return first, second

    @property
    def tooth_faults(self) -> tuple[Fault, ...]:
        """The faults with what follows from the shape of the teeth, as the loss of stiffness by a crack."""
        if not any(fault.drawn for fault in self.faults):
            return self.faults
        try:
            pairs = EnergyPairs(self.geometry, self.material, self.given("bore"))
            return tuple(fault.as_drawn(pairs) for fault in self.faults)
        except InputError as error:
            raise InputError(f"faults: {error.field}", error.rule, error.value, error.advice) from None

    @property
    def turning(self) -> bool:
        """Whether something repeats once per turn of a wheel, not with the mesh."""
        faults = any(fault.found for fault in self.faults)
        drawn = isinstance(self.pitch_errors, values.DrawnPitch)
        return faults or drawn or any(map(any, self.pitch_errors)) or any(self.eccentricity)

    @property
    def exact(self) -> bool:
        """Whether the teeth are taken to be exact: the transmission error is left out, or said to be none."""
        return self.transmission_error in (None, "none")

    @property
    def error_harmonics(self) -> ErrorHarmonics:
        """Harmonics of the transmission error of the unloaded gears by the method of the design.

        Measured errors contain all deviations. Those from the accuracy grade and from the tip relief are added up.
        """
        method = self.transmission_error
        if isinstance(method, ErrorFile):
            radius = method.wheel and self.geometry.base_diameter[method.wheel - 1] / 2
            return _file_error(method, self.teeth, self.module / 2, radius)
        if self.exact:
            return NO_ERROR
        quality = self.given("quality")
        found = from_quality(self.geometry, quality, tolerances(quality, self.geometry), method=method)
        if self.shares_load or self.under_load or self.path_relief is None:
            return found
        return added([found, from_tip_relief(self.geometry, self.path_relief)])

    @property
    def mesh_error(self) -> ErrorHarmonics:
        """The error of the spring of the model: that of the unloaded gears, and under load what load sharing adds."""
        if not self.under_load:
            return self.error_harmonics
        return added([self.strips.error] if self.exact else [self.error_harmonics, self.strips.error])


@lru_cache(maxsize=64)
def _table_stiffness(file: TableFile, teeth: int, face_width: float) -> MeshStiffness:
    """The stiffness of a table with this content, read once."""
    file.check_unchanged("stiffness")
    return stiffness_from_table(file.table, teeth=teeth, speed=file.speed, face_width=face_width,
                                columns=dict(file.columns))


@lru_cache(maxsize=64)
def _file_error(file: ErrorFile, teeth: tuple[int, int], most: float, radius: float | None) -> ErrorHarmonics:
    """The error in a file with this content, read once: amplitudes up to ``most``, m; a base radius for angles."""
    file.check_unchanged("transmission_error")
    options: dict[str, Any] = {"most": most, "radius": radius, "columns": dict(file.columns)}
    if isinstance(file, OrdersFile):
        return from_orders(file.path, teeth, **options)
    return error_from_table(file.path, teeth[0], **options)
