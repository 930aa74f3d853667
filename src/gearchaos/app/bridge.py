"""Words between Python and the browser beside the figures: address, clipboard, downloads, keys, busy state."""

from __future__ import annotations

import base64
from collections.abc import Callable
from importlib.resources import files
from typing import Any

from bokeh.events import DocumentReady
from bokeh.models import ColumnDataSource, CustomJS

_STEPS = {"ArrowLeft": (-1, 0), "ArrowRight": (1, 0), "ArrowUp": (0, 1), "ArrowDown": (0, -1)}


class Bridge:
    """Small sources: ``said`` and ``file`` are read by the page's script, ``heard`` is written by it."""

    def __init__(self, step: Callable[[int, int], None]) -> None:
        self.said = ColumnDataSource({"address": [""], "python": [""], "toml": [""]})
        self.file = ColumnDataSource({"content": [""], "name": [""]})
        self.heard = ColumnDataSource({"key": [""], "size": [1], "number": [0]})
        self._step = step
        self.heard.on_change("data", self._on_key)
        script = files("gearchaos.app").joinpath("templates/page.js").read_text(encoding="utf-8")
        self._script = CustomJS(args=self._sources(), code=script)

    def attach(self, document: Any, root: Any) -> None:
        """Let the page's script begin once the page is there.

        The sources belong to a root, else they would not be kept in step.
        """
        root.tags = list(self._sources().values())
        document.js_on_event(DocumentReady, self._script)

    def _sources(self) -> dict[str, ColumnDataSource]:
        return {"said": self.said, "file": self.file, "heard": self.heard}

    def say(self, query: str, python: str, toml: str) -> None:
        """The state for the address bar, without a new entry in the history, and what the two buttons copy."""
        self.said.data = {"address": [f"?{query}"], "python": [python], "toml": [toml]}

    def download(self, content: bytes, media: str, name: str) -> None:
        """Have the browser save a file."""
        self.file.data = {"content": [f"data:{media};base64,{base64.b64encode(content).decode()}"], "name": [name]}
        self.file.data = {"content": [""], "name": [""]}  # so that the document does not keep it

    def _on_key(self, _: str, __: Any, data: dict[str, list[Any]]) -> None:
        key, size = str(data["key"][0]), data["size"][0]
        if key in _STEPS and size in (1, 10):
            columns, rows = _STEPS[key]
            self._step(columns * size, rows * size)
