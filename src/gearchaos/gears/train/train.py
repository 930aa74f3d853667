"""`Train`: bodies, shafts and meshes, how they turn steadily, and the period that all excitations have in common."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np

from gearchaos.display import HasCard
from gearchaos.errors import InputError, unknown_name
from gearchaos.gears.io import units
from gearchaos.gears.io.fields import convert_fields, name_of, number, one, read_by, record
from gearchaos.gears.mesh.pair import AngularScales, GearPair, Scales
from gearchaos.gears.train.balance import balancing_speeds, mean_imbalance
from gearchaos.gears.train.mesh import Mesh
from gearchaos.gears.train.modes import hardly_damped
from gearchaos.gears.train.parts import GROUND, NO_DAMPING, Body, Shaft, Units, field_of, parts
from gearchaos.gears.train.period import LARGEST_TOLERANCE, common, followed_orders
from gearchaos.gears.train.ratios import steady_ratios
from gearchaos.gears.train.stiffness import STEPS, SeriesStiffness
from gearchaos.gears.train.structure import units_of
from gearchaos.model import DAMPING_LAWS, DEFAULT_LAW_OF_GEARS, SHARED_LAWS, Damped, DampingLaw
from gearchaos.model.damping import CONTACT
from gearchaos.quantities import POSITIVE, Rule, parameter_owner

_TOLERANCE = Rule(lambda v: 0 <= v <= LARGEST_TOLERANCE, f"must be from 0 to {LARGEST_TOLERANCE}")
_LISTED = 4  # names of parts in a sentence
BALANCE = 1e-6  # largest mean torque left over, relative to the sum of all


def _speed(field: str, value: Any) -> Any:
    """A speed in rpm of the first body, or the name of another one and its speed."""
    read = one(units.SPEED, POSITIVE)
    if not isinstance(value, Mapping):
        return read(field, value)
    if len(value) != 1:
        raise InputError(field, "must be that of one body", dict(value), 'E.g. speed = { rotor = "12.1 rpm" }.')
    return next((name, read(f"{field}.{name}", speed)) for name, speed in value.items())


def _listed(names: list[str]) -> str:
    """Some names, and how many others there are."""
    more = len(names) - _LISTED + 1
    return ", ".join(names) if more <= 1 else f"{', '.join(names[:-more])} and {more} others"


@dataclass(frozen=True, kw_only=True)
class Train(Damped, HasCard):
    """A gear train: bodies, shafts and meshes with play, in SI.

    Angles are deviations from the steady rotation, which follows from the numbers of teeth. The first body's turn is
    the time to which all orders refer; its sense of rotation is positive.

    Parameters
    ----------
    speed : angular velocity, or table
        Of the first body; a plain number is in rpm. A table names another body, ``{"rotor": "12.1 rpm"}``.
    bodies : list of Body or tables
    shafts : list of Shaft or tables
    meshes : list of Mesh or tables
        Results without the name of a mesh are those of the first. There may be none if a shaft has a stop: then lengths
        are angles and forces torques, those of the stops.
    damping_law : {"always", "contact", "unilateral"}
        Where the damping of the meshes acts, which do not say it themselves. That of stops acts in contact, with
        ``unilateral`` without ever pulling.
    frequency_tolerance : float
        How far mesh frequencies and orders may deviate, relatively, so that all repeats sooner. By default they are
        exact, but where that would take more than 2000 mesh cycles up to 1e-3 off.
    reference : Units, optional
        The units of dimensionless results; by default half the first backlash, and the frequency and mean stiffness of
        the first mesh.

    Raises
    ------
    InputError
        For a value that breaks a rule, or parts that do not go together.

    Examples
    --------
    A loose wheel on a driver that moves with the second order of an engine:

    >>> import gearchaos as gc
    >>> driver = gc.Body(name="driver", motion=[{"order": 2, "acceleration": "300 rad/s^2"}])
    >>> loose = gc.Body(name="loose", inertia="5e-4 kg*m^2", torque="-0.2 N*m")
    >>> mesh = gc.Mesh(between=("driver", "loose"), teeth=(20, 30), base_radii=("30 mm", "45 mm"),
    ...                stiffness="2e8 N/m", damping="60 N*s/m", backlash="0.12 mm")
    >>> train = gc.Train(speed="800 rpm", bodies=[driver, loose], meshes=[mesh])
    >>> round(float(train.speeds["loose"]), 3), round(train.period, 4)
    (-533.333, 0.0375)
    >>> gc.regime(train).contact
    'permanent'
    """

    speed: Any = field(metadata=read_by(_speed))
    bodies: Any = field(metadata=read_by(parts(Body)))
    meshes: Any = field(default=(), metadata=read_by(parts(Mesh)))
    shafts: Any = field(default=(), metadata=read_by(parts(Shaft)))
    damping_law: str = field(default=DEFAULT_LAW_OF_GEARS, metadata=read_by(name_of(*DAMPING_LAWS.own)))
    frequency_tolerance: Any = field(default=0.0, metadata=read_by(number(_TOLERANCE)))
    reference: Any = field(default=None, metadata=read_by(record(Units)))

    @classmethod
    def of_pair(cls, pair: GearPair, gears: Any) -> Train:
        """A pair, and the gears that it was made of, as a train of the bodies wheel1 and wheel2, at the torques that
        balance M10."""
        bodies = [{"name": f"wheel{n}", "inertia": inertia, "torque": torque, "damping": friction}
                  for n, inertia, torque, friction in (
                      (1, pair.I1, pair.M10, pair.b1), (2, pair.I2, -pair.M10 * pair.n2 / pair.n1, pair.b2))]
        mesh: dict[str, Any] = {"between": ("wheel1", "wheel2"), "design": gears}
        if not pair.rigid:
            mesh["line_of_action"] = 0.0
            for n, body in enumerate(bodies, 1):
                support = {"stiffness": getattr(pair, f"c{n}"), "damping": getattr(pair, f"k{n}"), "direction": 0.0}
                body |= {"mass": getattr(pair, f"m{n}"), "support": support}
        return cls(speed=pair.speed, bodies=bodies, meshes=[mesh], damping_law=pair.damping_law)

    def __post_init__(self) -> None:
        convert_fields(self)
        if not self.bodies:
            raise InputError("bodies", "must have at least one entry", [])
        if not self.meshes and all(shaft.stop is None for shaft in self.shafts):
            raise InputError("meshes", "must have at least one entry, or a shaft must have a stop", [])
        first = self.bodies[0]
        if first.fixed:
            raise InputError(field_of(first, "fixed"), "must be false", True,
                             "The first body turns: the speed and all orders are those of its rotation.")
        known = [body.name for body in self.bodies]
        own: dict[str, Any] = {}
        for part in (*self.bodies, *self.shafts, *self.meshes):
            if (name := parameter_owner(part.name)) in own:
                raise InputError(field_of(part, "name"), "must be that of no other part", own[name].name,
                                 "Give each a name. Names must differ in letters, digits, - and _.")
            own[name] = part
        for part in (*self.shafts, *self.meshes):
            allowed = [*known, GROUND] if isinstance(part, Shaft) else known
            for name in part.between:
                if name not in allowed:
                    raise unknown_name(field_of(part, "between"), name, allowed)
        for body in self.bodies:
            if body.carrier is not None and body.carrier not in known:
                raise unknown_name(field_of(body, "carrier"), body.carrier, known)
            if body.carrier == body.name or (body.carrier and self.body(body.carrier).carrier):
                raise InputError(field_of(body, "carrier"), "must be a body that is no planet", body.carrier)
        for mesh in self.meshes:
            self._check_mesh(mesh)
        if isinstance(self.speed, tuple):
            name, speed = self.speed
            if not self.ratios.get(name):
                raise unknown_name("speed: body that turns", name, [body for body in known if self.ratios[body]])
            object.__setattr__(self, "speed", speed / abs(float(self.ratios[name])))
        _ = self.followed
        self.check_balance()

    def unbalanced(self, **changed: Any) -> Train:
        """This train with fields replaced by checked ones, whose mean torques need not balance yet."""
        out = object.__new__(Train)
        for f in fields(self):
            object.__setattr__(out, f.name, changed.get(f.name, getattr(self, f.name)))
        return out

    def check_balance(self) -> None:
        """Raise `InputError` unless the mean torques balance."""
        left, size, name = mean_imbalance(self)
        if abs(left) <= BALANCE * size:
            return
        own = self.torque_of(self.body(name))
        others = [body for body in self.bodies if not body.prescribed and body.name != name and self.ratios[body.name]]
        advice = f"{left:.6g} N m are left over; {own - left:.9g} N m would balance them."
        if others and not any(map(self.torque_of, others)):
            other = others[-1].name
            load = -left * abs(self.ratios[name] / self.ratios[other])
            advice = f"{left:.6g} N m are left over; {load:.9g} N m at {other} would balance them."
        if any(body.torque_over_speed for body in self.bodies):
            speeds = ", ".join(f"{speed:.12g} rpm" for speed in balancing_speeds(self)) or "no speed of the tables"
            advice = f"{left:.6g} N m are left over here; by torque_over_speed all balance at {speeds}."
        raise InputError(f"body {name}: torque", "must balance the other mean torques", own,
                         f"{advice} Loads and drag are negative.")

    def body(self, name: str) -> Body:
        """The body of this name."""
        return next(body for body in self.bodies if body.name == name)

    def law_of(self, mesh: Mesh | None) -> DampingLaw:
        """Where the damping of a mesh acts, or of None that of stops."""
        law = DAMPING_LAWS[(mesh and mesh.damping_law) or self.damping_law]
        return law if mesh or law.releases else CONTACT

    def _check_mesh(self, mesh: Mesh) -> None:
        """Raise `InputError` for a mesh that does not go with its bodies."""
        a, b = map(self.body, mesh.between)
        if self.law_of(mesh).releases and (mesh.tooth_pairs is not None or mesh.uneven):
            raise InputError(field_of(mesh, "damping_law"), f"must be {' or '.join(SHARED_LAWS)} where tooth pairs "
                             "share the load", self.law_of(mesh).name, "The mesh has one damper; a pair that never "
                             "pulls would need its own. A design with load_sharing = 'prescribed' has one spring.")
        if a.prescribed and b.prescribed:
            raise InputError(field_of(mesh, "between"), "must have a body that is free to move", list(mesh.between),
                             "The motion of both is prescribed, so that nothing is left to compute.")
        planet = a.carrier or b.carrier
        if planet and mesh.line_of_action is None and mesh.pressure_angle is None:
            raise InputError(field_of(mesh, "pressure_angle"), "must be given for a mesh with a planet", None)
        if mesh.pressure_angle is not None and not planet:
            raise InputError(field_of(mesh, "pressure_angle"), "must be left out without a planet",
                             units.Shown(mesh.pressure_angle, mesh.pressure_angle),
                             "It has no effect here: base radii are given.")
        if mesh.line_of_action is not None and not any(x.support or x.carrier for x in (a, b)):
            raise InputError(field_of(mesh, "line_of_action"), "must be left out where both centres rest",
                             units.Shown(mesh.line_of_action, mesh.line_of_action),
                             "It has no effect here. Or give one body mass and support.")

    @cached_property
    def parallel_paths(self) -> dict[str, dict[str, float]]:
        """The meshes that share the load of a body, those of planets with sun or ring or of a branched power flow: by
        name the base radius of the body in each. They have it at the same end, both driving or both driven."""
        found: dict[tuple[str, int], dict[str, float]] = {}
        for mesh in self.meshes:
            for end, name in enumerate(mesh.between):
                found.setdefault((name, end), {})[mesh.name] = mesh.base_radii[end]
        out: dict[str, dict[str, float]] = {}
        for (name, _), meshes in found.items():
            if len(meshes) > 1:  # of a body that several drive, and which drives several, both are there
                out[f"{name} again" if name in out else name] = meshes
        return out

    def carrier(self, mesh: Mesh) -> str | None:
        """The body in whose frame the centres of both wheels of a mesh rest, if it turns."""
        found = [body.carrier for body in map(self.body, mesh.between) if body.carrier]
        return found[0] if found else None

    @cached_property
    def ratios(self) -> dict[str, Fraction]:
        """The steady speed of each body over that of the first one; negative where it turns the other way."""
        names = [body.name for body in self.bodies]
        first = names[0]
        ends = [part.between for part in (*self.shafts, *self.meshes)]
        ends += [(body.name, body.carrier) for body in self.bodies if body.carrier]
        connected, before = {first}, 0
        while len(connected) > before:
            before = len(connected)
            connected |= {name for pair in ends if connected & set(pair) - {GROUND} for name in pair}
        for name in names:
            if name not in connected:
                raise InputError(f"body {name}", f"must be connected with {first} by meshes and shafts", "none",
                                 "Leave it out, or name it in a mesh or a shaft.")
        equations: list[tuple[Any, dict[str, Fraction]]] = [
            (body, {body.name: Fraction(1)}) for body in self.bodies if body.fixed]
        for shaft in self.shafts:
            row = {name: Fraction(sign) for name, sign in zip(shaft.between, (1, -1), strict=True) if name != GROUND}
            equations.append((shaft, row))
        for mesh in self.meshes:
            (a, b), (z1, z2) = mesh.between, mesh.teeth
            other = Fraction(-z2 if mesh.internal else z2)
            row = {a: Fraction(z1), b: other}
            if held := self.carrier(mesh):
                row[held] = row.get(held, Fraction(0)) - z1 - other
            equations.append((mesh, row))
        return steady_ratios(names, first, equations)

    @property
    def speeds(self) -> dict[str, float]:
        """The steady speed of each body, rpm; negative where it turns against the first one."""
        return {name: float(ratio) * self.speed for name, ratio in self.ratios.items()}

    def _exact_order(self, mesh: Mesh) -> Fraction:
        held = self.carrier(mesh)
        return abs(self.ratios[mesh.between[0]] - (self.ratios[held] if held else 0)) * mesh.teeth[0]

    def mesh_order(self, mesh: Mesh) -> Fraction:
        """Mesh cycles in a turn of the first body, as they are followed."""
        return self.followed_order(self._exact_order(mesh))

    def turn_order(self, mesh: Mesh, wheel: int) -> Fraction:
        """Turns of a wheel of a mesh, 0 or 1, against its other one in a turn of the first body."""
        return self.mesh_order(mesh) / mesh.teeth[wheel]

    def followed_order(self, exact: Fraction) -> Fraction:
        """The order that is followed in place of that of an excitation."""
        return self.followed.get(exact, exact)

    @cached_property
    def _exact_orders(self) -> dict[str, Fraction]:
        """The orders of everything that varies with time, by what it is, of the turn of the first body."""
        found = {f"mesh {mesh.name}": self._exact_order(mesh) for mesh in self.meshes if mesh.varies}
        for mesh in self.meshes:
            found |= {f"turn of {mesh.between[i]} in {mesh.name}": self._exact_order(mesh) / mesh.teeth[i]
                      for i in mesh.turning}
        for body in self.bodies:
            for each in (*(body.motion or ()), *body.torque_orders):
                found[f"order {each.order:g} of {body.name}"] = each.ratio
        of_nothing = {f"mesh {mesh.name}": self._exact_order(mesh) for mesh in self.meshes[:1]} or {
            f"turn of {self.bodies[0].name}": Fraction(1)}
        return {name: order for name, order in found.items() if order} or of_nothing

    @cached_property
    def followed(self) -> dict[Fraction, Fraction]:
        """The orders that are followed, by the exact ones, which they may miss where all would repeat late."""
        tied = [{self._exact_order(mesh), *(self._exact_order(mesh) / mesh.teeth[i] for i in mesh.turning)}
                for mesh in self.meshes if mesh.turning and self._exact_order(mesh)]
        return followed_orders(self._exact_orders, tied, self.frequency_tolerance)

    def excitation_orders(self) -> dict[str, Fraction]:
        """The orders of all excitations as they are followed, by what they are of."""
        return {name: self.followed_order(order) for name, order in self._exact_orders.items()}

    @cached_property
    def base_order(self) -> Fraction:
        """Common periods in a turn of the first body: the greatest common divisor of all orders."""
        return common(self.followed.values())

    @property
    def deviation(self) -> float:
        """The largest relative deviation of an order that is followed from the exact one."""
        return max(abs(float(near / exact) - 1) for exact, near in self.followed.items())

    @property
    def period(self) -> float:
        """The common period of all excitations, s."""
        return 60.0 / self.speed / float(self.base_order)

    @property
    def cycles(self) -> dict[str, int]:
        """Cycles of each mesh in the common period, for those that vary; fractions of others do not count."""
        return {mesh.name: int(self.mesh_order(mesh) / self.base_order) for mesh in self.meshes if mesh.varies}

    @property
    def turns(self) -> dict[str, int]:
        """Turns of wheels in the common period, for those by which something repeats once per turn."""
        return {mesh.between[i]: int(self.turn_order(mesh, i) / self.base_order)
                for mesh in self.meshes for i in mesh.turning}

    def at(self, *, speed: float | None = None, torque: float | None = None) -> Train:
        """The same train at another speed of the first body, rpm, or load: all mean torques change in the ratio of the
        `torque`, N m."""
        changed: dict[str, Any] = {} if speed is None else {"speed": speed}
        if torque is not None:
            if tables := [body for body in self.bodies if body.torque_over_speed]:
                raise InputError("torque", "must be left out where a torque depends on the speed",
                                 field_of(tables[0], "torque_over_speed"), "Vary speed, or give that body a torque.")
            if self.torque == 0:
                raise InputError("torque", "must be given for a body, if the load is to be varied", 0.0,
                                 "All mean torques change in the ratio of the first one.")
            factor = torque / self.torque
            changed["bodies"] = [body if body.prescribed else replace(body, torque=body.torque * factor)
                                 for body in self.bodies]
        return replace(self, **changed)

    def to_pair(self) -> Train:
        """The train itself, which has the scales of its results."""
        return self

    @property
    def first_radii(self) -> tuple[float, float]:
        """The base radii of the first mesh, by which its forces become torques; 1 where stops alone have contact."""
        return self.meshes[0].base_radii if self.meshes else (1.0, 1.0)

    @property
    def scales(self) -> Scales[float]:
        """SI value of one unit of each dimensionless quantity; torques are those at the first mesh."""
        units = self.reference or units_of(self)
        first, second = self.first_radii
        kind = Scales if self.meshes else AngularScales
        return kind(length=units.length, time=1 / units.rate, velocity=units.length * units.rate, force=units.force,
                    stiffness=units.stiffness, frequency=units.rate / (2 * math.pi), rate=units.rate,
                    torque1=units.force * first, torque2=units.force * second)

    @property
    def torque(self) -> float:
        """The first mean torque that is not 0, N m: it stands for the load of the train."""
        return next(filter(None, map(self.torque_of, self.bodies)), 0.0)

    def torque_of(self, body: Body) -> float:
        """The mean torque on a body at the speed of the train, N m."""
        if body.torque_over_speed is None:
            return body.torque
        return float(self.torque_at(body, self.speed))

    def torque_at(self, body: Body, speed: Any) -> Any:
        """The torque by the table of a body at speeds of the train in rpm."""
        try:
            return body.torque_over_speed.at(float(self.ratios[body.name]) * np.asarray(speed))
        except InputError as error:
            raise InputError(field_of(body, error.field), error.rule, error.value, error.advice) from None

    @property
    def assumptions(self) -> tuple[str, ...]:
        """What stands for what the parts leave open, in words, each with the parts that it is said of."""
        found: dict[str, list[str]] = {}
        for mesh in self.meshes:
            if words := [text for text in mesh.assumed.values() if text != NO_DAMPING]:
                found.setdefault(", ".join(words), []).append(mesh.name)
            elif not any((*mesh.error_amplitudes, *mesh.eccentricity, *sum(mesh.pitch_errors, ()))):
                found.setdefault("no transmission error", []).append(mesh.name)
        at_zero = [mesh for mesh in self.meshes if mesh.varies and not mesh.phase]
        orders = list(map(self.mesh_order, at_zero))
        found["phase 0"] = [mesh.name for mesh, order in zip(at_zero, orders, strict=True) if orders.count(order) > 1]
        found[NO_DAMPING] = [part.name for part in (*self.meshes, *self.shafts) if NO_DAMPING in part.assumed.values()]
        return tuple(f"{text}: {_listed(names)}" for text, names in found.items() if names)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences about values that are possible but unusual."""
        cycles = max(self.cycles.values(), default=1)
        found = {f"The excitations repeat after {cycles} mesh cycles ({self.period * 1e3:.4g} ms), the unit in which "
                 "periods and sections are counted." + " frequency_tolerance = 0.001 may shorten it." * (
                     not self.deviation): cycles > 100}
        for mesh in self.meshes:
            most = max((abs(v) for v in (*map(abs, mesh.eccentricity), *(fault.back for fault in mesh.faults), *(
                late for wheel in mesh.pitch_errors for late in wheel))), default=0.0)
            found[f"Wear, pitch errors or eccentricity of {mesh.name} are up to {most * 1e6:.4g} µm, more than the "
                  "backlash: a plain number is in m."] = most > mesh.backlash > 0
        found |= {f"The stiffness of {mesh.name}, a Fourier series, is followed in {STEPS} steps, each its mean.": True
                  for mesh in self.meshes if isinstance(mesh.stiffness, SeriesStiffness)}
        found |= {f"The backlash of {mesh.name} is {mesh.backlash * 1e3:.4g} mm, unusually large: a plain number is in "
                  "m.": mesh.backlash > 5e-3 for mesh in self.meshes}
        return (*hardly_damped(self), *(text for text, holds in found.items() if holds))

