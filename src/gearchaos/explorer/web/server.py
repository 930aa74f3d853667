"""The server of the page. Only this machine can reach it, unless another address to listen at is given."""

from __future__ import annotations

import socket
import sys
from functools import partial
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from gearchaos.errors import InputError, missing_package
from gearchaos.explorer.jobs.worker import Job, Worker, Workers
from gearchaos.explorer.jobs.worker_process import WorkerProcess
from gearchaos.explorer.web import LOCAL

if TYPE_CHECKING:
    from gearchaos.explorer.view.state import View

PORT = 5006
"""The port that the server listens at by default."""

_SWITCH_INTERVAL = 0.001
"""Seconds after which Python switches threads, so that results of the worker processes are shown soon."""

_UNUSED_LIFETIME = 3000
"""Milliseconds after which the session of a closed page is removed."""


def check_installed() -> None:
    """Raise an `InputError` unless the optional dependencies ``gearchaos[app]`` are installed."""
    for name in ("bokeh", "tomlkit"):
        if find_spec(name) is None:
            raise missing_package("explore", name, "app")


def check_port(host: str, port: int) -> int:
    """The port if it is free at this host, or any free port for 0.

    Raises
    ------
    InputError
        If the port is taken, or the host is no address of this machine.
    """
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
    """A Bokeh server, not yet started.

    Parameters
    ----------
    view : View
        What a page without a query shows; its gears are those of all pages.
    host, port : str, int
        Where to listen; see `check_port`.
    """
    sys.setswitchinterval(_SWITCH_INTERVAL)
    later = (Worker(name, WorkerProcess(low_priority=True, on_demand=True)) for name in ("branches", "curves"))
    workers = Workers(Worker("points", WorkerProcess()), Worker("maps", WorkerProcess(low_priority=True)), *later)
    from gearchaos.explorer.jobs.map import warm_up  # here, while the processes start
    from gearchaos.explorer.jobs.point import point_motion

    points, maps = partial(point_motion, view.point), partial(warm_up, view)
    for worker, function in ((workers.quick, points), (workers.slow, maps)):
        worker.submit("", "warm-up", Job(function, lambda _: None, lambda _: None))
    try:
        from bokeh.server.server import BaseServer
        from bokeh.server.util import bind_sockets
        from tornado.httpserver import HTTPServer
        from tornado.ioloop import IOLoop

        from gearchaos.explorer.web.application import (  # here, while the processes start
            LARGEST_MESSAGE,
            GuardedTornado,
            application,
        )

        tornado = GuardedTornado(
            {"/": application(view, workers)}, host,
            check_unused_sessions_milliseconds=1000, unused_session_lifetime_milliseconds=_UNUSED_LIFETIME,
        )
        sockets, _ = bind_sockets(host, port)
        http = HTTPServer(tornado, max_body_size=LARGEST_MESSAGE)
        http.add_sockets(sockets)
        return BaseServer(IOLoop.current(), tornado, http)
    except BaseException:
        for worker in workers:
            worker.stop()
        raise
