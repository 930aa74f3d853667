"""Look-up of quantities by any form of their names; kinds of stiffness and studies declare more of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import lru_cache

from gearchaos.errors import InputError, unknown_name
from gearchaos.quantities.quantity import Name, Quantity, parse
from gearchaos.quantities.tables import (
    COORDINATES,
    GEARS,
    HARMONICS,
    OPERATION,
    PARAMETERS,
    PARTS,
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


def declare_results(rows: Iterable[Quantity]) -> None:
    """Add the variables of the results of a study, which no result had before, to what can be looked up."""
    for row in rows:
        if _BY_NAME.setdefault(row.name, row) != row:
            raise InputError("quantities", "must be of new names", row.name, "A name means the same everywhere.")
    find.cache_clear()


_ASKED: list[Callable[[], object]] = []


def ask_if_unknown(ask: Callable[[], object]) -> None:
    """Have a function called, which may `declare` more, before a name is taken to be that of no quantity."""
    _ASKED.append(ask)


@lru_cache(maxsize=4096)
def find(name: str) -> Quantity | None:
    """The quantity of a name; None if there is none.

    A name is that of a row of the tables (``omega``, ``x1_dot``), a family of harmonics with an order (``eps3``), or
    ``Kv_`` with a standard (``Kv_AGMA``), each with or without one of `PREFIXES` (``attractor_section_x1_dot``). The
    quantity is the same with and without prefix. Of a part of a train, as in ``loose.torque``, it is that of `PARTS`,
    or of a coordinate.
    """
    base = parse(name).base
    owner, dot, own = base.rpartition(".")
    if dot:
        found = PARTS.get(own) or _BY_NAME.get(own)
        return found and replace(found, name=base, long_name=f"{found.long_name or own} of {owner}", symbol="", tex="",
                                 axis_name=f"{found.axis_name or own} of {owner}")
    if parts := parse_harmonic(base):
        return of_order(HARMONICS[parts.family], parts.order or 0)
    if base.startswith("Kv_"):
        return replace(_BY_NAME["Kv_STANDARD"], name=base)
    for ask in _ASKED if base not in _BY_NAME else ():
        ask()
    return _BY_NAME.get(base)


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
