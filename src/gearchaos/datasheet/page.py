"""The page of a datasheet: the values that its template needs, and the pictures, as SVG within the page."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib import metadata
from importlib.resources import files
from typing import Any

import jinja2
import matplotlib
from markupsafe import Markup, escape
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gearchaos import plot
from gearchaos.cards.inputs import digits, inputs_in_words
from gearchaos.datasheet.answer import Answer, factor_and_share, in_words
from gearchaos.datasheet.quantities import Entry
from gearchaos.errors import InputError
from gearchaos.gears.units import measured

_UNITS = {"deg": "°", "kg*m^2": "kg m²"}  # units as they are printed, where that differs from their names
# width of a picture in inches: its letters are of the size of the page's on a telephone, and a little larger beside
# another picture
_WIDTH = 4.6
# letters as paths, since the page must not load fonts; identifiers that do not differ between runs
_SETTINGS: Any = {"svg.fonttype": "path", "svg.hashsalt": "gearchaos", "font.size": 9.5}
_NAMESPACES = 'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink"'


def sheet_html(answers: Sequence[Answer]) -> str:
    """The datasheet of a design as one self-contained HTML document without scripts, after the answer at each torque.

    The pair, its quantities and its curves are shown for the first answer, of the others the quantities that differ.
    """
    first, *others = answers
    design = first.design
    drawn = [
        _picture("pair", "Transverse section", "Both wheels to scale. Contact begins at A and ends at E; C is the "
                 "pitch point, and dots are points of contact. Wheel 1 drives.", 5.4,
                 lambda ax: plot.gear_pair(design, ax)),
        _picture("stiffness", "Mesh stiffness", "Along the line of action, over the whole face width; thin lines are "
                 "the means. Accepted methods differ, and none is validated by measurements here.", 4.0,
                 lambda ax: plot.mesh_stiffness(design, ax)),
        *([_picture("loaded", "Loaded transmission error", "By how much the mesh gives way at rest, of teeth that are "
                    "exact but for their relief: the gaps of the tooth pairs, and their springs.", 4.0,
                    lambda ax: plot.harris_map(design, ax=ax))] if design.shares_load else []),
        _picture("error", "Transmission error", "Of the unloaded gears; positive where wheel 2 lags behind.", 3.3,
                 lambda ax: plot.transmission_error(design, ax))]
    differing = [(f"{each.design.torque:.6g}", _groups(each.differing(first))) for each in others]
    return _environment().get_template("sheet.html.j2").render(
        css=Markup(_template("sheet.css")), title=first.title, answers=[_answer(first, first.notes), *(
            _answer(each, [note for note in each.notes if note not in first.notes]) for each in others)],
        problem=str(first.problem), inputs=list(inputs_in_words(design).items()), pictures=drawn,
        groups=_groups(first.entries), differing=differing,
        missing=[(reason, [first.entries[name].words for name in names]) for reason, names in first.absent],
        count=len(first.entries), version=metadata.version("gearchaos"))


def _answer(answer: Answer, notes: Sequence[str]) -> dict[str, Any]:
    """What the template shows of an answer, with these of its notes."""
    windows = [{
        "range": in_words(each), "contact": each.contact, "at": measured(each.speed_of_largest, 3),
        "factor": measured(each.dynamic_factor, 3), "reached": [
            f"{r.motion} {' in '.join(factor_and_share(r).split())}{' of the range' * (r.share < 1)}"
            for r in each.reached]} for each in (answer.speeds.windows if answer.speeds else ())]
    return {
        "conclusion": answer.conclusion, "facts": list(answer.facts), "basis": list(answer.basis), "windows": windows,
        "notes": notes, "problem": answer.problem,
        "ratio": "" if answer.speeds is None else measured(answer.speeds.quasi_static_ratio, 3),
        "torque": "" if answer.design.torque is None else f"{answer.design.torque:.6g} N m",
        "picture": None if (speeds := answer.speeds) is None else _picture(
            f"factors-{speeds.torque:g}", "Dynamic factor along the speed", "Largest mesh force of the computed "
            "motions over the static one, beside the factors of the standards, which end where these give no value.",
            4.3, lambda ax: plot.dynamic_factor(speeds.dataset, ax))}


def _template(name: str) -> str:
    return files("gearchaos.datasheet").joinpath("templates", name).read_text(encoding="utf-8")


@cache
def _environment() -> jinja2.Environment:
    """The environment of the template, with its filters.

    Both make HTML with what follows an underscore as a subscript: ``maths`` of a formula, ``sentence`` of a text, in
    which only symbols of one letter have indices and other names keep their underscores.
    """
    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(_template), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True,
        lstrip_blocks=True)
    index, symbol = re.compile(r"()_([A-Za-z0-9α-ω]+)"), re.compile(r"(?<!\w)([^\W\d_])_([A-Za-z0-9α-ω]+)")
    for name, pattern in (("maths", index), ("sentence", symbol)):
        environment.filters[name] = lambda text, pattern=pattern: Markup(
            pattern.sub(r"\1<sub>\2</sub>", str(escape(text))))
    return environment


def _groups(entries: Mapping[str, Entry]) -> list[tuple[str, list[dict[str, Any]]]]:
    """The rows of the tables by heading, in the order of the quantities."""
    out: dict[str, list[dict[str, Any]]] = {}
    for name, entry in entries.items():
        row = {
            "id": name, "name": entry.words, "symbol": entry.symbol,
            "value": None if entry.value is None else digits(entry.shown), "expected": entry.expected,
            "unit": "" if entry.value == () else _UNITS.get(entry.unit, entry.unit), "formula": entry.formula,
            "source": entry.source, "reason": entry.reason if entry.expected else "see Not computed"}
        out.setdefault(entry.group, []).append(row)
    return list(out.items())


def _picture(name: str, title: str, caption: str, height: float, draw: Callable[[Axes], Axes]) -> dict[str, Any]:
    """What the template shows of a picture: an SVG element, its identifiers with the name, or why there is none."""
    shown, content = {"name": name, "title": title, "caption": caption, "reason": ""}, io.StringIO()
    with matplotlib.rc_context(_SETTINGS):
        figure = Figure(figsize=(_WIDTH, height), layout="constrained")
        try:
            draw(figure.subplots())
        except InputError as error:
            return {**shown, "reason": str(error)}
        figure.savefig(content, format="svg", metadata={"Date": None})
    text = content.getvalue()
    text = re.sub(r"<metadata>.*?</metadata>", "", text[text.index("<svg"):], flags=re.DOTALL)
    text = re.sub(r'\bid="', f'id="{name}-', text)
    text = re.sub(r'(href="#|url\(#)', rf"\g<1>{name}-", text)
    label = f'role="img" aria-label="{escape(title)}"'
    svg = re.sub(r'<svg [^>]*?(viewBox="[^"]*")[^>]*>', rf"<svg {_NAMESPACES} \1 {label}>", text, count=1)
    return {**shown, "svg": Markup(svg)}
