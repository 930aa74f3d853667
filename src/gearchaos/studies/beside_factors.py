"""What response measures are read with: the mesh of a train; of a dynamic factor also where the mesh damping acts, and
the quasi-static ratio."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from gearchaos.datasets import model_from_json
from gearchaos.dynamics.response import MESH, Response
from gearchaos.model import DAMPING_LAWS, MeshModel
from gearchaos.studies.quasi_static import quasi_static_ratio, ratio_in_words

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
        ratio = ratio_in_words(quasi_static_ratio(model))
        found |= {"quasi-static ratio": ratio} if ratio else {}
    return found


def which_mesh() -> dict[str, str]:
    """Of which mesh the response measures are, as `Column.mesh` says."""
    return {column.variable or name: column.mesh for name, column in Response.declared().items()}


def words_beside(dataset: xr.Dataset, name: str) -> list[str]:
    """What a variable of a result is read with: of a train the mesh, and what stands beside dynamic factors."""
    words = []
    if MESH in dataset.coords and name in (of := which_mesh()):
        meshes = dataset[MESH].values
        words = [{"first": f"of {meshes.ravel()[0]}", "worst": "of the worst mesh", "all": "of all meshes"}[
            of[name] if meshes.ndim else "first"]]
    if name == "dynamic_factor" and "model" in dataset.attrs:
        found = beside_factors(model_from_json(dataset.attrs["model"]), map(str, dataset.variables))
        words += [f"{each} {value}" for each, value in found.items()]
    return words
