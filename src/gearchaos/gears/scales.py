"""Conversion of dimensionless quantities to the physical units of a gear pair, (2.8)-(2.11)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from gearchaos.errors import InputError
from gearchaos.quantities import find

Value = TypeVar("Value")


@dataclass(frozen=True)
class Scales(Generic[Value]):
    """SI value of one unit of each dimensionless quantity, (2.8)-(2.11): a float, or a DataArray over operating points.
    """

    length: Value  # half the backlash Δ, m
    time: Value  # 1/ω0, s
    velocity: Value  # Δ ω0
    force: Value  # c0 Δ
    stiffness: Value  # c0
    frequency: Value  # ω0/2π, Hz: the mesh frequency at omega = 1
    rate: Value  # ω0, 1/s, for Lyapunov exponents
    torque1: Value  # c0 R_n Δ, for the driving and the driven wheel
    torque2: Value


def unit_of(name: str, scales: Scales[Value]) -> tuple[Value, str] | None:
    """The value of one dimensionless unit of a quantity in its physical unit, and that unit.

    None if the name is not that of a quantity, or the quantity has no physical unit.
    """
    found = find(name)
    if found is None or found.physical is None:
        return None
    return getattr(scales, found.physical.scale) * found.physical.factor, found.physical.unit


def scaled(variables: Mapping[Any, Any], scales: Scales[Any]) -> dict[str, tuple[Any, Any, dict[str, Any]]]:
    """Dims, scaled values and attributes of those variables, DataArrays by name, that have a physical unit.

    A variable with values of several quantities, such as ``event_value``, has the name of its own one as the attribute
    ``quantity``.
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
    """Scale numbers, lists of numbers and nested mappings by name to physical units.

    Returns the scaled values, and the units by name. A value without physical unit stays as it is and has no entry
    among the units.
    """
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
