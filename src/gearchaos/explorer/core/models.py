"""The model of a page: its kind, its gears with their values in physical units, and the planes of its parameters."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from functools import cache, lru_cache
from typing import Any, TypeVar

import numpy as np

from gearchaos.errors import InputError
from gearchaos.explorer.core import trains
from gearchaos.explorer.core.bounds import (
    HIGHEST_HARMONIC,
    MAP_CELLS,
    SHARES,
    in_range,
    rounded,
    value_range,
)
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.io.units import RPM
from gearchaos.gears.mesh.pair import GearPair
from gearchaos.gears.operation.operating import Gears, OperatingModel, is_train, operating_model, pair_of
from gearchaos.gears.train.model import TrainModel
from gearchaos.gears.transmission_error import Quality, editions
from gearchaos.gears.transmission_error.harmonics import FROM_QUALITY
from gearchaos.model import PARAMETER_PAIRS, SUPPORTS, MeshModel, has_effect, state_names
from gearchaos.quantities import OPERATION, Range, parse_harmonic
from gearchaos.studies.core.axis import Axis
from gearchaos.studies.operation.quasi_static import quasi_static_ratio

WHEELS = ("J", "beta", "mu", "kappa", "zeta_support")  # pairs of values that belong to the wheels and their supports

AnyModel = TypeVar("AnyModel", bound=MeshModel)


def as_kind(model: AnyModel, kind: str) -> AnyModel:
    """A model of another kind, without the initial values and the bearing friction that this kind does not have."""
    kept = {n: v for n, v in model.initial.items() if n in state_names(kind)}
    model = replace(model, initial={})
    if kind == "single":
        model = replace(model, beta1=0.01, beta2=0.01) if model.kind != "single" else model
    # those of a model whose gears have rigid supports have their default values
    supports = {f"{family}{n}": getattr(model, f"{family}{n}") for family in SUPPORTS for n in (1, 2)}
    model = model.with_values({"kind": kind, **(supports if kind == "full" else {})})
    return model.with_values(kept) if kept else model


def equal(model: MeshModel, pair: str) -> bool:
    """Whether both members of a pair of `PARAMETER_PAIRS` have the same value; true also if the model has neither."""
    values = model.parameters()
    return len({values.get(name) for name in PARAMETER_PAIRS[pair]}) == 1


def are_alike(model: MeshModel) -> bool:
    """Whether both wheels and their supports have the same values."""
    return all(equal(model, pair) for pair in WHEELS)


GEAR_VALUES: tuple[str, ...] = ("speed", "torque", "backlash", "grade", "zeta")
"""The values of gears that a page sets, in rpm, N m and µm; the grade and ζ have no unit."""

_UM = 1e-6

_DIMENSIONLESS = {"speed": ("omega",), "torque": ("q0", "q1")}
"""Parameters of which one stands for a speed or torque on an axis."""

TOLERANCE = 1e-12  # relative rounding error allowed for the conversion of a value to SI units and back


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
    gears, pair = model.gears, pair_of(model.gears)
    values = {"speed": model.value("speed"), "torque": model.value("torque"), "backlash": pair.backlash / _UM}
    if (quality := _quality(gears)) is not None:
        values["grade"] = quality.coarsest
    values["zeta"] = pair.k / (2 * pair.mass * pair.omega0)
    out = {n: _digits(value) for n, value in values.items()}
    if model.zeta != own_model(gears, model.kind).zeta:
        out["zeta"] = model.zeta
    elif isinstance(gears, GearDesign):
        out["zeta"] = gears.given("damping_ratio")
    return out


def _digits(value: Any) -> float:
    """A value without the rounding error of its conversion from SI units."""
    return float(f"{value:.14g}")


def _quality(gears: Gears) -> Quality | None:
    """The accuracy grade, if the transmission error of the gears follows from it."""
    return gears.quality if isinstance(gears, GearDesign) and gears.transmission_error in FROM_QUALITY else None


def with_gear_value(gears: Any, name: str, value: float) -> Gears:
    """The gears with one of `GEAR_VALUES` replaced; the same gears if they have that value already.

    An `InputError` says that the gears have no such value, or do not accept it.
    """
    own = gear_values(own_model(gears, own_kind(gears)))
    if name not in own:
        raise InputError(name, "must be a value of the gears loaded", value, f"They have {', '.join(own)}.")
    if value == own[name]:
        return gears
    if name in _DIMENSIONLESS:
        return gears.at(**{name: value})
    new: dict[str, Any]
    if isinstance(gears, GearPair):
        new = {"backlash": value * _UM} if name == "backlash" else {"k": 2 * value * gears.mass * gears.omega0}
    elif name == "grade":
        new = {"quality": replace(gears.quality, grade=int(value) if value == int(value) else value)}
    elif name == "backlash":
        new = {"backlash": {"value": value * _UM, "of": "line of action, total"}}
    else:
        new = {"damping_ratio": value}
    return replace(gears, **new)


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
    if not all(math.isclose(getattr(model, n), getattr(new, n), rel_tol=TOLERANCE) for n in names):
        return model
    same = replace(model, **{n: getattr(own, n) for n in names})
    return with_new_gears(same, gears)


def at_on_axis(model: OperatingModel, axis: str, name: str, value: float) -> float | None:
    """The value on an axis of ``omega``, ``q0`` or ``q1`` that stands for a speed or torque; None on other axes."""
    if axis not in _DIMENSIONLESS.get(name, ()):
        return None
    pair = pair_of(model.gears)
    return value * RPM * pair.n1 / pair.omega0 if name == "speed" else value / pair.scales.torque1


def coarseness(model: MeshModel) -> int:
    """How many times fewer columns, and rows, a study of this model has than one of a pair."""
    return trains.coarseness(model) if isinstance(model, TrainModel) else 1


def map_cells(model: MeshModel) -> tuple[int, int]:
    """Columns and rows of the complete map of a model."""
    columns, rows = (count // coarseness(model) for count in MAP_CELLS)
    return columns, rows


def operating_axes(gears: Gears) -> tuple[Axis, Axis]:
    """The axes of speed and torque that a page shows first."""
    if is_train(gears):
        if not gears.meshes:
            raise InputError("train.meshes", "must have at least one entry to be explored", [],
                             "gearchaos regime, bifurcation and rattle take a train of stops alone.")
        model: Any = TrainModel(gears)
        x, y = (Axis(name, *trains.range_around(model, name)[:2], count)
                for name, count in zip(trains.varied_names(model), map_cells(model), strict=False))
        return x, y
    pair = pair_of(gears)
    speed, torque = pair.speed, pair.M10
    low, high = sorted(share * torque for share in SHARES) if torque else (0.0, 0.3 * pair.scales.torque1)
    omega = value_range("omega")  # at all torques; the resonance rises with the torque
    least = 1.01 * omega.least * _resonance_speed(pair_of(gears, high))
    most = 0.99 * omega.most * _resonance_speed(pair_of(gears, low or high))
    first, last = max(SHARES[0] * speed, least), min(SHARES[1] * speed, max(most, speed))
    ends = ("speed", min(first, 0.9 * last), last), ("torque", low, high)
    x, y = (Axis(name, rounded(start, stop - start) or start, rounded(stop, stop - start), count)  # ends of few digits
            for (name, start, stop), count in zip(ends, MAP_CELLS, strict=True))
    return x, y


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
    if is_train(gears):
        return trains.range_around(TrainModel(gears), name)
    found = value_range(name)
    if gears is None:
        return found
    for axis in operating_axes(gears):
        if axis.name == name:
            return found._replace(low=axis.start, high=axis.stop)
    if name == "grade" and (quality := _quality(gears)) is not None:
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
    if isinstance(model, TrainModel) and name == "torque":  # from 0 no torque could be scaled again
        own = model.train.torque
        return (1e-3 * own, found.most) if own >= 0 else (found.least, 1e-3 * own)
    return found.least, found.most


def check_operating_range(model: OperatingModel, axes: Iterable[Axis]) -> None:
    """Raise `InputError` if a parameter is out of the range that the explorer accepts at a corner of the map."""
    across, up = axes
    corners = {across.name: [across.start, across.stop] * 2, up.name: np.repeat([up.start, up.stop], 2)}
    for name, values in model.expand({n: np.asarray(v, float) for n, v in corners.items()}).items():
        if name == "omega" and "omega" not in corners:
            check_omega(model, np.asarray(corners.get("speed", model.value("speed"))), np.asarray(values))
        for value in np.asarray(values).tolist():
            in_range(name, value)


def check_omega(model: OperatingModel, speeds: np.ndarray, omega: np.ndarray) -> None:
    """Raise `InputError` about the speeds of gears, rpm, if the ω of any of them is not one that a page accepts."""
    found, ratio = value_range("omega"), omega / speeds
    if omega.min() < found.least:
        raise InputError("speed", f"must be at least {math.ceil(found.least / ratio.min())} rpm here",
                         float(speeds.min()), too_slow(model))
    if omega.max() > found.most:
        raise InputError("speed", f"must be at most {math.floor(found.most / ratio.max())} rpm here",
                         float(speeds.max()))


def too_slow(model: OperatingModel) -> str:
    """What to do about a speed that is too low for a page."""
    ratio = quasi_static_ratio(model) if model.value("torque") else 1.0
    return ("A motion at a lower one takes long to compute: gearchaos regime follows it. As the speed goes to 0 the "
            f"dynamic factor goes to {ratio:.3g}.")


@cache
def first_plane() -> tuple[Axis, Axis]:
    """The axes of the map of the paper's figure 2, which a page shows first."""
    from gearchaos.paper.settings import all_figures  # here, since worker processes import this module

    axes = next(iter(all_figures()[2].studies.values())).axes
    x, y = (Axis(n, r.start, r.stop, count) for (n, r), count in zip(axes.items(), MAP_CELLS, strict=True))
    return x, y


