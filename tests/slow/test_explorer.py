"""The explorer as a visitor meets it: the real server, and Debian's chromium by Playwright."""

import subprocess
import tomllib

import pytest
from PIL import Image
from typer.testing import CliRunner

import gearchaos as gc
from gearchaos.cli import app
from gearchaos.datasets import model_json
from gearchaos.explorer.jobs.export import FILES, OF_GEARS
from gearchaos.explorer.view.bounds import value_range
from gearchaos.explorer.view.presets import presets
from gearchaos.explorer.view.state import COLOURS, view_of
from gearchaos.explorer.view.text import to_query
from gearchaos.studyfile import load_study
from tests import EXAMPLES
from tests.slow.browser import CALM, COMMAND, FEW_CELLS, MAP, NEEDED, SIZES, START, Visit, served, visits

sync_api = pytest.importorskip("playwright.sync_api")
pytestmark = NEEDED
PAIR = str(EXAMPLES / "physical_pair.toml")
PLACE = "document.querySelector('main').offsetTop"
DIAGRAM = """() => {
  const view = [...Bokeh.index.roots].find((root) => root.model.name === "line")
  return view.model.renderers[0].data_source.data.image.length > 0
}"""


@pytest.fixture(scope="module")
def pair_server(kernels):
    """The address of a server of a physical pair that other machines can reach, and what it printed."""
    with served(PAIR, "--host", "0.0.0.0", few=True) as (url, printed):
        yield url.replace("0.0.0.0", "127.0.0.1"), printed


@pytest.fixture
def visit_pair(chromium, pair_server):
    """Opens a page of that server; whatever goes wrong on it fails the test."""
    with visits(chromium, pair_server[0], first=view_of(load_study(PAIR).model)) as begin:
        yield begin


@pytest.mark.parametrize("size", SIZES)
def test_the_page_loads_at_every_size_nothing_is_wider_than_it_and_numbers_can_be_read_whole(visit, size):
    page = visit(f"?{MAP}&at=0.9742702675,0.206&zeta=0.0249231594", size).page
    page.wait_for_selector("[data-stride]", state="attached")
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    if size == "phone":  # folded away, right after the map
        above, folded = (page.locator(f"#{name}").bounding_box() for name in ("map", "controls"))
        assert folded["height"] < 60 and 0 < folded["y"] - above["y"] - above["height"] < 20
        page.click("#controls summary")
    page.click("[data-basins]")
    page.wait_for_selector("#basin-legend .entry")
    for name in ("map", "motion", "controls", "line", "basin"):
        box = page.locator(f"#{name}").bounding_box()
        assert box["width"] > 200 and box["height"] > 100
    assert page.locator("header").bounding_box()["height"] < (100 if size == "phone" else 60)
    assert page.locator("canvas").count() >= 7
    page.locator("#controls").evaluate("fold => { fold.open = true }")
    assert page.locator(".field-omega input[type=text]").input_value() == "0.97427027"
    clipped = "fields => fields.filter((f) => f.scrollWidth > f.clientWidth).map((f) => f.value)"
    assert page.locator(".field input[type=text]").evaluate_all(clipped) == []


@pytest.mark.parametrize("kind", ["torsional", "full"])
def test_a_click_shows_the_verdict_of_regime(visit, kind):
    one = visit(f"?kind={kind}&{MAP}&at=2.9,0.01")
    for across, up in ((0.3, 0.7), (0.55, 0.6), (0.1, 0.1)):
        view = one.after(lambda across=across, up=up: one.page.mouse.click(*one.spot(across, up)))
        assert view.at == pytest.approx((0.2 + across * 2.8, up * 0.3), abs=0.2)
        assert one.label() == gc.regime(view.point).label


