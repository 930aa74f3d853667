"""The assessment in a browser: its button, its bars over the map, its table, another torque, its file, its width; and
what tolerances do at the point."""

import json

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.explorer.panels.assessment import places
from gearchaos.explorer.view.state import view_of
from gearchaos.plot.classes import CONTACT_CLASSES
from gearchaos.studyfile import load_design, load_study
from tests.slow.browser import DESIGN, NEEDED, Visit, visits
from tests.slow.test_explorer_curves import PLACE, near, pixels

sync_api = pytest.importorskip("playwright.sync_api")
pytestmark = NEEDED
FIRST = view_of(load_study(DESIGN).model)
QUERY = "?x=speed=786.0:822.0&y=torque=90.0:110.0&speed=788&torque=100"
DARK, SEPARATION = "#111111", CONTACT_CLASSES[1].colour


@pytest.fixture(scope="module")
def expected():
    return gc.assess(load_design(DESIGN), "786:822", 100)


@pytest.fixture
def visit_design(chromium, design_server):
    """Opens a page of that server; whatever goes wrong on it fails the test."""
    with visits(chromium, design_server, first=FIRST) as begin:
        yield lambda size="laptop", query=QUERY: begin(query, size)


def assess(one):
    """Press the button, and wait for the answer."""
    one.page.click("[data-press=assess]")
    one.page.wait_for_selector("#assessment-text tr")


def bar(one, speed, torque):
    """Whether the map has the colours of a striped bar at a point: separation, dark stripes, a white outline."""
    shown, scroll = pixels(one), one.page.evaluate("scrollY")
    place = one.page.evaluate(PLACE, ["map", speed, torque])
    return [near(shown, place, colour, scroll, 9) for colour in (SEPARATION, DARK, "#ffffff")]


def test_the_ranges_are_drawn_over_the_map_and_a_range_that_is_clicked_is_where_the_point_goes(visit_design, expected):
    one = visit_design()
    one.page.wait_for_selector("#legend [data-share='1.0000']", state="attached")
    avoided, usable = places(expected)[:2]
    quarter = (avoided + expected.avoid[0][1].start) / 2
    assert not all(bar(one, quarter, 100.0))
    assess(one)
    assert all(bar(one, quarter, 100.0)) and not all(bar(one, usable, 100.0)) and not all(bar(one, quarter, 105.0))
    text = one.page.locator("#assessment-text").inner_text()
    assert "790" in text and "809" in text and "loss of contact" in text and "Usable at 100 N m" in text
    assert one.page.evaluate("(e => e.scrollWidth <= e.clientWidth)(document.querySelector('#assessment .scroll'))")
    rows = one.page.locator("#assessment-text tr[data-range]")
    assert rows.count() == 3 and one.page.locator(".other").count() == 0
    for number, middle in ((0, avoided), (1, usable)):
        view = one.after(lambda number=number: rows.nth(number).click())
        assert view.at == (pytest.approx(middle, abs=0.06), 100.0)


def test_another_torque_is_said_and_another_design_removes_it(visit_design, expected):
    one = visit_design()
    assess(one)
    one.after(lambda: one.type("torque", "95"))
    assert "torque 100 N m, not that of the point, 95 N m" in one.page.wait_for_selector(".other").inner_text()
    quarter = (places(expected)[0] + expected.avoid[0][1].start) / 2
    assert all(bar(one, quarter, 100.0))
    one.after(lambda: one.page.locator("#assessment-text tr[data-range]").first.click())
    one.page.wait_for_selector(".other", state="detached")
    assert one.view.at[1] == 100.0
    one.after(lambda: one.type("zeta", "0.08"))
    one.page.wait_for_function("document.getElementById('assessment-text').innerText === ''")
    assert not all(bar(one, quarter, 100.0))


def test_it_can_be_stopped_and_is_free_again(visit_design):
    one = visit_design(query="?x=speed=300.0:7500.0&y=torque=90.0:110.0&speed=780&torque=100")
    button = one.page.locator("[data-press=assess]")
    button.click()
    one.page.wait_for_selector(".busy:has-text('assessment')")
    sync_api.expect(button).to_have_attribute("aria-pressed", "true")
    assert "stop" in button.inner_text()
    button.click()
    one.page.wait_for_selector(".busy:not(:has-text('assessment'))")
    sync_api.expect(button).to_have_attribute("aria-pressed", "false")
    assert one.page.locator("#assessment-text").inner_text() == ""


def test_the_file_is_what_the_command_prints(visit_design, expected, tmp_path):
    one = visit_design()
    assess(one)
    with one.page.expect_download() as download:
        one.export("assessment JSON")
    download.value.save_as(path := tmp_path / "assessment.json")
    document = json.loads(path.read_text())
    assert document.pop("study_file").count("[design]") == 1
    assert document == json.loads(json.dumps(expected.document()))


@pytest.mark.parametrize("size", ["laptop", "phone"])
def test_nothing_is_wider_than_the_page(visit_design, size):
    one = visit_design(size)
    assess(one)
    assert one.page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    table, outer = one.page.locator("#assessment .scroll").bounding_box(), one.page.locator("#map").bounding_box()
    assert outer["x"] < table["x"] and table["x"] + table["width"] < outer["x"] + outer["width"]


@pytest.mark.parametrize("size", ["laptop", "phone"])
def test_what_tolerances_do_is_said_and_drawn_until_the_point_moves(visit_design, size):
    one = visit_design(size, "?speed=3000&torque=100")
    plot = one.page.locator("#tolerances .plot")
    assert plot.bounding_box()["height"] == 0
    one.page.click("[data-press=tolerances]")
    first = one.page.wait_for_selector("#tolerances-text p").inner_text()
    vary = ["quality.deviations=within the grade", "damping_ratio=0.035:0.065", "backlash=0.084:0.156 mm"]
    found = gc.scatter(load_design(DESIGN), vary, "speed=3000:3000:1", [100], samples=512, indices=False)
    value = float(found.anywhere.sel(outcome="contact loss")[0])
    assert first.startswith(f"100 N m: contact is lost from rest with probability {value:.2f} (")
    sync_api.expect(one.page.locator("[data-press=tolerances]")).to_have_attribute("aria-pressed", "false")
    shown, place, scroll = pixels(one), plot.bounding_box(), one.page.evaluate("scrollY")
    left, top = int(place["x"]), int(place["y"] + scroll)
    inside = shown[top:top + int(place["height"]), left:left + int(place["width"])]
    for each in CONTACT_CLASSES[:3]:
        colour = [int(each.colour[i:i + 2], 16) for i in (1, 3, 5)]
        assert np.sum(np.abs(inside - colour).max(axis=-1) < 3) > 20
    assert one.page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    one.after(lambda: one.page.keyboard.press("ArrowUp"))
    one.page.wait_for_function("document.getElementById('tolerances-text').innerText === ''")
    assert plot.bounding_box()["height"] == 0


def test_a_page_without_gears_has_no_assessment(chromium, server):
    one = Visit(chromium, server)
    assert one.page.locator("#assessment").count() == one.page.locator("#tolerances").count() == 0
    assert one.page.locator("#export button:has-text('assessment')").count() == 0
    one.close()
