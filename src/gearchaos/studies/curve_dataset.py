"""Curves of events in two parameters as Datasets, and the arguments that all studies of them share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gearchaos.continuation.branch import outside
from gearchaos.continuation.curve import CurveData
from gearchaos.continuation.family import ParameterFamily, as_initial_values
from gearchaos.datasets import variable
from gearchaos.errors import InputError
from gearchaos.model import MeshModel, state_names
from gearchaos.studies.axis import Axis
from gearchaos.studies.plane import check_plane

if TYPE_CHECKING:
    import xarray as xr


def parameter_plane(model: MeshModel, x: Axis, y: Axis) -> ParameterFamily:
    """The model along two axes; raises `InputError` unless these are two parameters that it has."""
    check_is_parameter(model, x, "x")
    check_is_parameter(model, y, "y")
    check_plane(model, x, y)
    return ParameterFamily(model, (x.name, y.name))


def check_is_parameter(model: MeshModel, axis: Axis, field: str = "axis") -> None:
    """Raise `InputError` for an axis that is an initial value."""
    if axis.name in state_names(model.kind):
        raise InputError(field, "must be a parameter", axis.name,
                         "An initial value only selects an orbit of the model: give it as start.")


def check_inside(family: ParameterFamily, *axes: Axis) -> None:
    """Raise `InputError` unless the model's own values of all parameters lie on their axes."""
    for axis, value in zip(axes, family.start, strict=True):
        error = outside(ParameterFamily(family.model, (axis.name,)), float(value), (axis.start, axis.stop))
        if error is not None:
            raise error


def point_variables(
    family: ParameterFamily, curves: Sequence[CurveData]
) -> tuple[dict[str, xr.Variable], dict[str, xr.Variable]]:
    """The variables over the points of curves, one curve after another, and the parameters as their coordinates.

    Parameters
    ----------
    family : ParameterFamily
        The model along both parameters.
    curves : sequence of CurveData
    """
    multipliers = _joined([c.multipliers for c in curves], (0, family.dimension))
    data = {
        **_sections(family, curves),
        "multipliers_real": variable("multipliers_real", ("point", "exponent"), multipliers.real),
        "multipliers_imag": variable("multipliers_imag", ("point", "exponent"), multipliers.imag),
        "residual": variable("residual", ("point",), _joined([c.residual for c in curves], (0,))),
    }
    angle = _joined([c.angle for c in curves], (0,))
    if np.any(np.isfinite(angle)):
        data["angle"] = variable("angle", ("point",), angle)
    values = _joined([c.values for c in curves], (0, 2))
    return data, {n: variable(n, ("point",), v) for n, v in zip(family.axes, values.T, strict=True)}


def special_variables(family: ParameterFamily, curves: Sequence[CurveData]) -> dict[str, xr.Variable]:
    """The variables over the points of codimension 2 of all curves."""
    found = [special for curve in curves for special in curve.special]
    values = np.array([v for _, v in found], float).reshape(-1, 2)
    kinds = np.array([kind for kind, _ in found], dtype=object)
    data = {"special_kind": variable("special_kind", ("special",), kinds)}
    for name, own in zip(family.axes, values.T, strict=True):
        data[f"special_{name}"] = variable(f"special_{name}", ("special",), own)
    return data


def ends_of(family: ParameterFamily, curve: CurveData) -> list[dict[str, Any]]:
    """The ends of a curve: both parameters by name, and why it ends there."""
    x, y = family.axes
    return [{x: float(end[0]), y: float(end[1]), "why": end[2]} for end in curve.ends]


def _sections(family: ParameterFamily, curves: Sequence[CurveData]) -> dict[str, xr.Variable]:
    """The stroboscopic points of all orbits by name, over point and cycle; NaN after the last one of an orbit."""
    longest = max((curve.period for curve in curves), default=1)
    parts: dict[str, list[np.ndarray]] = {}
    for curve in curves:
        for name, x in as_initial_values(family, curve.values, curve.points).items():
            padded = np.pad(x, ((0, 0), (0, longest - curve.period)), constant_values=np.nan)
            parts.setdefault(name, []).append(padded)
    return {
        f"section_{name}": variable(f"section_{name}", ("point", "cycle"), np.concatenate(part))
        for name, part in parts.items()
    }


def _joined(parts: Sequence[np.ndarray], empty: tuple[int, ...]) -> np.ndarray:
    """Arrays one after another; an array of the shape ``empty`` if there are none."""
    return np.concatenate(parts) if parts else np.zeros(empty)
