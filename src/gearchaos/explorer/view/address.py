"""The query of the page's address: a view as text, and back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from urllib.parse import parse_qsl, urlencode

from gearchaos.errors import InputError
from gearchaos.explorer.view.bounds import MAP_CELLS, QUERY_LENGTH, bounded, finite_number
from gearchaos.explorer.view.planes import value_on
from gearchaos.explorer.view.state import View, check_known, stiffness_name, view_of
from gearchaos.model import (
    COORDINATES,
    KINDS,
    STIFFNESS_KINDS,
    HarmonicStiffness,
    MeshModel,
    SteppedStiffness,
    Stiffness,
    TwoLevelStiffness,
    expand_pairs,
)
from gearchaos.studies.axis import Axis

_OTHER_NAMES = ("kind", "stiffness", "x", "y", "at", "colour", "line", "start", "units")
"""Names in a query that do not set a value of the model."""

_STEPS = ("levels", "starts")
"""The fields of a stepped stiffness. In the query of a model that has one, each is a list of numbers with commas."""

_UNITS = ("dimensionless", "physical")


def to_query(view: View) -> str:
    """The view as the query of an address: values that differ from the defaults, with all their digits."""
    model = view.model
    out: dict[str, str] = {"kind": model.kind}
    if stiffness_name(model) != "two-level":
        out["stiffness"] = stiffness_name(model)
    if isinstance(model.stiffness, SteppedStiffness):
        out |= {n: ",".join(map(repr, getattr(model.stiffness, n))) for n in _STEPS}
    default = replace(MeshModel(kind=model.kind), stiffness=_stiffness(stiffness_name(model), out)).parameters()
    out |= {n: repr(v) for n, v in model.parameters().items() if v != default.get(n, 0.0)}
    out |= {n: repr(v) for n, v in model.initial.items()}
    out |= {n: f"{a.name}:{a.start!r}:{a.stop!r}" for n, a in (("x", view.x), ("y", view.y))}
    out |= {"at": ",".join(map(repr, view.at)), "colour": view.colour, "line": view.line}
    if view.initial:
        out["start"] = ",".join(f"{n}:{v!r}" for n, v in view.initial)
    return urlencode(out | ({"units": "physical"} if view.physical else {}), safe=":,")


def from_query(text: str, default: View) -> View:
    """The view that the query of an address asks for.

    Parameters
    ----------
    text : str
        With or without the leading question mark. What it does not name has its default value.
    default : View
        What an empty query shows.

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
    model = _model(given)
    usual = view_of(model)
    counts = dict(zip("xy", MAP_CELLS, strict=True))
    x, y = (_axis(n, given[n], count) if n in given else getattr(usual, n) for n, count in counts.items())
    at = _two_numbers("at", given["at"]) if "at" in given else (value_on(model, x), value_on(model, y))
    check_known("units", given.get("units", "dimensionless"), _UNITS)
    return View(
        model, x, y, at, given.get("colour", "motion"), given.get("line", "x"), _initial(given.get("start", "")),
        given.get("units") == "physical",
    )


def _stiffness(kind: str, given: Mapping[str, str]) -> Stiffness:
    """The mesh stiffness of a query before its parameters are set by name; ``kind`` is one of `STIFFNESS_KINDS`."""
    if kind == "steps":
        levels, starts = (tuple(finite_number(n, part) for part in given.get(n, "").split(",")) for n in _STEPS)
        return SteppedStiffness(levels, starts)
    return HarmonicStiffness() if kind == "harmonics" else TwoLevelStiffness()


def _model(given: Mapping[str, str]) -> MeshModel:
    """The model of a query."""
    kind, stiffness = given.get("kind", "torsional"), given.get("stiffness", "two-level")
    check_known("kind", kind, KINDS)
    check_known("stiffness", stiffness, STIFFNESS_KINDS)
    model = MeshModel(kind=kind, stiffness=_stiffness(stiffness, given))  # type: ignore[arg-type]
    others = (*_OTHER_NAMES, *_STEPS) if stiffness == "steps" else _OTHER_NAMES
    values = {n: v for n, v in given.items() if n not in others}
    expand_pairs(dict.fromkeys(values, 0.0), model)  # refuses an unknown name before its value is read
    return model.with_values({n: bounded(n, v) for n, v in values.items()})


def _axis(field: str, text: str, count: int) -> Axis:
    """An axis from ``name:start:stop``."""
    parts = text.split(":")
    if len(parts) != 3:
        raise InputError(field, "must read name:start:stop", text[:60], "E.g. eps1:0:0.3.")
    return Axis(parts[0], bounded(parts[0], parts[1]), bounded(parts[0], parts[2]), count)


def _two_numbers(field: str, text: str) -> tuple[float, float]:
    parts = text.split(",")
    if len(parts) != 2:
        raise InputError(field, "must be two numbers with a comma between", text[:60])
    first, second = (_parsed(field, part) for part in parts)
    return first, second


def _parsed(field: str, text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise InputError(field, "must be two numbers with a comma between", text[:40]) from None


def _initial(text: str) -> tuple[tuple[str, float], ...]:
    """Initial values from ``x1:1.0,x1_dot:0.0``."""
    parts = [part.partition(":") for part in text.split(",") if part]
    for name, _, _ in parts:
        check_known("start", name, {n for names in COORDINATES.values() for n in names})
    return tuple((name, bounded(name, value)) for name, _, value in parts)
