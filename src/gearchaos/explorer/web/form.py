"""The form of the page: the fields, menus and buttons that it has for a view."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from gearchaos.explorer.panels.labels import Units, hint, symbol, title
from gearchaos.explorer.view.models import axis_names, gear_values, initial_values, slider_range
from gearchaos.explorer.view.presets import presets
from gearchaos.explorer.view.state import COLOURS, LINES, View
from gearchaos.gears.operating import OperatingModel
from gearchaos.model import COORDINATES, KINDS, PARAMETER_PAIRS, STIFFNESS_KINDS
from gearchaos.quantities import HARMONICS, parse_harmonic

_GROUPS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("Operation", ("omega", "q0", "q1", "q2")),
    ("Transmission error", ("eps", "theta")),
    ("Mesh", ("zeta", *(q.name for kind in STIFFNESS_KINDS.values() for q in (*kind.rows, *kind.families)))),
    ("Wheels and bearings", ("J", "J1", "J2", "beta", "beta1", "beta2")),
    ("Supports", ("mu", "mu1", "mu2", "kappa", "kappa1", "kappa2", "zeta_support", "zeta_support1", "zeta_support2")),
)
"""Headings of the form, each with its fields: parameters, pairs, and families of harmonics."""

_GROUPS_OF_GEARS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("Operation", ("speed", "torque")), ("Gears", ("backlash", "grade", "zeta")),
)
"""Headings of the form for gears, with their fields. The fields of `_GROUPS` follow, folded."""

GEARS = "gears"
"""The entry of the menu of presets that shows the gears of the server."""

_KINDS = {
    "single": "single: relative motion (2.17)", "torsional": "torsional: rigid supports",
    "full": "full: elastic supports (2.12)",
}


@dataclass(frozen=True)
class Field:
    """A value, set by a slider from ``low`` to ``high`` or by a number; ``unit`` is empty on a page without gears, and
    ``hint`` says what the value means."""

    name: str
    title: str
    symbol: str
    low: float
    high: float
    step: str
    hint: str
    unit: str = ""


@dataclass(frozen=True)
class Menu:
    """A list to choose from; each option has a value and a text."""

    name: str
    title: str
    options: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Button:
    """A button; a toggle shows whether it is on."""

    name: str
    title: str
    toggle: bool = False


_BUTTONS = {
    "Transmission error": Button("more-eps", "one more error harmonic"),
    "Wheels and bearings": Button("alike", "both wheels alike", toggle=True),
    "Mesh": Button("more-c", "one more stiffness harmonic"),
}
"""The buttons below groups of the form, by heading; that of the mesh needs a stiffness with harmonics."""


@dataclass(frozen=True)
class Group:
    """Fields and buttons under a heading."""

    title: str
    fields: tuple[Field, ...]
    buttons: tuple[Button, ...] = ()


@dataclass(frozen=True)
class Form:
    """The form: the menus and buttons at its top, and the groups of fields, some of them folded."""

    menus: tuple[Menu, ...]
    buttons: tuple[Button, ...]
    groups: tuple[Group, ...]
    folded: tuple[Group, ...] = ()


def parameter_form(view: View, merged: Iterable[str], start: View) -> Form:
    """The form for the model of a view.

    Parameters
    ----------
    view : View
    merged : iterable of str
        Pairs of `PARAMETER_PAIRS` with one field for both members.
    start : View
        What the server shows first; its gears determine the ranges of the sliders of speed and torque.
    """
    figures = tuple((key, preset.name) for key, preset in presets().items())
    gears, marks = start.gears, Units(marked=start.gears is not None)
    first = () if gears is None else ((GEARS, "the gears loaded"),)
    menus = (
        Menu("preset", "Preset", (("", "choose a figure of the paper …"), *first, *figures)),
        Menu("kind", "Model", tuple((k, _KINDS[k]) for k in KINDS)),
        Menu("stiffness", "Mesh stiffness", tuple((s, s) for s in STIFFNESS_KINDS)),
    )
    buttons = (Button("units", "physical units", toggle=True),) if gears is not None else ()
    values = field_values(view)

    def group(heading: str, entries: Iterable[str], without: Iterable[str] = ()) -> Group:
        fields = []
        for name in [n for entry in entries for n in _names(entry, values, merged) if n not in without]:
            slider = slider_range(gears, name)
            step = "1" if name == "grade" else f"{slider.step:.6g}"
            unit = marks.of_parameter(name) if marks.marked else ""
            words = title(name) or "initial value"
            fields.append(Field(name, words, symbol(name), slider.low, slider.high, step, hint(name), unit))
        has_button = heading in _BUTTONS and (heading != "Mesh" or view.model.stiffness.families)
        return Group(heading, tuple(fields), (_BUTTONS[heading],) if has_button else ())

    initial = group("Initial values", COORDINATES[view.model.kind])
    if view.gears is None:
        return Form(menus, buttons, (*(group(*each) for each in _GROUPS), initial))
    of_gears = tuple(group(*each) for each in _GROUPS_OF_GEARS)
    shown = {f.name for each in of_gears for f in each.fields}
    return Form(menus, buttons, of_gears, (*(group(*each, shown) for each in _GROUPS), initial))


def plane_menus(view: View, units: Units) -> tuple[Menu, ...]:
    """Menus for the two parameters of the map and for its colouring."""
    texts = {n: f"{symbol(n)}  {title(n)}{units.bracketed(n)}" for n in axis_names(view.model)}
    axes = (
        Menu(which, text, tuple({**texts, axis.name: texts.get(axis.name, axis.name)}.items()))
        for which, text, axis in (("x", "Across", view.x), ("y", "Up", view.y))
    )
    return (*axes, Menu("colour", "Colour", tuple((n, f"{text}{units.of_measure(n)}") for n, text in COLOURS.items())))


def line_menu() -> Menu:
    """Menu for the direction of the bifurcation diagram."""
    return Menu("line", "Diagram along the", tuple((k, f"{v} line") for k, v in LINES.items()))


def field_values(view: View) -> dict[str, float]:
    """All values at the point by name: parameters, pairs, and the initial values of the motion chosen there.

    A pair has the value of its first member.
    """
    values = view.operating_point.parameters()
    values |= {pair: values[members[0]] for pair, members in PARAMETER_PAIRS.items() if members[0] in values}
    offered = set(axis_names(view.model))
    if isinstance(view.operating_point, OperatingModel):
        offered -= {"omega", "q0", "q1", "q2"} - {view.x.name, view.y.name}
        offered |= (of_gears := gear_values(view.operating_point)).keys()
        values |= of_gears
    return {**{n: v for n, v in values.items() if n in offered}, **initial_values(view.point)}


def _names(entry: str, values: Iterable[str], merged: Iterable[str]) -> list[str]:
    """The fields of an entry of `_GROUPS`: all harmonics of a family; a pair if merged, otherwise its members."""
    if entry in HARMONICS:
        return harmonics_of(entry, values)
    if entry not in values or (entry in PARAMETER_PAIRS and entry not in merged):
        return []
    return [] if any(entry in PARAMETER_PAIRS[pair] for pair in merged) else [entry]


def harmonics_of(family: str, names: Iterable[str]) -> list[str]:
    """The names among ``names`` that are harmonics of a family such as "eps"."""
    return [n for n in names if (parts := parse_harmonic(n)) is not None and parts.family == family]
