"""The explorer without a file: its choice, a drawing as a form, two drawings, what is wrong, an assessment, a file."""

import json
import math
import tomllib

import pytest

import gearchaos as gc
from gearchaos.explorer.core.drawing import EXAMPLE, Drawing
from gearchaos.explorer.core.form_inputs import inputs
from gearchaos.explorer.core.opened import Opened, opened
from gearchaos.gears.design.transverse_section import transverse_section
from gearchaos.studyfile import load_study
from tests import EXAMPLES
from tests.slow.browser import NEEDED, SIZES, START, WAIT, Visit
from tests.slow.instant import wait_until

sync_api = pytest.importorskip("playwright.sync_api")
sync_api.expect.set_options(WAIT)
pytestmark = NEEDED
NARROW = {"range.speed": "2000 rpm;2100 rpm", "range.torque": "60 N*m;70 N*m"}  # a map that is soon complete
FOCUS = """([key, number]) => document.activeElement ===
  document.querySelectorAll(`[data-key='${key}'] :is(input, select:not(.unit))`)[number]"""

CURVES = """(name) => {
  const view = [...Bokeh.index.roots].find((root) => root.model.name === name)
  return view.model.renderers.slice(0, 2).map((each) => Array.from(each.data_source.data.y))
}"""


class Page(Visit):
    """A page that need not show a motion."""

    def settled(self):
        return None

    def row(self, key):
        return self.page.locator(f"[data-key='{key}']")

    def fill(self, key, *texts):
        for number, text in enumerate(texts):
            box = self.row(key).locator("input").nth(number)
            box.fill(text)
            box.press("Enter")

    @property
    def drawing(self):
        return opened(self.page.evaluate("location.search"), Opened(START))[0].drawing


@pytest.fixture
def visit(chromium, server):
    """A function that opens a path of a server; whatever goes wrong on its page, or is asked for elsewhere, fails."""
    pages = []

    def begin(path, size="laptop"):
        pages.append(Page(chromium, server + path, size))
        return pages[-1]

    yield begin
    for one in pages:
        one.close()


@pytest.fixture
def example(visit):
    """A page with the example, whose map is soon complete."""
    one = visit("start")
    one.page.click("a:has-text('example')")
    for key, text in NARROW.items():
        one.fill(key, *(part.partition(" ")[0] for part in text.split(";")))
    one.page.wait_for_selector("#sheet svg")
    return one


@pytest.mark.parametrize("size", SIZES)
def test_the_choice_and_the_form_are_no_wider_than_any_screen_and_what_is_needed_is_said(visit, size):
    one = visit("start", size)
    assert one.is_as_wide_as_the_screen() and one.page.locator("h2").count() == 4
    one.page.click("a:has-text('empty form')")
    text = one.page.wait_for_selector("#sheet .state").inner_text()
    assert text == "Needed for the first numbers: teeth, module, face width."
    assert one.is_as_wide_as_the_screen() and one.row("design.pressure_angle").locator("input").get_attribute(
        "placeholder") == "20"
    assert not one.page.locator("#map").is_visible()
    one.page.click("header a")
    one.page.wait_for_selector("h2:has-text('A figure of the paper')")


def test_the_keyboard_alone_draws_a_pair_up_to_its_motion_and_the_address_has_it(visit):
    one = visit("?drawing=")
    one.page.wait_for_selector("#sheet .state")
    wanted = {**EXAMPLE, **NARROW}
    for key, each in inputs().items():
        texts, _ = each.parts(wanted.get(key, ""))
        for number in range(1 + each.reader.both):
            presses = 0
            while not one.page.evaluate(FOCUS, [key, number]):
                one.page.keyboard.press("Tab")
                assert (presses := presses + 1) < 6 + 20 * (key == "design.teeth")
            if number < len(texts):  # of a menu the first letters choose
                one.page.keyboard.type(texts[number])
        if key == "range.torque":  # what follows is folded
            break
    one.page.keyboard.press("Tab")
    one.page.wait_for_selector("#sheet svg")
    one.page.wait_for_selector(".verdict[data-final='1'][data-stage='complete']")
    one.page.wait_for_selector("#legend .entry")
    wait_until(lambda: one.drawing == Drawing.of(wanted.items()))  # the address follows the page
    before = one.page.locator("#sheet table").inner_text()
    one.page.reload()
    one.page.wait_for_selector("#sheet svg")
    assert one.page.locator("#sheet table").inner_text() == before and one.drawing == Drawing.of(wanted.items())


