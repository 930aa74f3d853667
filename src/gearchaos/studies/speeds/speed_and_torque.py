"""Gears over speed and torque: the map of their motions, and the dynamic factor beside those of standards."""

from __future__ import annotations

import warnings
from dataclasses import replace
from itertools import groupby
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from gearchaos.datasets import variable, variables
from gearchaos.dynamics import Classification
from gearchaos.errors import DesignWarning, InputError
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.dynamic_factor import standards
from gearchaos.gears.dynamic_factor.main_resonance import MAIN_END, SUPERCRITICAL_START, resonance
from gearchaos.gears.io.units import RPM
from gearchaos.gears.operation.operating import AnyModel, OperatingModel, as_model
from gearchaos.gears.operation.results import physical
from gearchaos.model import MeshModel, vary
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.core.operating_ranges import operating_axis
from gearchaos.studies.maps.bifurcation import Bifurcation
from gearchaos.studies.maps.zones import Zones
from gearchaos.studies.operation.load_change import REVERSAL
from gearchaos.studies.operation.quasi_static import quasi_static_ratio

if TYPE_CHECKING:
    import xarray as xr


def operating_map(
    gears: AnyModel, speed: Axis | str, torque: Axis | str, *, starts: int = 1,
    load_change: float = REVERSAL.ratio, wide: bool = False, refine: int = 1,
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
    starts, load_change, wide, refine, settings, progress, threads
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
    study = Zones(gears, *axes, starts=starts, load_change=load_change, wide=wide,  # type: ignore[arg-type]  # become a model
                  refine=refine, settings=settings)
    dataset = study.run(progress=progress, threads=threads)
    return in_operating_units(dataset, checked_operating_model(study.model))


def checked_operating_model(model: MeshModel) -> OperatingModel:
    """A model of gears as such; raises `InputError` for a dimensionless one."""
    if not model.is_operated:
        raise InputError("gears", "must be a GearDesign or a GearPair, or the model of one",
                         f"a {type(model).__name__}",
                         "A dimensionless MeshModel has no speed or torque; gearchaos.zones maps it over omega and q0.")
    return model  # type: ignore[return-value]


def in_operating_units(dataset: xr.Dataset, model: OperatingModel) -> xr.Dataset:
    """A map over speed and torque in physical units, with its dimensionless coordinates; a train has none."""
    if model.mesh_names:
        return physical(dataset)
    speeds, torques = dataset["speed"].values, dataset["torque"].values
    torque, speed = (v.ravel() for v in np.meshgrid(torques, speeds, indexing="ij"))
    batch = vary(model, {"speed": speed, "torque": torque})
    omega, q1 = (np.reshape(batch[name], (len(torques), len(speeds))) for name in ("omega", "q1"))
    return physical(dataset).assign_coords({
        **variables(("torque", "speed"), {"omega": omega, "q0": q1[:, 0]}),
        **variables(("speed",), {"mesh_frequency": model.gears.to_pair().n1 * speeds / 60})})


def dynamic_factor(
    design: GearDesign, speed: Axis | str, torque: Any = None, *, mode: Literal["fixed", "up", "down"] = "fixed",
    settings: Classification | None = None, progress: bool = False, threads: int | None = None,
) -> xr.Dataset:
    """The peak of the mesh force over the static one along the speed, beside K_v by ISO 6336-1 and AGMA.

    Parameters
    ----------
    design : GearDesign
        The gear pair, with all that a model needs but the speed.
    speed : Axis or str
        Speeds of wheel 1 in rpm: "500:6000:200" (start, stop, count), or an `Axis` with the name "speed".
    torque : torque, optional
        At wheel 1, a number in N m or a text such as "300 N*m"; by default that of the design.
    mode : {"fixed", "up", "down"}
        As in `bifurcation`: every speed from rest, or a slow sweep of the speed.
    settings, progress, threads
        As in `zones`.

    Returns
    -------
    xarray.Dataset
        Over ``speed``, in the units of `physical`: ``dynamic_factor``, the largest mesh force of the motion over the
        static mesh force, and the other variables of `bifurcation` without points; K_v by each standard, such as
        ``Kv_ISO_B``, which is NaN where the standard gives no value, with the reasons in ``attrs["refused"]``;
        ``resonance_ratio``, N of ISO 6336-1:2006, 6.4.2, at the mean mesh stiffness by the method of the design, and
        ``resonance_ratio_ISO_B``, N at the standard's own stiffness c_γα, on which method B is based; both with the
        limits of the ranges N_S, 1.15 and 1.5 as attributes ``main_start``, ``main_end`` and ``supercritical_start``.
        ``quasi_static_ratio`` is the peak over the static force as the speed goes to 0, more than 1 where the mesh
        stiffness jumps. The torque is a scalar coordinate.

    Raises
    ------
    InputError
        If an input that the model needs is missing, the torque is 0, or an axis is wrong.

    Notes
    -----
    K_v multiplies F_t K_A, while the computed factor is over the force of the torque alone: they are comparable for an
    application factor of 1, and after division by the quasi-static ratio, since for K_v a load that changes without
    inertia has the factor 1. In method B running-in removes nothing, and all wheels count as solid discs.

    Examples
    --------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(
    ...     teeth=(50, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05,
    ...     backlash={"value": "0.12 mm", "of": "line of action, total"}, transmission_error="from quality",
    ...     quality={"standard": "ISO 1328-1:1995", "grade": 6})
    >>> found = gc.dynamic_factor(design, "1000:8000:20", "100 N*m")
    >>> found.dynamic_factor.dims
    ('speed',)
    """
    axis = operating_axis("speed", speed)
    at_start = with_torque(design, torque).at(speed=axis.start)
    model = as_model(at_start)
    study = Bifurcation(model, axis, points=0, mode=mode, settings=settings)
    beside = {**by_standards(at_start, axis.values), **variables((), {
        "quasi_static_ratio": np.array(quasi_static_ratio(model))})}
    return physical(study.run(progress=progress, threads=threads)).assign(beside).assign_coords(variables(("speed",), {
        "mesh_frequency": at_start.teeth[0] * axis.values / 60, "torque": np.array(at_start.torque),
    })).assign_attrs(study="dynamic_factor")


def with_torque(design: Any, torque: Any) -> GearDesign:
    """The design at a torque, its own for None, with teeth that are all alike, as standards have it; raises
    `InputError` for anything but a loaded design.
    """
    if not isinstance(design, GearDesign):
        raise InputError("design", "must be a GearDesign", f"a {type(design).__name__}",
                         "The standards need the drawing of the pair.")
    loaded = design if torque is None else replace(design, torque=torque)
    if loaded.torque is None:
        loaded.at(speed=1.0).to_pair()  # names all inputs that are missing
    if loaded.given("torque") == 0:
        raise InputError("torque", "must be greater than 0", loaded.torque,
                         "Without load there is no ratio of forces; gearchaos rattle looks at gears without load.")
    if loaded.turning:
        warnings.warn("Faults, pitch errors and eccentricity are left out here: standards and the speeds to avoid take "
                      "all teeth to be alike. Studies of motions take them as they are.", DesignWarning, stacklevel=1)
    return loaded.with_like_teeth()


def by_standards(design: GearDesign, speeds: np.ndarray) -> dict[str, xr.Variable]:
    """K_v by all standards over speeds (P,) in rpm, and the resonance ratios N.

    N is that at the mean mesh stiffness of the design, and that at the stiffness of ISO 6336-1. It is NaN with the
    reason where ISO 6336-1 gives no stiffness.
    """
    designs, out = [design.at(speed=speed) for speed in speeds.tolist()], {}
    for standard in standards():
        factors = [standard.factor(each) for each in designs]
        values = np.array([np.nan if factor.value is None else factor.value for factor in factors])
        out[standard.name] = variable(standard.name, ("speed",), values)
        out[standard.name].attrs["long_name"] = standard.long_name
        refused = zip(speeds, (factor.reason for factor in factors), strict=True)
        stretches = [list(same) for reason, same in groupby(refused, lambda pair: pair[1].split(";")[0]) if reason]
        if stretches:  # the reason at the first speed; after its semicolon stands the value there
            out[standard.name].attrs["refused"] = " ".join(
                f"{same[0][0]:g} to {same[-1][0]:g} rpm: {same[0][1]}" for same in stretches)
    width = design.geometry.common_face_width
    for name, stiffness in (("resonance_ratio", lambda: design.nominal_stiffness.reference / width),
                            ("resonance_ratio_ISO_B", lambda: design.tooth_stiffness.mesh_stiffness)):
        out[name] = variable(name, ("speed",), np.full(len(speeds), np.nan))
        try:
            found = resonance(design.teeth[0], stiffness(), design.equivalent_mass / width, design.load.line_load)
        except InputError as error:
            out[name].attrs["refused"] = str(error)
            continue
        out[name].values = speeds * RPM / found.resonance_speed
        out[name].attrs.update(
            main_start=found.lower_limit_ratio, main_end=MAIN_END, supercritical_start=SUPERCRITICAL_START)
    return out
