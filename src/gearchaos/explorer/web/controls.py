"""What a visitor sets on the page: fields, menus, buttons; and how each of them changes the view."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from gearchaos.errors import InputError
from gearchaos.explorer.panels.units import Units
from gearchaos.explorer.view.bounds import HIGHEST_HARMONIC
from gearchaos.explorer.view.models import are_alike, equal
from gearchaos.explorer.view.presets import preset_of, presets
from gearchaos.explorer.view.state import View, stiffness_name
from gearchaos.explorer.web.form import GEARS, field_values, harmonics_of, line_menu, parameter_form, plane_menus
from gearchaos.explorer.web.html import render
from gearchaos.explorer.web.messages import Messages
from gearchaos.model import PARAMETER_PAIRS

_NUMBER = ".8g"
"""Format of a number in a field, which is short enough to be visible as a whole; the address has all digits."""

Change = Callable[[View], View]
"""A function that takes the present view and returns the one that a visitor asks for.

It raises `InputError` if that view is impossible.
"""


class Controls:
    """The form of a page.

    Parameters
    ----------
    messages : Messages
        To the browser.
    start : View
        What the server shows first; results for its gears can be shown in physical units.
    """

    def __init__(self, messages: Messages, start: View) -> None:
        self._messages, self._start, self._has_gears = messages, start, start.gears is not None
        self._merge_wheels, self._preset = True, ""
        self._view: View
        self._layout: Any = None

    def change_of(self, name: str, value: Any) -> Change | None:
        """The change made by setting a field or menu to a value; None if there is no field or menu of this name."""
        if name == "preset" and value == GEARS and self._has_gears:
            return lambda _: self._start
        if name in _MENUS:
            if name == "preset" and str(value) in presets():
                self._preset = str(value)
            return lambda view: _MENUS[name](view, str(value))
        if name in field_values(self._view):
            exact = float(f"{value:.10g}") if isinstance(value, float) else value  # without a slider's rounding error
            return lambda view: view.with_value(name, exact)
        return None

    def change_of_button(self, name: Any) -> Change | None:
        """The change made by pressing a button; None if there is none."""
        if name == "alike":
            return self._toggle_alike()
        if name == "units" and self._has_gears:
            return _with_other_units
        if name in ("more-eps", "more-c"):
            return self._one_more(name.removeprefix("more-"))
        return None

    def _toggle_alike(self) -> Change | None:
        """Show separate fields for both wheels; or common ones, after giving wheel 2 the values of wheel 1."""
        self._merge_wheels = not (self._merge_wheels and are_alike(self._view.model))
        self.show(self._view)
        return View.with_alike_wheels if self._merge_wheels and not are_alike(self._view.model) else None

    def _one_more(self, family: str) -> Change | None:
        """Add the next harmonic of a family."""
        number = 1 + len(harmonics_of(family, self._view.model.parameters()))
        return (lambda view: view.with_value(f"{family}{number}", 0.01)) if number <= HIGHEST_HARMONIC else None

    def show(self, view: View) -> None:
        """Show a view; the form is replaced only if it has other fields."""
        self._view = view
        self._preset, alike = preset_of(view, self._preset), self._merge_wheels and are_alike(view.operating_point)
        merged = {pair for pair in PARAMETER_PAIRS if alike and equal(view.operating_point, pair)}
        names, units = tuple(field_values(view)), Units(view.gears if view.physical else None, self._has_gears)
        layout = view.model.kind, names, view.x.name, view.y.name, merged, view.physical and self._has_gears
        if layout != self._layout:
            self._layout = layout
            form = parameter_form(view, merged, self._start)
            self._messages.write("parameters", render("parameters.html.j2", form=form))
            self._messages.write("axes", render("menus.html.j2", menus=plane_menus(view, units)))
            self._messages.write("line-choose", render("menus.html.j2", menus=[line_menu()]))
        self._messages.set_values({
            **{name: f"{value:{_NUMBER}}" for name, value in field_values(view).items()},
            "preset": self._preset if view.gears is None else GEARS, "kind": view.model.kind,
            "stiffness": stiffness_name(view.model), "x": view.x.name,
            "y": view.y.name, "colour": view.colour, "line": view.line, "alike": alike, "units": view.physical,
        })


def _with_other_units(view: View) -> View:
    """The view with physical instead of dimensionless units, or the other way round."""
    if view.gears is None:
        raise InputError("units", "must be dimensionless for a figure of the paper", "physical",
                         "Choose the gears in the menu of presets.")
    return replace(view, physical=not view.physical)


_MENUS: dict[str, Callable[[View, str], View]] = {
    "preset": lambda view, key: presets()[key].view if key in presets() else view,
    "kind": View.with_kind, "stiffness": View.with_stiffness,
    "x": lambda view, name: view.with_axis("x", name), "y": lambda view, name: view.with_axis("y", name),
    "colour": lambda view, name: replace(view, colour=name), "line": lambda view, name: replace(view, line=name),
}
"""The change made by choosing from a menu; an impossible view is refused by `View`."""
