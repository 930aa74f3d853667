"""The Bokeh application: the page of every visitor, and the checks on every request and message before the answer.

Pages of other sites must not reach the server. A browser says in ``Origin`` which site a request comes from. That is
not enough: an attacker can let his own domain name resolve to this machine (DNS rebinding), so that ``Origin`` and
``Host`` agree. Therefore the name in ``Host`` is checked as well.
"""

from __future__ import annotations

import ipaddress
import logging
import os
import re
import socket
from collections.abc import Callable
from typing import Any
from urllib.parse import unquote

from bokeh.application import Application
from bokeh.application.handlers import FunctionHandler
from bokeh.core.templates import get_env
from bokeh.server.session import ServerSession
from bokeh.server.tornado import BokehTornado
from bokeh.server.views.doc_handler import DocHandler
from bokeh.server.views.ico_handler import IcoHandler
from bokeh.server.views.static_handler import StaticHandler
from bokeh.server.views.ws import WSHandler
from tornado.httputil import HTTPServerRequest
from tornado.web import ErrorHandler

from gearchaos.errors import InputError
from gearchaos.explorer.jobs.export import FILES, OF_GEARS
from gearchaos.explorer.jobs.worker import Workers
from gearchaos.explorer.view.bounds import SKELETON_PERIOD, SKELETON_PERIODS
from gearchaos.explorer.view.run import WAYS
from gearchaos.explorer.view.state import CHANGES, View
from gearchaos.explorer.view.text import from_query
from gearchaos.explorer.web import LOCAL
from gearchaos.explorer.web.messages import asset
from gearchaos.explorer.web.session import Session
from gearchaos.gears.operating import OperatingModel

LARGEST_MESSAGE = 2**20  # largest number of bytes in a message; a page sends a few thousand at most

_SESSIONS = ("bokeh-token", "bokeh-session-id")
"""Arguments by which a request could choose a session of Bokeh. They are refused: every page gets a new session."""

_FRAMES = 3  # number of frames in a message: header, metadata, content

_ANSWERS = {"PULL-DOC-REQ": ServerSession.pull, "PATCH-DOC": ServerSession.patch}
"""The types of message that a page sends, and the function that answers each."""

_INVALID = "not a message of this page"  # reason given when a connection is closed

log = logging.getLogger(__name__)


def refusal(request: HTTPServerRequest, target: Any, host: str) -> int | None:
    """The HTTP status with which a request is refused, or None if it is accepted.

    The origin of a WebSocket connection must be the host that it asks for: a page that this server served.
    """
    requested, origin = (request.headers.get(name, "").lower() for name in ("Host", "Origin"))
    if not own_host(requested, host):
        return 403
    if target is Socket and origin not in (f"http://{requested}", f"https://{requested}"):
        return 403
    if target not in (Socket, *_SERVED.values()) or "\0" in unquote(request.path):  # no file name has a null character
        return 404
    return 403 if any(name in request.arguments for name in _SESSIONS) else None


class Socket(WSHandler):
    """The WebSocket connection of a page.

    A message that no page would send closes the connection, or is answered without details of this program.
    """

    def __init__(self, *args: Any, **options: Any) -> None:
        self._frames: list[str] = []
        super().__init__(*args, **options)

    def check_origin(self, origin: str) -> bool:
        """Accept the connection; its origin was checked by `refusal`."""
        return True

    def open(self) -> None:
        """Accept a connection whose token was issued by this server."""
        try:
            super().open()
        except Exception:
            self._refuse()
        else:
            self.set_nodelay(True)

    async def on_message(self, fragment: str | bytes) -> None:
        """Collect the frames of a message and answer it. Pages send text only, and only once they are connected."""
        if isinstance(fragment, bytes) or self.connection is None:
            self._refuse()
            return
        self._frames.append(fragment)
        if len(self._frames) < _FRAMES:
            return
        frames, self._frames = self._frames, []
        try:
            message = self.connection.protocol.assemble(*frames)
            answer: Any = _ANSWERS[message.msgtype]
            known = isinstance(message.header["msgid"], str) and "num_buffers" not in message.header
        except Exception:
            known = False
        if not known:
            self._refuse()
            return
        reply = None
        try:
            reply = await answer(message, self.connection)
        except Exception:  # an unknown model or value; errors in event handlers are caught by `Session`
            log.info("a patch cannot be applied", exc_info=True)
        # outside of the handler, in which Bokeh would send the traceback
        await self.send_message(reply or self.connection.error(message, _INVALID))

    async def send_message(self, message: Any) -> None:
        """Send the frames of a message together: each by itself wakes the browser, which interrupts this process."""
        self._hold_back(True)
        try:
            await super().send_message(message)
        finally:
            self._hold_back(False)

    def _hold_back(self, on: bool) -> None:
        """Whether the system waits for more before it sends; only Linux does."""
        stream = self.ws_connection and self.ws_connection.stream
        if stream and not stream.closed() and hasattr(socket, "TCP_CORK"):
            stream.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_CORK, int(on))

    def _refuse(self) -> None:
        log.info("a connection is closed: %s", _INVALID)
        self.close(1002, _INVALID)


