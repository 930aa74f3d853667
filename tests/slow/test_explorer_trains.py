"""The explorer of a gear train in a browser: the menu of meshes, the table of meshes, what is left out."""

import json

import pytest

from gearchaos.explorer.core.state import view_of
from gearchaos.studyfile import load_study
from tests import EXAMPLES
from tests.slow.browser import NEEDED, SIZES, Visit, served

pytest.importorskip("playwright.sync_api")
pytestmark = NEEDED
TRAIN = str(EXAMPLES / "train_idler.toml")


def test_a_train_opens_with_a_menu_of_its_meshes_and_a_table_of_them(chromium, kernels):
    with served(TRAIN, few=True) as (url, _):
        one = Visit(chromium, url, "phone", view_of(load_study(TRAIN).model))
        page = one.page
        page.wait_for_selector("#legend [data-colour=contact]", state="attached")
        assert page.evaluate("document.documentElement.scrollWidth") == page.viewport_size["width"]
        assert page.locator("select[data-set]").evaluate_all("menus => menus.map(menu => menu.dataset.set)") == [
            "run-way", "x", "y", "colour", "mesh", "skeleton-period", "change", "line"]
        assert one.after(lambda: one.choose("mesh", "idler/pump")).mesh == "idler/pump"
        page.wait_for_selector("#legend :text('of idler/pump')")
        page.wait_for_selector("#verdict :text('The figures of the motion are those of idler/pump')")
        one.after(lambda: page.mouse.click(*one.spot(0.5, 0.6)))
        one.settled()
        rows = page.locator("#verdict .meshes tr").evaluate_all("all => all.map(row => row.innerText.split('\\t'))")
        assert [row[0] for row in rows] == ["mesh", "motor/idler", "idler/pump"] and {*map(len, rows)} == {7}
        mesh = page.locator("#scheme button[data-mesh]").first
        mesh.focus()
        page.keyboard.press("Enter")
        page.wait_for_function("location.search.includes('mesh=motor')")
        page.wait_for_selector("#part:has-text('dynamic factor')")
        assert page.locator("#part").inner_text().startswith("A motor/idler: ") and rows[1][1] in (
            page.locator("#scheme g.mesh").first.get_attribute("data-contact"))
        page.locator("#scheme g[data-part=pump]").click()
        page.wait_for_selector("#part:has-text('3 pump')")
        assert page.locator("#scheme button[aria-pressed=true]").inner_text() == "3"
        page.emulate_media(reduced_motion="reduce")
        page.click("[data-animate]")
        shapes = json.loads(page.locator("[data-shapes]").get_attribute("data-shapes"))
        turned = page.locator("#scheme g[data-part=pump]").get_attribute("transform")
        assert f"rotate({shapes[0]['pump'][0]:g} " in turned
        page.set_viewport_size(dict(zip(("width", "height"), SIZES["desk"], strict=True)))
        page.wait_for_function("document.documentElement.scrollWidth === innerWidth")
        one.close()
