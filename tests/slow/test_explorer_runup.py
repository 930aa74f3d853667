"""A run-up played in a browser: the clock, the marker on the map, pixels, sound, stop, refusals, widths."""

import numpy as np
import pytest

from gearchaos.explorer.view.state import view_of
from gearchaos.studyfile import load_study
from tests.slow.browser import DESIGN, NEEDED, SIZES, visits
from tests.slow.test_explorer_curves import FRAME, count, pixels

sync_api = pytest.importorskip("playwright.sync_api")
pytestmark = NEEDED
FIRST = view_of(load_study(DESIGN).model)
QUERY = "?x=speed=900.0:2100.0&y=torque=90.0:110.0&speed=1000&torque=100&run="
SOURCE = """([name, field]) => {
  const {model} = [...Bokeh.index.roots].find((root) => root.model.name === name)
  const sources = model.renderers.map((r) => r.data_source.data)
  return field === "lines" ? sources.slice(0, 2).map((data) => [...data.x]) : [...sources.at(-1).x]
}"""
"""The speeds of the two lines of the response that are drawn, or of the last marker of a figure."""

NOW = """() => [parseFloat(document.getElementById("run-now").value), document.getElementById("run-audio").currentTime,
  [...Bokeh.index.roots].find((root) => root.model.name === "map").model.renderers.at(-1).data_source.data.x[0]]"""
"""The instant on show, that of the sound, and the speed of the marker on the map."""

INK = "#1d2b53"
DECODED = """async () => {
  const data = await (await fetch(document.getElementById("run-audio").src)).arrayBuffer()
  const found = await new OfflineAudioContext(1, 1, 44100).decodeAudioData(data)
  return [found.duration, found.getChannelData(0).reduce((most, each) => Math.max(most, Math.abs(each)), 0)]
}"""
"""The duration in s and the largest sample of the sound, as the browser decodes it."""


@pytest.fixture
def visit_design(chromium, design_server):
    """Opens a page of that server; whatever goes wrong on it fails the test."""
    with visits(chromium, design_server + QUERY, first=FIRST) as begin:
        yield begin


def begin(one):
    """Press play, and wait until the run-up is played."""
    one.page.click("[data-press=run]")
    one.page.wait_for_function("document.getElementById('run-now').value !== ''")


def wait_for(one, instant):
    one.page.wait_for_function("t => parseFloat(document.getElementById('run-now').value) >= t", arg=instant)


def wait_for_end(one):
    one.page.wait_for_selector("[data-press=run][aria-pressed=false]")


def test_a_run_is_played_by_the_clock_of_its_sound_and_asks_nothing_of_the_server(visit_design):
    one = visit_design("1000.0:2000.0,4.0,up,sound")
    one.page.wait_for_selector("#legend [data-share='1.0000']", state="attached")
    begin(one)
    one.page.wait_for_selector(".busy.idle")
    said = one.page.evaluate("""() => {
      window.said = 0
      const send = WebSocket.prototype.send
      WebSocket.prototype.send = function (...data) { window.said += 1; send.apply(this, data) }
      return window.said
    }""")
    wait_for_end(one)
    one.page.click("[data-press=run]")  # it is there, so the page plays it by itself
    wait_for(one, 1)
    drawn, (first, _) = count(one, "run", INK), one.page.evaluate(SOURCE, ["run", "lines"])
    before, heard, speed = one.page.evaluate(NOW)
    assert heard == pytest.approx(before, abs=0.3) and speed == pytest.approx(1000 + 250 * before, abs=20)
    wait_for(one, 3)
    after, heard, faster = one.page.evaluate(NOW)
    assert heard == pytest.approx(after, abs=0.3) and faster == pytest.approx(1000 + 250 * after, abs=20)
    assert after > before and max(one.page.evaluate(SOURCE, ["run", "lines"])[0]) > first[-1]
    assert count(one, "run", INK) > 1.5 * drawn
    wait_for_end(one)
    assert one.page.evaluate(SOURCE, ["run", "lines"])[0][-1] > 1990 and one.page.evaluate(NOW)[0] == 4.0
    assert one.page.evaluate("window.said") == said == 0
    duration, largest = one.page.evaluate(DECODED)
    assert duration == pytest.approx(4.0, abs=0.005) and largest == pytest.approx(1.0, abs=1e-3)
    assert one.page.evaluate("document.getElementById('run-audio').duration") == pytest.approx(duration, abs=1e-3)


