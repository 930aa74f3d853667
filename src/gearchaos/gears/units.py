"""Quantities with units, at the boundary only: a string such as "3 mm" becomes a float in SI."""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from numbers import Complex, Real
from typing import Any

from gearchaos.errors import InputError

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?|[-+]?(?:nan|inf)"
_NUMBER_AND_UNIT = re.compile(rf"\s*({_NUMBER})\s*([^\d\s].*|)")
_ANGLE = re.compile("radian|revolution|turn|degree|grade|arc")


@dataclass(frozen=True)
class Quantity:
    """A physical dimension: how it is called, its SI unit, and a value as one writes it."""

    name: str
    unit: str
    example: str


LENGTH = Quantity("a length", "m", "35.2 mm")
MASS = Quantity("a mass", "kg", "700 g")
INERTIA = Quantity("a moment of inertia", "kg*m^2", "4.9e-4 kg*m^2")
STIFFNESS = Quantity("a stiffness", "N/m", "400 N/um")
DAMPING = Quantity("a damping coefficient", "N*s/m", "530 N*s/m")
TORQUE = Quantity("a torque", "N*m", "85 N*m")
BEARING_FRICTION = Quantity("a rotational damping coefficient", "N*m*s/rad", "1e-4 N*m*s/rad")
SPEED = Quantity("an angular velocity", "rad/s", "2500 rpm")
ANGLE = Quantity("an angle", "rad", "30 deg")

LARGEST, SMALLEST = 1e40, 1e-40
"""No quantity may be larger in SI, or smaller but for 0, so that products and ratios of several stay far from where
floats end."""

LEAST_TEETH, MOST_TEETH = 3, 1_000_000

POSITIVE = "must be greater than 0"
NOT_NEGATIVE = "must not be negative"
ANY = "may have either sign"


def to_si(field: str, value: Any, quantity: Quantity) -> float:
    """The value of a field in SI, a float.

    Parameters
    ----------
    field : str
        Name for the error message.
    value : float, str or pint quantity
        A plain number is in SI already; a string carries a unit.
    quantity : Quantity
        What the field is.

    Raises
    ------
    InputError
        For a wrong dimension, a unit that does not exist, no unit in a string, or a value that is not finite, or of
        no size that a gear pair could have.
    """
    number = _float(field, _converted(field, value, quantity) if _has_unit(value) else value, quantity)
    if not math.isfinite(number):
        raise InputError(field, "must be a finite number", value)
    if number and not SMALLEST <= abs(number) <= LARGEST:
        raise _out_of_range(field, value, quantity)
    return number


def _float(field: str, value: Any, quantity: Quantity) -> float:
    """One real number as a float."""
    if not _is_real(value):
        raise _wrong(field, value, quantity)
    try:
        return float(value)
    except OverflowError:  # of a whole number with hundreds of digits
        raise _out_of_range(field, value, quantity) from None
    except (TypeError, ValueError):
        raise _wrong(field, value, quantity) from None


def _is_real(value: Any) -> bool:
    """Whether it may be one real number: no array, even of one value, and nothing complex."""
    if isinstance(value, (bool, bytes)) or getattr(value, "ndim", None):
        return False
    return hasattr(value, "__float__") and (isinstance(value, Real) or not isinstance(value, Complex))


def _out_of_range(field: str, value: object, quantity: Quantity) -> InputError:
    rule = f"must lie between {SMALLEST:g} and {LARGEST:g} {quantity.unit} in size, if it is not 0"
    return InputError(field, rule, value, f"It is {quantity.name}, e.g. '{quantity.example}'.")


def _has_unit(value: Any) -> bool:
    return isinstance(value, str) or (hasattr(value, "to") and hasattr(value, "magnitude"))


@cache
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()


def _converted(field: str, value: Any, quantity: Quantity) -> float:
    try:
        measured = _parsed(value) if isinstance(value, str) else value
        number = float(measured.to(quantity.unit).magnitude)
    except Exception as error:  # pint lets through whatever its tokenizer and arithmetic raise
        raise _wrong(field, value, quantity, f"{str(error).rstrip('.')}. ") from None
    if quantity is SPEED and not _ANGLE.search(str(measured.units)):
        # pint takes the radian for 1, so 40 Hz would become 40 rad/s
        raise _wrong(field, value, quantity, "Hertz and 1/s leave open whether turns or radians are meant. ")
    return number


def _parsed(text: str) -> Any:
    match = _NUMBER_AND_UNIT.fullmatch(text)
    if not match:
        raise ValueError("It is not a number followed by a unit")
    return _registry().Quantity(float(match[1]), match[2])


def _wrong(field: str, value: object, quantity: Quantity, reason: str = "") -> InputError:
    shown = value if isinstance(value, (str, bytes, bool)) or not _has_unit(value) else str(value)
    advice = f"{reason}Write e.g. '{quantity.example}', or a plain number in {quantity.unit}."
    return InputError(field, f"must be {quantity.name}", shown, advice)


def measure(name: str, value: Any, quantity: Quantity, rule: str) -> float:
    """The value of a field in SI, if it obeys the rule."""
    number = to_si(name, value, quantity)
    if (rule == POSITIVE and number <= 0) or (rule == NOT_NEGATIVE and number < 0):
        raise InputError(name, rule, value, f"It is {quantity.name}, e.g. '{quantity.example}'.")
    return number


def measures(name: str, values: Any, quantity: Quantity) -> tuple[float, ...]:
    """The values of a list, one per harmonic, in SI."""
    if isinstance(values, (str, bytes)) or not isinstance(values, Iterable):
        advice = f"Write e.g. ['{quantity.example}']."
        raise InputError(name, "must be a list, one value per harmonic", values, advice)
    return tuple(to_si(f"{name}[{i}]", v, quantity) for i, v in enumerate(values))


def teeth(name: str, value: Any) -> int:
    """A number of teeth."""
    try:
        count = None if isinstance(value, bool) else operator.index(value)
    except TypeError:
        count = None
    if count is None or count < LEAST_TEETH:
        raise InputError(name, f"must be a whole number of teeth, at least {LEAST_TEETH}", value)
    if count > MOST_TEETH:
        raise InputError(name, f"must be at most {MOST_TEETH:,} teeth", value)
    return count
