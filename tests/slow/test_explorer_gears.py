"""The explorer of a gear design in a browser: units, sizes, sliders, links, files, pixels."""

import re
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.explorer.core.presets import presets
from gearchaos.studyfile import load_design, load_study
from tests.slow.browser import DESIGN, FIRST, NEEDED, SIZES, Visit
from tests.slow.test_explorer_curves import BRANCH, PLACE, follow, near, pixels, show_curves
from tests.slow.test_explorer_pixels import picture

sync_api = pytest.importorskip("playwright.sync_api")
pytestmark = NEEDED
LABELS = """(name) => {
  const view = [...Bokeh.index.roots].find((root) => root.model.name === name)
  return [...view.model.below, ...view.model.left, ...view.model.above].map((axis) => axis.axis_label ?? "")
}"""
CUT = """() => {
  const pen = document.createElement("canvas").getContext("2d")
  const cut = []
  for (const menu of document.querySelectorAll("#axes select")) {
    pen.font = getComputedStyle(menu).font
    for (const option of menu.options)
      if (pen.measureText(option.label).width > menu.clientWidth - 22) cut.push(option.label)  // 22 px for the arrow
  }
  return cut
}"""
"""The options of the menus above the map that are wider than the menu."""

BOXES = """() => Object.fromEntries(["map", "line", "motion", "basin"].map((id) => {
  const {top, bottom, left} = document.getElementById(id).getBoundingClientRect()
  return [id, {top, bottom, left}]
}))"""
OUTSIDE = """() => {
  const pen = document.createElement("canvas").getContext("2d")
  const outside = []
  for (const view of Bokeh.index.roots) {
    if (!view.frame) continue  // hidden
    const {width, height} = view.frame.bbox
    for (const [axes, room] of [[view.model.left, height], [view.model.below, width + 60]])
      for (const axis of axes) {
        pen.font = `${axis.axis_label_text_font_size} system-ui, "DejaVu Sans", sans-serif`
        if (pen.measureText(axis.axis_label ?? "").width > room) outside.push([view.model.name, axis.axis_label])
      }
  }
  return outside
}"""
"""Labels longer than their axis: Bokeh clears only the height of an axis before it draws a vertical label again."""

GEARS = "?x=speed=2800.0:3200.0&y=torque=90.0:110.0&speed=3000&torque=100"
CALM = "?x=speed=400.0:500.0&y=torque=200.0:250.0&speed=450&torque=220"
"""A plane of one periodic motion, whose map is soon complete."""

PAGE = "design_server", CALM


@pytest.mark.parametrize("size", SIZES)
def test_axes_have_units_no_menu_is_cut_and_no_panel_is_empty_at_every_size(visit_design, size):
    one = visit_design(size=size)
    page = one.page
    page.wait_for_selector("[data-stride]", state="attached")
    assert one.is_as_wide_as_the_screen()
    assert page.evaluate(LABELS, "map") == ["speed n₁ [rpm]", "torque M₁ [N m]"]
    page.wait_for_function(f"({LABELS})('line')[0] !== ''")
    assert page.evaluate(LABELS, "line") == ["speed n₁ [rpm]", "displacement z [µm]"]
    assert page.evaluate(LABELS, "force") == ["time [ms]", "mesh force S [N]", "roll angle of wheel 1 [°]"]
    assert page.evaluate(LABELS, "history") == ["time [ms]", "displacement z [µm]"]
    for name in ("phase", "portrait"):
        assert page.evaluate(LABELS, name) == ["displacement z [µm]", "velocity z′ [mm/s]"]
    assert page.evaluate(LABELS, "spectrum") == ["order (1 is 2500 Hz)", "amplitude [mm/s]"]
    text = page.locator(".verdict").inner_text()
    assert all(part in text for part in ("n₁ = 3000 rpm, M₁ = 100 N m", "µm", "mm/s", "2500", "Hz", "1418.9", "[–]"))
    assert page.evaluate(CUT) == [] and page.evaluate(OUTSIDE) == []
    box = page.evaluate(BOXES)
    assert box["basin"]["bottom"] - box["basin"]["top"] < 80  # a button until basins are asked for
    if size != "phone":
        for above, below in (("map", "line"), ("motion", "basin")):
            assert box[above]["left"] == box[below]["left"]
            assert 0 < box[below]["top"] - box[above]["bottom"] < 20
    page.click("[data-basins]")
    page.wait_for_selector("#basin-legend .entry")
    assert page.locator("#basin .plot").bounding_box()["height"] == 300
    page.evaluate("document.getElementById('controls').open = true")
    titles = page.locator("#parameters .field span").all_text_contents()
    assert titles and all(title.endswith("]") for title in titles)


