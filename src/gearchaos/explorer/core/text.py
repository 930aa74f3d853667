"""A view as text, for a visitor to take along: the query of the page's address, a Python script, a study file in TOML.

Only the query is read again.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl, urlencode

import numpy as np
import tomlkit

import gearchaos
from gearchaos.errors import InputError
from gearchaos.explorer.core import models
from gearchaos.explorer.core.bounds import QUERY_LENGTH, bounded, finite_number
from gearchaos.explorer.core.run import Run
from gearchaos.explorer.core.state import View, check_known, view_of
from gearchaos.gears.design.gear_design import FILES, GearDesign
from gearchaos.gears.io.units import RPM
from gearchaos.gears.mesh.pair import GearPair
from gearchaos.gears.operation.operating import OperatingModel
from gearchaos.gears.train.model import TrainModel
from gearchaos.model import (
    COORDINATES,
    DAMPING_LAWS,
    DEFAULT_LAW,
    KINDS,
    PARAMETER_PAIRS,
    SCALARS,
    STIFFNESS_KINDS,
    SUPPORTS,
    MeshModel,
    Stiffness,
)
from gearchaos.studies.core.axis import Axis

_OTHER_NAMES: tuple[str, ...] = ("kind", "stiffness", "damping_law", "x", "y", "at", "colour", "line", "start", "units",
                                 "mesh", "run", "change")
"""Names in a query that set no parameter or initial value: the kinds of model and stiffness, the damping law, and
fields of `View`.

