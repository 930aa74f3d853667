"""The explorer as a visitor meets it: the real server, and Debian's chromium by Playwright."""

import subprocess
import tomllib

import pytest
from PIL import Image

import gearchaos as gc
from gearchaos.explorer.core.bounds import value_range
from gearchaos.explorer.core.presets import presets
from gearchaos.explorer.core.state import COLOURS
from tests.commands import ask
from tests.slow.browser import CALM, COMMAND, FEW_CELLS, MAP, NEEDED, SIZES, START

sync_api = pytest.importorskip("playwright.sync_api")
pytestmark = NEEDED
PAGE = "server", f"?{CALM}&at=1.0,0.1"
PLACE = "document.querySelector('main').offsetTop"
DIAGRAM = """() => {
  const view = [...Bokeh.index.roots].find((root) => root.model.name === "line")
  return view.model.renderers[0].data_source.data.image.length > 0
}"""
BELOW = """() => {
  const [map, controls] = ["map", "controls"].map((id) => document.getElementById(id).getBoundingClientRect())
  return [controls.height, controls.top - map.bottom]
}"""
"""The height of the parameters, and how far below the map they are, both at one instant."""


@pytest.mark.parametrize("size", SIZES)
def test_the_page_loads_at_every_size_nothing_is_wider_than_it_and_numbers_can_be_read_whole(visit, size):
    one = visit(f"?{MAP}&at=0.9742702675,0.206&zeta=0.0249231594", size)
    page = one.page
    page.wait_for_selector("[data-stride]", state="attached")
    assert one.is_as_wide_as_the_screen()
    if size == "phone":  # folded away, right after the map
        height, distance = page.evaluate(BELOW)
        assert height < 60 and 0 < distance < 20
        page.click("#controls summary")
    page.click("[data-basins]")
    page.wait_for_selector("#basin-legend .entry")
    for name in ("map", "motion", "controls", "line", "basin"):
        box = page.locator(f"#{name}").bounding_box()
        assert box["width"] > 200 and box["height"] > 100
    assert page.locator("header").bounding_box()["height"] < (100 if size == "phone" else 60)
    assert page.locator("canvas").count() >= 7
    assert page.locator("#assessment").count() == page.locator("#tolerances").count() == 0  # there are no gears
    assert page.locator("#export button:has-text('assessment')").count() == 0
    page.locator("#controls").evaluate("fold => { fold.open = true }")
    assert page.locator(".field-omega input[type=text]").input_value() == "0.97427027"
    clipped = "fields => fields.filter((f) => f.scrollWidth > f.clientWidth).map((f) => f.value)"
    assert page.locator(".field input[type=text]").evaluate_all(clipped) == []


def test_sliders_and_numbers_change_the_motion(one):
    for name, value in (("omega", "1.1"), ("omega", "1"), ("eps1", "0.206")):
        view = one.after(lambda name=name, value=value: one.type(name, value))
    assert view.at == (1.0, 0.206) and one.label() == "8T"
    view = one.after(lambda: one.type("eps1", "0.05"))
    assert view.at == (1.0, 0.05) and one.label() == "1T"
    box = one.page.locator(".field-omega input[type=range]").bounding_box()
    view = one.after(lambda: one.page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + box["height"] / 2))
    assert view.at[0] == pytest.approx(sum(value_range("omega")[:2]) / 2, abs=0.02)
    view = one.after(lambda: one.type("zeta", "0.08"))
    assert view.model.zeta == 0.08


def test_keys_move_the_point_but_not_while_typing(one):
    one.after(lambda: one.type("omega", "1.01"))
    one.page.locator("h1").click()  # nothing has the focus
    before, step = one.view, START.x.count // FEW_CELLS[0]  # a cell of the server's map has several of START's
    assert one.after(lambda: one.page.keyboard.press("ArrowRight")).at == before.stepped(step, 0).at
    assert one.after(lambda: one.page.keyboard.press("Shift+ArrowUp")).at[1] > before.at[1]
    here = one.view
    one.page.locator(".field-q0 input[type=text]").focus()
    one.page.keyboard.press("ArrowLeft")
    one.page.locator("h1").click()
    there = one.after(lambda: one.page.keyboard.press("ArrowUp"))  # requests are answered in their order
    assert there.at == (here.at[0], pytest.approx(here.stepped(0, step).at[1], abs=2e-5))  # the digits that a cell has


