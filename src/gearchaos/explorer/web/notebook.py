"""`gearchaos.explore`: the page in a notebook, or for a script, served by a thread of this process."""

from __future__ import annotations

import threading
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

from gearchaos.explorer.web import LOCAL
from gearchaos.explorer.web.server import address, check_installed, check_port, server
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.operating import as_model
from gearchaos.gears.pair import GearPair
from gearchaos.model import MeshModel
from gearchaos.studies.axis import Axis

_HEIGHT = 900
"""Height of the page in a notebook, in pixels."""


@dataclass(frozen=True)
class Explorer:
    """A page that is being served; a notebook shows it as the result of a cell.

    Attributes
    ----------
    url : str
        Address of the page, for a browser on this machine.
    """

    url: str
    _server: Any

    def stop(self) -> None:
        """Stop the server."""
        self._server.io_loop.add_callback(self._server.stop)

    def _repr_html_(self) -> str:
        return f'<iframe src="{self.url}" style="width:100%;height:{_HEIGHT}px;border:1px solid #ddd"></iframe>'


def explore(
    model: MeshModel | GearPair | GearDesign | None = None, x: Axis | None = None, y: Axis | None = None, *,
    port: int = 0,
) -> Explorer:
    """The explorer: a map of motions in the browser, and for any point of the map the motion there.

    Parameters
    ----------
    model : MeshModel, GearPair or GearDesign, optional
        The model to begin with; the paper's defaults if left out. Results for gears are in their units.
    x, y : Axis, optional
        Axes of the map, whose counts are ignored; mesh frequency and error amplitude if left out, for gears speed and
        torque.
    port : int
        Port to listen at; any free one by default. Other machines cannot reach it.

    Returns
    -------
    Explorer
        Jupyter shows the page; elsewhere open its ``url`` in a browser.

    Raises
    ------
    InputError
        For values outside the bounds of the explorer, or if ``gearchaos[app]`` is not installed.

    Examples
    --------
    >>> import gearchaos as gc
    >>> page = gc.explore(gc.MeshModel.of(q0=0.1))
    >>> page.url.startswith("http://127.0.0.1:")
    True
    >>> page.stop()
    """
    check_installed()
    import asyncio

    from gearchaos.explorer.view.state import view_of

    view = view_of(as_model(MeshModel() if model is None else model), x, y)
    port = check_port(LOCAL[0], port)
    ready: Future[Any] = Future()

    def serve() -> None:
        loop = asyncio.new_event_loop()
        asyncio.set_event_loop(loop)
        try:
            running = server(view, port=port)
            running.start()
        except Exception as error:  # raised again in the caller, who waits
            loop.close()
            ready.set_exception(error)
            return
        ready.set_result(running)
        running.io_loop.start()

    threading.Thread(target=serve, name="explorer", daemon=True).start()
    return Explorer(address(LOCAL[0], port), ready.result())
