"""`Inputs`: those of a gear design, how each is read, and what follows from single ones."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import InitVar, dataclass, field, fields
from functools import cached_property
from typing import Any

from gearchaos.errors import InputError
from gearchaos.gears.design import values
from gearchaos.gears.design.values import ErrorTable, OrdersFile, Rack, ReliefDimensions, Supports, TableFile
from gearchaos.gears.geometry import mechanics
from gearchaos.gears.geometry.backlash import OF, AnyBacklash, backlash_of, check_backlash
from gearchaos.gears.geometry.dimensions import Geometry, Pair, mating_geometry
from gearchaos.gears.geometry.internal import InternalGeometry
from gearchaos.gears.io.fields import Reader, name_of, number, one, read_by, record, two, whole
from gearchaos.gears.io.units import ANGLE, INERTIA, LENGTH, MASS, RPM, SPEED, TORQUE, to_si
from gearchaos.gears.stiffness import methods, other_methods
from gearchaos.gears.stiffness.iso6336 import ISO, Blank, ToothStiffness, tooth_stiffness
from gearchaos.gears.train.faults import Fault
from gearchaos.gears.train.parts import terms
from gearchaos.gears.transmission_error import Quality, editions
from gearchaos.gears.transmission_error.harmonics import FROM_QUALITY
from gearchaos.model import DAMPING_LAWS, DEFAULT_LAW_OF_GEARS, Damped
from gearchaos.quantities import NOT_NEGATIVE, POSITIVE

TEETH = two(values.tooth_count, "must be a list of two numbers of teeth")
_LENGTHS, _POSITIVE_LENGTHS = two(one(LENGTH, NOT_NEGATIVE)), two(one(LENGTH, POSITIVE))


@dataclass(frozen=True, kw_only=True)
class Inputs(Damped):
    """The inputs of a `gearchaos.GearDesign`, which describes and checks them; kept in SI, speeds in rpm. Each field
    says how its value is read, and what to write where a result needs it and it was left out.
    """

    teeth: Any = field(metadata=read_by(TEETH))
    internal: bool = field(default=False, metadata=read_by(values.yes_or_no))
    module: Any = field(default=None, metadata=read_by(one(LENGTH, POSITIVE)))
    diametral_pitch: InitVar[Any] = None
    face_width: Any = field(metadata=read_by(_POSITIVE_LENGTHS))
    pressure_angle: Any = field(default=values.PRESSURE_ANGLE, metadata=read_by(one(ANGLE)))
    helix_angle: Any = field(default=0.0, metadata=read_by(
        Reader(lambda name, value: abs(to_si(name, value, ANGLE)), ANGLE)))
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
    inertia: Any = field(default=None, metadata=read_by(
        two(one(INERTIA, POSITIVE)), "A ring is no disc: give the inertias of both wheels."))
    mass: Any = field(default=None, metadata=read_by(
        two(one(MASS, POSITIVE)), "A ring is no disc: give the masses of both wheels."))
    quality: Quality | Any = field(default=None, metadata=read_by(
        Reader(values.read_quality, parts={
            "standard": name_of(*editions()), "grade": two(whole("must be a grade", 0))}),
        "E.g. { standard = 'ISO 1328-1:1995', grade = 5 }."))
    backlash: AnyBacklash | Any = field(default=None, metadata=read_by(
        Reader(backlash_of, parts={"of": name_of(*OF), "value": one(LENGTH)}),
        "E.g. backlash = { value = '0.12 mm', of = 'line of action, total' }."))
    damping_ratio: float | None = field(default=None, metadata=read_by(
        number(values.BELOW_ONE),
        "Usual mesh damping ratios are 0.03 to 0.1: Kasuba and Evans, J. Mech. Des. 103, 1981; Wang and Cheng, J. "
        "Mech. Des. 103, 1981. It is the least known input, so there is no default."))
    damping_law: str = field(default=DEFAULT_LAW_OF_GEARS, metadata=read_by(name_of(*DAMPING_LAWS)))
    stiffness: str | TableFile | Any = field(default=ISO, metadata=read_by(values.Choice(tuple(methods()), TableFile)))
    load_sharing: str | None = field(default=None, metadata=read_by(name_of("prescribed", "tooth pairs", "under load")))
    corner_contact: bool | None = field(default=None, metadata=read_by(values.yes_or_no))
    lead_crowning: float = field(default=0.0, metadata=read_by(one(LENGTH, NOT_NEGATIVE)))
    lead_slope: float = field(default=0.0, metadata=read_by(one(LENGTH)))
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

    @property
    def geometry_kind(self) -> type[Geometry]:
        return InternalGeometry if self.internal else Geometry

    @cached_property
    def geometry(self) -> Geometry:
        values = {
            "teeth": self.teeth, "normal_module": self.module, "pressure_angle": self.pressure_angle,
            "helix_angle": self.helix_angle, "face_width": self.face_width, "addendum": self.rack.addendum,
            "dedendum": self.rack.dedendum, "root_radius": self.rack.root_radius}
        return mating_geometry(values, self.centre_distance, self.profile_shift, self.tip_alteration, self.tip_diameter,
                               self.geometry_kind)

    @property
    def backlash_line_of_action(self) -> float:
        """Total backlash in the transverse plane along the line of action, m; raises `InputError` if none is given."""
        return check_backlash(self.given("backlash"), self.geometry)

    @property
    def masses(self) -> Pair:
        """Masses of the wheels, kg; raises `InputError` if neither mass nor bore is given."""
        if self.mass is not None or self.internal:
            return self.given("mass")  # type: ignore[no-any-return]
        diameters, bores = mechanics.disc_diameter(self.geometry), self.given("bore")
        first, second = (mechanics.disc_mass(d, bore, width, material.density) for d, bore, width, material in zip(
            diameters, bores, self.face_width, self.material, strict=True))
        return first, second

    @property
    def inertias(self) -> Pair:
        """Moments of inertia of the wheels, kg m²; raises `InputError` if inertia, mass and bore are all left out."""
        if self.inertia is not None or self.internal:
            return self.given("inertia")  # type: ignore[no-any-return]
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
