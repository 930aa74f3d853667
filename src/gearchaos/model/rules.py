"""What the numbers of a model must obey, by their names."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import Any

import numpy as np

from gearchaos.errors import InputError

MAX_HARMONICS = 64

LARGEST = 1e12
"""No number may be larger, of either sign, so that products of several stay far from where floats end."""

SMALLEST = 1e-30
"""No parameter that others are divided by may be smaller, but for 0."""

# name -> (test on a float array, rule in words, what to do)
_Rule = tuple[Callable[[Any], Any], str, str]
_POSITIVE: _Rule = (lambda v: v > 0, "must be greater than 0", "")
_NOT_NEGATIVE: _Rule = (lambda v: v >= 0, "must not be negative", "Damping takes energy out; use 0 for none.")
_RULES: dict[str, _Rule] = {
    "omega": (lambda v: v > 0, "must be greater than 0", "It is the mesh frequency over sqrt(c0/m), (2.8)."),
    "zeta": _NOT_NEGATIVE,
    "J1": _POSITIVE,
    "J2": _POSITIVE,
    "beta1": _NOT_NEGATIVE,
    "beta2": _NOT_NEGATIVE,
    "mu1": _POSITIVE,
    "mu2": _POSITIVE,
    "kappa1": (lambda v: v > 0, "must be greater than 0", "For a rigid support use kind='torsional'."),
    "kappa2": (lambda v: v > 0, "must be greater than 0", "For a rigid support use kind='torsional'."),
    "zeta_support1": _NOT_NEGATIVE,
    "zeta_support2": _NOT_NEGATIVE,
    "chi1": (lambda v: v > -1, "must be greater than -1", "The mesh stiffness 1 + chi1 must stay positive."),
    "chi2": (lambda v: v < 1, "must be less than 1", "The mesh stiffness 1 - chi2 must stay positive."),
    "contact_ratio": (
        lambda v: (v >= 1) & (v <= 2),
        "must lie in [1, 2]",
        "One or two tooth pairs share the load, (2.16).",
    ),
}
_DIVISORS = ("omega", *(f"{name}{n}" for name in ("J", "beta", "mu", "kappa") for n in (1, 2)))
_TOO_LARGE = f"must be at most {LARGEST:g}, of either sign"
_ADVICE = "All values are dimensionless, (2.11): mind the units that they were made of."


def check(name: str, value: Any) -> None:
    """Raise `InputError` unless every element of ``value`` is a finite number that obeys the rules of ``name``."""
    one = isinstance(value, float)  # most are, and numpy takes a hundred times as long for one
    numbers = value if one else np.asarray(value, dtype=float)
    refuse_first(name, numbers, math.isfinite(value) if one else np.isfinite(numbers), "must be a finite number")
    if name in _RULES:
        test, rule, advice = _RULES[name]
        refuse_first(name, numbers, test(numbers), rule, advice)
    refuse_first(name, numbers, abs(numbers) <= LARGEST, _TOO_LARGE, _ADVICE)
    if name in _DIVISORS:
        enough = (numbers >= SMALLEST) | (numbers == 0)
        refuse_first(name, numbers, enough, f"must be at least {SMALLEST:g}, if it is not 0", _ADVICE)


def refuse_first(name: str, numbers: Any, good: Any, rule: str, advice: str = "") -> None:
    """Raise `InputError` with the first of the numbers that is not good, if there is one."""
    if good is not True and not np.all(good):
        raise InputError(name, rule, float(np.asarray(numbers)[~np.asarray(good)].flat[0]), advice)


def number_of(name: str, value: Any) -> float:
    """A value from outside as a float that obeys the rules of its name."""
    if isinstance(value, (str, bytes, bool)) or value is None:
        raise InputError(name, "must be a number", value)
    try:
        number = float(value)
    except (TypeError, ValueError):
        raise InputError(name, "must be a number", value) from None
    except OverflowError:  # of a whole number with hundreds of digits
        raise InputError(name, _TOO_LARGE, value, _ADVICE) from None
    check(name, number)
    return number


def numbers_of(name: str, values: Iterable[Any]) -> tuple[float, ...]:
    """The amplitudes or phases of a series, as floats."""
    if isinstance(values, (str, bytes)) or not isinstance(values, Iterable):
        raise InputError(name, "must be a list of numbers", values)
    numbers = tuple(number_of(name, v) for v in values)
    if len(numbers) > MAX_HARMONICS:
        raise InputError(name, f"must have at most {MAX_HARMONICS} harmonics", len(numbers))
    return numbers
