"""The map of the kinds of motion over the speeds and torques at which given gears run."""

from __future__ import annotations

import numbers
import re
from typing import TYPE_CHECKING

import numpy as np

from gearchaos.datasets import variable
from gearchaos.dynamics import Classification
from gearchaos.errors import InputError
from gearchaos.gears.operating import AnyModel, OperatingModel
from gearchaos.gears.results import physical
from gearchaos.model import MeshModel, vary
from gearchaos.studies.axis import Axis, as_axis, axis_example
from gearchaos.studies.zones import Zones

if TYPE_CHECKING:
    import xarray as xr


def operating_map(
    gears: AnyModel, speed: Axis | str, torque: Axis | str, *, starts: int = 1, refine: int = 1,
    settings: Classification | None = None, progress: bool = False, threads: int | None = None,
) -> xr.Dataset:
    """A map of the kinds of motion over speed and torque, in physical units.

    Every cell is a model of its own: the torque also changes what follows from it, such as a mesh stiffness by the rule
    for low loads.

    Parameters
    ----------
    gears : GearDesign or GearPair, or the model of one
        A design needs no speed and torque of its own.
    speed : Axis or str
        Speeds of wheel 1: "500:4500:200" (start, stop, count) in rpm, "500 rpm:4500 rpm:200", or an `Axis` with the
        name "speed".
    torque : Axis or str
        Torques at wheel 1, plain numbers in N m, likewise.
    starts, refine, settings, progress, threads
        As in `zones`.

    Returns
    -------
    xarray.Dataset
        The variables of `zones` over (torque, speed), in the units of `physical`. The coordinates ``omega`` and
        ``q0`` have the dimensionless mesh frequency and torque of wheel 1, the coordinate ``mesh_frequency`` the mesh
        frequency in Hz.

    Raises
    ------
    InputError
        If the gears are not known, as for a `MeshModel` made of dimensionless values, or an axis is wrong.

    Examples
    --------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(
    ...     teeth=(50, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05,
    ...     backlash={"value": "0.12 mm", "of": "line of action, total"}, transmission_error="from quality",
    ...     quality={"standard": "ISO 1328-1:1995", "grade": 6})
    >>> found = gc.operating_map(design, speed="1000:6000:6", torque="50:200:4")
    >>> found.label.dims, found.v_rms.attrs["units"]
    (('torque', 'speed'), 'mm/s')
    """
    axes = operating_axis("speed", speed), operating_axis("torque", torque)
    if isinstance(gears, MeshModel):
        checked_operating_model(gears)
    study = Zones(gears, *axes, starts=starts, refine=refine, settings=settings)  # type: ignore[arg-type]  # gears become a model
    dataset = study.run(progress=progress, threads=threads)
    return in_operating_units(dataset, checked_operating_model(study.model))


def checked_operating_model(model: MeshModel) -> OperatingModel:
    """A model of gears as such; raises `InputError` for a dimensionless one."""
    if not isinstance(model, OperatingModel):
        raise InputError("gears", "must be a GearDesign or a GearPair, or the model of one",
                         f"a {type(model).__name__}",
                         "A dimensionless MeshModel has no speed or torque; gearchaos.zones maps it over omega and q0.")
    return model


def in_operating_units(dataset: xr.Dataset, model: OperatingModel) -> xr.Dataset:
    """A map over speed and torque in physical units, with its dimensionless coordinates."""
    speeds, torques = dataset["speed"].values, dataset["torque"].values
    torque, speed = (v.ravel() for v in np.meshgrid(torques, speeds, indexing="ij"))
    batch, shape = vary(model, {"speed": speed, "torque": torque}), (len(torques), len(speeds))
    omega, q1 = (np.reshape(batch[name], shape) for name in ("omega", "q1"))
    beside = {
        "omega": variable("omega", ("torque", "speed"), omega), "q0": variable("q0", ("torque",), q1[:, 0]),
        "mesh_frequency": variable("mesh_frequency", ("speed",), model.gears.to_pair().n1 * speeds / 60),
    }
    return physical(dataset).assign_coords(beside)


def operating_axis(name: str, given: Axis | str, field: str = "") -> Axis:
    """The axis of a speed or torque; a text may leave out the name. ``field`` is its name in error messages."""
    field, example = field or name, axis_example(name).partition("=")[2]
    advice = f"E.g. {example}."
    if not isinstance(given, (str, Axis)):
        arguments, real = ", ".join(example.split(":")), isinstance(given, numbers.Real)
        value = f"{given:g}" if real else example.partition(":")[0]
        raise InputError(field, "must be an Axis or a text", given if real else f"a {type(given).__name__}",
                         f"E.g. '{example}' or Axis('{name}', {arguments}); one value alone is "
                         f"'{value}:{value}:1'.")
    if isinstance(given, str) and "=" not in given:
        if not re.fullmatch(r"[^:]*:[^:]*:[^:]*", given):
            raise InputError(field, "must read start:stop:count", given, advice)
        given = f"{name}={given}"
    axis = as_axis(given, field)
    if axis.name != name:
        raise InputError(field, f"must be an axis of {name}", axis.name, advice)
    return axis
