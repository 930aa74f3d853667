"""Checks of user input: numbers that break a rule of their quantity raise `InputError`."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from functools import lru_cache
from typing import Any

import numpy as np

from gearchaos.errors import InputError
from gearchaos.quantities import Quantity, Rule, find

MAX_HARMONICS = 64  # largest order of a harmonic
LARGEST = 1e12  # largest magnitude of a parameter or initial value, so that products of several do not overflow
SMALLEST = 1e-30  # smallest magnitude, other than 0, of a parameter that the equations divide by
_ADVICE = "All values are dimensionless, (2.11): check the units they were computed from."
FINITE = Rule(lambda v: abs(v) < math.inf, "must be a finite number")
_NOT_TOO_LARGE = Rule(lambda v: abs(v) <= LARGEST, f"must be at most {LARGEST:g}, of either sign", _ADVICE)
_NOT_TOO_SMALL = Rule(lambda v: (v >= SMALLEST) | (v == 0), f"must be at least {SMALLEST:g}, if it is not 0", _ADVICE)


def check_rule(field: str, values: Any, rule: Rule, given: Any = None) -> None:
    """Raise `InputError` unless every value, a float or an array of any shape, satisfies a rule.

    ``given`` is the value as the user gave it, for the message; by default the first number that breaks the rule.
    """
    satisfied = rule.holds(values)
    if satisfied is True or np.all(satisfied):  # a float gives True, and np.all would take a hundred times as long
        return
    if given is None:
        given = float(np.asarray(values)[~np.asarray(satisfied)].flat[0])
    raise InputError(field, rule.text, given, rule.advice)


def check(name: str, value: Any) -> None:
    """Raise `InputError` unless every element of ``value``, of any shape, is a finite number and satisfies the rules of
    its quantity; for a name of none only finiteness and magnitude are checked.
    """
    values = value if isinstance(value, float) else np.asarray(value, dtype=float)
    for rule in _rules(name):
        check_rule(name, values, rule)


@lru_cache(maxsize=1024)
def _rules(name: str) -> tuple[Rule, ...]:
    """The rules of the quantity of this name, in the order in which they are checked."""
    found = find(name) or Quantity(name)
    own = () if found.rule is None else (found.rule,)
    return (FINITE, *own, _NOT_TOO_LARGE, *((_NOT_TOO_SMALL,) if found.divisor else ()))


def to_float(name: str, value: Any) -> float:
    """A value given by the user as a float, checked by the rules of its quantity, see `check`."""
    if isinstance(value, (str, bytes, bool)) or value is None:
        advice = ""
        if isinstance(value, str):
            with_unit = re.match(r"\s*[-+]?\.?\d[\d.eE+-]*\s*[^\W\d_]|.*°", value)
            advice = ("Write a decimal point, not a comma." if "," in value else
                      "Write it without a unit; an angle is in radians." if with_unit else "")
        raise InputError(name, "must be a number", value, advice)
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise InputError(name, "must be a number", value) from None
    except OverflowError:  # an integer of hundreds of digits
        raise InputError(name, _NOT_TOO_LARGE.text, value, _ADVICE) from None
    check(name, number)
    return number


def to_floats(
    name: str, values: Iterable[Any], most: int = MAX_HARMONICS, items: str = "harmonics"
) -> tuple[float, ...]:
    """A list of at most ``most`` numbers as floats, checked as in `to_float`; ``items`` are what a message counts."""
    if isinstance(values, (str, bytes)) or not isinstance(values, Iterable):
        raise InputError(name, "must be a list of numbers", values)
    numbers = tuple(to_float(name, v) for v in values)
    if len(numbers) > most:
        raise InputError(name, f"must have at most {most} {items}", len(numbers))
    return numbers
