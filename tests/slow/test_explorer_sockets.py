"""The explorer under attack: raw sockets that say what no page of it would."""

import base64
import gc
import json
import os
import re
import socket
import struct
import sys
import time
from contextlib import suppress
from urllib.request import urlopen

import pytest

import gearchaos

pytest.importorskip("bokeh")
PATHS = ("/", "/start", "/ws", "/static/js/bokeh.min.js", "/autoload.js?bokeh-autoload-element=1", "/metadata",
         "/favicon.ico")


@pytest.fixture(scope="module")
def place(server):
    """The port of a server, which must have printed neither a traceback nor a path when it ends."""
    return int(server.rstrip("/").rpartition(":")[2])


class Raw:
    """One connection, byte by byte."""

    def __init__(self, port):
        self.socket, self.left = socket.create_connection(("127.0.0.1", port), timeout=20), b""

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def ask(self, path="/", method="GET", version="1.1", **headers):
        """Send a request; a header of None is left out. Returns the status, 0 where there is no answer, and the
        headers of the answer."""
        lines = [f"{name.replace('_', '-')}: {value}" for name, value in headers.items() if value is not None]
        self.socket.sendall("\r\n".join([f"{method} {path} HTTP/{version}", *lines, "", ""]).encode())
        answer = b""
        with suppress(ConnectionError):
            while b"\r\n\r\n" not in answer and (more := self.socket.recv(65536)):
                answer += more
        answer, _, self.left = answer.partition(b"\r\n\r\n")
        return int(answer.split()[1]) if answer else 0, answer.decode(errors="replace")

    def connect(self, host, origin, token="nonsense", protocol="bokeh"):
        return self.ask(
            "/ws", Host=host, Origin=origin, Upgrade="websocket", Connection="Upgrade", Sec_WebSocket_Version=13,
            Sec_WebSocket_Key=base64.b64encode(os.urandom(16)).decode(), Sec_WebSocket_Protocol=f"{protocol}, {token}")

    def send(self, *texts, opcode=1, length=None):
        """Frames, masked; ``length`` may lie."""
        for data in texts:
            head = struct.pack(">BBQ", 0x80 | opcode, 0x80 | 127, len(data) if length is None else length)
            self.socket.sendall(head + b"\0\0\0\0" + data)

    def read(self):
        """The next frame that is no ping: opcode and payload; (8, b"") at the end."""
        try:
            while True:
                first, size = self._exactly(2)
                size &= 127
                if size > 125:
                    size = int.from_bytes(self._exactly(2 if size == 126 else 8), "big")
                opcode, data = first & 15, self._exactly(size)
                if opcode != 9:
                    return opcode, data
        except (ConnectionError, EOFError):
            return 8, b""

    def _exactly(self, size):
        while len(self.left) < size:
            more = self.socket.recv(65536)
            if not more:
                raise EOFError
            self.left += more
        data, self.left = self.left[:size], self.left[size:]
        return data


def home(port):
    return f"127.0.0.1:{port}"


def token(port):
    page = urlopen(f"http://{home(port)}/").read().decode()
    return re.search(r'"token":\s*"([^"]+)"', page)[1]


@pytest.fixture(scope="module")
def known(place):
    """A token that was given out; the session that it names is kept."""
    found = token(place)
    with page(place, found):
        yield found


def page(port, known):
    raw = Raw(port)
    assert raw.connect(home(port), f"http://{home(port)}", known)[0] == 101
    texts = [part(raw) for _ in range(3)]
    assert json.loads(texts[0])["msgtype"] == "ACK"
    return raw


def message(kind="PATCH-DOC", content=None, **header):
    head = {"msgid": "1", "msgtype": kind, **header}
    return [json.dumps(part).encode() for part in (head, {}, {} if content is None else content)]


@pytest.mark.skipif(not hasattr(socket, "TCP_CORK"), reason="only Linux holds frames back")
def test_the_frames_of_a_message_arrive_together(place, known):
    with page(place, known) as raw:
        for _ in range(20):
            raw.send(*message(content={"events": []}))
            assert raw.socket.recv(65536).endswith(2 * b"\x81\x02{}")


def test_nothing_of_this_machine_s_folders_is_in_the_page(place):
    page = urlopen(f"http://{home(place)}/").read().decode()
    assert sys.prefix not in page and json.dumps(sys.prefix) not in page