``at`` is the point chosen, ``line`` the axis along which the bifurcation diagram runs, ``start`` the initial values of
the motion chosen at the point (`View.initial`), ``units`` one of `_UNITS` (`View.physical`), ``mesh`` that of a train,
``run`` the run-up, ``change`` what gears are looked at for beside operation.
"""

_USUAL_STIFFNESS = next(iter(STIFFNESS_KINDS))  # the kind of stiffness that a query does not name

_UNITS = ("dimensionless", "physical")

_OF_GEARS = set(models.GEAR_VALUES) - {"zeta"}
"""Names in a query that only gears have: a query with one of them is about the gears of the server."""


def to_query(view: View, default: View | None = None) -> str:
    """The view as the query of an address: values that differ from the defaults, with all their digits.

    Of gears it has `GEAR_VALUES` at the point, and what was set apart from the gears; all else stays with the server.
    Of a train it has the values that are not those of ``default``, or all.
    """
    if isinstance(view.model, TrainModel):
        known = {} if default is None else default.model.parameters()
        others = {n: repr(v) for n, v in view.model.parameters().items() if v != known.get(n)}
        return _query({"kind": view.model.kind, **others}, view, default)
    model = point = view.operating_point
    of_gears, own = isinstance(point, OperatingModel), {}
    if isinstance(point, OperatingModel):
        own, changed = models.gear_values(models.own_model(point.gears, point.kind)), models.changes(point)
        named = None if changed.pop("stiffness", None) is None else _query_of_stiffness(point.stiffness, always=True)
    else:
        model, changed = view.model, {}
        named = _query_of_stiffness(model.stiffness)
    if named is not None:
        stiffness = _stiffness(model.stiffness.kind, named)
        usual = replace(model, stiffness=stiffness) if of_gears else MeshModel(kind=model.kind, stiffness=stiffness)
        own_values = usual.parameters()
        changed |= {n: v for n, v in model.parameters().items() if v != own_values.get(n, 0.0)}
    law = {"damping_law": model.damping_law} if of_gears or model.damping_law != DEFAULT_LAW else {}
    out = {"kind": model.kind, **law, **(named or {})} | {n: repr(v) for n, v in {**own, **changed}.items()}
    return _query(out, view, default)


def _query(model: Mapping[str, str], view: View, default: View | None) -> str:
    """The query of a view whose model has these names and values in it."""
    out = {**model}
    out |= {n: repr(v) for n, v in view.model.initial.items()}
    out |= {n: f"{a.name}={a.start!r}:{a.stop!r}" for n, a in (("x", view.x), ("y", view.y))}
    out |= {"at": ",".join(map(repr, view.at)), "colour": view.colour, "line": view.line}
    if view.initial:
        out["start"] = ",".join(f"{n}={v!r}" for n, v in view.initial)
    if view.mesh:
        out["mesh"] = view.mesh
    if view.run is not None and (default is None or view.run != default.run):
        out["run"] = str(view.run)
    if view.change != View.change:
        out["change"] = view.change
    if view.physical or view.gears is not None:
        out["units"] = _UNITS[view.physical]
    return urlencode(out, safe=":,=")


def _query_of_stiffness(stiffness: Stiffness, always: bool = False) -> dict[str, str]:
    """The kind of a stiffness if it is not two-level or ``always``, and its lists of numbers that have no names."""
    out = {"stiffness": stiffness.kind} if always or stiffness.kind != _USUAL_STIFFNESS else {}
    return out | {n: ",".join(map(repr, values)) for n, values in stiffness.unnamed().items()}


def from_query(text: str, default: View) -> View:
    """The view that the query of an address asks for, which may begin with a question mark.

    An empty one asks for ``default``, whose gears are those whose speed, torque, backlash or grade a query sets. What
    it does not name has its default value; a name that does not exist and a value that is not accepted raise
    `InputError`.
    """
    text = text.removeprefix("?")
    if not text:
        return default
    if len(text) > QUERY_LENGTH:
        raise InputError("address", f"must have at most {QUERY_LENGTH} characters", len(text))
    given = dict(parse_qsl(text, keep_blank_values=True))
    model = _model(given, default)
    usual = view_of(model)
    counts = dict(zip("xy", models.map_cells(model), strict=True))
    x, y = (_axis(n, given[n], count) if n in given else getattr(usual, n) for n, count in counts.items())
    at = _two_numbers(given["at"]) if "at" in given else (models.value_on(model, x), models.value_on(model, y))
    units = given.get("units", _UNITS[usual.physical])
    check_known("units", units, _UNITS)
    initial = [part.partition("=") for part in given.get("start", "").split(",") if part]
    for name, _, _ in initial:
        check_known("start", name, {*model.state_names, *(n for names in COORDINATES.values() for n in names)})
    start = tuple((name, bounded(name, value)) for name, _, value in initial)
    run = Run.parse(given["run"]) if "run" in given else default.run if usual.run else None
    return View(model, x, y, at, given.get("colour", usual.colour), given.get("line", "x"), start, units == "physical",
                given.get("mesh", ""), run, default.vary if usual.run else (), given.get("change", View.change))


def _model(given: Mapping[str, str], default: View) -> MeshModel:
    """The model of a query: that of the server's gears if it has a value that only gears have, or they are a train."""
    if default.model.kind == "train":
        check_known("kind", given.get("kind", "train"), ("train",))
        return default.model.with_values({n: bounded(n, v) for n, v in given.items() if n not in _OTHER_NAMES})
    others, axes = _OTHER_NAMES, {given.get(n, "").partition("=")[0] for n in "xy"}
    if of_gears := _OF_GEARS & (given.keys() | axes):
        gears, others = default.gears, others + models.GEAR_VALUES
        if gears is None:
            name = next(iter(of_gears & given.keys()), "axis")
            raise InputError(name, "needs gears", given.get(name), "Start the explorer with a file that has [design] "
                             "or [gearpair]; the models on this page are dimensionless.")
        for name in models.GEAR_VALUES:
            if name in given:
                gears = models.with_gear_value(gears, name, bounded(name, given[name]))
    kind = given.get("kind", default.model.kind if of_gears else "torsional")
    check_known("kind", kind, KINDS)
    model = models.own_model(gears, kind) if of_gears else MeshModel(kind=kind)  # type: ignore[arg-type]
    if not of_gears or "stiffness" in given:
        model = replace(model, stiffness=_stiffness(given.get("stiffness", _USUAL_STIFFNESS), given))
        others += tuple(model.stiffness.unnamed())
    if "damping_law" in given:
        DAMPING_LAWS.check("damping_law", given["damping_law"])
        model = model.with_values({"damping_law": given["damping_law"]})
    values = {n: v for n, v in given.items() if n not in others}
    model.expand(dict.fromkeys(values, 0.0))  # refuses an unknown name before its value is read
    return model.with_values({n: bounded(n, v) for n, v in values.items()})


def _stiffness(kind: str, given: Mapping[str, str]) -> Stiffness:
    """The mesh stiffness of a query before its parameters are set by name."""
    STIFFNESS_KINDS.check("stiffness", kind)
    chosen = STIFFNESS_KINDS[kind]
    return chosen(**{
        n: tuple(finite_number(n, part) for part in given.get(n, "").split(",")) for n in chosen.example().unnamed()})


def _axis(field: str, text: str, count: int) -> Axis:
    """An axis from ``name=start:stop``."""
    name, _, ends = text.partition("=")
    parts = ends.split(":")
    if len(parts) != 2:
        raise InputError(field, "must read name=start:stop", text[:60], "E.g. eps1=0:0.3.")
    return Axis(name, bounded(name, parts[0]), bounded(name, parts[1]), count)


