"""The session of one page: how its view changes, and what is computed and shown anew then."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import count
from typing import Any

from gearchaos.errors import InputError
from gearchaos.explorer.jobs.computations import Computations
from gearchaos.explorer.jobs.worker import Workers
from gearchaos.explorer.view.state import View
from gearchaos.explorer.web.page import Page

_REST_DELAY = 120
"""Milliseconds between a change of the view and the update of all that is not the crosshair, the motion or the map."""

_numbers = count(1)


class Session:
    """A page and the computations that it shows.

    Parameters
    ----------
    view : View
        The first view.
    workers : Workers
    document : bokeh Document
        Of the page.
    start : View
        What the server shows first; its gears are those of the page.
    """

    def __init__(self, view: View, workers: Workers, document: Any, start: View) -> None:
        self._document, self._alive = document, True
        self.page = Page(start, view)
        self.computations = Computations(f"session-{next(_numbers)}", view, workers, self._call_soon, self.page)
        self._update_later: Any = None  # the timeout after which the rest of the page is updated
        self.page.show_view(view)

    def start(self) -> None:
        """Begin to compute; results can only be sent once the page is connected."""
        self.computations.start()

    def close(self) -> None:
        """Cancel all computations of the page."""
        self._alive = False
        self.computations.close()

    # --- the view changes ------------------------------------------------------------------------------------------

    def change(self, change: Callable[[View], View]) -> None:
        """Change the view; if that is impossible, keep the present one and show an error message."""
        try:
            view = change(self.page.view)
        except InputError as error:
            self.page.show_message(str(error))
            self.page.controls.show(self.page.view)
            return
        self.page.show_message("")
        self._show(view)

    def start_in_basins(self, x: float, y: float) -> None:
        """Show the motion from a point in the plane of the basins shown."""
        if axes := self.page.basins.axes:
            values = (value / scale for value, scale in zip((x, y), self.page.basins.scales, strict=True))
            view = self.page.basins_view.with_changed_initial(dict(zip(axes, values, strict=True)))
            self.choose_initial(view.initial)

    def choose_initial(self, initial: tuple[tuple[str, float], ...]) -> None:
        """Show the motion at the point from other initial values."""
        self.change(lambda view: view.with_initial(initial))

    def _show(self, view: View) -> None:
        """Show another view; only what differs is computed.

        The crosshair, the motion at the point and the map come first. The rest follows after `_REST_DELAY`, since each
        part of it would delay the display of the motion.
        """
        before, self.page.view = self.page.view, view
        self.page.map.mark(view.at)
        self.computations.update(view)
        if self._update_later is None:
            self._update_later = self._document.add_timeout_callback(partial(self._update_rest, before), _REST_DELAY)

    def _update_rest(self, before: View) -> None:
        """Update the rest of the page from an earlier view to the present one."""
        self._update_later, view = None, self.page.view
        if not self._alive:
            return
        self.page.show_view(view)
        computed = self.computations
        recoloured = (before.colour, before.physical) != (view.colour, view.physical)
        if recoloured and before.map_key == view.map_key and computed.map is not None:
            computed.show_map(computed.map)
        if before.physical != view.physical and computed.point_motion is not None:
            self.page.show_point_motion(computed.point_motion)
        computed.update_rest(before)

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
