"""The report of an assessment: the page for a person who decides, and the evidence below it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from importlib import metadata
from typing import Any

from markupsafe import Markup

from gearchaos import plot
from gearchaos.cards.card import card
from gearchaos.cards.inputs import inputs_in_words
from gearchaos.datasheet.html import environment, picture, template
from gearchaos.datasheet.verdict import (
    at_no_speed,
    beyond_in_words,
    decision,
    headings,
    jumps,
    keep_out,
    knocks_in_words,
    rows,
    scanned,
    title,
    torques_in_words,
    usable_in_words,
    worst,
)
from gearchaos.gears.mesh.pair import GearPair
from gearchaos.gears.operation.operating import is_design, is_train
from gearchaos.plot._assessment import draw_factors, height
from gearchaos.studies.speeds.assess import Assessment
from gearchaos.studies.speeds.changed_designs import Changed

_MOST_PICTURES = 6  # torques of which the dynamic factor over the speed is drawn
_MOST_NAMED = 3  # changes that the first page names
_WIDTH = 5.2  # of the picture of the decision, in inches


@dataclass(frozen=True)
class Report:
    """An assessment, with those of designs that differ in one input, None if they were not asked for.

    The ``name`` tells it from the one beside it.
    """

    found: Assessment
    name: str = ""
    sensitivity: Sequence[Changed] | None = None
    improvements: Sequence[Changed] | None = None

    def document(self) -> dict[str, Any]:
        """All of it, ready for JSON."""
        changes = {"sensitivity": self.sensitivity, "improvements": self.improvements}
        return self.found.document() | {
            name: [each.document(self.found) for each in found] for name, found in changes.items() if found is not None}

    @property
    def title(self) -> str:
        return ": ".join(filter(None, (self.name, title(self.found.gears))))

    @property
    def matters_most(self) -> list[Changed]:
        """The changes of the inputs to which the usable share is most sensitive, one of each, most first."""
        ordered = sorted((each for each in self.sensitivity or () if each.told_apart(self.found)),
                         key=lambda each: -abs(each.widening(self.found)))
        first = [each for number, each in enumerate(ordered) if each.name not in {o.name for o in ordered[:number]}]
        return first[:_MOST_NAMED]

    @property
    def helps_most(self) -> list[Changed]:
        """The changes of the design that widen the usable share, most first."""
        ordered = sorted(self.improvements or (), key=lambda each: -each.widening(self.found))
        return [each for each in ordered if each.widening(self.found) > 0 and each.told_apart(self.found)][:_MOST_NAMED]


def usable_share(found: Assessment) -> str:
    """The share of the speeds that is usable at all torques, and the range with the largest margin."""
    widest = next(iter(usable_in_words(found.usable_at_all[:1], found.speeds)), "")
    margin = f", with the largest margin {widest}" * bool(widest)
    operation = f", in operation {100 * found.usable_share_in_operation:.1f} %" * bool(found.at[0].load_change)
    return f"usable {100 * found.usable_share:.1f} % of the speeds{margin}{operation}"


def changed_in_words(each: Changed, found: Assessment) -> str:
    """A change, and what is usable after it, beside the assessment of the design itself."""
    after = f"not possible, {each.reason}" if each.assessment is None else usable_share(each.assessment)
    same = ", which the search does not tell apart" * (each.assessment is not None and not each.told_apart(found))
    return f"{each.name} {each.given} to {each.value}: {after}{same}"


def inputs_of(gears: Any) -> dict[str, str]:
    """All inputs that are given but the speed and the torque, in words with their units."""
    if is_design(gears):
        return inputs_in_words(replace(gears, speed=None, torque=None))
    if isinstance(gears, GearPair):
        return {"units": "SI"} | {f.name: f"{value:.6g}" if isinstance(value, float) else str(value)
                                  for f in fields(gears) if f.name not in ("speed", "M10", "M20")
                                  and (value := getattr(gears, f.name)) not in (None, (), 0.0)}
    found: dict[str, str] = {}
    for name, value in card(gears).rows:
        if name != "operating point":
            found[name] = f"{found[name]}; {value}" if name in found else value
    return found


def differing_inputs(one: Any, other: Any) -> list[tuple[str, str, str]]:
    """The inputs of two gears that are not the same, by name, with both values."""
    left, right = inputs_of(one), inputs_of(other)
    return [(name, left.get(name, "–"), right.get(name, "–")) for name in {**left, **right}
            if left.get(name) != right.get(name)]


def report_html(report: Report, against: Report | None = None) -> str:
    """The report as one self-contained HTML document without scripts; with another one, both beside each other."""
    reports = [report] if against is None else [report, against]
    sides: list[dict[str, Any]] = []
    for number, side in enumerate(reports):
        found, changes = side.found, {"sensitivity": side.sensitivity, "improvements": side.improvements}
        first = {"matters": None if side.sensitivity is None else side.matters_most,
                 "helps": None if side.improvements is None else side.helps_most}
        sides.append({
            "title": side.title, "torques": torques_in_words(found), "speeds": scanned(found),
            "verdict": [*decision(found), worst(found), f"tried: {found.tried}"], "usable_share": usable_share(found),
            "keep_out": keep_out(found),
            "picture": picture(f"{number}-decision", "What to avoid and what to use", "Speeds to avoid by what happens "
                               "there, and the events at their edges. At a torque blank is usable: ± is how far the "
                               "speed may differ from the middle.", height(found), partial(plot.assessment, found),
                               _WIDTH),
            **{name: None if each is None else [changed_in_words(one, found) for one in each]
               for name, each in {**first, **changes}.items()},
            # below the first page
            "avoid": [{"torque": f"{each.torque:.6g}", "ratio": at_no_speed(each), "rows": rows(each, found.gears),
                       "below": [*filter(None, [beyond_in_words(each)]), *knocks_in_words(each)]}
                      for each in found.at],
            "usable": [(f"{each.torque:.6g}", words)
                       for each in found.at for words in usable_in_words(each.usable, found.speeds)],
            "jumps": jumps(found), "tried": [(f"{each.torque:.6g}", each.tried) for each in found.at],
            "factors": [picture(f"{number}-factor-{index}", f"Dynamic factor at {each.torque:.6g} N m", "Largest mesh "
                                "force over the static one, of each motion found; ranges to avoid are shaded.", 3.0,
                                partial(draw_factors, each))
                        for index, each in enumerate(found.at) if len(found.at) <= _MOST_PICTURES],
            "inputs": list(inputs_of(found.gears).items()), "assumptions": found.assumptions,
            "kind": "train" if is_train(found.gears) else "pair"})
    return environment().get_template("report.html.j2").render(
        css=Markup(template("sheet.css") + template("report.css")), sides=sides, title=sides[0]["title"],
        headings=[heading.replace("\n", " ") for heading in headings(report.found.at[0])],
        differing=[] if against is None else differing_inputs(report.found.gears, against.found.gears),
        beside=against is not None, versions=", ".join(f"{name} {metadata.version(name)}" for name in (
            "gearchaos", "numba", "numpy", "xarray")))
