"""What a gear train is made of: bodies, shafts and meshes, in SI."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, fields, replace
from fractions import Fraction
from functools import cached_property
from types import SimpleNamespace
from typing import Any, TypeVar

import numpy as np

from gearchaos.errors import InputError
from gearchaos.gears import units
from gearchaos.gears.fields import (
    Convert,
    Record,
    convert_fields,
    each,
    name_of,
    number,
    one,
    read_by,
    record,
    record_values,
    two,
)
from gearchaos.gears.pair import GearPair
from gearchaos.gears.tooth_pairs import ToothPairs
from gearchaos.model import DAMPING_LAWS, HarmonicStiffness, SteppedStiffness, ToothPairStiffness
from gearchaos.model.contacts import OneSidedContacts
from gearchaos.quantities import NOT_NEGATIVE, POSITIVE
from gearchaos.validation import to_floats

GROUND = "ground"
"""The name of the housing in the ends of a shaft."""

LAWS = tuple(law for law in DAMPING_LAWS if law != "unilateral")
STEPS = 48
"""Steps in which a Fourier series of a mesh stiffness is followed."""

_JOINED = {"shaft": "-", "mesh": "/"}  # between the names of both ends in the name of a part
_MOST_ORDER = 1000  # largest order of an excitation, and largest denominator of one
_RATIO_TOLERANCE = 0.01  # largest relative difference between the ratio of base radii and that of numbers of teeth
Part = TypeVar("Part")


def field_of(part: Any, name: str) -> str:
    """A field of a part as it stands in messages: ``mesh z1/z2: backlash``."""
    return f"{type(part).__name__.lower()} {part.name}: {name}"


def read_part(kind: type[Part], number: int, value: Any) -> Part:
    """A body, shaft or mesh from a table of its fields, or itself; the n-th of a list, counted from 0.

    The field of an error is that of `field_of`, of a part without a name the number in place of this.
    """
    if isinstance(value, kind):
        return value
    word = kind.__name__.lower()
    own = value.get("name") if isinstance(value, Mapping) else None
    ends = value.get("between") if isinstance(value, Mapping) else None
    if own is None and isinstance(ends, (list, tuple)) and all(isinstance(end, str) for end in ends):
        own = _JOINED.get(word, " ").join(ends)
    label = f"{word} {own}" if isinstance(own, str) and own.strip() else f"{word} number {number + 1}"
    if not isinstance(value, Mapping):
        raise InputError(label, f"must be a {kind.__name__} or a table", value)
    try:
        return record_values(kind, label, value)
    except InputError as error:
        rest = error.field.removeprefix(label).removeprefix(".")
        raise InputError(f"{label}: {rest}" if rest else label, error.rule, error.value, error.advice) from None


def parts(kind: type[Part]) -> Convert:
    """A list of parts, each an object of this class or a table with its fields."""
    def convert(name: str, values: Any) -> tuple[Part, ...]:
        if isinstance(values, (str, bytes, Mapping)) or not hasattr(values, "__iter__"):
            raise InputError(name, f"must be a list of {kind.__name__} or tables", values)
        return tuple(read_part(kind, i, value) for i, value in enumerate(values))
    return convert


def _terms(kind: type[Part]) -> Convert:
    """A list of terms of a sum, each an object of this class or a table with its fields."""
    def convert(name: str, values: Any) -> tuple[Part, ...]:
        if isinstance(values, (str, bytes, Mapping)) or not hasattr(values, "__iter__"):
            known = ", ".join(f.name for f in fields(kind))  # type: ignore[arg-type]
            raise InputError(name, f"must be a list of tables with {known}", values)
        return tuple(record(kind)(f"{name}[{i}]", value) for i, value in enumerate(values))
    return convert


def _name(field: str, value: Any) -> str:
    if not isinstance(value, str) or not value.strip() or set(value) & set("=:,.\"'"):
        raise InputError(field, "must be a text without = : , . and quotes", value, "E.g. 'driver' or 'z1/z2'.")
    return value


def _ends(field: str, value: Any) -> tuple[str, str]:
    if isinstance(value, (str, bytes)) or not hasattr(value, "__len__") or len(value) != 2:
        raise InputError(field, "must be a list of the names of two bodies", value, "E.g. ['driver', 'loose'].")
    first, second = (_name(f"{field}[{i}]", v) for i, v in enumerate(value))
    if first == second:
        raise InputError(field, "must be two different bodies", first)
    return first, second


def _order(field: str, value: Any) -> float:
    found = number(POSITIVE)(field, value)
    if found > _MOST_ORDER or abs(Fraction(found).limit_denominator(_MOST_ORDER) - found) > 1e-9 * found:
        raise InputError(field, f"must be a ratio of whole numbers up to {_MOST_ORDER}", value, "E.g. 2 or 0.5.")
    return found


@dataclass(frozen=True, kw_only=True)
class _Order:
    """A term amplitude × cos(order Ω t + phase), Ω the speed of the first body."""

    order: Any = field(metadata=read_by(_order))
    phase: Any = field(default=0.0, metadata=read_by(one(units.ANGLE)))

    def __post_init__(self) -> None:
        convert_fields(self)

    @property
    def ratio(self) -> Fraction:
        """The order as a ratio of whole numbers."""
        return Fraction(self.order).limit_denominator(_MOST_ORDER)


@dataclass(frozen=True, kw_only=True)
class MotionOrder(_Order):
    """A prescribed angular acceleration, or angle, beside the uniform rotation."""

    acceleration: Any = field(default=None, metadata=read_by(one(units.ANGULAR_ACCELERATION)))
    angle: Any = field(default=None, metadata=read_by(one(units.ANGLE)))

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.acceleration is None) == (self.angle is None):
            raise InputError("acceleration", "must be given, or angle, not both",
                             None if self.angle is None else "both", "E.g. acceleration = '300 rad/s^2'.")


@dataclass(frozen=True, kw_only=True)
class TorqueOrder(_Order):
    """A torque that varies, in the body's own sense of rotation."""

    amplitude: Any = field(metadata=read_by(one(units.TORQUE)))


