"""Words between Python and the browser beside the figures: what stands on the page, address, clipboard, downloads, and
what a visitor presses."""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping
from importlib.resources import files
from typing import Any

from bokeh.events import DocumentReady
from bokeh.models import ColumnDataSource, CustomJS

WORDS = ("parameters", "axes", "line-choose", "busy", "message", "legend", "verdict", "others", "basin-legend")
"""Elements of the template whose HTML changes; as widgets each change would have Bokeh lay out the page again."""


class Bridge:
    """Small sources: ``said``, ``news`` and ``file`` are read by the page's script, ``heard`` is written by it.

    All that changes at once goes out as one piece of ``news``, and first when the page says that it is there: a message
    of its own for each change has the browser draw several times what is shown once.

    Parameters
    ----------
    actions : mapping of str to callable
        What a visitor may ask for, by name; each takes a value, which may be anything.
    """

    def __init__(self, actions: Mapping[str, Callable[[Any], None]]) -> None:
        self._actions = {**actions, "there": self._begin}
        self.said = ColumnDataSource({"address": [""], "python": [""], "toml": [""]})
        self.news = ColumnDataSource({"models": [{}], "words": [{}], "values": [{}], "number": [0]})
        self.file = ColumnDataSource({"content": [""], "name": [""]})
        self.heard = ColumnDataSource({"what": [""], "value": [None], "number": [0]})
        self.heard.on_change("data", self._on_heard)
        script = files("gearchaos.explorer").joinpath("templates/page.js").read_text(encoding="utf-8")
        self._script = CustomJS(args=self._sources(), code=script)
        self._models: dict[str, dict[str, Any]] = {}
        self._words = dict.fromkeys(WORDS, "")
        self._shown: dict[str, str] = {}
        self._values: dict[str, Any] = {}
        self._document: Any = None
        self._there = self._waiting = False

    def attach(self, document: Any, root: Any) -> None:
        """Let the page's script begin once the page is there.

        The sources belong to a root, else they would not be kept in step.
        """
        self._document = document
        root.tags = list(self._sources().values())
        document.js_on_event(DocumentReady, self._script)

    def _sources(self) -> dict[str, ColumnDataSource]:
        return {"said": self.said, "news": self.news, "file": self.file, "heard": self.heard}

    def say(self, query: str, python: str, toml: str) -> None:
        """The state for the address bar, without a new entry in the history, and what the two buttons copy."""
        self.said.data = {"address": [f"?{query}"], "python": [python], "toml": [toml]}

    def put(self, model: Any, **attributes: Any) -> None:
        """Have the browser's copy of a model take on some attributes; this one here stays as it is."""
        self._models.setdefault(model.id, {}).update(attributes)
        self._tell_soon()

    def write(self, name: str, html: str) -> None:
        """Have one of `WORDS` show this."""
        if self._words[name] != html:
            self._words[name] = html
            self._tell_soon()

    def show(self, values: dict[str, Any]) -> None:
        """Have what a visitor sets show these values by name."""
        self._values = values
        self._tell_soon()

    def _begin(self, _: Any) -> None:
        self._there = True
        self._tell_soon()

    def _tell_soon(self) -> None:
        if self._there and not self._waiting:
            self._waiting = True
            self._document.add_next_tick_callback(self._tell)

    def _tell(self) -> None:
        """Send all that has changed since the last time."""
        words = {name: html for name, html in self._words.items() if self._shown.get(name) != html}
        number = self.news.data["number"][0] + 1  # news that are the same again are news
        news = {"models": [self._models], "words": [words], "values": [self._values], "number": [number]}
        self._shown.update(words)
        self._models, self._values, self._waiting = {}, {}, False
        self.news.data = news

    def download(self, content: bytes, media: str, name: str) -> None:
        """Have the browser save a file."""
        self.file.data = {"content": [f"data:{media};base64,{base64.b64encode(content).decode()}"], "name": [name]}
        self.file.data = {"content": [""], "name": [""]}  # so that the document does not keep it

    def _on_heard(self, _: str, __: Any, data: dict[str, Any]) -> None:
        what, value = (data.get(name) for name in ("what", "value"))
        if isinstance(what, list) and isinstance(value, list) and what and value and str(what[0]) in self._actions:
            self._actions[str(what[0])](value[0])
