"""Conversion of values with units, such as "3 mm", to floats in SI, and of speeds to rpm.

Only this module uses pint; all other code computes with floats.
"""

from __future__ import annotations

import math
import operator
import re
from dataclasses import dataclass, replace
from functools import cache
from numbers import Complex, Real
from typing import Any, Self

from gearchaos.errors import InputError
from gearchaos.quantities import Rule
from gearchaos.validation import FINITE, check_rule

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[-+]?(?:nan|inf)"
_NUMBER_AND_UNIT = re.compile(rf"\s*({_NUMBER})\s*([^\d\s].*|1\s*/.*|)")
_FRACTION = re.compile(r"\s*([-+]?)(?:(\d+)(?:\s+|\s*-\s*))?(\d+)\s*/\s*([1-9]\d*)(?!\d)\s*(.*)")
# an angle in degrees, arc minutes and arc seconds
_SEXAGESIMAL = re.compile(
    r"\s*([-+]?)(\d+)\s*(?:°|deg)\s*(\d+\.?\d*)\s*(?:['′]|arcmin)(?:\s*([\d.]+)\s*(?:[\"″]|arcsec))?\s*")
_DECIMAL_COMMA = re.compile(r"\s*([-+]?[\d.]*),(\d+)(.*)")
_POWER = re.compile(r"(?<=[^\W\d⁰¹²³⁴-⁹])\s*(?:\*\*|\^)\s*(?:[-+]?\d{1,2}|\([-+]?\d{1,2}\))(?![\w.])")
# a power of at most two digits of a unit, and what is left of others: pint computes 9**9**9, whatever it takes
_OTHER_POWER = re.compile(r"\*\*|\^|[⁰¹²³⁴-⁹]{3}")
_MOST_UNIT = 60  # most characters of a unit
_GRAD = re.compile(r"\bgrad", re.IGNORECASE)
_ANGLE = re.compile("radian|revolution|turn|degree|grade|arc")


@dataclass(frozen=True)
class Dimension:
    """A physical dimension: its name with article, the unit of a plain number in pint's notation, an example, and the
    units of drawings, the usual one first; without them that of the example is."""

    name: str
    unit: str  # that of the SI, but of speeds rpm
    example: str
    drawn: tuple[str, ...] = ()


LENGTH = Dimension("a length", "m", "35.2 mm", ("mm", "um", "in"))
MASS = Dimension("a mass", "kg", "700 g")
INERTIA = Dimension("a moment of inertia", "kg*m^2", "4.9e-4 kg*m^2")
STIFFNESS = Dimension("a stiffness", "N/m", "400 N/um")
DAMPING = Dimension("a damping coefficient", "N*s/m", "530 N*s/m")
TORQUE = Dimension("a torque", "N*m", "85 N*m", ("N*m", "lbf*in", "lbf*ft"))
BEARING_FRICTION = Dimension("a rotational damping coefficient", "N*m*s/rad", "1e-4 N*m*s/rad")
TORSIONAL_STIFFNESS = Dimension("a torsional stiffness", "N*m/rad", "2e4 N*m/rad")
ANGULAR_ACCELERATION = Dimension("an angular acceleration", "rad/s^2", "300 rad/s^2")
FORCE = Dimension("a force", "N", "250 N")
VELOCITY = Dimension("a velocity", "m/s", "5 mm/s")
ACCELERATION = Dimension("an acceleration", "m/s^2", "20 m/s^2")
ANGULAR_VELOCITY = Dimension("an angular velocity", "rad/s", "0.5 rad/s")  # of a vibration
SPEED = Dimension("an angular velocity", "rpm", "2500 rpm", ("rpm", "rad/s"))
ANGLE = Dimension("an angle", "rad", "30 deg", ("deg", "rad"))
DURATION = Dimension("a time", "s", "60 s")
FREQUENCY = Dimension("a frequency", "Hz", "25 Hz")
PRESSURE = Dimension("a modulus of elasticity", "Pa", "206 GPa")
STRESS = Dimension("a stress", "N/mm^2", "800 N/mm^2")
DENSITY = Dimension("a density", "kg/m^3", "7830 kg/m^3")
DIAMETRAL_PITCH = Dimension("a diametral pitch", "1/in", "8 1/in")
# powers of units of angles that a value of a dimension may have; 0 alone for the others
_ANGLE_POWERS: dict[Dimension, tuple[int, ...]] = {ANGLE: (1,), SPEED: (1,), BEARING_FRICTION: (0, -1),
    TORSIONAL_STIFFNESS: (0, -1), ANGULAR_ACCELERATION: (0, 1), ANGULAR_VELOCITY: (0, 1)}


