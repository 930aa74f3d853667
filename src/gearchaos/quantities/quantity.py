"""The description of one quantity: names and their parts, symbols, units, rule and range."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from functools import lru_cache
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
        Field of `gearchaos.gears.pair.Scales` with the SI value of one dimensionless unit.
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

PREFIXES = (
    "attractor_section_", "attractor_start_", "attractor_", "event_section_", "event_", "jump_", "section_", "start_",
    "special_", "curve_", "manifold_", "saddle_section_", "saddle_", "cell_", "neighbour_", "orbit_",
)
"""Prefixes of variables of a result: ``attractor_`` one value per attractor, ``event_`` and ``jump_`` one per event and
jump, ``section_`` values at the stroboscopic section, ``start_`` initial values, ``special_`` one value per point of
codimension 2, ``curve_``, ``manifold_``, ``saddle_`` and ``orbit_`` one per curve, branch of a manifold, saddle and
period of orbits, ``cell_`` and ``neighbour_`` those of the two cells at a side."""

_PARTS = re.compile(r"([A-Za-z_]+?)(0|[1-9][0-9]{0,17})?(_dot)?")


@dataclass(frozen=True)
class Name:
    """The parts of a name: those of ``section_x1_dot`` are prefix "section_", family "x", order 1 and derivative 1.

    Attributes
    ----------
    family : str
        The name without prefix, order and derivative.
    order : int or None
        The number in the name: the harmonic order in ``eps3``, the wheel in ``J1`` and ``x1``, 0 in the parameter pairs
        ``q0`` and ``chi0``; None without a number.
    derivative : int
        1 where the name ends in ``_dot``, for the derivative with respect to τ; else 0.
    prefix : str
        One of `PREFIXES`, or empty.
    """

    family: str
    order: int | None = None
    derivative: int = 0
    prefix: str = ""

    @property
    def base(self) -> str:
        """The name without its prefix."""
        return f"{self.family}{'' if self.order is None else self.order}{'_dot' * self.derivative}"

    def __str__(self) -> str:
        return self.prefix + self.base


@lru_cache(maxsize=4096)
def parse(name: str) -> Name:
    """The parts of a name. Of a text that does not match the pattern of names, all but the prefix is the family."""
    prefix = next((p for p in PREFIXES if name.startswith(p)), "")
    parts = _PARTS.fullmatch(name, len(prefix))
    if parts is None:
        return Name(name[len(prefix):], prefix=prefix)
    return Name(parts[1], None if parts[2] is None else int(parts[2]), int(parts[3] is not None), prefix)
