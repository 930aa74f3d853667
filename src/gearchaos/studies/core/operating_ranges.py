"""Speeds and torques as they are given: an axis of either, a range of speeds, one torque or several."""

from __future__ import annotations

import numbers
import re
from collections.abc import Iterable, Sequence
from typing import Any

from gearchaos.errors import InputError
from gearchaos.gears.io.units import TORQUE, to_si
from gearchaos.studies.core.axis import Axis, as_axis, as_range, axis_example

FIRST_SPEEDS = 40
"""Number of speeds of a range without one, where others are added between them."""

_MOST_TORQUES = 1000
_NUMBER = r"[-+]?[.\d]+(?:[eE][-+]?\d+)?"


def operating_axis(name: str, given: Axis | str, field: str = "", count: int | None = None) -> Axis:
    """The axis of a speed or torque; a text may leave out the name.

    ``field`` is its name in error messages, ``count`` the number of values of a text without one, which must have one
    by default.
    """
    field, example = field or name, axis_example(name).partition("=")[2]
    form, advice = "start:stop:count", f"E.g. {example}."
    if count is not None:
        form, advice = f"start:stop or {form}", f"E.g. {example.rpartition(':')[0]} or {example}."
    if not isinstance(given, (str, Axis)):
        arguments, real = ", ".join(example.split(":")), isinstance(given, numbers.Real)
        value = f"{given:g}" if real else example.partition(":")[0]
        raise InputError(field, "must be an Axis or a text", given if real else f"a {type(given).__name__}",
                         f"E.g. '{example}' or Axis('{name}', {arguments}); one value alone is "
                         f"'{value}:{value}:1'.")
    named = given
    if isinstance(given, str) and "=" not in given:
        if given.count(":") != 2 and (count is None or given.count(":") != 1):
            raise InputError(field, f"must read {form}", given, advice)
        named = f"{name}={given}"
    try:
        axis = as_axis(named, field) if count is None else as_range(named, field, count)
    except InputError as error:
        raise InputError(field, error.rule, error.value, error.advice) from None
    if axis.name != name:
        raise InputError(field, f"must be an axis of {name}", axis.name, advice)
    return axis


def range_of_speeds(given: Axis | str, field: str = "speed") -> Axis:
    """A range of speeds between which others are added, a text without a number of them with `FIRST_SPEEDS`; raises
    `InputError` for a single speed."""
    axis = operating_axis("speed", given, field, FIRST_SPEEDS)
    if axis.count < 2:
        raise InputError(field, "must be a range of speeds", str(given), "E.g. 500:6000, or with a number of first "
                         "speeds 500:6000:120.")
    return axis


def torques_of(given: Any, field: str = "torque") -> tuple[float, ...]:
    """One torque or several in N m, each once and in the order given.

    Each is a number in N m, or a text: one torque, several with commas between them, or "start:stop:count". A plain
    number in a text has the unit of the last torque there, else N m.
    """
    each = given if isinstance(given, Iterable) and not isinstance(given, str) else [given]
    torques = tuple(torque for one in each for torque in _torques_in(one, field))
    for torque in torques:
        if torques.count(torque) > 1:
            raise InputError(field, "must be given once", torque)
    if not 0 < len(torques) <= _MOST_TORQUES:
        raise InputError(field, f"must be 1 to {_MOST_TORQUES} values", len(torques), "E.g. 50,100,200 in N m.")
    return torques


def _torques_in(given: Any, field: str) -> Sequence[float]:
    if not isinstance(given, str):
        return [to_si(field, given, TORQUE)]
    if ":" in given:
        return operating_axis("torque", given, field).values.tolist()
    parts = [part.strip() for part in given.split(",")]
    sizes = [float(n) for part in parts for n in re.findall(_NUMBER, part)[:1]]
    if sizes != sorted(set(sizes)):
        raise InputError(field, "must rise from one to the next", given,
                         "A comma stands between two torques; a decimal number has a point.")
    unit = re.sub(_NUMBER, "", parts[-1]).strip() if re.match(_NUMBER, parts[-1]) else ""
    return [to_si(field, f"{part} {unit or TORQUE.unit}" if re.fullmatch(_NUMBER, part) else part, TORQUE)
            for part in parts]
