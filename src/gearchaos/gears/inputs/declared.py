"""Inputs as the fields of a frozen dataclass declare them: units, rules, one value or two, and tables of values.

A field says how its value is read: ``module: Any = field(metadata=read_by(one(units.LENGTH, POSITIVE)))``. The class
calls `convert_fields` in its ``__post_init__``, and checks what a field alone cannot say.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, fields
from typing import Any, TypeVar

from gearchaos.errors import InputError, unknown_name
from gearchaos.gears import units
from gearchaos.quantities import Rule
from gearchaos.validation import check_rule, to_float

T = TypeVar("T")

PRESSURE = units.Dimension("a modulus of elasticity", "Pa", "206 GPa")
DENSITY = units.Dimension("a density", "kg/m^3", "7830 kg/m^3")

_OTHER_UNITS: dict[units.Dimension, tuple[tuple[str, float], ...]] = {
    units.LENGTH: (("mm", 1e-3), ("um", 1e-6)),
    units.ANGLE: (("deg", math.pi / 180),),
    units.STIFFNESS: (("N/um", 1e6),),
    PRESSURE: (("GPa", 1e9), ("MPa", 1e6)),
    DENSITY: (("g/cm^3", 1e3),),
}
"""Units in which a number may have been meant, and their values in SI."""

Convert = Callable[[str, Any], Any]
"""Takes the name of an input and the value given, and returns the value as it is kept."""


def read_by(convert: Convert, advice: str = "") -> dict[str, Any]:
    """The metadata of a field: how its value is read, and the advice for a result that needs it and lacks it."""
    return {"convert": convert, "advice": advice}


def convert_fields(record: Any) -> None:
    """Read all declared fields of a frozen dataclass that is being created.

    None stays None in a field whose default it is.
    """
    for f in fields(record):
        value = getattr(record, f.name)
        if "convert" in f.metadata and (value is not None or f.default is not None):
            object.__setattr__(record, f.name, f.metadata["convert"](f.name, value))


def one(dimension: units.Dimension, rule: Rule | None = None, between: tuple[float, float] | None = None) -> Convert:
    """A value with a unit, in SI; between two bounds beyond which only a slip of units explains it."""

    def convert(field: str, value: Any) -> float:
        number = units.to_si(field, value, dimension, rule)
        if between is not None:
            check_plausible(field, number, *between, dimension)
        return number

    return convert


def number(rule: Rule | None = None) -> Convert:
    """A pure number."""

    def convert(field: str, value: Any) -> float:
        found = to_float(field, value)
        if rule is not None:
            check_rule(field, found, rule)
        return found

    return convert


def each(dimension: units.Dimension) -> Convert:
    """A list of values with a unit, one per harmonic or level, in SI."""

    def convert(field: str, values: Any) -> tuple[float, ...]:
        if isinstance(values, (str, bytes)) or not isinstance(values, Iterable):
            advice = f"Write e.g. ['{dimension.example}']."
            raise InputError(field, "must be a list, one value per harmonic", values, advice)
        return tuple(units.to_si(f"{field}[{i}]", v, dimension) for i, v in enumerate(values))

    return convert


def two(convert: Convert) -> Convert:
    """The values of both wheels, from a list of two or from one that holds for both.

    An item of a list, tuple or array is ``field[0]`` or ``field[1]`` in messages.
    """

    def convert_both(field: str, value: Any) -> tuple[Any, Any]:
        try:
            items = None if isinstance(value, (str, bytes, Mapping)) else list(value)
        except TypeError:  # one number, or a quantity of one value
            items = None
        if items is None:
            both = convert(field, value)
            return both, both
        if len(items) != 2:
            raise InputError(field, "must be one value, or a list of two: for wheel 1 and for wheel 2", value)
        return convert(f"{field}[0]", items[0]), convert(f"{field}[1]", items[1])

    return convert_both


def two_of(convert: Convert, rule: str) -> Convert:
    """The values of both wheels, from a list of two only; a message begins with the rule."""

    def convert_both(field: str, value: Any) -> tuple[Any, Any]:
        if isinstance(value, (str, bytes)) or not hasattr(value, "__len__"):
            raise InputError(field, rule, value)
        return two(convert)(field, value)

    return convert_both


def name_of(known: tuple[str, ...]) -> Convert:
    """One of some names."""

    def convert(field: str, value: Any) -> str:
        if value not in known:
            raise unknown_name(field, str(value), known)
        return value

    return convert


def record_values(kind: Callable[..., T], field: str, value: Mapping[str, Any]) -> T:
    """A dataclass from a table of its fields; the field of an error is that of the value within the table.

    Raises `InputError` for an unknown key, a missing one, or a value that breaks a rule.
    """
    known = {f.name: f for f in fields(kind)}  # type: ignore[arg-type]
    for key in value:
        if key not in known:
            error = unknown_name(field, str(key), known)
            raise InputError(field, f"must have no key but {', '.join(known)}", str(key), error.advice)
    for name, each in known.items():
        if name not in value and each.default is MISSING:
            raise InputError(f"{field}.{name}", "must be given", None)
    try:
        return kind(**value)
    except InputError as error:
        raise InputError(f"{field}.{error.field}", error.rule, error.value, error.advice) from None


def check_plausible(
    field: str, number: float, least: float, most: float, dimension: units.Dimension, reason: str = ""
) -> None:
    """Raise `InputError`, with the question what was meant, unless a number lies within plausible bounds, in SI.

    ``reason`` says where the bounds come from, as a sentence.
    """
    if least <= number <= most:
        return
    shown = units.Length(number, number) if dimension is units.LENGTH else units.Shown(number, number)
    unit = shown.unit or dimension.unit
    meant = [unit for unit, size in _OTHER_UNITS.get(dimension, ()) if least <= number * size <= most
             and not isinstance(number, units.Measured)]
    question = f"Did you mean '{number:g} {meant[0]}'? A plain number is in {dimension.unit}. " if meant else ""
    raise InputError(field, f"must lie between {least / shown.size:.4g} and {most / shown.size:.4g} {unit}", shown,
                     f"{question}{reason}".rstrip())
