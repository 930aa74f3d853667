"""The form of the page: the fields, menus and buttons that it has for a view."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from gearchaos.explorer.panels.labels import symbol, title
from gearchaos.explorer.view.bounds import value_range
from gearchaos.explorer.view.planes import axis_names, initial_values
from gearchaos.explorer.view.presets import presets
from gearchaos.explorer.view.state import COLOURS, LINES, View, stiffness_name
from gearchaos.model import COORDINATES, KINDS, PARAMETER_PAIRS, STIFFNESS_KINDS
from gearchaos.quantities import HARMONICS, parse_harmonic

_GROUPS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("Operation", ("omega", "q0", "q1", "q2")),
    ("Transmission error", ("eps", "theta")),
    ("Mesh", ("zeta", "chi0", "chi1", "chi2", "contact_ratio", "c", "alpha")),
    ("Wheels and bearings", ("J", "J1", "J2", "beta", "beta1", "beta2")),
    ("Supports", ("mu", "mu1", "mu2", "kappa", "kappa1", "kappa2", "zeta_support", "zeta_support1", "zeta_support2")),
)
"""Headings of the form, each with its fields: parameters, pairs, and families of harmonics."""

_KINDS = {
    "single": "single: relative motion (2.17)", "torsional": "torsional: rigid supports",
    "full": "full: elastic supports (2.12)",
}


@dataclass(frozen=True)
class Field:
    """A value, set by a slider from ``low`` to ``high`` or by a number."""

    name: str
    title: str
    symbol: str
    low: float
    high: float
    step: str


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


@dataclass(frozen=True)
class Group:
    """Fields and buttons under a heading."""

    title: str
    fields: tuple[Field, ...]
    buttons: tuple[Button, ...] = ()


@dataclass(frozen=True)
class Form:
    """The form: the menus and buttons at its top, and the groups of fields."""

    menus: tuple[Menu, ...]
    buttons: tuple[Button, ...]
    groups: tuple[Group, ...]


def parameter_form(view: View, merged: Iterable[str], has_pair: bool) -> Form:
    """The form for the model of a view.

    Parameters
    ----------
    view : View
    merged : iterable of str
        Pairs of `PARAMETER_PAIRS` with one field for both members.
    has_pair : bool
        Whether results can be shown in physical units.
    """
    figures = tuple((key, preset.name) for key, preset in presets().items())
    menus = (
        Menu("preset", "Preset", (("", "choose a figure of the paper …"), *figures)),
        Menu("kind", "Model", tuple((k, _KINDS[k]) for k in KINDS)),
        Menu("stiffness", "Mesh stiffness", tuple((s, s) for s in STIFFNESS_KINDS)),
    )
    buttons = (Button("units", "physical units", toggle=True),) if has_pair else ()
    values = field_values(view)
    groups = [
        Group(heading, tuple(_field(n) for entry in entries for n in _names(entry, values, merged)),
              _group_buttons(heading, view))
        for heading, entries in _GROUPS
    ]
    initial = Group("Initial values", tuple(map(_field, COORDINATES[view.model.kind])))
    return Form(menus, buttons, (*groups, initial))


def plane_menus(view: View) -> tuple[Menu, ...]:
    """Menus for the two parameters of the map and for its colouring."""
    texts = {n: f"{symbol(n)}  {title(n)}" for n in axis_names(view.model)}
    axes = (
        Menu(which, text, tuple({**texts, axis.name: texts.get(axis.name, axis.name)}.items()))
        for which, text, axis in (("x", "Across", view.x), ("y", "Up", view.y))
    )
    return (*axes, Menu("colour", "Colour", tuple(COLOURS.items())))


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
    return {**{n: v for n, v in values.items() if n in offered}, **initial_values(view.point)}


def _field(name: str) -> Field:
    slider = value_range(name)
    return Field(name, title(name) or "initial value", symbol(name), slider.low, slider.high, f"{slider.step:.6g}")


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


def _group_buttons(heading: str, view: View) -> tuple[Button, ...]:
    if heading == "Transmission error":
        return (Button("more-eps", "one more error harmonic"),)
    if heading == "Wheels and bearings":
        return (Button("alike", "both wheels alike", toggle=True),)
    if heading == "Mesh" and stiffness_name(view.model) == "harmonics":
        return (Button("more-c", "one more stiffness harmonic"),)
    return ()
