"""A planetary set written out as bodies and meshes of a train."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from gearchaos.errors import InputError
from gearchaos.gears import units
from gearchaos.gears.fields import Record, one, read_by, record_values
from gearchaos.gears.train.mesh import Mesh
from gearchaos.gears.train.parts import Body
from gearchaos.quantities import POSITIVE

_MOST_PLANETS = 12
_ADDENDUM = 1.0  # over the module


def _teeth(field: str, value: Any) -> tuple[int, int, int]:
    if isinstance(value, (str, bytes)) or not hasattr(value, "__len__") or len(value) != 3:
        raise InputError(field, "must be a list of three numbers of teeth: sun, planet, ring", value)
    sun, planet, ring = (units.teeth(f"{field}[{i}]", z) for i, z in enumerate(value))
    return sun, planet, ring


def _count(field: str, value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= _MOST_PLANETS:
        raise InputError(field, f"must be a whole number from 1 to {_MOST_PLANETS}", value)
    return value


@dataclass(frozen=True, kw_only=True)
class PlanetarySet(Record):
    """A planetary set with equally spaced planets, of gears without profile shift, for a `Train`.

    Its ``bodies`` are ``sun``, ``carrier``, ``ring``, ``planet1``, …, those that are held last, and its ``meshes``
    ``sun/planet1``, ``planet1/ring``, …. Other bodies are joined to it by shafts, such as a ring that is held
    elastically, by a shaft to ``"ground"``.

    Parameters
    ----------
    count : int
        Number of planets.
    teeth : three int
        Of sun, planet and ring: z_r = z_s + 2 z_p, and z_s + z_r is a multiple of the number of planets.
    module : length
    pressure_angle : angle
    sun, ring, carrier, planet : tables
        Fields of a `Body` without its name; a ring that is held is ``{fixed = true}``.
    sun_mesh, ring_mesh : tables
        Fields of a `Mesh` without names, teeth and base radii, alike for all planets. Both waveforms begin at the same
        position of their pitch points in the mesh cycle.

    Raises
    ------
    InputError
        For numbers of teeth that cannot be assembled, or planets that collide.

    Notes
    -----
    Where the sun turns forwards in the frame of the carrier, as it does unless it is held, the sun mesh of planet n, at
    the angle ψ_n, is z_s ψ_n behind that of the first one, and its ring mesh z_r ψ_n ahead (R. G. Parker, J. Lin, *Mesh
    phasing relationships in planetary and epicyclic gears*, J. Mech. Des. 126 (2004) 365). A planet meets sun and ring
    with opposite flanks at opposite points of its pitch circle, so that they are half a cycle apart where its number of
    teeth is even.

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

    count: int = field(metadata=read_by(_count))
    teeth: Any = field(metadata=read_by(_teeth))
    module: Any = field(metadata=read_by(one(units.LENGTH, POSITIVE)))
    pressure_angle: Any = field(default="20 deg", metadata=read_by(one(units.ANGLE, POSITIVE)))
    sun: Any = None
    ring: Any = None
    carrier: Any = None
    planet: Any = None
    sun_mesh: Any = None
    ring_mesh: Any = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("sun", "ring", "carrier", "planet", "sun_mesh", "ring_mesh"):
            if not isinstance(getattr(self, name), Mapping):
                raise InputError(name, "must be given, a table", getattr(self, name))
        for name, wheel in (("sun_mesh", 2), ("ring_mesh", 1)):
            table = getattr(self, name)
            if any(isinstance(fault, Mapping) and fault.get("wheel") == wheel for fault in table.get("faults") or ()):
                raise InputError(f"{name}.faults", f"must leave out wheel {wheel}", "a fault of every planet",
                                 "Write the bodies and meshes out for one of a single planet.")
        sun, planet, ring = self.teeth
        if ring != sun + 2 * planet:
            raise InputError("teeth", f"must have a ring of z_sun + 2 z_planet = {sun + 2 * planet} teeth", ring,
                             "The gears have no profile shift.")
        if (sun + ring) % self.count == 0 and self._gap(self.count) > 0:
            return
        fits = [str(n) for n in range(2, _MOST_PLANETS + 1) if (sun + ring) % n == 0 and self._gap(n) > 0]
        possible = f"Possible are {', '.join(fits)}." if fits else ""
        if (sun + ring) % self.count:
            raise InputError("count", f"must divide z_sun + z_ring = {sun + ring}", self.count,
                             f"Planets at equal distances could not be assembled. {possible}")
        raise InputError("count", "must leave the tip circles of the planets apart", self.count,
                         f"They would overlap by {-self._gap(self.count) * 1e3:.4g} mm. {possible}")

    def _gap(self, count: int) -> float:
        """The distance of the tip circles of neighbours, if so many planets are equally spaced, m."""
        distance = 2 * self.orbit * math.sin(math.pi / count) if count > 1 else math.inf
        return distance - self.module * (self.teeth[1] + 2 * _ADDENDUM)

    @property
    def orbit(self) -> float:
        """Distance of the planets' centres from the axis, m."""
        return self.module * (self.teeth[0] + self.teeth[1]) / 2

    @property
    def positions(self) -> list[float]:
        """Angles of the planets, rad."""
        return [2 * math.pi * n / self.count for n in range(self.count)]

    @property
    def bodies(self) -> list[Body]:
        """Sun, carrier, ring, those that are held last, and the planets."""
        names = sorted(("sun", "carrier", "ring"), key=lambda name: bool(getattr(self, name).get("fixed")))
        found = [_part(Body, name, {"name": name, **getattr(self, name)}) for name in names]
        return found + [_part(Body, "planet", {
            "name": f"planet{n}", "carrier": "carrier", "orbit": self.orbit, "position": position, **self.planet})
                        for n, position in enumerate(self.positions, 1)]

    @property
    def meshes(self) -> list[Mesh]:
        """Two meshes of each planet: with the sun, and with the ring."""
        sun, planet, ring = self.teeth
        base = self.module * math.cos(self.pressure_angle) / 2
        sense = -1 if self.sun.get("fixed") else 1  # in which the sun turns in the frame of the carrier
        out = []
        for n, position in enumerate(self.positions, 1):
            both = {"pressure_angle": self.pressure_angle}
            with_sun = _part(Mesh, "sun_mesh", {
                "between": ("sun", f"planet{n}"), "teeth": (sun, planet), "base_radii": (base * sun, base * planet),
                **both, **self.sun_mesh})
            with_ring = _part(Mesh, "ring_mesh", {
                "between": (f"planet{n}", "ring"), "teeth": (planet, ring), "internal": True,
                "base_radii": (base * planet, base * ring), **both, **self.ring_mesh})
            out += [_ahead(with_sun, -sense * sun * position),
                    _ahead(with_ring, sense * ring * position + math.pi * (planet + 1))]
        return out


def _part(kind: type[Any], name: str, values: Mapping[str, Any]) -> Any:
    """A body or mesh of the set from the table of this name."""
    return record_values(kind, f"planets: {name}", values)


def _ahead(mesh: Mesh, phase: float) -> Mesh:
    """A mesh that is ahead of its own phase, if anything of it varies."""
    return replace(mesh, phase=mesh.phase + phase) if mesh.varies else mesh
