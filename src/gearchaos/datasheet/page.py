"""The page of a datasheet: the values that its template needs, from the quantities of a design."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cache
from importlib import metadata
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import jinja2
from markupsafe import Markup, escape

from gearchaos.datasheet.pictures import pictures
from gearchaos.errors import InputError
from gearchaos.gears.design.gear_design import GearDesign, sentences
from gearchaos.gears.sheet import Entry, shown_value, with_scanned_speeds

if TYPE_CHECKING:
    import xarray as xr

_MOST_VALUES = 6
"""Values of a list that are shown; the number of the others is stated."""

_WORDS = {
    "Kv_ISO_B": "dynamic factor by ISO 6336-1, method B", "Kv_ISO_C": "dynamic factor by ISO 6336-1, method C",
    "Kv_AGMA": "dynamic factor by AGMA 2001-D04", "backlash_line_of_action": "total backlash along the line of action",
    "lower_limit_ratio": "resonance ratio where main resonance begins", "main_start": "start of the main resonance",
    "main_end": "end of the main resonance", "supercritical_start": "start of the supercritical range",
}
"""Names in words of quantities whose names do not read as words."""

_UNITS = {"deg": "°", "kg*m^2": "kg m²"}
"""Units as they are printed, where that differs from their names."""


def sheet_html(entries: Mapping[str, Entry], design: GearDesign, factors: xr.Dataset | None = None) -> str:
    """The datasheet of a design as one self-contained HTML document.

    Parameters
    ----------
    entries : dict of Entry
        The quantities by name, from `gearchaos.gears.sheet.datasheet`; one without a value has its reason shown.
    design : GearDesign
        The design, which is drawn with its stiffness and transmission error.
    factors : Dataset, optional
        The dynamic factor along the speed, from `gearchaos.dynamic_factor`, to be drawn as well; quantities of a design
        without speed then refer to it.

    Returns
    -------
    str
        The page refers to no other files and contains no scripts.
    """
    if factors is not None:
        entries = with_scanned_speeds(entries)
    return _environment().get_template("sheet.html.j2").render(
        css=Markup(_template("sheet.css")), title=_title(design), inputs=list(_inputs(design)),
        notes=list(_notes(design)), pictures=list(pictures(design, factors)), groups=_groups(entries),
        missing=_missing(entries), count=len(entries), version=metadata.version("gearchaos"),
    )


def _template(name: str) -> str:
    """A file of the folder of templates."""
    return files("gearchaos.datasheet").joinpath("templates", name).read_text(encoding="utf-8")


@cache
def _environment() -> jinja2.Environment:
    """The environment of the template, with the filter for formulas."""
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(_template), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["maths"] = _maths
    environment.filters["sentence"] = _sentence
    return environment


_INDEX = re.compile(r"_([A-Za-z0-9α-ω]+)")


def _maths(text: str) -> Markup:
    """A formula as HTML, with what follows an underscore as a subscript: d_b1 becomes d<sub>b1</sub>."""
    return Markup(_INDEX.sub(r"<sub>\1</sub>", str(escape(text))))


_SYMBOL = re.compile(r"(?<!\w)([^\W\d_])_([A-Za-z0-9α-ω]+)")


def _sentence(text: str) -> Markup:
    """A sentence as HTML, with the indices of symbols of one letter as subscripts; other names keep underscores."""
    return Markup(_SYMBOL.sub(r"\1<sub>\2</sub>", str(escape(text))))


def _title(design: GearDesign) -> str:
    """The pair in a few words."""
    kind = "Helical" if design.helix_angle else "Spur"
    return f"{kind} gear pair {design.teeth[0]}/{design.teeth[1]}, module {design.module * 1e3:.6g} mm"


def _inputs(design: GearDesign) -> Iterator[tuple[str, str]]:
    """The inputs that describe the pair, in words, with their values."""
    g, rack = design.geometry, design.rack
    yield "teeth", _values(design.teeth)
    yield "normal module", f"{design.module * 1e3:.6g} mm"
    yield "normal pressure angle", f"{math.degrees(design.pressure_angle):.6g}°"
    if design.helix_angle:
        yield "helix angle", f"{math.degrees(design.helix_angle):.6g}°"
    yield "face width", f"{_values(design.face_width, 1e3)} mm"
    yield "centre distance", f"{g.centre_distance * 1e3:.6g} mm"
    yield "profile shift coefficients", _values(g.profile_shift)
    yield "basic rack", f"h_aP {rack.addendum:g}, h_fP {rack.dedendum:g}, ρ_fP {rack.root_radius:g}, in modules"
    if design.bore is not None:
        yield "bore", f"{_values(design.bore, 1e3)} mm"
    if design.quality is not None:
        yield "quality", f"{design.quality.standard}, grade {_values(design.quality.grades)}"
    if design.backlash is not None:
        yield "backlash, line of action, total", f"{design.backlash_line_of_action * 1e3:.6g} mm"
    if design.damping_ratio is not None:
        yield "damping ratio of the mesh", f"{design.damping_ratio:g}"
    for name in ("stiffness", "transmission_error"):
        yield f"{name.replace('_', ' ')} by", _method(getattr(design, name) or "none")
    if design.speed is not None:
        yield "speed of wheel 1", f"{design.speed:.6g} rpm"
    if design.torque is not None:
        yield "torque at wheel 1", f"{design.torque:.6g} N m"


def _method(given: Any) -> str:
    """A method by its name, or the file that is used."""
    return given if isinstance(given, str) else f"file {getattr(given, 'table', None) or given.orders}"


def _notes(design: GearDesign) -> Iterator[str]:
    """What the designer should know: unusual values, limits of the transmission error and of the stiffness."""
    yield from (*design.warnings, *design.assumptions)
    with suppress(InputError):  # the quantities say what is missing
        yield from sentences(design.mesh_stiffness.notes)


def _groups(entries: Mapping[str, Entry]) -> list[tuple[str, list[dict[str, Any]]]]:
    """The rows of the tables by heading, in the order of the quantities."""
    out: dict[str, list[dict[str, Any]]] = {}
    for name, entry in entries.items():
        row = {
            "id": name, "name": _WORDS.get(name, name.replace("_", " ")), "symbol": entry.symbol,
            "value": None if entry.value is None else _values(shown_value(entry)), "expected": entry.expected,
            "unit": "" if entry.value == () else _UNITS.get(entry.unit, entry.unit), "formula": entry.formula,
            "source": entry.source, "reason": _reason(entry),
        }
        out.setdefault(entry.group, []).append(row)
    return list(out.items())


def _missing(entries: Mapping[str, Entry]) -> list[tuple[str, list[str]]]:
    """The reasons why quantities have no value, each with the names of these quantities in words."""
    out: dict[str, list[str]] = {}
    for name, entry in entries.items():
        if entry.value is None and not entry.expected:
            out.setdefault(_reason(entry), []).append(_WORDS.get(name, name.replace("_", " ")))
    return list(out.items())


def _reason(entry: Entry) -> str:
    """Why a quantity has no value, without the words that an error has for an input left out."""
    return entry.reason.replace("; got None", "")


def _values(value: Any, factor: float = 1.0) -> str:
    """A number, or several separated by slashes."""
    if not isinstance(value, tuple):
        return _number(value * factor)
    shown = [_number(v * factor) for v in value]
    if not shown:
        return "none"
    rest = len(shown) - _MOST_VALUES
    return " / ".join(shown[:_MOST_VALUES]) + (f" and {rest} more" if rest > 0 else "")


def _number(value: float) -> str:
    """A number of six digits, with a minus sign that is no hyphen."""
    return f"{value:.6g}".replace("-", "−")
