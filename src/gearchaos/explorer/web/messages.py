"""Messages between Python and the page's script, in addition to those that Bokeh sends for figures.

They are data sources of Bokeh, which copies a change on one side to the other.

========== ================== ===========================================================================
source     written by         content
========== ================== ===========================================================================
page_state Python             query of the address; texts that the menu copies to the clipboard
updates    Python             new attributes of figures, HTML of elements, values of the form
download   Python             a file to save
run_up     Python             a run-up to play: lines, images, sound, models to change; empty if there is none
requests   the page's script  what a visitor asks for: the name of an action and a value
========== ================== ===========================================================================
"""

from __future__ import annotations

import base64
from collections.abc import Callable
from functools import cache
from importlib.resources import files
from typing import Any

from bokeh.events import DocumentReady
from bokeh.models import ColumnDataSource, CustomJS
from jinja2 import Environment, FunctionLoader

from gearchaos.explorer.core.form_inputs import inputs
from gearchaos.explorer.core.style import motion_hint


def render(name: str, **values: Any) -> str:
    """The template ``name``, a path below the explorer, filled with values."""
    return _environment().get_template(name).render(values)


def asset(path: str) -> str:
    """The source of a template, of the page's style sheet or of a script, by its path below the explorer."""
    return files("gearchaos.explorer").joinpath(path).read_text(encoding="utf-8")


@cache
def _environment() -> Environment:
    made = Environment(loader=FunctionLoader(asset), autoescape=True, trim_blocks=True, lstrip_blocks=True)
    made.filters |= {"motion_hint": motion_hint, "input_label": lambda key: inputs()[key].label}
    return made


ELEMENTS = ("parameters", "axes", "line-choose", "busy", "message", "legend", "verdict", "others", "basin-legend",
            "branch", "skeleton-legend", "run-text", "assessment-text", "tolerances-text",
            "knock-text", "sheet", "relief", "speeds-text", "changes-text")
"""Elements of the page whose HTML changes. As Bokeh widgets, each change would lay out the page again."""


class Messages:
    """The messages of one page.

    Changes at about the same time are sent as one update, since the browser draws after each message. Nothing is sent
    before the page's script reports that it runs. ``act`` is called with what a visitor asks for, the name of an action
    and a value, which may be anything.
    """

    def __init__(self) -> None:
        self.act: Callable[[str, Any], None] = lambda action, value: None
        self._page_state = ColumnDataSource({"address": [""], "python": [""], "toml": [""]})
        self._updates = ColumnDataSource({"models": [{}], "html": [{}], "values": [{}], "number": [0]})
        self._download = ColumnDataSource({"content": [""], "name": [""]})
        self._run_up = ColumnDataSource({"run": [{}], "number": [0]})
        self._requests = ColumnDataSource({"action": [""], "value": [None], "number": [0]})
        self._requests.on_change("data", self._on_request)
        self._sources = {"page_state": self._page_state, "updates": self._updates, "download": self._download,
                         "run_up": self._run_up, "requests": self._requests}
        code = "".join(asset(f"web/static/{name}") for name in ("page.js", "play.js", "turn.js", "train.js"))
        self._script = CustomJS(args=self._sources, code=code)
        self._models: dict[str, dict[str, Any]] = {}
        self._html = dict.fromkeys(ELEMENTS, "")
        self._sent_html: dict[str, str] = {}
        self._values: dict[str, Any] = {}
        self._new_run_up: dict[str, Any] | None = None
        self._document: Any = None
        self._page_ready = self._update_scheduled = False

    def attach(self, document: Any, root: Any) -> None:
        """Run the page's script once the page is loaded; as tags of the model ``root`` the sources are synchronised."""
        self._document = document
        root.tags = list(self._sources.values())
        document.js_on_event(DocumentReady, self._script)

    def set_page_state(self, query: str, python: str, toml: str) -> None:
        """Set the query of the address bar, without an entry in the history, and the texts for the clipboard."""
        self._page_state.data = {"address": [f"?{query}"], "python": [python], "toml": [toml]}

    def set_attributes(self, model: Any, **attributes: Any) -> None:
        """Set attributes of the browser's copy of a Bokeh model; the model in this process stays as it is."""
        self._models.setdefault(model.id, {}).update(attributes)
        self._schedule_update()

    def write(self, element: str, template: str = "", **values: Any) -> None:
        """Set the HTML of one of `ELEMENTS` to a template filled with values; nothing by default."""
        html = render(f"{template}.html.j2", **values) if template else ""
        if self._html[element] != html:
            self._html[element] = html
            self._schedule_update()

    def set_values(self, values: dict[str, Any]) -> None:
        """Set values that the form shows, by the name of the field; the others stay as they are."""
        self._values = self._values | values
        self._schedule_update()

    def save_file(self, content: bytes, media_type: str, name: str) -> None:
        """Have the browser save a file."""
        address = f"data:{media_type};base64,{base64.b64encode(content).decode()}"
        self._download.data = {"content": [address], "name": [name]}
        self._download.data = {"content": [""], "name": [""]}  # so that the document does not keep the content

    def set_run_up(self, run: dict[str, Any]) -> None:
        """Set the run-up that the page plays once its figures are set up; an empty one ends the playing."""
        self._new_run_up = run
        self._schedule_update()

    def _schedule_update(self) -> None:
        if self._page_ready and not self._update_scheduled:
            self._update_scheduled = True
            self._document.add_next_tick_callback(self._send_update)

    def _send_update(self) -> None:
        """Send all that has changed since the last update."""
        html = {name: text for name, text in self._html.items() if self._sent_html.get(name) != text}
        number = self._updates.data["number"][0] + 1  # an update equal to the last one would not be sent
        update = {"models": [self._models], "html": [html], "values": [self._values], "number": [number]}
        self._sent_html.update(html)
        self._models, self._values, self._update_scheduled = {}, {}, False
        self._updates.data = update
        if self._new_run_up is not None:
            self._run_up.data = {"run": [self._new_run_up], "number": [number]}
            self._new_run_up = None

    def _on_request(self, _: str, __: Any, data: dict[str, Any]) -> None:
        """Perform the action that the page's script asks for; malformed requests are ignored."""
        action, value = (data.get(name) for name in ("action", "value"))
        if not (isinstance(action, list) and isinstance(value, list) and action and value):
            return
        if action[0] == "ready":
            self._page_ready = True
            self._schedule_update()
        else:
            self.act(str(action[0]), value[0])
