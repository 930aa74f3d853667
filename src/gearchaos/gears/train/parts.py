"""What a gear train is made of beside its meshes: bodies and shafts, in SI; and how tables of parts are read."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from fractions import Fraction
from functools import partial
from typing import Any, TypeVar

import numpy as np

from gearchaos.errors import InputError, gather
from gearchaos.gears.io import units
from gearchaos.gears.io.fields import (
    Convert,
    Record,
    convert_fields,
    each,
    number,
    one,
    read_by,
    record,
    record_values,
)
from gearchaos.quantities import NOT_NEGATIVE, POSITIVE

GROUND = "ground"
"""The name of the housing in the ends of a shaft."""

JOINED = {"shaft": "-", "mesh": "/"}  # between the names of both ends in the name of a part
NO_DAMPING = "no damping"  # in words, of a part of which none is given
_MOST_ORDER = 1000  # largest order of an excitation, and largest denominator of a short ratio
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
        own = JOINED.get(word, " ").join(ends)
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
        return tuple(gather(partial(read_part, kind, i, value) for i, value in enumerate(values)))
    return convert


def terms(kind: type[Part]) -> Convert:
    """A list of terms of a sum, each an object of this class or a table with its fields."""
    def convert(name: str, values: Any) -> tuple[Part, ...]:
        if isinstance(values, (str, bytes, Mapping)) or not hasattr(values, "__iter__"):
            known = ", ".join(f.name for f in fields(kind))  # type: ignore[arg-type]
            raise InputError(name, f"must be a list of tables with {known}", values)
        return tuple(record(kind)(f"{name}[{i}]", value) for i, value in enumerate(values))
    return convert


def part_name(field: str, value: Any) -> str:
    if not isinstance(value, str) or not value.strip() or set(value) & set("=:,.\"'"):
        raise InputError(field, "must be a text without = : , . and quotes", value, "E.g. 'driver' or 'z1/z2'.")
    return value


def texts(field: str, value: Any) -> dict[str, str]:
    if not isinstance(value, Mapping) or not all(isinstance(text, str) for text in value.values()):
        raise InputError(field, "must be a table of texts", value, 'E.g. assumed = { damping = "ζ 0.05" }.')
    return dict(value)


def ends_of(field: str, value: Any) -> tuple[str, str]:
    if isinstance(value, (str, bytes)) or not hasattr(value, "__len__") or len(value) != 2:
        raise InputError(field, "must be a list of the names of two bodies", value, "E.g. ['driver', 'loose'].")
    first, second = (part_name(f"{field}[{i}]", v) for i, v in enumerate(value))
    if first == second:
        raise InputError(field, "must be two different bodies", first)
    return first, second


def _order(field: str, value: Any) -> float:
    ratio = re.fullmatch(r"\s*(\d{1,9})\s*/\s*([1-9]\d{0,8})\s*", value) if isinstance(value, str) else None
    found = number(POSITIVE)(field, int(ratio[1]) / int(ratio[2]) if ratio else value)
    if not 1 / _MOST_ORDER <= found <= _MOST_ORDER:
        raise InputError(field, f"must lie between 1/{_MOST_ORDER} and {_MOST_ORDER}", value,
                         "It counts turns of the first body, e.g. 2, 0.5 or '7/3'.")
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
        """The order as a ratio of whole numbers: a short one if it is near."""
        short = Fraction(self.order).limit_denominator(_MOST_ORDER)
        return short if abs(short / self.order - 1) < 1e-9 else Fraction(self.order).limit_denominator(10**6)


@dataclass(frozen=True, kw_only=True)
class MotionOrder(_Order):
    """A prescribed angular acceleration, or angle, beside the uniform rotation, in the body's own sense of rotation:
    amplitude × cos(order Ω t + phase), Ω the speed of the first body."""

    acceleration: Any = field(default=None, metadata=read_by(one(units.ANGULAR_ACCELERATION)))
    angle: Any = field(default=None, metadata=read_by(one(units.ANGLE)))

    def __post_init__(self) -> None:
        super().__post_init__()
        if (self.acceleration is None) == (self.angle is None):
            raise InputError("acceleration", "must be given, or angle, not both",
                             None if self.angle is None else "both", "E.g. acceleration = '300 rad/s^2'.")


@dataclass(frozen=True, kw_only=True)
class TorqueOrder(_Order):
    """A torque amplitude × cos(order Ω t + phase) in the sense in which the body turns, Ω that of the first."""

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
        With ``order``, ``amplitude`` and ``phase``: amplitude × cos(order Ω t + phase). The phase leads, where those of
        transmission errors and stiffnesses lag.
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
    position_error : length
        Of a planet: how far its pin stands ahead of ``position`` on the orbit. It changes how planets share the load.
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

    name: str = field(metadata=read_by(part_name))
    inertia: Any = field(default=None, metadata=read_by(one(units.INERTIA, POSITIVE)))
    motion: Any = field(default=None, metadata=read_by(terms(MotionOrder)))
    fixed: bool = False
    torque: Any = field(default=0.0, metadata=read_by(one(units.TORQUE)))
    torque_over_speed: Any = field(default=None, metadata=read_by(record(TorqueTable)))
    torque_orders: Any = field(default=(), metadata=read_by(terms(TorqueOrder)))
    damping: Any = field(default=0.0, metadata=read_by(one(units.BEARING_FRICTION, NOT_NEGATIVE)))
    mass: Any = field(default=None, metadata=read_by(one(units.MASS, POSITIVE)))
    support: Any = field(default=None, metadata=read_by(record(Support)))
    carrier: Any = field(default=None, metadata=read_by(part_name))
    orbit: Any = field(default=None, metadata=read_by(one(units.LENGTH, POSITIVE)))
    position: Any = field(default=0.0, metadata=read_by(one(units.ANGLE)))
    position_error: Any = field(default=0.0, metadata=read_by(one(units.LENGTH)))
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
                             "rotation), or is held. A joint of two shafts without inertia is left out: they are one "
                             "shaft of 1/(1/k1 + 1/k2).")
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
        for name in ("pin", "position", "position_error") if self.carrier is None else ():
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
        The angle from which on stops act in parallel: half the play of a spline, or the end of the first stage of a
        clutch.
    stop_back : angle, optional
        That of the other side, where the second body runs ahead, by default the same; a large one is none.
    stop_stiffness, stop_damping : torque/angle, torque time
        Of the stops; their damping acts while they touch.
    assumed : table of texts
        What stands for what is left open, by field, as it is printed.

    Examples
    --------
    >>> import gearchaos as gc
    >>> gc.Shaft(between=("motor", "pinion"), stiffness="2e4 N*m/rad").name
    'motor-pinion'
    """

    between: Any = field(metadata=read_by(ends_of))
    name: Any = field(default=None, metadata=read_by(part_name))
    stiffness: Any = field(default=0.0, metadata=read_by(one(units.TORSIONAL_STIFFNESS, NOT_NEGATIVE)))
    damping: Any = field(default=None, metadata=read_by(one(units.BEARING_FRICTION, NOT_NEGATIVE)))
    stop: Any = field(default=None, metadata=read_by(one(units.ANGLE, NOT_NEGATIVE)))
    stop_back: Any = field(default=None, metadata=read_by(one(units.ANGLE, NOT_NEGATIVE)))
    stop_stiffness: Any = field(default=None, metadata=read_by(one(units.TORSIONAL_STIFFNESS, POSITIVE)))
    stop_damping: Any = field(default=None, metadata=read_by(one(units.BEARING_FRICTION, NOT_NEGATIVE)))
    assumed: Any = field(default=None, compare=False, metadata=read_by(texts))

    def __post_init__(self) -> None:
        convert_fields(self)
        object.__setattr__(self, "name", self.name or JOINED["shaft"].join(self.between))
        of = "damping" if self.stiffness else "stop_damping"
        object.__setattr__(self, "assumed", self.assumed or ({of: NO_DAMPING} if getattr(self, of) is None else {}))
        for name in ("damping", "stop_damping"):
            object.__setattr__(self, name, getattr(self, name) or 0.0)
        if (self.stop is None) != (self.stop_stiffness is None):
            raise InputError("stop_stiffness", "must be given with stop, and only with it", self.stop_stiffness)
        for name in ("stop_back", "stop_damping") if self.stop is None else ():
            if value := getattr(self, name):
                raise InputError(name, "must be left out without stop", value, "It has no effect.")
        if self.stiffness == 0 and self.damping:
            raise InputError("damping", "must be left out without stiffness", self.damping,
                             "It belongs to the spring and has no effect; stop_damping is that of the stops.")
        if self.stiffness == 0 and self.stop is None:
            raise InputError("stiffness", "must be greater than 0, or stop and stop_stiffness be given", 0.0,
                             "A shaft transmits torque. For a rigid one let both bodies be one.")
