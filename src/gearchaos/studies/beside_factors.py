"""What a dynamic factor is read with: where the mesh damping acts, and the quasi-static ratio."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from gearchaos.datasets import model_from_json
from gearchaos.gears.units import measured
from gearchaos.model import DAMPING_LAWS, MeshModel
from gearchaos.studies.speed_and_torque import quasi_static_ratio

if TYPE_CHECKING:
    import xarray as xr


def beside_factors(model: MeshModel, varied: Iterable[str] = ()) -> dict[str, str]:
    """Names and values to stand beside dynamic factors of a model of which quantities may be varied.

    The quasi-static ratio is left out where it is 1 or none, or something that it depends on is varied: a parameter of
    the stiffness, and of tooth pairs also the load.
    """
    found = {"mesh damping": DAMPING_LAWS[model.damping_law]}
    if model.kind == "train":
        return found
    load = ("q0", "q1", "q2", "torque") if model.stiffness.shared else ()
    if (model.q1 or model.q2) and not {*varied} & {*model.stiffness.parameter_names(), *load}:
        ratio = measured(quasi_static_ratio(model), 3)
        found |= {"quasi-static ratio": ratio} if ratio != "1" else {}
    return found


def words_beside(dataset: xr.Dataset, name: str) -> list[str]:
    """The same in words for a variable of a result; empty unless it is the dynamic factor."""
    if name != "dynamic_factor" or "model" not in dataset.attrs:
        return []
    found = beside_factors(model_from_json(dataset.attrs["model"]), map(str, dataset.variables))
    return [f"{each} {value}" for each, value in found.items()]