@dataclass(frozen=True, kw_only=True)
class TorqueTable(Record):
    """A mean torque over the speed of its body, linear between the values given."""

    speed: Any = field(metadata=read_by(each(units.SPEED)))
    torque: Any = field(metadata=read_by(each(units.TORQUE)))

    def __post_init__(self) -> None:
        convert_fields(self)
        if len(self.speed) < 2 or any(b <= a for a, b in zip((-1e-300, *self.speed), self.speed, strict=False)):
            raise InputError("speed", "must be two or more rising values, none below 0", list(self.speed))
        if len(self.torque) != len(self.speed):
            raise InputError("torque", f"must have {len(self.speed)} values, one for each speed", len(self.torque))

    def at(self, speed: Any) -> Any:
        """The torque at speeds of the body in rpm, of either sign; raises `InputError` beyond the table."""
        wrong = np.extract((np.abs(speed) < self.speed[0]) | (np.abs(speed) > self.speed[-1]), speed)
        if len(wrong):
            raise InputError("torque_over_speed", f"must have the speed {abs(wrong[0]):.6g} rpm of the body within it",
                             f"{self.speed[0]:.6g} to {self.speed[-1]:.6g} rpm")
        return np.interp(np.abs(speed), self.speed, self.torque)


@dataclass(frozen=True, kw_only=True)
class Support(Record):
    """An elastic support of the centre of a body: along one direction, or alike in all."""

    stiffness: Any = field(metadata=read_by(one(units.STIFFNESS, POSITIVE)))
    damping: Any = field(default=0.0, metadata=read_by(one(units.DAMPING, NOT_NEGATIVE)))
    direction: Any = field(default=None, metadata=read_by(one(units.ANGLE)))

    def __post_init__(self) -> None:
        convert_fields(self)


@dataclass(frozen=True)
class Units(Record):
    """SI values of the units of a train: of length, frequency (rad/s) and stiffness of its first mesh."""

    length: float = field(metadata=read_by(number(POSITIVE)))
    rate: float = field(metadata=read_by(number(POSITIVE)))
    stiffness: float = field(metadata=read_by(number(POSITIVE)))

    @property
    def force(self) -> float:
        return self.stiffness * self.length


