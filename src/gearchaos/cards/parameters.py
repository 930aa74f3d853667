"""Cards of models and of studies."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields

import numpy as np

from gearchaos.cards.card import Card
from gearchaos.cards.drawing import EMPHASIS, Drawing, around
from gearchaos.gears.operating import OperatingModel
from gearchaos.model import MeshModel, has_effect, mesh_stiffness, transmission_error
from gearchaos.studies.study import Study

_KINDS = {"single": "Single-degree-of-freedom model", "torsional": "Torsional model",
          "full": "Model with elastic supports"}
_SHOWN = ("kind", "omega", "zeta", "q1", "q2", "error", "stiffness", "initial", "gears")
"""Fields of a model that have rows of their own, or none."""

_ROW_OF = {"omega": "mesh frequency ω", "zeta": "mesh damping ζ", "q0": "static load q₀",
           "eps1": "transmission error ε", "speed": "operating point", "torque": "operating point"}
"""The row of a model that a study does not have if this parameter is one of its axes."""

_SAMPLES = 400

_MOST_LISTED = 8
"""Most harmonics whose amplitudes are listed."""


def model_card(model: MeshModel) -> Card:
    """The card of a model: its parameters, and its stiffness and transmission error over two mesh periods."""
    title = _KINDS[model.kind] + (" of given gears" if isinstance(model, OperatingModel) else "")
    return Card(title, list(model_rows(model)), excitation(model).svg)


def model_rows(model: MeshModel) -> Iterator[tuple[str, str]]:
    """Names and values of the main parameters of a model, and of all others that differ from their defaults."""
    if isinstance(model, OperatingModel):
        yield "operating point", f"{model.value('speed'):.6g} rpm, {model.value('torque'):.6g} N m"
    yield "mesh frequency ω", f"{model.omega:.6g}"
    yield "mesh damping ζ", f"{model.zeta:.6g}"
    yield "static load q₀", f"{model.q1:.6g}" if model.q1 == model.q2 else f"{model.q1:.6g}, {model.q2:.6g}"
    yield "transmission error ε", _listed(model.error.amplitudes)
    yield "mesh stiffness χ", model.stiffness.describe()
    standard = MeshModel(kind=model.kind)
    for f in fields(MeshModel):
        value = getattr(model, f.name)
        if f.name not in _SHOWN and has_effect(f.name, model.kind) and value != getattr(standard, f.name):
            yield f.name, f"{value:.6g}"
    if model.initial:
        yield "initial values", ", ".join(f"{name} = {value:.6g}" for name, value in model.initial.items())


def _listed(values: tuple[float, ...]) -> str:
    """The amplitudes of harmonics, or of many of them their number and the largest."""
    if len(values) > _MOST_LISTED and any(values):
        return f"{len(values)} harmonics of at most {max(map(abs, values)):.4g}"
    return ", ".join(f"{value:.4g}" for value in values) if any(values) else "none"


def excitation(model: MeshModel) -> Drawing:
    """The mesh stiffness over two mesh periods, and below it the transmission error in another colour."""
    tau = np.linspace(0, 2 * model.period, _SAMPLES)
    curves = [_scaled(mesh_stiffness(model, tau)), _scaled(transmission_error(model, tau))]
    drawing = Drawing("mesh stiffness, and below it transmission error, over two mesh periods",
                      (0, 2 * model.period), (-1.15, 1.05))
    drawing.line(tau, curves[0])
    drawing.line(tau, curves[1] - 1.1, colour=EMPHASIS)
    return drawing


def _scaled(values: np.ndarray) -> np.ndarray:
    """Values from 0 to 1; 0.5 if all are equal."""
    low, high = around(values)
    return (values - low) / (high - low)


def study_card(study: Study) -> Card:
    """The card of a study that is not computed yet: its axes, its model and its size."""
    axes = [getattr(study, name) for name in study.axis_fields]
    rows = [(axis.name, f"{axis.start:.6g} to {axis.stop:.6g}, {axis.count} values")
            for axis in axes if axis is not None]
    for name in study.option_types():
        value = getattr(study, name)
        if value != study.__dataclass_fields__[name].default:
            rows.append((name, str(value)))
    rows.append(("to compute", f"{study.count:,} item{'s' * (study.count != 1)}"))
    varied = {_ROW_OF.get(name) for name, _ in rows}
    model = [row for row in model_rows(study.model) if row[0] not in varied]
    return Card(f"Study: {study.kind}", [*rows, *model], excitation(study.model).svg)
