"""The explorer of a gear design in a browser: units, sliders, links, files, pixels."""

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.explorer.view.presets import presets
from gearchaos.explorer.view.state import view_of
from gearchaos.studyfile import load_design, load_study
from tests.slow.browser import DESIGN, NEEDED, SIZES, Visit, visits
from tests.slow.test_explorer_pixels import picture

pytest.importorskip("playwright.sync_api")
pytestmark = NEEDED
FIRST = view_of(load_study(DESIGN).model)
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

CALM = "?x=speed=400.0:500.0&y=torque=200.0:250.0&speed=450&torque=220"
"""A plane of one periodic motion, whose map is soon complete."""


@pytest.fixture
def visit_design(chromium, design_server):
    """Opens a page of that server; whatever goes wrong on it fails the test."""
    with visits(chromium, design_server, first=FIRST) as begin:
        yield begin


@pytest.mark.parametrize("size", SIZES)
def test_axes_have_units_no_menu_is_cut_and_no_panel_is_empty_at_every_size(visit_design, size):
    page = visit_design(size=size).page
    page.wait_for_selector("[data-stride]", state="attached")
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
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


def test_a_group_of_fields_stays_open_or_folded_when_the_form_changes(visit_design):
    one = visit_design(CALM)
    assert one.page.locator(".folded").get_attribute("open") is None
    one.page.click(".folded summary")
    one.after(lambda: one.choose("kind", "single: relative motion (2.17)"))
    one.page.wait_for_selector(".field-z")
    assert one.page.locator(".folded").get_attribute("open") is not None
    one.after(lambda: one.choose("preset", presets()["4"].name))
    one.page.wait_for_selector(".folded", state="detached")
    one.after(lambda: one.choose("preset", "the gears loaded"))
    one.page.wait_for_selector(".field-speed")
    assert one.page.locator(".folded").get_attribute("open") is not None
    one.page.click(".folded summary")
    one.after(lambda: one.choose("kind", "single: relative motion (2.17)"))
    one.page.wait_for_selector(".field-z", state="attached")
    assert one.page.locator(".folded").get_attribute("open") is None


def test_sliders_of_gears_change_the_map_and_the_verdict(visit_design):
    one = visit_design(CALM)
    one.page.wait_for_selector("#legend [data-share='1.0000']", state="attached")
    before = one.label(), one.page.locator(".verdict").inner_text()
    for name, value in (("speed", "480"), ("torque", "230"), ("backlash", "60"), ("zeta", "0.08"), ("grade", "12")):
        view = one.after(lambda name=name, value=value: one.type(name, value))
        wanted = {"speed": view.at[0], "torque": view.at[1]}.get(name)
        assert (wanted if wanted is not None else one.view.gears) is not None
        one.page.wait_for_selector("#legend [data-share='1.0000']", state="attached")
        assert one.label() == gc.regime(view.point).label
    assert view.at == (480.0, 230.0) and view.gears.damping_ratio == 0.08 and view.gears.quality.grade == 12
    assert view.gears.backlash_line_of_action == pytest.approx(60e-6)
    assert view.point.error.amplitudes[0] > 10 * FIRST.point.error.amplitudes[0]
    assert before != (one.label(), one.page.locator(".verdict").inner_text())
    one.type("grade", "3.5")
    assert "must be a whole number" in one.message()


def test_the_map_of_a_measure_has_its_unit_and_the_colours_of_its_values(visit_design):
    one = visit_design(CALM + "&colour=v_rms")
    one.page.wait_for_selector("#legend [data-share='1.0000']", state="attached")
    assert one.page.locator("#legend").inner_text().startswith("rms of x1' (single, train: z') V_RMS [mm/s]")
    pixels, frame, values = picture(one)
    motion = gc.regime(one.view.model.with_values({"speed": 400.0, "torque": 200.0}))
    scales = one.view.model.gears.at(torque=200.0).to_pair().scales
    assert values[0, 0] == pytest.approx(motion.v_rms * scales.velocity * 1e3, rel=1e-2)
    left, top, width, height = (round(v) for v in frame)
    inside = pixels[top + 5:top + height - 5, left + 5:left + width - 5].reshape(-1, 3)
    assert len(np.unique(inside, axis=0)) > 20  # a level, not one colour


def test_a_link_gives_the_same_page_and_a_wrong_one_a_message(visit_design):
    one = visit_design()
    one.after(lambda: one.type("backlash", "80"))
    one.after(lambda: one.type("grade", "8"))
    one.label()
    query, text = one.page.evaluate("location.search"), one.page.locator(".verdict").inner_text()
    again = visit_design(query)
    again.label()
    assert again.page.evaluate("location.search") == query
    assert again.page.locator(".verdict").inner_text() == text
    assert again.page.locator(".field-grade input[type=text]").input_value() == "8"
    wrong = visit_design("?speed=3000&quality=8")
    assert wrong.message().startswith("The address cannot be shown: parameter must be one of")


def test_an_export_gives_the_point_of_the_design(visit_design, tmp_path):
    one = visit_design()
    view = one.after(lambda: one.type("grade", "9"))
    one.export("copy as TOML")
    one.page.wait_for_selector("#note:has-text('TOML')")
    path = tmp_path / "design.toml"
    path.write_text(one.page.evaluate("navigator.clipboard.readText()"), encoding="utf-8")
    assert load_study(path).model == view.point and load_study(path).model.gears.quality.grade == 9


def test_a_figure_of_the_paper_is_dimensionless_and_the_gears_come_back(visit_design):
    one = visit_design()
    assert one.after(lambda: one.choose("preset", presets()["4"].name)) == presets()["4"].view
    one.page.wait_for_selector(".field-omega")
    assert one.page.evaluate(LABELS, "map") == ["mesh frequency ω [ω₀]", "error amplitude ε₁ [–]"]
    assert one.after(lambda: one.choose("preset", "the gears loaded")).point == FIRST.point


def test_a_notebook_shows_a_design(chromium, kernels):
    shown = gc.explore(load_design(DESIGN))
    one = Visit(chromium, shown.url, first=FIRST)
    assert one.view.point == FIRST.point and "N m" in one.settled().inner_text()
    one.close()
    shown.stop()
