"""What response measures are read with: the mesh of a train; of a dynamic factor also where the mesh damping acts, the
quasi-static ratio, and the root stress at the peak of the force."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from gearchaos.datasets import model_from_json
from gearchaos.dynamics.response import MESH, Response
from gearchaos.errors import InputError
from gearchaos.gears.geometry.root_stress import ROOT_STRESS, root_stress
from gearchaos.gears.io.units import measured
from gearchaos.gears.operation.operating import gears_from_json, gears_of, is_design
from gearchaos.model import MeshModel
from gearchaos.studies.operation.quasi_static import quasi_static_ratio, ratio_in_words

if TYPE_CHECKING:
    import xarray as xr


def peak_root_stress(gears: Any, torque: float | None, factor: float | None) -> list[float] | None:
    """The nominal root stress of both wheels of a design, N/mm², times a dynamic factor, at a torque at wheel 1, N m;
    of an internal pair that of the pinion alone.

    It is that of the whole mesh force at the peak of a motion, also where tooth pairs share it. None for other gears,
    without torque or factor, and where the standard has no stress.
    """
    if torque is None or factor is None or not math.isfinite(factor) or not is_design(gears):
        return None
    with suppress(InputError):
        return [factor * ROOT_STRESS.factor * each for each in root_stress(gears.geometry, torque)]
    return None


def root_in_words(gears: Any, torque: float | None, factor: float | None) -> str:
    """The larger of both root stresses, to stand behind a dynamic factor: " (root 92 N/mm²)"; empty without one."""
    found = peak_root_stress(gears, torque, factor)
    return "" if found is None else f" (root {measured(max(found), 3)} {ROOT_STRESS.unit})"


def root_in_result(dataset: xr.Dataset, factor: float, at: Mapping[str, Any]) -> str:
    """The same of a result in which a dynamic factor is at these coordinates; empty where a load has no torque."""
    gears = gears_from_json(dataset.attrs["gears"]) if "gears" in dataset.attrs else None
    if not is_design(gears) or {"q0", "q1", "q2"} & {*at}:
        return ""
    own = dataset["torque"].sel(at).item() if "torque" in dataset.data_vars else gears.torque
    return root_in_words(gears, at.get("torque", own), factor)


def root_of_model(model: MeshModel, factor: float) -> list[float] | None:
    """The same as `peak_root_stress` of a model of gears at its operating point."""
    gears = gears_of(model)
    return None if gears is None else peak_root_stress(gears, model.value("torque"), factor)


def beside_factors(model: MeshModel, varied: Iterable[str] = (), factor: float | None = None) -> dict[str, str]:
    """Names and values to stand beside dynamic factors of a model of which quantities may be varied, or beside one.

    The root stress is that at this one, of the whole mesh force. The quasi-static ratio is left out where it is 1 or
    none, or something that it depends on is varied: a parameter of the stiffness, and of tooth pairs also the load.
    """
    found = {"mesh damping": model.damping_in_words}
    if model.mesh_names:
        return found
    load = ("q0", "q1", "q2", "torque") if model.stiffness.shared else ()
    if (model.q1 or model.q2) and not {*varied} & {*model.stiffness.parameter_names(), *load}:
        ratio = ratio_in_words(quasi_static_ratio(model))
        found |= {"quasi-static ratio": ratio} if ratio else {}
    if factor is not None and (stress := root_of_model(model, factor)):
        found["root stress"] = f"{measured(max(stress), 3)} {ROOT_STRESS.unit}, whole force"
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
