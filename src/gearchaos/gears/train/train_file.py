"""`Train` from the tables of a study file, and its initial values."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from gearchaos.errors import InputError, gather, unknown_name
from gearchaos.gears.io.fields import record_values
from gearchaos.gears.io.units import ANGLE, ANGULAR_VELOCITY, LENGTH, VELOCITY, to_si
from gearchaos.gears.train.mesh import Mesh
from gearchaos.gears.train.model import TrainModel
from gearchaos.gears.train.parts import Body, Shaft, read_part
from gearchaos.gears.train.planets import PlanetarySet
from gearchaos.gears.train.structure import structure
from gearchaos.gears.train.train import Train

_KINDS = {"bodies": Body, "shafts": Shaft, "meshes": Mesh}


def read_train(table: Mapping[str, Any], pair: Callable[[str], Any]) -> Train:
    """The train of a table ``[train]``; ``pair`` reads the gears at a path, for meshes with a ``design``.

    A table ``planets``, or a list of such, adds the bodies and meshes of planetary sets.
    """
    given = dict(table)
    planets = given.pop("planets", None)

    def read(name: str) -> None:
        found = given.get(name, [])
        if not isinstance(found, list):
            raise InputError(f"train.{name}", "must be a list of tables", found, f"Write [[train.{name}]].")
        given[name] = gather(partial(read_part, _KINDS[name], i, _with_design(part, pair))
                             for i, part in enumerate(found))

    gather(partial(read, name) for name in _KINDS if name in given or planets is not None)
    for each in planets if isinstance(planets, list) else [] if planets is None else [planets]:
        own, label = each, "planets"
        if isinstance(each, Mapping):
            own = {name: _with_design(part, pair) for name, part in _with_design(each, pair).items()}
            label = f"planets {each['name']}" if isinstance(each.get("name"), str) else label
        found = _in_words("train.planets", f"{label}: ", PlanetarySet, own)
        given["bodies"] += found.bodies
        given["meshes"] += found.meshes
    return _in_words("train", "train.", Train, given)


def _in_words(label: str, prefix: str, kind: type[Any], value: Any) -> Any:
    """A value from a table, with the prefix before the names of its keys in messages, but not before parts."""
    if not isinstance(value, Mapping):
        raise InputError(label, "must be a table", value, f"Write [{label}].")
    try:
        return record_values(kind, label, value)
    except InputError as error:
        rest = error.field.removeprefix(label).removeprefix(".")
        field = rest if " " in rest else f"{prefix}{rest}" if rest else label
        raise InputError(field, error.rule, error.value, error.advice) from None


def _with_design(part: Any, pair: Callable[[str], Any]) -> Any:
    """The table of a part, of one with a design with the gears at the path that it names."""
    if not (isinstance(part, Mapping) and isinstance(part.get("design"), str)):
        return part
    return {**part, "design": pair(part["design"])}


def initial_of(model: TrainModel, table: Mapping[str, Any]) -> dict[str, float]:
    """Dimensionless initial values by coordinate from a table ``[initial]``.

    It has ``deflections`` and ``deflection_rates`` by the names of meshes, a deflection 0 where the front flanks touch,
    and of shafts, the twist; or the coordinates themselves.
    """
    out = {name: value for name, value in table.items() if name in model.state_names}
    found = structure(model.train)
    elements = {element.name: element for element in [*found.springs, *found.contacts] if element.owner}
    length = model.units.length
    for key, values in table.items():
        if key in out:
            continue
        if key == "angles":
            raise InputError("initial.angles", "must be left out", values,
                             "The deflections of meshes and shafts say all: turning as a whole has no effect.")
        if key not in ("deflections", "deflection_rates"):
            raise unknown_name("key of [initial]", key, ("deflections", "deflection_rates", *model.state_names))
        if not isinstance(values, Mapping):
            raise InputError(f"initial.{key}", "must be a table of values by mesh and shaft", values)
        rate = key == "deflection_rates"
        for name, value in values.items():
            if name not in elements:
                raise unknown_name(f"initial.{key}: mesh or shaft", name, elements)
            element, field = elements[name], f"initial.{key}: {name}"
            if element not in found.chosen:
                raise InputError(field, "must be left out", value,
                                 "Its deflection follows from those of other meshes and shafts.")
            mesh = element.mesh is not None
            dimension = (VELOCITY if mesh else ANGULAR_VELOCITY) if rate else (LENGTH if mesh else ANGLE)
            number = to_si(field, value, dimension)
            out[found.coordinate(element)[rate]] = (number / (length * model.units.rate) if rate else
                                                    (number + (element.backlash / 2 if mesh else 0.0)) / length)
    return out
