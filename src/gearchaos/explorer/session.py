"""One visitor's page: a view, what is being computed for it, and what of it is on show."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import count
from typing import Any

import xarray as xr

from gearchaos.errors import InputError
from gearchaos.explorer import export, lines, words
from gearchaos.explorer.board import Board
from gearchaos.explorer.dossier import Dossier, dossier, followed
from gearchaos.explorer.elsewhere import Steps
from gearchaos.explorer.figures.history import times
from gearchaos.explorer.figures.style import label, plain
from gearchaos.explorer.maps import COARSE, Map, sharpened
from gearchaos.explorer.state import View
from gearchaos.explorer.worker import Job, Worker
from gearchaos.gears.pair import GearPair, physical
from gearchaos.plot._axes import symbol
from gearchaos.studies.axis import Axis

_SETTLE = 0.05
"""Seconds after the last change of a slider before slow work begins."""

_COARSE = 4
"""The first diagram has every so many-th column."""

_FOLLOW = 120
"""Milliseconds after which the rest of the page follows the point."""

_numbers = count(1)
log = logging.getLogger(__name__)


class Session:
    """What happens on one page.

    Parameters
    ----------
    view : View
        To begin with.
    workers : (Worker, Worker)
        For the motion at the point, and for maps and everything else that takes long.
    document : bokeh Document
        Of the page.
    pair : GearPair, optional
        Whose units results may be shown in.
    """

    def __init__(self, view: View, workers: tuple[Worker, Worker], document: Any, pair: GearPair | None) -> None:
        self.name, self.view, self.pair = f"session-{next(_numbers)}", view, pair
        self._quick, self._slow = workers
        self._document, self._alive = document, True
        self._busy: set[str] = set()
        self._map: Map | None = None
        self._dossier: Dossier | None = None
        self._motion_key: Any = None
        self._portrait_key: Any = None
        self._following: Any = None
        self._basin_start: tuple[tuple[str, float], ...] = ()
        self._first = self._line_waits = self._basin_waits = False
        self.board = Board(self, pair is not None)
        self._show_view()

    def begin(self) -> None:
        """Ask for all that the page shows; not before the page's connection can be told of the answers.

        What lies about the point waits for a first map.
        """
        self._ask_dossier()
        self._ask_map()
        self._first = True

    # --- what a visitor does -------------------------------------------------------------------------------------

    def change(self, wanted: Callable[[View], View]) -> None:
        """Go to another view, or say why that cannot be and stay."""
        try:
            view = wanted(self.view)
        except InputError as error:
            self.board.tell(str(error))
            self.board.controls.show(self.view)
            return
        self.board.tell("")
        self.go(view)

    def go(self, view: View) -> None:
        """Show another view; only what differs is computed anew.

        The point goes first, and what is known of its motion; controls, address and all that takes long follow when
        that is on its way, since each of them keeps the event loop from showing the motion.
        """
        before, self.view = self.view, view
        self.board.mark(view)
        if before.point != view.point:
            self._ask_dossier()
        if before.plane != view.plane:
            self._ask_map()
        if self._following is None:
            self._following = self._document.add_timeout_callback(partial(self._follow, before), _FOLLOW)

    def _follow(self, before: View) -> None:
        """Bring the rest of the page from the view it shows to the present one."""
        self._following, view = None, self.view
        if not self._alive:
            return
        self._show_view()
        anew = (before.colour, before.physical) != (view.colour, view.physical)
        if anew and before.plane == view.plane and self._map is not None:
            self._draw_map(self._map)
        if before.physical != view.physical and self._dossier is not None:
            self._draw_dossier(self._dossier)
        if _line_key(before) != _line_key(view):
            self._ask_line()
        if before.base != view.base:
            self._leave_point()
        self._ask_waiting_basin()

    def _ask_waiting_basin(self) -> None:
        if self._basin_waits:
            self.ask_basin()

    def point_at(self, x: float, y: float) -> None:
        """Move the point."""
        self.change(lambda view: view.moved(x, y))

    def step(self, columns: int, rows: int) -> None:
        """Move the point by cells."""
        self.change(lambda view: view.stepped(columns, rows))

    def zoom(self, x: tuple[float, float], y: tuple[float, float]) -> None:
        """Show another part of the plane."""
        axes = [
            Axis(a.name, float(low), float(high), a.count)
            for a, (low, high) in zip((self.view.x, self.view.y), (x, y), strict=True)
        ]
        if axes != [self.view.x, self.view.y]:
            self.change(lambda view: replace(view, x=axes[0], y=axes[1]))

    def start_in_basins(self, values: dict[str, float]) -> None:
        """Show the motion that a start in the plane of the basins on show leads to."""
        self.change(lambda view: replace(view, start=replace(view, start=self._basin_start).started(values).start))

    def start_from(self, values: tuple[tuple[str, float], ...]) -> None:
        """Show the motion that another start at the point leads to."""
        self.change(lambda view: replace(view, start=values))

    def ask_basin(self) -> None:
        """Compute the basins of the point, once the page has come to it."""
        self._basin_waits = self._first or self._following is not None
        if not self._basin_waits:
            self._ask(self._slow, "basins", partial(lines.basins, self.view), partial(
                self._draw_basin, self.view.start))

    def ask_export(self, kind: str, suffix: str) -> None:
        """Make a file of what is on show."""
        dataset = self._dataset(kind)
        if dataset is None:
            self.board.tell("There is nothing to save yet.")
            return
        title = self._dossier.verdict.label if self._dossier and kind == "motion" else ""
        steps = partial(export.exported, kind, suffix, dataset, self.view.colour, title)
        self._ask(self._quick, f"{kind}.{suffix}", steps, lambda found: self.board.bridge.download(*found))

    def close(self) -> None:
        """Forget all work for this page."""
        self._alive = False
        for worker in (self._quick, self._slow):
            worker.drop(self.name)

    # --- asking --------------------------------------------------------------------------------------------------

    def _show_view(self) -> None:
        view = self.view
        self.board.controls.show(view)
        self.board.place(view)
        self.board.bridge.say(view.query(), export.as_python(view, self._pair), export.as_toml(view, self.pair))

    def _ask_dossier(self) -> None:
        self._quick.drop(self.name, "chaos")
        self._busy.discard("chaos")
        self._ask(self._quick, "motion", partial(dossier, self.view.point), self._take_dossier)

    def _ask_map(self) -> None:
        self._map = None
        self._ask(self._slow, "map", partial(sharpened, self.view), self._draw_map, _SETTLE)

    def _ask_line(self, *strides: int) -> None:
        """Ask for the diagram; the finer one waits until the map is sharp."""
        self._line_waits = not strides and "map" in self._busy
        strides = strides or ((_COARSE,) if self._line_waits else (_COARSE, 1))
        self._ask(self._slow, "diagram", partial(lines.bifurcation, self.view, *strides), self._draw_line, 2 * _SETTLE)

    def _leave_point(self) -> None:
        """Other motions and basins belong to the point left behind."""
        self._slow.drop(self.name, "basins")
        self._finished("basins", None)
        self.board.basin.clear()
        self.board.show_basin_legend()
        self.board.show_choices([])
        self._ask(self._slow, "other motions", partial(lines.attractors, self.view), self._draw_choices, 3 * _SETTLE)

    def _ask(
        self, worker: Worker, panel: str, steps: Steps, draw: Callable[[Any], None], delay: float = 0.0,
    ) -> None:
        self._busy.add(panel)
        self._show_busy()
        worker.submit(self.name, panel, Job(
            steps, lambda found: self._later(partial(self._show, draw, found)),
            lambda message: self._later(partial(self._finished, panel, message)), delay,
            lambda: self._later(partial(self._show_busy, compiling=True)),
        ))

    def _show(self, draw: Callable[[Any], None], found: Any) -> None:
        draw(found)
        self._show_busy()

    def _show_busy(self, compiling: bool = False) -> None:
        share = 0.0 if self._map is None else self._map.share
        how_far = f"map {100 * share:.0f} %" if share < 1 else "map (following chaos)"
        self.board.show_busy([how_far if p == "map" else p for p in sorted(self._busy)], compiling)

    def _finished(self, panel: str, message: str | None) -> None:
        self._busy.discard(panel)
        self._show_busy()
        if message:
            self.board.tell(f"{panel}: {message}")
        if panel == "map":
            self._go_on()
            self._finish_line()

    def _later(self, action: Callable[[], None]) -> None:
        """Have the event loop do something, as long as the page is there; it may go away at any moment."""
        if not self._alive:
            return
        try:
            self._document.add_next_tick_callback(action)
        except AttributeError:  # of a document that is being taken apart
            context = self._document.session_context
            if context is not None and not context.destroyed:
                raise

    # --- showing -------------------------------------------------------------------------------------------------

    def _draw_map(self, found: Map) -> None:
        self._map = found
        if self.view.colour not in found.dataset and self.view.colour != "motion":
            return
        self.board.show_map(found, self.view.colour, self._pair)
        if found.stride <= COARSE[-1]:
            self._go_on()
        if found.share == 1:
            self._finish_line()

    def _go_on(self) -> None:
        """Ask for what waits for a first map."""
        if self._first:
            self._first = False
            self._ask_line()
            self._leave_point()
            self._ask_waiting_basin()

    def _finish_line(self) -> None:
        """Ask for the finer diagram that waits for the map."""
        if self._line_waits:
            self._ask_line(1)

    def _take_dossier(self, found: Dossier) -> None:
        """Show what is known of the motion, unless the point has moved on since; what does not repeat is then followed
        on, which takes long."""
        if found.model != self.view.point:
            return
        self._draw_dossier(found := found.after(self._dossier))
        if not found.final and _stage(found) == "followed":
            self._ask(self._quick, "chaos", partial(followed, found.model, found.verdict.label), self._take_dossier)

    def _draw_dossier(self, found: Dossier) -> None:
        self._dossier = found
        pair = self._pair
        where = ", ".join(
            f"{plain(symbol(a.name))} = {v:g}" for a, v in zip((self.view.x, self.view.y), self.view.at, strict=True))
        self._draw_portrait(found, pair)
        if found.motion is not None:
            self._draw_motion(found.motion, pair)
        elif not found.verdict.section:
            self.board.clear_motion()
            self._motion_key = self._portrait_key = None
        self.board.show_verdict(words.verdict_html(found, where, _stage(found), pair))

    def _draw_portrait(self, found: Dossier, pair: GearPair | None) -> None:
        key = found.model, found.verdict.periods_spent, found.portrait is None, pair
        if not found.verdict.section or key == self._portrait_key:
            return
        self._portrait_key = key
        x, y = found.points(pair)
        self.board.portrait.show(x.values, y.values, (label(x, "z"), label(y, "z_dot")))

    def _draw_motion(self, motion: xr.Dataset, pair: GearPair | None) -> None:
        key = float(motion["z"].values[0]), motion.sizes["tau"], pair
        if key == self._motion_key:
            return
        self._motion_key = key
        tau, period = times(motion)
        shown = motion if pair is None else physical(motion, pair)
        self.board.spectrum.show(motion, shown["z_dot"])
        self.board.history.show(shown, tau, period)
        self.board.phase.show(shown, 1.0 if pair is None else pair.scales.length * 1e6)

    def _draw_line(self, found: xr.Dataset) -> None:
        if found:
            self.board.line.show(found)

    def _draw_basin(self, start: tuple[tuple[str, float], ...], found: xr.Dataset) -> None:
        if found:
            self._basin_start = start
            self.board.basin.show(found)
            self.board.show_basin_legend()

    def _draw_choices(self, found: xr.Dataset) -> None:
        self.board.show_choices(words.attractor_choices(found))

    def _dataset(self, kind: str) -> xr.Dataset | None:
        """The data of a panel, in the units on show."""
        found = {
            "map": None if self._map is None else self._map.dataset,
            "motion": None if self._dossier is None else self._dossier.motion,
        }[kind]
        if found is None:
            return None
        return found if self._pair is None else physical(found, self._pair)

    @property
    def _pair(self) -> GearPair | None:
        """The pair in whose units results are on show, if they are."""
        return self.pair if self.view.physical else None


def _stage(found: Dossier) -> str:
    """How far a dossier is, in one word."""
    if found.motion is None and found.verdict.section:
        return "verdict"
    return "complete" if found.final else "followed"


def _line_key(view: View) -> tuple[Any, ...]:
    """What the diagram depends on."""
    axis = view.x if view.line == "x" else view.y
    return view.base.with_values({axis.name: axis.start}), axis