def test_a_wrong_centre_distance_is_understood_from_its_field_and_the_last_right_pair_stays(example):
    one, row = example, example.row("design.centre_distance")
    table = one.page.locator("#sheet table").inner_text()
    one.fill("design.centre_distance", "120")
    sync_api.expect(row.locator(".said")).to_contain_text("must be greater than 122.16")
    assert "the sum of the base radii" in row.locator(".said").inner_text()
    box = row.locator("input")
    assert box.get_attribute("aria-invalid") == "true"
    assert box.get_attribute("aria-describedby") == row.locator(".said").get_attribute("id")
    assert one.page.locator(".wrong").count() == 1 and one.page.locator("#sheet table").inner_text() == table
    one.fill("design.centre_distance", "131.5")
    sync_api.expect(row.locator(".said")).to_be_hidden()
    assert one.page.locator(".wrong, .state").count() == 0 and box.get_attribute("aria-invalid") == "false"


def test_two_drawings_stand_side_by_side_with_words_for_what_changed(example):
    one = example
    one.page.click("[data-press=keep]")
    one.page.wait_for_selector(".changed")
    one.fill("design.tip_relief.start_diameter", "63", "207.5")
    one.fill("design.tip_relief.amount", "8")
    words = one.page.locator(".changed")
    sync_api.expect(words).to_contain_text("tip relief: amount not given → 8 µm")
    row = one.page.locator("#sheet tr:has-text('loaded error') td")
    assert row.count() == 3 and row.nth(2).inner_text().endswith("%")
    sync_api.expect(one.page.locator("#speeds-text")).to_contain_text("; the kept one at most")
    for name in ("deflection", "factors"):
        curves = one.page.evaluate(CURVES, name)
        assert len(curves[0]) == len(curves[1]) > 100 and curves[0] != curves[1]
    top = one.page.locator("#sheet > *").first  # what changed stands first
    assert top.inner_text().startswith("What changed: tip relief: amount")
    wait_until(lambda: one.drawing["design.tip_relief.amount"] == "8 um")
    one.page.reload()
    sync_api.expect(words).to_contain_text("tip relief: amount not given → 8 µm")
    one.page.click("a:has-text('open the kept one')")
    one.page.wait_for_selector("[data-press=keep]:has-text('keep this one')")
    wait_until(lambda: one.drawing == Drawing.of({**EXAMPLE, **NARROW}.items()))


def test_teeth_turn_as_their_geometry_and_the_motion_say_and_step_where_motion_is_not_wanted(example):
    one, button = example, example.page.locator("[data-turn]")
    sync_api.expect(button).to_be_enabled()
    one.page.emulate_media(reduced_motion="reduce")
    sync_api.expect(button).to_contain_text("an eighth")
    design = one.drawing.reading.design.at(speed=2000.0, torque=60.0)
    drawn = transverse_section(design)
    for step in range(1, 4):
        button.click()
        words = one.page.locator("#gap").inner_text()
        now = transverse_section(design, step / 8)
        turns = [float(each.split("(")[1].split()[0]) for each in one.page.locator("#sheet polygon").evaluate_all(
            "all => all.map((each) => each.getAttribute('transform'))")]
        kind, size = words.split()[:2]
        gap = 5e-6 * float(size) * (1 if kind == "gap" else -1)
        axes = [[section.tooth_axis(wheel, section.start + section.phase * section.geometry.base_pitch)
                 for wheel in (0, 1)] for section in (drawn, now)]
        for wheel, turn in enumerate(turns):  # down is up in a picture
            whole = math.tau / design.teeth[wheel]
            expected = axes[0][wheel] - axes[1][wheel] - wheel * gap / (design.geometry.base_diameter[1] / 2)
            assert abs(math.remainder(math.radians(turn) - expected, whole)) < 1e-5
    one.page.emulate_media(reduced_motion="no-preference")
    button.click()
    sync_api.expect(button).to_contain_text("pause")
    before = one.page.locator("#sheet polygon").first.get_attribute("transform")
    wait_until(lambda: one.page.locator("#sheet polygon").first.get_attribute("transform") != before)
    button.click()
    sync_api.expect(button).to_have_attribute("aria-pressed", "false")


