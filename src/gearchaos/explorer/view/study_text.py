"""The point and its map as text: a Python script, and a study file in TOML."""

from __future__ import annotations

import re
from dataclasses import fields
from typing import Any

import tomlkit

from gearchaos.explorer.view.pair import pair_at
from gearchaos.explorer.view.state import View, stiffness_name
from gearchaos.gears.pair import GearPair
from gearchaos.model import SCALARS, MeshModel, Stiffness
from gearchaos.studies.axis import Axis

_CLASSES = re.compile(r"\b(MeshModel|TransmissionError|TwoLevelStiffness|HarmonicStiffness|SteppedStiffness)\(")
"""Names of classes in the ``repr`` of a model; a script has to write ``gc.MeshModel`` and so on."""


def as_python(view: View, pair: GearPair | None = None) -> str:
    """A script that computes what the page shows, scaled to the units of the pair if there is one."""
    model = _CLASSES.sub(r"gc.\1(", repr(view.point))
    x, y = (f'gc.Axis("{a.name}", {a.start!r}, {a.stop!r}, {a.count})' for a in (view.x, view.y))
    return (
        "import gearchaos as gc\n\n"
        f"model = {model}\n"
        "verdict = gc.regime(model)\n"
        "motion = gc.steady(model, verdict)\n"
        f"zones = gc.zones(model, {x}, {y}, progress=True)\n"
        f"{_scaled(pair)}"
        "print(verdict.label, verdict.reason)\n"
        "gc.plot.dossier(motion)\n"
        "gc.plot.zones(zones)\n"
    )


def _scaled(pair: GearPair | None) -> str:
    """The lines of a script that scale its results."""
    if pair is None:
        return ""
    return f"pair = gc.{pair!r}\nmotion, zones = gc.physical(motion, pair), gc.physical(zones, pair)\n"


def as_toml(view: View, pair: GearPair | None = None) -> str:
    """A study file of the point and its map.

    With a pair it describes the physical pair at the point, if that exists, otherwise the dimensionless model.
    """
    model, document = view.point, tomlkit.document()
    physical = pair and pair_at(pair, model)
    if physical:
        document.add(tomlkit.comment("The pair at the point chosen; numbers without a unit are in SI."))
        document["gearpair"] = {"kind": model.kind, **_fields(physical)}
    else:
        if pair:
            document.add(tomlkit.comment("No pair of the same mass and kind of supports has these values."))
        document["model"] = _model(model)
    if model.initial:
        document["initial"] = dict(model.initial)
    document["study"] = {"kind": "zones", "x": _axis(view.x), "y": _axis(view.y)}
    return tomlkit.dumps(document)


def _fields(pair: GearPair) -> dict[str, Any]:
    """The fields of a pair that are set."""
    values = {f.name: getattr(pair, f.name) for f in fields(pair)}
    return {n: list(v) if isinstance(v, tuple) else v for n, v in values.items() if v not in (None, ())}


def _model(model: MeshModel) -> dict[str, Any]:
    """The table ``[model]`` of a study file."""
    return {
        "kind": model.kind, **{n: getattr(model, n) for n in SCALARS},
        "error": {"amplitudes": list(model.error.amplitudes), "phases": list(model.error.phases)},
        "stiffness": {"kind": stiffness_name(model), **_stiffness(model.stiffness)},
    }


def _stiffness(stiffness: Stiffness) -> dict[str, Any]:
    """The keys of ``[model.stiffness]`` but for its kind; they have the names of the fields."""
    values = {f.name: getattr(stiffness, f.name) for f in fields(stiffness)}
    return {n: list(v) if isinstance(v, tuple) else v for n, v in values.items()}


def _axis(axis: Axis) -> str:
    return f"{axis.name}={axis.start!r}:{axis.stop!r}:{axis.count}"
