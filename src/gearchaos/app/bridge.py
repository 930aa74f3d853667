"""Words between Python and the browser beside the figures: what stands on the page, address, clipboard, downloads, and
what a visitor presses."""

from __future__ import annotations

import base64
from collections.abc import Callable, Mapping
from importlib.resources import files
from typing import Any

from bokeh.events import DocumentReady
from bokeh.models import ColumnDataSource, CustomJS

WORDS = ("busy", "message", "legend", "verdict", "others", "basin-legend")
"""Elements of the template whose HTML changes; as widgets each change would have Bokeh lay out the page again."""


class Bridge:
    """Small sources: ``said``, ``words`` and ``file`` are read by the page's script, ``heard`` is written by it.

    Parameters
    ----------
    actions : mapping of str to callable
        What a visitor may ask for, by name; each takes a value, which may be anything.
    """

    def __init__(self, actions: Mapping[str, Callable[[Any], None]]) -> None:
        self._actions = actions
        self.said = ColumnDataSource({"address": [""], "python": [""], "toml": [""]})
        self.words = ColumnDataSource({name: [""] for name in WORDS})
        self.file = ColumnDataSource({"content": [""], "name": [""]})
        self.heard = ColumnDataSource({"what": [""], "value": [None], "number": [0]})
        self.heard.on_change("data", self._on_heard)
        script = files("gearchaos.app").joinpath("templates/page.js").read_text(encoding="utf-8")
        self._script = CustomJS(args=self._sources(), code=script)

    def attach(self, document: Any, root: Any) -> None:
        """Let the page's script begin once the page is there.

        The sources belong to a root, else they would not be kept in step.
        """
        root.tags = list(self._sources().values())
        document.js_on_event(DocumentReady, self._script)

    def _sources(self) -> dict[str, ColumnDataSource]:
        return {"said": self.said, "words": self.words, "file": self.file, "heard": self.heard}

    def say(self, query: str, python: str, toml: str) -> None:
        """The state for the address bar, without a new entry in the history, and what the two buttons copy."""
        self.said.data = {"address": [f"?{query}"], "python": [python], "toml": [toml]}

    def write(self, name: str, html: str) -> None:
        """Have one of `WORDS` show this."""
        if self.words.data[name][0] != html:
            self.words.patch({name: [(0, html)]})

    def download(self, content: bytes, media: str, name: str) -> None:
        """Have the browser save a file."""
        self.file.data = {"content": [f"data:{media};base64,{base64.b64encode(content).decode()}"], "name": [name]}
        self.file.data = {"content": [""], "name": [""]}  # so that the document does not keep it

    def _on_heard(self, _: str, __: Any, data: dict[str, list[Any]]) -> None:
        action = self._actions.get(str(data["what"][0]))
        if action is not None:
            action(data["value"][0])
