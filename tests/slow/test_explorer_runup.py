"""A run-up played in a browser: the clock, the marker on the map, pixels, sound, stop, refusals, widths."""

import numpy as np
import pytest

from tests.slow.browser import NEEDED
from tests.slow.test_explorer_curves import FRAME, count, pixels

sync_api = pytest.importorskip("playwright.sync_api")
pytestmark = NEEDED
PAGE = ("design_server",
        "?x=speed=900.0:2100.0&y=torque=90.0:110.0&speed=1000&torque=100&run=1000.0:2000.0,4.0,up,sound")
SOURCE = """([name, field]) => {
  const {model} = [...Bokeh.index.roots].find((root) => root.model.name === name)
  const sources = model.renderers.map((r) => r.data_source.data)
  return field === "lines" ? sources.slice(0, 2).map((data) => [...data.x]) : [...sources.at(-1).x]
}"""
"""The speeds of the two lines of the response that are drawn, or of the last marker of a figure."""

NOW = """() => [parseFloat(document.getElementById("run-now").value),
  [...Bokeh.index.roots].find((root) => root.model.name === "map").model.renderers.at(-1).data_source.data.x[0]]"""
"""The instant on show, and the speed of the marker on the map."""

CLOCK_OF_SOUND = """() => {
  window.instant = window.said = 0
  const audio = document.getElementById("run-audio"), send = WebSocket.prototype.send
  Object.defineProperty(audio, "currentTime", {get: () => window.instant, set: () => {}})
  Object.defineProperty(audio, "ended", {get: () => false})
  audio.addEventListener("play", () => { window.sounded = true })
  WebSocket.prototype.send = function (...data) { window.said += 1; send.apply(this, data) }
}"""
"""From now on the clock of the sound stands at ``instant``, and ``said`` counts what is sent to the server."""

CLOCK_OF_FRAMES = """() => {
  window.instant = 0
  const frame = window.requestAnimationFrame.bind(window), clock = performance.now, began = performance.now()
  window.requestAnimationFrame = (draw) =>
    frame((now) => draw(draw.name === "next_frame" ? began + 1000 * window.instant : now))
  performance.now = () => began
  document.querySelector("[data-press=run]").click()
  performance.now = clock
}"""
"""Plays the run with a clock that stands at ``instant``."""

INK = "#1d2b53"
DECODED = """async () => {
  const data = await (await fetch(document.getElementById("run-audio").src)).arrayBuffer()
  const found = await new OfflineAudioContext(1, 1, 44100).decodeAudioData(data)
  return [found.duration, found.getChannelData(0).reduce((most, each) => Math.max(most, Math.abs(each)), 0)]
}"""
"""The duration in s and the largest sample of the sound, as the browser decodes it."""


def choose(one, **values):
    wanted = one.view.with_run(**values).run
    if wanted.sound != one.view.run.sound:
        one.page.click("[data-press=run-sound]")
    one.page.select_option("[data-set=run-way]", wanted.way)
    for name in ("start", "stop", "duration"):
        one.page.fill(f"[data-set=run-{name}]", f"{getattr(wanted, name):g}")
        one.page.press(f"[data-set=run-{name}]", "Enter")
    one.page.wait_for_function("(words) => decodeURIComponent(location.search).includes(words)",
                               arg=f"{wanted.start}:{wanted.stop},{wanted.duration},{wanted.way}")
    assert one.view.run == wanted


def begin(one):
    one.page.click("[data-press=run]")
    one.page.wait_for_function("document.getElementById('run-now').value !== ''")


def wait_for(one, instant):
    one.page.evaluate("instant => { window.instant = instant }", instant)
    one.page.wait_for_function("t => parseFloat(document.getElementById('run-now').value) === t", arg=instant)


def wait_for_end(one):
    one.page.wait_for_selector("[data-press=run][aria-pressed=false]")


