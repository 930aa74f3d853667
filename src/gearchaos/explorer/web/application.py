"""The Bokeh application: the page of every visitor, and the checks on every request and message before the answer.

Pages of other sites must not reach the server. A browser says in ``Origin`` which site a request comes from. That is
not enough: an attacker can let his own domain name resolve to this machine (DNS rebinding), so that ``Origin`` and
``Host`` agree. Therefore the name in ``Host`` is checked as well.

Of the requests of another site only the links that a visitor follows are answered, and the page in a notebook, whose
address has the `KEY` of this server. A page is sent without a session, which takes a tenth of a second to make: that
waits for the connection of the page.
"""

from __future__ import annotations

import gc
import ipaddress
import logging
import os
import re
import socket
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any
from urllib.parse import unquote, urlsplit

from bokeh.application import Application
from bokeh.application.handlers import FunctionHandler
from bokeh.core.templates import get_env
from bokeh.document import document as documents
from bokeh.server.session import ServerSession
from bokeh.server.tornado import BokehTornado
from bokeh.server.views.doc_handler import DocHandler
from bokeh.server.views.ico_handler import IcoHandler
from bokeh.server.views.static_handler import StaticHandler
from bokeh.server.views.ws import WSHandler
from tornado.httputil import HTTPServerRequest
from tornado.web import ErrorHandler

from gearchaos.errors import InputError
from gearchaos.explorer.core.bounds import SKELETON_PERIOD, SKELETON_PERIODS
from gearchaos.explorer.core.opened import Opened, opened
from gearchaos.explorer.core.run import WAYS
from gearchaos.explorer.core.state import CHANGES, View
from gearchaos.explorer.core.text import from_query
from gearchaos.explorer.core.worker import Workers
from gearchaos.explorer.features.drawing.form import form
from gearchaos.explorer.features.train.scheme import scheme
from gearchaos.explorer.web import KEY, LOCAL, START
from gearchaos.explorer.web.export import FILES, OF_GEARS
from gearchaos.explorer.web.messages import asset, render
from gearchaos.explorer.web.page import Page
from gearchaos.explorer.web.session import Session
from gearchaos.explorer.web.start import Start
from gearchaos.gears.operation.operating import is_design

LARGEST_MESSAGE = 2**20  # largest number of bytes in a message; a page sends a few thousand at most

_SESSIONS = ("bokeh-token", "bokeh-session-id")
"""Arguments by which a request could choose a session of Bokeh. They are refused: every page gets a new session."""

_FRAMES = 3  # number of frames in a message: header, metadata, content

_ANSWERS = {"PULL-DOC-REQ": ServerSession.pull, "PATCH-DOC": ServerSession.patch}
"""The types of message that a page sends, and the function that answers each."""

_INVALID = "not a message of this page"  # reason given when a connection is closed

_TITLE, _NOT_SHOWN = "gearchaos explore", "The address cannot be shown: "

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
    if is_foreign(request, requested) and request.arguments.get("key") != [KEY.encode()]:
        return 403
    if target not in (Socket, *_SERVED.values()) or "\0" in unquote(request.path):  # no file name has a null character
        return 404
    return 403 if any(name in request.arguments for name in _SESSIONS) else None


def is_foreign(request: HTTPServerRequest, host: str) -> bool:
    """Whether another site than the ``host`` asks, and not by a link that a visitor has followed.

    Browsers say so in ``Sec-Fetch-Site``. Where they do not, since they are old or the connection is not to the same
    machine, ``Origin`` or ``Referer`` may tell.
    """
    site, user, destination, origin, referer = (request.headers.get(name) for name in (
        "Sec-Fetch-Site", "Sec-Fetch-User", "Sec-Fetch-Dest", "Origin", "Referer"))
    if site is not None:
        return site not in ("same-origin", "none") and (user, destination) != ("?1", "document")
    origin = origin or referer
    return origin is not None and urlsplit(origin).netloc.lower() != host


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


