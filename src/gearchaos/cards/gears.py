"""Cards of gears: a pair by its drawing, and a pair by its parameters in SI."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gearchaos.cards.card import Card
from gearchaos.cards.drawing import Drawing, around
from gearchaos.cards.parameters import excitation
from gearchaos.errors import InputError
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.design.transverse_section import transverse_section
from gearchaos.gears.pair import GearPair

_MOST_TEETH = 200
"""Number of teeth above which a wheel is drawn as a disc."""


def design_card(design: GearDesign) -> Card:
    """The card of a gear design: its main dimensions, and both wheels in mesh to scale."""
    kind = "spur" if design.helix_angle == 0 else "helical"
    teeth = " and ".join(map(str, design.teeth))
    return Card(f"Gear design: {kind} gears, {teeth} teeth", list(_design_rows(design)), _wheels(design).svg)


def _design_rows(design: GearDesign) -> Iterator[tuple[str, str]]:
    geometry = design.geometry
    yield "module", f"{1e3 * design.module:.6g} mm"
    if design.helix_angle:
        yield "helix angle", f"{np.degrees(design.helix_angle):.6g}°"
    yield "centre distance", f"{1e3 * geometry.centre_distance:.6g} mm"
    yield "face width", " and ".join(f"{1e3 * width:.6g}" for width in dict.fromkeys(design.face_width)) + " mm"
    yield "contact ratio", f"{geometry.contact_ratio:.4g}"
    if design.quality is not None:
        grades = " and ".join(map(str, dict.fromkeys(np.atleast_1d(design.quality.grade).tolist())))
        yield "accuracy", f"{design.quality.standard}, grade {grades}"
    yield "transmission error", _transmission_error(design)
    if design.backlash is not None:
        yield "backlash, line of action, total", f"{1e3 * design.backlash_line_of_action:.6g} mm"
    if design.damping_ratio is not None:
        yield "damping ratio ζ", f"{design.damping_ratio:.4g}"
    if design.speed is not None:
        yield "speed", f"{design.speed:.6g} rpm"
    if design.torque is not None:
        yield "torque", f"{design.torque:.6g} N m"


def _transmission_error(design: GearDesign) -> str:
    """What the transmission error is from, with its largest harmonic; or why it is not known."""
    try:
        error = design.error_harmonics
    except InputError as missing:
        return str(missing)
    source = "from quality" if design.transmission_error == "from quality" else error.source
    return source if design.exact else f"{source}, largest harmonic {1e6 * max(error.amplitudes):.4g} µm"


def _wheels(design: GearDesign) -> Drawing:
    """The outlines of both wheels, one beside the other."""
    section = transverse_section(design, None)
    outlines = []
    for wheel in (0, 1):
        if section.geometry.teeth[wheel] > _MOST_TEETH:
            angle, radius = np.linspace(0, 2 * np.pi, 181), section.geometry.working_diameter[wheel] / 2
            outline = section.centres[wheel] + radius * np.column_stack([np.cos(angle), np.sin(angle)])
        else:
            outline = section.outline(wheel, detail=0.5)
        outlines.append(np.vstack([outline, outline[:1]])[:, ::-1])
    x, y = (around(*(outline[:, axis] for outline in outlines)) for axis in (0, 1))
    drawing = Drawing("both wheels in mesh", x, y, equal=True)
    for outline in outlines:
        drawing.line(*outline.T, width=0.7, fill="currentColor")
    return drawing


def pair_card(pair: GearPair) -> Card:
    """The card of a gear pair in SI, with its excitation."""
    rows = [("teeth", f"{pair.n1} and {pair.n2}"), ("base radii", f"{1e3 * pair.R1:.6g} and {1e3 * pair.R2:.6g} mm"),
            ("reference stiffness", f"{1e-6 * pair.c0:.6g} N/µm"),
            ("torques", f"{pair.M10:.6g} and {pair.M20:.6g} N m")]
    return Card("Gear pair", rows, excitation(pair.to_model()).svg)
