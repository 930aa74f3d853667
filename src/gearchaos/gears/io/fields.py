"""What the fields of dataclasses declare: how an input is read, and how a computed quantity is shown.

An input: ``module: Any = field(metadata=read_by(one(units.LENGTH, POSITIVE)))``. The class is a `Record`, or calls
`convert_fields` in its ``__post_init__``, and checks what a field alone cannot say. A result: ``value: float =
described("K_v", …)``, with symbol, formula, source and unit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields, replace
from functools import partial
from typing import Any, TypeVar

from gearchaos.errors import InputError, gather, unknown_name
from gearchaos.gears.io import units
from gearchaos.quantities import Rule
from gearchaos.validation import check_rule, to_float

T = TypeVar("T")

# units in which a number may have been meant, and their values in SI
_OTHER_UNITS: dict[units.Dimension, tuple[tuple[str, float], ...]] = {
    units.LENGTH: (("mm", 1e-3), ("um", 1e-6)), units.PRESSURE: (("GPa", 1e9), ("MPa", 1e6)),
    units.ANGLE: (("deg", math.pi / 180),), units.STIFFNESS: (("N/um", 1e6),), units.DENSITY: (("g/cm^3", 1e3),)}

# takes the name of an input and the value given, and returns the value as it is kept
Convert = Callable[[str, Any], Any]


@dataclass(frozen=True)
class Reader:
    """How an input is read, and what a form needs to know to ask for it: its dimension, unless it is a plain number;
    the ``names`` that it can be; the readers of its ``parts`` if it is a table; whether it is that of ``both`` wheels.
    """

    convert: Convert
    dimension: units.Dimension | None = None
    names: tuple[str, ...] = ()
    parts: Mapping[str, Convert] = field(default_factory=dict)
    both: bool = False

    def __call__(self, field: str, value: Any) -> Any:
        return self.convert(field, value)


def read_by(convert: Convert, advice: str = "") -> dict[str, Any]:
    """The metadata of a field: how its value is read, and the advice for a result that needs it and lacks it."""
    return {"convert": convert, "advice": advice}


def readers(kind: Any) -> dict[str, Convert]:
    """How the fields of a dataclass are read, by name; not every field says so."""
    return {f.name: f.metadata["convert"] for f in fields(kind) if "convert" in f.metadata}


def convert_fields(record: Any) -> None:
    """Read all declared fields of a frozen dataclass that is being created; None stays None where it is the default."""
    def read(f: Field[Any]) -> None:
        value = getattr(record, f.name)
        if "convert" in f.metadata and (value is not None or f.default is not None):
            object.__setattr__(record, f.name, f.metadata["convert"](f.name, value))

    gather(partial(read, f) for f in fields(record))


class Record:
    """The base of frozen dataclasses that are nothing but inputs."""

    def __post_init__(self) -> None:
        convert_fields(self)


def one(dimension: units.Dimension, rule: Rule | None = None, between: tuple[float, float] | None = None) -> Reader:
    """A value with a unit, in SI; between two bounds beyond which only a slip of units explains it."""
    def convert(field: str, value: Any) -> float:
        number = units.to_si(field, value, dimension, rule)
        if between is not None:
            check_plausible(field, number, *between, dimension=dimension)
        return number
    return Reader(convert, dimension)


def number(rule: Rule | None = None) -> Reader:
    def convert(field: str, value: Any) -> float:
        found = to_float(field, value)
        if rule is not None:
            check_rule(field, found, rule)
        return found
    return Reader(convert)


def each(dimension: units.Dimension) -> Convert:
    """A list of values with a unit, one per harmonic or level, in SI."""
    def convert(field: str, values: Any) -> tuple[float, ...]:
        if isinstance(values, (str, bytes)) or not isinstance(values, Iterable):
            raise InputError(field, "must be a list, one value per harmonic", values,
                             f"Write e.g. ['{dimension.example}'].")
        return tuple(units.to_si(f"{field}[{i}]", v, dimension) for i, v in enumerate(values))
    return convert


def two(convert: Convert, rule: str = "") -> Reader:
    """The values of both wheels, from a list of two or from one that holds for both.

    An item of a list, tuple or array is ``field[0]`` or ``field[1]`` in messages. With a rule, with which a message
    begins, it must be a list.
    """
    def convert_both(field: str, value: Any) -> tuple[Any, Any]:
        if rule and (isinstance(value, (str, bytes)) or not hasattr(value, "__len__")):
            raise InputError(field, rule, value)
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
    each = convert if isinstance(convert, Reader) else Reader(convert)
    return replace(each, convert=convert_both, both=True)


def whole(rule: str, least: int, most: float = math.inf, advice: str = "") -> Convert:
    """A whole number within bounds; the rule says which."""
    def convert(field: str, value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not least <= value <= most:
            raise InputError(field, rule, value, advice)
        return value
    return convert


def having(attribute: str, rule: str, advice: str = "") -> Convert:
    """A value that has this attribute, kept as it is; the rule is that of anything else."""
    def convert(field: str, value: Any) -> Any:
        if not hasattr(value, attribute):
            raise InputError(field, rule, value, advice)
        return value
    return convert


def name_of(*known: str) -> Reader:
    def convert(field: str, value: Any) -> str:
        if value not in known:
            raise unknown_name(field, str(value), known)
        return value
    return Reader(convert, names=known)


def record(kind: type, rule: str = "", advice: str = "") -> Reader:
    """A dataclass, or a table with its values; the rule is that of anything else."""
    def convert(field: str, value: Any) -> Any:
        if isinstance(value, kind):
            return value
        if not isinstance(value, Mapping):
            names = ", ".join(f.name for f in fields(kind))
            raise InputError(field, rule or f"must be a table with {names}", value, advice)
        return record_values(kind, field, value)
    return Reader(convert, parts=readers(kind))


def record_values(kind: Callable[..., T], field: str, value: Mapping[str, Any]) -> T:
    """A dataclass from a table of its fields; the field of an error is that of the value within the table."""
    known = {f.name: f for f in fields(kind)}  # type: ignore[arg-type]
    for key in value:
        if key not in known:
            raise unknown_key(field, key, value[key], known, known)
    if missing := [name for name, each in known.items() if name not in value and each.default is MISSING]:
        raise InputError(f"{field}.{', '.join(missing)}", "must be given", None)
    try:
        return kind(**value)
    except InputError as error:
        raise InputError(f"{field}.{error.field}", error.rule, error.value, error.advice) from None


def unknown_key(table: str, key: Any, value: Any, names: Iterable[str], known: Mapping[str, Field[Any]]) -> InputError:
    """The error for a key that is none of the names of a table. It suggests a similar name; if its field is known, it
    must take the value."""
    def takes(name: str) -> bool:
        try:
            known[name].metadata["convert"](name, value)
        except KeyError:  # nothing is known of it
            return True
        except InputError:
            return False
        return True

    advice = unknown_name(table, str(key), filter(takes, names)).advice
    return InputError(table, f"must have no key but {', '.join(names)}", str(key), advice)


def check_plausible(field: str, number: float, least: float, most: float, reason: str = "",
                    dimension: units.Dimension = units.LENGTH) -> None:
    """Raise `InputError`, asking what was meant, unless a number lies within bounds in SI; the reason explains them."""
    if least <= number <= most:
        return
    shown = units.Length(number, number) if dimension is units.LENGTH else units.Shown(number, number)
    unit = shown.unit or dimension.unit
    meant = [unit for unit, size in _OTHER_UNITS.get(dimension, ()) if least <= number * size <= most
             and not isinstance(number, units.Measured)]
    question = f"Did you mean '{number:g} {meant[0]}'? A plain number is in {dimension.unit}. " if meant else ""
    raise InputError(field, f"must lie between {least / shown.size:.4g} and {most / shown.size:.4g} {unit}", shown,
                     f"{question}{reason}".rstrip())


def check_toothing(module: float, pressure_angle: float | None, helix_angle: float | None) -> None:
    """Raise `InputError` for a module in m, or angles in rad where they are given, that no gear has."""
    degree = math.pi / 180
    check_plausible("module", module, 1e-5, 0.1)
    for name, angle, least, most in (("pressure_angle", pressure_angle, 5, 45), ("helix_angle", helix_angle, 0, 60)):
        if angle is not None:
            check_plausible(name, abs(angle), least * degree, most * degree, dimension=units.ANGLE)


@dataclass(frozen=True)
class Formula:
    """How a quantity is shown, and where it comes from: its symbol in plain Unicode, and its formula in this unit."""

    symbol: str
    unit: str  # empty for a pure number
    factor: float  # on the value in SI
    text: str
    source: str  # standard with edition, and the clause or equation
    words: str = ""  # empty if its name reads as words


def described(symbol: str, text: str, source: str, unit: str = "", factor: float = 1.0, *, words: str = "") -> Any:
    return field(metadata={"formula": Formula(symbol, unit, factor, text, source, words)})


def formulas(result: Any) -> dict[str, Formula]:
    """The formulas of the fields of a result, a dataclass or an instance of one, by name; not every field has one."""
    return {f.name: f.metadata["formula"] for f in fields(result) if "formula" in f.metadata}
