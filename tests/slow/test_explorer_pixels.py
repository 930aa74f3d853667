"""What the map of the explorer looks like: pixels of screenshots, not the state of the page."""

import io

import numpy as np
import pytest
from bokeh.palettes import Viridis256
from PIL import Image

import gearchaos as gc
from gearchaos.explorer.core.state import COLOURS, OF_LOAD_CHANGES
from gearchaos.explorer.features.map.job import COARSE
from gearchaos.plot.classes import CONTACT_CLASSES, MOTION_CLASSES
from tests.slow.browser import NEEDED

pytest.importorskip("playwright.sync_api")
pytestmark = NEEDED
PLANE = "?x=omega=1.9:2.3&y=eps1=0.0:0.1&at=2.2,0.06"
"""Two kinds of motion, with and without loss of contact, and no chaos."""

PAGE = "server", PLANE

GREY = "#bfbfbf"
CLASSES = {"motion": MOTION_CLASSES, "contact": CONTACT_CLASSES}
DATA = """async () => {
  await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))  // it is painted then
  const view = [...Bokeh.index.roots].find((root) => root.model.name === "map")
  const {left, top, width, height} = view.frame.bbox
  const {x, y} = view.el.getBoundingClientRect()
  const image = view.model.renderers[0].data_source.data.image[0]
  const same = window.seen === image
  window.seen = image
  if (same) return {frame: [x + left, y + top, width, height], rows: image.shape[0], text: Array.from(image).join(" ")}
}"""


def picture(one):
    """The pixels of the page (H, W, 3), and the frame and values (rows, columns) of the map that they show."""
    while True:  # until the map has not changed meanwhile
        one.page.evaluate(DATA)
        pixels = np.asarray(Image.open(io.BytesIO(one.page.screenshot())).convert("RGB"), dtype=int)
        if found := one.page.evaluate(DATA):
            return pixels, found["frame"], np.array(found["text"].split(), float).reshape(found["rows"], -1)


def expected(colour, values):
    """The colours (rows, columns, 3) of all cells; of a level from the least to the greatest but one in a hundred."""
    if colour in CLASSES:
        return rgb([c.colour for c in CLASSES[colour]])[values.astype(int)]
    known = values[np.isfinite(values)]
    low, high, shades = known.min(), np.percentile(known, 99), rgb(Viridis256)
    if colour == "attractors":
        low, high = known.min() - 0.5, known.max() + 0.5
        shades = shades[np.linspace(0, 255, int(high - low)).round().astype(int)]
    index = np.clip(np.nan_to_num((values - low) / (high - low)) * len(shades), 0, len(shades) - 1).astype(int)
    return np.where(np.isnan(values)[..., None], rgb([GREY]), shades[index])


def rgb(colours):
    return np.array([tuple(bytes.fromhex(c[1:7])) for c in colours])


def cells(shape):
    """Rows and columns of some cells spread over the map."""
    return (a.ravel() for a in np.mgrid[1 : shape[0] - 1 : shape[0] // 36, 1 : shape[1] - 1 : shape[1] // 48])


def drawn(pixels, frame, row, column, shape):
    """Colours (N, 3) in the middles of cells; the outer ones lie on the frame."""
    left, top, width, height = frame
    x, y = left + column / (shape[1] - 1) * width, top + (1 - row / (shape[0] - 1)) * height
    return pixels[y.astype(int), x.astype(int)]


def looks_right(one, colour):
    """Compare what is drawn with what should be; a level has many colours, the lighter the greater."""
    pixels, frame, values = picture(one)
    row, column = cells(values.shape)
    wanted, found = expected(colour, values), drawn(pixels, frame, row, column, values.shape)
    around = [(r, c) for r in (-1, 0, 1) for c in (-1, 0, 1)]  # a cell is little more than a pixel
    wrong = np.min([abs(wanted[row + r, column + c] - found).max(axis=1) for r, c in around], axis=0) > 3
    assert wrong.mean() < 0.03, f"{wrong.mean():.0%} of the cells drawn in a wrong colour"  # those under the crosshair
    shades = len({tuple(p) for p in found[~wrong]})
    assert shades >= (2 if colour in (*CLASSES, "attractors") else 30)
    if colour not in (*CLASSES, "attractors"):
        order = np.argsort(values[row, column][~wrong], kind="stable")
        light = [group.mean() for group in np.array_split((found[~wrong] @ [0.299, 0.587, 0.114])[order], 8)]
        assert np.all(np.diff(light) > -2) and light[-1] > light[0] + 60


def first_map(one, colour="motion"):
    coarse = "".join(f":not([data-stride='{stride}'])" for stride in COARSE[:-1])
    one.page.wait_for_selector(f"[data-colour={colour}]{coarse}", state="attached")


@pytest.mark.parametrize("colour", ["v_rms", "attractors"])
def test_a_colouring_from_the_address_bar_is_drawn_in_its_colours(visit, colour):
    one = visit(f"{PLANE}&colour={colour}")
    first_map(one, colour)
    looks_right(one, colour)


def test_every_colouring_is_drawn_in_its_colours_whatever_was_shown_before(one):
    first_map(one)
    looks_right(one, "motion")
    order = ("v_rms", "contact", "motion", "contact_fraction", "dynamic_factor", "v_rms", "attractors", "contact",
             "dynamic_factor", "motion")
    assert {*order} == {*COLOURS} - {*OF_LOAD_CHANGES}  # those are of gears
    for colour in order:
        one.after(lambda colour=colour: one.choose("colour", COLOURS[colour]))
        first_map(one, colour)
        looks_right(one, colour)


def said(one, across, up):
    """What stands beside the pointer: words and values."""
    one.page.mouse.move(*one.spot(across, up))
    one.page.wait_for_selector(".bk-tooltip-row-value")
    rows = zip(*(one.page.locator(f".bk-tooltip-row-{part}").all_inner_texts() for part in ("label", "value")),
               strict=True)
    return {name.strip(": "): value for name, value in rows}


def test_what_lies_under_the_pointer_is_said_in_words_and_units(one):
    one.after(lambda: one.choose("colour", COLOURS["v_rms"]))
    first_map(one, "v_rms")
    one.page.wait_for_selector("[data-share='1.0000']", state="attached")
    found = said(one, 0.7, 0.3)
    value, unit = found["rms of the velocity V_RMS"].split()
    model = one.view.moved(float(found["ω"]), float(found["ε₁"])).point
    assert unit == "Δω₀" and float(value) == pytest.approx(gc.regime(model).v_rms, rel=0.02)
    one.after(lambda: one.choose("colour", COLOURS["motion"]))
    first_map(one)
    assert said(one, 0.71, 0.3)["motion"] == gc.regime(model).label


def test_a_ring_and_dotted_lines_to_all_edges_mark_the_point(one):
    first_map(one)
    pixels, (left, top, width, height), _ = picture(one)
    x, y = round(left + 0.75 * width), round(top + 0.4 * height)
    ring = pixels[y - 8 : y + 9, x - 8 : x + 9].sum(axis=2)
    assert (ring < 150).sum() > 40 and (ring > 740).sum() > 20  # black in white
    for along, line in ((width, pixels[y - 2 : y + 3]), (height, pixels[:, x - 2 : x + 3].swapaxes(0, 1))):
        first = round(left if along == width else top)
        dark = (line.max(axis=0) - line.min(axis=0)).max(axis=1)[first : first + round(along)] > 60
        assert all(0.25 < part.mean() < 0.95 for part in np.array_split(dark, 8))
