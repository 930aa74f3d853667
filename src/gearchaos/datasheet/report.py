"""The report of an assessment: the page for a person who decides, and the evidence below it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from importlib import metadata
from typing import Any

from markupsafe import Markup

from gearchaos import plot
from gearchaos.cards.card import card
from gearchaos.cards.inputs import inputs_in_words
from gearchaos.datasheet import assessment as in_words
from gearchaos.datasheet.assessment import Section, avoided
from gearchaos.datasheet.html import environment, picture, template
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
        return ": ".join(filter(None, (self.name, in_words.title(self.found.gears))))

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

    @property
    def answer(self) -> list[str]:
        """What to do, in words for sentences, with what it rests on."""
        return [*in_words.decision(self.found), in_words.worst(self.found), in_words.tried_in_words(self.found)]

    @property
    def as_given(self) -> str:
        """What is usable without a change, in words."""
        return f"as given: {usable_share(self.found)}"

    @property
    def changes(self) -> Iterator[Section]:
        """What changes of one input do, for the first page."""
        if self.sensitivity is None and not self.name:
            yield Section("Inputs that matter most", words=[
                self.as_given, "not computed: the command does so with --sensitivity"])
        for heading, tried, best, all_fail in (
                ("Inputs that matter most", self.sensitivity, self.matters_most,
                 "alters it by more than the search leaves open"),
                ("What to change", self.improvements, self.helps_most, "that were tried widens the usable speeds")):
            if tried is not None:
                yield Section(heading, items=self._in_words(best), words=[
                    self.as_given, "with one changed:" if best else f"none of the {len(tried)} changes {all_fail}"])

    @property
    def evidence(self) -> Iterator[Section]:
        """All that stands below the first page."""
        found = self.found
        yield from (avoided(at, found.gears) for at in found.at)
        yield Section.of("Usable", ("torque, N m", "speeds, with the margin either way from the middle"), [
            (f"{at.torque:.6g}", words) for at in found.at
            for words in in_words.usable_in_words(at.usable, found.speeds)])
        yield Section("Jumps of a slow run-up and run-down", items=in_words.jumps(found) or ["none were found"])
        for heading, changes in (("Assumed inputs varied one at a time", self.sensitivity),
                                 ("Changes of the design that were tried, one at a time", self.improvements)):
            if changes:
                yield Section(heading, items=self._in_words(changes))
        yield Section("What was tried", items=[f"{at.torque:.6g} N m: {at.tried}" for at in found.at])
        yield Section("Inputs", values=[*inputs_of(found.gears).items()])
        yield Section("Assumptions", items=found.assumptions)

    def _in_words(self, changes: Sequence[Changed] | None) -> list[str]:
        return [changed_in_words(each, self.found) for each in changes or ()]


def usable_share(found: Assessment) -> str:
    """The share of the speeds that is usable at all torques, and the range with the largest margin."""
    widest = next(iter(in_words.usable_in_words(found.usable_at_all[:1], found.speeds)), "")
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


def differing_inputs(one: Any, other: Any) -> Section:
    """The inputs of two gears that are not the same, by name, with both values."""
    left, right = inputs_of(one), inputs_of(other)
    found = [(name, left.get(name, "–"), right.get(name, "–")) for name in {**left, **right}
             if left.get(name) != right.get(name)]
    return Section.of("What differs in the inputs", ("Input", "First", "Second"), found)


def report_html(report: Report, against: Report | None = None) -> str:
    """The report as one self-contained HTML document without scripts; with another one, both beside each other."""
    reports = [report] if against is None else [report, against]
    sides: list[dict[str, Any]] = []
    for number, side in enumerate(reports):
        found = side.found
        sides.append({
            "title": side.title, "scope": in_words.scope(found), "verdict": side.answer,
            "keep_out": in_words.keep_out(found), "changes": [*side.changes], "evidence": side.evidence,
            "picture": picture(f"{number}-decision", "What to avoid and what to use", "Speeds to avoid by what happens "
                               "there, and the events at their edges. At a torque blank is usable: ± is how far the "
                               "speed may differ from the middle.", height(found), partial(plot.assessment, found),
                               _WIDTH),
            "factors": [picture(f"{number}-factor-{index}", f"Dynamic factor at {each.torque:.6g} N m", "Largest mesh "
                                "force over the static one, of each motion found; ranges to avoid are shaded.", 3.0,
                                partial(draw_factors, each))
                        for index, each in enumerate(found.at) if len(found.at) <= _MOST_PICTURES],
            "kind": "train" if is_train(found.gears) else "pair"})
    return environment().get_template("report.html.j2").render(
        css=Markup(template("sheet.css") + template("report.css")), sides=sides, title=sides[0]["title"],
        differing=None if against is None else differing_inputs(report.found.gears, against.found.gears),
        beside=against is not None, versions=", ".join(f"{name} {metadata.version(name)}" for name in (
            "gearchaos", "numba", "numpy", "xarray")))
