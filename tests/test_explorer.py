"""The explorer as a visitor meets it: the real server, and Debian's chromium by Playwright."""

import json
import re
import shutil
import signal
import subprocess
import sys
import tomllib
from contextlib import contextmanager

import pytest
from PIL import Image

import gearchaos as gc
from gearchaos.app.bounds import span
from gearchaos.app.presets import presets
from gearchaos.app.state import COLOURS, from_query
from gearchaos.studies.warmup import warmup

sync_api = pytest.importorskip("playwright.sync_api")
CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
pytestmark = [
    pytest.mark.skipif(CHROMIUM is None, reason="make test installs chromium"),
    pytest.mark.xdist_group("browser"),
]
_MAIN = """
import signal
from gearchaos.cli import main
signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job inherits that it is ignored
main()
"""
COMMAND = (sys.executable, "-c", _MAIN, "explore", "--no-open", "--port", "0")
SIZES = {"laptop": (1366, 768), "desk": (1920, 1080), "phone": (390, 844)}
MAP = "x=omega:0.2:3.0&y=eps1:0.0:0.3"
START = presets()["2"].view
WAIT = 20_000
PLACE = "document.querySelector('main').offsetTop"


@pytest.fixture(scope="module", autouse=True)
def kernels():
    """Those of the models that the pages show, else some page would wait for them."""
    list(warmup((2, 4, 6)))


@contextmanager
def served(*arguments):
    """The address of a server, and what it says on stderr."""
    with subprocess.Popen((*COMMAND, *arguments), stderr=subprocess.PIPE, text=True) as process:
        said = []
        for line in process.stderr:
            said.append(line)
            if found := re.search(r"http://\S+", line):
                break
        assert said and found, said
        try:
            yield found[0], said
        finally:
            process.send_signal(signal.SIGINT)
            try:
                _, rest = process.communicate(timeout=60)
            finally:
                process.kill()
            assert "Traceback" not in rest


@pytest.fixture(scope="module")
def server():
    with served() as (url, _):
        yield url


@pytest.fixture(scope="module")
def chromium():
    with sync_api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield browser
        browser.close()


class Visit:
    """A page, what went wrong on it, and what it asked for elsewhere."""

    def __init__(self, chromium, url, size="laptop"):
        width, height = SIZES[size]
        self.context = chromium.new_context(viewport={"width": width, "height": height}, accept_downloads=True)
        self.context.grant_permissions(["clipboard-read", "clipboard-write"])
        self.page, self.errors, self.strangers = self.context.new_page(), [], []
        self.page.set_default_timeout(WAIT)
        self.page.on("pageerror", lambda e: self.errors.append(str(e)))
        self.page.on("console", lambda m: self.errors.append(m.text) if m.type == "error" else None)
        home = re.match(r"http://[^/]+", url)[0]
        self.page.on("request", lambda r: self.strangers.append(r.url) if not _own(r.url, home) else None)
        self.page.goto(url)
        self.settled()

    def settled(self):
        """The final verdict of the point."""
        return self.page.wait_for_selector(".verdict[data-final='1'][data-stage='complete']")

    @property
    def view(self):
        """What the address bar says."""
        return from_query(self.page.evaluate("location.search"), START)

    def after(self, act):
        """Act, and return the view that the address bar then shows."""
        before = self.page.evaluate("location.search")
        act()
        self.page.wait_for_function("before => location.search !== before", arg=before)
        return self.view

    def label(self):
        """The verdict on show, once it is that of the point in the address bar."""
        model = self.view
        words = ", ".join(f"= {v:g}" for v in model.at)
        for part in words.split(", "):
            self.page.wait_for_selector(f".verdict[data-final='1'] .label span:has-text('{part}')")
        return self.settled().get_attribute("data-label")

    def spot(self, across, up):
        """A place on the screen by its shares of the map's frame."""
        box = self.page.locator("#map-figure").bounding_box()
        return (box["x"] + 70 + across * (box["width"] - 120), box["y"] + 10 + (1 - up) * (box["height"] - 65))

    def type(self, name, text):
        field = self.page.locator(f".field-{name} input[type=text]")
        field.fill(text)
        field.press("Enter")

    def choose(self, name, label):
        """Choose an option by its words."""
        self.page.locator(f"select[name=select-{name}]").select_option(label=label)

    def message(self):
        return self.page.wait_for_selector(".error").inner_text()

    def close(self):
        assert self.errors == [] and self.strangers == []
        self.context.close()


