"""The public names: symbol, description, units, rule and range of every parameter, coordinate and result.

Each is described once, by a `Quantity` in one of the tables in `gearchaos.quantities.tables`. Files, pictures, printed
tables, error messages and the explorer take their texts, units and ranges from there. To add a quantity, add its row;
the value itself is computed elsewhere. The parameters of a mesh stiffness are declared by its kind, in
`gearchaos.model.stiffness`.

>>> quantity("section_x1_dot").symbol
'x₁′'
>>> parse("eps3").order
3
"""

from gearchaos.quantities.lookup import (
    PARAMETER_PAIRS,
    STIFFNESS_PARAMETERS,
    ask_if_unknown,
    declare,
    declare_results,
    find,
    parse_harmonic,
    quantity,
)
from gearchaos.quantities.quantity import (
    NOT_NEGATIVE,
    POSITIVE,
    PREFIXES,
    Name,
    Physical,
    Quantity,
    Range,
    Rule,
    parameter_owner,
    parse,
)
from gearchaos.quantities.tables import (
    COORDINATES,
    GEARS,
    HARMONICS,
    OPERATION,
    PARAMETERS,
    RESPONSES,
    RESULTS,
    VERDICTS,
)

__all__ = [
    "COORDINATES", "GEARS", "HARMONICS", "NOT_NEGATIVE", "OPERATION", "PARAMETERS", "PARAMETER_PAIRS", "POSITIVE",
    "PREFIXES", "RESPONSES", "RESULTS", "STIFFNESS_PARAMETERS", "VERDICTS", "Name", "Physical", "Quantity", "Range",
    "Rule", "ask_if_unknown", "declare", "declare_results", "find", "parameter_owner", "parse", "parse_harmonic",
    "quantity",
]