def test_sliders_and_numbers_change_the_motion(visit):
    one = visit(f"?{CALM}&at=1.0,0.206")
    assert one.label() == "8T"
    view = one.after(lambda: one.type("eps1", "0.05"))
    assert view.at == (1.0, 0.05) and one.label() == "1T"
    box = one.page.locator(".field-omega input[type=range]").bounding_box()
    view = one.after(lambda: one.page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + box["height"] / 2))
    assert view.at[0] == pytest.approx(sum(value_range("omega")[:2]) / 2, abs=0.02)
    view = one.after(lambda: one.type("zeta", "0.08"))
    assert view.model.zeta == 0.08


def test_presets_kinds_stiffness_axes_and_colours(visit):
    one = visit()
    assert one.after(lambda: one.choose("preset", presets()["13b"].name)) == presets()["13b"].view
    assert one.label() == "quasi-periodic"
    assert one.after(lambda: one.choose("kind", "torsional: rigid supports")).model.kind == "torsional"
    assert one.after(lambda: one.choose("stiffness", "harmonics")).model.stiffness.amplitudes == (0.25,)
    one.page.wait_for_selector(".field-c1")
    assert one.after(lambda: one.choose("y", "q₀  torque")).y.name == "q0"
    for colour in ("v_rms", "contact_fraction", "dynamic_factor", "attractors", "motion"):
        assert one.after(lambda colour=colour: one.choose("colour", COLOURS[colour])).colour == colour
    assert one.after(lambda: one.choose("line", "vertical line")).line == "y"


def test_keys_move_the_point_but_not_while_typing(visit):
    one = visit(f"?{CALM}&at=1.0,0.1")
    before, step = one.view, START.x.count // FEW_CELLS[0]  # a cell of the server's map has several of START's
    assert one.after(lambda: one.page.keyboard.press("ArrowRight")).at == before.stepped(step, 0).at
    assert one.after(lambda: one.page.keyboard.press("Shift+ArrowUp")).at[1] > before.at[1]
    here = one.view
    one.page.locator(".field-q0 input[type=text]").focus()
    one.page.keyboard.press("ArrowLeft")
    one.page.wait_for_timeout(300)
    assert one.view == here


def test_zoom_recomputes_what_is_in_view(visit):
    one = visit(f"?{CALM}&at=1.0,0.1")
    one.page.mouse.move(*one.spot(0.5, 0.5))
    view = one.after(lambda: one.page.mouse.wheel(0, -600))
    assert view.x.stop - view.x.start < 0.18 and view.at == (1.0, 0.1)
    one.page.wait_for_selector(".busy:has-text('map')")
    one.page.wait_for_selector("[data-stride='4'], [data-stride='2'], [data-stride='1']", state="attached")


def test_the_address_bar_restores_the_page(visit):
    query = to_query(presets()["13a"].view.with_value("zeta", 0.03))
    one = visit(f"?{query}")
    assert to_query(one.view) == query
    assert one.page.locator(".field-zeta input[type=text]").input_value() == "0.03"
    one.page.reload()
    one.settled()
    assert to_query(one.view) == query


@pytest.mark.parametrize("query", ["eps1=1e400", "%00=1"])
def test_an_absurd_address_is_a_message_on_a_page_that_works(visit, query):
    one = visit(f"?{query}")
    assert "The address cannot be shown" in one.message()
    assert one.label() == gc.regime(START.point).label


def test_absurd_numbers_in_every_field_are_messages_and_change_nothing(visit):
    one = visit(f"?kind=full&{CALM}&at=1.0,0.1")
    here, fields = one.view, one.page.locator(".field input[type=text]")
    assert fields.count() >= 18
    place = one.page.evaluate(PLACE)
    for i in range(fields.count()):
        value = fields.nth(i).input_value()
        fields.nth(i).fill(("abc", "1e400", "-1e300", "nan")[i % 4])
        fields.nth(i).press("Enter")
        assert "must" in one.message() and one.page.evaluate(PLACE) == place  # else the next click would miss
        sync_api.expect(fields.nth(i)).to_have_value(value)
        fields.nth(i).fill("abc")
        fields.nth(i).press("Enter")
        sync_api.expect(fields.nth(i)).to_have_value(value)
    assert one.view == here
    one.after(lambda: one.type("eps1", "0.05"))
    assert one.page.locator(".error").count() == 0