def _own(address, home):
    return address.startswith((home, home.replace("http", "ws"), "data:", "blob:"))


@pytest.fixture
def visit(chromium, server):
    visits = []

    def begin(query="", size="laptop"):
        visits.append(Visit(chromium, server + query, size))
        return visits[-1]

    yield begin
    for one in visits:
        one.close()


@pytest.mark.parametrize("size", SIZES)
def test_the_page_loads_at_every_size_and_nothing_is_wider_than_it(visit, size):
    page = visit(f"?{MAP}&at=1.0,0.206", size).page
    page.wait_for_selector("[data-stride]", state="attached")
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    for name in ("map", "dossier", "controls", "line", "basin"):
        box = page.locator(f"#{name}").bounding_box()
        assert box["width"] > 200 and box["height"] > 100
    assert page.locator("canvas").count() >= 7


@pytest.mark.parametrize("kind", ["torsional", "full"])
def test_a_click_shows_the_verdict_of_regime(visit, kind):
    one = visit(f"?kind={kind}&{MAP}&at=2.9,0.01")
    for across, up in ((0.3, 0.7), (0.55, 0.6), (0.1, 0.1)):
        view = one.after(lambda across=across, up=up: one.page.mouse.click(*one.spot(across, up)))
        assert view.at == pytest.approx((0.2 + across * 2.8, up * 0.3), abs=0.2)
        assert one.label() == gc.regime(view.point).label


def test_sliders_and_numbers_change_the_motion(visit):
    one = visit(f"?{MAP}&at=1.0,0.206")
    assert one.label() == "8T"
    view = one.after(lambda: one.type("eps1", "0.05"))
    assert view.at == (1.0, 0.05) and one.label() == "1T"
    box = one.page.locator(".field-omega input[type=range]").bounding_box()
    view = one.after(lambda: one.page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + box["height"] / 2))
    assert view.at[0] == pytest.approx(sum(span("omega")[:2]) / 2, abs=0.02)
    view = one.after(lambda: one.type("zeta", "0.08"))
    assert view.model.zeta == 0.08


def test_presets_kinds_stiffness_axes_and_colours(visit):
    one = visit()
    assert one.after(lambda: one.choose("preset", presets()["13b"].name)) == presets()["13b"].view
    assert one.label() == "quasi-periodic"
    assert one.after(lambda: one.choose("kind", "torsional: rigid supports")).model.kind == "torsional"
    assert one.after(lambda: one.choose("stiffness", "harmonics")).model.stiffness.amplitudes == (0.25,)
    one.page.wait_for_selector(".field-c1")
    assert one.after(lambda: one.choose("y", "q₀  torque")).y.name == "q0"
    for colour in ("v_rms", "contact_fraction", "dynamic_factor", "attractors", "motion"):
        assert one.after(lambda colour=colour: one.choose("colour", COLOURS[colour])).colour == colour
    assert one.after(lambda: one.choose("line", "vertical line")).line == "y"


def test_keys_move_the_point_but_not_while_typing(visit):
    one = visit(f"?{MAP}&at=1.0,0.1")
    before = one.view
    assert one.after(lambda: one.page.keyboard.press("ArrowRight")).at == before.stepped(1, 0).at
    assert one.after(lambda: one.page.keyboard.press("Shift+ArrowUp")).at[1] > before.at[1]
    here = one.view
    one.page.locator(".field-q0 input[type=text]").focus()
    one.page.keyboard.press("ArrowLeft")
    one.page.wait_for_timeout(300)
    assert one.view == here