@dataclass(frozen=True, kw_only=True)
class Body:
    """A rotating body of a `Train`: a wheel with its shaft, a motor, a load, a carrier.

    A value is a number in SI or a text with a unit such as ``"5e-4 kg*m^2"``.

    Parameters
    ----------
    name : str
    inertia : length² mass, optional
        About its own axis. Without it the motion is prescribed.
    motion : list of MotionOrder or tables, optional
        Prescribed motion beside the uniform rotation: ``order`` of the turn of the first body, ``acceleration`` or
        ``angle``, ``phase``. An empty list is uniform rotation.
    fixed : bool
        Whether it is held by the housing, as the ring of many planetary sets. Then it has no inertia.
    torque : torque
        Mean torque from outside in the body's own sense of rotation: it drives if positive.
    torque_over_speed : TorqueTable or table, optional
        In place of ``torque``: lists ``speed`` and ``torque`` of a drag or load that depends on the steady speed of the
        body. Oscillations do not change it; ``damping`` acts on these.
    torque_orders : list of TorqueOrder or tables
        With ``order``, ``amplitude`` and ``phase``.
    damping : torque time
        Of deviations from uniform rotation, to the housing.
    mass : mass, optional
        With a ``support`` or a ``pin``, or of a planet.
    support : Support or table, optional
        With ``stiffness``, ``damping`` and ``direction``, an angle; without a direction alike in all.
    carrier : str, optional
        Of a planet: the body that carries its centre, at the distance ``orbit`` and the angle ``position``, in a
        ``pin``, a `Support`, or without play and elasticity.
    orbit : length, optional
    position : angle
    pin : Support or table, optional

    Raises
    ------
    InputError
        For a value that breaks a rule.

    Examples
    --------
    >>> import gearchaos as gc
    >>> gc.Body(name="loose", inertia="5e-4 kg*m^2", torque="-0.1 N*m").torque
    -0.1
    """

    name: str = field(metadata=read_by(_name))
    inertia: Any = field(default=None, metadata=read_by(one(units.INERTIA, POSITIVE)))
    motion: Any = field(default=None, metadata=read_by(_terms(MotionOrder)))
    fixed: bool = False
    torque: Any = field(default=0.0, metadata=read_by(one(units.TORQUE)))
    torque_over_speed: Any = field(default=None, metadata=read_by(record(TorqueTable)))
    torque_orders: Any = field(default=(), metadata=read_by(_terms(TorqueOrder)))
    damping: Any = field(default=0.0, metadata=read_by(one(units.BEARING_FRICTION, NOT_NEGATIVE)))
    mass: Any = field(default=None, metadata=read_by(one(units.MASS, POSITIVE)))
    support: Any = field(default=None, metadata=read_by(record(Support)))
    carrier: Any = field(default=None, metadata=read_by(_name))
    orbit: Any = field(default=None, metadata=read_by(one(units.LENGTH, POSITIVE)))
    position: Any = field(default=0.0, metadata=read_by(one(units.ANGLE)))
    pin: Any = field(default=None, metadata=read_by(record(Support)))

    def __post_init__(self) -> None:
        convert_fields(self)
        if self.name == GROUND:
            raise InputError("name", "must be another name", self.name, "It stands for the housing in a shaft.")
        if not isinstance(self.fixed, bool):
            raise InputError("fixed", "must be true or false", self.fixed)
        given = [name for name in ("inertia", "motion") if getattr(self, name) is not None] + ["fixed"] * self.fixed
        if len(given) != 1:
            raise InputError("inertia", "must be given, or motion, or fixed, and only one of them", given or None,
                             f"{self.name} is moved by torques, or moves as prescribed (motion = [] is uniform "
                             "rotation), or is held.")
        if self.torque and self.torque_over_speed is not None:
            raise InputError("torque", "must be left out beside torque_over_speed", self.torque)
        idle = {name: getattr(self, name) for name in ("torque", "torque_over_speed", "torque_orders", "damping")}
        for name, value in idle.items() if self.prescribed else ():
            if value:
                raise InputError(name, "must be left out where the motion is prescribed", value,
                                 f"It has no effect on {self.name}.")
        if (self.carrier is None) != (self.orbit is None):
            raise InputError("orbit", "must be given with carrier, and only with it", self.orbit)
        if self.carrier is not None and self.support is not None:
            raise InputError("support", "must be left out for a planet", "given", "A planet has a pin in its carrier.")
        for name in ("pin", "position") if self.carrier is None else ():
            if getattr(self, name):
                raise InputError(name, "must be left out without carrier", "a value",
                                 "It is that of a planet, and has no effect here.")
        if self.mass is None and (self.support is not None or self.carrier is not None):
            raise InputError("mass", "must be given where the centre moves", None,
                             "It does with a support, and that of a planet with its carrier.")
        if self.mass is not None and self.support is None and self.carrier is None:
            raise InputError("mass", "must be left out where the centre rests", units.Shown(self.mass, self.mass),
                             "It has no effect there. Or give support, or of a planet carrier and orbit.")

    @property
    def prescribed(self) -> bool:
        """Whether its motion is prescribed: given, or none."""
        return self.inertia is None