@pytest.mark.parametrize("size", ["laptop", "phone"])
def test_nothing_is_wider_than_the_page_whatever_was_asked_for(visit_design, size):
    one = visit_design("?x=speed=786.0:822.0&y=torque=90.0:110.0&speed=788&torque=100&run=1000.0:2000.0,0.8,up", size)
    page = one.page
    assert page.locator("#run").bounding_box()["height"] < (150 if size == "phone" else 60)
    show_curves(one)
    follow(one)
    for name, text in (("assess", "#assessment-text"), ("tolerances", "#tolerances-text"), ("run", "#run-text")):
        page.click(f"[data-press={name}]")
        page.wait_for_selector(f"{text} *")
    assert one.is_as_wide_as_the_screen()
    outer = page.locator("main").bounding_box()
    for part in ("#skeleton", "#branch", "#assessment .scroll", "#tolerances .plot", "#run", "#run .two"):
        box = page.locator(part).first.bounding_box()
        assert outer["x"] <= box["x"] and box["x"] + box["width"] <= outer["x"] + outer["width"], part
        assert box["height"] > 20, part


def test_a_group_of_fields_stays_open_or_folded_when_the_form_changes(one):
    if one.view.model.kind != "torsional":
        one.after(lambda: one.choose("preset", "the gears loaded"))
    one.page.wait_for_selector(".field-speed")
    assert one.page.locator(".folded").get_attribute("open") is None
    one.page.click(".folded summary")
    one.after(lambda: one.choose("kind", "single: relative motion (2.17)"))
    one.page.wait_for_selector(".field-z")
    assert one.page.locator(".folded").get_attribute("open") is not None
    view = one.after(lambda: one.choose("preset", presets()["4"].name))
    assert view == presets()["4"].view  # a figure of the paper is dimensionless, and the gears come back
    one.page.wait_for_selector(".folded", state="detached")
    one.page.wait_for_selector(".field-omega")
    assert one.page.evaluate(LABELS, "map") == ["mesh frequency ω [ω₀]", "error amplitude ε₁ [–]"]
    assert one.after(lambda: one.choose("preset", "the gears loaded")).point == FIRST.point
    one.page.wait_for_selector(".field-speed")
    assert one.page.locator(".folded").get_attribute("open") is not None
    one.page.click(".folded summary")
    one.after(lambda: one.choose("kind", "single: relative motion (2.17)"))
    one.page.wait_for_selector(".field-z", state="attached")
    assert one.page.locator(".folded").get_attribute("open") is None


def test_sliders_of_gears_change_the_map_and_the_verdict_and_a_link_gives_the_same_page(visit_design):
    one = visit_design(CALM + "&colour=v_rms")
    before = one.page.locator(".verdict").inner_text()
    for name, value in (("speed", "480"), ("torque", "230"), ("backlash", "60"), ("zeta", "0.08"), ("grade", "12")):
        view = one.after(lambda name=name, value=value: one.type(name, value))
        assert one.label() == gc.regime(view.point).label
    assert view.at == (480.0, 230.0) and view.gears.damping_ratio == 0.08 and view.gears.quality.grade == 12
    assert view.gears.backlash_line_of_action == pytest.approx(60e-6)
    assert view.point.error.amplitudes[0] > 10 * FIRST.point.error.amplitudes[0]
    one.page.wait_for_selector("#legend [data-share='1.0000']", state="attached")
    assert one.page.locator("#legend").inner_text().startswith("rms of the velocity V_RMS [mm/s]")
    pixels, frame, values = picture(one)
    motion = gc.regime(view.model.with_values({"speed": 400.0, "torque": 200.0}))
    scales = view.model.gears.at(torque=200.0).to_pair().scales
    assert values[0, 0] == pytest.approx(motion.v_rms * scales.velocity * 1e3, rel=1e-2)
    left, top, width, height = (round(v) for v in frame)
    inside = pixels[top + 5:top + height - 5, left + 5:left + width - 5].reshape(-1, 3)
    assert len(np.unique(inside, axis=0)) > 20  # a level, not one colour
    query, text = one.page.evaluate("location.search"), one.page.locator(".verdict").inner_text()
    assert text != before
    again = visit_design(query)
    again.label()
    assert again.page.evaluate("location.search") == query and again.page.locator(".verdict").inner_text() == text
    assert again.page.locator(".field-grade input[type=text]").input_value() == "12"
    one.type("grade", "3.5")
    assert "must be a whole number" in one.message()


