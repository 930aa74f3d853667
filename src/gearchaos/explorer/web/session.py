"""The session of one page: its present view, the computations for it, and the display of their results."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import count
from typing import Any

import xarray as xr

from gearchaos.errors import InputError
from gearchaos.explorer.jobs.computations import Computations
from gearchaos.explorer.jobs.map_grid import Map
from gearchaos.explorer.jobs.point_motion import PointMotion
from gearchaos.explorer.jobs.skeleton import Skeleton
from gearchaos.explorer.jobs.worker import Workers
from gearchaos.explorer.panels.attractors import choices
from gearchaos.explorer.view.state import View
from gearchaos.explorer.web.page import Page

_REST_DELAY = 120
"""Milliseconds between a change of the view and the update of all that is not the crosshair, the motion or the map."""

_numbers = count(1)


class Session:
    """A page and its view; the `Display` of its computations.

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
        self.view, self._document, self._alive = view, document, True
        self.page = Page(start)
        self.computations = Computations(f"session-{next(_numbers)}", view, workers, self._call_soon, self)
        self._update_later: Any = None  # the timeout after which the rest of the page is updated
        self._basins_view = view  # the view whose basins are shown
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
            view = change(self.view)
        except InputError as error:
            self.page.show_message(str(error))
            self.page.controls.show(self.view)
            return
        self.page.show_message("")
        self._show(view)

    def start_in_basins(self, x: float, y: float) -> None:
        """Show the motion from a point in the plane of the basins shown."""
        if axes := self.page.basins.axes:
            values = (value / scale for value, scale in zip((x, y), self.page.basins.scales, strict=True))
            view = self._basins_view.with_changed_initial(dict(zip(axes, values, strict=True)))
            self.choose_initial(view.initial)

    def choose_initial(self, initial: tuple[tuple[str, float], ...]) -> None:
        """Show the motion at the point from other initial values."""
        self.change(lambda view: view.with_initial(initial))

    def ask_file(self, kind: str, suffix: str) -> None:
        """Make a file of the map or of the motion shown."""
        self.computations.ask_file(kind, suffix)

    def _show(self, view: View) -> None:
        """Show another view; only what differs is computed.

        The crosshair, the motion at the point and the map come first. The rest follows after `_REST_DELAY`, since each
        part of it would delay the display of the motion.
        """
        before, self.view = self.view, view
        self.page.mark(view)
        self.computations.update(view)
        if self._update_later is None:
            self._update_later = self._document.add_timeout_callback(partial(self._update_rest, before), _REST_DELAY)

    def _update_rest(self, before: View) -> None:
        """Update the rest of the page from an earlier view to the present one."""
        self._update_later, view = None, self.view
        if not self._alive:
            return
        self.page.show_view(view)
        computed = self.computations
        recoloured = (before.colour, before.physical) != (view.colour, view.physical)
        if recoloured and before.map_key == view.map_key and computed.map is not None:
            computed.show_map(computed.map)
        if before.physical != view.physical and computed.point_motion is not None:
            self.show_point_motion(computed.point_motion)
        computed.update_rest(before)

    # --- the display of results --------------------------------------------------------------------------------------

    def show_map(self, found: Map) -> None:
        """Draw the map."""
        self.page.show_map(found, self.view)

    def show_point_motion(self, found: PointMotion) -> None:
        """Draw the motion at the point."""
        self.page.show_point_motion(found, self.view)

    def show_diagram(self, found: xr.Dataset) -> None:
        """Draw the bifurcation diagram."""
        self.page.show_diagram(found, self.view)

    def show_basins(self, view: View, found: xr.Dataset) -> None:
        """Draw the basins of a view."""
        self._basins_view = view
        self.page.show_basins(found, view)

    def show_attractors(self, found: xr.Dataset) -> None:
        """List all motions of the point."""
        self.page.show_choices(choices(found))

    def clear_point_studies(self) -> None:
        """Remove the basins and the list of motions of the previous point."""
        self.page.clear_basins()
        self.page.show_choices([])

    def show_branch(self, found: xr.Dataset) -> None:
        """Draw the branch of a motion over the diagram."""
        self.page.show_branch(found, self.view)

    def clear_branch(self) -> None:
        """Remove the branch."""
        self.page.clear_branch()

    def show_skeleton(self, found: Skeleton | None) -> None:
        """Draw bifurcation curves over the map; None if they wait for the map."""
        self.page.show_skeleton(found)

    def clear_skeleton(self) -> None:
        """Remove the bifurcation curves."""
        self.page.clear_skeleton()

    def show_busy(self, tasks: Sequence[str], compiling: bool) -> None:
        """Say what is being computed."""
        self.page.show_busy(tasks, compiling)

    def show_message(self, message: str) -> None:
        """Show an error message."""
        self.page.show_message(message)

    def save_file(self, content: bytes, media_type: str, name: str) -> None:
        """Have the browser save a file."""
        self.page.messages.save_file(content, media_type, name)

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