def test_without_sound_it_takes_as_long_and_comes_back_along_the_second_line(visit_design):
    one = visit_design("1000.0:2000.0,1.5,down")
    begin(one)
    began = one.page.evaluate("performance.now()")
    wait_for(one, 1.7)
    up, down = one.page.evaluate(SOURCE, ["run", "lines"])
    assert max(up) > 1990 and min(down) > 1500 and max(down) > 1990
    shown, scroll = pixels(one), one.page.evaluate("scrollY")
    wait_for_end(one)
    assert one.page.evaluate("performance.now()") - began > 2500
    left, top, width, height = (round(v) for v in one.page.evaluate(FRAME, "waterfall"))
    part = [each[top + scroll : top + scroll + height, left : left + width] for each in (shown, pixels(one))]
    assert (abs(part[0] - part[1]).max(axis=2) > 24).sum() > height  # the line moved
    assert len(np.unique(part[1].reshape(-1, 3), axis=0)) > 50  # an image
    assert one.page.locator("#run-audio").get_attribute("src") is None
    text = one.page.locator("#run-text").inner_text()
    assert "Jumps, speed rising: 1" in text and "Jumps, speed falling: 1" in text and "quasi-static ratio" in text


def test_a_run_can_be_stopped_while_it_is_computed_and_goes_with_the_torque(visit_design):
    one = visit_design("1000.0:7000.0,30.0,up")
    button = one.page.locator("[data-press=run]")
    button.click()
    one.page.wait_for_selector(".busy:has-text('run-up')")
    assert "stop" in button.inner_text()
    button.click()
    one.page.wait_for_selector(".busy:not(:has-text('run-up'))")
    sync_api.expect(button).to_have_attribute("aria-pressed", "false")
    assert "play" in button.inner_text()
    for name, value in (("run-stop", "2000"), ("run-duration", "1")):
        def fill(name=name, value=value):
            one.page.fill(f"[data-set={name}]", value)
            one.page.press(f"[data-set={name}]", "Enter")
        assert "run=" in one.page.url and one.after(fill).run is not None
    assert (one.view.run.stop, one.view.run.duration) == (2000.0, 1.0)
    begin(one)
    assert one.page.locator("#run .plot").first.bounding_box()["height"] > 150
    one.after(lambda: one.type("torque", "95"))
    one.page.wait_for_function("document.getElementById('run-text').innerText === ''")
    assert one.page.evaluate(SOURCE, ["map", ""]) == []
    assert one.page.locator("#run .plot").first.bounding_box()["height"] == 0


def test_what_the_gears_do_not_allow_is_said_and_the_button_is_free_again(visit_design):
    one = visit_design("100.0:2000.0,0.2,up")
    one.page.click("[data-press=run]")
    assert "at most 5 % within a period" in one.message()
    wait_for_end(one)
    one.page.fill("[data-set=run-duration]", "31")
    one.page.press("[data-set=run-duration]", "Enter")
    one.page.wait_for_selector(".error:has-text('must lie in (0, 30] s')")
    assert one.page.input_value("[data-set=run-duration]") == "0.2"


@pytest.mark.parametrize("size", SIZES)
def test_nothing_is_wider_than_the_page_while_it_is_played(visit_design, size):
    one = visit_design("1000.0:2000.0,2.0,up", size)
    one.page.wait_for_selector("#run .plot", state="attached")
    assert one.page.locator("#run").bounding_box()["height"] < (150 if size == "phone" else 60)
    begin(one)
    wait_for(one, 1)
    assert one.page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    run, outer = one.page.locator("#run").bounding_box(), one.page.locator("main").bounding_box()
    assert outer["x"] <= run["x"] and run["x"] + run["width"] <= outer["x"] + outer["width"]
    wait_for_end(one)
    assert count(one, "run", INK) > 100
