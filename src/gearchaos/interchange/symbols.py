"""The symbols and functions in SymPy by which the equations of a model are written, and their names."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from gearchaos.errors import InputError
from gearchaos.model import STIFFNESS_KINDS, TransmissionError
from gearchaos.quantities import HARMONICS
from gearchaos.validation import MAX_HARMONICS

COORDINATES = ("x1", "x2", "y1", "y2", "z")
"""The functions of τ that may be coordinates; z is none where it has a definition."""


def sympy() -> Any:
    """The module `sympy`; raises `InputError` if it is not installed."""
    try:
        import sympy as module
    except ImportError:
        raise InputError("SymPy", "must be installed for symbolic equations", "missing",
                         'Run: pip install "gearchaos[sympy]".') from None
    return module


def TAU() -> Any:  # the letter of time in the equations
    """The symbol of the time τ."""
    return sympy().Symbol("tau", real=True)


def symbol(name: str) -> Any:
    """The symbol of a parameter."""
    return sympy().Symbol(name, real=True)


def function(name: str) -> Any:
    """The function of τ with this name."""
    return sympy().Function(name)(TAU())


def numbered(numbers: Mapping[str, Any]) -> dict[str, float]:
    """Numbers by the names of their symbols: those of a list are in the singular, and have its index from 1 on."""
    out: dict[str, float] = {}
    for name, value in numbers.items():
        many = isinstance(value, tuple)
        out |= {f"{_singular(name)}{i}": v for i, v in enumerate(value, start=1)} if many else {name: value}
    return out


def named(values: Mapping[str, float]) -> tuple[dict[str, float], dict[str, Any]]:
    """Values by the names of symbols as arguments of `MeshModel.of`: single values, and waveforms by their field."""
    owners: dict[str, tuple[str, Any, str]] = {
        "eps": ("error", TransmissionError, "amplitudes"), "theta": ("error", TransmissionError, "phases")}
    for kind in STIFFNESS_KINDS.values():
        owners |= {_singular(kind.letters.get(field, field)): ("stiffness", kind, field) for field in kind.lists()}
    numbers: dict[str, dict[int, float]] = {}
    single = {}
    for name, value in values.items():
        found = re.fullmatch(r"([a-z]+)([1-9]\d*)", name)
        if found and found[1] in owners:
            if int(found[2]) > MAX_HARMONICS:  # as many as levels
                raise InputError("values", f"must have numbers of at most {MAX_HARMONICS} in their names", name)
            numbers.setdefault(found[1], {})[int(found[2])] = value
        else:
            single[name] = value
    parts: dict[tuple[str, Any], dict[str, tuple[float, ...]]] = {}
    for name, (part, kind_of_part, field) in owners.items():
        if name in numbers:
            parts.setdefault((part, kind_of_part), {})[field] = _list(name, numbers[name])
    return single, {part: _made(kind_of_part, lists) for (part, kind_of_part), lists in parts.items()}


def _made(kind: Any, lists: Mapping[str, tuple[float, ...]]) -> Any:
    """A waveform of a kind from lists of numbers; those without value are empty."""
    return kind(**{f.name: lists.get(f.name, ()) for f in fields(kind) if "tuple" in str(f.type)})


def _singular(name: str) -> str:
    """The name of one of the numbers of a list: level of levels."""
    return name if name in HARMONICS else name.removesuffix("s")


def _list(name: str, numbers: Mapping[int, float]) -> tuple[float, ...]:
    """The values of a series by their numbers 1, 2, …, without gaps except for harmonics, which are 0 there."""
    if name not in HARMONICS and sorted(numbers) != list(range(1, len(numbers) + 1)):
        raise InputError("values", f"must have {name}1, {name}2, … without gaps", sorted(numbers))
    return tuple(numbers.get(i, 0.0) for i in range(1, max(numbers) + 1))