@dataclass(frozen=True, kw_only=True)
class Shaft:
    """A shaft, clutch or spline between two bodies of a `Train`, which turn alike.

    Parameters
    ----------
    between : two names
        Of bodies; the second may be ``"ground"``, the housing.
    name : str, optional
        By default both names with a hyphen.
    stiffness : torque/angle
        Of the spring; 0 for a coupling that has play and stops alone.
    damping : torque time
        Of the spring.
    stop : angle, optional
        The angle, to both sides, from which on stops act in parallel: half the play of a spline, or the end of the
        first stage of a clutch.
    stop_stiffness, stop_damping : torque/angle, torque time
        Of the stops; their damping acts while they touch.

    Examples
    --------
    >>> import gearchaos as gc
    >>> gc.Shaft(between=("motor", "pinion"), stiffness="2e4 N*m/rad").name
    'motor-pinion'
    """

    between: Any = field(metadata=read_by(_ends))
    name: Any = field(default=None, metadata=read_by(_name))
    stiffness: Any = field(default=0.0, metadata=read_by(one(units.TORSIONAL_STIFFNESS, NOT_NEGATIVE)))
    damping: Any = field(default=0.0, metadata=read_by(one(units.BEARING_FRICTION, NOT_NEGATIVE)))
    stop: Any = field(default=None, metadata=read_by(one(units.ANGLE, NOT_NEGATIVE)))
    stop_stiffness: Any = field(default=None, metadata=read_by(one(units.TORSIONAL_STIFFNESS, POSITIVE)))
    stop_damping: Any = field(default=0.0, metadata=read_by(one(units.BEARING_FRICTION, NOT_NEGATIVE)))

    def __post_init__(self) -> None:
        convert_fields(self)
        object.__setattr__(self, "name", self.name or _JOINED["shaft"].join(self.between))
        if (self.stop is None) != (self.stop_stiffness is None):
            raise InputError("stop_stiffness", "must be given with stop, and only with it", self.stop_stiffness)
        if self.stop is None and self.stop_damping:
            raise InputError("stop_damping", "must be left out without stop", self.stop_damping,
                             "It has no effect.")
        if self.stiffness == 0 and self.damping:
            raise InputError("damping", "must be left out without stiffness", self.damping,
                             "It belongs to the spring and has no effect; stop_damping is that of the stops.")
        if self.stiffness == 0 and self.stop is None:
            raise InputError("stiffness", "must be greater than 0, or stop and stop_stiffness be given", 0.0,
                             "A shaft transmits torque. For a rigid one let both bodies be one.")


@dataclass(frozen=True, kw_only=True)
class SeriesStiffness(Record):
    """A mesh stiffness c(ψ) = ``mean`` + Σ ``amplitudes[j - 1]`` cos(j ψ − ``phases[j - 1]``), N/m, ψ the phase of the
    mesh cycle. It is followed in `STEPS` steps, each the mean of the series over it."""

    mean: Any = field(metadata=read_by(one(units.STIFFNESS, POSITIVE)))
    amplitudes: Any = field(metadata=read_by(each(units.STIFFNESS)))
    phases: Any = field(default=(), metadata=read_by(each(units.ANGLE)))

    def __post_init__(self) -> None:
        convert_fields(self)
        if len(self.phases) > len(self.amplitudes):
            raise InputError("phases", "must not be longer than amplitudes", len(self.phases))
        if not self.amplitudes:
            raise InputError("amplitudes", "must have at least one value", [], "A constant stiffness is one number.")
        if (least := float(self._levels().min())) <= 0:
            raise InputError("amplitudes", "must leave the stiffness positive", list(self.amplitudes),
                             f"With a mean of {self.mean:.6g} N/m it falls to {least:.6g} N/m.")

    def _levels(self) -> np.ndarray:
        """The means of the series over equal steps of the mesh cycle, N/m."""
        edges = np.arange(STEPS + 1) / STEPS
        levels = np.full(STEPS, float(self.mean))
        for j, amplitude in enumerate(self.amplitudes, 1):
            phase = self.phases[j - 1] if j <= len(self.phases) else 0.0
            levels += amplitude * np.diff(np.sin(2 * np.pi * j * edges - phase)) * STEPS / (2 * np.pi * j)
        return levels

    @cached_property
    def steps(self) -> SteppedStiffness:
        """The same stiffness in steps, N/m."""
        return SteppedStiffness(tuple(self._levels().tolist()), tuple((np.arange(STEPS) / STEPS).tolist()))

    def scaled(self, factor: float) -> SeriesStiffness:
        """The same stiffness times a factor."""
        return replace(self, mean=self.mean * factor, amplitudes=tuple(a * factor for a in self.amplitudes))