def test_zoom_recomputes_what_is_in_view(one):
    here, before = one.view.at, one.view.x
    one.page.mouse.move(*one.spot(0.5, 0.5))
    view = one.after(lambda: one.page.mouse.wheel(0, -600))
    assert view.x.stop - view.x.start < 0.9 * (before.stop - before.start) and view.at == here
    one.page.wait_for_selector(".busy:has-text('map')")
    one.page.wait_for_selector("[data-stride='4'], [data-stride='2'], [data-stride='1']", state="attached")


def test_what_is_copied_is_what_is_shown(one):
    zeta = 0.03 if one.view.model.zeta != 0.03 else 0.04
    one.after(lambda: one.type("zeta", str(zeta)))
    assert tomllib.loads(one.copied("TOML"))["model"]["zeta"] == zeta
    names: dict = {}
    exec(one.copied("Python").split("verdict")[0], names)
    assert names["model"] == one.view.point and not one.page.locator("nav").is_visible()


def is_picture(path):
    with Image.open(path) as picture:
        return min(picture.size) > 400 and len(picture.convert("RGB").getcolors(10**7)) > 20


def test_downloads(one, tmp_path):
    one.page.wait_for_selector("[data-stride]", state="attached")
    for kind, study in (("map", "zones"), ("motion", "simulate")):
        assert is_picture(one.saved(f"{kind} PNG", tmp_path))
        assert one.saved(f"{kind} SVG", tmp_path).read_bytes().startswith(b"<?xml")
        assert gc.load(one.saved(f"{kind} data", tmp_path)).attrs["study"] == study
    assert one.page.locator(".error").count() == 0


def test_absurd_numbers_in_every_field_are_messages_and_change_nothing(one):
    if one.view.model.kind != "full":
        one.after(lambda: one.choose("kind", "full: elastic supports (2.12)"))
    one.page.wait_for_selector(".field-y1")
    here, fields = one.view, one.page.locator(".field input[type=text]")
    assert fields.count() >= 18
    place = one.page.evaluate(PLACE)
    for i in range(fields.count()):
        value = fields.nth(i).input_value()
        for absurd in (("abc", "1e400", "-1e300", "nan")[i % 4], *(["abc"] if i < 3 else [])):
            fields.nth(i).fill(absurd)
            fields.nth(i).press("Enter")
            assert "must" in one.message() and one.page.evaluate(PLACE) == place  # else the next click would miss
            sync_api.expect(fields.nth(i)).to_have_value(value)
    assert one.view == here
    one.after(lambda: one.type("eps1", "0.055"))
    assert one.page.locator(".error").count() == 0


def test_presets_kinds_stiffness_axes_and_colours(one):
    assert one.after(lambda: one.choose("preset", presets()["13b"].name)) == presets()["13b"].view
    assert one.label() == "quasi-periodic"
    text = one.page.locator(".spectral").inner_text()
    assert "points alone: chaotic." in text and "the verdict rests on the Lyapunov exponents" in text
    assert one.page.locator("[data-press=follow]").is_disabled()
    assert "this one is quasi-periodic" in one.page.locator(".follow").get_attribute("title")
    assert one.after(lambda: one.choose("kind", "torsional: rigid supports")).model.kind == "torsional"
    assert one.after(lambda: one.choose("stiffness", "harmonics")).model.stiffness.amplitudes == (0.25,)
    one.page.wait_for_selector(".field-c1")
    assert one.after(lambda: one.choose("y", "q₀  torque")).y.name == "q0"
    for colour in ("v_rms", "contact_fraction", "dynamic_factor", "attractors", "motion"):
        assert one.after(lambda colour=colour: one.choose("colour", COLOURS[colour])).colour == colour
    assert one.after(lambda: one.choose("line", "vertical line")).line == "y"
    query = one.page.evaluate("location.search")
    one.page.reload()
    one.settled()
    assert one.page.evaluate("location.search") == query  # which restores the page
    assert one.page.locator(".field-zeta input[type=text]").input_value() == f"{one.view.model.zeta:g}"


