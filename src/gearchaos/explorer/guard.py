"""Who may talk to the server, and what it takes from them: every request is looked at before it is answered.

A page of another site must not reach it. Browsers tell from where a request comes (``Origin``), but a name that an
attacker owns can be made to point at this machine; then ``Origin`` and ``Host`` agree, and only the name gives it away.
"""

from __future__ import annotations

import ipaddress
import logging
import os
import re
import socket
from typing import Any
from urllib.parse import unquote

from bokeh.protocol.message import Message
from bokeh.server.session import ServerSession
from bokeh.server.tornado import BokehTornado
from bokeh.server.views.doc_handler import DocHandler
from bokeh.server.views.ico_handler import IcoHandler
from bokeh.server.views.static_handler import StaticHandler
from bokeh.server.views.ws import WSHandler
from tornado.httputil import HTTPServerRequest
from tornado.web import ErrorHandler

from gearchaos.explorer.bounds import LOCAL

MESSAGE = 2**20
"""Most bytes of a message; the largest that a page sends has a few thousand."""

_HOST = re.compile(r"(?P<name>[a-z0-9._-]+|\[[0-9a-f:.]+\])(:[0-9]{1,5})?")
_SESSIONS = ("bokeh-token", "bokeh-session-id")
"""Arguments by which Bokeh lets a request name a session; a page has a new one."""

_PARTS = 3
_ASKED = {"PULL-DOC-REQ": ServerSession.pull, "PATCH-DOC": ServerSession.patch}
"""What a page asks for, and what answers it."""

_NOT_OURS = "not a message of this page"
log = logging.getLogger(__name__)


def own_host(header: str, host: str) -> bool:
    """Whether a ``Host`` header names a server that listens at ``host``, at whatever port a tunnel ends.

    Beyond this machine an address is as good as another one, since only a name can be made to point elsewhere.
    """
    match = _HOST.fullmatch(header.lower())
    if match is None:
        return False
    name = match["name"].strip("[]")
    if host in LOCAL:
        return name in LOCAL
    return name in (host.lower(), "localhost", socket.gethostname().lower()) or _is_address(name)


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def refusal(request: HTTPServerRequest, target: Any, host: str) -> int | None:
    """The status by which a request is refused, None if it is not.

    A connection must say that it comes from the page that this server served: its origin is the host it asks for.
    """
    asked, origin = (request.headers.get(name, "").lower() for name in ("Host", "Origin"))
    if not own_host(asked, host):
        return 403
    if target is Socket and origin not in (f"http://{asked}", f"https://{asked}"):
        return 403
    if target not in (Socket, *_SERVED.values()) or "\0" in unquote(request.path):  # no file can have such a name
        return 404
    return 403 if any(name in request.arguments for name in _SESSIONS) else None


class Socket(WSHandler):
    """A page's connection. What no page says ends it, or is answered without a word about this program."""

    def __init__(self, *args: Any, **options: Any) -> None:
        self._parts: list[str] = []
        super().__init__(*args, **options)

    def check_origin(self, origin: str) -> bool:
        """No origin gets as far as this but the server's own, see `refusal`."""
        return True

    def open(self) -> None:
        """Take a connection whose token this server has given out."""
        try:
            super().open()
        except Exception:
            self._refuse()

    async def on_message(self, fragment: str | bytes) -> None:
        """One part of a message: header, metadata or content. Pages send text alone, none before they are greeted."""
        if isinstance(fragment, bytes) or self.connection is None:
            self._refuse()
            return
        self._parts.append(fragment)
        if len(self._parts) == _PARTS:
            parts, self._parts = self._parts, []
            await self._take(*parts)

    async def _take(self, header: str, metadata: str, content: str) -> None:
        try:
            message = self.connection.protocol.assemble(header, metadata, content)
            asked = _ASKED[message.msgtype]
            known = isinstance(message.header["msgid"], str) and "num_buffers" not in message.header
        except Exception:
            known = False
        if not known:
            self._refuse()
            return
        await self.send_message(await self._answer(asked, message))

    async def _answer(self, asked: Any, message: Message[Any]) -> Message[Any]:
        try:
            return await asked(message, self.connection)
        except Exception:  # there is no such model or value; what fails in our own code is told where it is called
            log.info("a patch cannot be applied", exc_info=True)
        return self.connection.error(message, _NOT_OURS)

    def _refuse(self) -> None:
        log.info("a connection is closed: %s", _NOT_OURS)
        self.close(1002, _NOT_OURS)


_SERVED: dict[Any, Any] = {
    WSHandler: Socket, DocHandler: DocHandler, StaticHandler: StaticHandler, IcoHandler: IcoHandler,
}
"""What Bokeh serves, by what it is served here; all else there is not."""


class Tornado(BokehTornado):
    """Bokeh's application behind these checks; only pages that it gave out itself may connect.

    Parameters
    ----------
    applications : mapping of str to Application
    host : str
        Where the server listens.
    """

    def __init__(self, applications: Any, host: str, **options: Any) -> None:
        self._host = host
        super().__init__(
            applications, websocket_max_message_size_bytes=MESSAGE, sign_sessions=True, secret_key=os.urandom(32),
            **options,
        )

    def get_handler_delegate(
        self, request: HTTPServerRequest, target_class: Any, target_kwargs: Any = None, path_args: Any = None,
        path_kwargs: Any = None,
    ) -> Any:
        """What answers a request: what it asks for, or a refusal."""
        target = _SERVED.get(target_class, target_class)
        status = refusal(request, target, self._host)
        if status is not None:
            target, target_kwargs, path_args, path_kwargs = ErrorHandler, {"status_code": status}, None, None
        return super().get_handler_delegate(request, target, target_kwargs, path_args, path_kwargs)
