"""The assessment in a browser: its button, its bars over the map, its table, another torque, its file, its width; and
what tolerances do at the point."""

import json

import numpy as np
import pytest

from gearchaos.plot.classes import CONTACT_CLASSES, SEVERITY_COLOURS
from tests.slow.browser import NEEDED
from tests.slow.test_explorer_curves import PLACE, near, pixels

sync_api = pytest.importorskip("playwright.sync_api")
pytestmark = NEEDED
PAGE = "design_server", "?x=speed=786.0:822.0&y=torque=90.0:110.0&speed=788&torque=100"
DARK, HITS = "#111111", SEVERITY_COLOURS["contact lost, hits"]


def assess(one):
    one.page.click("[data-press=assess]")
    one.page.wait_for_selector("[data-press=assess][aria-pressed=true]")
    one.page.wait_for_selector("[data-press=assess][aria-pressed=false]")
    assert one.page.locator("#assessment-text tr").count()


def bar(one, speed, torque):
    """Whether the map has the colours of a striped bar at a point: hits, dark stripes, a white outline."""
    shown, scroll = pixels(one), one.page.evaluate("scrollY")
    place = one.page.evaluate(PLACE, ["map", speed, torque])
    return [near(shown, place, colour, scroll, 9) for colour in (HITS, DARK, "#ffffff")]


def test_the_ranges_are_drawn_over_the_map_listed_and_saved_and_one_that_is_clicked_is_where_the_point_goes(
        one, tmp_path):
    one.page.wait_for_selector("#legend [data-share='1.0000']", state="attached")
    assert not all(bar(one, 795.0, 100.0))
    assess(one)
    document = json.loads(one.saved("assessment JSON", tmp_path).read_text())
    assert document.pop("study_file").count("[design]") == 1
    (avoided,), usable = document["avoid"], min(document["usable"], key=lambda part: part["from"])
    middles = [(part["from"] + part["to"]) / 2 for part in (avoided, usable)]
    quarter = (middles[0] + avoided["from"]) / 2
    assert (round(avoided["from"]), round(avoided["to"])) == (791, 808)  # tests.contracts.explorer.test_assessment
    assert all(bar(one, quarter, 100.0)) and not all(bar(one, middles[1], 100.0)) and not all(bar(one, quarter, 105.0))
    text = one.page.locator("#assessment-text").inner_text()
    assert "790" in text and "809" in text and "contact lost, hits" in text and "Usable in operation" in text
    assert one.page.evaluate("(e => e.scrollWidth <= e.clientWidth)(document.querySelector('#assessment .scroll'))")
    rows = one.page.locator("#assessment-text tr[data-range]")
    assert rows.count() == 3 and one.page.locator(".other").count() == 0
    for number, middle in enumerate(middles):
        view = one.after(lambda number=number: rows.nth(number).click())
        assert view.at == (pytest.approx(middle, abs=0.06), 100.0)
    one.after(lambda: one.type("torque", "95"))
    assert "torque 100 N m, not that of the point, 95 N m" in one.page.wait_for_selector(".other").inner_text()
    assert all(bar(one, quarter, 100.0))
    one.after(lambda: rows.first.click())
    one.page.wait_for_selector(".other", state="detached")
    assert one.view.at[1] == 100.0
    one.after(lambda: one.type("zeta", "0.08"))  # another design removes it
    one.page.wait_for_function("document.getElementById('assessment-text').innerText === ''")
    assert not all(bar(one, quarter, 100.0))


def test_it_can_be_stopped_and_is_free_again(visit_design):
    one = visit_design("?x=speed=300.0:7500.0&y=torque=90.0:110.0&speed=780&torque=100")
    button = one.page.locator("[data-press=assess]")
    button.click()
    one.page.wait_for_selector(".busy:has-text('assessment')")
    sync_api.expect(button).to_have_attribute("aria-pressed", "true")
    assert "stop" in button.inner_text()
    button.click()
    one.page.wait_for_selector(".busy:not(:has-text('assessment'))")
    sync_api.expect(button).to_have_attribute("aria-pressed", "false")
    sync_api.expect(one.page.locator("[data-show=assess-progress]")).to_contain_text("assessment stopped at")


def test_what_tolerances_do_is_said_and_drawn_until_the_point_moves(one):
    one.after(lambda: one.choose("preset", "the gears loaded"))
    plot = one.page.locator("#tolerances .plot")
    assert plot.bounding_box()["height"] == 0
    one.page.click("[data-press=tolerances]")
    first = one.page.wait_for_selector("#tolerances-text p").inner_text()
    assert first.startswith("100 N m: contact is lost in operation with probability 0.")
    sync_api.expect(one.page.locator("[data-press=tolerances]")).to_have_attribute("aria-pressed", "false")
    shown, place, scroll = pixels(one), plot.bounding_box(), one.page.evaluate("scrollY")
    left, top = int(place["x"]), int(place["y"] + scroll)
    inside = shown[top:top + int(place["height"]), left:left + int(place["width"])]
    for each in CONTACT_CLASSES[:3]:
        colour = [int(each.colour[i:i + 2], 16) for i in (1, 3, 5)]
        assert np.sum(np.abs(inside - colour).max(axis=-1) < 3) > 20
    one.after(lambda: one.type("torque", "101"))
    one.page.wait_for_function("document.getElementById('tolerances-text').innerText === ''")
    assert plot.bounding_box()["height"] == 0


def test_a_knock_is_drawn_and_goes_with_the_point(visit_design):
    one = visit_design("?x=speed=700.0:1500.0&y=torque=90.0:300.0&speed=1300&torque=250")
    one.page.wait_for_selector(".verdict[data-stage=complete]")
    plot = one.page.locator("#knock .plot")
    assert plot.bounding_box()["height"] == 0
    one.page.click("[data-press=knock]")
    first = one.page.wait_for_selector("#knock-text p").inner_text()
    assert first.startswith("The least knock that leads to a motion to avoid is ")
    one.page.wait_for_function("document.querySelector('#knock .plot').offsetHeight > 100")
    sync_api.expect(one.page.locator("[data-press=knock]")).to_have_attribute("aria-pressed", "false")
    one.after(lambda: one.type("torque", "240"))
    one.page.wait_for_function("document.getElementById('knock-text').innerText === ''")
    assert plot.bounding_box()["height"] == 0
