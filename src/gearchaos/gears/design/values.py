"""The parts of a gear design that are tables of several values, and how its inputs are read."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, ClassVar

from gearchaos.errors import ChangedFileError, InputError, unknown_name
from gearchaos.files import read_bytes
from gearchaos.gears.geometry.dimensions import KEEP_CLEARANCE
from gearchaos.gears.io import units
from gearchaos.gears.io.fields import (
    Reader,
    Record,
    convert_fields,
    each,
    name_of,
    number,
    one,
    read_by,
    readers,
    record,
    record_values,
    two,
    whole,
)
from gearchaos.gears.io.tables import MOST_BYTES
from gearchaos.gears.stiffness.iso6336 import Blank
from gearchaos.gears.transmission_error import Quality
from gearchaos.gears.transmission_error.pitch import pitch_from_table
from gearchaos.quantities import NOT_NEGATIVE, POSITIVE, Rule

BELOW_ONE = Rule(lambda v: (v > 0) & (v < 1), "must be greater than 0 and less than 1",
                 "It is the ratio of the damping to the critical one, not a percentage.")


@dataclass(frozen=True, kw_only=True)
class Rack(Record):
    """Basic rack tooth profile h_aP, h_fP and ρ_fP, in normal modules; by default profile A of ISO 53:1998."""

    addendum: float = field(default=1.0, metadata=read_by(number(POSITIVE)))
    dedendum: float = field(default=1.25, metadata=read_by(number(POSITIVE)))
    root_radius: float = field(default=0.38, metadata=read_by(number(NOT_NEGATIVE)))


PROFILE_A = Rack()  # profile A of ISO 53:1998
INCH = 25.4e-3  # one inch in m
PRESSURE_ANGLE = math.radians(20)  # normal pressure angle of ISO 53:1998, rad


def yes_or_no(name: str, value: Any) -> bool:
    if not isinstance(value, bool):
        raise InputError(name, "must be true or false", value)
    return value


@dataclass(frozen=True, kw_only=True)
class ReliefDimensions(Record):
    """Tip relief of both wheels as a drawing gives it.

    The amount is C_a, the profile deviation at the tip circle: in the transverse plane along the line of action, 0 for
    a wheel without relief. The relief begins at the start diameter; without it only results that need no more than the
    amount can be computed. It grows in this shape to the tip.
    """

    amount: Any = field(metadata=read_by(two(one(units.LENGTH, NOT_NEGATIVE))))
    start_diameter: Any = field(default=None, metadata=read_by(two(one(units.LENGTH, POSITIVE))))
    shape: str = field(default="linear", metadata=read_by(name_of("linear", "parabolic")))


@dataclass(frozen=True, kw_only=True)
class Supports(Record):
    """Elastic supports of both wheels along the line of action: shaft and bearings together, with the wheel's mass."""

    stiffness: Any = field(metadata=read_by(two(one(units.STIFFNESS, POSITIVE, (1e4, 1e13)))))
    damping_ratio: Any = field(metadata=read_by(two(number(
        Rule(lambda v: (v >= 0) & (v < 1), "must be at least 0 and less than 1")))))


def _headers(field: str, value: Any) -> tuple[tuple[str, str], ...]:
    """Headers in a file by the names of columns, as pairs."""
    try:
        chosen = dict(value)
    except (TypeError, ValueError):
        chosen = {"": None}
    if not all(isinstance(text, str) and text for pair in chosen.items() for text in pair):
        raise InputError(field, "must be a table of headers in the file", value,
                         "E.g. { angle = 'Angle of rotation', value = 'Stiffness curve' }.")
    return tuple(chosen.items())


@dataclass(frozen=True, kw_only=True)
class DataFile:
    """What all files of a design have: the checksum of the content, by default that of now, and headers of columns."""

    key: ClassVar[str] = "table"  # the field with the path

    sha256: str = ""
    columns: Any = field(default=(), metadata=read_by(_headers))

    def __post_init__(self) -> None:
        found = self.sha256 or _checksum(self.path)
        if not found:
            raise InputError(self.key, "must be a file that can be read", self.path,
                             "It does not exist, is no file, is too large or may not be read. Write the table first, "
                             "or correct the path.")
        object.__setattr__(self, "sha256", found)
        convert_fields(self)

    @property
    def path(self) -> str:
        return str(getattr(self, self.key))

    def check_unchanged(self, field: str) -> None:
        """Raise `ChangedFileError` if the content is no longer that with which the design was made."""
        if _checksum(self.path) != self.sha256:
            raise ChangedFileError(f"{field}.{self.key}", "must be the file with which the design was made", self.path,
                                   "It is missing or was changed since. Make the design again, or restore the file.")


@dataclass(frozen=True, kw_only=True)
class TableFile(DataFile):
    """A file with the stiffness over one or more mesh periods; the speed of wheel 1, in rpm, is that of times."""

    table: str
    speed: Any = field(default=None, metadata=read_by(one(units.SPEED, POSITIVE)))


@dataclass(frozen=True, kw_only=True)
class ErrorFile(DataFile):
    """A file with a transmission error: the angle of this wheel, or without one a length along the line of action."""

    wheel: Any = field(default=None, metadata=read_by(
        whole("must be 1 or 2", 1, 2, "It is the wheel whose angle the error is.")))


