"""The parts of a gear design that are tables of several values, and the conversion of each input of a design."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from gearchaos.errors import InputError, unknown_name
from gearchaos.files import read_bytes
from gearchaos.gears import units
from gearchaos.gears.geometry.backlash import backlash_of
from gearchaos.gears.geometry.mating import KEEP_CLEARANCE
from gearchaos.gears.inputs.cells import MOST_BYTES
from gearchaos.gears.inputs.forms import record_values, two_lengths, two_values
from gearchaos.gears.inputs.plausibility import check_plausible
from gearchaos.gears.materials import materials
from gearchaos.gears.stiffness.iso6336 import Blank
from gearchaos.gears.stiffness.mesh_stiffness import methods
from gearchaos.gears.transmission_error.quality import Quality
from gearchaos.quantities import NOT_NEGATIVE, POSITIVE, Rule
from gearchaos.validation import check_rule, to_float

_BELOW_ONE = Rule(lambda v: (v > 0) & (v < 1), "must be greater than 0 and less than 1",
                  "It is the ratio of the damping to the critical one, not a percentage.")


@dataclass(frozen=True, kw_only=True)
class Rack:
    """Basic rack tooth profile, in normal modules; by default profile A of ISO 53:1998.

    Parameters
    ----------
    addendum, dedendum, root_radius : float, optional
        h_aP/m_n, h_fP/m_n and ρ_fP/m_n.
    """

    addendum: float = 1.0
    dedendum: float = 1.25
    root_radius: float = 0.38

    def __post_init__(self) -> None:
        for name, rule in (("addendum", POSITIVE), ("dedendum", POSITIVE), ("root_radius", NOT_NEGATIVE)):
            object.__setattr__(self, name, to_float(name, getattr(self, name)))
            check_rule(name, getattr(self, name), rule)


PROFILE_A = Rack()
"""Profile A of ISO 53:1998."""

INCH = 25.4e-3
"""One inch in m."""

PRESSURE_ANGLE = math.radians(20)
"""Normal pressure angle of ISO 53:1998, rad."""


@dataclass(frozen=True, kw_only=True)
class ReliefDimensions:
    """Tip relief of both wheels as a drawing gives it.

    Parameters
    ----------
    amount : length, one or two
        C_a of each wheel, the profile deviation at the tip circle: in the transverse plane along the line of action. 0
        for a wheel without relief.
    start_diameter : length, one or two, optional
        Diameters at which the relief begins. None, the default, if the drawing does not say; then only results that
        need no more than the amount can be computed.
    shape : {"linear", "parabolic"}, optional
        How the relief grows from its start to the tip; by default linear.
    """

    amount: Any
    start_diameter: Any = None
    shape: str = "linear"

    def __post_init__(self) -> None:
        object.__setattr__(self, "amount", two_lengths("amount", self.amount, NOT_NEGATIVE))
        if self.start_diameter is not None:
            starts = two_lengths("start_diameter", self.start_diameter, POSITIVE)
            object.__setattr__(self, "start_diameter", starts)
        if self.shape not in RELIEF_SHAPES:
            raise unknown_name("shape", str(self.shape), RELIEF_SHAPES)


RELIEF_SHAPES = ("linear", "parabolic")


@dataclass(frozen=True, kw_only=True)
class Supports:
    """Elastic supports of both wheels, along the line of action in the transverse plane.

    Parameters
    ----------
    stiffness : force/length, one or two
        Of each wheel's shaft and bearings together.
    damping_ratio : float, one or two
        Of the wheel's mass on its support.
    """

    stiffness: Any
    damping_ratio: Any

    def __post_init__(self) -> None:
        object.__setattr__(self, "stiffness", two_values("stiffness", self.stiffness, _support_stiffness))
        object.__setattr__(self, "damping_ratio", two_values("damping_ratio", self.damping_ratio, _support_damping))


@dataclass(frozen=True, kw_only=True)
class DataFile:
    """What all files of a design have.

    Parameters
    ----------
    sha256 : str, optional
        Checksum of its content; by default that of the file now. A file whose content has changed since is refused.
    columns : mapping of str to str, optional
        Headers in the file by the names of columns; kept as a tuple of pairs.
    """

    sha256: str = ""
    columns: Any = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "sha256", self.sha256 or _required_checksum(self._key, self.path))
        try:
            chosen = dict(self.columns)
        except (TypeError, ValueError):
            chosen = {"": None}
        if not all(isinstance(text, str) and text for pair in chosen.items() for text in pair):
            raise InputError("columns", "must be a table of headers in the file", self.columns,
                             "E.g. { angle = 'Angle of rotation', value = 'Stiffness curve' }.")
        object.__setattr__(self, "columns", tuple(chosen.items()))

    @property
    def _key(self) -> str:
        return "orders" if isinstance(self, OrdersFile) else "table"

    @property
    def path(self) -> str:
        """Path of the file."""
        return str(getattr(self, self._key))


@dataclass(frozen=True, kw_only=True)
class TableFile(DataFile):
    """A file with the stiffness over one or more mesh periods.

    Parameters
    ----------
    table : str
        Path of the file.
    speed : angular velocity, optional
        Of wheel 1, in rpm without a unit, at which the times of a table over time hold.
    """

    table: str
    speed: Any = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.speed is not None:
            object.__setattr__(self, "speed", _speed("speed", self.speed))


@dataclass(frozen=True, kw_only=True)
class ErrorFile(DataFile):
    """A file with a transmission error.

    Parameters
    ----------
    wheel : {1, 2}, optional
        The wheel whose angle the error is. None, the default, for a length along the line of action.
    """

    wheel: Any = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.wheel is not None and (type(self.wheel) is not int or self.wheel not in (1, 2)):
            raise InputError("wheel", "must be 1 or 2", self.wheel, "It is the wheel whose angle the error is.")


@dataclass(frozen=True, kw_only=True)
class OrdersFile(ErrorFile):
    """A file with amplitudes and phases of harmonics.

    Parameters
    ----------
    orders : str
        Path of the file.
    """

    orders: str


@dataclass(frozen=True, kw_only=True)
class ErrorTable(ErrorFile):
    """A file with an error over one or more mesh periods.

    Parameters
    ----------
    table : str
        Path of the file.
    """

    table: str


def checksum(path: str) -> str:
    """SHA-256 of the content of a file; empty if it cannot be read."""
    try:
        return hashlib.sha256(read_bytes(Path(path), MOST_BYTES)).hexdigest()
    except (OSError, ValueError):  # ValueError for a name with a null character
        return ""


def _required_checksum(field: str, path: str) -> str:
    """SHA-256 of the content of a file; raises `InputError` if it cannot be read."""
    if found := checksum(path):
        return found
    raise InputError(field, "must be a file that can be read", path,
                     "It does not exist, is no file, is too large or may not be read. Write the table first, or "
                     "correct the path.")


SOLID = "solid"
"""The blank of a wheel that is a solid disc."""

ERRORS = ("none", "from quality")


def _support_stiffness(field: str, value: Any) -> float:
    """The stiffness of a support in N/m."""
    number = units.to_si(field, value, units.STIFFNESS, POSITIVE)
    check_plausible(field, number, 1e4, 1e13, units.STIFFNESS)
    return number


def _support_damping(field: str, value: Any) -> float:
    """The damping ratio of a support, at least 0 and below 1."""
    number = to_float(field, value)
    check_rule(field, number, Rule(lambda v: (v >= 0) & (v < 1), "must be at least 0 and less than 1"))
    return number


def _length(field: str, value: Any) -> float:
    """A length greater than 0 in m."""
    return units.to_si(field, value, units.LENGTH, POSITIVE)


def module_of(diametral_pitch: Any) -> units.Measured:
    """The module in m of a diametral pitch, in 1/in if it is a plain number; messages show it in inches."""
    number = units.to_si("diametral_pitch", diametral_pitch, units.DIAMETRAL_PITCH, POSITIVE)
    return units.Measured(INCH / number, "in", INCH)


def _teeth(field: str, value: Any) -> tuple[int, int]:
    """Numbers of teeth of both wheels; a list of two is required."""
    if isinstance(value, (str, bytes)) or not hasattr(value, "__len__"):
        raise InputError(field, "must be a list of two numbers of teeth", value)
    return two_values(field, value, _count)


def _count(field: str, value: Any) -> int:
    """The number of teeth of one external wheel."""
    if isinstance(value, int) and not isinstance(value, bool) and value < 0:
        raise InputError(field, "must be greater than 0", value,
                         "Negative numbers of teeth denote internal gears, which are not computed.")
    return units.teeth(field, value)


def _angle(field: str, value: Any) -> float:
    """An angle in rad."""
    return units.to_si(field, value, units.ANGLE)


def _shift(field: str, value: Any) -> tuple[float, float]:
    """Profile shift coefficients of both wheels; a list of two is required."""
    if isinstance(value, (str, bytes)) or not hasattr(value, "__len__"):
        raise InputError(field, "must be a list of two: x1 and x2, in normal modules", value)
    return two_values(field, value, to_float)


def _tip_alteration(field: str, value: Any) -> tuple[float, float] | str:
    """k m_n of both wheels in m, or `KEEP_CLEARANCE`."""
    return value if isinstance(value, str) and value == KEEP_CLEARANCE else two_lengths(field, value)


def _bore(field: str, value: Any) -> tuple[float, float]:
    """Bore diameters in m; 0 for a wheel without bore."""
    return two_lengths(field, value, NOT_NEGATIVE)


def _blank(field: str, value: Any) -> Blank | str:
    """Rim and web of one wheel in m, or `SOLID`."""
    if value == SOLID or isinstance(value, Blank):
        return value
    if not isinstance(value, Mapping) or set(value) != {"rim", "web"}:
        raise InputError(field, f"must be {SOLID!r}, or a table with rim and web", value,
                         f"Each wheel may have its own: ['{SOLID}', {{ rim = '70 mm', web = '90 mm' }}].")
    return Blank(*(_length(f"{field}.{name}", value[name]) for name in ("rim", "web")))


def _inertia(field: str, value: Any) -> tuple[float, float]:
    """Moments of inertia in kg m²."""
    return two_values(field, value, lambda name, item: units.to_si(name, item, units.INERTIA, POSITIVE))


def _mass(field: str, value: Any) -> tuple[float, float]:
    """Masses in kg."""
    return two_values(field, value, lambda name, item: units.to_si(name, item, units.MASS, POSITIVE))


def _record(kind: type) -> Callable[[str, Any], Any]:
    """A converter for a dataclass or a table with its values."""

    def convert(field: str, value: Any) -> Any:
        if isinstance(value, kind):
            return value
        if not isinstance(value, Mapping):
            names = ", ".join(f.name for f in fields(kind))
            raise InputError(field, f"must be a table with {names}", value)
        return record_values(kind, field, value)

    return convert


def _tip_relief(field: str, value: Any) -> ReliefDimensions:
    """Tip relief from its amounts alone, or from a table."""
    if isinstance(value, (ReliefDimensions, Mapping)):
        return _record(ReliefDimensions)(field, value)
    return ReliefDimensions(amount=two_lengths(field, value, NOT_NEGATIVE))


def _quality(field: str, value: Any) -> Quality:
    """Accuracy grade from a `Quality` or a table; its own errors begin with ``quality.``."""
    if isinstance(value, Quality):
        return value
    if not isinstance(value, Mapping) or set(value) != {"standard", "grade"}:
        raise InputError(field, "must be a table with standard and grade", value,
                         "E.g. { standard = 'ISO 1328-1:1995', grade = 5 }.")
    return Quality(value["standard"], value["grade"])


def _choice(names: tuple[str, ...], **files: type) -> Callable[[str, Any], Any]:
    """A converter for one of some names, or a table that names a file by one key of ``files``."""

    def convert(field: str, value: Any) -> Any:
        if isinstance(value, tuple(files.values())):
            return value
        if isinstance(value, Mapping):
            key, *others = [key for key in files if key in value] or [""]
            if not key or others:
                raise InputError(field, f"must be a table with one of {', '.join(files)}", dict(value))
            if not isinstance(value[key], str) or not value[key]:
                raise InputError(f"{field}.{key}", "must be the path of a file", value[key])
            return record_values(files[key], field, value)
        if not isinstance(value, str) or value not in names:
            tables = " or ".join(f"{{ {key} = '…' }}" for key in files)
            error = unknown_name(field, str(value), names)
            raise InputError(field, error.rule, value, f"{error.advice} Or name a file: {tables}.".lstrip())
        return value

    return convert


def _damping_ratio(field: str, value: Any) -> float:
    """Damping ratio of the mesh."""
    number = to_float(field, value)
    check_rule(field, number, _BELOW_ONE)
    return number


def _factor(field: str, value: Any) -> float:
    """A factor greater than 0."""
    number = to_float(field, value)
    check_rule(field, number, POSITIVE)
    return number


def _speed(field: str, value: Any) -> float:
    """Speed of wheel 1 in rpm."""
    return units.to_si(field, value, units.SPEED, POSITIVE)


def _torque(field: str, value: Any) -> float:
    """Torque in N m; 0 for an idling pair."""
    return units.to_si(field, value, units.TORQUE, NOT_NEGATIVE)


CONVERTERS: dict[str, Callable[[str, Any], Any]] = {
    "teeth": _teeth,
    "module": _length,
    "face_width": lambda field, value: two_lengths(field, value, POSITIVE),
    "pressure_angle": _angle,
    "helix_angle": lambda field, value: abs(_angle(field, value)),
    "centre_distance": _length,
    "profile_shift": _shift,
    "rack": _record(Rack),
    "tip_alteration": _tip_alteration,
    "tip_diameter": lambda field, value: two_lengths(field, value, POSITIVE),
    "tip_relief": _tip_relief,
    "material": lambda field, value: materials(value),
    "bore": _bore,
    "blank": lambda field, value: two_values(field, value, _blank),
    "inertia": _inertia,
    "mass": _mass,
    "quality": _quality,
    "backlash": lambda field, value: backlash_of(value),
    "damping_ratio": _damping_ratio,
    "stiffness": _choice(tuple(methods()), table=TableFile),
    "transmission_error": _choice(ERRORS, orders=OrdersFile, table=ErrorTable),
    "eccentricity": lambda field, value: two_lengths(field, value, NOT_NEGATIVE),
    "supports": _record(Supports),
    "application_factor": _factor,
    "speed": _speed,
    "torque": _torque,
}
"""For each input of a design: a function of its name and the value given, which returns the value as it is kept."""
