"""What a Bokeh application does for every visitor, and when its server ends."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from bokeh.application.handlers import FunctionHandler

from gearchaos.explorer.worker import Worker


class Handler(FunctionHandler):
    """Fills the document of every visitor by ``page``; its workers end with the server."""

    def __init__(self, page: Callable[[Any], None], workers: tuple[Worker, ...]) -> None:
        super().__init__(page)
        self._workers = workers

    def on_server_unloaded(self, server_context: Any) -> None:
        """Stop the workers."""
        for worker in self._workers:
            worker.stop()