def _two_numbers(text: str) -> tuple[float, float]:
    """The point chosen, from its two values with a comma between."""
    rule, parts, found = "must be two numbers with a comma between", text.split(","), []
    if len(parts) != 2:
        raise InputError("at", rule, text[:60])
    for part in parts:
        try:
            found.append(float(part))
        except ValueError:
            raise InputError("at", rule, part[:40]) from None
    return found[0], found[1]


_CLASSES = re.compile(
    rf"\b(MeshModel|TransmissionError|{'|'.join(kind.__name__ for kind in STIFFNESS_KINDS.values())})\(")
"""Names of classes in the ``repr`` of a model; a script has to write ``gc.MeshModel``, or to import the class."""


def as_python(view: View) -> str:
    """A script that computes what the page shows, in the units that it shows."""
    model = view.point
    x, y = (f'gc.Axis("{a.name}", {a.start!r}, {a.stop!r}, {a.count})' for a in (view.x, view.y))
    scaled = "motion, zones = gc.physical(motion, gears), gc.physical(zones, gears)\n"
    first, scaled = "", scaled if view.physical and view.gears is not None else ""
    if isinstance(model, TrainModel):
        first = "from gearchaos.gears.train.model import TrainModel\n"
        made = f"gc.Train({', '.join(f'{n}={v!r}' for n, v in pair_values(model.train).items())})"
        lines = f"gears = {made}\nmodel = TrainModel(gears, {dict(model.initial)!r})\n"
    elif isinstance(model, OperatingModel):
        gears, values = model.gears, {**models.changes(model), **model.initial}
        own = design_values(gears) if isinstance(gears, GearDesign) else pair_values(gears)
        made = f"gc.{type(gears).__name__}({', '.join(f'{n}={v!r}' for n, v in own.items())})"
        first = "from gearchaos.gears.operation.operating import operating_model\n"
        set_apart = f".with_values({_with_prefix(repr(values))})" if values else ""
        lines = f"gears = {made}\nmodel = operating_model(gears, {model.kind!r}){set_apart}\n"
    else:
        lines = f"model = {_with_prefix(repr(model))}\n"
    for used in STIFFNESS_KINDS.values():
        if f"{used.__name__}(" in lines and not hasattr(gearchaos, used.__name__):
            first += f"from {used.__module__} import {used.__name__}\n"
    return (
        f"import gearchaos as gc\n{first}\n{lines}"
        "verdict = gc.regime(model)\n"
        "motion = gc.steady(model, verdict)\n"
        f"zones = gc.zones(model, {x}, {y}, progress=True)\n"
        f"{scaled}"
        "print(verdict.label, verdict.reason)\n"
        "gc.plot.motion(motion)\n"
        "gc.plot.zones(zones)\n"
    )


def _with_prefix(text: str) -> str:
    """The ``repr`` of a model or stiffness, with the names of classes as a script has to write them."""
    return _CLASSES.sub(lambda found: f"gc.{found[0]}" if hasattr(gearchaos, found[1]) else found[0], text)


def as_toml(view: View) -> str:
    """A study file of the point and its map.

    Of gears it describes the design or pair at the point. Where values were set apart from a design, it describes the
    pair with these values; where no pair has them, the dimensionless model.
    """
    model, axes, document = view.point, (view.x, view.y), tomlkit.document()
    comment, tables = _tables(model)
    if comment:
        document.add(tomlkit.comment(comment))
    for name, table in tables.items():
        document[name] = table
    if isinstance(model, OperatingModel) and "model" in document:
        axes = models.as_dimensionless_axis(model.gears, view.x), models.as_dimensionless_axis(model.gears, view.y)
    if model.initial:
        document["initial"] = dict(model.initial)
    ranges = {n: f"{a.name}={a.start!r}:{a.stop!r}:{a.count}" for n, a in zip("xy", axes, strict=True)}
    document["study"] = {"kind": "zones", **ranges}
    return tomlkit.dumps(document)


def _tables(model: MeshModel) -> tuple[str, dict[str, Any]]:
    """A comment, and the tables of a study file that describe a model."""
    at_point = "The gears at the point chosen; numbers without a unit are in SI, speeds in rpm."
    if isinstance(model, TrainModel):
        return at_point, {"train": pair_values(model.train)}
    comment, dimensionless = "", {"model": {
        "kind": model.kind, **{n: getattr(model, n) for n in SCALARS}, "damping_law": model.damping_law,
        "error": {"amplitudes": list(model.error.amplitudes), "phases": list(model.error.phases)},
        "stiffness": {"kind": model.stiffness.kind, **model.stiffness.record()},
    }}
    if isinstance(model, OperatingModel):
        gears, comment = model.gears, at_point
        if isinstance(gears, GearDesign) and model.kind == models.own_kind(gears) and not models.changes(model):
            values = design_values(gears)
            operation = {n: values.pop(n) for n in ("speed", "torque")}
            return comment, {"design": values, "operation": operation}
        if (pair := pair_at(gears.to_pair(), model)) is not None:
            return comment, {"gearpair": {"kind": model.kind, **pair_values(pair)}}
        comment = "No pair of the same mass and kind of supports has these values."
    return comment, dimensionless


