"""Cards of gears: a pair by its drawing, and a pair by its parameters in SI."""

from __future__ import annotations

import math
from typing import Any

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

_MOST_VALUES = 6
"""Values of a list that are shown; the number of the others is stated."""


def digits(value: Any, factor: float = 1.0) -> str:
    """A number of six digits, or several separated by slashes, with a minus sign that is no hyphen."""
    values = value if isinstance(value, tuple) else (value,)
    shown = [f"{v * factor:.6g}".replace("-", "−") for v in values]
    rest = f" and {len(shown) - _MOST_VALUES} more" if len(shown) > _MOST_VALUES else ""
    return " / ".join(shown[:_MOST_VALUES]) + rest or "none"


def inputs_in_words(design: GearDesign) -> dict[str, str]:
    """The inputs that describe a pair, each in words with its value; without those that were left out."""
    d, g, rack = design, design.geometry, design.rack
    stiffness, error = (given if isinstance(given, str) else f"file {given.path}"
                        for given in (d.stiffness, d.transmission_error or "none"))
    found = {
        "teeth": digits(d.teeth),
        "normal module": f"{d.module * 1e3:.6g} mm",
        "normal pressure angle": f"{math.degrees(d.pressure_angle):.6g}°",
        "helix angle": f"{math.degrees(d.helix_angle):.6g}°" if d.helix_angle else "",
        "face width": f"{digits(d.face_width, 1e3)} mm",
        "centre distance": f"{g.centre_distance * 1e3:.6g} mm",
        "profile shift coefficients": digits(g.profile_shift),
        "basic rack": f"h_aP {rack.addendum:g}, h_fP {rack.dedendum:g}, ρ_fP {rack.root_radius:g}, in modules",
        "bore": "" if d.bore is None else f"{digits(d.bore, 1e3)} mm",
        "quality": "" if d.quality is None else f"{d.quality.standard}, grade {digits(d.quality.grades)}",
        "backlash, line of action, total":
            "" if d.backlash is None else f"{d.backlash_line_of_action * 1e3:.6g} mm",
        "damping ratio of the mesh": "" if d.damping_ratio is None else f"{d.damping_ratio:g}",
        "stiffness by": stiffness,
        "transmission error by": error,
        "speed of wheel 1": "" if d.speed is None else f"{d.speed:.6g} rpm",
        "torque at wheel 1": "" if d.torque is None else f"{d.torque:.6g} N m",
    }
    return {name: value for name, value in found.items() if value}


def design_card(design: GearDesign) -> Card:
    """The card of a gear design: its main dimensions, and both wheels in mesh to scale."""
    kind = "spur" if design.helix_angle == 0 else "helical"
    try:
        error = design.error_harmonics
        source = "from quality" if design.transmission_error == "from quality" else error.source
        excited = source if design.exact else f"{source}, largest harmonic {1e6 * max(error.amplitudes):.4g} µm"
    except InputError as missing:
        excited = str(missing)
    known = {**inputs_in_words(design), "contact ratio": f"{design.geometry.contact_ratio:.4g}",
             "transmission error": excited}
    shown = ("normal module", "helix angle", "centre distance", "face width", "contact ratio", "quality",
             "transmission error", "backlash, line of action, total", "damping ratio of the mesh", "speed of wheel 1",
             "torque at wheel 1")
    return Card(f"Gear design: {kind} gears, {' and '.join(map(str, design.teeth))} teeth",
                [(name, known[name]) for name in shown if name in known], _wheels(design).svg)


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