def test_zoom_recomputes_what_is_in_view(visit):
    one = visit(f"?{MAP}&at=1.0,0.1")
    one.page.mouse.move(*one.spot(0.5, 0.5))
    view = one.after(lambda: one.page.mouse.wheel(0, -600))
    assert view.x.stop - view.x.start < 2.5 and view.at == (1.0, 0.1)
    one.page.wait_for_selector(".busy:has-text('map')")
    one.page.wait_for_selector("[data-stride='4'], [data-stride='2'], [data-stride='1']", state="attached")


def test_the_address_bar_restores_the_page(visit):
    query = presets()["13a"].view.with_value("zeta", 0.03).query()
    one = visit(f"?{query}")
    assert one.view.query() == query
    assert one.page.locator(".field-zeta input[type=text]").input_value() == "0.03"
    one.page.reload()
    one.settled()
    assert one.view.query() == query


@pytest.mark.parametrize("query", ["eps1=1e400", "%00=1"])
def test_an_absurd_address_is_a_message_on_a_page_that_works(visit, query):
    one = visit(f"?{query}")
    assert "The address cannot be shown" in one.message()
    assert one.label() == gc.regime(START.point).label


def test_absurd_numbers_in_every_field_are_messages_and_change_nothing(visit):
    one = visit(f"?kind=full&{MAP}&at=1.0,0.1")
    here, fields = one.view, one.page.locator(".field input[type=text]")
    assert fields.count() >= 18
    place = one.page.evaluate(PLACE)
    for i in range(fields.count()):
        value = fields.nth(i).input_value()
        fields.nth(i).fill(("abc", "1e400", "-1e300", "nan")[i % 4])
        fields.nth(i).press("Enter")
        assert "must" in one.message() and one.page.evaluate(PLACE) == place  # else the next click would miss
        sync_api.expect(fields.nth(i)).to_have_value(value)
        fields.nth(i).fill("abc")
        fields.nth(i).press("Enter")
        sync_api.expect(fields.nth(i)).to_have_value(value)
    assert one.view == here
    one.after(lambda: one.type("eps1", "0.05"))
    assert one.page.locator(".error").count() == 0


def test_what_is_copied_is_what_is_shown(visit):
    one = visit(f"?{MAP}&at=1.0,0.206&zeta=0.03")
    one.page.click("[data-copy=toml]")
    one.page.wait_for_selector("[data-copy=toml]:has-text('copied')")
    text = one.page.evaluate("navigator.clipboard.readText()")
    assert tomllib.loads(text)["model"]["zeta"] == 0.03
    one.page.click("[data-copy=python]")
    one.page.wait_for_selector("[data-copy=python]:has-text('copied')")
    names: dict = {}
    exec(one.page.evaluate("navigator.clipboard.readText()").split("verdict")[0], names)
    assert names["model"] == one.view.point


def test_downloads(visit, tmp_path):
    one = visit(f"?{MAP}&at=1.0,0.206")
    one.page.wait_for_selector("[data-stride]", state="attached")
    for kind, suffix in (("map", "PNG"), ("map", "SVG"), ("map", "data"), ("motion", "PNG"), ("motion", "data")):
        with one.page.expect_download() as waiting:
            one.page.click(f"button:has-text('{kind} {suffix}')")
        path = tmp_path / waiting.value.suggested_filename
        waiting.value.save_as(path)
        if suffix == "PNG":
            with Image.open(path) as picture:
                assert min(picture.size) > 400
        elif suffix == "SVG":
            assert path.read_bytes().startswith(b"<?xml")
        else:
            dataset = gc.load(path)
            assert dataset.attrs["study"] == {"map": "zones", "motion": "simulate"}[kind]


