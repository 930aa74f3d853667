"""The page of a datasheet: the values that its template needs, from the quantities of a design."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from importlib import metadata
from importlib.resources import files
from typing import Any

import jinja2
from markupsafe import Markup, escape

from gearchaos.datasheet.answer import Answer, factor_and_share, in_words
from gearchaos.datasheet.pictures import factor_picture, pictures
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.design.values import DataFile
from gearchaos.gears.sheet import Entry, shown_value
from gearchaos.gears.units import measured

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


def sheet_html(answers: Sequence[Answer]) -> str:
    """The datasheet of a design as one self-contained HTML document, which begins with the answer at each torque.

    Parameters
    ----------
    answers : sequence of Answer
        Of one design at one or more torques. The pair, its quantities and its curves are shown for the first one, of
        the others the quantities that differ.

    Returns
    -------
    str
        The page refers to no other files and contains no scripts.
    """
    first, *others = answers
    differing = [
        (f"{answer.design.torque:.6g}", _groups({n: e for n, e in answer.entries.items() if e != first.entries[n]}))
        for answer in others]
    return _environment().get_template("sheet.html.j2").render(
        css=Markup(_template("sheet.css")), title=first.title, answers=[_answer(first, first.notes), *(
            _answer(each, [note for note in each.notes if note not in first.notes]) for each in others)],
        problem=str(first.problem), inputs=list(_inputs(first.design)), pictures=list(pictures(first.design)),
        groups=_groups(first.entries),
        differing=differing, missing=[(reason, [_words(name) for name in names]) for reason, names in first.absent],
        count=len(first.entries), version=metadata.version("gearchaos"),
    )


def _answer(answer: Answer, notes: Sequence[str]) -> dict[str, Any]:
    """What the template shows of an answer, with these of its notes."""
    windows = [{
        "range": in_words(each), "contact": each.contact, "at": measured(each.speed_of_largest, 3),
        "factor": measured(each.dynamic_factor, 3),
        "reached": [f"{r.motion} {' in '.join(factor_and_share(r).split())}{' of the range' * (r.share < 1)}"
                    for r in each.reached],
    } for each in (answer.speeds.windows if answer.speeds else ())]
    return {
        "conclusion": answer.conclusion, "facts": list(answer.facts), "basis": list(answer.basis), "windows": windows,
        "notes": notes, "problem": answer.problem,
        "ratio": "" if answer.speeds is None else measured(answer.speeds.quasi_static_ratio, 3),
        "torque": "" if answer.design.torque is None else f"{answer.design.torque:.6g} N m",
        "picture": None if answer.speeds is None else factor_picture(answer.speeds),
    }


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


def _method(given: str | DataFile) -> str:
    """A method by its name, or the file that is used."""
    return given if isinstance(given, str) else f"file {given.path}"


def _groups(entries: Mapping[str, Entry]) -> list[tuple[str, list[dict[str, Any]]]]:
    """The rows of the tables by heading, in the order of the quantities."""
    out: dict[str, list[dict[str, Any]]] = {}
    for name, entry in entries.items():
        row = {
            "id": name, "name": _words(name), "symbol": entry.symbol,
            "value": None if entry.value is None else _values(shown_value(entry)), "expected": entry.expected,
            "unit": "" if entry.value == () else _UNITS.get(entry.unit, entry.unit), "formula": entry.formula,
            "source": entry.source, "reason": entry.reason if entry.expected else "see Not computed",
        }
        out.setdefault(entry.group, []).append(row)
    return list(out.items())


def _words(name: str) -> str:
    """The name of a quantity in words."""
    return _WORDS.get(name, name.replace("_", " "))


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
