"""What a visitor does on the page (clicks, keys, zooming, the form), and the request to the session that results.

A browser may send anything, so every value is checked, and every error becomes a message on the page.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from functools import partial
from typing import Any

from bokeh.events import DoubleTap, PointEvent, PressUp, RangesUpdate, Tap

from gearchaos.errors import InputError
from gearchaos.explorer.jobs.export import FILES
from gearchaos.explorer.jobs.worker import INTERNAL_ERROR
from gearchaos.explorer.view.bounds import SKELETON_PERIOD, SKELETON_PERIODS, finite_number
from gearchaos.explorer.view.presets import presets
from gearchaos.explorer.web.session import Session

log = logging.getLogger(__name__)

_ZOOM_DELAY = 250
"""Milliseconds after the last change of the ranges of the map until the map of the new ranges is computed."""

_CLICKS = (Tap, DoubleTap, PressUp)
"""Events of Bokeh that are clicks: two in quick succession are a DoubleTap, and a slow one is a press."""

_STEPS = (-10, -1, 0, 1, 10)
"""Cells that an arrow key moves the point by."""

_Ends = tuple[tuple[float, float], tuple[float, float]]
"""Ends of the horizontal and of the vertical axis."""


class Events:
    """The events of a page.

    Parameters
    ----------
    session : Session
    """

    def __init__(self, session: Session) -> None:
        self._session, self._timeout, self._skeleton_period = session, None, SKELETON_PERIOD
        page = session.page
        page.messages.actions = {name: partial(self._checked, action) for name, action in {
            "step": self._step, "choose": self._choose, "save": self._save,
            "basins": lambda _: session.computations.ask_basins(),
            "set": self._set, "press": self._press,
        }.items()}
        page.map.figure.on_event(RangesUpdate, partial(self._checked, self._zoomed))
        for click in _CLICKS:
            for figure, action in (
                (page.map, self._click_map), (page.diagram, self._click_diagram),
                (page.basins, lambda event: session.start_in_basins(event.x, event.y)),
            ):
                figure.figure.on_event(click, partial(self._checked, action))

    def _checked(self, action: Callable[[Any], None], value: Any) -> None:
        """Perform an action; an error becomes a message on the page."""
        try:
            action(value)
        except InputError as error:
            self._session.page.show_message(str(error))
        except Exception:
            log.exception("a page could not be answered")
            self._session.page.show_message(INTERNAL_ERROR)

    # --- figures ---------------------------------------------------------------------------------------------------

    def _click_map(self, event: PointEvent) -> None:
        """Move the point."""
        self._session.change(lambda view: view.moved(event.x, event.y))

    def _click_diagram(self, event: PointEvent) -> None:
        """Move the point along the line of the bifurcation diagram."""
        self._session.change(
            lambda view: view.moved(event.x, view.at[1]) if view.line == "x" else view.moved(view.at[0], event.x))

    def _zoomed(self, event: RangesUpdate) -> None:
        """Compute the map of the new ranges, once panning or zooming has ended."""
        numbers = [finite_number("end", end) for end in (event.x0, event.x1, event.y0, event.y1)]
        ends = (numbers[0], numbers[1]), (numbers[2], numbers[3])
        if self._is_shown(ends):
            return
        document = self._session.page.map.figure.document
        if self._timeout is not None:
            document.remove_timeout_callback(self._timeout)
        self._timeout = document.add_timeout_callback(partial(self._zoom, ends), _ZOOM_DELAY)

    def _zoom(self, ends: _Ends) -> None:
        self._timeout = None
        if not self._is_shown(ends):
            self._session.change(lambda view: view.zoomed(*ends))

    def _is_shown(self, ends: _Ends) -> bool:
        """Whether these are the ends of the present axes, up to a small fraction of a cell."""
        view = self._session.page.view
        return all(
            max(abs(low - a.start), abs(high - a.stop)) < 1e-6 * (a.stop - a.start)
            for a, (low, high) in zip((view.x, view.y), ends, strict=True)
        )

    # --- keys, buttons, the form -----------------------------------------------------------------------------------

    def _step(self, value: Any) -> None:
        """An arrow key: columns and rows to move the point by."""
        if isinstance(value, list) and len(value) == 2 and all(n in _STEPS for n in value):
            columns, rows = map(int, value)
            self._session.change(lambda view: view.stepped(columns, rows))

    def _set(self, value: Any) -> None:
        """A field or a menu was set: its name and its value."""
        if not isinstance(value, list) or len(value) != 2 or not isinstance(value[0], str):
            return
        name, chosen = value
        if name == "skeleton-period":
            self._choose_skeleton_period(chosen)
            return
        change = self._session.page.controls.change_of(name, chosen)
        if change is not None:
            self._session.change(change)
            if name == "preset" and str(chosen) in presets() and presets()[str(chosen)].basins:
                self._session.computations.ask_basins()

    def _press(self, name: Any) -> None:
        """A button of the form, of the dossier, of the diagram or of the map."""
        computed = self._session.computations
        actions = {
            "follow": computed.ask_branch, "drop-branch": computed.clear_branch, "skeleton": self._toggle_skeleton,
        }
        if isinstance(name, str) and name in actions:
            actions[name]()
            return
        change = self._session.page.controls.change_of_button(name)
        if change is not None:
            self._session.change(change)

    def _toggle_skeleton(self) -> None:
        """Show the bifurcation curves over the map, or remove them."""
        computed = self._session.computations
        if computed.skeleton_period:
            computed.clear_skeleton()
        else:
            computed.ask_skeleton(self._skeleton_period)

    def _choose_skeleton_period(self, value: Any) -> None:
        """The largest period of the orbits of the bifurcation curves; those shown are computed again."""
        if str(value) not in map(str, SKELETON_PERIODS):
            return
        self._skeleton_period = int(value)
        if self._session.computations.skeleton_period:
            self._session.computations.ask_skeleton(self._skeleton_period)

    def _choose(self, value: Any) -> None:
        """One of the motions of the point, by its number."""
        choices = self._session.page.choices
        if isinstance(value, int) and 0 <= value < len(choices):
            self._session.choose_initial(choices[value].initial)

    def _save(self, value: Any) -> None:
        """A file, by its name in `FILES`."""
        if isinstance(value, str) and value in FILES:
            self._session.computations.ask_file(*value.split("-"))
