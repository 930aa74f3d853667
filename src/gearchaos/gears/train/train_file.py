"""`Train` from the tables of a study file, and its initial values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from gearchaos.errors import InputError, unknown_name
from gearchaos.gears.fields import record_values
from gearchaos.gears.train.model import TrainModel
from gearchaos.gears.train.parts import Mesh, parameter_owner
from gearchaos.gears.train.planets import PlanetarySet
from gearchaos.gears.train.train import Train
from gearchaos.gears.units import LENGTH, VELOCITY, to_si


def read_train(table: Mapping[str, Any], pair: Callable[[str], Any]) -> Train:
    """The train of a table ``[train]``; ``pair`` reads the gears at a path, for meshes with a ``design``.

    A table ``planets`` adds the bodies and meshes of a planetary set.
    """
    given = dict(table)
    meshes = []
    for i, mesh in enumerate(_tables(given, "meshes")):
        if isinstance(mesh.get("design"), str):
            mesh = {**mesh, "design": pair(mesh["design"])}
        meshes.append(record_values(Mesh, f"train.meshes[{i}]", mesh))
    given["meshes"] = meshes
    if planets := given.pop("planets", None):
        if not isinstance(planets, Mapping):
            raise InputError("train.planets", "must be a table", planets)
        found = record_values(PlanetarySet, "train.planets", planets)
        given["bodies"] = [*_tables(given, "bodies"), *found.bodies]
        given["meshes"] += found.meshes
    return record_values(Train, "train", given)


def _tables(table: Mapping[str, Any], name: str) -> list[dict[str, Any]]:
    """A list of tables, in TOML [[train.name]]."""
    found = table.get(name, [])
    if not isinstance(found, list) or not all(isinstance(each, Mapping) for each in found):
        raise InputError(f"train.{name}", "must be a list of tables", found, f"Write [[train.{name}]].")
    return [dict(each) for each in found]


def initial_of(model: TrainModel, table: Mapping[str, Any]) -> dict[str, float]:
    """Dimensionless initial values by coordinate, from a table with ``deflections`` and ``deflection_rates`` of meshes,
    and angles of shafts, by name; of a mesh 0 where the front flanks touch."""
    dimensions = {"deflections": (LENGTH, "z", model.units.length),
                  "deflection_rates": (VELOCITY, "z_dot", model.units.length * model.units.rate)}
    out = {}
    for key, values in table.items():
        if key not in dimensions:
            raise unknown_name("key of [initial]", key, dimensions)
        if not isinstance(values, Mapping):
            raise InputError(f"initial.{key}", "must be a table of values by mesh", values)
        dimension, suffix, unit = dimensions[key]
        names = {mesh.name: mesh for mesh in model.train.meshes}
        for name, value in values.items():
            if name not in names:
                raise unknown_name(f"initial.{key}: mesh", name, names)
            first = name == model.train.meshes[0].name
            coordinate = suffix if first else f"{parameter_owner(name)}.{suffix}"
            if coordinate not in model.state_names:
                raise InputError(f"initial.{key}.{name}", "must be left out for this mesh", value,
                                 "Its deflection follows from the others: it closes a loop.")
            shift = names[name].backlash / 2 if suffix == "z" else 0.0
            out[coordinate] = (to_si(f"initial.{key}.{name}", value, dimension) + shift) / unit
    return out
