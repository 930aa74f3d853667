"""What is known of one quantity: symbol, words, units, rule and range."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from typing import Any, NamedTuple


@dataclass(frozen=True)
class Rule:
    """What a value must obey.

    Attributes
    ----------
    holds : callable
        Takes a float or an array of floats and returns bool or an array of bool, True where the rule is obeyed.
    words : str
        The rule as the predicate of a sentence, e.g. "must be greater than 0".
    advice : str
        What to do where a value breaks it, or why the rule exists; may be empty.
    """

    holds: Callable[[Any], Any]
    words: str
    advice: str = ""


class Range(NamedTuple):
    """Values that the explorer offers: ends of the slider, and the least and the largest value that can be typed."""

    low: float
    high: float
    least: float
    most: float

    @property
    def step(self) -> float:
        """Step of the slider."""
        return (self.high - self.low) / 400


@dataclass(frozen=True)
class Physical:
    """The physical unit of a dimensionless quantity.

    Attributes
    ----------
    scale : str
        Field of `gearchaos.gears.scales.Scales` with the SI value of one dimensionless unit.
    factor : float
        From the SI unit to the unit shown.
    unit : str
        Unit shown, in the notation of UDUNITS, e.g. "N*m".
    long_name : str
        Name of the quantity when it has this unit; empty if it is the same as without unit.
    symbol, tex : str
        Its symbol then, plain and in mathtext; empty if it is the same as without unit.
    """

    scale: str
    factor: float
    unit: str
    long_name: str = ""
    symbol: str = ""
    tex: str = ""


@dataclass(frozen=True)
class Quantity:
    """One quantity.

    Attributes
    ----------
    name : str
        Name in Python, in study files, on the command line and in results.
    symbol, tex : str
        Symbol in plain Unicode ("ε₁") and in mathtext without dollar signs; empty if it has none.
    long_name : str
        ``long_name`` in files; empty if that is the name itself.
    words : str
        Short words for an axis of a picture, before the symbol; empty for ``long_name``.
    title : str
        Words for a field of the explorer or a row of the page of a verdict; empty for what has neither.
    unit : str
        Dimensionless unit, ``units`` in files: a product of delta (half the backlash), omega0, c0 and T (mesh period).
    physical : Physical or None
        Unit of a gear pair; None for what is a plain number there too.
    rule : Rule or None
        What a value must obey beside being finite.
    divisor : bool
        Whether the equations divide by it, so that a value other than 0 must not be tiny.
    range : Range or None
        What the explorer offers; None for what cannot be set.
    members : tuple of str
        The two parameters that a pair sets; empty for all other quantities.
    home : str
        Where a study file has it, if not in ``[model]``.
    """

    name: str
    symbol: str = ""
    tex: str = ""
    _: KW_ONLY
    long_name: str = ""
    words: str = ""
    title: str = ""
    unit: str = "1"
    physical: Physical | None = None
    rule: Rule | None = None
    divisor: bool = False
    range: Range | None = None
    members: tuple[()] | tuple[str, str] = ()
    home: str = ""


POSITIVE = Rule(lambda v: v > 0, "must be greater than 0")
NOT_NEGATIVE = Rule(lambda v: v >= 0, "must not be negative")
