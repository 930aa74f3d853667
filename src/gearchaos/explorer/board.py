"""All that stands on a page: figures, controls, words; laid out by the template."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from bokeh.events import DoubleTap, PointEvent, PressUp, RangesUpdate, Tap

from gearchaos.errors import InputError
from gearchaos.explorer import words
from gearchaos.explorer.bounds import SORRY, number
from gearchaos.explorer.bridge import Bridge
from gearchaos.explorer.controls import Controls
from gearchaos.explorer.figures.basin import BasinFigure
from gearchaos.explorer.figures.bifurcation import BifurcationFigure
from gearchaos.explorer.figures.history import HistoryFigure
from gearchaos.explorer.figures.map import MapFigure
from gearchaos.explorer.figures.phase import PhaseFigure
from gearchaos.explorer.figures.portrait import PortraitFigure
from gearchaos.explorer.figures.spectrum import SpectrumFigure
from gearchaos.explorer.figures.style import plain
from gearchaos.explorer.forms import words_for
from gearchaos.explorer.maps import Map
from gearchaos.explorer.state import View
from gearchaos.plot._axes import symbol

if TYPE_CHECKING:
    from gearchaos.explorer.session import Session
    from gearchaos.gears.pair import GearPair

log = logging.getLogger(__name__)

_REST = 250
"""Milliseconds that the view of the map must rest before it is computed."""

_CLICKS = (Tap, DoubleTap, PressUp)
"""What Bokeh makes of a click: one soon after another is a double one, and a slow one, or one that a busy browser takes
note of late, a press."""

FILES = {
    f"{what}-{suffix}": f"{what} {words}"
    for what in ("map", "motion") for suffix, words in (("png", "PNG"), ("svg", "SVG"), ("nc", "data"))
}
"""What can be saved, of what and how, in words; the template has a button for each."""


class Board:
    """The models of one page, and what to do when a visitor touches them."""

    def __init__(self, session: Session, has_pair: bool) -> None:
        self._session = session
        self.bridge = Bridge({name: partial(self._do, action) for name, action in {
            "step": self._step, "choose": self._choose, "save": self._save, "basins": lambda _: session.ask_basin(),
            "set": self._set, "press": self._press,
        }.items()})
        self.controls = Controls(session.change, session.ask_basin, self.bridge, has_pair)
        put = self.bridge.put
        self.map, self.line, self.basin = MapFigure(put), BifurcationFigure(put), BasinFigure(put)
        self.history, self.phase = HistoryFigure(put), PhaseFigure(put)
        self.portrait, self.spectrum = PortraitFigure(put), SpectrumFigure(put)
        self._choices: list[dict[str, Any]] = []
        self.show_choices([])
        self._placed: tuple[Any, ...] = ()
        self._waiting: Any = None
        self._listen()

    def _listen(self) -> None:
        session = self._session
        self.map.figure.on_event(RangesUpdate, partial(self._do, self._moved))
        for click in _CLICKS:
            for figure, action in (
                (self.map, lambda event: session.point_at(event.x, event.y)), (self.line, self._along),
                (self.basin, self._from),
            ):
                figure.figure.on_event(click, partial(self._do, action))

    def _do(self, action: Callable[[Any], None], what: Any) -> None:
        """Do what a page asks for, which may be anything; whatever goes wrong there is told."""
        try:
            action(what)
        except InputError as error:
            self.tell(str(error))
        except Exception:
            log.exception("a page could not be answered")
            self.tell(SORRY)

    def roots(self) -> dict[str, Any]:
        """Every root of the template by name."""
        return {
            "map": self.map.figure, "history": self.history.figure, "phase": self.phase.figure,
            "portrait": self.portrait.figure, "spectrum": self.spectrum.figure, "line": self.line.figure,
            "basin": self.basin.figure,
        }

    # --- touched -------------------------------------------------------------------------------------------------

    def _moved(self, event: RangesUpdate) -> None:
        """The map was panned or zoomed: wait until it rests."""
        numbers = [number("end", end) for end in (event.x0, event.x1, event.y0, event.y1)]
        ends = (numbers[0], numbers[1]), (numbers[2], numbers[3])
        if self._same(ends):
            return
        document = self.map.figure.document
        if self._waiting is not None:
            document.remove_timeout_callback(self._waiting)
        self._waiting = document.add_timeout_callback(partial(self._rest, ends), _REST)

    def _rest(self, ends: tuple[tuple[float, float], tuple[float, float]]) -> None:
        self._waiting = None
        if not self._same(ends):
            self._session.zoom(*ends)

    def _same(self, ends: tuple[tuple[float, float], tuple[float, float]]) -> bool:
        """Whether that is what is shown, to a thousandth of a cell or so."""
        view = self._session.view
        return all(
            max(abs(low - a.start), abs(high - a.stop)) < 1e-6 * (a.stop - a.start)
            for a, (low, high) in zip((view.x, view.y), ends, strict=True)
        )

    def _step(self, value: Any) -> None:
        """An arrow key: so many columns and rows."""
        if isinstance(value, list) and len(value) == 2 and all(n in (-10, -1, 0, 1, 10) for n in value):
            self._session.step(*map(int, value))

    def _set(self, value: Any) -> None:
        """A field or a list."""
        self.controls.set(value)

    def _press(self, name: Any) -> None:
        """A button."""
        self.controls.press(name)

    def _choose(self, value: Any) -> None:
        """One of the motions on offer, by its number."""
        if isinstance(value, int) and 0 <= value < len(self._choices):
            self._session.start_from(self._choices[value]["start"])

    def _save(self, value: Any) -> None:
        """A file of the map or the motion."""
        if isinstance(value, str) and value in FILES:
            self._session.ask_export(*value.split("-"))

    def _along(self, event: PointEvent) -> None:
        x, y = self._session.view.at
        self._session.point_at(*((event.x, y) if self._session.view.line == "x" else (x, event.x)))

    def _from(self, event: PointEvent) -> None:
        if self.basin.axes[0]:
            self._session.start_in_basins(dict(zip(self.basin.axes, (event.x, event.y), strict=True)))

    # --- shown ---------------------------------------------------------------------------------------------------

    def place(self, view: View) -> None:
        """Axes of the map, and the point wherever it shows."""
        self.mark(view)
        self.line.mark(view.at["xy".index(view.line)])
        if self._placed != (view.x, view.y):
            self._placed = (view.x, view.y)
            self.map.place(view.x, view.y, (axis_words(view.x.name), axis_words(view.y.name)))

    def mark(self, view: View) -> None:
        """The point on the map."""
        self.map.mark(view.at)

    def show_map(self, found: Map, colour: str, pair: GearPair | None) -> None:
        """Draw the map and its legend."""
        self.map.show(found, colour, pair)
        how_far = (
            f'<span data-colour="{colour}" data-stride="{found.stride}" data-share="{found.share:.4f}"></span>')
        self.bridge.write("legend", self.map.legend + how_far)

    def show_busy(self, panels: Sequence[str], compiling: bool) -> None:
        """Say what is being computed, and whether that has kernels to compile first."""
        self.bridge.write("busy", words.busy_html(panels, compiling))

    def tell(self, message: str) -> None:
        """Show a message of what cannot be done, or none."""
        self.bridge.write("message", words.error_html(message))

    def show_verdict(self, html: str) -> None:
        """The verdict of the point, in words."""
        self.bridge.write("verdict", html)

    def clear_motion(self) -> None:
        """Show no motion, where there is none that stays bounded."""
        for figure in (self.history, self.phase, self.portrait, self.spectrum):
            figure.clear()

    def show_basin_legend(self) -> None:
        """The legend of what the basin plane shows."""
        self.bridge.write("basin-legend", self.basin.legend)

    def show_choices(self, choices: list[dict[str, Any]]) -> None:
        """A button for every motion of the point."""
        self._choices = choices
        self.bridge.write("others", words.choices_html(choices))


def axis_words(name: str) -> str:
    """The label of an axis of the map."""
    return f"{words_for(name)} {plain(symbol(name))}".strip()
