"""The form of the page: its groups of fields, menus and buttons, and the values that fields show."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

from gearchaos.explorer.core.models import axis_names, gear_values, initial_values, slider_range
from gearchaos.explorer.core.presets import presets
from gearchaos.explorer.core.state import COLOURS, OF_LOAD_CHANGES, View
from gearchaos.explorer.core.style import Units, hint, symbol, title
from gearchaos.explorer.core.trains import meaning
from gearchaos.gears.operation.operating import OperatingModel, gears_of
from gearchaos.gears.train.model import TrainModel
from gearchaos.model import DAMPING_LAWS, KINDS, PARAMETER_PAIRS, STIFFNESS_KINDS
from gearchaos.quantities import HARMONICS, parse_harmonic, quantity
from gearchaos.studies.operation.factor_context import which_mesh

_GROUPS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("Operation", ("omega", "q0", "q1", "q2")),
    ("Transmission error", ("eps", "theta")),
    ("Mesh", ("zeta", *dict.fromkeys(
        q.name for kind in STIFFNESS_KINDS.values() for q in (*kind.rows, *kind.families)))),
    ("Wheels and bearings", ("J", "J1", "J2", "beta", "beta1", "beta2")),
    ("Supports", ("mu", "mu1", "mu2", "kappa", "kappa1", "kappa2", "zeta_support", "zeta_support1", "zeta_support2")),
)
"""Headings of the form, each with its fields: parameters, pairs, and families of harmonics."""

_GROUPS_OF_GEARS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("Operation", ("speed", "torque")), ("Gears", ("backlash", "grade", "zeta")),
)
"""Headings of the form for gears, with their fields. The fields of `_GROUPS` follow, folded."""

GEARS = "gears"  # the entry of the menu of presets that shows the gears of the server

_KINDS = {
    "single": "single: relative motion (2.17)", "torsional": "torsional: rigid supports",
    "full": "full: elastic supports (2.12)",
}


NUMBER = ".8g"
"""Format of a number in a field, which is short enough to be visible as a whole; the address has all digits."""


class Field(NamedTuple):
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


class Menu(NamedTuple):
    """A list to choose from; each option has a value and a text."""

    name: str
    title: str
    options: tuple[tuple[str, str], ...]


class Button(NamedTuple):
    """A button; a toggle shows whether it is on."""

    name: str
    title: str
    toggle: bool = False


class Group(NamedTuple):
    """Fields and buttons under a heading."""

    title: str
    fields: tuple[Field, ...]
    buttons: tuple[Button, ...] = ()


class Form(NamedTuple):
    """The form: the menus and buttons at its top, and the groups of fields, some of them folded."""

    menus: tuple[Menu, ...]
    buttons: tuple[Button, ...]
    groups: tuple[Group, ...]
    folded: tuple[Group, ...] = ()
    folded_title: str = "Dimensionless parameters"


_UNITS = Button("units", "physical units", toggle=True)

_BUTTONS = {
    "Transmission error": Button("more-eps", "one more error harmonic"),
    "Wheels and bearings": Button("alike", "both wheels alike", toggle=True),
    "Mesh": Button("more-c", "one more stiffness harmonic"),
}
"""The buttons below groups of the form, by heading; that of the mesh needs a stiffness with harmonics."""


def parameter_form(view: View, merged: Iterable[str], start: View, drawn: bool = False) -> Form:
    """The form for the model of a view, with one field for both members of the ``merged`` pairs.

    ``start`` is what the page shows first; its gears determine the ranges of the sliders of speed and torque. Those
    that are ``drawn`` have a form of their own.
    """
    if isinstance(view.model, TrainModel):
        return _train_form(view.model, start)
    figures = tuple((key, preset.name) for key, preset in presets().items())
    gears, marks = start.gears, Units(marked=start.gears is not None)
    first = () if gears is None else ((GEARS, "the gears loaded"),)
    menus = (
        Menu("preset", "Preset", (("", "choose a figure of the paper …"), *first, *figures)),
        Menu("kind", "Model", tuple((k, _KINDS[k]) for k in KINDS)),
        Menu("stiffness", "Mesh stiffness", tuple((s, s) for s in STIFFNESS_KINDS)),
        Menu("damping_law", "Mesh damping", tuple((law.name, law.words) for law in DAMPING_LAWS.values())),
    )
    buttons = (_UNITS,) if gears is not None else ()
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

    initial = group("Initial values", view.model.coordinate_names)
    if view.gears is None:
        return Form(menus, buttons, (*(group(*each) for each in _GROUPS), initial))
    of_gears = tuple(group(*each) for each in _GROUPS_OF_GEARS[: 1 if drawn else None])
    shown = {f.name for each in of_gears for f in each.fields}
    return Form(menus, buttons, of_gears, (*(group(*each, shown) for each in _GROUPS), initial))


def _train_form(model: Any, start: View) -> Form:
    """The form of a train: its speed and torques, and folded the parameters of its parts."""
    units, fields = Units(marked=True), dict[str, list[Field]]()
    for name in axis_names(model):
        owner, _, own = name.rpartition(".")
        slider, found = slider_range(start.gears, name), quantity(name)
        words = found.axis_name if own == "torque" and owner else own
        fields.setdefault("" if own == "torque" else owner, []).append(Field(
            name, words, found.symbol, slider.low, slider.high, f"{slider.step:.6g}",
            meaning(model, name) or found.long_name, units.of_parameter(name)))
    operation = Group("Operation", tuple(fields.pop("")))
    parts = tuple(Group(owner, tuple(each)) for owner, each in fields.items())
    return Form((), (_UNITS,), (operation,), parts, "Parameters of parts")


def plane_menus(view: View, units: Units) -> tuple[Menu, ...]:
    """Menus for the two parameters of the map and for its colouring."""
    texts = {n: f"{symbol(n)}  {title(n)}{units.bracketed(n)}" for n in axis_names(view.model)}
    axes = (
        Menu(which, text, tuple({**texts, axis.name: texts.get(axis.name, axis.name)}.items()))
        for which, text, axis in (("x", "Across", view.x), ("y", "Up", view.y))
    )
    without = () if gears_of(view.model) is not None else OF_LOAD_CHANGES
    colours = Menu("colour", "Colour", tuple(
        (n, f"{text}{units.of_measure(n)}") for n, text in COLOURS.items() if n not in without))
    if not isinstance(view.model, TrainModel):
        return (*axes, colours)
    return (*axes, colours, Menu("mesh", "Mesh", (("", "worst mesh"), *((n, n) for n in view.model.mesh_names))))


def whose(view: View) -> str:
    """Of which mesh of a train the map's measure is; empty for a pair, and for what is of the motion as a whole."""
    of = which_mesh().get(view.colour)
    if not isinstance(view.model, TrainModel) or of is None:
        return ""
    return f"of {view.model.mesh_names[0] if of == 'first' else view.mesh or 'the worst mesh'}"


def field_values(view: View) -> dict[str, float]:
    """All values at the point by name: parameters, pairs, and the initial values of the motion chosen there.

    A pair has the value of its first member.
    """
    if isinstance(view.operating_point, TrainModel):
        return {n: view.operating_point.value(n) or 0.0 for n in axis_names(view.model)}
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
