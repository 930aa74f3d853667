"""The server: a page for every visitor, on this machine alone unless told otherwise."""

from __future__ import annotations

import socket
import sys
from collections.abc import Callable
from functools import partial
from importlib.resources import files
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from gearchaos.errors import InputError
from gearchaos.explorer.bounds import LOCAL
from gearchaos.explorer.elsewhere import Elsewhere
from gearchaos.explorer.worker import Job, Worker

if TYPE_CHECKING:
    from gearchaos.explorer.state import View
    from gearchaos.gears.pair import GearPair

PORT = 5006
_SWITCH = 0.001
"""Seconds after which a thread lets another have its turn, so that what a process found is soon shown."""

_CHECK = 3000
"""Milliseconds after which a page that was closed is forgotten."""


def check_installed() -> None:
    """Raise unless the libraries of the page are there."""
    for name in ("bokeh", "tomlkit"):
        if find_spec(name) is None:
            raise InputError("explore", "needs the libraries of the page", name, "pip install gearchaos[app]")


def check_port(host: str, port: int) -> int:
    """A free port, the one asked for unless it is 0; raises if that one is taken or the host is none of ours."""
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
    """Where the page is."""
    return f"http://{f'[{host}]' if ':' in host else host}:{port}/"


def server(view: View, pair: GearPair | None = None, *, host: str = LOCAL[0], port: int = PORT) -> Any:
    """A Bokeh server, not yet started.

    Parameters
    ----------
    view : View
        What a page without a query shows.
    pair : GearPair, optional
        Whose units results may be shown in.
    host, port : str, int
        Where to listen; see `check_port`.
    """
    from bokeh.application import Application

    from gearchaos.explorer.guard import MESSAGE, Tornado
    from gearchaos.explorer.handler import Handler

    sys.setswitchinterval(_SWITCH)
    workers = Worker("points", Elsewhere()), Worker("maps", Elsewhere(polite=True))
    _warm(view, *workers)
    try:
        return _listening(Tornado(
            {"/": Application(Handler(_page(view, pair, workers), workers))}, host,
            check_unused_sessions_milliseconds=1000, unused_session_lifetime_milliseconds=_CHECK,
        ), host, port, MESSAGE)
    except BaseException:
        for worker in workers:
            worker.stop()
        raise


def _listening(application: Any, host: str, port: int, most: int) -> Any:
    """A server of an application; a request's body has at most so many bytes."""
    from bokeh.server.server import BaseServer
    from bokeh.server.util import bind_sockets
    from tornado.httpserver import HTTPServer
    from tornado.ioloop import IOLoop

    sockets, _ = bind_sockets(host, port)
    http = HTTPServer(application, max_body_size=most)
    http.add_sockets(sockets)
    return BaseServer(IOLoop.current(), application, http)


def _warm(view: View, quick: Worker, slow: Worker) -> None:
    """Have the kernels that a page needs at once in memory before the first visitor comes."""
    from gearchaos.explorer.dossier import dossier
    from gearchaos.explorer.maps import first

    for worker, steps in ((quick, partial(dossier, view.point)), (slow, partial(first, view))):
        worker.submit("", "warm", Job(steps, lambda _: None, lambda _: None))


def _page(view: View, pair: GearPair | None, workers: tuple[Worker, Worker]) -> Callable[[Any], None]:
    """A function that fills the document of a new visitor."""
    from gearchaos.explorer.board import FILES
    from gearchaos.explorer.session import Session
    from gearchaos.explorer.state import from_query

    template, css = _template(), _text("page.css")

    def page(document: Any) -> None:
        message = ""
        try:
            first = from_query(document.session_context.request.query, view)
        except InputError as error:
            first, message = view, f"The address cannot be shown: {error}"
        session = Session(first, workers, document, pair)
        session.board.tell(message)
        document.on_session_destroyed(lambda _: session.close())
        session.board.bridge.attach(document, session.board.map.figure)
        document.add_next_tick_callback(session.begin)
        document.title, document.template = "gearchaos explore", template
        document.template_variables.update(css=css, files=FILES)
        with document.models.freeze():  # else all models are looked through again for every root
            for name, model in session.board.roots().items():
                model.name = name
                document.add_root(model)

    return page


def _template() -> Any:
    from bokeh.core.templates import get_env

    return get_env().from_string(_text("page.html.j2"))


def _text(name: str) -> str:
    return files("gearchaos.explorer").joinpath("templates", name).read_text(encoding="utf-8")
