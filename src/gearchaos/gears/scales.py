"""What one unit of each dimensionless quantity is in the units of a pair, (2.8)-(2.11), and variables scaled by it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gearchaos.errors import InputError
from gearchaos.quantities import find


@dataclass(frozen=True)
class Scales:
    """What one unit of each dimensionless quantity is in SI, (2.8)-(2.11).

    Attributes
    ----------
    length : float
        Half the backlash Δ, m.
    time : float
        1/ω0, s.
    velocity : float
        Δ ω0, m/s.
    force : float
        c0 Δ, N.
    stiffness : float
        c0, N/m.
    frequency : float
        ω0/2π, Hz: the mesh frequency where omega = 1.
    rate : float
        ω0, 1/s: Lyapunov exponents.
    torque1, torque2 : float
        c0 R_n Δ, N m, of the driving and of the driven wheel.
    """

    length: float
    time: float
    velocity: float
    force: float
    stiffness: float
    frequency: float
    rate: float
    torque1: float
    torque2: float


def unit_of(name: str, scales: Scales) -> tuple[float, str] | None:
    """What one unit of a dimensionless quantity is in its physical unit, and that unit.

    None if the quantity has no physical unit, or there is none of this name.
    """
    found = find(name)
    if found is None or found.physical is None:
        return None
    return getattr(scales, found.physical.scale) * found.physical.factor, found.physical.unit


def scaled(variables: Mapping[Any, Any], scales: Scales) -> dict[str, tuple[Any, Any, dict[str, Any]]]:
    """Dims, values and attrs of those variables that have a physical unit, in that unit."""
    units = {str(name): unit_of(str(name), scales) for name in variables}
    return {name: _scaled(name, variables[name], *unit) for name, unit in units.items() if unit}


def scaled_numbers(values: Mapping[str, Any], scales: Scales) -> tuple[dict[str, Any], dict[str, Any]]:
    """Numbers by name, and lists and tables of them, in physical units where they have one; and those units by name."""
    out, units = dict(values), dict[str, Any]()
    for name, value in values.items():
        if isinstance(value, Mapping):
            out[name], units[name] = scaled_numbers(value, scales)
        elif unit := unit_of(name, scales):
            out[name], units[name] = _times(unit[0], value), unit[1]
    return out, units


def _times(factor: float, value: Any) -> Any:
    if isinstance(value, list):
        return [_times(factor, v) for v in value]
    return None if value is None else factor * value


def _scaled(name: str, variable: Any, factor: float, symbol: str) -> tuple[Any, Any, dict[str, Any]]:
    if variable.dtype.kind not in "biuf":
        raise InputError("dataset", f"must hold real numbers in {name}", f"type {variable.dtype}", "Compute it again.")
    attrs = {**variable.attrs, "units": symbol}
    found = find(name)
    if found is not None and found.physical is not None and found.physical.long_name:
        attrs["long_name"] = found.physical.long_name
    return variable.dims, variable.values * factor, attrs