@pytest.mark.parametrize("kind", ["torsional", "full"])
def test_a_click_shows_the_verdict_of_regime_and_none_gets_lost_however_soon_or_slow(visit, kind):
    one = visit(f"?kind={kind}&{MAP}&at=2.9,0.01")
    view = one.after(lambda: one.page.mouse.click(*one.spot(0.55, 0.6)))
    assert view.at == pytest.approx((0.2 + 0.55 * 2.8, 0.6 * 0.3), abs=0.2)
    assert one.label() == gc.regime(view.point).label
    for point in ((0.3, 0.3), (0.7, 0.4)):
        one.page.mouse.click(*one.spot(*point))
    one.page.wait_for_function("Number(new URLSearchParams(location.search).get('at').split(',')[0]) > 1.8")
    one.page.mouse.move(*one.spot(0.2, 0.8))
    one.page.mouse.down()
    one.page.wait_for_timeout(600)  # a press
    view = one.after(one.page.mouse.up)
    assert view.at[0] < 1.2 and one.label() == gc.regime(view.point).label


def test_other_motions_basins_and_the_diagram(one):
    if one.view != presets()["4"].view:
        one.after(lambda: one.choose("preset", presets()["4"].name))
    one.page.wait_for_selector("#others button:has-text('3T')").click()
    one.page.wait_for_selector(".verdict[data-label='3T'][data-final='1']")
    one.page.wait_for_function("location.search.includes('start=')")  # the address follows
    assert gc.regime(one.view.point).label == "3T" and one.view.initial
    one.page.click("button:has-text('basins of this point')")
    one.page.wait_for_selector("#basin-legend .entry")
    one.page.wait_for_function(DIAGRAM)
    box = one.page.locator("#line .plot").bounding_box()
    view = one.after(lambda: one.page.locator("#line .plot").click(position={"x": box["width"] / 2, "y": 100}))
    assert view.at[0] != 2.3 and view.at[1] == 0.05 and view.initial == ()


def test_the_preset_of_basins_computes_them_and_stays_chosen(one):
    one.after(lambda: one.choose("preset", presets()["3c"].name))
    one.page.wait_for_selector("#basin-legend .entry")
    chosen = one.page.locator("select[name=select-preset]")
    sync_api.expect(chosen).to_have_value("3c")
    one.after(lambda: one.page.mouse.click(*one.spot(0.6, 0.6)))
    sync_api.expect(chosen).to_have_value("3c")
    one.after(lambda: one.type("zeta", "0.06"))
    sync_api.expect(chosen).to_have_value("")


def test_an_absurd_address_is_a_message_on_a_page_that_works_and_disturbs_no_other_tab(one, visit):
    there, two = one.view, visit("?%00=1")
    assert "The address cannot be shown" in two.message() and two.label() == gc.regime(START.point).label
    two.after(lambda: two.page.mouse.click(*two.spot(0.6, 0.6)))
    assert two.label() == gc.regime(two.view.point).label and one.view == there
    label = one.settled().get_attribute("data-label")
    two.after(lambda: two.type("zeta", "0.09"))
    assert one.view == there and one.settled().get_attribute("data-label") == label
    assert one.after(lambda: one.type("zeta", "0.07")).model.zeta == 0.07 and two.view.model.zeta == 0.09


BAD_ARGUMENTS = (("--port", "99999"), ("--axis", "omega=1:2:3"), ("--set", "eps9=0.1"), ("--set", "omega=1000"))


@pytest.mark.parametrize("arguments", BAD_ARGUMENTS)
def test_bad_arguments_of_the_command_are_one_line(no_waiting, arguments):
    done = ask("explore", "--no-open", *arguments, code=2)
    assert done.stderr.startswith("starting the explorer …\n"), done.stderr
    assert done.stderr.splitlines()[-1].startswith("error: ")


def test_the_command_itself_ends_with_that_line():
    done = subprocess.run((*COMMAND[:-2], *BAD_ARGUMENTS[-1]), capture_output=True, text=True, timeout=120)
    assert done.returncode == 2, done.stderr
    assert done.stderr.splitlines()[-1].startswith("error: ") and "Traceback" not in done.stderr
