"""Cards of inputs: models, gear pairs by their drawing or in SI, and studies that are not computed yet."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import fields
from typing import Any

import numpy as np

from gearchaos.cards.card import EMPHASIS, Card, Drawing, around, card
from gearchaos.errors import InputError
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.design.transverse_section import transverse_section
from gearchaos.gears.mesh.pair import GearPair
from gearchaos.gears.operation.operating import OperatingModel
from gearchaos.gears.train.model import TrainModel
from gearchaos.gears.train.train import Train
from gearchaos.gears.transmission_error.harmonics import FROM_QUALITY
from gearchaos.model import MeshModel, has_effect, mesh_stiffness, transmission_error
from gearchaos.studies.core.study import Study

_KINDS = {"single": "Single-degree-of-freedom model", "torsional": "Torsional model",
          "full": "Model with elastic supports"}
_SHOWN = ("kind", "omega", "zeta", "q1", "q2", "error", "stiffness", "damping_law", "initial", "gears")
"""Fields of a model that have rows of their own, or none."""

_ROW_OF = {"omega": "mesh frequency ω", "zeta": "mesh damping ζ", "q0": "static load q₀",
           "eps1": "transmission error ε", "speed": "operating point", "torque": "operating point"}
"""The row of a model that a study does not have if this parameter is one of its axes."""

_SAMPLES = 400

_MOST_LISTED = 8  # most harmonics whose amplitudes are listed


@card.register
def _model(model: MeshModel) -> Card:
    """Its parameters, and its stiffness and transmission error over two mesh periods."""
    title = _KINDS[model.kind] + (" of given gears" if isinstance(model, OperatingModel) else "")
    return Card(title, list(_model_rows(model)), _excitation(model))


@card.register
def _train(train: Train) -> Card:
    """Its bodies, shafts and meshes, and how they turn."""
    rows = [("operating point", f"{train.speed:.6g} rpm of {train.bodies[0].name}, {train.torque:.6g} N m")]
    for body in train.bodies:
        moves = f"{body.inertia:.4g} kg m²" if body.inertia is not None else (
            "held" if body.fixed else "prescribed motion")
        rows.append(("body", f"{body.name}: {moves}, {train.speeds[body.name]:.6g} rpm"))
    rows += [("shaft", f"{shaft.name}: {shaft.stiffness:.4g} N m/rad") for shaft in train.shafts]
    rows += [("mesh", f"{mesh.name}: {mesh.teeth[0]}/{mesh.teeth[1]} teeth, backlash {mesh.backlash * 1e3:.4g} mm")
             for mesh in train.meshes]
    rows += [("assumed", text) for text in train.assumptions]
    rows += [("mesh damping", TrainModel(train).damping_in_words), ("common period", f"{train.period * 1e3:.6g} ms")]
    return Card("Gear train", rows)


@card.register
def _train_model(model: TrainModel) -> Card:
    """The card of its train."""
    return card(model.train)


def _model_rows(model: MeshModel) -> Iterator[tuple[str, str]]:
    """Names and values of the main parameters of a model, and of all others that differ from their defaults."""
    if isinstance(model, OperatingModel):
        yield "operating point", f"{model.value('speed'):.6g} rpm, {model.value('torque'):.6g} N m"
    yield "mesh frequency ω", f"{model.omega:.6g}"
    law = f" {model.law.words}" * model.law.in_contact
    yield "mesh damping ζ", f"{model.zeta:.6g}{law}"
    yield "static load q₀", f"{model.q1:.6g}" if model.q1 == model.q2 else f"{model.q1:.6g}, {model.q2:.6g}"
    amplitudes = model.error.amplitudes
    listed = ", ".join(f"{value:.4g}" for value in amplitudes)
    if len(amplitudes) > _MOST_LISTED:
        listed = f"{len(amplitudes)} harmonics of at most {max(map(abs, amplitudes)):.4g}"
    yield "transmission error ε", listed if any(amplitudes) else "none"
    yield "mesh stiffness χ", model.stiffness.describe()
    standard = MeshModel(kind=model.kind)
    for f in fields(MeshModel):
        value = getattr(model, f.name)
        if f.name not in _SHOWN and has_effect(f.name, model.kind) and value != getattr(standard, f.name):
            yield f.name, f"{value:.6g}"
    if model.initial:
        yield "initial values", ", ".join(f"{name} = {value:.6g}" for name, value in model.initial.items())


def _excitation(model: MeshModel) -> str:
    """The mesh stiffness over two mesh periods, and below it the transmission error in another colour."""
    tau = np.linspace(0, 2 * model.period, _SAMPLES)
    curves = mesh_stiffness(model, tau), transmission_error(model, tau)
    # each from 0 to 1, or 0.5 if all its values are equal
    chi, error = ((values - low) / (high - low) for values in curves for low, high in [around(values)])
    drawing = Drawing("mesh stiffness, and below it transmission error, over two mesh periods",
                      (0, 2 * model.period), (-1.15, 1.05))
    drawing.line(tau, chi)
    drawing.line(tau, error - 1.1, colour=EMPHASIS)
    return drawing.svg


@card.register
def _study(study: Study) -> Card:
    """What is not computed yet: its axes, its model and its size."""
    axes = [getattr(study, name) for name in study.axis_fields]
    rows = [(axis.name, f"{axis.start:.6g} to {axis.stop:.6g}, {axis.count} values")
            for axis in axes if axis is not None]
    for name in study.option_types():
        value = getattr(study, name)
        if value != study.__dataclass_fields__[name].default:
            rows.append((name, str(value)))
    rows.append(("to compute", f"{study.count:,} item{'s' * (study.count != 1)}"))
    varied = {_ROW_OF.get(name) for name, _ in rows}
    model = [row for row in _model_rows(study.model) if row[0] not in varied]
    return Card(f"Study: {study.kind}", [*rows, *model], _excitation(study.model))


_MOST_TEETH = 200  # number of teeth above which a wheel is drawn as a disc
_MOST_VALUES = 6  # values of a list that are shown; the number of the others is stated


def digits(value: Any, factor: float = 1.0) -> str:
    """A number of six digits, or several separated by slashes, with a minus sign that is no hyphen."""
    values = value if isinstance(value, tuple) else (value,)
    shown = [f"{v * factor:.6g}".replace("-", "−") for v in values]
    rest = f" and {len(shown) - _MOST_VALUES} more" if len(shown) > _MOST_VALUES else ""
    return " / ".join(shown[:_MOST_VALUES]) + rest or "none"


def inputs_in_words(design: GearDesign) -> dict[str, str]:
    """The inputs that describe a pair, each in words with its value; without those that were left out."""
    d, g, rack = design, design.geometry, design.rack
    relief, ends = d.tip_relief, ""
    if relief is not None and any(relief.amount):
        begins = "" if relief.start_diameter is None else f" from diameter {digits(relief.start_diameter, 1e3)} mm"
        ends = f"{digits(relief.amount, 1e6)} µm, {relief.shape}{begins}"
    stiffness, error = (given if isinstance(given, str) else f"file {given.path}"
                        for given in (d.stiffness, d.transmission_error or "none"))
    found = {
        "teeth": digits(d.teeth) + ", wheel 2 a ring" * d.internal,
        "normal module": f"{d.module * 1e3:.6g} mm",
        "normal pressure angle": f"{math.degrees(d.pressure_angle):.6g}°",
        "helix angle": f"{math.degrees(d.helix_angle):.6g}°" if d.helix_angle else "",
        "face width": f"{digits(d.face_width, 1e3)} mm",
        "centre distance": f"{g.centre_distance * 1e3:.6g} mm",
        "profile shift coefficients": digits(g.profile_shift),
        "basic rack": f"h_aP {rack.addendum:g}, h_fP {rack.dedendum:g}, ρ_fP {rack.root_radius:g}, in modules",
        "bore": "" if d.bore is None else f"{digits(d.bore, 1e3)} mm",
        "tip relief": ends,
        "lead crowning": f"{d.lead_crowning * 1e6:.6g} µm" if d.lead_crowning else "",
        "lead slope": f"{digits(d.lead_slope, 1e6)} µm over the face width" if d.lead_slope else "",
        "load sharing": d.sharing_in_words,
        "quality": "" if d.quality is None else f"{d.quality.standard}, grade {digits(d.quality.grades)}" + (
            "" if d.quality.deviations is None else f", deviations {digits(d.quality.deviations)} of the permissible"),
        "backlash, line of action, total":
            "" if d.backlash is None else f"{d.backlash_line_of_action * 1e3:.6g} mm",
        "damping ratio of the mesh":
            "" if d.damping_ratio is None else f"{d.damping_ratio:g}, {d.law.words}",
        "stiffness by": stiffness,
        "transmission error by": error,
        "speed of wheel 1": "" if d.speed is None else f"{d.speed:.6g} rpm",
        "torque at wheel 1": "" if d.torque is None else f"{d.torque:.6g} N m",
    }
    return {name: value for name, value in found.items() if value}


@card.register
def _design(design: GearDesign) -> Card:
    """Its main dimensions, and both wheels in mesh to scale, one beside the other."""
    section, outlines = transverse_section(design, None), []
    for wheel in (0, 1):
        if section.geometry.teeth[wheel] > _MOST_TEETH and not design.internal:
            angle, radius = np.linspace(0, 2 * np.pi, 181), section.geometry.working_diameter[wheel] / 2
            outline = section.centres[wheel] + radius * np.column_stack([np.cos(angle), np.sin(angle)])
        else:
            outline = section.body(wheel, detail=0.5)
        outlines.append(np.vstack([outline, outline[:1]])[:, ::-1])
    x, y = (around(*(outline[:, axis] for outline in outlines)) for axis in (0, 1))
    drawing = Drawing("both wheels in mesh", x, y, equal=True)
    for outline in outlines:
        drawing.line(*outline.T, width=0.7, fill="currentColor")
    kind = "internal " * design.internal + ("spur" if design.helix_angle == 0 else "helical")
    try:
        error = design.error_harmonics
        method = design.transmission_error
        source = method if method in FROM_QUALITY else error.source
        excited = source if design.exact else f"{source}, largest harmonic {1e6 * max(error.amplitudes):.4g} µm"
    except InputError as missing:
        excited = str(missing)
    known = {**inputs_in_words(design), "contact ratio": f"{design.geometry.contact_ratio:.4g}",
             "transmission error": excited}
    shown = ("normal module", "helix angle", "centre distance", "face width", "contact ratio", "quality",
             "transmission error", "backlash, line of action, total", "damping ratio of the mesh", "speed of wheel 1",
             "torque at wheel 1")
    return Card(f"Gear design: {kind} gears, {' and '.join(map(str, design.teeth))} teeth",
                [(name, known[name]) for name in shown if name in known], drawing.svg)


@card.register
def _pair(pair: GearPair) -> Card:
    rows = [("teeth", f"{pair.n1} and {pair.n2}"), ("base radii", f"{1e3 * pair.R1:.6g} and {1e3 * pair.R2:.6g} mm"),
            ("reference stiffness", f"{1e-6 * pair.c0:.6g} N/µm"),
            ("torques", f"{pair.M10:.6g} and {pair.M20:.6g} N m")]
    return Card("Gear pair", rows, _excitation(pair.to_model()))
