"""A planetary set written out as bodies and meshes of a train."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from typing import Any

from gearchaos.errors import InputError
from gearchaos.gears.geometry.dimensions import Geometry, mating_geometry, shift_sum
from gearchaos.gears.geometry.internal import InternalGeometry
from gearchaos.gears.geometry.tooth_root import involute
from gearchaos.gears.io import units
from gearchaos.gears.io.fields import (
    Record,
    check_toothing,
    each,
    having,
    number,
    one,
    read_by,
    record_values,
    two,
    whole,
)
from gearchaos.gears.stiffness.iso6336 import from_iso, tooth_stiffness
from gearchaos.gears.train.mesh import Mesh
from gearchaos.gears.train.parts import Body, part_name
from gearchaos.gears.train.stiffness import of_model
from gearchaos.quantities import POSITIVE

_MOST_PLANETS = 12
_MOST_SHIFT = 2.0  # of the ring, in modules: beyond, its teeth would not be those of a gear
_OF_DESIGN = ("module", "pressure_angle", "helix_angle", "profile_shift", "centre_distance")


def _teeth(field: str, value: Any) -> tuple[int, int, int]:
    if isinstance(value, (str, bytes)) or not hasattr(value, "__len__") or len(value) != 3:
        raise InputError(field, "must be a list of three numbers of teeth: sun, planet, ring", value)
    sun, planet, ring = (units.teeth(f"{field}[{i}]", z) for i, z in enumerate(value))
    return sun, planet, ring


@dataclass(frozen=True, kw_only=True)
class PlanetarySet(Record):
    """A planetary set with equally spaced planets, of spur or helical gears, for a `Train`.

    Its ``bodies`` are ``sun``, ``carrier``, ``ring``, ``planet1``, …, those that are held last, and its ``meshes``
    ``sun/planet1``, ``planet1/ring``, …. Other bodies are joined to it by shafts, such as a ring that is held
    elastically, by a shaft to ``"ground"``. A ``name`` stands before theirs: ``low_sun/planet1``.

    Parameters
    ----------
    count : int
        Number of planets.
    teeth : three int
        Of sun, planet and ring: z_s + z_r is a multiple of the number of planets, and z_r = z_s + 2 z_p, but with
        profile shift near it.
    module, pressure_angle, helix_angle : length, angle, angle
        Those of the normal section, and β at the reference cylinder; by default 20° and 0.
    profile_shift : two float, optional
        Of sun and planets, in normal modules, by default 0. The ring has the one that goes with its backlash.
    centre_distance : length, optional
        Of sun and planets; by default that without backlash of these two.
    design : GearDesign, optional
        Of the sun and a planet, in place of all these, and for what ``sun_mesh`` leaves out. In a study file the path
        of a file with ``[design]``; its torque is that of one mesh. ``ring_mesh`` then needs nothing: it has a
        stiffness by ISO 6336-1, of the width and material of the planet, damping and backlash of the sun mesh.
    name : str, optional
        Needed where a train has several sets.
    sun, ring, carrier, planet : tables
        Fields of a `Body` without its name; a ring that is held is ``{fixed = true}``.
    position_errors : list of length, optional
        How far the pin of each planet stands ahead on the orbit, in the sense in which positions count: that in which
        the first body turns.
    sun_mesh, ring_mesh : tables
        Fields of a `Mesh` without names, teeth and base radii, alike for all planets. Both waveforms begin at the same
        position of their pitch points in the mesh cycle. The angle of their forces is the working one.

    Raises
    ------
    InputError
        For numbers of teeth that cannot be assembled, or planets that collide.

    Notes
    -----
    All is plane: helical gears have the dimensions of their transverse section, and no tilting.

    Where the sun turns forwards in the frame of the carrier, as it does unless it is held, the sun mesh of planet n, at
    the angle ψ_n, is z_s ψ_n behind that of the first one, and its ring mesh z_r ψ_n ahead (R. G. Parker, J. Lin, *Mesh
    phasing relationships in planetary and epicyclic gears*, J. Mech. Des. 126 (2004) 365). A planet meets sun and ring
    with opposite flanks at opposite points of its pitch circles. So its ring mesh is ahead by z_p π, and by the angle
    z_p (ψ_s + ψ_r) between these flanks of a tooth, with ψ = (π/2 + 2 x_p tan α_n)/z_p + inv α_t − inv α_wt at each
    pitch circle. Without profile shift that is half a cycle for an even number of teeth.

    Examples
    --------
    >>> import gearchaos as gc
    >>> steel = {"mass": 0.5, "inertia": "5e-4 kg*m^2"}
    >>> mesh = {"stiffness": "5e8 N/m", "backlash": "0.1 mm", "damping": "800 N*s/m"}
    >>> planets = gc.PlanetarySet(
    ...     count=3, teeth=(27, 36, 99), module="2.8 mm", sun={"inertia": "5e-4 kg*m^2", "torque": 30},
    ...     ring={"fixed": True}, carrier={"inertia": "5e-2 kg*m^2", "torque": -140}, planet=steel,
    ...     sun_mesh=mesh, ring_mesh=mesh)
    >>> train = gc.Train(speed=1500, bodies=planets.bodies, meshes=planets.meshes)
    >>> {name: round(float(speed), 1) for name, speed in train.speeds.items()}["carrier"]
    321.4
    """

    count: int = field(metadata=read_by(
        whole(f"must be a whole number from 1 to {_MOST_PLANETS}", 1, _MOST_PLANETS)))
    teeth: Any = field(metadata=read_by(_teeth))
    module: Any = field(default=None, metadata=read_by(one(units.LENGTH, POSITIVE)))
    pressure_angle: Any = field(default=None, metadata=read_by(one(units.ANGLE, POSITIVE)))
    helix_angle: Any = field(default=None, metadata=read_by(one(units.ANGLE)))
    profile_shift: Any = field(default=None, metadata=read_by(two(number(), "must be a list of two: sun and planets")))
    centre_distance: Any = field(default=None, metadata=read_by(one(units.LENGTH, POSITIVE)))
    design: Any = field(default=None, metadata=read_by(having(
        "geometry", "must be a GearDesign, in a study file the path of a file with [design]",
        "It is that of the sun and a planet.")))
    position_errors: Any = field(default=None, metadata=read_by(each(units.LENGTH)))
    name: Any = field(default=None, metadata=read_by(part_name))
    sun: Any = None
    ring: Any = None
    carrier: Any = None
    planet: Any = None
    sun_mesh: Any = None
    ring_mesh: Any = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.design is not None and self.sun_mesh is None:
            object.__setattr__(self, "sun_mesh", {})
        if self.design is not None and self.ring_mesh is None:
            object.__setattr__(self, "ring_mesh", {})
        for name in ("sun", "ring", "carrier", "planet", "sun_mesh", "ring_mesh"):
            if not isinstance(getattr(self, name), Mapping):
                raise InputError(name, "must be given, a table", getattr(self, name))
        faults: dict[str, Any] = {name: getattr(self, name).get("faults") or () for name in ("sun_mesh", "ring_mesh")}
        if self.design is not None:
            faults["design"] = self.design.faults
        for name, given in faults.items():
            wheel = 1 if name == "ring_mesh" else 2
            if any((fault["wheel"] if isinstance(fault, Mapping) else fault.wheel) == wheel for fault in given):
                raise InputError(f"{name}.faults", f"must leave out wheel {wheel}", "a fault of every planet",
                                 "Write the bodies and meshes out for one of a single planet.")
        if len(self.position_errors or ()) not in (0, self.count):
            raise InputError("position_errors", f"must be {self.count}, one for each planet", len(self.position_errors))
        self._check_dimensions()
        largest = max(map(abs, self.position_errors or ()), default=0.0)
        if largest > 0.1 * self.geometry.normal_module:  # flanks would be moved by more than any backlash
            raise InputError("position_errors", "must be at most a tenth of the module", f"{1e3 * largest:.4g} mm",
                             "They are by how much pins are off their places, some hundredths of a millimetre.")
        sun, _, ring = self.teeth
        if (sun + ring) % self.count == 0 and self._gap(self.count) > 0:
            return
        fits = [str(n) for n in range(2, _MOST_PLANETS + 1) if (sun + ring) % n == 0 and self._gap(n) > 0]
        possible = f"Possible are {', '.join(fits)}." if fits else ""
        if (sun + ring) % self.count:
            raise InputError("count", f"must divide z_sun + z_ring = {sun + ring}", self.count,
                             f"Planets at equal distances could not be assembled. {possible}")
        raise InputError("count", "must leave the tip circles of the planets apart", self.count,
                         f"They would overlap by {-self._gap(self.count) * 1e3:.4g} mm. {possible}")

    def _check_dimensions(self) -> None:
        """Raise `InputError` for dimensions that are not given, or twice, or teeth that do not mesh."""
        sun, planet, ring = self.teeth
        for name in _OF_DESIGN if self.design is not None else ():
            if (value := getattr(self, name)) is not None:
                raise InputError(name, "must be left out beside design", value, "The gears have that of their design.")
        if self.design is not None and self.design.internal:
            raise InputError("design", "must be that of two external wheels", "an internal pair",
                             "It is that of the sun and a planet.")
        if self.design is not None and self.design.teeth != (sun, planet):
            raise InputError("teeth", f"must begin with {list(self.design.teeth)}, those of the design",
                             [sun, planet], "Its wheel 1 is the sun, its wheel 2 a planet.")
        if self.design is None:
            if self.module is None:
                raise InputError("module", "must be given", None, "Or give a design.")
            check_toothing(self.module, self.pressure_angle, self.helix_angle)
        if not any(self.geometry.profile_shift) and ring != sun + 2 * planet:
            raise InputError("teeth", f"must have a ring of z_sun + 2 z_planet = {sun + 2 * planet} teeth", ring,
                             "The gears have no profile shift.")
        shift = self.ring_geometry.profile_shift[1]
        if not abs(shift) <= _MOST_SHIFT:
            raise InputError("teeth", f"must have a ring near z_sun + 2 z_planet = {sun + 2 * planet} teeth", ring,
                             f"At the centre distance of {self.orbit * 1e3:.6g} mm " + (
                                 "its base circle is too large for the planets." if math.isnan(shift) else
                                 f"it would need a profile shift of {shift:.3g} modules."))

    @cached_property
    def geometry(self) -> Geometry:
        """Dimensions of the sun and a planet."""
        if self.design is not None:
            return self.design.geometry  # type: ignore[no-any-return]
        angle = math.radians(20) if self.pressure_angle is None else self.pressure_angle
        values = {"teeth": self.teeth[:2], "normal_module": self.module, "pressure_angle": angle,
                  "helix_angle": abs(self.helix_angle or 0.0), "face_width": (0.0, 0.0)}
        return mating_geometry(values, self.centre_distance, self.profile_shift, (0.0, 0.0))

    @cached_property
    def ring_geometry(self) -> InternalGeometry:
        """Dimensions of a planet and the ring, which has the profile shift of no backlash, NaN where there is none."""
        sun, own, z = self.geometry, self.geometry.profile_shift[1], self.teeth[1:]
        width, alteration = (sun.face_width[1],) * 2, (sun.tip_alteration[1], 0.0)
        given = InternalGeometry(**{**asdict(sun), "teeth": z, "face_width": width, "tip_alteration": alteration})
        return replace(given, profile_shift=(own, shift_sum(given) - own))

    def _of_ring(self, sun_mesh: Mesh) -> dict[str, Any]:
        """What the ring mesh has where it is not given, beside a design."""
        if self.design is None or "design" in self.ring_mesh:
            return {}
        found: dict[str, Any] = {"damping": sun_mesh.damping, "backlash": sun_mesh.backlash}
        if not {"stiffness", "tooth_pairs"} & self.ring_mesh.keys():
            geometry, modulus = self.ring_geometry, self.design.material[1].E
            single = tooth_stiffness(geometry, youngs_modulus=(modulus, modulus), blanks=(self.design.blanks[1], None))
            curve = from_iso(geometry, single.mesh_stiffness)
            found["stiffness"] = of_model(curve.waveform, curve.reference)
        assumed = {"stiffness": "stiffness by ISO 6336-1, the ring as a rack, in jumps as tooth pairs come and go",
                   "damping": "damping of the sun mesh",
                   "backlash": "backlash of the sun mesh", "error_amplitudes": "no transmission error"}
        own = {*self.ring_mesh, *({"stiffness"} if "tooth_pairs" in self.ring_mesh else ())}
        return {**found, "assumed": {name: text for name, text in assumed.items() if name not in own}}

    def _gap(self, count: int) -> float:
        """The distance of the tip circles of neighbours, if so many planets are equally spaced, m."""
        distance = 2 * self.orbit * math.sin(math.pi / count) if count > 1 else math.inf
        return distance - self.geometry.tip_diameter[1]

    @property
    def orbit(self) -> float:
        """Distance of the planets' centres from the axis, m."""
        return self.geometry.centre_distance

    @property
    def positions(self) -> list[float]:
        """Angles of the planets, rad."""
        return [2 * math.pi * n / self.count for n in range(self.count)]

    def named(self, body: str) -> str:
        """The name of a body of this set, such as ``sun``, in the train."""
        return f"{self.name}_{body}" if self.name else body

    @property
    def bodies(self) -> list[Body]:
        """Sun, carrier, ring, those that are held last, and the planets."""
        names = sorted(("sun", "carrier", "ring"), key=lambda name: bool(getattr(self, name).get("fixed")))
        found = [self._part(Body, name, {"name": self.named(name), **getattr(self, name)}) for name in names]
        errors = self.position_errors or [0.0] * self.count
        return found + [self._part(Body, "planet", {
            "name": self.named(f"planet{n}"), "carrier": self.named("carrier"), "orbit": self.orbit,
            "position": position, "position_error": error, **self.planet})
                        for n, (position, error) in enumerate(zip(self.positions, errors, strict=True), 1)]

    @property
    def meshes(self) -> list[Mesh]:
        """Two meshes of each planet: with the sun, and with the ring."""
        (sun, planet, ring), geometry = self.teeth, self.geometry
        base = geometry.base_diameter[0] / sun / 2
        sense = -1 if self.sun.get("fixed") else 1  # in which the sun turns in the frame of the carrier
        of_design = {} if self.design is None else {"design": self.design}
        angles = geometry.working_pressure_angle, self.ring_geometry.working_pressure_angle
        # between the flanks of a planet's tooth that touch sun and ring, each at its pitch circle, times z_planet
        across = math.pi + 4 * geometry.profile_shift[1] * math.tan(geometry.pressure_angle) + planet * (
            2 * involute(geometry.transverse_pressure_angle) - sum(map(involute, angles)))
        out = []
        for n, position in enumerate(self.positions, 1):
            mates = [self.named(name) for name in ("sun", f"planet{n}", "ring")]
            with_sun = self._part(Mesh, "sun_mesh", {
                "name": self.named(f"sun/planet{n}"), "between": mates[:2], "teeth": (sun, planet),
                "base_radii": (base * sun, base * planet), "pressure_angle": angles[0], **of_design, **self.sun_mesh})
            with_ring = self._part(Mesh, "ring_mesh", {
                "name": self.named(f"planet{n}/ring"), "between": mates[1:], "teeth": (planet, ring), "internal": True,
                "base_radii": (base * planet, base * ring), "pressure_angle": angles[1],
                **self._of_ring(with_sun), **self.ring_mesh})
            for mesh, ahead in ((with_sun, -sense * sun * position),
                                (with_ring, sense * ring * position + math.pi * planet + across)):
                out.append(replace(mesh, phase=mesh.phase + ahead) if mesh.varies else mesh)
        return out

    def _part(self, kind: type[Any], name: str, values: Mapping[str, Any]) -> Any:
        """A body or mesh of the set from the table of this name."""
        return record_values(kind, f"planets{f' {self.name}' if self.name else ''}: {name}", values)
