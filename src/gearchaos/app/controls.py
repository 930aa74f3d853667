"""The controls: every parameter as a slider and a number, the kind of model, the axes, the presets."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from bokeh.layouts import column, row
from bokeh.models import Button, Div, InlineStyleSheet, Select, Slider, TextInput, Toggle

from gearchaos.app.bounds import HARMONICS, span
from gearchaos.app.figures.style import plain
from gearchaos.app.presets import presets
from gearchaos.app.state import COLOURS, LINES, STIFFNESSES, View, axis_names, stiffness_name
from gearchaos.axis import Axis
from gearchaos.model import COORDINATES, KINDS, PAIRS
from gearchaos.plot._axes import symbol

_STEPS = 400
_GROUPS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("Operation", ("omega", "q0", "q1", "q2")),
    ("Transmission error", ("eps", "theta")),
    ("Mesh", ("zeta", "chi0", "chi1", "chi2", "contact_ratio", "c", "alpha")),
    ("Wheels and bearings", ("J", "J1", "J2", "beta", "beta1", "beta2")),
    ("Supports", ("mu", "mu1", "mu2", "kappa", "kappa1", "kappa2", "zeta_support", "zeta_support1", "zeta_support2")),
)
_WORDS = {
    "omega": "mesh frequency", "q": "torque", "zeta": "mesh damping", "chi": "stiffness step",
    "contact_ratio": "contact ratio", "eps": "error amplitude", "theta": "error phase", "c": "stiffness amplitude",
    "alpha": "stiffness phase", "J": "inertia", "beta": "bearing friction", "mu": "wheel mass",
    "kappa": "support stiffness", "zeta_support": "support damping",
}
_ALWAYS_HARMONIC = ("eps", "theta", "c", "alpha")

Change = Callable[[Callable[[View], View]], None]
"""Takes a function from the view on show to the one wanted."""


class Field:
    """One value as a slider and a number; whoever moves it calls ``set_value``."""

    def __init__(self, name: str, set_value: Callable[[str, object], None], css: InlineStyleSheet) -> None:
        low, high, _, _ = span(name)
        self.name, self._set, self._quiet = name, set_value, False
        stem = name.rstrip("0123456789")
        words = _WORDS.get(stem if stem in _WORDS else name, "start")
        self.words = Div(text=f"<span title='{name}'>{words} <b>{plain(symbol(name))}</b></span>",
                         css_classes=["words"], sizing_mode="stretch_width", stylesheets=[css], margin=(4, 4, 0, 4))
        self.slider = Slider(start=low, end=high, value=low, step=(high - low) / _STEPS, show_value=False,
                             sizing_mode="stretch_width", name=f"slider-{name}", margin=(0, 6, 0, 8))
        self.number = TextInput(value="", width=84, name=f"number-{name}", margin=(0, 4, 0, 0))
        self.slider.on_change("value", self._moved)
        self.number.on_change("value", self._typed)
        self.model = column(self.words, row(self.slider, self.number, sizing_mode="stretch_width"),
                            sizing_mode="stretch_width", css_classes=["field", f"field-{name}"])

    def _moved(self, _: str, __: float, value: float) -> None:
        if not self._quiet:
            self._set(self.name, float(f"{value:.10g}"))

    def _typed(self, _: str, __: str, value: str) -> None:
        if not self._quiet:
            self._set(self.name, value)

    def show(self, value: float) -> None:
        """Show a value without setting it again; the slider reaches as far as it must."""
        self._quiet = True
        low, high, _, _ = span(self.name)
        ends = {"start": min(low, value), "end": max(high, value)}
        changed = {k: v for k, v in ends.items() if getattr(self.slider, k) != v}
        if changed:
            self.slider.update(**changed)
        if abs(self.slider.value - value) > 1e-9 * max(1.0, abs(value)):
            self.slider.value = value
        if self.number.value != f"{value:.10g}":
            self.number.value = f"{value:.10g}"
        self._quiet = False


class Controls:
    """All controls of a page; `column` holds them.

    Parameters
    ----------
    change : Change
        Called with what a visitor wants.
    css : InlineStyleSheet
        Of the words in it.
    """

    def __init__(self, change: Change, css: InlineStyleSheet) -> None:
        self._change, self._css, self._quiet = change, css, False
        self._fields: dict[str, Field] = {}
        self._view: View | None = None
        self.preset = self._select("Preset", [("", "choose a figure of the paper …"), *(
            (key, p.name) for key, p in presets().items())], self._to_preset, "preset")
        self.kind = self._select("Model", [(k, _KINDS[k]) for k in KINDS], lambda v: lambda s: s.with_kind(v), "kind")
        self.stiffness = self._select(
            "Mesh stiffness", [(s, s) for s in STIFFNESSES], lambda v: lambda s: s.with_stiffness(v), "stiffness")
        self.x = self._select("Across", [], lambda v: lambda s: _other_axis(s, v, "x"), "x")
        self.y = self._select("Up", [], lambda v: lambda s: _other_axis(s, v, "y"), "y")
        self.colour = self._select("Colour", list(COLOURS.items()), lambda v: lambda s: replace(s, colour=v), "colour")
        self.line = self._select(
            "Diagram along the", [(k, f"{v} line") for k, v in LINES.items()],
            lambda v: lambda s: replace(s, line=v), "line")
        self.alike = Toggle(label="both wheels alike", active=True, name="alike", height=28)
        self.alike.on_change("active", lambda _, __, ___: self._arrange())
        self.more = Button(label="one more error harmonic", name="more-eps", height=28)
        self.more.on_click(lambda: self._one_more("eps"))
        self.more_stiffness = Button(label="one more stiffness harmonic", name="more-c", height=28)
        self.more_stiffness.on_click(lambda: self._one_more("c"))
        self.physical = Toggle(label="physical units", name="units", height=28, visible=False)
        self.physical.on_change("active", lambda _, __, on: self._ask(lambda s: replace(s, physical=on)))
        self.column = column(sizing_mode="stretch_width", name="controls")

    def show(self, view: View) -> None:
        """Show a view."""
        before, self._view, self._quiet = self._view, view, True
        for name in ("kind", "colour", "line"):
            wanted = view.model.kind if name == "kind" else getattr(view, name)
            getattr(self, name).value = wanted
        self.stiffness.value = stiffness_name(view.model)
        names = [(n, f"{plain(symbol(n))}  {words_for(n)}") for n in axis_names(view.model)]
        for select, axis in ((self.x, view.x), (self.y, view.y)):
            options = names if axis.name in dict(names) else [*names, (axis.name, axis.name)]
            if select.options != options:
                select.options = options
            select.value = axis.name
        self.physical.active = view.physical
        self._quiet = False
        if before is None or _layout_key(before) != _layout_key(view):
            self._arrange()
        self._show_values()

    def _show_values(self) -> None:
        assert self._view is not None
        values = _all_values(self._view)
        for name, field in self._fields.items():
            if name in values:
                field.show(values[name])

    def _arrange(self) -> None:
        """Choose the fields that this model has."""
        assert self._view is not None
        values = _all_values(self._view)
        sections: list[Any] = [self.preset, self.kind, self.stiffness, self.physical]
        for title, stems in _GROUPS:
            names = [n for stem in stems for n in _names(stem, values, self.alike.active)]
            if names:
                sections += [_heading(title, self._css), *(self._field(n).model for n in names)]
            sections += {"Transmission error": [self.more], "Wheels and bearings": [self.alike]}.get(title, [])
            if title == "Mesh" and stiffness_name(self._view.model) == "harmonics":
                sections.append(self.more_stiffness)
        starts = COORDINATES[self._view.model.kind]
        sections += [_heading("Start", self._css), *(self._field(n).model for n in starts)]
        self.column.children = sections
        self._show_values()

    def _field(self, name: str) -> Field:
        if name not in self._fields:
            self._fields[name] = Field(name, lambda n, v: self._ask(lambda s: s.with_value(n, v)), self._css)
        return self._fields[name]

    def _one_more(self, stem: str) -> None:
        assert self._view is not None
        number = 1 + sum(n.startswith(stem) and n[len(stem):].isdigit() for n in self._view.model.parameters())
        if number <= HARMONICS:
            self._ask(lambda s: s.with_value(f"{stem}{number}", 0.01))

    def _select(
        self, title: str, options: list[Any], wanted: Callable[[str], Callable[[View], View]], name: str,
    ) -> Select:
        select = Select(title=title, options=options, name=f"select-{name}", sizing_mode="stretch_width",
                        value=options[0][0] if options else "")
        select.on_change("value", lambda _, __, value: self._ask(wanted(value)) if value else None)
        return select

    def _to_preset(self, key: str) -> Callable[[View], View]:
        return lambda view: replace(presets()[key].view, physical=view.physical)

    def _ask(self, wanted: Callable[[View], View]) -> None:
        if not self._quiet:
            self._change(wanted)


_KINDS = {
    "single": "single: relative motion (2.17)", "torsional": "torsional: rigid supports",
    "full": "full: elastic supports (2.12)",
}


def _other_axis(view: View, name: str, which: str) -> View:
    """Another parameter along one axis, over the range of its slider; the two change places if they must."""
    if name == getattr(view, "y" if which == "x" else "x").name:
        x, y = (Axis(a.name, a.start, a.stop, b.count) for a, b in ((view.y, view.x), (view.x, view.y)))
        return view.with_axes(x, y)
    old = getattr(view, which)
    if name == old.name:
        return view
    axis = Axis(name, span(name).low, span(name).high, old.count)
    return view.with_axes(axis, view.y) if which == "x" else view.with_axes(view.x, axis)


def _all_values(view: View) -> dict[str, float]:
    """Every value at the point by name: parameters, pairs and the start."""
    values = view.base.parameters()
    mine = set(axis_names(view.model))
    values |= {pair: values[singles[0]] for pair, singles in PAIRS.items() if singles[0] in values}
    start = {n: 1.0 if n == "x1" else 0.0 for n in COORDINATES[view.model.kind]}
    return {**{n: v for n, v in values.items() if n in mine}, **start, **view.point.initial}


def _names(stem: str, values: Iterable[str], alike: bool) -> list[str]:
    """The fields of a stem: the pair or its two members, or all harmonics there are."""
    if stem in _ALWAYS_HARMONIC:
        return [n for n in values if n[: len(stem)] == stem and n[len(stem):].isdigit()]
    if stem not in values:
        return []
    member = any(stem in singles for singles in PAIRS.values())
    if (stem in PAIRS and not alike) or (member and alike):
        return []
    return [stem]


def _layout_key(view: View) -> tuple[Any, ...]:
    return view.model.kind, tuple(view.base.parameters())


def _heading(title: str, css: InlineStyleSheet) -> Div:
    return Div(text=f"<h3>{title}</h3>", sizing_mode="stretch_width", stylesheets=[css], margin=(0, 4))


def words_for(name: str) -> str:
    """A parameter in words."""
    return _WORDS.get(name.rstrip("0123456789"), _WORDS.get(name, ""))
