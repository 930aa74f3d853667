"""What follows from a drawing at once: teeth in mesh to scale, numbers, and curves over the mesh cycle."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from bokeh.models import ColumnDataSource, Line, Range1d

from gearchaos.datasheet.answer import assumed_in_words
from gearchaos.datasheet.quantities import Entry, datasheet, pair_title
from gearchaos.errors import InputError
from gearchaos.explorer.core.drawing import Drawing, changes, label_of
from gearchaos.explorer.core.form_words import in_form_words
from gearchaos.explorer.core.opened import address_of
from gearchaos.explorer.core.style import FIRST_DATA, Panel, SetAttributes
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.design.transverse_section import TransverseSection, transverse_section
from gearchaos.gears.io.units import measured
from gearchaos.gears.operation.loaded_error import loaded_error
from gearchaos.plot.theme import INK

_NAMES = ("contact_ratio", "overlap_ratio", "contact_ratio_under_load", "mesh_stiffness_mean",
          "mesh_stiffness_under_load", "loaded_error_peak_to_peak", "root_stress", "resonance_speed")
"""The quantities of the datasheet that stand beside the drawing."""

_POSITIONS = np.arange(361) / 360.0  # in the mesh cycle
KEPT = "#9a5a00"
_TEETH = 4  # of each wheel on either side of the one in mesh
_ROUGH = 0.5  # share of the points of an outline


CYCLES = (("stiffness", "mesh stiffness [N/µm]"), ("deflection", "loaded error [µm]"))
"""The curves over the mesh cycle: name, and label with unit."""


class Known(NamedTuple):
    """What is known of a design: quantities by name, and curves over the mesh cycle by the names of `CYCLES`; one that
    cannot be computed is left out."""

    entries: Mapping[str, Entry]
    curves: Mapping[str, np.ndarray]

    @classmethod
    def of(cls, design: GearDesign) -> Known:
        curves = {}
        with suppress(InputError):  # without a torque
            curves["stiffness"] = 1e-6 * design.mesh_stiffness(_POSITIONS)
            curves["deflection"] = 1e6 * loaded_error(design, None, _POSITIONS)
        return cls(datasheet(design, _NAMES), curves)


class Sheet(NamedTuple):
    """A drawing at the speed and torque of ``design``, and the one that is kept at the same, None if it cannot run."""

    drawing: Drawing
    kept: Drawing | None
    design: GearDesign
    now: Known
    before: Known | None = None

    @classmethod
    def of(cls, drawing: Drawing, design: GearDesign, kept: Drawing | None = None) -> Sheet:
        other = None if kept is None else kept.reading.design
        before = None if other is None else Known.of(other.at(speed=design.speed, torque=design.torque))
        return cls(drawing, kept, design, Known.of(design), before)


class CycleFigure(Panel):
    """A curve of a sheet over the mesh cycle, and that of the drawing that is kept, dashed."""

    def __init__(self, set_attributes: SetAttributes, name: str, label: str) -> None:
        super().__init__(set_attributes, x_range=Range1d(0.0, 1.0))
        self.name, self.label = name, label
        self.now, self.kept = ColumnDataSource(FIRST_DATA), ColumnDataSource(FIRST_DATA)
        for source, colour, dash in ((self.kept, KEPT, "dashed"), (self.now, INK, "solid")):
            self.figure.add_glyph(source, Line(x="x", y="y", line_color=colour, line_width=1.6, line_dash=dash))

    def show(self, sheet: Sheet) -> None:
        curves = [None if each is None else each.curves.get(self.name) for each in (sheet.now, sheet.before)]
        point = next((curve[:1] for curve in curves if curve is not None), np.ones(1))  # which a line does not show
        for source, curve in zip((self.now, self.kept), curves, strict=True):
            y = point if curve is None else curve
            self._set(source, data={"x": _POSITIONS[: len(y)].astype(np.float32), "y": y.astype(np.float32)})
        self._label("fraction of the mesh period", self.label)


class Teeth(NamedTuple):
    """The teeth in mesh as a picture: its box in mm, the outlines of both wheels, the ends of the path of contact and
    the points of contact. Up is down, as in pictures of a browser."""

    box: str
    outlines: list[str]
    path: tuple[float, ...]
    contacts: list[tuple[float, float]]


def teeth(design: GearDesign) -> Teeth:
    """The teeth of a design in mesh, in the transverse section, with wheel 1 below."""
    section, outlines = section_in_mm(design)
    ends = 1e3 * np.array([section.on_line(section.start), section.on_line(section.end)]) * (1, -1)
    pitch = np.pi * 1e3 * section.geometry.working_diameter[0] / section.geometry.teeth[0]
    (x, y), width, height = ends.mean(axis=0), 4 * pitch, 2.2 * pitch
    touching = [1e3 * section.on_line(distance) * (1, -1) for distance in section.contacts]
    return Teeth(f"{x - width / 2:.3f} {y - height / 2:.3f} {width:.3f} {height:.3f}",
                 [points(outline) for outline in outlines],
                 tuple(round(v, 3) for v in ends.ravel()), [(round(a, 3), round(b, 3)) for a, b in touching])


def section_in_mm(design: GearDesign, backlash: float | None = None) -> tuple[TransverseSection, list[np.ndarray]]:
    """The section of a design, perhaps with another backlash, m, and the outlines (points, 2) of some teeth of both
    wheels with their centres or rim, mm. Up is down."""
    section, count = transverse_section(design), range(-_TEETH, _TEETH + 1)
    section = section if backlash is None else replace(section, backlash=backlash)
    return section, [section.body(wheel, count, _ROUGH) * (1e3, -1e3) for wheel in (0, 1)]


def points(outline: np.ndarray) -> str:
    """An outline as the points of a polygon."""
    return " ".join(f"{a:.3f},{b:.3f}" for a, b in outline)


class Row(NamedTuple):
    """A quantity in words, of the drawing and of the one that is kept, and by how much they differ."""

    name: str
    unit: str
    now: str
    kept: str = ""
    change: str = ""
    hint: str = ""


class SheetText(NamedTuple):
    """What stands beside the form: the pair, its teeth, its numbers, and what changed since a drawing was kept."""

    title: str
    teeth: Teeth
    rows: list[Row]
    changed: list[tuple[str, str, str]] | None
    address: str  # of a page with the drawing that is kept
    assumed: list[tuple[str, str]]  # of which drawing, and what
    notes: tuple[str, ...]


def sheet_text(sheet: Sheet) -> SheetText:
    """A sheet in words."""
    rows, kept, design = [], sheet.kept, sheet.design
    for name, entry in sheet.now.entries.items():
        if (entry.value is None and entry.expected) or (name == "overlap_ratio" and not entry.value):
            continue
        other = sheet.before and sheet.before.entries[name]
        rows.append(Row(entry.words, entry.unit, _shown(entry), "" if other is None else _shown(other),
                        "" if other is None else _difference(other, entry),
                        entry.reason or f"{entry.formula} ({entry.source})"))
    at = [f"{value:.6g} {unit}" for value, unit in ((design.speed, "rpm"), (design.torque, "N m")) if value is not None]
    return SheetText(", ".join([pair_title(design), *at]), teeth(design), rows,
                     None if kept is None else changes(kept, sheet.drawing),
                     "" if kept is None else address_of(kept),
                     _assumed(design, None if kept is None else kept.reading.design),
                     tuple(in_form_words(note, label_of) for note in (*design.warnings, *design.assumptions)))


def _assumed(design: GearDesign, kept: GearDesign | None) -> list[tuple[str, str]]:
    """What is assumed of a design and of one that is kept, once where it is the same."""
    now, before = (each and assumed_in_words(each) for each in (design, kept))
    if before in (None, now):
        return [("of both" if before else "", str(now))]
    return [("of this one", str(now)), ("of the kept one", str(before))]


def _values(entry: Entry) -> tuple[float, ...]:
    value = () if entry.value is None else entry.value
    return value if isinstance(value, tuple) else (value,)


def _shown(entry: Entry) -> str:
    return " / ".join(measured(value) for value in _values(entry)) or "not known"


def _difference(before: Entry, after: Entry) -> str:
    """By how much the values grew, in per cent; empty where they are the same."""
    both = zip(_values(before), _values(after), strict=False)
    grown = [100 * (b / a - 1) if a else 0.0 for a, b in both]
    return " / ".join(f"{each:+.3g} %" for each in grown) if any(abs(each) >= 0.05 for each in grown) else ""