def test_a_run_is_played_by_the_clock_of_its_sound_and_asks_nothing_of_the_server(one):
    one.page.wait_for_selector("#legend [data-share='1.0000']", state="attached")
    begin(one)
    one.page.wait_for_selector(".busy.idle")
    wait_for_end(one)
    assert one.page.evaluate(NOW)[0] == 4.0
    one.page.evaluate(CLOCK_OF_SOUND)
    one.page.click("[data-press=run]")  # it is there, so the page plays it by itself
    one.page.wait_for_function("window.sounded")
    drawn = []
    for instant in (1.0, 3.0):
        wait_for(one, instant)
        assert one.page.evaluate(NOW) == [instant, 1000 + 250 * instant]
        drawn += one.page.evaluate(SOURCE, ["run", "lines"])[:1]
    assert max(drawn[0]) < 1250 < 1700 < max(drawn[1]) < 1750
    wait_for(one, 4.0)
    wait_for_end(one)
    assert one.page.evaluate(SOURCE, ["run", "lines"])[0][-1] > 1990 and one.page.evaluate("window.said") == 0
    one.page.evaluate("window.instant = 0")
    one.page.click("[data-press=run]")
    inked = []
    for instant in (1.0, 3.0):
        wait_for(one, instant)
        inked.append(count(one, "run", INK))  # after a picture of the page its figures tell the server their sizes
        assert one.page.evaluate(NOW)[0] == instant  # however long all this took
    assert inked[1] > 1.5 * inked[0]
    wait_for(one, 4.0)
    wait_for_end(one)
    duration, largest = one.page.evaluate(DECODED)
    assert duration == pytest.approx(4.0, abs=0.005) and largest == pytest.approx(1.0, abs=1e-3)
    assert one.page.evaluate("document.getElementById('run-audio').duration") == pytest.approx(duration, abs=1e-3)


def test_without_sound_it_takes_as_long_and_comes_back_along_the_second_line(one):
    choose(one, start=1000.0, stop=2000.0, duration=1.5, way="down", sound=False)
    begin(one)
    began = one.page.evaluate("performance.now()")
    wait_for_end(one)
    assert one.page.evaluate("performance.now()") - began > 2500
    one.page.evaluate(CLOCK_OF_FRAMES)
    wait_for(one, 1.7)
    up, down = one.page.evaluate(SOURCE, ["run", "lines"])
    assert max(up) > 1990 and max(down) > 1990 and min(down) == pytest.approx(2000 - 1000 * 0.2 / 1.5, abs=10)
    shown, scroll = pixels(one), one.page.evaluate("scrollY")
    wait_for(one, 3.0)
    wait_for_end(one)
    left, top, width, height = (round(v) for v in one.page.evaluate(FRAME, "waterfall"))
    part = [each[top + scroll : top + scroll + height, left : left + width] for each in (shown, pixels(one))]
    assert (abs(part[0] - part[1]).max(axis=2) > 24).sum() > height  # the line moved
    assert len(np.unique(part[1].reshape(-1, 3), axis=0)) > 50  # an image
    assert one.page.locator("#run-audio").get_attribute("src") is None
    text = one.page.locator("#run-text").inner_text()
    assert "Jumps, speed rising: 1" in text and "not steady, speed falling: 1" in text and "quasi-static ratio" in text


def test_a_run_can_be_stopped_while_it_is_computed_and_goes_with_the_torque(one):
    choose(one, start=1000.0, stop=7000.0, duration=30.0, way="up", sound=False)
    button = one.page.locator("[data-press=run]")
    button.click()
    one.page.wait_for_selector(".busy:has-text('run-up')")
    assert "stop" in button.inner_text()
    button.click()
    one.page.wait_for_selector(".busy:not(:has-text('run-up'))")
    sync_api.expect(button).to_have_attribute("aria-pressed", "false")
    assert "play" in button.inner_text()
    choose(one, stop=2000.0, duration=1.0)
    begin(one)
    assert one.page.locator("#run .plot").first.bounding_box()["height"] > 150
    one.after(lambda: one.type("torque", "95"))
    one.page.wait_for_function("document.getElementById('run-text').innerText === ''")
    assert one.page.evaluate(SOURCE, ["map", ""]) == []
    assert one.page.locator("#run .plot").first.bounding_box()["height"] == 0


def test_what_the_gears_do_not_allow_is_said_and_the_button_is_free_again(one):
    choose(one, start=100.0, stop=2000.0, duration=0.2, way="up")
    one.page.click("[data-press=run]")
    assert "at most 5 % within a period" in one.message()
    wait_for_end(one)
    one.page.fill("[data-set=run-duration]", "31")
    one.page.press("[data-set=run-duration]", "Enter")
    one.page.wait_for_selector(".error:has-text('must lie in (0, 30] s')")
    assert one.page.input_value("[data-set=run-duration]") == "0.2"
