"""Styles of pictures: sizes, fonts and backgrounds, hatching, and data beside a picture."""

import itertools
import re

import matplotlib
import numpy as np
import pytest
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text

import gearchaos as gc
from gearchaos import plot
from gearchaos.errors import InputError
from gearchaos.plot.classes import SEVERITY_COLOURS
from gearchaos.plot.theme import BACKGROUND, INK, STROBE, adapt
from tests.branches import EVENT_COLOURS
from tests.colour_vision import VISION, lab, linear
from tests.commands import ask
from tests.contracts.plot.test_pictures import PICTURES, diagram, motion, starts, zones_map


@pytest.fixture(autouse=True)
def _settings_are_restored():
    with matplotlib.rc_context():
        yield


def drawn(draw, **options) -> Figure:
    """A figure with one of the pictures, by name, or what a function draws."""
    figure = Figure(**options)
    FigureCanvasAgg(figure)
    PICTURES.get(draw, draw)(figure.subplots())
    figure.canvas.draw()
    return figure


def contrast(colour: str, other: str) -> float:
    """Contrast ratio of two colours, from 1 to 21 (WCAG 2)."""
    low, high = sorted(float(np.array([0.2126, 0.7152, 0.0722]) @ linear(one)) for one in (colour, other))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("name", sorted(PICTURES.keys() - {"zones", "level", "bifurcation", "basins"}))  # no maps
def test_lines_and_texts_are_visible_on_a_dark_background(name):
    with plot.style("dark"):
        figure = drawn(name)
    background = to_hex(figure.get_facecolor())
    assert max(to_rgb(background)) < 0.2
    texts = [t for t in figure.findobj(Text) if t.get_visible() and t.get_text()]
    lines = [line for line in figure.findobj(Line2D) if line.get_visible() and len(line.get_xdata())]
    assert texts or lines
    for text in texts:
        assert contrast(to_hex(text.get_color()), background) >= 4.5, text.get_text()
    for line in lines:
        thin = line.get_linewidth() < 0.7  # reference lines and grids stay in the background
        assert contrast(to_hex(line.get_color()), background) >= (1.4 if thin else 3), line


@pytest.mark.parametrize("colour", [INK, STROBE, *EVENT_COLOURS, "#2f6db5", "#a96a00", "#1b7a4b", "#c8102e"])
def test_every_colour_of_a_line_is_visible_on_both_backgrounds(colour):
    assert adapt(colour) == colour
    plot.style("dark")
    assert contrast(adapt(colour), adapt(BACKGROUND)) >= 3


@pytest.mark.parametrize("eye", VISION)
def test_kinds_of_motions_and_of_events_stay_apart_in_every_kind_of_colour_vision(eye):
    plot.style("dark")
    for colours in ([kind.colour for kind in plot.MOTION_CLASSES], map(adapt, EVENT_COLOURS),
                    SEVERITY_COLOURS.values()):
        seen = [lab(np.clip(np.array(VISION[eye]) @ linear(colour), 0, 1)) for colour in colours]
        assert min(np.linalg.norm(a - b) for a, b in itertools.combinations(seen, 2)) > 25


def test_colours_of_maps_are_the_same_in_every_style():
    light = plot.zones(zones_map(), Figure().subplots())
    with plot.style("dark"):
        dark = plot.zones(zones_map(), Figure().subplots())
        scale = plot.bifurcation(diagram(), "x1", Figure().subplots()).images[0].cmap
    assert light.images[0].cmap.colors == dark.images[0].cmap.colors
    assert sum(scale(0.0)[:3]) < 0.5 < 2.5 < sum(scale(1.0)[:3]), "no points: the background"


def test_a_style_holds_for_a_block_also_if_it_raises_or_until_the_next_call():
    before = dict(matplotlib.rcParams)
    with pytest.raises(RuntimeError), plot.style("dark", width=100):
        assert matplotlib.rcParams["axes.facecolor"] == "#16181d"
        raise RuntimeError
    assert dict(matplotlib.rcParams) == before
    plot.style("dark")
    plot.style("paper")
    assert matplotlib.rcParams["axes.facecolor"] == "white" and matplotlib.rcParams["text.color"] == "black"
    assert matplotlib.rcParams["font.size"] == 8