def test_the_best_relief_is_found_and_taken(example):
    one, value = example, "#sheet tr:has-text('loaded error') td"
    one.page.click("[data-press=relief]")
    assert "varies least" in one.page.wait_for_selector("#relief p").inner_text()
    one.page.click("#relief a")
    now, kept = (float(one.page.wait_for_selector(f"{value} >> nth={n}").inner_text()) for n in (0, 1))
    assert now < kept and one.drawing["design.tip_relief.amount"].endswith("um")


def test_inches_and_a_study_file_that_gear_reads(visit, tmp_path):
    one = visit("?drawing=")
    one.page.wait_for_selector("#sheet .state")
    one.row("design.module").locator(".unit").select_option("1/in")
    one.row("design.face_width").locator(".unit").select_option("in")
    for key, texts in {"design.teeth": ["24", "40"], "design.module": ["10"], "design.helix_angle": ["15"],
                       "design.face_width": ["0.9"]}.items():
        one.fill(key, *texts)
    one.page.wait_for_selector("#sheet svg")
    sync_api.expect(one.page.locator("#sheet .state")).to_contain_text("bore")
    path = tmp_path / "pair.toml"
    path.write_text(one.copied("TOML"))
    assert tomllib.loads(path.read_text())["design"]["diametral_pitch"] == "10 1/in"
    assert gc.open(path).module == pytest.approx(2.54e-3) and gc.open(path).face_width[0] == pytest.approx(22.86e-3)


def test_an_assessment_of_a_drawing_can_be_stopped_and_saved_as_a_page(example, tmp_path):
    one, button = example, example.page.locator("[data-press=assess]")
    one.page.locator("select[name=select-change]").select_option("none")
    button.click()
    sync_api.expect(button).to_contain_text("stop")
    button.click()
    sync_api.expect(button).to_have_attribute("aria-pressed", "false")
    said = one.page.locator("[data-show=assess-progress]")
    sync_api.expect(said).to_contain_text("assessment stopped at")
    assert one.page.locator("#assessment-text").inner_text() == "" and "nothing of it is known" in said.inner_text()
    button.click()
    one.page.wait_for_selector("#assessment-text p")
    page = one.saved("assessment as a page", tmp_path).read_text()
    assert "23/81" in page and "<script" not in page
    assert one.saved("assessment PDF", tmp_path).read_bytes().startswith(b"%PDF")
    one.page.click("[data-press=changes]")
    one.page.wait_for_selector("#changes-text li")
    one.page.click("[data-press=changes]")
    sync_api.expect(one.page.locator("[data-show=changes-progress]")).to_contain_text("what stands below lacks")
    tried = json.loads(one.saved("changed designs JSON", tmp_path).read_text())["improvements"]
    assert tried[0]["input"] == "tip relief" and len(tried) < 8


def test_a_file_and_a_train_of_the_examples_open_their_pages(visit):
    one = visit("start")
    one.page.set_input_files("#file", EXAMPLES / "spur_50_50.toml")
    one.page.wait_for_selector(".verdict")
    found, _ = opened(one.page.evaluate("location.search"), Opened(START))
    assert found.start.gears == load_study(EXAMPLES / "spur_50_50.toml").gears
    other = visit("start")
    other.page.click("a:has-text('idler')")
    other.page.wait_for_selector(".verdict .meshes")
    assert other.page.locator("#scheme svg").is_visible() and "pump" in other.page.locator("#scheme").inner_text()
    assert "example=train_idler" in other.page.evaluate("location.search")
