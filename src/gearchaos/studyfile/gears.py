"""The gears that a study file describes: ``[gearpair]``, or ``[design]`` with ``[operation]``."""

from __future__ import annotations

import copy
from collections.abc import Collection, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from gearchaos.errors import InputError
from gearchaos.gears.operating import Gears, is_design
from gearchaos.gears.pair import GearPair
from gearchaos.studyfile.tables import GearPairTable, StudyFile, validated

TABLES = ("gearpair", "design", "operation")
"""The tables that describe gears; ``--set TABLE.KEY=VALUE`` replaces a value in them."""

def separated(values: Mapping[str, Any]) -> tuple[dict[str, dict[str, Any]], dict[str, Any]]:
    """Values for the tables of gears, by table and key, and the other values by name."""
    of_gears: dict[str, dict[str, Any]] = {table: {} for table in TABLES}
    rest = {}
    for name, value in values.items():
        table, dot, key = name.partition(".")
        if dot and table in TABLES:
            of_gears[table][key] = value
        else:
            rest[name] = value
    return of_gears, rest


def refuse_without_table(gears: Gears, values: Mapping[str, Any], known: Collection[str] = ()) -> None:
    """Raise `InputError` for a value of the gears that is given without the name of its table.

    ``known`` are the names that need no table: those of the parameters and initial values of the model.
    """
    table = "design" if is_design(gears) else "gearpair"
    own = {f.name for f in fields(gears)} - set(known)  # type: ignore[arg-type]
    for name, value in values.items():
        if name.partition(".")[0] in own:
            raise InputError(name, "must be given with the name of its table", value, f"Write {table}.{name}=VALUE.")


def gears_of(
    tables: StudyFile, values: Mapping[str, Mapping[str, Any]], folder: Path, default: Mapping[str, Any]
) -> Gears | None:
    """The gears of a study file in a folder; None if it describes none.

    ``values`` by table and key replace those of the file; ``default`` has speed and torque of a design without.
    """
    for table in TABLES:
        for key, value in values[table].items():
            if getattr(tables, table) is None and not (table == "operation" and tables.design):
                raise InputError(f"{table}.{key}", f"needs a study file with a [{table}] table", value)
    if tables.design is None and tables.operation is not None:
        raise InputError("[operation]", "must be left out without [design]", list(tables.operation),
                         "[gearpair] has M10 and speed.")
    if tables.gearpair is not None:
        _refuse_beside(tables, "gearpair", "model", "design")
        found = validated(GearPairTable, {**tables.gearpair.model_dump(), **values["gearpair"]}, "gearpair")
        return GearPair(**found.model_dump(exclude={"kind"}))
    if tables.design is None:
        return None
    _refuse_beside(tables, "design", "model")
    from gearchaos.gears.design import gear_design  # many modules, for files with a design alone

    design = _replaced(tables.design, values["design"], "design")
    for name, path in gear_design.FILES:
        given = design.get(name)
        if isinstance(given, dict) and isinstance(given.get(path), str):
            given[path] = str((folder / given[path]).absolute())
    operation = _replaced(tables.operation or {}, values["operation"], "operation")
    if any(name in operation for name in gear_design.FREQUENCIES):
        default = {name: value for name, value in default.items() if name != "speed"}
    return gear_design.GearDesign.from_tables(design, {**default, **operation})


def _refuse_beside(tables: StudyFile, table: str, *others: str) -> None:
    """Raise `InputError` for a table that determines the model, too."""
    for other in others:
        if (found := getattr(tables, other)) is not None:
            given = list(found) if isinstance(found, Mapping) else list(found.model_fields_set)
            raise InputError(f"[{other}]", f"must be left out beside [{table}]", given,
                             "The gears determine the model.")


def _replaced(table: Mapping[str, Any], values: Mapping[str, Any], title: str) -> dict[str, Any]:
    """A table with values replaced by key; the key of a value in an inner table is ``quality.grade``."""
    out = copy.deepcopy(dict(table))
    for path, value in values.items():
        *outer, last = path.split(".")
        inner = out
        for name in outer:
            inner = inner.setdefault(name, {})
            if not isinstance(inner, dict):
                raise InputError(f"{title}.{path}", f"must not lie in {name}, which is no table", value)
        inner[last] = value
    return out
