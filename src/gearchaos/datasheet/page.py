"""The page of a datasheet: the values that its template needs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import metadata
from typing import Any

from markupsafe import Markup

from gearchaos import plot
from gearchaos.cards.inputs import digits, inputs_in_words
from gearchaos.datasheet.answer import DesignAnswer
from gearchaos.datasheet.assessment import avoided
from gearchaos.datasheet.html import environment, picture, template
from gearchaos.datasheet.quantities import Entry

_UNITS = {"deg": "°", "kg*m^2": "kg m²"}  # units as they are printed, where that differs from their names


def sheet_html(answers: Sequence[DesignAnswer]) -> str:
    """The datasheet of a design as one self-contained HTML document without scripts, after the answer at each torque.

    The pair, its quantities and its curves are shown for the first answer, of the others the quantities that differ.
    """
    first, *others = answers
    design = first.design
    drawn = [
        picture("pair", "Transverse section", "Both wheels to scale. Contact begins at A and ends at E; C is the "
                 "pitch point, and dots are points of contact. Wheel 1 drives.", 5.4,
                 lambda ax: plot.gear_pair(design, ax)),
        picture("stiffness", "Mesh stiffness", "Along the line of action, over the whole face width; thin lines are "
                 "the means. Accepted methods differ, and none is validated by measurements here.", 4.0,
                 lambda ax: plot.mesh_stiffness(design, ax)),
        *([picture("loaded", "Mesh deflection", "By how much the mesh gives way at rest, of teeth that are "
                    "exact but for their relief: the gaps of the tooth pairs, and their springs.", 4.0,
                    lambda ax: plot.harris_map(design, ax=ax))]
          if design.torque and design.has_gaps else []),
        *([picture("pattern", "Contact pattern", "Force per width between two teeth at rest under the torque, along "
                   "the path of contact and across the face width. Beyond the dashed lines tip corners touch.", 4.0,
                   lambda ax: plot.contact_pattern(design, ax))] if design.under_load else []),
        picture("error", "Transmission error", "Of the unloaded gears; positive where wheel 2 lags behind.", 3.3,
                 lambda ax: plot.transmission_error(design, ax))]
    differing = [(f"{each.design.torque:.6g}", _groups(each.differing(first))) for each in others]
    return environment().get_template("sheet.html.j2").render(
        css=Markup(template("sheet.css")), title=first.title, answers=[_answer(first, first.notes), *(
            _answer(each, [note for note in each.notes if note not in first.notes]) for each in others)],
        problem=str(first.problem), inputs=list(inputs_in_words(design).items()), pictures=drawn,
        groups=_groups(first.entries), differing=differing,
        missing=[(reason, [first.entries[name].words for name in names]) for reason, names in first.absent],
        count=len(first.entries), version=metadata.version("gearchaos"))


def _answer(answer: DesignAnswer, notes: Sequence[str]) -> dict[str, Any]:
    """What the template shows of an answer, with these of its notes."""
    speeds = answer.speeds
    return {
        "decision": [answer.conclusion] if speeds is None else answer.decision, "facts": list(answer.facts),
        "basis": list(answer.basis), "avoided": None if speeds is None else avoided(speeds, answer.design),
        "notes": notes, "problem": answer.problem,
        "torque": "" if answer.design.torque is None else f"{answer.design.torque:.6g} N m",
        "picture": None if speeds is None else picture(
            f"factors-{speeds.torque:g}", "Dynamic factor along the speed", "Largest mesh force of the computed "
            "motions over the static one, beside the factors of the standards, which end where these give no value.",
            4.3, lambda ax: plot.dynamic_factor(speeds.dataset, ax))}


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