def _stiffness(field: str, value: Any) -> Any:
    """A stiffness in N/m, or a table: one in steps with ``levels`` in N/m and ``starts``, or a `SeriesStiffness`."""
    if isinstance(value, (SteppedStiffness, SeriesStiffness)):
        return value
    if not isinstance(value, Mapping):
        return one(units.STIFFNESS, POSITIVE)(field, value)
    if "mean" in value:
        return record(SeriesStiffness)(field, value)
    if set(value) != {"levels", "starts"}:
        raise InputError(field, "must be a stiffness, or a table with levels and starts, or with mean, amplitudes and "
                         "phases", dict(value), "Starts are shares of the mesh cycle.")
    levels = each(units.STIFFNESS)(f"{field}.levels", value["levels"])
    return SteppedStiffness(levels, to_floats(f"{field}.starts", value["starts"]))


_OF_DESIGN = ("teeth", "base_radii", "stiffness", "tooth_pairs", "damping", "backlash", "error_amplitudes",
              "error_phases")
"""The fields of a mesh that a design has."""


_ANY_DAMPING = 0.05  # of a design that lacks it, where the damping is given beside it


def _points(design: Any) -> list[Any]:
    """A design at its speed and torque; one that lacks them at two of each, between which it must not differ."""
    lacks = {name: values for name, values in (("speed", (600.0, 900.0)), ("torque", (50.0, 75.0)))
             if getattr(design, name, values) is None}
    if not lacks:
        return [design]
    return [design.at(**{name: values[i] for name, values in lacks.items()}) for i in (0, 1)]


def _values_of(design: Any, without: Collection[str]) -> dict[str, Any]:
    """The values of a mesh by name that a design or a pair has, those left out that are not wanted."""
    pair: GearPair = design.to_pair()
    found: dict[str, Any] = {
        "teeth": (pair.n1, pair.n2), "base_radii": (pair.R1, pair.R2), "damping": pair.k, "backlash": pair.backlash,
        "error_amplitudes": pair.error_amplitudes, "error_phases": pair.error_phases}
    stiffness = design.to_model().stiffness
    if "stiffness" not in without:
        if isinstance(stiffness, ToothPairStiffness):
            found["tooth_pairs"] = pair.tooth_pairs
        elif isinstance(stiffness, HarmonicStiffness):
            found["stiffness"] = SeriesStiffness(mean=pair.c0, phases=stiffness.phases, amplitudes=tuple(
                a * pair.c0 for a in stiffness.amplitudes))
        else:
            parts = stiffness.parts(stiffness.numbers())
            found["stiffness"] = SteppedStiffness(tuple(float(level) * pair.c0 for _, level in parts),
                                                  tuple(float(start) for start, _ in parts))
    return {name: value for name, value in found.items() if name not in without}