def design_values(design: GearDesign) -> dict[str, Any]:
    """The inputs of a design that differ from their defaults, as numbers in SI, texts, lists and tables by name."""
    required = ("teeth", "module", "face_width")
    plain = GearDesign(**{n: getattr(design, n) for n in required})
    values = {
        name: _plain(value) for name, value in asdict(design).items()
        if value is not None and (name in required or getattr(design, name) != getattr(plain, name))
    }
    for name, key in FILES:
        if isinstance(table := values.get(name), dict) and key in table:
            kept = {n: v for n, v in table.items() if v and n != "sha256"}
            values[name] = {**kept, key: str(Path(table[key]).absolute())}
    return values


def pair_values(pair: GearPair) -> dict[str, Any]:
    """The fields of a pair that are not left out, as numbers in SI, texts, lists and tables by name."""
    return {name: _plain(value) for name, value in asdict(pair).items() if value not in (None, ())}


def _plain(value: Any) -> Any:
    """A value with lists for tuples, and tables without the keys that are left out."""
    if isinstance(value, dict):
        return {n: _plain(v) for n, v in value.items() if v is not None}
    return [_plain(v) for v in value] if isinstance(value, (list, tuple)) else value


def pair_at(pair: GearPair, model: MeshModel) -> GearPair | None:
    """The pair with the mass, mesh stiffness and backlash of ``pair`` whose dimensionless model is ``model``.

    The inverse of (2.11). Fields whose dimensionless parameters are those of ``pair`` keep all their digits. None if
    there is no such pair: inertias that imply another equivalent mass, or elastic supports where those of ``pair`` are
    rigid.
    """
    if model.kind == "full" and pair.rigid:
        return None
    if model.kind == "single":
        pair = replace(pair, b1=0.0, b2=0.0)
    own = pair.to_model(model.kind)
    old, new = own.parameters(), model.parameters()
    damping = 2 * pair.mass * pair.omega0
    # by field: the dimensionless parameters that determine it, and its value
    values: dict[str, tuple[tuple[str, ...], float]] = {
        "speed": (("omega",), model.omega * pair.omega0 / pair.n1 / RPM), "k": (("zeta",), model.zeta * damping)}
    for n in (1, 2):
        radius = getattr(pair, f"R{n}")
        at = {name: getattr(model, f"{name}{n}") for name in ("J", "q", "beta", *SUPPORTS)}
        values |= {
            f"I{n}": ((f"J{n}",), at["J"] * pair.mass * radius**2),
            f"M{n}0": ((f"q{n}",), at["q"] * pair.scales.force * radius),
            f"b{n}": ((f"beta{n}",), at["beta"] * damping * radius**2),
        }
        if model.kind == "full":
            values |= {
                f"m{n}": ((f"mu{n}",), at["mu"] * pair.mass),
                f"c{n}": ((f"kappa{n}",), at["kappa"] * pair.c0),
                f"k{n}": ((f"zeta_support{n}", f"mu{n}"), at["zeta_support"] * at["mu"] * damping),
            }
    changed: dict[str, Any] = {
        field: value for field, (names, value) in values.items() if any(old[n] != new[n] for n in names)}
    if model.error != own.error:
        amplitudes = tuple(a * pair.half_backlash for a in model.error.amplitudes)
        changed |= {"error_amplitudes": amplitudes, "error_phases": model.error.phases}
    if model.stiffness != own.stiffness:
        of_stiffness = {field for kind in STIFFNESS_KINDS.own.values() for field in kind.pair_fields.values()}
        changed |= {field: GearPair.__dataclass_fields__[field].default for field in of_stiffness}
        changed |= model.stiffness.to_pair(pair.c0, pair.half_backlash)
    found = replace(pair, **changed)
    ignored = () if model.kind == "full" else [n for family in SUPPORTS for n in PARAMETER_PAIRS[family]]
    made = found.to_model(model.kind)  # has to be the model up to rounding
    a, b = ({n: v for n, v in m.parameters().items() if n not in ignored} for m in (made, model))
    same = made.stiffness.kind == model.stiffness.kind and a.keys() == b.keys() and np.allclose(
        [*a.values()], [b[n] for n in a], rtol=models.TOLERANCE, atol=1e-15)
    return found if same else None
