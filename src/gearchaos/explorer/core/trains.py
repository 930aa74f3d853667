"""The values of a gear train that a page sets, and where its axes and sliders lie."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

from gearchaos.errors import InputError
from gearchaos.explorer.core.bounds import COARSER_TRAIN, LEAST_SPEED, SHARES, rounded, value_range
from gearchaos.gears.train.mesh import Mesh
from gearchaos.gears.train.model import TrainModel
from gearchaos.model import vary
from gearchaos.quantities import Range


@lru_cache(maxsize=256)
def varied_names(model: TrainModel) -> tuple[str, ...]:
    """The parameters that an axis can scan: the speed, the torques, then those of other parts.

    Left out are those with the value 0, around which no axis lies, and torques that must balance each other: ``torque``
    stands for these.
    """
    values = {"torque": model.train.torque, **model.parameters()}

    def can_vary(name: str) -> bool:
        try:
            vary(model, {name: [share * values[name] for share in SHARES]})
        except InputError:
            return False
        return values[name] != 0

    order = [lambda name: name == "speed", lambda name: name.endswith(".torque"), lambda name: name == "torque"]
    return tuple(sorted(filter(can_vary, values), key=lambda name: [not first(name) for first in order]))


def coarseness(model: TrainModel) -> int:
    """How many times fewer columns, and rows, the studies of a train have: a power of two.

    The time of a cell grows as the square of the number of coordinates, times the mesh cycles in the common period.
    """
    cycles = max(model.train.mesh_order(mesh) / model.train.base_order for mesh in model.train.meshes)
    wanted = 2 ** round(math.log2(len(model.state_names) * math.sqrt(cycles)))
    return min(max(wanted, COARSER_TRAIN[0]), COARSER_TRAIN[1])


def shown_mesh(model: TrainModel, name: str) -> Mesh:
    """The mesh whose motion a page draws: the one chosen, or the first where that is none."""
    return next((mesh for mesh in model.train.meshes if mesh.name == name), model.train.meshes[0])


def static_force(model: TrainModel, mesh: Mesh) -> float:
    """The dimensionless force of a mesh under the mean torques."""
    batch: Any = vary(model, {})
    return float(batch.assembly.static[0, model.mesh_names.index(mesh.name)] / model.units.force)


def range_around(model: TrainModel, name: str) -> Range:
    """The range of the slider and the axis of a value, around the one that the train has."""
    shares = (LEAST_SPEED, SHARES[1]) if name == "speed" else SHARES
    low, high = sorted(share * (model.value(name) or 0.0) for share in shares)
    return value_range(name)._replace(low=rounded(low, high - low), high=rounded(high, high - low))


def meaning(model: TrainModel, name: str) -> str:
    """What a value of the train as a whole means, in words; empty for those of parts."""
    return {"speed": f"Speed of {model.train.bodies[0].name}",
            "torque": "First mean torque, negative if it brakes; all others change in its ratio"}.get(name, "")
