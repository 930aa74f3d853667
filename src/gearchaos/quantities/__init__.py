"""Every name that a user meets, once: its symbol, words, units, rule and range.

A parameter, a coordinate, a response measure or a variable of a result is described by one `Quantity`, a row of a table
in `gearchaos.quantities.tables`. Files, pictures, pages, error messages and the explorer take their texts, units and
ranges from there. To add a quantity, write its row; the value itself is computed elsewhere.

>>> quantity("section_x1_dot").symbol
'x₁′'
>>> parse("eps3").order
3
"""

from gearchaos.quantities.lookup import PAIRS, find, harmonic, quantity
from gearchaos.quantities.names import PREFIXES, Name, parse
from gearchaos.quantities.quantity import NOT_NEGATIVE, POSITIVE, Physical, Quantity, Range, Rule
from gearchaos.quantities.tables import (
    COORDINATES,
    HARMONICS,
    PARAMETERS,
    RESPONSES,
    RESULTS,
    STIFFNESS_LEVELS,
    VERDICTS,
)

__all__ = [
    "COORDINATES", "HARMONICS", "NOT_NEGATIVE", "PAIRS", "PARAMETERS", "POSITIVE", "PREFIXES", "RESPONSES", "RESULTS",
    "STIFFNESS_LEVELS", "VERDICTS", "Name", "Physical", "Quantity", "Range", "Rule", "find", "harmonic", "parse",
    "quantity",
]
