"""The server of the page, and `gearchaos.explore`, which runs it in a thread for a notebook or a script.

Only this machine can reach it, unless another address to listen at is given.
"""

from __future__ import annotations

import socket
import sys
import threading
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from gearchaos.errors import InputError, missing_package
from gearchaos.explorer.core.worker import Job, Worker, WorkerProcess, Workers
from gearchaos.explorer.web import KEY, LOCAL
from gearchaos.gears.operation.operating import AnyModel, as_model
from gearchaos.model import MeshModel
from gearchaos.studies.core.axis import Axis

if TYPE_CHECKING:
    from gearchaos.explorer.core.state import View

PORT = 5006  # the port that the server listens at by default

_SWITCH_INTERVAL = 0.001
"""Seconds after which Python switches threads, so that results of the worker processes are shown soon."""

_UNUSED_LIFETIME = 3000  # milliseconds after which the session of a closed page is removed
_HEIGHT = 900  # height of the page in a notebook, in pixels


def check_installed() -> None:
    """Raise an `InputError` unless the optional dependencies ``gearchaos[app]`` are installed."""
    for name in ("bokeh", "tomlkit"):
        if find_spec(name) is None:
            raise missing_package("explore", name, "app")


def check_port(host: str, port: int) -> int:
    """The port, or any free one for 0; `InputError` if it is taken, or the host is no address of this machine."""
    if not 0 <= port <= 65535:
        raise InputError("--port", "must lie in [0, 65535]", port)
    try:
        with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((host, port))
            return probe.getsockname()[1]
    except OSError as error:
        raise InputError("--port", "must be free, at an address of this machine", f"{host}:{port}",
                         f"{error.strerror}. Choose another one, or 0 for any.") from None


def address(host: str, port: int) -> str:
    """The URL of the page."""
    return f"http://{f'[{host}]' if ':' in host else host}:{port}/"


def server(view: View, *, host: str = LOCAL[0], port: int = PORT) -> Any:
    """A Bokeh server at a host and port, not yet started.

    ``view`` is what a page without a query shows; its gears are those of all pages.
    """
    sys.setswitchinterval(_SWITCH_INTERVAL)
    later = (Worker(name, WorkerProcess(low_priority=True, on_demand=True)) for name in ("branches", "curves"))
    workers = Workers(Worker("points", WorkerProcess()), Worker("maps", WorkerProcess(low_priority=True)), *later)
    from gearchaos.explorer.features.map.job import warm_up  # here and below, while the processes start
    from gearchaos.explorer.features.motion.point import point_motion

    points, maps = partial(point_motion, view.point), partial(warm_up, view)
    for worker, function in ((workers.quick, points), (workers.slow, maps)):
        worker.submit("", "warm-up", Job(function, lambda _: None, lambda _: None, urgent=True))
    try:
        from bokeh.server.server import BaseServer
        from bokeh.server.util import bind_sockets
        from tornado.httpserver import HTTPServer
        from tornado.ioloop import IOLoop

        from gearchaos.explorer.web.application import LARGEST_MESSAGE, GuardedTornado, application

        tornado = GuardedTornado({"/": application(view, workers)}, host, check_unused_sessions_milliseconds=1000,
                                 unused_session_lifetime_milliseconds=_UNUSED_LIFETIME)
        sockets, _ = bind_sockets(host, port)
        http = HTTPServer(tornado, max_body_size=LARGEST_MESSAGE)
        http.add_sockets(sockets)
        return BaseServer(IOLoop.current(), tornado, http)
    except BaseException:
        for worker in workers:
            worker.stop()
        raise


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
        style = f"width:100%;height:{_HEIGHT}px;border:1px solid #ddd"
        return f'<iframe src="{self.url}?key={KEY}" style="{style}"></iframe>'


def explore(
    model: AnyModel | None = None, x: Axis | None = None, y: Axis | None = None, *,
    port: int = 0,
) -> Explorer:
    """The explorer: a map of motions in the browser, and for any point of the map the motion there.

    Parameters
    ----------
    model : MeshModel, GearPair, GearDesign or Train, optional
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

    from gearchaos.explorer.core.state import view_of

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
