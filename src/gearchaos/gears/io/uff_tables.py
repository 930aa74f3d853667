"""Files in the Universal File Format as tables: signals over the time, or spectra over the order at several speeds."""

from __future__ import annotations

import re
import warnings
from collections import Counter
from pathlib import Path
from typing import Any, Literal

import numpy as np

from gearchaos.errors import InputError, missing_package

_BEGIN = re.compile(rb"\s*-1[ \t]*\r?\n *\d+b?\b")
_SPEED = 19  # the type of data of a speed
_ABSCISSAE = {17: "time", 20: "order"}  # by type of data
_NAMES = {8: "displacement", 9: "force", 11: "velocity", 12: "acceleration", 13: "force", _SPEED: "speed"}
# what an amplitude is, by words in the texts of a spectrum
_AMPLITUDES = {"rms": r"\brms\b|\beff", "peak to peak": r"peak.to.peak|pk.?-?pk"}


def is_uff(content: bytes) -> bool:
    """Whether a file begins as one in the Universal File Format."""
    return bool(_BEGIN.match(content))


def uff_rows(path: Path, field: str) -> list[list[str]]:
    """The header and the rows of the table that the datasets 58 of a file are.

    Signals are columns over the instants of the first one that is no speed; speeds are interpolated between their own.
    Spectra have rows of speed, order and amplitude, the speed from the z axis. Functions of anything else are left out.
    Raises `InputError` if the package pyuff is missing, the file cannot be read, or has not the one or the other.
    """
    functions = _functions(path, field)
    return _spectra(path, functions, field) if over(path, field, functions) == "order" else _signals(
        path, functions, field)


def over(path: Path, field: str, functions: list[dict[str, Any]] | None = None) -> Literal["time", "order"]:
    """What the functions of a file that are read are over; raises `InputError` unless it is one of them."""
    found = {_abscissa(each) for each in functions or _functions(path, field, header_only=True)} - {""}
    if len(found) != 1:
        raise InputError(field, "must have signals over the time, or spectra over the order", str(path),
                         "It has both: export them into files of their own." if found else "It has neither.")
    return "order" if found == {"order"} else "time"


def _functions(path: Path, field: str, header_only: bool = False) -> list[dict[str, Any]]:
    """The datasets 58 of a file."""
    try:
        import pyuff
    except ImportError:
        raise missing_package(f"{path}, in the Universal File Format,", "pyuff", "uff") from None
    try:
        with warnings.catch_warnings(action="ignore", category=ResourceWarning):  # it leaves files to Python
            file = pyuff.UFF(str(path))
            numbers = [i for i, kind in enumerate(file.get_set_types()) if kind == 58]
            sets = file.read_sets(numbers, header_only=header_only)
    except Exception as error:  # pyuff raises its own for each
        raise InputError(field, "must be a file in the Universal File Format that can be read", str(path),
                         f"{error}.".replace("..", ".")) from None
    return sets if isinstance(sets, list) else [sets]


def _abscissa(function: dict[str, Any]) -> str:
    """What a function is over: "time", "order" or, if anything else, nothing."""
    kind = _ABSCISSAE.get(function["abscissa_spec_data_type"], "")
    return kind or next((word for word in _ABSCISSAE.values() if word in _label(function, "abscissa").lower()), "")


def _label(function: dict[str, Any], axis: str, part: str = "lab") -> str:
    """The label of an axis, or its unit; "" for none."""
    text = str(function[f"{axis}_axis_{part}"]).strip()
    return "" if text.upper() == "NONE" else text


def _unit(function: dict[str, Any], axis: str) -> str:
    """The unit of an axis; that of a speed, which the format fixes, if it has none."""
    fixed = {_SPEED: "rpm", 17: "s"}.get(function[f"{axis}_spec_data_type"], "")
    return _label(function, axis, "units_lab") or fixed


def _name(function: dict[str, Any]) -> str:
    """The quantity by the type of its data, and its label unless that says the same."""
    label = _label(function, "ordinate")
    kind = "speed" if _is_speed(function) else _NAMES.get(function["ordinate_spec_data_type"], "")
    return label if kind in label.lower() and label else f"{kind}, {label}".strip(", ") or "value"


def _spectra(path: Path, functions: list[dict[str, Any]], field: str) -> list[list[str]]:
    spectra = [each for each in functions if _abscissa(each) == "order"]
    kinds = {(_name(each), _unit(each, "ordinate"), _unit(each, "z_axis"), next((
        word for word, words in _AMPLITUDES.items() if re.search(words, f"{each['id1']} {_name(each)}".lower())), ""))
        for each in spectra}
    if len(kinds) > 1:
        raise InputError(field, "must have spectra of one quantity in one unit", str(path),
                         f"It has {', '.join(sorted(f'{name} {kind} [{unit}]' for name, unit, _, kind in kinds))}.")
    ((name, unit, speed_unit, kind),) = kinds
    if any(each["z_axis_spec_data_type"] != _SPEED and "rpm" not in speed_unit.lower() for each in spectra):
        raise InputError(field, "must have the speed of each spectrum on its z axis, in rpm", str(path),
                         "Or write a table with the columns speed, order and amplitude.")
    rows = [[f"speed [{speed_unit}]", "order", f"{name} {kind}".strip() + f" [{unit}]" * bool(unit)]]
    for each in spectra:
        # the header has six digits of the distance of the orders, in one turn of a whole number
        count = 1 / each["abscissa_inc"] if each["abscissa_spacing"] else 0.0
        orders = np.asarray(each["x"]) if not count or abs(count - round(count)) > 1e-5 * count else (
            each["abscissa_min"] + np.arange(len(each["data"])) / round(count))
        lines = zip(orders.tolist(), np.abs(each["data"]).tolist(), strict=True)
        rows += [[repr(float(each["z_axis_value"])), repr(order), repr(size)] for order, size in lines if order > 0]
    return rows


def _signals(path: Path, functions: list[dict[str, Any]], field: str) -> list[list[str]]:
    signals = [each for each in functions if _abscissa(each) == "time"]
    first = next((each for each in signals if not _is_speed(each)), signals[0])
    slack = 1e-3 * np.diff(first["x"][:2]).max(initial=0.0)  # headers round
    low, high = max(each["x"][0] for each in signals) - slack, min(each["x"][-1] for each in signals) + slack
    time = first["x"][(first["x"] >= low) & (first["x"] <= high)]
    names, columns = Counter(map(_name, signals)), {"time [s]": time}
    for each in signals:
        same = len(each["x"]) == len(first["x"]) and np.allclose(each["x"], first["x"], rtol=0, atol=slack)
        if not (same or _is_speed(each)):
            raise InputError(field, "must have signals at the same instants", str(path), f"{_name(each)} "
                             f"[{_unit(each, 'ordinate')}] has others than {_name(first)}: speeds alone may.")
        unit, own = _unit(each, "ordinate"), f" {each['id1'].strip()}" * (names[_name(each)] > 1)
        columns[f"{_name(each)}{own}" + f" [{unit}]" * bool(unit)] = np.interp(time, each["x"], each["data"])
    return [[*columns], *([*map(repr, row)] for row in np.stack([*columns.values()], axis=1).tolist())]


def _is_speed(function: dict[str, Any]) -> bool:
    return function["ordinate_spec_data_type"] == _SPEED or "rpm" in _label(function, "ordinate", "units_lab").lower()
