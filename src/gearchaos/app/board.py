"""All that stands on a page: figures, controls, words; laid out by the template."""

from __future__ import annotations

from functools import partial
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from bokeh.events import RangesUpdate, Tap
from bokeh.layouts import row
from bokeh.models import Button, Div, InlineStyleSheet

from gearchaos.app import words
from gearchaos.app.bridge import Bridge
from gearchaos.app.controls import Controls
from gearchaos.app.figures.basin import BasinFigure
from gearchaos.app.figures.bifurcation import BifurcationFigure
from gearchaos.app.figures.history import HistoryFigure
from gearchaos.app.figures.map import MapFigure
from gearchaos.app.figures.phase import PhaseFigure
from gearchaos.app.figures.portrait import PortraitFigure
from gearchaos.app.figures.spectrum import SpectrumFigure
from gearchaos.app.figures.style import plain
from gearchaos.app.maps import Map
from gearchaos.app.state import View
from gearchaos.plot._axes import symbol

if TYPE_CHECKING:
    from gearchaos.app.session import Session

_REST = 250
"""Milliseconds that the view of the map must rest before it is computed."""

_FILES = (("map", "png"), ("map", "svg"), ("map", "nc"), ("motion", "png"), ("motion", "svg"), ("motion", "nc"))


class Board:
    """The models of one page, and what to do when a visitor touches them."""

    def __init__(self, session: Session, has_pair: bool) -> None:
        self._session = session
        self._css = InlineStyleSheet(css=files("gearchaos.app").joinpath("templates/inner.css").read_text("utf-8"))
        self.controls = Controls(session.change, self._css)
        self.controls.physical.visible = has_pair
        self.bridge = Bridge(session.step)
        self.map, self.line, self.basin = MapFigure(), BifurcationFigure(), BasinFigure()
        self.history, self.phase = HistoryFigure(), PhaseFigure()
        self.portrait, self.spectrum = PortraitFigure(), SpectrumFigure()
        self.busy, self.message, self.legend = self._words("busy"), self._words("message"), self._words("legend")
        self.verdict, self.basin_legend = self._words("verdict"), self._words("basin-legend")
        self.others = row(sizing_mode="stretch_width", name="others", styles={"flex-wrap": "wrap"})
        self.show_choices([])
        self._share, self._panels = 0.0, frozenset[str]()
        self._placed: tuple[Any, ...] = ()
        self._waiting: Any = None
        self._listen()

    def _words(self, name: str) -> Div:
        return Div(text="", name=name, sizing_mode="stretch_width", stylesheets=[self._css], margin=0)

    def _listen(self) -> None:
        session = self._session
        self.map.figure.on_event(Tap, lambda event: session.point_at(event.x, event.y))
        self.map.figure.on_event(RangesUpdate, self._moved)
        self.line.figure.on_event(Tap, self._along)
        self.basin.figure.on_event(Tap, self._from)

    def roots(self) -> dict[str, Any]:
        """Every root of the template by name."""
        c = self.controls
        return {
            "busy": self.busy, "downloads": row(*self._buttons()), "message": self.message, "controls": c.column,
            "choose": row(c.x, c.y, c.colour, sizing_mode="stretch_width"), "map": self.map.figure,
            "legend": self.legend, "verdict": self.verdict, "others": self.others, "history": self.history.figure,
            "phase": self.phase.figure, "portrait": self.portrait.figure, "spectrum": self.spectrum.figure,
            "line_choose": row(c.line, sizing_mode="stretch_width"),
            "line": self.line.figure, "basin_choose": self._basin_button(),
            "basin": self.basin.figure, "basin_legend": self.basin_legend,
        }

    def _buttons(self) -> list[Button]:
        out = []
        for kind, suffix in _FILES:
            name = {"nc": "data"}.get(suffix, suffix.upper())
            button = Button(label=f"{kind} {name}", name=f"save-{kind}-{suffix}", height=28, margin=2)
            button.on_click(partial(self._session.ask_export, kind, suffix))
            out.append(button)
        return out

    def _basin_button(self) -> Button:
        button = Button(label="basins of this point: which start leads where", name="basin-button",
                        sizing_mode="stretch_width", height=30)
        button.on_click(self._session.ask_basin)
        return button

    # --- touched -------------------------------------------------------------------------------------------------

    def _moved(self, event: RangesUpdate) -> None:
        """The map was panned or zoomed: wait until it rests."""
        ends = (event.x0, event.x1), (event.y0, event.y1)
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

    def _along(self, event: Tap) -> None:
        x, y = self._session.view.at
        self._session.point_at(*((event.x, y) if self._session.view.line == "x" else (x, event.x)))

    def _from(self, event: Tap) -> None:
        if self.basin.axes[0]:
            self._session.start_from(tuple(zip(self.basin.axes, (event.x, event.y), strict=True)))

    # --- shown ---------------------------------------------------------------------------------------------------

    def place(self, view: View) -> None:
        """Axes of the map, and the point."""
        self.mark(view)
        if self._placed != (view.x, view.y):
            self._placed = (view.x, view.y)
            self.map.place(view.x, view.y, (axis_words(view.x.name), axis_words(view.y.name)))

    def mark(self, view: View) -> None:
        """The point."""
        self.map.mark(view.at)
        self.line.here.location = view.at["xy".index(view.line)]

    def show_map(self, found: Map, colour: str) -> None:
        """Draw the map and its legend."""
        self.map.show(found, colour)
        self.legend.text = self.map.legend + (
            f'<span data-stride="{found.stride}" data-share="{found.share:.4f}"></span>')
        self._share = found.share
        self.show_busy(self._panels)

    def show_busy(self, panels: set[str] | frozenset[str]) -> None:
        """Say what is being computed."""
        self._panels = frozenset(panels)
        what = ", ".join(f"map {100 * self._share:.0f} %" if p == "map" else p for p in sorted(panels))
        text = f'<div class="busy"><i></i>computing {what}</div>'
        self.busy.text = text if panels else '<div class="busy idle"><i></i>ready</div>'

    def tell(self, message: str) -> None:
        """Show a message of what cannot be done, or none."""
        self.message.text, self.message.visible = words.error_html(message), bool(message)

    def clear_motion(self) -> None:
        """Show no motion, where there is none that stays bounded."""
        for figure in (self.history, self.phase, self.portrait, self.spectrum):
            figure.clear()

    def show_basin_legend(self) -> None:
        """The legend of what the basin plane shows."""
        self.basin_legend.text = self.basin.legend

    def show_choices(self, choices: list[dict[str, Any]]) -> None:
        """A button for every motion of the point."""
        words_ = "all motions here:" if choices else "looking for other motions here …"
        title = Div(text=f'<span class="words">{words_}</span>', stylesheets=[self._css], margin=(10, 4, 0, 4))
        self.others.children = [title, *(self._choice(c) for c in choices)]

    def _choice(self, choice: dict[str, Any]) -> Button:
        colour = choice["colour"]
        button = Button(
            label=f"{choice['name']}  {100 * choice['share']:.0f} %", name="choice", height=28, margin=2,
            stylesheets=[InlineStyleSheet(css=f".bk-btn {{ border-left: 10px solid {colour} !important; }}")],
        )
        button.on_click(partial(self._session.start_from, choice["start"]))
        return button


def axis_words(name: str) -> str:
    """The label of an axis of the map."""
    from gearchaos.app.controls import words_for

    return f"{words_for(name)} {plain(symbol(name))}".strip()