class Measured(float):
    """A number in SI with the unit in which it was written, for messages about it, and one such unit in SI."""

    unit: str
    size: float

    def __new__(cls, number: float, unit: str = "", size: float = 1.0) -> Self:
        new = super().__new__(cls, number)
        new.unit, new.size = unit, size
        return new

    def __abs__(self) -> Measured:
        return Measured(super().__abs__(), self.unit, self.size)


class Shown(float):
    """A number in SI as messages show it: in the unit in which ``like`` was written, or else in that of the class."""

    unit, size = "", 1.0

    def __new__(cls, number: float, like: float | None = None) -> Self:
        new = super().__new__(cls, number)
        if isinstance(like, Measured):
            new.unit, new.size = like.unit, like.size
        return new

    def __repr__(self) -> str:
        return f"{self / self.size:.9g} {self.unit}".rstrip()

    __str__ = __repr__


class Length(Shown):
    """A length in m that error messages show in mm, the unit of drawings, unless it was written in another one."""

    unit, size = "mm", 1e-3


_DOT = r"[-.·⋅*]?"
# units as they are usually written, without spaces, that pint does not know or takes for others: for each dimension
# patterns of the whole unit and what they mean in the notation of pint. A speed in 1/min is in revolutions per minute,
# a pound of a torque is a pound-force.
_SPELLINGS: dict[Dimension, dict[str, str]] = {
    SPEED: {r"1?/min|min(\^|\*\*)?-1|min⁻¹|(rev|r|U)/min|RPM": "rpm", r"(rev|r|U)/s": "turn/s"},
    TORQUE: {rf"(kgf|(?:[kMm]|da)?N){_DOT}(m|mm|cm)": r"\1*\2", rf"ozf?{_DOT}in|in{_DOT}ozf?": "ozf*in",
             rf"(?:lbf?|lbs){_DOT}(in|ft)|(in|ft){_DOT}(?:lbf?|lbs)": r"lbf*\1\2"},
    BEARING_FRICTION: {r"([kM]?N)m\*?s(/rad)?": r"\1*m*s"},
    INERTIA: {r"(k?g)(m|mm|cm)(\^2|\*\*2|²)": r"\1*\2**2"}, STIFFNESS: {r"lbs?/in": "lbf/in"},
    ACCELERATION: {"g": "standard_gravity", r"(mm|m)/s2": r"\1/s^2"},
    LENGTH: {r"[\"″]|''|in\.": "in", r"mils?": "thou"}, DIAMETRAL_PITCH: {r"(DP|P)?": "1/in"}}
# the units of angles in texts and tables in the notation of pint, which would take "Grad" for a gigaradian and "grad"
# for a gon: both are refused, since German programs mean degrees
ANGLES = {
    **{name: name for name in ("rad", "radian", "radians", "mrad", "urad", "µrad", "μrad", "deg", "degree", "degrees",
                               "mdeg", "°", "gon", "turn", "turns", "revolution", "revolutions", "arcmin", "arcsec")},
    "º": "deg", "rev": "turn", "'": "arcmin", "′": "arcmin", '"': "arcsec", "″": "arcsec", "''": "arcsec",
}
RPM = 0.10471975511965977  # one revolution per minute in rad/s, rounded as by pint
# limits of the magnitude of a value in SI other than 0, so that products and quotients of several values neither
# overflow nor underflow
LARGEST, SMALLEST = 1e40, 1e-40
LEAST_TEETH, MOST_TEETH = 3, 1_000_000


