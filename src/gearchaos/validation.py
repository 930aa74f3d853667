"""Values from outside checked against the rules of their names; a value that breaks one is an `InputError`."""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import lru_cache
from typing import Any

import numpy as np

from gearchaos.errors import InputError
from gearchaos.quantities import Quantity, Rule, find

MAX_HARMONICS = 64
"""Largest order of a harmonic."""

LARGEST = 1e12
"""Largest magnitude of a number of a model, so that products of several stay far from overflow."""

SMALLEST = 1e-30
"""Smallest magnitude, other than 0, of a parameter that the equations divide by."""

_ADVICE = "All values are dimensionless, (2.11): mind the units that they were made of."
FINITE = Rule(lambda v: abs(v) < math.inf, "must be a finite number")
_NOT_TOO_LARGE = Rule(lambda v: abs(v) <= LARGEST, f"must be at most {LARGEST:g}, of either sign", _ADVICE)
_NOT_TOO_SMALL = Rule(lambda v: (v >= SMALLEST) | (v == 0), f"must be at least {SMALLEST:g}, if it is not 0", _ADVICE)


def obey(field: str, values: Any, rule: Rule, given: Any = None) -> None:
    """Raise `InputError` unless every value obeys a rule.

    Parameters
    ----------
    field : str
        What the error message calls the value.
    values : float or array
        One number or many.
    rule : Rule
        What each must obey.
    given : object, optional
        The value as it came from outside, for the message; by default the first number that breaks the rule.
    """
    good = rule.holds(values)
    if good is True or np.all(good):  # for one float the first test alone decides, and is a hundred times as fast
        return
    if given is None:
        given = float(np.asarray(values)[~np.asarray(good)].flat[0])
    raise InputError(field, rule.words, given, rule.advice)


def check(name: str, value: Any) -> None:
    """Raise `InputError` unless every element of ``value`` is a finite number that obeys the rules of its name.

    Parameters
    ----------
    name : str
        A parameter, an initial value, or any other name, for which only the size is checked.
    value : float or array_like of float
        Any shape.
    """
    values = value if isinstance(value, float) else np.asarray(value, dtype=float)
    for rule in _rules(name):
        obey(name, values, rule)


@lru_cache(maxsize=1024)
def _rules(name: str) -> tuple[Rule, ...]:
    """The rules of a name in the order in which they are checked."""
    found = find(name) or Quantity(name)
    own = () if found.rule is None else (found.rule,)
    return (FINITE, *own, _NOT_TOO_LARGE, *((_NOT_TOO_SMALL,) if found.divisor else ()))


def number_of(name: str, value: Any) -> float:
    """A value from outside as a float that obeys the rules of its name, see `check`."""
    if isinstance(value, (str, bytes, bool)) or value is None:
        raise InputError(name, "must be a number", value)
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise InputError(name, "must be a number", value) from None
    except OverflowError:  # an integer of hundreds of digits
        raise InputError(name, _NOT_TOO_LARGE.words, value, _ADVICE) from None
    check(name, number)
    return number


def numbers_of(name: str, values: Iterable[Any]) -> tuple[float, ...]:
    """The amplitudes or phases of a Fourier series, one per harmonic, as floats."""
    if isinstance(values, (str, bytes)) or not isinstance(values, Iterable):
        raise InputError(name, "must be a list of numbers", values)
    numbers = tuple(number_of(name, v) for v in values)
    if len(numbers) > MAX_HARMONICS:
        raise InputError(name, f"must have at most {MAX_HARMONICS} harmonics", len(numbers))
    return numbers
