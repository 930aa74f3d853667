"""Models of given gears: the values that a page sets by their physical units, and what follows from them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from gearchaos.errors import InputError
from gearchaos.explorer.view.bounds import MAP_CELLS, in_range, rounded, value_range
from gearchaos.explorer.view.models import as_kind
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.operating import Gears, OperatingModel, operating_model, pair_of
from gearchaos.gears.pair import GearPair
from gearchaos.gears.transmission_error.quality import Quality, editions
from gearchaos.gears.units import RPM
from gearchaos.model import MeshModel, has_effect, state_names
from gearchaos.quantities import Range
from gearchaos.studies.axis import Axis

GEAR_VALUES = ("speed", "torque", "backlash", "grade", "zeta")
"""The values of gears that a page sets, in rpm, N m and µm; the grade and ζ have no unit."""

_FROM_QUALITY = "from quality"
_UM = 1e-6

_DIMENSIONLESS = {"speed": ("omega",), "torque": ("q0", "q1")}
"""Parameters of which one stands for a speed or torque on an axis."""

_SHARES = (0.1, 2.5)
"""Ends of the axes that a page shows first, relative to the speed and the torque at which the gears operate."""

_TOLERANCE = 1e-12
"""Relative rounding error allowed for the conversion of a value to SI units and back."""


def gears_of(model: MeshModel) -> Gears | None:
    """The gears of a model; None if it is dimensionless."""
    return model.gears if isinstance(model, OperatingModel) else None


def own_kind(gears: Gears) -> str:
    """The kind of model of gears: full with elastic supports, otherwise torsional."""
    return "torsional" if pair_of(gears).rigid else "full"


@lru_cache(maxsize=256)
def own_model(gears: Gears, kind: str) -> OperatingModel:
    """The model of gears as one of `KINDS`, with all parameters those of the gears as far as this kind has them."""
    try:
        return operating_model(gears, kind)
    except InputError:  # elastic supports that the gears do not have, or bearing friction that this kind does not have
        return as_kind(operating_model(gears), kind)


def gear_values(model: OperatingModel) -> dict[str, float]:
    """The values among `GEAR_VALUES` that the gears of a model have, in the units of the page.

    Speed and torque are those of the model, which may have been set as ``omega`` and ``q1``.
    """
    gears, pair, own = model.gears, pair_of(model.gears), own_model(model.gears, model.kind)
    speed = pair.speed if model.omega == own.omega else model.omega * pair.omega0 / pair.n1 / RPM
    torque = pair.M10 if model.q1 == own.q1 else model.q1 * pair.scales.torque1
    values = {"speed": _digits(speed), "torque": _digits(torque), "backlash": _digits(pair.backlash / _UM)}
    if (quality := _quality(gears)) is not None:
        values["grade"] = float(quality.coarsest)
    return {**values, "zeta": _damping(gears) if model.zeta == own.zeta else model.zeta}


def _digits(value: float) -> float:
    """A value without the rounding error of its conversion from SI units."""
    return float(f"{value:.14g}")


def _quality(gears: Gears) -> Quality | None:
    """The accuracy grade, if the transmission error of the gears follows from it."""
    return gears.quality if isinstance(gears, GearDesign) and gears.transmission_error == _FROM_QUALITY else None


def _damping(gears: Gears) -> float:
    """The mesh damping ratio ζ."""
    if isinstance(gears, GearDesign):
        return gears.given("damping_ratio")
    pair = pair_of(gears)
    return _digits(pair.k / (2 * pair.mass * pair.omega0))


def with_gear_value(gears: Gears, name: str, value: float) -> Gears:
    """The gears with one of `GEAR_VALUES` replaced; the same gears if they have that value already.

    Raises
    ------
    InputError
        If the gears have no such value, or do not accept it.
    """
    own = gear_values(own_model(gears, own_kind(gears)))
    if name not in own:
        raise InputError(name, "must be a value of the gears loaded", value, f"They have {', '.join(own)}.")
    if value == own[name]:
        return gears
    return gears.at(**{name: value}) if name in _DIMENSIONLESS else _replaced(gears, name, value)


def _replaced(gears: Any, name: str, value: float) -> Gears:
    """The gears with another backlash in µm, grade or damping ratio."""
    if isinstance(gears, GearPair):
        if name == "backlash":
            return replace(gears, backlash=value * _UM)
        return replace(gears, k=2 * value * gears.mass * gears.omega0)
    if name == "backlash":
        return replace(gears, backlash={"value": value * _UM, "of": "line of action, total"})
    if name == "grade":
        grade: Any = int(value) if value == int(value) else value
        return replace(gears, quality=replace(gears.quality, grade=grade))
    return replace(gears, damping_ratio=value)


def with_new_gears(model: OperatingModel, gears: Gears, kind: str | None = None) -> OperatingModel:
    """The model of other gears, with those values of ``model`` that were set apart from its gears.

    A value that the change of the gears determines anew is that of the new gears.
    """
    old, new = own_model(model.gears, model.kind), own_model(gears, kind or model.kind)
    if _other_stiffness(model, old):
        new = replace(new, stiffness=model.stiffness)
    before, after = old.parameters(), new.parameters()
    kept = {
        n: v for n, v in model.parameters().items()
        if v != before.get(n) and before.get(n) == after.get(n) and has_effect(n, new.kind)
    }
    kept |= {n: v for n, v in model.initial.items() if n in state_names(new.kind)}
    return new.with_values(kept) if kept else new


def _other_stiffness(model: MeshModel, own: MeshModel) -> bool:
    """Whether the mesh stiffness of a model is of another kind than its gears', or has other steps."""
    return model.stiffness.kind != own.stiffness.kind or model.stiffness.unnamed() != own.stiffness.unnamed()


