"""The point and its map as text: a Python script, and a study file in TOML."""

from __future__ import annotations

import re
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import tomlkit

from gearchaos.explorer.view.models import as_dimensionless_axis, changes, own_kind
from gearchaos.explorer.view.state import View, stiffness_name
from gearchaos.gears.design.gear_design import FILES, GearDesign
from gearchaos.gears.operating import OperatingModel
from gearchaos.gears.pair import GearPair
from gearchaos.gears.units import RPM
from gearchaos.model import PARAMETER_PAIRS, SCALARS, STIFFNESS_KINDS, SUPPORTS, MeshModel
from gearchaos.studies.axis import Axis

_CLASSES = re.compile(
    rf"\b(MeshModel|TransmissionError|{'|'.join(kind.__name__ for kind in STIFFNESS_KINDS.values())})\(")
"""Names of classes in the ``repr`` of a model; a script has to write ``gc.MeshModel`` and so on."""


def as_python(view: View) -> str:
    """A script that computes what the page shows, in the units that it shows."""
    model, first = view.point, "import gearchaos as gc\n"
    x, y = (f'gc.Axis("{a.name}", {a.start!r}, {a.stop!r}, {a.count})' for a in (view.x, view.y))
    if isinstance(model, OperatingModel):
        first += "from gearchaos.gears.operating import operating_model\n"
    scaled = view.physical and isinstance(model, OperatingModel)
    return (
        f"{first}\n{_model_lines(model)}"
        "verdict = gc.regime(model)\n"
        "motion = gc.steady(model, verdict)\n"
        f"zones = gc.zones(model, {x}, {y}, progress=True)\n"
        f"{_SCALED if scaled else ''}"
        "print(verdict.label, verdict.reason)\n"
        "gc.plot.dossier(motion)\n"
        "gc.plot.zones(zones)\n"
    )


_SCALED = "motion, zones = gc.physical(motion, gears), gc.physical(zones, gears)\n"
"""The line of a script that scales its results."""


def _model_lines(model: MeshModel) -> str:
    """The lines of a script that make a model."""
    if not isinstance(model, OperatingModel):
        return f"model = {_with_prefix(repr(model))}\n"
    gears, values = model.gears, {**changes(model), **model.initial}
    if isinstance(gears, GearDesign):
        text = ", ".join(f"{n}={v!r}" for n, v in design_values(gears).items())
        made = f"gears = gc.GearDesign({text})\n"
    else:
        made = f"gears = gc.{gears!r}\n"
    set_apart = f".with_values({_with_prefix(repr(values))})" if values else ""
    return f"{made}model = operating_model(gears, {model.kind!r}){set_apart}\n"


def _with_prefix(text: str) -> str:
    """The ``repr`` of a model or stiffness, with the names of classes as a script has to write them."""
    return _CLASSES.sub(r"gc.\1(", text)


def as_toml(view: View) -> str:
    """A study file of the point and its map.

    Of gears it describes the design or pair at the point. Where values were set apart from a design, it describes the
    pair with these values; where no pair has them, the dimensionless model.
    """
    model, axes, document = view.point, (view.x, view.y), tomlkit.document()
    for line, tables in _tables(model):
        if line:
            document.add(tomlkit.comment(line))
        for name, table in tables.items():
            document[name] = table
    if isinstance(model, OperatingModel) and "model" in document:
        axes = tuple(as_dimensionless_axis(model.gears, axis) for axis in axes)  # type: ignore[assignment]
    if model.initial:
        document["initial"] = dict(model.initial)
    document["study"] = {"kind": "zones", "x": _axis_text(axes[0]), "y": _axis_text(axes[1])}
    return tomlkit.dumps(document)


def _tables(model: MeshModel) -> list[tuple[str, dict[str, Any]]]:
    """The tables of a study file that describe a model, after a comment."""
    if not isinstance(model, OperatingModel):
        return [("", {"model": _model_table(model)})]
    gears, comment = model.gears, "The gears at the point chosen; numbers without a unit are in SI, speeds in rpm."
    usual = model.kind == own_kind(gears)
    if isinstance(gears, GearDesign) and usual and not changes(model):
        values = design_values(gears)
        operation = {n: values.pop(n) for n in ("speed", "torque")}
        return [(comment, {"design": values, "operation": operation})]
    if (pair := pair_at(gears.to_pair(), model)) is not None:
        values = {f.name: getattr(pair, f.name) for f in fields(pair)}
        given = {n: list(v) if isinstance(v, tuple) else v for n, v in values.items() if v not in (None, ())}
        return [(comment, {"gearpair": {"kind": model.kind, **given}})]
    return [("No pair of the same mass and kind of supports has these values.", {"model": _model_table(model)})]