@pytest.mark.parametrize(("name", "width", "height", "size"), [
    ("paper", "double", None, (190, 140)), ("paper", 120, 60, (120, 60)), ("paper", None, None, (90, 70)),
    ("slides", "column", None, (90, 70)), ("dark", 50, None, (50, 70)), ("paper", 300, None, (300, 140))])
def test_the_height_that_is_not_given_leaves_room_for_labels_and_fits_on_a_page(name, width, height, size):
    with plot.style(name, width, height):
        assert np.multiply(25.4, matplotlib.rcParams["figure.figsize"]) == pytest.approx(size)


def page_of(file) -> list[float]:
    """The sides of a page of a PDF in mm, which must have embedded fonts."""
    content = file.read_bytes()
    assert b"/FontFile2" in content and b"/Type3" not in content
    box = [float(v) / 72 * 25.4 for v in re.search(rb"/MediaBox \[ *([^\]]*)\]", content)[1].split()]
    assert box[:2] == [0, 0]
    return box[2:]


def test_a_pdf_has_the_size_that_was_asked_for_and_embedded_fonts(tmp_path):
    with plot.style("paper", 120, 60):
        plot.history(motion()).figure.savefig(tmp_path / "a.pdf")
    assert page_of(tmp_path / "a.pdf") == pytest.approx([120, 60], abs=0.02)


@pytest.mark.slow
def test_a_picture_is_saved_with_its_data_in_the_style_in_which_it_was_drawn(tmp_path):
    ds = zones_map().assign_attrs(study="zones")
    with plot.style("paper", width="column"):
        figure = drawn(lambda ax: plot.zones(ds, ax))
    assert plot.save_with_data(figure, tmp_path / "a.pdf") == [tmp_path / "a.pdf", tmp_path / "a.nc"]
    assert page_of(tmp_path / "a.pdf")[0] == pytest.approx(90, abs=0.02)
    xr.testing.assert_identical(gc.load(tmp_path / "a.nc").load()[["label", "period"]], ds[["label", "period"]])
    plot.save_with_data(figure, tmp_path / "a.png")
    assert matplotlib.image.imread(tmp_path / "a.png").shape[1] == pytest.approx(90 / 25.4 * 600, abs=1)
    assert matplotlib.rcParams["pdf.fonttype"] == matplotlib.rcParamsDefault["pdf.fonttype"]


def test_letters_of_an_svg_need_no_font(tmp_path):
    with plot.style("paper"):
        drawn("history").savefig(tmp_path / "a.svg")
    content = (tmp_path / "a.svg").read_text()
    assert "<text" not in content and "<path" in content


@pytest.mark.parametrize(("arguments", "field"), [
    (("papers",), "style"), (("paper", "colum"), "width"), (("paper", -3), "width"), (("paper", None, 0), "height"),
    (("paper", float("nan")), "width"), (("paper", 39.9), "width"), (("paper", None, 39.9), "height"),
    (("paper", 2001), "width")])
def test_a_style_that_does_not_exist_is_refused(arguments, field):
    before = dict(matplotlib.rcParams)
    with pytest.raises(InputError) as error:
        plot.style(*arguments)
    assert error.value.field == field and dict(matplotlib.rcParams) == before


@pytest.mark.parametrize("draw", [
    lambda ax: plot.zones(zones_map(), ax, hatch=True), lambda ax: plot.basins(starts(), ax, points=False, hatch=True),
    lambda ax: plot.level(zones_map().assign(period=zones_map().period), "label", ax, hatch=True)])
def test_a_hatched_map_has_no_colour_and_tells_all_classes_apart(draw):
    figure = drawn(draw, figsize=(4, 3))
    assert np.ptp(np.asarray(figure.canvas.buffer_rgba())[..., :3].astype(int), axis=2).max() == 0, "grey only"
    ax = figure.axes[0]
    legend = [(to_hex(p.get_facecolor()), p.get_hatch() or "") for p in ax.get_legend().get_patches()]
    assert len(set(legend)) == len(legend) > 2
    assert {patch.get_hatch() for patch in ax.patches} == {hatch for _, hatch in legend if hatch}