HOSTS = ("evil.example", "127.0.0.1.evil.example:{port}", "127.0.0.1:{port}@evil.example", "", None,
         "localhost.evil.example", "10.0.0.1:{port}", "[::1", "127.0.0.1:{port}, evil.example")


@pytest.mark.parametrize(("path", "host"), [*((path, "evil.example:{port}") for path in PATHS),
                                            *((PATHS[0], host) for host in HOSTS)])
def test_no_name_but_the_server_s_own_is_answered(place, path, host):
    host = host and host.format(port=place)
    with Raw(place) as raw:
        assert raw.ask(path, Host=host, Origin=f"http://{host}")[0] in (400, 403)
    with Raw(place) as raw:
        assert raw.connect(host, f"http://{host}", "x")[0] in (400, 403)


@pytest.mark.parametrize("origin", [
    "http://evil.example", "http://evil.example:{port}", "null", None, "", "http://127.0.0.1", "http://127.0.0.1:1",
    "http://127.0.0.1:{port}.evil.example", "http://localhost:{port}", "http://[::1", "file://"])
def test_only_the_server_s_own_page_may_connect(place, known, origin):
    with Raw(place) as raw:
        assert raw.connect(home(place), origin and origin.format(port=place), known)[0] == 403


@pytest.mark.parametrize("host", ["127.0.0.1:{port}", "localhost:{port}", "LOCALHOST:9999", "[::1]:{port}"])
def test_every_name_of_this_machine_s_own_and_any_end_of_a_tunnel_is_answered(place, known, host):
    host = host.format(port=place)
    with Raw(place) as raw:
        assert raw.ask("/favicon.ico", Host=host)[0] == 200
    with Raw(place) as raw:
        assert raw.connect(host, f"http://{host}", known)[0] == 101


ELSEWHERE, FOREIGN = "http://evil.example", {"Sec_Fetch_Site": "cross-site"}
LINK = {"Sec_Fetch_Dest": "document", "Sec_Fetch_User": "?1"}


@pytest.mark.parametrize(("status", "headers"), [
    (403, FOREIGN), (403, {"Sec_Fetch_Site": "same-site"}), (403, {**FOREIGN, **LINK, "Sec_Fetch_Dest": "iframe"}),
    (403, {**FOREIGN, **LINK, "Sec_Fetch_User": None}), (403, {"Origin": ELSEWHERE}), (403, {"Origin": "null"}),
    (403, {"Referer": f"{ELSEWHERE}/"}), (403, {"Referer": "http://127.0.0.1:1/"}),
    (200, {**FOREIGN, **LINK, "Referer": ELSEWHERE}), (200, {"Sec_Fetch_Site": "none"}),
    (200, {"Sec_Fetch_Site": "same-origin", "Origin": "http://{home}"}), (200, {"Referer": "http://{home}/?zeta=0.1"})])
def test_another_site_has_no_page_made_but_by_a_link(place, status, headers):
    """A browser says where a request comes from, or an old one only which page made it."""
    sent = {name: value and value.format(home=home(place)) for name, value in headers.items()}
    for path in ("/favicon.ico", "/static/js/bokeh.min.js"):
        with Raw(place) as raw:
            assert raw.ask(path, Host=home(place), **sent)[0] == status
    if status == 403:
        with Raw(place) as raw:
            assert raw.ask("/?key=guessed", Host=home(place), **sent)[0] == status


def test_a_session_is_made_for_a_page_that_connects_alone_and_those_left_are_removed_together(kernels, monkeypatch):
    shown, collections = gearchaos.explore(), []
    port = int(shown.url.rstrip("/").rpartition(":")[2])
    tokens = [token(port) for _ in range(5)]
    assert not shown._server.get_sessions("/")
    pages = [page(port, each) for each in tokens]
    assert len(shown._server.get_sessions("/")) == 5
    monkeypatch.setattr(gc, "collect", lambda: collections.append(len(shown._server.get_sessions("/"))))
    for each in pages:
        each.socket.close()
    until = time.monotonic() + 60
    while not collections or collections[-1]:
        assert time.monotonic() < until
        time.sleep(0.05)
    assert len(collections) <= 2, "two if the pages are left in two looks at them"
    shown.stop()