def axis_names(model: MeshModel) -> list[str]:
    """Parameters that an axis of the map can scan.

    A pair stands in place of its two members; parameters that have no effect on this kind of model are left out, and
    so are initial values. The harmonics listed are those that the model has, and at least the first.
    """
    if isinstance(model, TrainModel):
        return list(trains.varied_names(model))
    out = [q.name for q in OPERATION] if isinstance(model, OperatingModel) else []
    for name in [*model.known_names, *(n for n in model.parameters() if n not in model.known_names)]:
        order = ((parts := parse_harmonic(name)) is not None and parts.order) or 0
        if order <= HIGHEST_HARMONIC and has_effect(name, model.kind) and name not in {*model.state_names, *out}:
            out.append(name)
    return out


def initial_values(model: MeshModel) -> dict[str, float]:
    """Every coordinate of a model at τ = 0, by name: as given, otherwise x1 = 1 and all others 0, as in the paper.

    Of a train those that are given: others follow from its mean torques.
    """
    if isinstance(model, TrainModel):
        return dict(model.initial)
    return {n: 1.0 if n == "x1" else 0.0 for n in model.coordinate_names} | dict(model.initial)


def value_on(model: MeshModel, axis: Axis) -> float:
    """The value that the model has for the parameter of an axis, or the middle of the axis if it has no single value.

    A pair has no single value if its two members differ.
    """
    if isinstance(model, OperatingModel) and axis.name in gear_values(model):
        return gear_values(model)[axis.name]
    if isinstance(model, TrainModel):
        return (axis.start + axis.stop) / 2 if (value := model.value(axis.name)) is None else value
    known = model.parameters() | initial_values(model)
    missing = dict.fromkeys(model.state_names)  # None for z, which follows from x1, x2, ... and is not in `known`
    values = {known.get(n, missing.get(n, 0.0)) for n in model.set_by(axis.name)}  # an absent harmonic is 0
    first = values.pop()
    return (axis.start + axis.stop) / 2 if first is None or values else first