def to_si(field: str, value: Any, dimension: Dimension, rule: Rule | None = None) -> float:
    """The value of a field in SI, a speed in rpm, from a number in the unit of the dimension, a text or a quantity of
    pint.

    Raises `InputError` for a wrong dimension, an unknown unit, a text without unit, a value that is not finite or whose
    magnitude is beyond the limits, or one that breaks the rule, which is for the number in SI.
    """
    magnitude = Rule(
        lambda v: v == 0 or SMALLEST <= abs(v) <= LARGEST, f"must lie between {SMALLEST:g} and {LARGEST:g} "
        f"{dimension.unit} in size, if it is not 0", f"It is {dimension.name}, e.g. '{dimension.example}'.")
    real = hasattr(value, "__float__") and (isinstance(value, Real) or not isinstance(value, Complex))
    if isinstance(value, Measured):
        number: float = value
    elif _has_unit(value):
        number = _converted(field, value, dimension)
    elif not real or isinstance(value, (bool, bytes)) or getattr(value, "ndim", None):  # also an array of one element
        raise _not_convertible(field, value, dimension)
    else:
        try:
            number = float(value)
        except OverflowError:  # an integer of hundreds of digits
            raise InputError(field, magnitude.text, value, magnitude.advice) from None
        except (TypeError, ValueError):
            raise _not_convertible(field, value, dimension) from None
    own = () if rule is None else (replace(rule, advice=magnitude.advice),)
    for each in (FINITE, magnitude, *own):
        check_rule(field, number, each, value)
    return number


def _has_unit(value: Any) -> bool:
    return isinstance(value, str) or (hasattr(value, "to") and hasattr(value, "magnitude"))


@cache
def _registry() -> Any:
    """The unit registry of pint, created at the first use, since that takes long."""
    import pint

    return pint.UnitRegistry()


def _converted(field: str, value: Any, dimension: Dimension) -> Measured:
    import pint

    if isinstance(value, str) and (match := _DECIMAL_COMMA.fullmatch(value)):
        whole, decimals, rest = match.groups()
        readings = [f"'{whole.replace('.', '') or '0'}.{decimals}{rest}'"] if rest[:1] != "." else []
        if len(decimals) == 3 and "." not in whole:
            readings.append(f"'{whole}{decimals}{rest}'" + " if the comma separates thousands" * len(readings))
        raise InputError(field, "must have a decimal point, not a comma", value, f"Write {', or '.join(readings)}.")
    unit, own = "", dimension.unit
    try:
        number, unit = _split(value, dimension) if isinstance(value, str) else (value.magnitude, str(value.units))
        measured = _registry().Quantity(float(number), _unit(unit, dimension)) if isinstance(value, str) else value
        number, size = float(measured.to(own).magnitude), float((measured.units * 1.0).to(own).magnitude)
    except Exception as error:  # pint does not wrap what its tokenizer and arithmetic raise
        known = isinstance(error, (pint.DimensionalityError, KeyError))
        found = f"is {f'no unit of {dimension.name}' if known else 'not known'}. {grad_advice(unit)}"
        reason = f"The unit '{unit}' {found}" if unit else "It is not a number followed by a unit. "
        raise _not_convertible(field, value, dimension, reason) from None
    if dimension is ANGLE and not _ANGLE.search(str(measured.units)):  # a number or a percentage
        raise _not_convertible(field, value, dimension, "It has no unit of an angle. ")
    if dimension is SPEED and not _ANGLE.search(str(measured.units)):
        # pint treats the radian as the number 1 and would convert 40 Hz to 40 rad/s
        raise _not_convertible(field, value, dimension, "Hertz and 1/s leave open whether turns or radians are meant, "
                               "of the shaft or of the mesh: write rpm, or in [operation] beside [design] "
                               "shaft_frequency or mesh_frequency. ")
    # pint treats units of angles as numbers; radians count here for angles, angular velocities and frequencies only,
    # elsewhere they are the number 1, as in "N*m/rad"
    angles = sum(power for name, power in measured.unit_items() if _ANGLE.search(name) and (
        dimension in (ANGLE, SPEED, FREQUENCY) or name != "radian"))
    if angles not in _ANGLE_POWERS.get(dimension, (0,)):
        speed = "A speed, in rpm or rad/s, is `speed`. " if dimension is FREQUENCY else ""
        raise _not_convertible(field, value, dimension, f"It has units of angles that do not belong to it. {speed}")
    return Measured(number, unit, size)