def test_hatches_lie_on_the_cells_of_their_class():
    ax = plot.zones(zones_map(), Figure().subplots(), hatch=True)
    (double,) = (p for p in ax.patches if p.get_hatch() == "////")  # 2T: the cell at omega 2, eps1 0.1
    assert np.allclose(double.get_path().get_extents().extents, [1.5, 0.05, 2.5, 0.15])


def test_all_nine_kinds_of_motion_look_different_when_hatched():
    from gearchaos.plot.classes import hatched_patch

    looks = {(p.get_facecolor(), p.get_hatch()) for p in (hatched_patch(i, "") for i in range(9))}
    assert len(looks) == len(plot.MOTION_CLASSES) == 9


def test_the_picture_of_a_result_can_be_hatched_where_it_is_a_map_of_classes():
    assert plot.result(zones_map().assign_attrs(study="zones"), hatch=True).axes[0].patches
    with pytest.raises(InputError, match="hatch"):
        plot.result(diagram().assign_attrs(study="bifurcation"), hatch=True)
    with pytest.raises(InputError, match=r"^hatch must be left out for a variable without classes; got 'v_rms'"):
        plot.level(zones_map(), "v_rms", hatch=True)


def test_several_datasets_have_files_by_their_study(tmp_path):
    figure = Figure()
    one, two = figure.subplots(1, 2)
    maps = [zones_map().assign_attrs(study="zones", number=n) for n in (1, 2)]
    plot.zones(maps[0], one)
    plot.level(maps[0], "v_rms", one)  # the same data again
    plot.zones(maps[1], two)
    plot.basins(starts().assign_attrs(study="basins"), one)
    files = plot.save_with_data(figure, tmp_path / "a.png")
    assert [f.name for f in files] == ["a.png", "a-zones-1.nc", "a-zones-2.nc", "a-basins.nc"]
    assert [gc.load(f).attrs["number"] for f in files[1:3]] == [1, 2]


@pytest.mark.parametrize(("shown", "path", "field"), [
    *((lambda: plot.zones(zones_map(), Figure().subplots()), path, "path") for path in ("a.txt", "no/a.png")),
    (lambda: plot.backlash(Figure().subplots()), "a.png", "shown"), (zones_map, "a.png", "shown")])
def test_what_cannot_be_saved_with_data_is_refused_and_leaves_no_file(tmp_path, shown, path, field):
    with pytest.raises(InputError) as error:
        plot.save_with_data(shown(), tmp_path / path)
    assert error.value.field == field and list(tmp_path.iterdir()) == []


def command(folder, *options):
    gc.save(zones_map().assign_attrs(study="zones"), folder / "zones.nc")
    return ask("plot", folder / "zones.nc", *options, "--out", folder / "out.pdf")


@pytest.mark.slow
@pytest.mark.parametrize(("width", "millimetres"), [("column", 90), ("120", 120)])
def test_the_command_draws_in_a_style(tmp_path, width, millimetres):
    assert command(tmp_path, "--style", "paper", "--width", width, "--hatch").exit_code == 0
    assert page_of(tmp_path / "out.pdf")[0] == pytest.approx(millimetres, abs=0.02)
    assert matplotlib.rcParams["font.size"] == matplotlib.rcParamsDefault["font.size"]


@pytest.mark.parametrize(("options", "message"), [
    (["--width", "column"], "--width needs --style"),
    (["--style", "poster"], "style must be one of dark, paper, slides"),
    (["--style", "dark", "--width", "broad"], "width must be column, double or a number of mm; got 'broad'"),
    (["--style", "dark", "--width", "5"], "width must be from 40 to 2000 mm; got 5")])
def test_the_command_refuses_a_style_that_does_not_exist(tmp_path, options, message):
    refused = command(tmp_path, *options)
    assert refused.exit_code == 2 and message in refused.stderr and not (tmp_path / "out.pdf").exists()