def test_what_is_copied_is_what_is_shown(visit):
    one = visit(f"?{CALM}&at=1.0,0.206&zeta=0.03")
    one.export("copy as TOML")
    one.page.wait_for_selector("#note:has-text('TOML')")
    text = one.page.evaluate("navigator.clipboard.readText()")
    assert tomllib.loads(text)["model"]["zeta"] == 0.03
    one.export("copy as Python")
    one.page.wait_for_selector("#note:has-text('Python')")
    assert not one.page.locator("nav").is_visible()
    names: dict = {}
    exec(one.page.evaluate("navigator.clipboard.readText()").split("verdict")[0], names)
    assert names["model"] == one.view.point


def taken(one, folder, files):
    """What the menu saves under these words, in a folder."""
    one.page.wait_for_selector("[data-stride]", state="attached")
    found = {}
    for words in files:
        with one.page.expect_download() as waiting:
            one.export(words)
        found[words] = folder / waiting.value.suggested_filename
        waiting.value.save_as(found[words])
    assert one.page.locator(".error").count() == 0
    return found


def is_picture(path):
    with Image.open(path) as picture:
        return min(picture.size) > 400 and len(picture.convert("RGB").getcolors(10**7)) > 20


def test_downloads(visit, tmp_path):
    names = [words for name, words in FILES.items() if not name.startswith(OF_GEARS)]
    found = taken(visit(f"?{CALM}&at=1.0,0.206"), tmp_path, names)
    for what, study in (("map", "zones"), ("motion", "simulate")):
        assert is_picture(found[f"{what} PNG"]) and found[f"{what} SVG"].read_bytes().startswith(b"<?xml")
        assert gc.load(found[f"{what} data"]).attrs["study"] == study


def test_downloads_in_physical_units_are_of_the_same_motion(visit_pair, tmp_path):
    one = visit_pair()
    one.after(lambda: one.page.click("button:has-text('physical units')"))
    one.page.wait_for_selector(".verdict:has-text('Δω₀')")
    plain = gc.load(taken(one, tmp_path, ["motion data"])["motion data"]).load()
    one.after(lambda: one.page.click("button:has-text('physical units')"))
    one.page.wait_for_selector(".verdict:has-text('mm/s')")
    found = taken(one, tmp_path, ["motion PNG", "map PNG", "motion data", "map data"])
    motion, scales = gc.load(found["motion data"]), load_study(PAIR).pair.scales
    assert is_picture(found["motion PNG"]) and is_picture(found["map PNG"])
    assert motion["z"].values == pytest.approx(plain["z"].values * scales.length * 1e6, rel=1e-12)
    assert motion["tau"].values == pytest.approx(plain["tau"].values * scales.time * 1e3, rel=1e-12)
    assert motion["z"].attrs["units"] == "µm" and gc.load(found["map data"])["v_rms"].attrs["units"] == "mm/s"


def test_other_motions_basins_and_the_diagram(visit):
    one = visit("?" + to_query(presets()["4"].view))
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


def test_the_preset_of_basins_computes_them_and_stays_chosen(visit):
    one = visit()
    one.after(lambda: one.choose("preset", presets()["3c"].name))
    one.page.wait_for_selector("#basin-legend .entry")
    chosen = one.page.locator("select[name=select-preset]")
    sync_api.expect(chosen).to_have_value("3c")
    one.after(lambda: one.page.mouse.click(*one.spot(0.6, 0.6)))
    sync_api.expect(chosen).to_have_value("3c")
    one.after(lambda: one.type("zeta", "0.06"))
    sync_api.expect(chosen).to_have_value("")


