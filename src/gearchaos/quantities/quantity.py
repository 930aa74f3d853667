"""The description of one quantity: names and their parts, symbols, units, rule and range."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import KW_ONLY, dataclass
from functools import lru_cache
from typing import Any, NamedTuple


@dataclass(frozen=True)
class Rule:
    """A condition that values must satisfy."""

    holds: Callable[[Any], Any]  # of a float or an array, True where it is satisfied, of the same shape
    text: str  # the predicate of a sentence, e.g. "must be greater than 0"
    advice: str = ""  # what to do if a value breaks the rule, or why the rule exists


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
    """The physical unit of a dimensionless quantity; name and symbols are empty if they are those of that."""

    scale: str  # field of `gearchaos.gears.mesh.pair.Scales` with the SI value of one dimensionless unit
    factor: float  # the SI unit divided by the unit shown, e.g. 1e6 for µm
    unit: str  # that is shown, in the notation of UDUNITS, e.g. "N*m"
    long_name: str = ""
    symbol: str = ""
    tex: str = ""


@dataclass(frozen=True)
class Quantity:
    """The description of a parameter, coordinate, response measure or other variable of a result.

    Texts are empty where it has none.
    """

    name: str  # in Python, in study files, on the command line and in results
    symbol: str = ""  # in plain Unicode, "ε₁"
    tex: str = ""  # the symbol in mathtext, without dollar signs
    _: KW_ONLY
    long_name: str = ""  # in files; empty if that is the name itself
    axis_name: str = ""  # short name on the axis of a picture, before the symbol, instead of the long name
    title: str = ""  # of its field in the explorer, or of its row in the table printed by ``gearchaos regime``
    unit: str = "1"  # ``units`` in files: a product of delta (half the backlash), omega0, c0 and T (mesh period)
    physical: Physical | None = None  # unit for a given gear pair; None for a pure number
    rule: Rule | None = None  # what a value must satisfy besides being finite
    divisor: bool = False  # whether the equations divide by it: a value other than 0 must not be tiny
    range: Range | None = None  # None for a quantity that cannot be set
    members: tuple[()] | tuple[str, str] = ()  # of a pair, such as ``q0``: the parameters of both wheels that it sets
    toml_table: str = ""  # the table of a study file in which it is given; empty for ``[model]``


POSITIVE = Rule(lambda v: v > 0, "must be greater than 0")
NOT_NEGATIVE = Rule(lambda v: v >= 0, "must not be negative")

PREFIXES = (
    "attractor_section_", "attractor_start_", "attractor_", "event_section_", "event_", "jump_", "section_", "start_",
    "special_", "curve_", "manifold_", "saddle_section_", "saddle_", "cell_", "neighbour_", "orbit_",
    "against_",
)
"""Prefixes of variables of a result: ``attractor_`` one value per attractor, ``event_`` and ``jump_`` one per event and
jump, ``section_`` values at the stroboscopic section, ``start_`` initial values, ``special_`` one value per point of
codimension 2, ``curve_``, ``manifold_``, ``saddle_`` and ``orbit_`` one per curve, branch of a manifold, saddle and
period of orbits, ``cell_`` and ``neighbour_`` those of the two cells at a side, ``against_`` those of
gears that are compared."""

_PARTS = re.compile(r"([A-Za-z_]+?)(0|[1-9][0-9]{0,17})?(_dot)?")


@dataclass(frozen=True)
class Name:
    """The parts of a name: those of ``section_x1_dot`` are prefix "section_", family "x", order 1 and derivative 1."""

    family: str
    order: int | None = None  # of the harmonic in ``eps3``, the wheel in ``J1`` and ``x1``, 0 in the pair ``q0``
    derivative: int = 0  # with respect to τ: 1 where the name ends in ``_dot``
    prefix: str = ""  # one of `PREFIXES`

    @property
    def base(self) -> str:
        """The name without its prefix."""
        return f"{self.family}{'' if self.order is None else self.order}{'_dot' * self.derivative}"

    def __str__(self) -> str:
        return self.prefix + self.base


def parameter_owner(name: str) -> str:
    """The name of a part of a train as it stands before the dot in the names of its parameters, which are also those of
    variables in files: letters, digits, - and _."""
    return "".join(c if c.isalnum() or c in "-_" else "_" for c in name)


@lru_cache(maxsize=4096)
def parse(name: str) -> Name:
    """The parts of a name. Of a text that does not match the pattern of names, all but the prefix is the family."""
    prefix = next((p for p in PREFIXES if name.startswith(p)), "")
    parts = _PARTS.fullmatch(name, len(prefix))
    if parts is None:
        return Name(name[len(prefix):], prefix=prefix)
    return Name(parts[1], None if parts[2] is None else int(parts[2]), int(parts[3] is not None), prefix)
