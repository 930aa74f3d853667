"""The controls: every parameter as a slider and a number, the kind of model, the axes, the presets."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from gearchaos.explorer.bounds import HARMONICS, span
from gearchaos.explorer.bridge import Bridge
from gearchaos.explorer.figures.style import plain
from gearchaos.explorer.forms import button, choice, field, heading, words_for
from gearchaos.explorer.presets import preset_of, presets
from gearchaos.explorer.state import COLOURS, LINES, STIFFNESSES, View, axis_names, initial_values, stiffness_name
from gearchaos.model import COORDINATES, KINDS, PAIRS, MeshModel
from gearchaos.plot._axes import symbol
from gearchaos.studies.axis import Axis

_GROUPS: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("Operation", ("omega", "q0", "q1", "q2")),
    ("Transmission error", ("eps", "theta")),
    ("Mesh", ("zeta", "chi0", "chi1", "chi2", "contact_ratio", "c", "alpha")),
    ("Wheels and bearings", ("J", "J1", "J2", "beta", "beta1", "beta2")),
    ("Supports", ("mu", "mu1", "mu2", "kappa", "kappa1", "kappa2", "zeta_support", "zeta_support1", "zeta_support2")),
)
_SHOWN = ".8g"
"""How a field shows a number, so that it can be read whole; the address has all its digits."""

_WHEELS = ("J", "beta", "mu", "kappa", "zeta_support")
"""The pairs that belong to the wheels and their supports."""

_ALWAYS_HARMONIC = ("eps", "theta", "c", "alpha")
_KINDS = {
    "single": "single: relative motion (2.17)", "torsional": "torsional: rigid supports",
    "full": "full: elastic supports (2.12)",
}

Wanted = Callable[[View], View]
"""From the view on show to the one that a visitor wants."""


class Controls:
    """What a visitor sets on a page.

    Parameters
    ----------
    change : callable
        Called with what a visitor wants, a `Wanted`.
    ask_basin : callable
        Has the basins of the point computed.
    bridge : Bridge
        To the page.
    has_pair : bool
        Whether there are physical units to change to.
    """

    def __init__(
        self, change: Callable[[Wanted], None], ask_basin: Callable[[], None], bridge: Bridge, has_pair: bool
    ) -> None:
        self._change, self._bridge, self._has_pair, self._alike = change, bridge, has_pair, True
        self._ask_basin, self._preset = ask_basin, ""
        self._view: View
        self._layout: Any = None

    # --- touched -------------------------------------------------------------------------------------------------

    def set(self, value: Any) -> None:
        """A field or a list was set: its name and its value, which may be anything."""
        if not isinstance(value, list) or len(value) != 2 or not isinstance(value[0], str):
            return
        name, chosen = value
        if name in _CHOICES:
            self._choose(name, str(chosen))
        elif name in self._values():
            exact = float(f"{chosen:.10g}") if isinstance(chosen, float) else chosen
            self._change(lambda view: view.with_value(name, exact))

    def _choose(self, name: str, chosen: str) -> None:
        preset = presets().get(chosen) if name == "preset" else None
        if preset is not None:
            self._preset = chosen
        self._change(lambda view: _CHOICES[name](view, chosen))
        if preset is not None and preset.basins:
            self._ask_basin()

    def press(self, name: Any) -> None:
        """A button was pressed."""
        if name == "alike":
            self._press_alike()
        elif name == "units" and self._has_pair:
            self._change(lambda view: replace(view, physical=not view.physical))
        elif name in ("more-eps", "more-c"):
            self._one_more(name.removeprefix("more-"))

    def _press_alike(self) -> None:
        """Part the two wheels, or have the second take on what the first has."""
        self._alike = not (self._alike and are_alike(self._view.model))
        self.show(self._view)
        if self._alike and not are_alike(self._view.model):
            self._change(made_alike)

    def _one_more(self, stem: str) -> None:
        number = 1 + sum(n.startswith(stem) and n[len(stem):].isdigit() for n in self._view.model.parameters())
        if number <= HARMONICS:
            self._change(lambda view: view.with_value(f"{stem}{number}", 0.01))

    # --- shown ---------------------------------------------------------------------------------------------------

    def show(self, view: View) -> None:
        """Show a view."""
        self._view, bridge = view, self._bridge
        self._preset, alike = preset_of(view, self._preset), self._alike and are_alike(view.base)
        single = {pair for pair in PAIRS if alike and _equal(view.base, pair)}
        layout = view.model.kind, tuple(view.base.parameters()), view.x.name, view.y.name, single
        if layout != self._layout:
            self._layout = layout
            bridge.write("parameters", self._parameters(view, single))
            bridge.write("axes", _axes(view))
            bridge.write("line-choose", choice(
                "line", "Diagram along the", [(k, f"{v} line") for k, v in LINES.items()]))
        bridge.show({
            **{name: f"{value:{_SHOWN}}" for name, value in self._values().items()},
            "preset": self._preset, "kind": view.model.kind, "stiffness": stiffness_name(view.model), "x": view.x.name,
            "y": view.y.name, "colour": view.colour, "line": view.line, "alike": alike, "units": view.physical,
        })

    def _parameters(self, view: View, single: Iterable[str]) -> str:
        """The fields that this model has, one for each pair in ``single``."""
        parts = [
            choice("preset", "Preset", [("", "choose a figure of the paper …"), *(
                (key, p.name) for key, p in presets().items())]),
            choice("kind", "Model", [(k, _KINDS[k]) for k in KINDS]),
            choice("stiffness", "Mesh stiffness", [(s, s) for s in STIFFNESSES]),
            button("units", "physical units", toggled=True) if self._has_pair else "",
        ]
        values = self._values()
        for title, stems in _GROUPS:
            names = [n for stem in stems for n in _names(stem, values, single)]
            parts += [heading(title), *map(field, names)] if names else []
            parts += {
                "Transmission error": [button("more-eps", "one more error harmonic")],
                "Wheels and bearings": [button("alike", "both wheels alike", toggled=True)],
            }.get(title, [])
            if title == "Mesh" and stiffness_name(view.model) == "harmonics":
                parts.append(button("more-c", "one more stiffness harmonic"))
        return "".join([*parts, heading("Start"), *map(field, COORDINATES[view.model.kind])])

    def _values(self) -> dict[str, float]:
        """Every value at the point by name: parameters, pairs and the start."""
        view, values = self._view, self._view.base.parameters()
        mine = set(axis_names(view.model))
        values |= {pair: values[singles[0]] for pair, singles in PAIRS.items() if singles[0] in values}
        return {**{n: v for n, v in values.items() if n in mine}, **initial_values(view.point)}


def _axes(view: View) -> str:
    """Lists to choose the axes and the colour of the map from."""
    names = {n: f"{plain(symbol(n))}  {words_for(n)}" for n in axis_names(view.model)}
    shown = [
        choice(which, title, {**names, axis.name: names.get(axis.name, axis.name)}.items())
        for which, title, axis in (("x", "Across", view.x), ("y", "Up", view.y))
    ]
    return "".join([*shown, choice("colour", "Colour", COLOURS.items())])


def _preset(view: View, key: str) -> View:
    return presets()[key].view if key in presets() else view


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


_CHOICES: dict[str, Callable[[View, str], View]] = {
    "preset": _preset, "kind": View.with_kind, "stiffness": View.with_stiffness,
    "x": lambda view, name: _other_axis(view, name, "x"), "y": lambda view, name: _other_axis(view, name, "y"),
    "colour": lambda view, name: replace(view, colour=name), "line": lambda view, name: replace(view, line=name),
}
"""What can be chosen from a list; a view that cannot be is refused by the view itself."""


def _names(stem: str, values: Iterable[str], single: Iterable[str]) -> list[str]:
    """The fields of a stem: a pair in ``single`` or else its two members, or all harmonics there are."""
    if stem in _ALWAYS_HARMONIC:
        return [n for n in values if n[: len(stem)] == stem and n[len(stem):].isdigit()]
    if stem not in values or (stem in PAIRS and stem not in single):
        return []
    return [] if any(stem in PAIRS[pair] for pair in single) else [stem]


def _equal(model: MeshModel, pair: str) -> bool:
    """Whether both values of a pair are the same, if the model has them."""
    values = model.parameters()
    return len({values.get(name) for name in PAIRS[pair]}) == 1


def are_alike(model: MeshModel) -> bool:
    """Whether both wheels have the same values."""
    return all(_equal(model, pair) for pair in _WHEELS)


def made_alike(view: View) -> View:
    """With the values of the first wheel for both."""
    for pair in _WHEELS:
        if not _equal(view.base, pair):
            view = view.with_value(pair, view.base.parameters()[PAIRS[pair][0]])
    return view
