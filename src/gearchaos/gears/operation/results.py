"""Results of studies in the physical units of a gear pair."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import fields
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from gearchaos.errors import InputError
from gearchaos.gears.mesh.pair import GearPair, Scales, Value
from gearchaos.gears.operation.operating import Gears, gears_from_json, gears_json, is_design, is_train, pair_of
from gearchaos.quantities import find

if TYPE_CHECKING:
    import xarray as xr


def physical(dataset: xr.Dataset, pair: Gears | None = None) -> xr.Dataset:
    """A result of a study in physical units: µm, mm/s, N, ms, and Hz of mesh frequency.

    Parameters
    ----------
    dataset : Dataset
        The result of a study of the gears.
    pair : GearPair or GearDesign, optional
        The gears whose scales apply; may be left out for a study of gears, whose result carries them.

    Returns
    -------
    Dataset
        The same dims and names, with scaled values and their ``units``; x_n is the arc length R_n φ_n. Labels, shares,
        ratios and ``attrs["model"]`` stay as they are. ``attrs["pair"]`` holds the pair as JSON. A result that is in
        physical units already is returned unchanged.

    Raises
    ------
    InputError
        If there are no gears, they are not those of the result, or an argument has another type.

    Examples
    --------
    >>> import gearchaos as gc
    >>> pair = gc.GearPair(n1=25, n2=50, I1=5e-4, I2=8e-3, R1="35 mm", R2="70 mm", c0="400 N/um", k="500 N*s/m",
    ...                    backlash="0.12 mm", M10="85 N*m", speed="14000 rpm", error_amplitudes=["6 um"])
    >>> motion = gc.physical(gc.simulate(pair, periods=3))
    >>> motion.section_z.attrs["units"]
    'µm'
    """
    if is_physical(dataset) and pair is None:
        return dataset
    gears = _checked_gears(dataset, pair)
    if is_physical(dataset):
        return dataset
    out = dataset.assign_attrs(pair=gears_json(pair_of(gears)))
    # of a branch what is over its points, events and jumps, each with its torques; of curves likewise
    if "special_kind" in dataset:
        special = dataset.drop_dims("point")
        parts = [dataset.drop_dims("special"), special.assign_coords(
            {name: special[f"special_{name}"] for name in dataset.coords})]
    else:
        dims = [dim for dim in ("event", "jump") if f"{dim}_value" in dataset]
        parts = [dataset.drop_dims(dims) if dims else dataset]
        for dim in dims:
            alone = dataset.drop_dims([d for d in (*dims, "point") if d != dim])
            parts.append(alone.assign_coords({dataset["event_value"].attrs.get("quantity"): alone[f"{dim}_value"]}))
    for part in parts:
        scales = _scales(part, gears)
        own = {name: array for name, array in part.coords.items() if array.dims == dataset[name].dims}
        out = out.assign_coords(scaled(own, scales)).assign(scaled(part.data_vars, scales))
    found: dict[str, str] = {}  # the attributes of a branch or of curves that hold values of their parameters
    if "event_value" in dataset:
        unit = unit_of(dataset["event_value"].attrs.get("quantity", ""), pair_of(gears).scales)
        for name in ("range", "ends", "stable", "neutral", "cascade", "asymmetric"):
            if name in dataset.attrs and unit is not None:
                found[name] = json.dumps(times(unit[0], json.loads(dataset.attrs[name])))
    if "special_kind" in dataset:
        found["ends"] = json.dumps([scaled_numbers(end, pair_of(gears, end.get("torque")).scales)[0]
                                    for end in json.loads(dataset.attrs["ends"])])
    return out.assign_attrs(found)


def _scales(dataset: xr.Dataset, gears: Gears) -> Scales[Any]:
    """The scales of a result: numbers, or arrays along the coordinate ``torque`` if they depend on it."""
    if "torque" not in dataset.coords:
        torques = json.loads(dataset.attrs.get("settings", "{}")).get("torque_range", ())
        if torques and any(pair_of(gears, value).scales != pair_of(gears).scales for value in torques):
            raise InputError("dataset", "must have the coordinate torque", sorted(map(str, dataset.coords)),
                             "The reference stiffness of the gears depends on the torque, and with it the units. Keep "
                             "the coordinate, as isel(torque=2) does, or scale the result before you select or "
                             "average.")
        return pair_of(gears).scales
    torque = dataset["torque"]
    if torque.size == 0:  # no events, or no points of codimension 2: nothing to scale
        return pair_of(gears).scales
    found = [pair_of(gears, value).scales for value in torque.values.ravel().tolist()]
    if all(scales == found[0] for scales in found):
        return found[0]
    names, kind = [f.name for f in fields(Scales)], cast(Any, type(found[0]))
    return kind(**{n: torque.copy(data=np.reshape([getattr(s, n) for s in found], torque.shape)) for n in names})


def _checked_gears(dataset: Any, pair: Any) -> Gears:
    """The gears of the Dataset, or those given; raises `InputError` if both differ, or there are none."""
    if not hasattr(dataset, "data_vars"):
        advice = "Write physical(dataset, pair). Numbers of a verdict times those of pair.scales are in SI."
        raise InputError("dataset", "must be an xarray.Dataset", f"a {type(dataset).__name__}", advice)
    carried = gears_from_json(dataset.attrs["gears"]) if "gears" in dataset.attrs else None
    pair = carried if pair is None else pair
    if not (isinstance(pair, GearPair) or is_design(pair) or is_train(pair)):
        raise InputError("pair", "must be a GearPair, a GearDesign or a Train", f"a {type(pair).__name__}",
                         "A MeshModel alone has no units.")
    if carried is None and is_physical(dataset) and gears_json(pair_of(pair)) != dataset.attrs["pair"]:
        raise InputError("pair", "must be the gears of the result", f"a {type(pair).__name__}",
                         "The result is in the units of other gears.")
    if carried is None:
        return pair  # type: ignore[return-value]
    speed = carried.speed if is_train(carried) else 1.0  # a train may have torques for some speeds alone
    one, other = ({"speed": speed}, {"speed": speed, "torque": 1.0})  # they are the same at one of these
    try:
        same = carried.at(**one) == pair.at(**one) or carried.at(**other) == pair.at(**other)
    except InputError:  # a speed or torque that one of them cannot have
        same = False
    if not same:
        raise InputError("pair", "must be the gears of the result", f"a {type(pair).__name__}",
                         "The result of a study of gears carries them: physical(dataset) uses them.")
    return carried  # type: ignore[no-any-return]


def is_physical(dataset: Any) -> bool:
    return "pair" in getattr(dataset, "attrs", {})


def unit_in(dataset: xr.Dataset, name: str) -> float:
    """One dimensionless unit of a variable in the units of a Dataset: 1 unless `physical` has scaled the Dataset."""
    if not is_physical(dataset):
        return 1.0
    try:
        pair = gears_from_json(dataset.attrs["pair"])
    except InputError as error:
        raise InputError("dataset", "must carry its gear pair as JSON in attrs['pair']", dataset.attrs["pair"],
                         f"gearchaos.physical writes it: scale the dimensionless result again. ({error})") from error
    unit = unit_of(name, pair.scales)
    return 1.0 if unit is None else unit[0]


def unit_of(name: str, scales: Scales[Value]) -> tuple[Value, str] | None:
    """The value of one dimensionless unit of a quantity in its physical unit, and that unit; None for what has none."""
    found = find(name)
    if found is None or found.physical is None:
        return None
    unit = found.physical.unit
    return getattr(scales, found.physical.scale) * found.physical.factor, (
        _ANGULAR.get(unit, unit) if scales.angular else unit)


_ANGULAR = {"µm": "µrad", "mm/s": "mrad/s", "N": "N*m"}
"""Units of angles and torques in place of those of deflections and forces of meshes."""


def scaled(variables: Mapping[Any, Any], scales: Scales[Any]) -> dict[str, tuple[Any, Any, dict[str, Any]]]:
    """Dims, scaled values and attributes of those variables, DataArrays by name, that have a physical unit; one with
    values of several quantities, such as ``event_value``, names its own one in the attribute ``quantity``.
    """
    out = {}
    for name, variable in variables.items():
        quantity = variable.attrs.get("quantity", str(name))
        if not (unit := unit_of(quantity, scales)):
            continue
        factor: Any = unit[0]
        if variable.dtype.kind not in "biuf":
            raise InputError("dataset", f"must hold real numbers in {quantity}", f"type {variable.dtype}",
                             "Compute it again.")
        attrs = {**variable.attrs, "units": unit[1]}
        found = find(quantity)
        if found is not None and found.physical is not None and found.physical.long_name:
            attrs["long_name"] = found.physical.long_name
        if isinstance(factor, float):
            values = variable.values * factor
        elif set(factor.dims) <= set(variable.dims):
            values = (variable * factor).transpose(*variable.dims).values.astype(variable.dtype)
        else:
            raise InputError("dataset", f"must be over speed instead of {quantity} where the torque changes its unit",
                             quantity, "The reference stiffness depends on the torque.")
        out[str(name)] = variable.dims, values, attrs
    return out


def scaled_numbers(values: Mapping[str, Any], scales: Scales[Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Numbers, lists of numbers and nested mappings in physical units, and these, by name, of those with one."""
    out, units = dict(values), dict[str, Any]()
    for name, value in values.items():
        if isinstance(value, Mapping):
            out[name], units[name] = scaled_numbers(value, scales)
        elif unit := unit_of(name, scales):
            out[name], units[name] = times(unit[0], value), unit[1]
    return out, units


def times(factor: float, value: Any) -> Any:
    """A value of JSON with all its numbers that are not integers times a factor."""
    if isinstance(value, dict):
        return {key: times(factor, item) for key, item in value.items()}
    if isinstance(value, list):
        return [times(factor, item) for item in value]
    return value * factor if isinstance(value, float) else value
