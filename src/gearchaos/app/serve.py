"""The server: a page for every visitor, on this machine alone unless told otherwise."""

from __future__ import annotations

import logging
import socket
import sys
from collections.abc import Callable
from importlib.resources import files
from importlib.util import find_spec
from typing import Any

from gearchaos.errors import InputError

LOCAL = ("127.0.0.1", "localhost", "::1")
PORT = 5006
_SWITCH = 0.001
"""Seconds after which a thread lets another have its turn, so that pages answer while maps are computed."""


def check_installed() -> None:
    """Raise unless the libraries of the page are there."""
    for name in ("panel", "bokeh", "tomlkit"):
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


def origins(host: str, port: int) -> list[str]:
    """Where a page may come from that opens a connection."""
    names = {"127.0.0.1", "localhost"} if host in LOCAL else {host}
    return sorted(f"{f'[{n}]' if ':' in n else n}:{port}" for n in names)


def address(host: str, port: int) -> str:
    """Where the page is."""
    return f"http://{f'[{host}]' if ':' in host else host}:{port}/"


def server(view: Any, pair: Any = None, *, host: str = LOCAL[0], port: int = PORT) -> Any:
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
    import matplotlib
    import panel as pn

    matplotlib.use("Agg")
    sys.setswitchinterval(_SWITCH)
    logging.getLogger("bokeh").setLevel(logging.ERROR)
    page = _page(view, pair)
    return pn.io.server.get_server(
        page, port=port, address=host, websocket_origin=origins(host, port), title="gearchaos explore", start=False,
        show=False, check_unused_sessions_milliseconds=5000, unused_session_lifetime_milliseconds=10000,
    )


def _page(view: Any, pair: Any) -> Callable[[], Any]:
    """A function that makes the page of a new visitor."""
    import panel as pn

    from gearchaos.app.session import Session
    from gearchaos.app.state import from_query
    from gearchaos.app.worker import Worker

    quick = Worker("points")
    workers = quick, Worker("maps", after=quick)

    def page() -> Any:
        document, message = pn.state.curdoc, ""
        try:
            first = from_query(_query(document), view)
        except InputError as error:
            first, message = view, f"The address cannot be shown: {error}"
        session = Session(first, workers, document, pair)
        session.board.tell(message)
        document.on_session_destroyed(lambda _: session.close())
        session.board.bridge.attach(document)
        return _laid_out(session.board.roots())

    return page


def _query(document: Any) -> str:
    request = document.session_context.request
    return request.query if hasattr(request, "query") else ""


def _laid_out(roots: dict[str, Any]) -> Any:
    """The roots in the page's template."""
    import panel as pn

    folder = files("gearchaos.app").joinpath("templates")
    template = pn.Template(folder.joinpath("page.html.j2").read_text(encoding="utf-8"))
    template.add_variable("css", folder.joinpath("page.css").read_text(encoding="utf-8"))
    for name, model in roots.items():
        template.add_panel(name, pn.pane.Bokeh(model, sizing_mode=model.sizing_mode or "fixed"))
    return template