def _split(text: str, dimension: Dimension) -> tuple[float, str]:
    """The number and the unit of a text such as "3 mm" or "3 1/2 in"; raises ValueError if it is none."""
    if dimension is ANGLE and (match := _SEXAGESIMAL.fullmatch(text)):
        sign, degrees, minutes, seconds = match.groups()
        return float(f"{sign}1") * (int(degrees) + float(minutes) / 60 + float(seconds or 0) / 3600), "deg"
    if match := _FRACTION.fullmatch(text):
        sign, whole, above, below, unit = match.groups()
        return float(f"{sign}1") * (int(whole or 0) + int(above) / int(below)), unit
    if not (match := _NUMBER_AND_UNIT.fullmatch(text)):
        raise ValueError(text)
    return float(match[1]), match[2].rstrip()


def _unit(text: str, dimension: Dimension) -> str:
    """A unit in the notation of pint; raises ValueError for one that may not be read, KeyError for one of no angle."""
    if _GRAD.search(text) or len(text) > _MOST_UNIT or _OTHER_POWER.search(_POWER.sub("", text)):
        raise ValueError(text)
    compact = re.sub(r"\s", "", text)
    if dimension is ANGLE:
        return ANGLES[compact]
    for pattern, meaning in _SPELLINGS.get(dimension, {}).items():
        if match := re.fullmatch(pattern, compact):
            return match.expand(meaning)
    return f"1{text}" if text.startswith("/") else text


def grad_advice(unit: str) -> str:
    """What to write instead of a unit "grad" or "Grad"; empty for any other."""
    return "Write deg or gon: the unit may be either. " if _GRAD.search(unit) else ""


def _not_convertible(field: str, value: object, dimension: Dimension, reason: str = "") -> InputError:
    shown = value if isinstance(value, (str, bytes, bool)) or not _has_unit(value) else str(value)
    advice = f"{reason}Write e.g. '{dimension.example}', or a plain number in {dimension.unit}."
    return InputError(field, f"must be {dimension.name}", shown, advice)


def teeth(name: str, value: Any) -> int:
    """The number of teeth of a wheel as an int; raises `InputError` unless it is an integer within the limits."""
    try:
        count = None if isinstance(value, bool) else operator.index(value)
    except TypeError:
        count = None
    if count is None or count < LEAST_TEETH:
        raise InputError(name, f"must be a whole number of teeth, at least {LEAST_TEETH}", value)
    if count > MOST_TEETH:
        raise InputError(name, f"must be at most {MOST_TEETH:,} teeth", value)
    return count


def measured(value: float, digits: int = 4) -> str:
    """A physical value as text, with no more digits than drawings and tolerances support; "none" for NaN."""
    if math.isnan(value):
        return "none"
    rounded = float(f"{value:.{digits}g}")
    return f"{rounded:.0f}" if 10**digits <= abs(rounded) < 1e7 else f"{rounded:.{digits}g}"
