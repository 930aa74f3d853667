"""`gearchaos.explore`: the page in a notebook, or beside a script, served by this process."""

from __future__ import annotations

import threading
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

from gearchaos.explorer.bounds import LOCAL
from gearchaos.explorer.serve import address, check_installed, check_port, server
from gearchaos.gears.pair import GearPair
from gearchaos.model import MeshModel
from gearchaos.studies.axis import Axis

_HEIGHT = 900


@dataclass(frozen=True)
class Explorer:
    """A page being served; a notebook shows it where it is the result of a cell.

    Attributes
    ----------
    url : str
        Where the page is, for a browser on this machine.
    """

    url: str
    _server: Any

    def stop(self) -> None:
        """Serve the page no longer."""
        self._server.io_loop.add_callback(self._server.stop)

    def _repr_html_(self) -> str:
        return f'<iframe src="{self.url}" style="width:100%;height:{_HEIGHT}px;border:1px solid #ddd"></iframe>'


def explore(
    model: MeshModel | GearPair | None = None, x: Axis | None = None, y: Axis | None = None, *, port: int = 0,
) -> Explorer:
    """The explorer: a map of motions, and wherever one points, the motion behind it.

    Parameters
    ----------
    model : MeshModel or GearPair, optional
        Where to begin; the paper's defaults if left out. Of a pair results can be shown in its units.
    x, y : Axis, optional
        Of the map, whatever their counts; mesh frequency and error amplitude if left out.
    port : int
        Where to listen, on this machine alone; any free port by default.

    Returns
    -------
    Explorer
        Jupyter shows it as the page itself; elsewhere open its ``url``.

    Raises
    ------
    InputError
        For values that the explorer does not take, or if ``gearchaos[app]`` is not installed.
    """
    check_installed()
    from gearchaos.explorer.state import first_view

    pair = model if isinstance(model, GearPair) else None
    view = first_view(pair.to_model() if pair else model or MeshModel(), x, y)  # type: ignore[union-attr, arg-type]
    port = check_port(LOCAL[0], port)
    running = _started(view, pair, port)
    return Explorer(address(LOCAL[0], port), running)


def _started(view: Any, pair: GearPair | None, port: int) -> Any:
    """A server in a thread of its own."""
    import asyncio

    ready: Future[Any] = Future()

    def serve() -> None:
        loop = asyncio.new_event_loop()
        asyncio.set_event_loop(loop)
        try:
            running = server(view, pair, port=port)
            running.start()
        except Exception as error:  # whatever it is, it belongs to the caller, who waits
            loop.close()
            ready.set_exception(error)
            return
        ready.set_result(running)
        running.io_loop.start()

    threading.Thread(target=serve, name="explorer", daemon=True).start()
    return ready.result()