def test_other_motions_basins_and_the_diagram(visit):
    one = visit("?" + presets()["4"].view.query())
    one.page.wait_for_selector("#others button:has-text('3T')").click()
    one.page.wait_for_selector(".verdict[data-label='3T'][data-final='1']")
    one.page.wait_for_function("location.search.includes('start=')")  # the address follows
    assert gc.regime(one.view.point).label == "3T" and one.view.start
    one.page.click("button:has-text('basins of this point')")
    one.page.wait_for_selector("#basin-legend .entry")
    one.page.wait_for_selector(".busy:not(:has-text('diagram'))")
    box = one.page.locator("#line .plot").bounding_box()
    view = one.after(lambda: one.page.locator("#line .plot").click(position={"x": box["width"] / 2, "y": 100}))
    assert view.at[0] != 2.3 and view.at[1] == 0.05 and view.start == ()


def test_two_tabs_do_not_disturb_each_other(visit):
    one, two = visit(f"?{MAP}&at=1.0,0.206"), visit(f"?{MAP}&at=2.9,0.01")
    there = two.view
    one.after(lambda: one.page.mouse.click(*one.spot(0.6, 0.6)))
    assert one.label() == gc.regime(one.view.point).label
    assert two.view == there and two.label() == "1T"
    two.after(lambda: two.type("zeta", "0.06"))
    assert one.view.model.zeta == 0.025


def test_no_click_gets_lost_however_soon_or_slow(visit):
    one = visit(f"?{MAP}&at=1.0,0.206")
    for point in ((0.3, 0.3), (0.7, 0.4)):
        one.page.mouse.click(*one.spot(*point))
    one.page.wait_for_function("Number(new URLSearchParams(location.search).get('at').split(',')[0]) > 1.8")
    one.page.mouse.move(*one.spot(0.2, 0.8))
    one.page.mouse.down()
    one.page.wait_for_timeout(600)
    one.after(one.page.mouse.up)
    assert one.view.at[0] < 1.2


def test_connections_from_other_origins_are_refused(server):
    from http.client import HTTPConnection

    home = server.removeprefix("http://").rstrip("/")
    connection = HTTPConnection(home, timeout=20)
    connection.request("GET", "/ws", headers={
        "Upgrade": "websocket", "Connection": "Upgrade", "Origin": "http://example.org",
        "Sec-WebSocket-Key": "Z2VhcmNoYW9zZ2VhcmNoYQ==", "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Protocol": "bokeh, none",
    })
    assert connection.getresponse().status == 403
    connection.close()


def test_a_study_file_its_units_and_a_warning_for_open_hosts(chromium):
    from pathlib import Path

    study = Path(__file__).parent.parent / "examples" / "physical_pair.toml"
    with served(str(study), "--host", "0.0.0.0") as (url, said):
        assert any(line.startswith("warning: ") for line in said)
        one = Visit(chromium, url.replace("0.0.0.0", "127.0.0.1"))
        assert "mm/s" not in one.page.locator(".verdict").inner_text()
        one.after(lambda: one.page.click("button:has-text('physical units')"))
        one.page.wait_for_selector(".verdict:has-text('mm/s')")
        assert one.view.physical
        one.close()


def test_the_notebook_shows_the_same_page(chromium):
    shown = gc.explore(gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206))
    assert shown.url in shown._repr_html_()
    one = Visit(chromium, shown.url)
    assert one.label() == "8T"
    one.close()
    shown.stop()


def test_bad_arguments_of_the_command_are_one_line():
    for arguments in (("--port", "99999"), ("--axis", "omega=1:2:3"), ("--set", "eps9=0.1"), ("--set", "omega=1000")):
        done = subprocess.run((*COMMAND[:-2], *arguments), capture_output=True, text=True, timeout=120)
        assert done.returncode == 2, done.stderr
        assert done.stderr.splitlines()[-1].startswith("error: ") and "Traceback" not in done.stderr


def test_the_page_is_plain_json_free_of_paths(server):
    """Nothing of this machine's folders is in what a visitor gets."""
    from urllib.request import urlopen

    page = urlopen(server).read().decode()
    assert sys.prefix not in page and json.dumps(sys.prefix) not in page