def _model_table(model: MeshModel) -> dict[str, Any]:
    """The table ``[model]`` of a study file."""
    return {
        "kind": model.kind, **{n: getattr(model, n) for n in SCALARS},
        "error": {"amplitudes": list(model.error.amplitudes), "phases": list(model.error.phases)},
        "stiffness": {"kind": stiffness_name(model), **model.stiffness.record()},
    }


def _axis_text(axis: Axis) -> str:
    return f"{axis.name}={axis.start!r}:{axis.stop!r}:{axis.count}"


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


def _plain(value: Any) -> Any:
    """A value with lists for tuples, and tables without the keys that are left out."""
    if isinstance(value, dict):
        return {n: _plain(v) for n, v in value.items() if v is not None}
    return [_plain(v) for v in value] if isinstance(value, (list, tuple)) else value


_TOLERANCE = 1e-12
"""Relative rounding error allowed for the conversion of a value to SI units and back."""

_Values = dict[str, tuple[tuple[str, ...], float]]
"""By field of a `GearPair`: the dimensionless parameters that determine it, and its value."""


def pair_at(pair: GearPair, model: MeshModel) -> GearPair | None:
    """The pair with the mass, mesh stiffness and backlash of ``pair`` whose dimensionless model is ``model``.

    The inverse of (2.11). Fields whose dimensionless parameters are those of ``pair`` keep all their digits.

    Returns
    -------
    GearPair or None
        None if there is no such pair: inertias that imply another equivalent mass, or elastic supports where those
        of ``pair`` are rigid.
    """
    if model.kind == "full" and pair.rigid:
        return None
    if model.kind == "single":
        pair = replace(pair, b1=0.0, b2=0.0)
    own = pair.to_model(model.kind)
    old, new = own.parameters(), model.parameters()
    values: _Values = {
        "speed": (("omega",), model.omega * pair.omega0 / pair.n1 / RPM),
        "k": (("zeta",), model.zeta * 2 * pair.mass * pair.omega0),
        **_wheel_values(pair, model, 1), **_wheel_values(pair, model, 2),
    }
    changed: dict[str, Any] = {
        field: value for field, (names, value) in values.items() if any(old[n] != new[n] for n in names)}
    if model.error != own.error:
        amplitudes = tuple(a * pair.half_backlash for a in model.error.amplitudes)
        changed |= {"error_amplitudes": amplitudes, "error_phases": model.error.phases}
    if model.stiffness != own.stiffness:
        of_stiffness = {field for kind in STIFFNESS_KINDS.values() for field in kind.pair_fields.values()}
        changed |= {field: GearPair.__dataclass_fields__[field].default for field in of_stiffness}
        changed |= model.stiffness.to_pair(pair.c0)
    found = replace(pair, **changed)
    ignored = () if model.kind == "full" else [n for family in SUPPORTS for n in PARAMETER_PAIRS[family]]
    made = found.to_model(model.kind)  # has to be the model up to rounding
    a, b = ({n: v for n, v in m.parameters().items() if n not in ignored} for m in (made, model))
    same = made.stiffness.kind == model.stiffness.kind and a.keys() == b.keys() and np.allclose(
        [*a.values()], [b[n] for n in a], rtol=_TOLERANCE, atol=1e-15)
    return found if same else None


def _wheel_values(pair: GearPair, model: MeshModel, n: int) -> _Values:
    """Inertia, torque and bearing friction of wheel ``n``; with elastic supports also its mass and support."""
    radius, damping = getattr(pair, f"R{n}"), 2 * pair.mass * pair.omega0
    at = {name: getattr(model, f"{name}{n}") for name in ("J", "q", "beta", *SUPPORTS)}
    values: _Values = {
        f"I{n}": ((f"J{n}",), at["J"] * pair.mass * radius**2),
        f"M{n}0": ((f"q{n}",), at["q"] * pair.scales.force * radius),
        f"b{n}": ((f"beta{n}",), at["beta"] * damping * radius**2),
    }
    if model.kind != "full":
        return values
    return {
        **values,
        f"m{n}": ((f"mu{n}",), at["mu"] * pair.mass),
        f"c{n}": ((f"kappa{n}",), at["kappa"] * pair.c0),
        f"k{n}": ((f"zeta_support{n}", f"mu{n}"), at["zeta_support"] * at["mu"] * damping),
    }
