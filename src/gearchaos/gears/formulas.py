"""Descriptions of computed quantities, kept beside the fields that hold them: symbol, unit, formula and source."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any


@dataclass(frozen=True)
class Formula:
    """How a quantity is shown, and where it comes from.

    Attributes
    ----------
    symbol : str
        Symbol in plain Unicode, e.g. "c′".
    unit : str
        Unit shown; empty for a pure number.
    factor : float
        The SI unit divided by the unit shown: the number shown is the value in SI times this factor.
    text : str
        The formula, in the units shown.
    source : str
        Standard with edition, and the clause or equation.
    """

    symbol: str
    unit: str
    factor: float
    text: str
    source: str


def described(symbol: str, text: str, source: str, unit: str = "", factor: float = 1.0) -> Any:
    """A dataclass field whose metadata holds a `Formula`."""
    return field(metadata={"formula": Formula(symbol, unit, factor, text, source)})


def formulas(result: Any) -> dict[str, Formula]:
    """The formulas of a result by field name, in the order of its fields.

    Parameters
    ----------
    result : dataclass or instance of one
        Its fields without a formula, such as warnings, are left out.
    """
    return {f.name: f.metadata["formula"] for f in fields(result) if "formula" in f.metadata}
