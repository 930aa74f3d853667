"""Cards of notebooks: what is on them, and that they load nothing and escape every text."""

import base64
import io
import re
from dataclasses import replace
from functools import cache
from xml.etree import ElementTree

import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_rgb
from matplotlib.image import imread

import gearchaos as gc
from gearchaos.cards import Card
from gearchaos.cards.card import HEIGHT, MOST_POINTS, WIDTH, Drawing, around
from gearchaos.continuation.saddles import EdgeState
from gearchaos.errors import InputError
from tests.contracts.plot.test_pictures import diagram, starts, zones_map

SINGLE = gc.MeshModel.of(kind="single", zeta=0.025, omega=0.8, q0=0.1, eps1=0.1)
DESIGN = gc.GearDesign(
    teeth=(50, 50), module="3 mm", face_width="20 mm", centre_distance="150 mm", bore="30 mm", damping_ratio=0.05,
    backlash={"value": "0.12 mm", "of": "line of action"}, quality={"standard": "ISO 1328-1:1995", "grade": 6},
    transmission_error="none")


MAKE = {
    "model": lambda: SINGLE, "full": lambda: gc.MeshModel.of(kind="full", kappa=0.7, c1=0.2, eps1=0.1),
    "operating": lambda: gc.Zones(DESIGN.at(speed="3000 rpm", torque=100), "omega=1:2:3", "eps1=0:0.1:3").model,
    "design": lambda: DESIGN, "pair": lambda: DESIGN.at(speed="3000 rpm", torque=100).to_pair(),
    "verdict": lambda: gc.regime(SINGLE), "orbit": lambda: gc.orbit(SINGLE, period=1),
    "edge": lambda: EdgeState(made("orbit"), made("orbit").points),
    "study": lambda: gc.Zones(SINGLE, "omega=0.6:1:4", "eps1=0:0.2:3", refine=2), "regime": lambda: gc.Regime(SINGLE),
    "no orbit": lambda: EdgeState(None, made("orbit").points),
    "zones": lambda: gc.zones(SINGLE, "omega=0.6:1:4", "eps1=0:0.2:3"),
    "bifurcation": lambda: gc.bifurcation(SINGLE, "eps1=0:0.2:4"),
    "without points": lambda: gc.bifurcation(SINGLE, "eps1=0:0.2:4", points=0),
    "basins": lambda: gc.basins(SINGLE, "z=-1:1:4", "z_dot=-1:1:3"),
    "attractors": lambda: gc.attractors(SINGLE, starts=8), "simulate": lambda: gc.simulate(SINGLE, 4, samples=16),
    "section": lambda: gc.simulate(SINGLE, 4), "branch": lambda: gc.branch(SINGLE, "omega=0.78:0.82"),
    "verdict data": lambda: made("verdict").to_dataset()}


@cache
def made(name):
    return MAKE[name]()


@pytest.mark.parametrize("name", MAKE)
def test_a_card_is_well_formed_loads_nothing_and_has_the_colours_of_the_page(name):
    """No colour of text or background is fixed, so that a card is readable on light and dark pages."""
    html = gc.card(made(name)).html
    tree = ElementTree.fromstring(html.replace("&#x27;", "'"))
    tags = {element.tag for element in tree.iter()}
    assert tags <= {"div", "span", "svg", "path", "image"}
    links = [v for element in tree.iter() for k, v in element.items() if k in ("src", "href")]
    assert all(link.startswith("data:image/png;base64,") for link in links) and "url(" not in html
    assert ("svg" in tags) == (name not in ("no orbit", "verdict data"))
    assert "nan" not in "".join(element.get("d", "") for element in tree.iter())
    styles = re.findall(r'style="([^"]*)"', html)
    assert {m for s in styles for m in re.findall(r"(?<![-\w])color:([^;]*)", s)} == {"inherit"}
    backgrounds = {m for s in styles for m in re.findall(r"background:([^;]*)", s)}
    assert backgrounds - {kind.colour for kind in gc.plot.MOTION_CLASSES} == {"transparent"}
    if not isinstance(made(name), xr.Dataset):
        assert made(name)._repr_html_() == html, "what notebooks show"


def test_every_text_is_escaped():
    card = Card("<b>&", [("<i>", '"><script>alert(1)</script>')], colour='"><script>')
    assert "<script" not in card.html and "&lt;b&gt;&amp;" in card.html
    unit = zones_map().assign_attrs(study="<script>alert(1)</script>")
    assert "<script" not in gc.card(unit).html


def test_a_card_says_what_the_value_is():
    verdict = made("verdict")
    card = gc.card(verdict)
    assert card.title == "Verdict: 3T" and dict(card.rows)["because"] == verdict.reason
    assert card.colour == {kind.name: kind.colour for kind in gc.plot.MOTION_CLASSES}["3T"]
    study = dict(gc.card(made("study")).rows)
    assert study["omega"] == "0.6 to 1, 4 values" and study["refine"] == "2" and study["to compute"] == "12 items"
    assert "mesh frequency ω" not in study and study["mesh damping ζ"] == "0.025", "what varies has no value"
    assert dict(gc.card(made("full")).rows)["kappa1"] == "0.7"
    assert dict(gc.card(made("operating")).rows)["operating point"].startswith("3000 rpm, 100 N m")
    shares = dict(gc.card(made("zones")).rows)["motions"]
    assert sum(float(share) for share in re.findall(r"([\d.]+) %", shares)) == pytest.approx(100, abs=1)


