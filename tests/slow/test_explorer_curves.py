"""Branches in the diagram and bifurcation curves over the map in a browser: pixels, buttons, units, widths."""

import io

import numpy as np
import pytest
from PIL import Image

import gearchaos as gc
from gearchaos.explorer.features.motion.diagram import BRANCH_COLOUR as BRANCH
from gearchaos.explorer.features.motion.orbits import skeleton
from gearchaos.plot.theme import EVENT_COLOURS as CURVES
from tests.slow.browser import NEEDED

sync_api = pytest.importorskip("playwright.sync_api")
pytestmark = NEEDED
PAGE = "server", "?q0=0.1&x=omega=2.0:2.4&y=eps1=0.0:0.1&at=2.2,0.02"
"""A 1T orbit that loses stability in a flip at ω = 2.145, where motions of 2T begin; soon computed."""

PLACE = """([name, x, y]) => {
  const view = [...Bokeh.index.roots].find((root) => root.model.name === name)
  const {left, top} = view.el.getBoundingClientRect()
  return [left + view.frame.x_scale.compute(x), top + view.frame.y_scale.compute(y)]
}"""
"""The place on the screen of a point of a figure, given in its own coordinates."""

FRAME = """(name) => {
  const view = [...Bokeh.index.roots].find((root) => root.model.name === name)
  const {left, top} = view.el.getBoundingClientRect()
  const {left: x, top: y, width, height} = view.frame.bbox
  return [left + x, top + y, width, height]
}"""
IMAGE = """() => [...Bokeh.index.roots].find((root) => root.model.name === "line")
  .model.renderers[0].data_source.data.image.length > 0"""
PAINTED = "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
EVENT = """() => {
  const {model} = [...Bokeh.index.roots].find((root) => root.model.name === "line")
  const {x, y} = model.renderers.map((r) => r.data_source.data).find((data) => data.multipliers)
  return [x[0], y[0]]
}"""


def pixels(one):
    one.page.evaluate(PAINTED)
    return np.asarray(Image.open(io.BytesIO(one.page.screenshot(full_page=True))).convert("RGB"), dtype=int)


def near(shown, place, colour, scroll=0, width=3):
    """Whether a pixel of about this colour is within some pixels of a place."""
    x, y = round(place[0]), round(place[1] + scroll)
    part = shown[y - width : y + width + 1, x - width : x + width + 1].reshape(-1, 3)
    return bool((abs(part - rgb(colour)).max(axis=1) < 24).any())


def count(one, name, colour):
    """Number of pixels of about this colour in the frame of a figure."""
    shown, scroll = pixels(one), one.page.evaluate("scrollY")
    left, top, width, height = (round(v) for v in one.page.evaluate(FRAME, name))
    part = shown[top + scroll : top + scroll + height, left : left + width].reshape(-1, 3)
    return int((abs(part - rgb(colour)).max(axis=1) < 24).sum())


def rgb(colour):
    return np.array(list(bytes.fromhex(colour[1:])))


def follow(one):
    one.page.wait_for_function(IMAGE)
    one.page.wait_for_selector(".follow button:not([disabled])")
    one.page.click("[data-press=follow]")
    one.page.wait_for_selector("#branch .words")


def show_curves(one, period="1"):
    one.page.wait_for_selector("#legend [data-share='1.0000']", state="attached")
    one.page.locator("select[name=select-skeleton-period]").select_option(period)
    one.page.click("[data-press=skeleton]")
    one.page.wait_for_selector("#skeleton [data-complete='1']", state="attached")


def test_a_branch_is_drawn_where_the_motion_is_says_what_lies_at_its_event_and_goes_with_its_button_and_line(one):
    follow(one)
    shown, scroll = pixels(one), one.page.evaluate("scrollY")
    for omega in (2.18, 2.25, 2.35):  # stable
        z = gc.regime(one.view.point.with_values({"omega": omega})).section["z"][0]
        assert near(shown, one.page.evaluate(PLACE, ["line", omega, z]), BRANCH, scroll)
        assert not near(shown, one.page.evaluate(PLACE, ["line", omega, z + 0.05]), BRANCH, scroll)
    text = one.page.locator("#branch").inner_text()
    assert "Branch of 1T orbits along ω from 2 to 2.4" in text and "Stable from 2.14" in text and "flip (1)" in text
    one.page.locator("#line").scroll_into_view_if_needed()
    one.page.mouse.move(*one.page.evaluate(PLACE, ["line", *one.page.evaluate(EVENT)]))
    one.page.wait_for_selector(".bk-tooltip-row-value")
    found = one.page.locator(".bk-tooltip-row-value").all_inner_texts()
    assert found[0] == "flip of 1T" and found[1].startswith("ω = 2.1") and found[2].startswith("−1, ")
    one.page.click("[data-press=drop-branch]")
    one.page.wait_for_function("document.getElementById('branch').innerText === ''")
    assert count(one, "line", BRANCH) == 0
    follow(one)
    assert count(one, "line", BRANCH) > 200
    one.after(lambda: one.type("eps1", "0.03"))
    one.page.wait_for_function("document.getElementById('branch').innerText === ''")
    assert count(one, "line", BRANCH) == 0


def test_bifurcation_curves_are_drawn_where_the_kinds_of_motion_change_and_go(one):
    one.page.locator("#map-figure").scroll_into_view_if_needed()
    show_curves(one)
    curve = next(c for c in list(skeleton(one.view, 1))[-1].curves if c.kind == "flip" and c.x.max() > 2.1)
    shown, scroll = pixels(one), one.page.evaluate("scrollY")
    for height in (0.01, 0.03, 0.05):
        i = int(np.argmin(abs(curve.y - height)))
        place = one.page.evaluate(PLACE, ["map", curve.x[i], curve.y[i]])
        assert near(shown, place, CURVES["flip"], scroll)
        assert not near(shown, (place[0] + 25, place[1]), CURVES["flip"], scroll)
    button = one.page.locator("[data-press=skeleton]")
    sync_api.expect(button).to_have_attribute("aria-pressed", "true")
    button.click()
    sync_api.expect(button).to_have_attribute("aria-pressed", "false")
    assert count(one, "map", CURVES["flip"]) == 0 and one.page.locator("#skeleton .entry").count() == 0
    button.click()
    one.page.wait_for_selector("#skeleton [data-complete='1']", state="attached")
    assert count(one, "map", CURVES["flip"]) > 100
    one.page.mouse.move(*one.spot(0.5, 0.5))
    one.after(lambda: one.page.mouse.wheel(0, -300))  # another window
    sync_api.expect(button).to_have_attribute("aria-pressed", "false")
    assert one.page.locator("#skeleton .entry").count() == 0
