"""`Drawing`: the inputs of a gear design, how each is read, and what follows from them alone."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import InitVar, dataclass, field, fields, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from gearchaos.errors import InputError
from gearchaos.gears import mechanics
from gearchaos.gears.design import values
from gearchaos.gears.design.values import ErrorFile, ErrorTable, OrdersFile, Rack, ReliefDimensions, Supports, TableFile
from gearchaos.gears.fields import name_of, number, one, read_by, record, two
from gearchaos.gears.geometry.backlash import AnyBacklash, backlash_of, check_backlash
from gearchaos.gears.geometry.corner_contact import CornerGap, corner_contact
from gearchaos.gears.geometry.dimensions import Geometry, Pair, mating_geometry
from gearchaos.gears.stiffness import MeshStiffness, methods, other_methods
from gearchaos.gears.stiffness.iso6336 import ISO, Blank, ToothStiffness, tooth_stiffness
from gearchaos.gears.stiffness.potential_energy import ToothPairs as EnergyPairs
from gearchaos.gears.stiffness.table import from_table as stiffness_from_table
from gearchaos.gears.tooth_pairs import CornerContact, Relief, ToothPairs, back_phase
from gearchaos.gears.train.parts import terms
from gearchaos.gears.train.teeth import Fault
from gearchaos.gears.transmission_error import Quality, tolerances
from gearchaos.gears.transmission_error.harmonics import FROM_QUALITY, ErrorHarmonics, from_quality
from gearchaos.gears.transmission_error.pitch import drawn_pitch
from gearchaos.gears.transmission_error.tables import from_orders
from gearchaos.gears.transmission_error.tables import from_table as error_from_table
from gearchaos.gears.transmission_error.tip_relief import TipRelief, from_tip_relief, unrelieved_length
from gearchaos.gears.units import ANGLE, INERTIA, LENGTH, MASS, RPM, SPEED, TORQUE, to_si
from gearchaos.model import DAMPING_LAWS, DEFAULT_LAW_OF_GEARS
from gearchaos.model.stiffness.tooth_pairs import CONTACT_RATIO
from gearchaos.quantities import NOT_NEGATIVE, POSITIVE

_NO_RELIEF = 1e-13  # length over the path of contact of a relief of no depth
NO_ERROR = ErrorHarmonics(amplitudes=(), phases=(), source="none: the gears are taken to be exact")
TEETH = two(values.tooth_count, "must be a list of two numbers of teeth")
_LENGTHS, _POSITIVE_LENGTHS = two(one(LENGTH, NOT_NEGATIVE)), two(one(LENGTH, POSITIVE))


@dataclass(frozen=True, kw_only=True)
class Drawing:
    """The inputs of a `gearchaos.GearDesign`, which describes and checks them; kept in SI, speeds in rpm. Each field
    says how its value is read, and what to write where a result needs it and it was left out.
    """

    teeth: Any = field(metadata=read_by(TEETH))
    module: Any = field(default=None, metadata=read_by(one(LENGTH, POSITIVE)))
    diametral_pitch: InitVar[Any] = None
    face_width: Any = field(metadata=read_by(_POSITIVE_LENGTHS))
    pressure_angle: Any = field(default=values.PRESSURE_ANGLE, metadata=read_by(one(ANGLE)))
    helix_angle: Any = field(default=0.0, metadata=read_by(lambda name, value: abs(to_si(name, value, ANGLE))))
    centre_distance: Any = field(default=None, metadata=read_by(one(LENGTH, POSITIVE)))
    profile_shift: Any = field(default=None, metadata=read_by(
        two(number(), "must be a list of two: x1 and x2, in normal modules")))
    rack: Rack | Any = field(default=values.PROFILE_A, metadata=read_by(record(Rack)))
    tip_alteration: Any = field(default=(0.0, 0.0), metadata=read_by(values.tip_alterations))
    tip_diameter: Any = field(default=None, metadata=read_by(_POSITIVE_LENGTHS))
    tip_relief: ReliefDimensions | Any = field(default=None, metadata=read_by(values.read_tip_relief))
    material: Any = field(default="steel", metadata=read_by(two(mechanics.read_material)))
    bore: Any = field(default=None, metadata=read_by(
        _LENGTHS, "The mass of a wheel follows from its bore, 0 for a disc without one; or give inertia and mass."))
    blank: Any = field(default=values.SOLID, metadata=read_by(two(values.read_blank)))
    inertia: Any = field(default=None, metadata=read_by(two(one(INERTIA, POSITIVE))))
    mass: Any = field(default=None, metadata=read_by(two(one(MASS, POSITIVE))))
    quality: Quality | Any = field(default=None, metadata=read_by(
        values.read_quality, "E.g. { standard = 'ISO 1328-1:1995', grade = 5 }."))
    backlash: AnyBacklash | Any = field(default=None, metadata=read_by(
        backlash_of, "E.g. backlash = { value = '0.12 mm', of = 'line of action, total' }."))
    damping_ratio: float | None = field(default=None, metadata=read_by(
        number(values.BELOW_ONE),
        "Usual mesh damping ratios are 0.03 to 0.1: Kasuba and Evans, J. Mech. Des. 103, 1981; Wang and Cheng, J. "
        "Mech. Des. 103, 1981. It is the least known input, so there is no default."))
    damping_law: str = field(default=DEFAULT_LAW_OF_GEARS, metadata=read_by(name_of(*DAMPING_LAWS)))
    stiffness: str | TableFile | Any = field(default=ISO, metadata=read_by(values.Choice(tuple(methods()), TableFile)))
    load_sharing: str | None = field(default=None, metadata=read_by(name_of("prescribed", "tooth pairs")))
    corner_contact: bool | None = field(default=None, metadata=read_by(values.yes_or_no))
    transmission_error: str | OrdersFile | ErrorTable | Any = field(default=None, metadata=read_by(
        values.Choice(("none", *FROM_QUALITY), OrdersFile, ErrorTable)))
    eccentricity: Any = field(default=(0.0, 0.0), metadata=read_by(_LENGTHS))
    pitch_errors: Any = field(default=((), ()), metadata=read_by(values.read_pitch_errors))
    faults: Any = field(default=(), metadata=read_by(terms(Fault)))
    supports: Supports | Any = field(default=None, metadata=read_by(record(Supports)))
    application_factor: float = field(default=1.0, metadata=read_by(number(POSITIVE)))
    speed: Any = field(default=None, metadata=read_by(
        one(SPEED, POSITIVE), "It is the speed of wheel 1, e.g. '360 rpm'."))
    torque: Any = field(default=None, metadata=read_by(
        one(TORQUE, NOT_NEGATIVE), "It is the torque at wheel 1, e.g. '9000 N*m'."))

    def given(self, name: str) -> Any:
        """The value of an input that a result needs; raises `InputError` with advice if it was left out."""
        self.require([name])
        return getattr(self, name)

    def require(self, names: Iterable[str]) -> None:
        """Raise one `InputError`, with advice on each, if some of these inputs were left out."""
        missing = [name for name in names if getattr(self, name) is None]
        if missing:
            *others, last = missing
            subject = f"{', '.join(others)} and {last}" if others else last
            known = {f.name: f.metadata["advice"] for f in fields(self)}
            raise InputError(subject, "must be given", None, " ".join(filter(None, (known[n] for n in missing))))

    @cached_property
    def geometry(self) -> Geometry:
        values = {
            "teeth": self.teeth, "normal_module": self.module, "pressure_angle": self.pressure_angle,
            "helix_angle": self.helix_angle, "face_width": self.face_width, "addendum": self.rack.addendum,
            "dedendum": self.rack.dedendum, "root_radius": self.rack.root_radius}
        return mating_geometry(values, self.centre_distance, self.profile_shift, self.tip_alteration, self.tip_diameter)

    @property
    def backlash_line_of_action(self) -> float:
        """Total backlash in the transverse plane along the line of action, m; raises `InputError` if none is given."""
        return check_backlash(self.given("backlash"), self.geometry)

    @property
    def masses(self) -> Pair:
        """Masses of the wheels, kg; raises `InputError` if neither mass nor bore is given."""
        if self.mass is not None:
            return self.mass
        diameters, bores = mechanics.disc_diameter(self.geometry), self.given("bore")
        first, second = (mechanics.disc_mass(d, bore, width, material.density) for d, bore, width, material in zip(
            diameters, bores, self.face_width, self.material, strict=True))
        return first, second

    @property
    def inertias(self) -> Pair:
        """Moments of inertia of the wheels, kg m²; raises `InputError` if inertia, mass and bore are all left out."""
        if self.inertia is not None:
            return self.inertia
        discs = zip(mechanics.disc_diameter(self.geometry), self.bore or (0.0, 0.0), self.masses, strict=True)
        first, second = (mechanics.disc_inertia(*each) for each in discs)
        return first, second

    @property
    def equivalent_mass(self) -> float:
        """Mass of the pair along the line of action, kg, (2.9); over the face width it is m_red of ISO 6336-1."""
        base1, base2 = self.geometry.base_diameter
        return mechanics.equivalent_mass(self.inertias, (base1 / 2, base2 / 2))

    @property
    def load(self) -> mechanics.MeshLoad:
        """Tangential force, line load and pitch line velocity; raises `InputError` without speed or torque."""
        return mechanics.mesh_load(
            self.geometry, self.given("speed") * RPM, self.given("torque"), self.application_factor)

    @property
    def blanks(self) -> tuple[Blank | None, Blank | None]:
        """Rim and web of each wheel; None for a solid disc."""
        first, second = (each if isinstance(each, Blank) else None for each in self.blank)
        return first, second

    @property
    def tooth_stiffness(self) -> ToothStiffness:
        """c′ and c_γα by ISO 6336-1 at the torque of the design; at 100 N/mm and above if it has none."""
        load = None if self.torque is None else mechanics.mesh_load(
            self.geometry, 0.0, self.torque, self.application_factor).line_load  # whatever the speed
        if load == 0:
            raise InputError("torque", "must be greater than 0 for a mesh stiffness by ISO 6336-1", self.torque,
                             "By the rule for low loads, (90), the stiffness vanishes with the load. Other methods do "
                             f"not depend on the load. {other_methods(ISO, self.geometry)}")
        first, second = (material.E for material in self.material)
        return tooth_stiffness(self.geometry, line_load=load, youngs_modulus=(first, second), blanks=self.blanks)

    @property
    def mesh_stiffness(self) -> MeshStiffness:
        """Mesh stiffness over the mesh period by the method of the design.

        That by ISO 6336-1 depends on the torque by the rule for low loads; the others do not.
        """
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
    def one_spring(self) -> str:
        """Why the mesh can only be one spring, in words; empty if tooth pairs can share the load."""
        if self.helix_angle:
            return "helical teeth enter contact bit by bit"
        if not CONTACT_RATIO.holds(self.geometry.contact_ratio):
            return f"the contact ratio is {self.geometry.contact_ratio:.4g}, and tooth pairs need 1 to 4"
        if self._one_pair is None:
            return "a table has the stiffness of all pairs together"
        if self.damping_law == "unilateral":
            return "with the damping law unilateral each tooth pair would need a damper of its own"
        return ""

    @property
    def has_corner_contact(self) -> bool:
        """Whether tooth pairs touch beyond their path: as ``corner_contact`` says; left out, where corners can."""
        if not self.shares_load:
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
        if self.shares_load:
            return f"tooth pairs {'with corner contact' if self.has_corner_contact else 'on their nominal path alone'}"
        return f"one spring, since {self.one_spring}" if self.one_spring else "prescribed, one spring"

    @property
    def _one_pair(self) -> Callable[[Any], tuple[tuple[float, ...], tuple[float, ...]]] | None:
        """How the method of the stiffness finds that of one tooth pair over c0; None if it has the sum alone."""
        return None if isinstance(self.stiffness, TableFile) else methods()[self.stiffness].pair

    @property
    def tooth_pairs(self) -> ToothPairs | None:
        """The tooth pairs that share the load, None for one spring; raises `InputError` where an input is missing."""
        if not self.shares_load or self._one_pair is None:
            return None
        path, given = self.geometry.contact_ratio * self.geometry.base_pitch, self.tip_relief
        levels, starts = self._one_pair(self)
        found = None
        left_out = given is None or not any(given.amount) or self.relief_left_out
        if (relief := None if left_out else self.path_relief) is not None:
            unrelieved_length(self.geometry, relief)  # raises where the reliefs overlap
            lengths = [min(length / path, 1.0) or _NO_RELIEF for length in relief.length]
            found = Relief(amount=relief.amount, length=lengths, shape=relief.shape)
        stiffness = [level * self.mesh_stiffness.reference for level in levels]
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
        return (self.shares_load and self.load_sharing is None and relief is not None and any(relief.amount)
                and relief.start_diameter is None)

    @property
    def comparable_stiffnesses(self) -> tuple[MeshStiffness, ...]:
        """The mesh stiffness by the method of the design, then by all others that it can be computed by."""
        found = [self.mesh_stiffness]
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
        """The faults with the loss of stiffness that follows from the depth of a crack."""
        if not any(fault.crack_depth for fault in self.faults):
            return self.faults
        try:
            pairs = EnergyPairs(self.geometry, self.material, self.given("bore"))
            return tuple(replace(fault, crack_depth=0.0, stiffness_loss=pairs.lost_by_crack(
                fault.wheel - 1, fault.crack_depth)) if fault.crack_depth else fault for fault in self.faults)
        except InputError as error:
            raise InputError(f"faults: {error.field}", error.rule, error.value, error.advice) from None

    @property
    def turning(self) -> bool:
        """Whether something repeats once per turn of a wheel, not with the mesh."""
        faults = any(f.stiffness_loss or f.crack_depth or f.wear for f in self.faults)
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
        found: list[ErrorHarmonics] = [
            from_quality(self.geometry, quality, tolerances(quality, self.geometry), method=method)]
        if self.shares_load or self.path_relief is None:
            return found[0]
        found.append(from_tip_relief(self.geometry, self.path_relief))
        total = np.zeros(max(len(part.amplitudes) for part in found), complex)
        for part in found:
            total[: len(part.amplitudes)] += np.array(part.amplitudes) * np.exp(-1j * np.array(part.phases))
        return ErrorHarmonics(amplitudes=tuple(np.abs(total).tolist()), phases=tuple((-np.angle(total)).tolist()),
                              source="; ".join(part.source for part in found),
                              residual_rms=math.hypot(*(part.residual_rms for part in found)),
                              residual_peak=sum(part.residual_peak for part in found),
                              warnings=tuple(warning for part in found for warning in part.warnings),
                              assumptions=tuple(text for part in found for text in part.assumptions))


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
