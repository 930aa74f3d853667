"""What one unit of each dimensionless quantity is in the units of a pair, (2.8)-(2.11), and variables scaled by it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from gearchaos.errors import InputError


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


# name of a variable or axis -> (scale of `Scales`, factor to the unit shown, the unit)
_Unit = tuple[str, float, str]
_LENGTH: _Unit = ("length", 1e6, "µm")
_VELOCITY: _Unit = ("velocity", 1e3, "mm/s")
_UNITS: tuple[tuple[str, _Unit], ...] = (
    (r"(z|[xy][12])_dot|z_dot_(rms|peak_to_peak)|v_rms(_least|_most|_up|_down)?", _VELOCITY),
    (r"z|[xy][12]|z_(rms|peak_to_peak)|eps\d+", _LENGTH),
    (r"mesh_force(_peak)?", ("force", 1.0, "N")),
    (r"tau(_section)?", ("time", 1e3, "ms")),
    (r"omega", ("frequency", 1.0, "Hz")),
    (r"lyapunov(_lo|_hi|_ci)?|trace_error", ("rate", 1.0, "1/s")),
    (r"kappa[12]?", ("stiffness", 1.0, "N/m")),
    (r"q[01]", ("torque1", 1.0, "N*m")),
    (r"q2", ("torque2", 1.0, "N*m")),
)
_PREFIX = re.compile(r"^(attractor_)?(section_)?|^start_")
_MEANING = {
    "omega": "mesh frequency", "q0": "driving torque", "q1": "driving torque", "q2": "resisting torque",
}


def unit_of(name: str, scales: Scales) -> tuple[float, str] | None:
    """What 1 is, of a dimensionless variable or axis, in its physical unit, and that unit; None for a plain number."""
    plain = _PREFIX.sub("", name)
    found = next((unit for pattern, unit in _UNITS if re.fullmatch(pattern, plain)), None)
    if found is None:
        return None
    scale, factor, symbol = found
    return getattr(scales, scale) * factor, symbol


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
    if name in _MEANING:
        attrs["long_name"] = _MEANING[name]
    return variable.dims, variable.values * factor, attrs