def test_the_spectral_class_says_that_the_verdict_does_not_rest_on_it(visit):
    one = visit("?" + to_query(presets()["13b"].view))
    text = one.page.locator(".spectral").inner_text()
    assert one.label() == "quasi-periodic" and "points alone: chaotic." in text
    assert "the verdict rests on the Lyapunov exponents" in text


def test_two_tabs_do_not_disturb_each_other(visit):
    one, two = visit(f"?{MAP}&at=1.0,0.206"), visit(f"?{MAP}&at=2.9,0.01")
    there = two.view
    one.after(lambda: one.page.mouse.click(*one.spot(0.6, 0.6)))
    assert one.label() == gc.regime(one.view.point).label
    assert two.view == there and two.label() == "1T"
    two.after(lambda: two.type("zeta", "0.06"))
    assert one.view.model.zeta == 0.025


def test_no_click_gets_lost_however_soon_or_slow(visit):
    one = visit(f"?{MAP}&at=1.0,0.206")
    for point in ((0.3, 0.3), (0.7, 0.4)):
        one.page.mouse.click(*one.spot(*point))
    one.page.wait_for_function("Number(new URLSearchParams(location.search).get('at').split(',')[0]) > 1.8")
    one.page.mouse.move(*one.spot(0.2, 0.8))
    one.page.mouse.down()
    one.page.wait_for_timeout(600)
    one.after(one.page.mouse.up)
    assert one.view.at[0] < 1.2


def test_a_study_file_and_its_units(visit_pair, tmp_path):
    one = visit_pair()
    assert one.view.physical and "mm/s" in one.page.locator(".verdict").inner_text()
    one.after(lambda: one.page.click("button:has-text('physical units')"))
    one.page.wait_for_selector(".verdict:has-text('Δω₀')")
    assert not one.view.physical and "mm/s" not in one.page.locator(".verdict").inner_text()
    assert one.page.locator("[data-press=alike]").get_attribute("aria-pressed") == "false"  # J1 is not J2
    one.export("copy as TOML")
    one.page.wait_for_selector("#note:has-text('TOML')")
    path = tmp_path / "pair.toml"
    path.write_text(one.page.evaluate("navigator.clipboard.readText()"), encoding="utf-8")
    assert load_study(path).pair is not None and model_json(load_study(path).model) == model_json(one.view.point)
    preset = presets()["4"]
    assert one.after(lambda: one.choose("preset", preset.name)) == preset.view  # which is dimensionless
    sync_api.expect(one.page.locator("[data-press=units]")).to_have_attribute("aria-pressed", "false")


def test_a_server_that_others_can_reach_prints_a_warning(pair_server):
    _, printed = pair_server
    assert any(line.startswith("warning: ") for line in printed)


def test_the_notebook_shows_the_same_page(chromium):
    shown = gc.explore(gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206))
    assert shown.url in shown._repr_html_()
    one = Visit(chromium, shown.url)
    assert one.label() == "8T"
    one.close()
    shown.stop()


BAD_ARGUMENTS = (
    ("--port", "99999"), ("--axis", "omega=1:2:3"), ("--set", "eps9=0.1"), ("--set", "omega=1000"),
)


@pytest.mark.parametrize("arguments", BAD_ARGUMENTS)
def test_bad_arguments_of_the_command_are_one_line(no_waiting, arguments):
    done = CliRunner().invoke(app, ["explore", "--no-open", *arguments], catch_exceptions=False)
    assert done.exit_code == 2 and done.stderr.startswith("starting the explorer …\n"), done.stderr
    assert done.stderr.splitlines()[-1].startswith("error: ") and "Traceback" not in done.stderr


def test_the_command_itself_ends_with_that_line():
    done = subprocess.run((*COMMAND[:-2], *BAD_ARGUMENTS[-1]), capture_output=True, text=True, timeout=120)
    assert done.returncode == 2, done.stderr
    assert done.stderr.splitlines()[-1].startswith("error: ") and "Traceback" not in done.stderr