def changes(model: OperatingModel) -> dict[str, Any]:
    """What was set apart from the gears of a model, by name: parameters, and the stiffness if it is of another kind."""
    own = own_model(model.gears, model.kind)
    out: dict[str, Any] = {}
    if _other_stiffness(model, own):
        out["stiffness"] = model.stiffness
        own = replace(own, stiffness=model.stiffness)
    before = own.parameters()
    return out | {n: v for n, v in model.parameters().items() if v != before.get(n, 0.0) and has_effect(n, model.kind)}


def settled(model: OperatingModel) -> OperatingModel:
    """The model with speed, torque and damping of its gears as its ω, q1 and ζ say.

    The same model if there are no such gears: where the stiffness depends on the torque, or the torques of the wheels
    are not in the ratio of the gears.
    """
    own = own_model(model.gears, model.kind)
    names = ("omega", "q1", "q2", "zeta")
    if all(getattr(model, n) == getattr(own, n) for n in names):
        return model
    gears, wanted = model.gears, gear_values(model)
    for name in ("speed", "torque", "zeta"):
        gears = with_gear_value(gears, name, wanted[name])
    new = own_model(gears, model.kind)
    if not all(math.isclose(getattr(model, n), getattr(new, n), rel_tol=_TOLERANCE) for n in names):
        return model
    same = replace(model, **{n: getattr(own, n) for n in names})
    return with_new_gears(same, gears)


def at_on_axis(model: OperatingModel, axis: str, name: str, value: float) -> float | None:
    """The value on an axis of ``omega``, ``q0`` or ``q1`` that stands for a speed or torque; None on other axes."""
    if axis not in _DIMENSIONLESS.get(name, ()):
        return None
    pair = pair_of(model.gears)
    return value * RPM * pair.n1 / pair.omega0 if name == "speed" else value / pair.scales.torque1


def operating_axes(gears: Gears) -> tuple[Axis, Axis]:
    """The axes of speed and torque that a page shows first."""
    pair = pair_of(gears)
    speed, torque = pair.speed, pair.M10
    low, high = sorted(share * torque for share in _SHARES) if torque else (0.0, 0.3 * pair.scales.torque1)
    omega = value_range("omega")  # at all torques; the resonance rises with the torque
    least = 1.01 * omega.least * _resonance_speed(pair_of(gears, high))
    most = 0.99 * omega.most * _resonance_speed(pair_of(gears, low or high))
    first, last = max(_SHARES[0] * speed, least), min(_SHARES[1] * speed, max(most, speed))
    return (_rounded_axis("speed", min(first, 0.9 * last), last, MAP_CELLS[0]),
            _rounded_axis("torque", low, high, MAP_CELLS[1]))


def _rounded_axis(name: str, start: float, stop: float, count: int) -> Axis:
    """An axis whose ends have few digits."""
    width = stop - start
    return Axis(name, rounded(start, width) or start, rounded(stop, width), count)


def as_operating_axis(gears: Gears, axis: Axis) -> Axis:
    """An axis of ``omega`` or ``q0`` as that of the speed or torque; any other axis as it is."""
    for dimensionless, operating, unit in _axis_units(gears):
        if axis.name == dimensionless:
            return Axis(operating, _digits(axis.start * unit), _digits(axis.stop * unit), axis.count)
    return axis


def as_dimensionless_axis(gears: Gears, axis: Axis) -> Axis:
    """The inverse of `as_operating_axis`."""
    for dimensionless, operating, unit in _axis_units(gears):
        if axis.name == operating:
            return Axis(dimensionless, axis.start / unit, axis.stop / unit, axis.count)
    return axis


def _axis_units(gears: Gears) -> tuple[tuple[str, str, float], ...]:
    """A dimensionless parameter, the operating value that belongs to it, and one unit of it in rpm or N m."""
    pair = pair_of(gears)
    return ("omega", "speed", _resonance_speed(pair)), ("q0", "torque", pair.scales.torque1)


def _resonance_speed(pair: GearPair) -> float:
    """The speed of wheel 1 in rpm at which ω = 1."""
    return pair.omega0 / pair.n1 / RPM


def slider_range(gears: Gears | None, name: str) -> Range:
    """The range of the slider of a value: that of its axis for speed and torque, of the edition for a grade."""
    found = value_range(name)
    if gears is None:
        return found
    for axis in operating_axes(gears):
        if axis.name == name:
            return found._replace(low=axis.start, high=axis.stop)
    quality = _quality(gears)
    if name == "grade" and quality is not None:
        low, high = editions()[quality.standard].grades
        return found._replace(low=low, high=high)
    return found


def limits(model: MeshModel, name: str) -> tuple[float, float]:
    """The least and the largest value that a page accepts for a parameter; of a speed those within the range of ω."""
    found = value_range(name)
    if isinstance(model, OperatingModel) and name == "speed":
        unit, omega = _resonance_speed(pair_of(model.gears)), value_range("omega")
        return max(found.least, omega.least * unit), min(found.most, omega.most * unit)
    if isinstance(model, OperatingModel) and name == "torque" and isinstance(model.gears, GearDesign):
        return 1e-3 * abs(pair_of(model.gears).M10), found.most
    return found.least, found.most


def check_operating_range(model: OperatingModel, axes: Iterable[Axis]) -> None:
    """Raise `InputError` if a parameter is out of the range that the explorer accepts at a corner of the map."""
    across, up = axes
    corners = {across.name: [across.start, across.stop] * 2, up.name: np.repeat([up.start, up.stop], 2)}
    for name, values in model.expand({n: np.asarray(v, float) for n, v in corners.items()}).items():
        for value in np.asarray(values).tolist():
            in_range(name, value)
