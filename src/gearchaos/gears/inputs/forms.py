"""Common forms of the inputs of a design: one value or two, and tables of values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields
from typing import Any, TypeVar

from gearchaos.errors import InputError, unknown_name
from gearchaos.gears import units
from gearchaos.quantities import Rule

T = TypeVar("T")


def two_values(field: str, value: Any, convert: Callable[[str, Any], T]) -> tuple[T, T]:
    """The values of both wheels from a list of two, or from one that holds for both.

    Parameters
    ----------
    field : str
        Name of the value in error messages; an item of a list is ``field[0]`` or ``field[1]``.
    value : object
        A list, tuple or array of two values, or one value.
    convert : callable
        Takes the name and one value, and returns the value as it is kept.
    """
    items = _items(value)
    if items is None:
        both = convert(field, value)
        return both, both
    if len(items) != 2:
        raise InputError(field, "must be one value, or a list of two: for wheel 1 and for wheel 2", value)
    return convert(f"{field}[0]", items[0]), convert(f"{field}[1]", items[1])


def two_lengths(field: str, value: Any, rule: Rule | None = None) -> tuple[float, float]:
    """The lengths of both wheels in m, from one or two."""
    return two_values(field, value, lambda name, item: units.to_si(name, item, units.LENGTH, rule))


def _items(value: Any) -> list[Any] | None:
    """The items of a list, tuple or array; None for anything else, such as a text or a quantity of one value."""
    if isinstance(value, (str, bytes, Mapping)):
        return None
    try:
        return list(value)
    except TypeError:
        return None


def record_values(kind: Callable[..., T], field: str, value: Mapping[str, Any]) -> T:
    """A dataclass from a table of its fields; the field of an error is that of the value within the table.

    Raises
    ------
    InputError
        For an unknown key, a missing one, or a value that breaks a rule.
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