def test_a_branch_is_in_the_units_of_the_page_also_after_these_were_switched(visit_design):
    one = visit_design(GEARS)
    follow(one)
    assert "along n₁ from 2800 to 3200 rpm" in one.page.locator("#branch").inner_text()
    shown, scroll = pixels(one), one.page.evaluate("scrollY")
    motion = gc.regime(one.view.point.with_values({"speed": 3100.0}))
    z = motion.section["z"][0] * one.view.gears.to_pair().scales.length * 1e6
    assert near(shown, one.page.evaluate(PLACE, ["line", 3100.0, z]), BRANCH, scroll)
    one.after(lambda: one.page.click("button:has-text('physical units')"))
    one.page.wait_for_selector(".verdict:has-text('Δω₀')")
    one.page.wait_for_function(f"({LABELS})('line')[1].endsWith('[Δ]')")
    one.page.wait_for_selector("#branch .words")
    one.page.wait_for_selector(".busy.idle")
    place = one.page.evaluate(PLACE, ["line", 3100.0, motion.section["z"][0]])
    assert near(pixels(one), place, BRANCH, one.page.evaluate("scrollY"))


def test_what_is_saved_and_copied_is_in_the_units_of_the_page_and_of_the_same_motion(one, tmp_path):
    one.after(lambda: one.choose("preset", presets()["4"].name))
    one.after(lambda: one.choose("preset", "the gears loaded"))
    one.page.wait_for_selector(".verdict:has-text('mm/s')")
    sync_api.expect(one.page.locator("[data-press=units]")).to_have_attribute("aria-pressed", "true")
    one.page.wait_for_selector("#legend [data-share='1.0000']", state="attached")
    one.settled()
    motion = gc.load(one.saved("motion data", tmp_path)).load()
    assert gc.load(one.saved("map data", tmp_path))["v_rms"].attrs["units"] == "mm/s"
    one.after(lambda: one.page.click("button:has-text('physical units')"))
    one.page.wait_for_selector(".verdict:has-text('Δω₀')")
    assert not one.view.physical and "mm/s" not in one.page.locator(".verdict").inner_text()
    sync_api.expect(one.page.locator("[data-press=units]")).to_have_attribute("aria-pressed", "false")
    plain, scales = gc.load(one.saved("motion data", tmp_path)).load(), one.view.gears.to_pair().scales
    assert motion["z"].values == pytest.approx(plain["z"].values * scales.length * 1e6, rel=1e-12)
    assert motion["tau"].values == pytest.approx(plain["tau"].values * scales.time * 1e3, rel=1e-12)
    assert motion["z"].attrs["units"] == "µm" and one.page.locator(".error").count() == 0
    view, path = one.after(lambda: one.type("grade", "9")), tmp_path / "design.toml"
    path.write_text(one.copied("TOML"), encoding="utf-8")
    assert load_study(path).model == view.point and load_study(path).model.gears.quality.grade == 9


def test_a_notebook_shows_a_design(chromium, kernels):
    shown = gc.explore(load_design(DESIGN))
    source, frame = re.search('src="([^"]+)"', shown._repr_html_())[1], {"Sec-Fetch-Site": "cross-site"}
    assert source.startswith(shown.url) and urlopen(Request(source, headers=frame)).status == 200
    with pytest.raises(HTTPError, match="403"):
        urlopen(Request(shown.url, headers=frame))
    one = Visit(chromium, source, first=FIRST)
    assert one.view.point == FIRST.point and "N m" in one.settled().inner_text()
    one.close()
    shown.stop()