@pytest.mark.parametrize(("name", "part"), [
    ("zones", lambda ds: ds.isel(omega=0)), ("zones", lambda ds: ds.isel(omega=slice(0, 0))),
    ("zones", lambda ds: ds[["v_rms"]]), ("basins", lambda ds: ds[["attractor"]]),
    ("basins", lambda ds: ds.isel(z=1)), ("attractors", lambda ds: ds[["attractor_label"]]),
    ("bifurcation", lambda ds: ds.isel(eps1=1)), ("simulate", lambda ds: ds[["contact"]]),
    ("branch", lambda ds: ds[["z_peak_to_peak"]]), ("bifurcation", lambda ds: ds[["section_z"]])])
def test_the_card_of_a_part_of_a_result_says_so_and_has_no_picture(name, part):
    card = gc.card(part(made(name)))
    assert dict(card.rows)["shown"] == "a part of the result" and card.picture == ""


def test_a_motion_that_diverges_is_called_so_and_many_harmonics_are_counted():
    far = gc.simulate(gc.MeshModel.of(eps1=0.1, initial={"x1": 1e9}), 3, samples=8)
    assert dict(gc.card(far).rows)["status"] == "diverged" and "status" not in dict(gc.card(made("section")).rows)
    few, many = (dict(gc.card(gc.MeshModel.of(**{f"eps{j}": -0.1})).rows) for j in (6, 64))
    assert few["transmission error ε"] == "0, 0, 0, 0, 0, -0.1"
    assert many["transmission error ε"] == "64 harmonics of at most 0.1"


def test_values_that_are_no_result_have_no_card():
    for value in (3, xr.Dataset(), None):
        with pytest.raises(InputError, match="value"):
            gc.card(value)


def test_the_cells_of_a_map_have_the_colours_of_the_palette_or_none_with_the_lowest_row_below():
    ds = starts().assign_attrs(study="basins")
    ds["attractor"][0, 0] = -2  # not computed
    coloured, partly = (imread(io.BytesIO(base64.b64decode(re.search(r"base64,([^\"]*)", gc.card(found).picture)[1])))
                        for found in (zones_map().assign_attrs(study="zones"), ds))
    colours = [to_rgb(kind.colour) for kind in gc.plot.MOTION_CLASSES]
    expected = np.array([[5, 6, 3], [0, 1, 4]])  # eps1 0.2: quasi-periodic, chaotic, 4T; below it 1T, 2T, 7T
    assert np.allclose(coloured[..., :3], np.array(colours)[expected], atol=0.01)
    assert partly[1, 0, 3] == 0 and partly[0, 2, 3] == 1, "undecided cells have a colour"


def test_a_line_is_drawn_where_its_points_are_with_few_of_them():
    drawing = Drawing("", (0, 10), (0, 1))
    drawing.line(np.array([0, 5, np.nan, 10]), np.array([0, 1, 0.5, 0.5]))
    (path,) = re.findall(r' d="([^"]*)"', drawing.svg)
    moves = [(kind, float(x), float(y)) for kind, x, y in re.findall(r"([ML])([\d.]+) ([\d.]+)", path)]
    assert [kind for kind, *_ in moves] == ["M", "L", "M"], "interrupted where a value is missing"
    assert moves[0][1] < 5 < WIDTH / 2 == moves[1][1] and moves[0][2] > HEIGHT - 5 and moves[1][2] < 5
    drawing.line(np.linspace(0, 1, 50_000), np.zeros(50_000))
    assert drawing.svg.count("L") <= MOST_POINTS + 1


@pytest.mark.parametrize(("values", "low", "high"), [
    (([0.0, 10.0],), -0.3, 10.3), (([2.0],), 1.0, 3.0), (([np.nan],), 0, 1), (([],), 0, 1)])
def test_the_range_of_a_drawing_contains_all_values(values, low, high):
    assert around(*values) == pytest.approx((low, high))


def test_the_card_of_a_design_says_what_excites_it_and_its_backlash(tmp_path):
    table = tmp_path / "te.csv"
    table.write_text("order,peak [um],phase [deg]\n1,1.5,0\n2,4.25,0\n")
    errors = ("none", "from quality", {"orders": str(table)})
    shown = [dict(gc.card(replace(DESIGN, transmission_error=error)).rows) for error in errors]
    assert [row["transmission error"] for row in shown] == [
        "none: the gears are taken to be exact", "from quality, largest harmonic 10.56 µm",
        "orders of te.csv, peak, largest harmonic 4.25 µm"]
    assert {row["backlash, line of action, total"] for row in shown} == {"0.12 mm"}
    without = replace(DESIGN, transmission_error="from quality", quality=None)
    assert "quality must be given" in dict(gc.card(without).rows)["transmission error"]


def test_the_card_of_a_verdict_of_gears_has_their_speed_and_torque():
    verdict = gc.regime(DESIGN.at(speed="3000 rpm", torque=100))
    rows = dict(gc.card(verdict).rows)
    assert rows["operating point"] == f"torsional, ω = {verdict.model.omega:.6g}, 3000 rpm, 100 N m"
    moved = gc.regime(verdict.model.with_values({"speed": 2500, "torque": 120}))
    assert dict(gc.card(moved).rows)["operating point"].endswith(", 2500 rpm, 120 N m")
    assert dict(gc.card(gc.regime(SINGLE)).rows)["operating point"] == "single, ω = 0.8"


def test_a_design_with_many_teeth_is_drawn_as_discs_and_a_diagram_without_z_has_a_card():
    assert len(gc.card(replace(DESIGN, teeth=(250, 251), centre_distance=None)).html) < 20_000
    assert "<image" in gc.card(diagram().assign_attrs(study="bifurcation")).html
