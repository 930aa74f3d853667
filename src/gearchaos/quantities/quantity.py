"""The description of one quantity: names, symbols, units, rule and range."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from typing import Any, NamedTuple


@dataclass(frozen=True)
class Rule:
    """A condition that values must satisfy.

    Attributes
    ----------
    holds : callable
        Takes a float or an array of floats and returns a bool or an array of bool of the same shape, True where the
        rule is satisfied.
    text : str
        The rule as the predicate of a sentence, e.g. "must be greater than 0".
    advice : str
        What to do if a value breaks the rule, or why the rule exists; may be empty.
    """

    holds: Callable[[Any], Any]
    text: str
    advice: str = ""


class Range(NamedTuple):
    """The values that the explorer offers: ``low`` to ``high`` on the slider, ``least`` to ``most`` when typed."""

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
        The SI unit divided by the unit shown, e.g. 1e6 for µm.
    unit : str
        Unit shown, in the notation of UDUNITS, e.g. "N*m".
    long_name : str
        Name of the physical quantity; empty if it is that of the dimensionless one.
    symbol, tex : str
        Symbol of the physical quantity, plain and in mathtext; empty if it is that of the dimensionless one.
    """

    scale: str
    factor: float
    unit: str
    long_name: str = ""
    symbol: str = ""
    tex: str = ""


@dataclass(frozen=True)
class Quantity:
    """The description of a parameter, coordinate, response measure or other variable of a result.

    Attributes
    ----------
    name : str
        Name in Python, in study files, on the command line and in results.
    symbol, tex : str
        Symbol in plain Unicode ("ε₁") and in mathtext without dollar signs; empty if it has none.
    long_name : str
        ``long_name`` in files; empty if that is the name itself.
    axis_name : str
        Short name on the axis of a picture, before the symbol; if empty, ``long_name`` is used.
    title : str
        Name of its field in the explorer, or of its row in the table that ``gearchaos regime`` prints; empty if it has
        neither.
    unit : str
        Dimensionless unit, ``units`` in files: a product of delta (half the backlash), omega0, c0 and T (mesh period).
    physical : Physical or None
        Physical unit for a given gear pair; None if the quantity is a pure number.
    rule : Rule or None
        What a value must satisfy besides being finite.
    divisor : bool
        Whether the equations divide by it, so that a value other than 0 must not be tiny.
    range : Range or None
        The values that the explorer offers; None for a quantity that cannot be set.
    members : tuple of str
        For a parameter pair, a name such as ``q0`` that sets the values of both wheels: the names of the two
        parameters. Empty for all other quantities.
    toml_table : str
        Table of a study file in which it is given; empty for ``[model]``.
    """

    name: str
    symbol: str = ""
    tex: str = ""
    _: KW_ONLY
    long_name: str = ""
    axis_name: str = ""
    title: str = ""
    unit: str = "1"
    physical: Physical | None = None
    rule: Rule | None = None
    divisor: bool = False
    range: Range | None = None
    members: tuple[()] | tuple[str, str] = ()
    toml_table: str = ""


POSITIVE = Rule(lambda v: v > 0, "must be greater than 0")
NOT_NEGATIVE = Rule(lambda v: v >= 0, "must not be negative")