def _design(field: str, value: Any) -> Any:
    if not hasattr(value, "to_pair"):
        raise InputError(field, "must be a GearDesign or a GearPair, in a study file the path of one", value)
    return value


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """A gear mesh between two bodies of a `Train`.

    Its deflection is s = r_a φ_a − r_b φ_b − e(t), φ in each wheel's own sense of rotation: s > 0 on the front flank,
    by which the first body drives the second one, and s < −backlash on the back flank.

    Parameters
    ----------
    between : two names
        Driving and driven body.
    name : str, optional
        By default both names with a slash.
    design : GearDesign or GearPair, optional
        Whose teeth, base radii, stiffness, damping, backlash and error are those of the mesh. In a study file the path
        of a file with ``[design]`` or ``[gearpair]``. What is given beside it replaces its value.
    teeth : two int
    base_radii : two lengths
        In the ratio of the teeth to 1 %; the second one is taken to be in that ratio exactly.
    stiffness : force/length, or table
        Constant, or ``levels`` and where each ``starts`` in the mesh cycle, or a Fourier series with ``mean``,
        ``amplitudes`` and ``phases``, as in (2.7), which is followed in 48 steps.
    tooth_pairs : table
        Or tooth pairs that share the load, as of `GearPair`.
    damping : force time/length
    backlash : length
        Total, along the line of action.
    error_amplitudes, error_phases : list of length, list of angle
        Static transmission error e(t) = Σ e_j cos(j ψ − θ_j), ψ the phase of the mesh cycle.
    phase : angle
        ψ at t = 0.
    damping_law : {"always", "contact"}, optional
        That of the train by default.
    internal : bool
        Whether one of the wheels is a ring.
    line_of_action : angle
        Direction along which a displacement of the centre of the first body presses the flanks together; matters
        where centres move. Of a planet it follows from ``pressure_angle``.
    pressure_angle : angle, optional
        Working pressure angle, of a mesh with a planet.

    Examples
    --------
    >>> import gearchaos as gc
    >>> mesh = gc.Mesh(between=("driver", "loose"), teeth=(20, 30), base_radii=("30 mm", "45 mm"),
    ...                stiffness="2e8 N/m", damping="60 N*s/m", backlash="0.12 mm")
    >>> mesh.name, mesh.backlash
    ('driver/loose', 0.00012)
    """

    between: Any = field(metadata=read_by(_ends))
    name: Any = field(default=None, metadata=read_by(_name))
    design: Any = field(default=None, metadata=read_by(_design))
    teeth: Any = field(default=None, metadata=read_by(two(units.teeth, "must be a list of two numbers of teeth")))
    base_radii: Any = field(default=None, metadata=read_by(two(one(units.LENGTH, POSITIVE), "must be a list of two")))
    stiffness: Any = field(default=None, metadata=read_by(_stiffness))
    tooth_pairs: Any = field(default=None, metadata=read_by(record(ToothPairs)))
    damping: Any = field(default=None, metadata=read_by(one(units.DAMPING, NOT_NEGATIVE)))
    backlash: Any = field(default=None, metadata=read_by(one(units.LENGTH, NOT_NEGATIVE)))
    error_amplitudes: Any = field(default=None, metadata=read_by(each(units.LENGTH)))
    error_phases: Any = field(default=None, metadata=read_by(each(units.ANGLE)))
    phase: Any = field(default=0.0, metadata=read_by(one(units.ANGLE)))
    damping_law: Any = field(default=None, metadata=read_by(name_of(*LAWS)))
    internal: bool = False
    line_of_action: Any = field(default=None, metadata=read_by(one(units.ANGLE)))
    pressure_angle: Any = field(default=None, metadata=read_by(one(units.ANGLE, POSITIVE)))

    def __post_init__(self) -> None:
        convert_fields(self)
        object.__setattr__(self, "name", self.name or _JOINED["mesh"].join(self.between))
        if not isinstance(self.internal, bool):
            raise InputError("internal", "must be true or false", self.internal)
        if self.stiffness is not None and self.tooth_pairs is not None:
            raise InputError("stiffness", "must be left out beside tooth_pairs", self.stiffness,
                             "The stiffness of the mesh is that of its tooth pairs.")
        for name, value in self._of_design().items():
            object.__setattr__(self, name, value)
        for name in ("teeth", "base_radii", "backlash"):
            if getattr(self, name) is None:
                raise InputError(name, "must be given", None, "Or give a design.")
        if self.stiffness is None and self.tooth_pairs is None:
            raise InputError("stiffness", "must be given, or tooth_pairs, or a design", None)
        for name, default in (("damping", 0.0), ("error_amplitudes", ()), ("error_phases", ())):
            if getattr(self, name) is None:
                object.__setattr__(self, name, default)
        if len(self.error_phases) > len(self.error_amplitudes):
            raise InputError("error_phases", "must not be longer than error_amplitudes", len(self.error_phases))
        (z1, z2), (r1, r2) = self.teeth, self.base_radii
        if abs(r1 / r2 * z2 / z1 - 1) > _RATIO_TOLERANCE:
            raise InputError("base_radii", f"must be in the ratio of the teeth, {z1}/{z2} = {z1 / z2:.6g}, to 1 %",
                             round(r1 / r2, 6), "Base radii are m z cos(α)/2.")
        object.__setattr__(self, "base_radii", (r1, r1 * z2 / z1))  # without the rounding of drawings
        object.__setattr__(self, "design", None)  # its values are those of the mesh
        if self.phase and not self.varies:
            raise InputError("phase", "must be left out for a mesh of constant stiffness without error",
                             units.Shown(self.phase, self.phase), "It has no effect.")

    def _of_design(self) -> dict[str, Any]:
        """The values of the design, by the names of fields."""
        if self.design is None:
            return {}
        own = {name for name in _OF_DESIGN if getattr(self, name) is not None}
        own |= {"stiffness", "tooth_pairs"} if own & {"stiffness", "tooth_pairs"} else set()
        design = self.design
        if "damping" in own and getattr(design, "damping_ratio", own) is None:
            design = replace(design, damping_ratio=_ANY_DAMPING)
        try:
            points = [_values_of(point, own) for point in _points(design)]
        except InputError as error:
            raise InputError(f"design: {error.field}", error.rule, error.value, error.advice) from None
        for name, value in points[0].items():
            if any(point[name] != value for point in points[1:]):
                raise InputError("design", "must have a speed and a torque", "none",
                                 f"Its {name} depends on them: write [operation] with speed and torque in its file, or "
                                 f"give {name} beside it.")
        return points[0]

    def with_mean_stiffness(self, mean: Any, own: float) -> Mesh:
        """This mesh with another mean stiffness than its ``own`` one, and a stiffness of the same form."""
        mean = units.to_si("stiffness", mean, units.STIFFNESS, POSITIVE)
        if self.tooth_pairs is not None:
            levels = tuple(level * mean / own for level in self.tooth_pairs.stiffness)
            return replace(self, tooth_pairs=replace(self.tooth_pairs, stiffness=levels))
        if isinstance(self.stiffness, SeriesStiffness):
            return replace(self, stiffness=self.stiffness.scaled(mean / own))
        if isinstance(self.stiffness, SteppedStiffness):
            levels = tuple(level * mean / own for level in self.stiffness.levels)
            return replace(self, stiffness=replace(self.stiffness, levels=levels))
        return replace(self, stiffness=mean)

    def contacts(self) -> OneSidedContacts:
        """The contacts of one mesh cycle, stiffnesses in N/m and gaps in m."""
        if self.tooth_pairs is not None:
            in_si = SimpleNamespace(tooth_pairs=self.tooth_pairs, half_backlash=1.0, c0=1.0)
            pairs: Any = ToothPairStiffness.from_pair(in_si)
            return ToothPairStiffness.contacts(pairs.numbers(), 1)
        levels: tuple[float, ...] = (self.stiffness,)
        starts: tuple[float, ...] = (0.0,)
        stepped = self.stiffness.steps if isinstance(self.stiffness, SeriesStiffness) else self.stiffness
        if isinstance(stepped, SteppedStiffness):
            levels, starts = stepped.levels, stepped.starts
        if starts[0] > 0:  # until then the last level of the cycle before lasts on
            levels, starts = (levels[-1], *levels), (0.0, *starts)
        both = np.array([levels, levels], float)[None]
        return OneSidedContacts(np.array([1, -1]), np.array([starts], float), both, np.zeros((*both.shape, 3)))

    @property
    def constant(self) -> bool:
        """Whether the stiffness is the same along the mesh cycle."""
        stepped = isinstance(self.stiffness, SteppedStiffness) and len(set(self.stiffness.levels)) > 1
        series = isinstance(self.stiffness, SeriesStiffness) and any(self.stiffness.amplitudes)
        return not (stepped or series or self.tooth_pairs is not None)

    @property
    def varies(self) -> bool:
        """Whether stiffness or error change along the mesh cycle."""
        return not self.constant or any(self.error_amplitudes)