@dataclass(frozen=True, kw_only=True)
class OrdersFile(ErrorFile):
    """A file with amplitudes and phases of harmonics."""

    key: ClassVar[str] = "orders"

    orders: str


@dataclass(frozen=True, kw_only=True)
class ErrorTable(ErrorFile):
    """A file with an error over one or more mesh periods."""

    table: str


def _checksum(path: str) -> str:
    """SHA-256 of the content of a file; empty if it cannot be read."""
    try:
        return hashlib.sha256(read_bytes(Path(path), MOST_BYTES)).hexdigest()
    except (OSError, ValueError):  # ValueError for a name with a null character
        return ""


SOLID = "solid"  # the blank of a wheel that is a solid disc


def module_of(diametral_pitch: Any) -> units.Measured:
    """The module in m of a diametral pitch, in 1/in if it is a plain number; messages show it in inches."""
    number = units.to_si("diametral_pitch", diametral_pitch, units.DIAMETRAL_PITCH, POSITIVE)
    return units.Measured(INCH / number, "in", INCH)


def tooth_count(field: str, value: Any) -> int:
    if isinstance(value, int) and not isinstance(value, bool) and value < 0:
        raise InputError(field, "must be greater than 0", value, "For a pinion in a ring write positive numbers, that "
                         "of the ring second, and internal = true. Profile shifts keep the signs of ISO 21771.")
    return units.teeth(field, value)


def _tip_alterations(field: str, value: Any) -> tuple[float, float] | str:
    """k m_n of both wheels in m, or `KEEP_CLEARANCE`."""
    return value if isinstance(value, str) and value == KEEP_CLEARANCE else two(one(units.LENGTH))(field, value)


tip_alterations = Reader(_tip_alterations, units.LENGTH, both=True)


def read_blank(field: str, value: Any) -> Blank | str:
    """Rim and web of one wheel in m, or `SOLID`."""
    if value == SOLID or isinstance(value, Blank):
        return value
    if not isinstance(value, Mapping) or set(value) != {"rim", "web"}:
        raise InputError(field, f"must be {SOLID!r}, or a table with rim and web", value,
                         f"Each wheel may have its own: ['{SOLID}', {{ rim = '70 mm', web = '90 mm' }}].")
    return Blank(*(one(units.LENGTH, POSITIVE)(f"{field}.{name}", value[name]) for name in ("rim", "web")))


def _tip_relief(field: str, value: Any) -> ReliefDimensions:
    """Tip relief from its amounts alone, or from a table."""
    if isinstance(value, (ReliefDimensions, Mapping)):
        return record(ReliefDimensions)(field, value)
    return ReliefDimensions(amount=two(one(units.LENGTH, NOT_NEGATIVE))(field, value))


read_tip_relief = Reader(_tip_relief, parts=readers(ReliefDimensions))


def read_quality(field: str, value: Any) -> Quality:
    """Accuracy grade from a `Quality` or a table; its own errors begin with ``quality.``."""
    if isinstance(value, Quality):
        return value
    known = {f.name for f in fields(Quality)}
    if not isinstance(value, Mapping) or not {"standard", "grade"} <= set(value) <= known:
        raise InputError(field, "must be a table with standard and grade, and deviations if they are known", value,
                         "E.g. { standard = 'ISO 1328-1:1995', grade = 5 }.")
    return Quality(**value)


@dataclass(frozen=True, kw_only=True)
class DrawnPitch(Record):
    """Pitch deviations drawn at random within the accuracy grade, the same ones for the same seed."""

    seed: int = field(metadata=read_by(whole("must be a whole number from 0 on", 0)))


def read_pitch_errors(field: str, value: Any) -> Any:
    """Cumulative pitch deviations of both wheels in m: of each from a file, a list, or none; or `DrawnPitch`."""
    if isinstance(value, (DrawnPitch, Mapping)):
        return record(DrawnPitch)(field, value)
    return two(_pitch_of_wheel, "must be a list of two, or a table with seed")(field, value)


def _pitch_of_wheel(field: str, value: Any) -> tuple[float, ...]:
    if isinstance(value, str) and value:
        return pitch_from_table(value, field)
    return each(units.LENGTH)(field, () if value is None or isinstance(value, str) else value)


class Choice:
    """One of some names, or a table that names a file by the key of its kind."""

    def __init__(self, names: tuple[str, ...], *files: type[DataFile]) -> None:
        self.names, self.files = names, {kind.key: kind for kind in files}
        self.tables = " or ".join(f"{{ {key} = '…' }}" for key in self.files)

    def __call__(self, field: str, value: Any) -> Any:
        if isinstance(value, tuple(self.files.values())):
            return value
        if isinstance(value, Mapping):
            key, *others = [key for key in self.files if key in value] or [""]
            if not key or others:
                raise InputError(field, f"must be {' or '.join([*self.names, self.tables])}", dict(value))
            if not isinstance(value[key], str) or not value[key]:
                raise InputError(f"{field}.{key}", "must be the path of a file", value[key])
            return record_values(self.files[key], field, value)
        if not isinstance(value, str) or value not in self.names:
            error = unknown_name(field, str(value), self.names)
            raise InputError(field, error.rule, value, f"{error.advice} Or name a file: {self.tables}.".lstrip())
        return value


def method_in_words(given: str | DataFile) -> str:
    """By which method something is computed, or from which file."""
    if isinstance(given, str):
        return given if given.startswith("from") else f"by {given}"
    return f"from {Path(given.path).name}"