REFUSED = [
    *(("GET", path, {}, [404]) for path in (
        "/static/js/%00", "/static/js/bokeh.min.js%00", "/static/%00/x", "/%00", "/ws%00")),
    *(("GET", path, {"Origin": "http://evil.example"}, [403, 404]) for path in (
        "/autoload.js?bokeh-autoload-element=1", "/metadata", "/static/extensions/x", "/nothing",
        "/static/../../../../../../etc/passwd", "/static/%2e%2e/%2e%2e/server.py")),
    *((method, "/", {"Content_Length": 0}, [400, 405]) for method in (
        "POST", "PUT", "DELETE", "OPTIONS", "TRACE", "NONSENSE")),
    *(("GET", f"/?{query}", {}, [403]) for query in (  # a request names no session
        "bokeh-token=x", "bokeh-session-id=x", "bokeh-token=" + "A" * 3000)),
    ("GET", "/", {"Host": None, "version": "1.0"}, [403]),
    ("GET", "/?" + "x" * 2**17, {}, [0, 400, 414, 431]),
    ("POST", "/", {"Content_Length": 2**30}, [0, 400, 405, 413])]


@pytest.mark.parametrize(("method", "path", "others", "allowed"), REFUSED, ids=[each[1][:40] for each in REFUSED])
def test_what_no_page_asks_for_is_refused(place, method, path, others, allowed):
    with Raw(place) as raw:
        status, answer = raw.ask(path, method, **{"Host": home(place), **others})
        assert status in allowed and "Access-Control" not in answer and "root:" not in answer


def forged(**payload):
    return base64.urlsafe_b64encode(json.dumps(payload).encode()).decode().rstrip("=")


@pytest.mark.parametrize("fake", [
    "", "x", "x.y", "A" * 5000, forged(session_id="x", session_expiry=10**12),
    forged(session_id="x", session_expiry=10**12) + ".AAAA", forged(session_id=[]), forged(x=1) + ".x"])
def test_a_token_that_was_not_given_out_opens_no_session(place, fake):
    with Raw(place) as raw:
        assert raw.connect(home(place), f"http://{home(place)}", fake)[0] in (0, 101, 400)
        assert raw.read()[0] == 8


NONSENSE = {
    "binary": [(b"\0\1\2", 2)], "broken JSON": [(b"{", 1), (b"}", 1), (b"[", 1)], "no text": [(b"\xff\xfe", 1)],
    "a list for a header": [(b"[]", 1), (b"{}", 1), (b"{}", 1)], "no kind": [(b"{}", 1), (b"{}", 1), (b"{}", 1)],
    "an unknown kind": [(m, 1) for m in message("NOTHING")], "a kind for servers": [(m, 1) for m in message("OK")],
    "another document": [(m, 1) for m in message("PUSH-DOC", {"doc": {"roots": []}})],
    "a number for a kind": [(m, 1) for m in message(7)],
    "a list for a name": [(m, 1) for m in message("PULL-DOC-REQ", msgid=[])],
    "buffers that never come": [*((m, 1) for m in message(num_buffers=10**9)), (b'{"id": "1"}', 1), (b"x", 2)],
    "words for a number": [(m, 1) for m in message(num_buffers="many")],
    "depth": [(b"[" * 100_000, 1), (b"{}", 1), (b"{}", 1)],
    "a long number": [(b"1" * 100_000, 1), (b"{}", 1), (b"{}", 1)], "an opcode that is none": [(b"x", 5)]}


@pytest.mark.parametrize("what", NONSENSE)
def test_nonsense_ends_the_connection_and_nothing_else(place, known, what):
    with page(place, known) as raw:
        with suppress(ConnectionError):
            for data, opcode in NONSENSE[what]:
                raw.send(data, opcode=opcode)
        opcode, answer = raw.read()
        assert opcode == 8 and clean(answer)


def clean(answer):
    text = answer.decode(errors="replace")
    return "Traceback" not in text and "site-packages" not in text and sys.prefix not in text and ".py" not in text


def changed(model="p1", attribute="data", value=None):
    return {"kind": "ModelChanged", "model": {"id": model}, "attr": attribute, "new": value}


