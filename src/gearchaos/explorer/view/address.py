"""The query of the page's address: a view as text, and back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from urllib.parse import parse_qsl, urlencode

from gearchaos.errors import InputError
from gearchaos.explorer.view.bounds import MAP_CELLS, QUERY_LENGTH, bounded, finite_number
from gearchaos.explorer.view.models import (
    GEAR_VALUES,
    AnyModel,
    changes,
    gear_values,
    own_model,
    value_on,
    with_gear_value,
)
from gearchaos.explorer.view.state import View, check_known, stiffness_name, view_of
from gearchaos.gears.operating import OperatingModel
from gearchaos.model import (
    COORDINATES,
    KINDS,
    STIFFNESS_KINDS,
    MeshModel,
    Stiffness,
)
from gearchaos.studies.axis import Axis

_OTHER_NAMES = ("kind", "stiffness", "x", "y", "at", "colour", "line", "start", "units")
"""Names in a query that set no parameter or initial value: the kinds of model and stiffness, and fields of `View`.

``at`` is the point chosen, ``line`` the axis along which the bifurcation diagram runs, ``start`` the initial values of
the motion chosen at the point (`View.initial`), ``units`` one of `_UNITS` (`View.physical`).
"""

_USUAL_STIFFNESS = next(iter(STIFFNESS_KINDS))
"""The kind of stiffness that a query does not name."""

_UNITS = ("dimensionless", "physical")

_OF_GEARS = set(GEAR_VALUES) - {"zeta"}
"""Names in a query that only gears have: a query with one of them is about the gears of the server."""


def to_query(view: View) -> str:
    """The view as the query of an address: values that differ from the defaults, with all their digits.

    Of gears it has `GEAR_VALUES` at the point, and what was set apart from the gears; all else stays with the server.
    """
    point = view.operating_point
    if isinstance(point, OperatingModel):
        out = _query_of_gears(point)
    else:
        out = {"kind": view.model.kind, **_query_of_stiffness(view.model.stiffness)}
        usual = MeshModel(kind=view.model.kind, stiffness=_stiffness(stiffness_name(view.model), out)).parameters()
        out |= {n: repr(v) for n, v in view.model.parameters().items() if v != usual.get(n, 0.0)}
    out |= {n: repr(v) for n, v in view.model.initial.items()}
    out |= {n: f"{a.name}={a.start!r}:{a.stop!r}" for n, a in (("x", view.x), ("y", view.y))}
    out |= {"at": ",".join(map(repr, view.at)), "colour": view.colour, "line": view.line}
    if view.initial:
        out["start"] = ",".join(f"{n}={v!r}" for n, v in view.initial)
    if view.physical or isinstance(point, OperatingModel):
        out["units"] = _UNITS[view.physical]
    return urlencode(out, safe=":,=")


def _query_of_gears(model: OperatingModel) -> dict[str, str]:
    """Kind of model, values of its gears, and what was set apart from them."""
    own, changed = gear_values(own_model(model.gears, model.kind)), changes(model)
    named: dict[str, str] = {}
    if changed.pop("stiffness", None) is not None:
        named = {"stiffness": stiffness_name(model), **_query_of_stiffness(model.stiffness)}
        default = replace(model, stiffness=_stiffness(stiffness_name(model), named)).parameters()
        changed |= {n: v for n, v in model.parameters().items() if v != default.get(n, 0.0)}
    return {"kind": model.kind, **named} | {n: repr(v) for n, v in {**own, **changed}.items()}


def _query_of_stiffness(stiffness: Stiffness) -> dict[str, str]:
    """The kind of a stiffness that is not two-level, and its lists of numbers that have no names of parameters."""
    out = {} if stiffness.kind == _USUAL_STIFFNESS else {"stiffness": stiffness.kind}
    return out | {n: ",".join(map(repr, values)) for n, values in stiffness.unnamed().items()}


def from_query(text: str, default: View) -> View:
    """The view that the query of an address asks for.

    Parameters
    ----------
    text : str
        With or without the leading question mark. What it does not name has its default value.
    default : View
        What an empty query shows. Its gears are those whose speed, torque, backlash or grade a query sets.

    Raises
    ------
    InputError
        If a name does not exist, or a value is not accepted.
    """
    text = text.removeprefix("?")
    if not text:
        return default
    if len(text) > QUERY_LENGTH:
        raise InputError("address", f"must have at most {QUERY_LENGTH} characters", len(text))
    given = dict(parse_qsl(text, keep_blank_values=True))
    axes = {given.get(n, "").partition("=")[0] for n in "xy"}
    model = _model_of_gears(given, default) if _OF_GEARS & (given.keys() | axes) else _model(given)
    usual = view_of(model)
    counts = dict(zip("xy", MAP_CELLS, strict=True))
    x, y = (_axis(n, given[n], count) if n in given else getattr(usual, n) for n, count in counts.items())
    at = _two_numbers("at", given["at"]) if "at" in given else (value_on(model, x), value_on(model, y))
    units = given.get("units", _UNITS[usual.physical])
    check_known("units", units, _UNITS)
    initial = [part.partition("=") for part in given.get("start", "").split(",") if part]
    for name, _, _ in initial:
        check_known("start", name, {n for names in COORDINATES.values() for n in names})
    start = tuple((name, bounded(name, value)) for name, _, value in initial)
    return View(model, x, y, at, given.get("colour", usual.colour), given.get("line", "x"), start, units == "physical")


def _model_of_gears(given: Mapping[str, str], default: View) -> OperatingModel:
    """The model of the server's gears with the values of a query."""
    gears = default.gears
    if gears is None:
        name = next(iter(_OF_GEARS & given.keys()), "axis")
        raise InputError(name, "needs gears", given.get(name), "Start the explorer with a file that has [design] or "
                         "[gearpair]; the models on this page are dimensionless.")
    for name in GEAR_VALUES:
        if name in given:
            gears = with_gear_value(gears, name, bounded(name, given[name]))
    kind = given.get("kind", default.model.kind)
    check_known("kind", kind, KINDS)
    model, others = own_model(gears, kind), {*_OTHER_NAMES, *GEAR_VALUES}
    if "stiffness" in given:
        check_known("stiffness", given["stiffness"], STIFFNESS_KINDS)
        model = replace(model, stiffness=_stiffness(given["stiffness"], given))
        others |= model.stiffness.unnamed().keys()
    return _with_values(model, {n: v for n, v in given.items() if n not in others})


