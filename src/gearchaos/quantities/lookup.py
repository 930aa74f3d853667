"""Look-up of quantities by any form of their names."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache

from gearchaos.errors import unknown_name
from gearchaos.quantities.names import Name, parse
from gearchaos.quantities.quantity import Quantity
from gearchaos.quantities.tables import (
    COORDINATES,
    GEARS,
    HARMONICS,
    OPERATION,
    PARAMETERS,
    RESPONSES,
    RESULTS,
    VERDICTS,
    of_order,
)

PARAMETER_PAIRS: dict[str, tuple[str, str]] = {q.name: q.members for q in PARAMETERS if q.members}
"""The names that set a parameter of both wheels, such as ``q0``, each with the names of the two parameters."""

STIFFNESS_PARAMETERS: list[Quantity] = []
"""The parameters of all kinds of mesh stiffness, and pairs of them. Each kind declares its own."""

_TABLES = (PARAMETERS, OPERATION, GEARS, COORDINATES, RESPONSES, VERDICTS, RESULTS)
_BY_NAME = {q.name: q for table in _TABLES for q in table}


def declare(rows: Iterable[Quantity], families: Iterable[Quantity]) -> None:
    """Add the parameters of a kind of mesh stiffness, and the families of its harmonics, to what can be looked up.

    The kinds stand above the quantities; `gearchaos.model.stiffness` calls this once for each of them.
    """
    for row in rows:
        if row.name not in _BY_NAME:
            STIFFNESS_PARAMETERS.append(row)
            _BY_NAME[row.name] = row
            if row.members:
                PARAMETER_PAIRS[row.name] = row.members
    HARMONICS.update({family.name: family for family in families})
    find.cache_clear()
    parse_harmonic.cache_clear()


@lru_cache(maxsize=4096)
def find(name: str) -> Quantity | None:
    """The quantity of a name; None if there is none.

    A name is that of a row of the tables (``omega``, ``x1_dot``), or a family of harmonics with an order (``eps3``),
    either of them with or without one of `PREFIXES` (``attractor_section_x1_dot``). The quantity is the same with and
    without prefix.
    """
    base = parse(name).base
    parts = parse_harmonic(base)
    return _BY_NAME.get(base) if parts is None else of_order(HARMONICS[parts.family], parts.order or 0)


def quantity(name: str) -> Quantity:
    """The quantity of a name, see `find`; raises `InputError` if there is none."""
    found = find(name)
    if found is None:
        raise unknown_name("name", name, _BY_NAME)
    return found


@lru_cache(maxsize=4096)
def parse_harmonic(name: str) -> Name | None:
    """The parts of the name of a harmonic, such as ``eps3``, with a family in `HARMONICS` and an order of at least 1.

    None for any other name.
    """
    parts = parse(name)
    return parts if parts.family in HARMONICS and parts.order and not (parts.derivative or parts.prefix) else None