PATCHES = {
    "no events": {}, "events that are none": {"events": 7}, "an event that is none": {"events": [None]},
    "an unknown event": {"events": [{"kind": "Nothing"}]},
    "an unknown model": {"events": [changed()]}, "a model without a name": {"events": [changed(None)]},
    "an unknown message": {"events": [{"kind": "MessageSent", "msg_type": "x", "msg_data": {}}]},
    "an unknown action": {"events": [{"kind": "MessageSent", "msg_type": "bokeh_event", "msg_data": {
        "type": "event", "name": "nothing", "values": {}}}]},
    "a class": {"events": [{"kind": "RootAdded", "model": {"type": "object", "name": "os.system", "id": "x"}}]}}


@pytest.mark.parametrize("what", PATCHES)
def test_a_patch_of_what_there_is_not_is_answered_without_a_word_of_the_program(place, known, what):
    with page(place, known) as raw:
        raw.send(*message(content=PATCHES[what]))
        answers = [raw.read() for _ in range(3)]
        assert all(clean(text) for _, text in answers)
        assert answers[0][0] == 8 or json.loads(answers[0][1])["msgtype"] in ("ERROR", "OK")


def test_giant_messages_are_refused(place, known):
    with page(place, known) as raw:
        raw.send(b"", length=2**40)  # nothing of it needs to come
        assert raw.read()[0] == 8
    with page(place, known) as raw:
        with suppress(ConnectionError):
            raw.send(b"x" * 2**21)
        assert raw.read()[0] == 8


def test_two_hundred_connections_at_once_and_the_page_still_works(place, known):
    many = [Raw(place) for _ in range(200)]
    try:
        for raw in many:
            assert raw.connect(home(place), f"http://{home(place)}", known)[0] == 101
        for raw in many:
            assert json.loads(raw.read()[1])["msgtype"] == "ACK"
        with page(place, known) as raw:
            raw.send(*message("PULL-DOC-REQ"))
            assert json.loads(raw.read()[1])["msgtype"] == "PULL-DOC-REPLY"
    finally:
        for raw in many:
            raw.socket.close()


def read_until(raw, *kinds):
    """Kind and content of the next message of some kinds; each has three parts, and two more for every array."""
    while True:
        head, _, content = (part(raw) for _ in range(3))
        head = json.loads(head)
        for _ in range(2 * head.get("num_buffers", 0)):
            part(raw)
        if head["msgtype"] in kinds:
            return head["msgtype"], content.decode()


def part(raw):
    opcode, data = raw.read()
    assert opcode != 8, "the connection has ended"
    return data


def request(model, action, value):
    entries = [["action", action], ["value", value], ["number", [1]]]
    return changed(model, value={"type": "map", "entries": entries})


def event(figure, name, **values):
    return {"kind": "MessageSent", "msg_type": "bokeh_event", "msg_data": {
        "type": "event", "name": name, "values": {"type": "map", "entries": [
            ["model", {"id": figure}], *([k, v] for k, v in values.items())]}}}


def walk(document):
    """Every model of a document as JSON."""
    if isinstance(document, dict):
        if document.get("type") == "object" and "id" in document:
            yield {"attributes": {}, **document}
        document = list(document.values())
    for part in document if isinstance(document, list) else ():
        yield from walk(part)


ABSURD = (None, {}, "x", 10**400, [[[]]], ["omega", {}], ["omega", 10**400], ["kind", 7], ["preset", []], [1e300, 0])


def test_a_page_may_say_anything_and_still_works(place):
    with page(place, token(place)) as raw:
        raw.send(*message("PULL-DOC-REQ"))
        _, document = read_until(raw, "PULL-DOC-REPLY")
        models = list(walk(json.loads(document)))
        model = next(m["id"] for m in models if '["action"' in json.dumps(m["attributes"].get("data")))
        figure = next(m["id"] for m in models if m["name"] == "Figure")
        names = ("step", "choose", "save", "set", "press")
        said = [request(model, [name], [value]) for name in names for value in ABSURD]
        said += [request(model, *w) for w in ((7, 7), ([], []), ([[]], [{}]), (None, None), ({"a": 1}, ["x"]))]
        said += [event(figure, "tap", sx=0, sy=0, x=x, y=0, modifiers=None) for x in (None, "x", [], 1e300, "nan")]
        said += [event(figure, "rangesupdate", x0=x, x1=0, y0=0, y1=x) for x in (None, "x", [], 1e300, "nan")]
        for one in said:
            raw.send(*message(content={"events": [one]}))
            kind, answer = read_until(raw, "OK", "ERROR")
            assert kind in ("OK", "ERROR") and clean(answer.encode())
