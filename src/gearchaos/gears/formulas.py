"""What modules of gears declare: how each computed quantity is shown, and the standards and methods themselves.

The description of a quantity, with symbol, unit, formula and source, is kept beside the field that holds it. A standard
or a method of computation is a module of its own, and no list names it.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from importlib import import_module
from pkgutil import iter_modules
from types import ModuleType
from typing import Any


@dataclass(frozen=True)
class Formula:
    """How a quantity is shown, and where it comes from: its symbol in plain Unicode, and its formula in the units
    shown.
    """

    symbol: str
    unit: str  # empty for a pure number
    factor: float  # on the value in SI
    text: str
    source: str  # standard with edition, and the clause or equation
    words: str = ""  # empty if its name reads as words


def described(symbol: str, text: str, source: str, unit: str = "", factor: float = 1.0, *, words: str = "") -> Any:
    """A dataclass field whose metadata holds a `Formula`."""
    return field(metadata={"formula": Formula(symbol, unit, factor, text, source, words)})


def formulas(result: Any) -> dict[str, Formula]:
    """The formulas of a result, a dataclass or an instance of one, by field name in the order of the fields.

    Fields without a formula, such as warnings, are left out.
    """
    return {f.name: f.metadata["formula"] for f in fields(result) if "formula" in f.metadata}


def declared(folder: ModuleType, name: str) -> list[Any]:
    """What the modules of a package call ``name``, in the order of the modules; not every module must have it."""
    modules = (import_module(f"{folder.__name__}.{found.name}") for found in iter_modules(folder.__path__))
    return [getattr(module, name) for module in modules if hasattr(module, name)]