def _stiffness(kind: str, given: Mapping[str, str]) -> Stiffness:
    """The mesh stiffness of a query before its parameters are set by name; ``kind`` is one of `STIFFNESS_KINDS`."""
    chosen = STIFFNESS_KINDS[kind]
    return chosen(**{
        n: tuple(finite_number(n, part) for part in given.get(n, "").split(",")) for n in chosen.example().unnamed()})


def _model(given: Mapping[str, str]) -> MeshModel:
    """The model of a query."""
    kind, stiffness = given.get("kind", "torsional"), given.get("stiffness", _USUAL_STIFFNESS)
    check_known("kind", kind, KINDS)
    check_known("stiffness", stiffness, STIFFNESS_KINDS)
    model = MeshModel(kind=kind, stiffness=_stiffness(stiffness, given))  # type: ignore[arg-type]
    others = (*_OTHER_NAMES, *model.stiffness.unnamed())
    values = {n: v for n, v in given.items() if n not in others}
    return _with_values(model, values)


def _with_values(model: AnyModel, values: Mapping[str, str]) -> AnyModel:
    """The model with the values of a query by name."""
    model.expand(dict.fromkeys(values, 0.0))  # refuses an unknown name before its value is read
    return model.with_values({n: bounded(n, v) for n, v in values.items()})


def _axis(field: str, text: str, count: int) -> Axis:
    """An axis from ``name=start:stop``."""
    name, _, ends = text.partition("=")
    parts = ends.split(":")
    if len(parts) != 2:
        raise InputError(field, "must read name=start:stop", text[:60], "E.g. eps1=0:0.3.")
    return Axis(name, bounded(name, parts[0]), bounded(name, parts[1]), count)


def _two_numbers(field: str, text: str) -> tuple[float, float]:
    rule, parts, found = "must be two numbers with a comma between", text.split(","), []
    if len(parts) != 2:
        raise InputError(field, rule, text[:60])
    for part in parts:
        try:
            found.append(float(part))
        except ValueError:
            raise InputError(field, rule, part[:40]) from None
    return found[0], found[1]
