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
    """Two small sources: ``said`` is written here and read by the page's script, ``heard`` the other way round."""

    def __init__(self, step: Callable[[int, int], None]) -> None:
        self.said = ColumnDataSource({"kind": [""], "text": [""], "name": [""], "number": [0]}, name="said")
        self.heard = ColumnDataSource({"key": [""], "size": [1], "number": [0]}, name="heard")
        self._number, self._step = 0, step
        self.heard.on_change("data", self._on_key)
        script = files("gearchaos.app").joinpath("templates/page.js").read_text(encoding="utf-8")
        self._script = CustomJS(args={"said": self.said, "heard": self.heard}, code=script)

    def attach(self, document: Any) -> None:
        """Let the page's script begin once the page is there."""
        document.js_on_event(DocumentReady, self._script)

    def address(self, query: str) -> None:
        """Put the state in the address bar, without a new entry in the history."""
        self._say("address", f"?{query}")

    def texts(self, python: str, toml: str) -> None:
        """What the two copy buttons copy."""
        self._say("python", python)
        self._say("toml", toml)

    def download(self, content: bytes, media: str, name: str) -> None:
        """Have the browser save a file."""
        self._say("download", f"data:{media};base64,{base64.b64encode(content).decode()}", name)
        self._say("downloaded", "", name)  # so that the document does not keep the file

    def _say(self, kind: str, text: str, name: str = "") -> None:
        self._number += 1
        self.said.data = {"kind": [kind], "text": [text], "name": [name], "number": [self._number]}

    def _on_key(self, _: str, __: Any, data: dict[str, list[Any]]) -> None:
        key, size = str(data["key"][0]), data["size"][0]
        if key in _STEPS and size in (1, 10):
            columns, rows = _STEPS[key]
            self._step(columns * size, rows * size)