_SERVED: dict[Any, Any] = {
    WSHandler: Socket, DocHandler: DocHandler, StaticHandler: StaticHandler, IcoHandler: IcoHandler,
}
"""Handlers of Bokeh that are served, each with its replacement; all others answer 404."""


class GuardedTornado(BokehTornado):
    """Bokeh's Tornado application with these checks for a server at ``host``; session tokens are signed."""

    def __init__(self, applications: Any, host: str, **options: Any) -> None:
        self._host = host
        super().__init__(applications, websocket_max_message_size_bytes=LARGEST_MESSAGE, sign_sessions=True,
                         secret_key=os.urandom(32), **options)

    def get_handler_delegate(
        self, request: HTTPServerRequest, target_class: Any, target_kwargs: Any = None, path_args: Any = None,
        path_kwargs: Any = None,
    ) -> Any:
        """The handler of a request, or one that refuses it; called by Bokeh."""
        target = _SERVED.get(target_class, target_class)
        status = refusal(request, target, self._host)
        if status is not None:
            target, target_kwargs, path_args, path_kwargs = ErrorHandler, {"status_code": status}, None, None
        return super().get_handler_delegate(request, target, target_kwargs, path_args, path_kwargs)


_HOST = re.compile(r"(?P<name>[a-z0-9._-]+|\[[0-9a-f:.]+\])(:[0-9]{1,5})?")


def own_host(header: str, host: str) -> bool:
    """Whether a ``Host`` header names a server that listens at ``host``; the port is ignored, since tunnels change it.

    If the server listens at an address that other machines can reach, every IP address is accepted: DNS rebinding needs
    a name.
    """
    match = _HOST.fullmatch(header.lower())
    if match is None:
        return False
    name = match["name"].strip("[]")
    if host in LOCAL:
        return name in LOCAL
    if name in (host.lower(), "localhost", socket.gethostname().lower()):
        return True
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def application(view: View, workers: Workers) -> Application:
    """The application with the explorer's page.

    ``view`` is what a page without a query shows; its gears are those of all pages. The workers are stopped when the
    server ends.
    """
    template, css = get_env().from_string(asset("templates", "page.html.j2")), asset("static", "page.css")

    def fill(document: Any) -> None:
        message = ""
        try:
            first = from_query(document.session_context.request.query, view)
        except InputError as error:
            first, message = view, f"The address cannot be shown: {error}"
        session = Session(first, workers, document, view)
        session.page.show_message(message)
        document.on_session_destroyed(lambda _: session.close())
        session.page.messages.attach(document, session.page.map.figure)
        document.add_next_tick_callback(session.start)
        document.title, document.template = "gearchaos explore", template
        document.template_variables.update(
            css=css, files={n: words for n, words in FILES.items() if view.gears or not n.startswith(OF_GEARS)},
            gears=view.gears is not None, pair=isinstance(view.model, OperatingModel), periods=SKELETON_PERIODS,
            period=SKELETON_PERIOD, ways=WAYS,
            changes={name: words for name, (words, _) in CHANGES.items()})
        with document.models.freeze():  # otherwise Bokeh walks through all models again for every root
            for name, model in session.page.roots().items():
                model.name = name
                document.add_root(model)

    return Application(_Handler(fill, workers))


class _Handler(FunctionHandler):
    """Fills the document of every visitor, and stops the workers when the server ends."""

    def __init__(self, fill: Callable[[Any], None], workers: Workers) -> None:
        super().__init__(fill)
        self._workers = workers

    def on_server_unloaded(self, server_context: Any) -> None:
        """Stop the workers; called by Bokeh."""
        for worker in self._workers:
            worker.stop()
