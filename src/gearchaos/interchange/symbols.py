"""The symbols and functions in SymPy by which the equations of a model are written, and their names."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from gearchaos.errors import InputError
from gearchaos.model import HarmonicStiffness, SteppedStiffness, Stiffness, TransmissionError
from gearchaos.validation import MAX_HARMONICS

COORDINATES = ("x1", "x2", "y1", "y2", "z")
"""The functions of τ that may be coordinates; z is none where it has a definition."""

_NUMBERED = re.compile(r"(eps|theta|c|alpha|level|start)([1-9]\d*)")


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


def stiffness_values(stiffness: Stiffness) -> dict[str, float]:
    """The values of a mesh stiffness by the names of their symbols."""
    if isinstance(stiffness, SteppedStiffness):
        return _numbered("level", stiffness.levels) | _numbered("start", stiffness.starts)
    if isinstance(stiffness, HarmonicStiffness):
        return _numbered("c", stiffness.amplitudes) | _numbered("alpha", stiffness.phases)
    return dict(vars(stiffness))


def named(values: Mapping[str, float]) -> tuple[dict[str, float], dict[str, Any]]:
    """Values by the names of symbols as arguments of `MeshModel.of`: single values, and waveforms by their field."""
    series: dict[str, dict[int, float]] = {}
    single = {}
    for name, value in values.items():
        if found := _NUMBERED.fullmatch(name):
            if int(found[2]) > MAX_HARMONICS:  # as many as levels
                raise InputError("values", f"must have numbers of at most {MAX_HARMONICS} in their names", name)
            series.setdefault(found[1], {})[int(found[2])] = value
        else:
            single[name] = value
    rows = {name: _list(name, numbers) for name, numbers in series.items()}
    parts: dict[str, Any] = {}
    if rows.keys() & {"eps", "theta"}:
        parts["error"] = TransmissionError(rows.get("eps", ()), rows.get("theta", ()))
    if rows.keys() & {"c", "alpha"}:
        parts["stiffness"] = HarmonicStiffness(rows.get("c", ()), rows.get("alpha", ()))
    if rows.keys() & {"level", "start"}:
        parts["stiffness"] = SteppedStiffness(rows.get("level", ()), rows.get("start", ()))
    return single, parts


def _numbered(name: str, values: tuple[float, ...]) -> dict[str, float]:
    return {f"{name}{i}": value for i, value in enumerate(values, start=1)}


def _list(name: str, numbers: Mapping[int, float]) -> tuple[float, ...]:
    """The values of a series by their numbers 1, 2, …, without gaps except for harmonics, which are 0 there."""
    if name in ("level", "start") and sorted(numbers) != list(range(1, len(numbers) + 1)):
        raise InputError("values", f"must have {name}1, {name}2, … without gaps", sorted(numbers))
    return tuple(numbers.get(i, 0.0) for i in range(1, max(numbers) + 1))
