"""The session of one page: what each click, key, field and button does, and what is computed and shown then.

A browser may send anything, so every value is checked, and every error becomes a message on the page.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import count
from typing import Any

from bokeh.events import DoubleTap, PointEvent, PressUp, RangesUpdate, Tap

from gearchaos.errors import InputError
from gearchaos.explorer.core.bounds import HIGHEST_HARMONIC, SKELETON_PERIOD, SKELETON_PERIODS, finite_number
from gearchaos.explorer.core.drawing import Drawing
from gearchaos.explorer.core.models import are_alike
from gearchaos.explorer.core.opened import Opened, redrawn
from gearchaos.explorer.core.presets import presets
from gearchaos.explorer.core.state import View
from gearchaos.explorer.core.style import Panel
from gearchaos.explorer.core.worker import INTERNAL_ERROR, Workers
from gearchaos.explorer.web.computations import Computations
from gearchaos.explorer.web.export import FILES
from gearchaos.explorer.web.form import GEARS, field_values, harmonics_of
from gearchaos.explorer.web.page import Page

log = logging.getLogger(__name__)

_REST_DELAY = 120
"""Milliseconds between a change of the view and the update of all that is not the crosshair, the motion or the map."""

_ZOOM_DELAY = 250
"""Milliseconds after the last change of the ranges of the map until the map of the new ranges is computed."""

_CLICKS = (Tap, DoubleTap, PressUp)
"""Events of Bokeh that are clicks: two in quick succession are a DoubleTap, and a slow one is a press."""

_STEPS = (-10, -1, 0, 1, 10)  # cells that an arrow key moves the point by

_MENUS: dict[str, Callable[[View, str], View]] = {
    "kind": View.with_kind, "stiffness": View.with_stiffness,
    "damping_law": View.with_damping_law,
    "x": lambda view, name: view.with_axis("x", name), "y": lambda view, name: view.with_axis("y", name),
    "colour": lambda view, name: replace(view, colour=name), "line": lambda view, name: replace(view, line=name),
    "mesh": lambda view, name: replace(view, mesh=name),
    "change": lambda view, name: replace(view, change=name),
}
"""The change made by choosing from a menu; an impossible view is refused by `View`."""

_ASKED = {"follow": Computations.ask_branch, "drop-branch": Computations.clear_branch, "run": Computations.ask_run_up,
          "assess": Computations.ask_assessment, "knock": Computations.ask_knock,
          "tolerances": Computations.ask_tolerances, "relief": Computations.ask_relief,
          "changes": Computations.ask_changes}
"""What a button asks for, by its name."""

_RUN_NUMBERS = {f"run-{name}": name for name in ("start", "stop", "duration")}
"""Fields of the run-up, by the name of the field."""

_numbers = count(1)


class Session:
    """A page and the computations that it shows.

    ``view`` is the first view, ``opened`` has the gears of the page.
    """

    def __init__(self, view: View, workers: Workers, document: Any, opened: Opened) -> None:
        self._document, self._alive, self._started = document, True, False
        page = self.page = Page(opened, view)
        self.computations = Computations(f"session-{next(_numbers)}", view, workers, self._call_soon, page)
        self._update_later: Any = None  # the timeout after which the rest of the page is updated
        self._zoom_later: Any = None
        self._skeleton_period = SKELETON_PERIOD
        page.messages.act = partial(self._checked, self._act)
        page.map.figure.on_event(RangesUpdate, partial(self._checked, self._zoomed))
        for panel in (page.map, page.diagram, page.basins):
            for click in _CLICKS:
                panel.figure.on_event(click, partial(self._checked, self._click, panel))
        page.show_view()

    def start(self) -> None:
        """Begin to compute, once there is something to compute; results can only be sent once the page is connected."""
        if not self._started and self.page.opened.is_complete:
            self._started = True
            self.computations.start(self.page.view)
            self.computations.ask_factors(self.page.compared)

    def close(self) -> None:
        """Cancel all computations of the page."""
        self._alive = False
        self.computations.close()

    # --- the view changes ------------------------------------------------------------------------------------------

    def change(self, change: Callable[[View], View]) -> None:
        """Change the view; if that is impossible, keep the present one and show an error message.

        Only what differs is computed. The crosshair, the motion at the point and the map come first. The rest follows
        after `_REST_DELAY`, since each part of it would delay the display of the motion.
        """
        before = self.page.view
        try:
            view = change(before)
        except InputError as error:
            self.page.show_message(str(error))
            self.page.show_form()
            return
        self.page.show_message("")
        self.page.view = view
        self.page.map.mark(view.at)
        self.computations.update(view)
        if self._update_later is None:
            self._update_later = self._document.add_timeout_callback(partial(self._update_rest, before), _REST_DELAY)

    def _update_rest(self, before: View) -> None:
        """Update the rest of the page from an earlier view to the present one."""
        self._update_later, view = None, self.page.view
        if not self._alive:
            return
        self.page.show_view()
        computed = self.computations
        recoloured = (before.colour, before.physical, before.mesh) != (view.colour, view.physical, view.mesh)
        if recoloured and before.map_key == view.map_key and computed.map is not None:
            computed.show_map(computed.map)
        if (before.physical, before.mesh) != (view.physical, view.mesh) and computed.point_motion is not None:
            self.page.show_point_motion(computed.point_motion)
        if before.physical != view.physical and computed.knocked is not None:
            self.page.show_knock(computed.knocked)
        computed.update_rest(before)
        computed.ask_factors(self.page.compared)

    def _call_soon(self, function: Callable[[], None]) -> None:
        """Have the event loop call a function, unless the page has been closed."""
        if not self._alive:
            return
        try:
            self._document.add_next_tick_callback(function)
        except AttributeError:  # raised by a document that is being destroyed
            context = self._document.session_context
            if context is not None and not context.destroyed:
                raise

    def _checked(self, action: Callable[..., None], *values: Any) -> None:
        """Perform an action; an error becomes a message on the page."""
        try:
            action(*values)
        except InputError as error:
            self.page.show_message(str(error))
        except Exception:
            log.exception("a page could not be answered")
            self.page.show_message(INTERNAL_ERROR)

    # --- figures ---------------------------------------------------------------------------------------------------

    def _click(self, panel: Panel, event: PointEvent) -> None:
        """Move the point, on the diagram along its line only; show the motion from one of the basins."""
        page, x, y = self.page, event.x, event.y
        if panel is page.diagram:
            x, y = (x, page.view.at[1]) if page.view.line == "x" else (page.view.at[0], x)
        if panel is not page.basins:
            self.change(lambda view: view.moved(x, y))
        elif axes := page.basins.axes:
            values = (value / scale for value, scale in zip((x, y), page.basins.scales, strict=True))
            initial = page.basins_view.with_changed_initial(dict(zip(axes, values, strict=True))).initial
            self.change(lambda view: replace(view, initial=initial))

    def _zoomed(self, event: RangesUpdate) -> None:
        """Compute the map of the new ranges, once panning or zooming has ended."""
        x0, x1, y0, y1 = (finite_number("end", end) for end in (event.x0, event.x1, event.y0, event.y1))
        ends = (x0, x1), (y0, y1)

        def is_shown() -> bool:  # up to a small fraction of a cell
            view = self.page.view
            return all(
                max(abs(low - a.start), abs(high - a.stop)) < 1e-6 * (a.stop - a.start)
                for a, (low, high) in zip((view.x, view.y), ends, strict=True)
            )

        def zoom() -> None:
            self._zoom_later = None
            if not is_shown():
                self.change(lambda view: view.zoomed(*ends))

        if is_shown():
            return
        if self._zoom_later is not None:
            self._document.remove_timeout_callback(self._zoom_later)
        self._zoom_later = self._document.add_timeout_callback(zoom, _ZOOM_DELAY)

    # --- keys, buttons, the form -----------------------------------------------------------------------------------

    def _act(self, action: str, value: Any) -> None:
        """What a visitor asks for; what no page asks for is ignored."""
        page, computed = self.page, self.computations
        match action, value:
            case "step", [columns, rows] if columns in _STEPS and rows in _STEPS:  # cells to move the point by
                self.change(lambda view: view.stepped(int(columns), int(rows)))
            case "choose", int(number) if 0 <= number < len(page.choices):  # one of the motions of the point
                initial = page.choices[number].initial
                self.change(lambda view: replace(view, initial=initial))
            case "save", str(name) if name in FILES:
                computed.ask_file(*name.split("-"))
            case "basins", _:
                computed.ask_basins()
            case "press", str(name) if name in _ASKED:
                _ASKED[name](computed)
            case "press", "skeleton" if computed.skeleton_period:
                computed.clear_skeleton()
            case "press", "skeleton":
                computed.ask_skeleton(self._skeleton_period)
            case "range", int(number) if page.line is not None and 0 <= number < len(page.ranges):
                line, speed = page.line, page.ranges[number]
                self.change(lambda view: line.moved(view, speed))
            case "press", "run-sound":
                self.change(lambda view: view.with_run(sound=not view.sounds))
            case "press", "alike":
                # separate fields for both wheels; or common ones, after giving wheel 2 the values of wheel 1
                alike = are_alike(page.view.model)
                page.merge_wheels = merge = not (page.merge_wheels and alike)
                page.show_form()
                if merge and not alike:
                    self.change(View.with_alike_wheels)
            case "press", ("more-eps" | "more-c") as name:
                family = name.removeprefix("more-")
                number = 1 + len(harmonics_of(family, page.view.model.parameters()))
                if number <= HIGHEST_HARMONIC:
                    self.change(lambda view: view.with_value(f"{family}{number}", 0.01))
            case "draw", list(texts) if page.opened.drawing is not None:
                self._draw(Drawing.of(texts), page.opened.kept)
            case "press", "keep" if page.opened.drawing is not None:
                self._draw(page.opened.drawing, None if page.opened.kept else page.opened.drawing)
            case "press", "units" if page.opened.start.gears is not None:
                self.change(View.with_other_units)
            case "set", [str(name), chosen]:
                self._set(name, chosen)

    def _draw(self, drawing: Drawing, kept: Drawing | None) -> None:
        """Another drawing, or another one that is kept: its numbers and curves at once, then its motions."""
        page, before = self.page, self.page.opened
        page.draw(opened := before.drawn(drawing, kept))
        view = redrawn(page.view, before, opened) if opened.is_complete else page.view
        if self._started and opened.is_complete:
            self.change(lambda _: view)
            page.show_drawing(drawing)
        else:
            page.view = view
            page.show_view()
            self.start()

    def _set(self, name: str, chosen: Any) -> None:
        """A field or a menu was set."""
        if name == "skeleton-period":
            if str(chosen) in map(str, SKELETON_PERIODS):
                self._skeleton_period = int(chosen)
                if self.computations.skeleton_period:  # those shown are computed again
                    self.computations.ask_skeleton(self._skeleton_period)
        elif name == "preset" and chosen == GEARS and self.page.opened.start.gears is not None:
            self.change(lambda _: self.page.opened.start)
        elif name == "preset" and (key := str(chosen)) in presets():
            preset = presets()[key]
            self.page.preset = key
            self.change(lambda _: preset.view)
            if preset.basins:  # they are computed at once
                self.computations.ask_basins()
        elif name == "preset":  # shows the present one again
            self.change(lambda view: view)
        elif name == "run-way":
            self.change(lambda view: view.with_run(way=str(chosen)))
        elif name in _RUN_NUMBERS:
            self.change(lambda view: view.with_run(**{_RUN_NUMBERS[name]: finite_number(name, chosen)}))
        elif name in _MENUS:
            self.change(lambda view: _MENUS[name](view, str(chosen)))
        elif name in field_values(self.page.view):
            if isinstance(chosen, float):
                chosen = float(f"{chosen:.10g}")  # without a slider's rounding error
            self.change(lambda view: view.with_value(name, chosen))