class Blank(DocHandler):
    """The page, which names its session in a token and its figures by `named_roots`."""

    application_context: Any

    def __init__(self, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self.application_context = BlankSessions(self.application_context.application)


@dataclass(frozen=True)
class BlankSessions:
    """What `Blank` takes for the sessions of the application: each has the token that it is to have, and the blank
    document."""

    application: Application

    async def create_session_if_needed(self, _: str, request: HTTPServerRequest, token: str) -> Any:
        """A session that has no more than the page needs; called by Bokeh."""
        return SimpleNamespace(token=token, document=self.application.handlers[0].blank(request.query))


_SERVED: dict[Any, Any] = {
    WSHandler: Socket, DocHandler: Blank, StaticHandler: StaticHandler, IcoHandler: IcoHandler, Start: Start,
}
"""Handlers of Bokeh that are served, each with its replacement; all others answer 404."""


class GuardedTornado(BokehTornado):
    """Bokeh's Tornado application with these checks for a server at ``host``; session tokens are signed."""

    def __init__(self, applications: Any, host: str, **options: Any) -> None:
        self._host = host
        super().__init__(applications, extra_patterns=[(f"/{START}", Start)], sign_sessions=True,
                         websocket_max_message_size_bytes=LARGEST_MESSAGE, secret_key=os.urandom(32), **options)

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


    async def _cleanup_sessions(self) -> None:
        """Discard the sessions of closed pages with one collection of garbage; Bokeh, which calls it, makes one for
        each."""
        before = len(self.get_sessions("/"))
        documents.gc = SimpleNamespace(collect=lambda: None)
        try:
            await super()._cleanup_sessions()
        finally:
            documents.gc = gc
        if len(self.get_sessions("/")) < before:
            gc.collect()


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

    ``view`` is what a page without a query shows; its gears are those of all pages whose address names no others. The
    workers are stopped when the server ends.
    """
    own, template = Opened(view), get_env().from_string(asset("web/templates/page.html.j2"))
    sessions: dict[str, Session] = {}

    figures: dict[tuple[bool, ...], list[Any]] = {}  # by what else a page has, once it was asked for

    def blank(query: str) -> Any:
        first, _, _ = _shown(query, own)
        kind = gears, pair, _ = *first.has_gears, first.drawing is not None
        if kind not in figures:
            figures[kind] = named_roots(Page(first, first.start))
        return SimpleNamespace(
            title=_TITLE, template=template, roots=figures[kind], template_variables=dict(
                css=asset("web/static/page.css"), gears=gears, pair=pair,
                design=is_design(first.start.gears), form=first.drawing and render(
                    "features/drawing/form.html.j2", form=form(first.drawing)),
                scheme=render("features/train/scheme.html.j2", scheme=scheme(first.start.gears)) if gears and not pair
                else "",
                files={n: words for n, words in FILES.items() if gears or not n.startswith(OF_GEARS)},
                periods=SKELETON_PERIODS, period=SKELETON_PERIOD, ways=WAYS,
                changes={name: words for name, (words, _) in CHANGES.items()}))

    def fill(document: Any) -> None:
        first, rest, message = _shown(document.session_context.token_payload["query"], own)
        view = first.start
        try:
            view = from_query(rest, view)
        except InputError as error:
            message = f"{_NOT_SHOWN}{error}"
        session = Session(view, workers, document, first)
        session.page.show_message(message)
        roots = named_roots(session.page)
        sessions[document.session_context.id] = session  # Bokeh's callback on documents would collect garbage as well
        session.page.messages.attach(document, session.page.map.figure)
        document.add_next_tick_callback(session.start)
        document.title = _TITLE
        with document.models.freeze():  # otherwise Bokeh walks through all models again for every root
            for model in roots:
                document.add_root(model)

    return Application(_Handler(fill, workers, blank, sessions))


def _shown(query: str, own: Opened) -> tuple[Opened, str, str]:
    """What an address opens, the rest of its query, and a message where it cannot be opened."""
    try:
        return *opened(query, own), ""
    except InputError as error:
        return own, "", f"{_NOT_SHOWN}{error}"


def named_roots(page: Page) -> list[Any]:
    """The figures of a page with their names in the template, and the same identifiers in every session."""
    roots = page.roots()
    for name, model in roots.items():
        model.name, model._id = name, f"figure-{name}"
    return list(roots.values())


class _Handler(FunctionHandler):
    """Fills the document of every visitor, and stops the workers when the server ends."""

    def __init__(
        self, fill: Callable[[Any], None], workers: Workers, blank: Callable[[str], Any],
        sessions: dict[str, Session],
    ) -> None:
        super().__init__(fill)
        self._workers, self.blank, self._sessions = workers, blank, sessions

    def process_request(self, request: HTTPServerRequest) -> dict[str, Any]:
        """What the token of a page says of its address; called by Bokeh."""
        return {"query": request.query.removeprefix(f"key={KEY}")}

    async def on_session_destroyed(self, session_context: Any) -> None:
        """Cancel what is computed for a page that was left; called by Bokeh."""
        if session := self._sessions.pop(session_context.id, None):
            session.close()

    def on_server_unloaded(self, server_context: Any) -> None:
        """Stop the workers; called by Bokeh."""
        for worker in self._workers:
            worker.stop()
