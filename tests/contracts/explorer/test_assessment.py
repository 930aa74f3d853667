"""The assessment in the explorer, without a browser: its numbers, of which torque it is, where it is drawn, files."""

import json
from dataclasses import replace
from html import unescape

import pytest

import gearchaos as gc
from gearchaos.datasheet.assessment import decision, rows, usable_in_words, worst
from gearchaos.datasheet.report import Report
from gearchaos.errors import InputError
from gearchaos.explorer.core.progress import Part, Progress
from gearchaos.explorer.core.style import Units, empty_figure
from gearchaos.explorer.core.text import from_query, to_query
from gearchaos.explorer.features.assessment.job import assessed
from gearchaos.explorer.features.assessment.panel import AssessedLine, assessment_text, places
from gearchaos.explorer.features.assessment.speed_line import SpeedLine
from gearchaos.explorer.features.map.job import successive_maps
from gearchaos.explorer.features.map.panel import MapFigure
from gearchaos.explorer.web import export
from gearchaos.explorer.web.form import plane_menus
from gearchaos.plot._assessment import meaning
from gearchaos.plot.classes import AVOID_CLASSES
from gearchaos.studies.maps.cells_to_avoid import TO_AVOID
from gearchaos.studyfile import load_design, load_study
from tests import ONE_SPRING
from tests.contracts.explorer.test_computations import GEARS, PAIR, PAPER, TRAIN, Put, session

pytestmark = pytest.mark.slow

SPUR = ONE_SPRING
VIEW = GEARS.zoomed((786.0, 822.0), (50.0, 150.0)).moved(788.0, 100.0)
LINE = SpeedLine(VIEW)


@pytest.fixture(scope="module")
def found():
    """The assessment of `LINE`: a range to avoid, to which load changes lead, between two usable ones."""
    *before, last = assessed(LINE)
    (part,) = [each for each in before if isinstance(each, Part)]
    assert all(0 <= each.share <= 1 for each in before if isinstance(each, Progress))
    assert part.lacks == "motions after a reversal of the load"
    assert part.found.at[0].load_change == "" and last.at[0].load_change
    operation = gc.assess(load_design(SPUR), "786:822", 100, load_change=None, knocks=False)
    assert part.found.document()["avoid"] == operation.document()["avoid"]
    return last


def test_the_numbers_are_those_of_assess(found):
    expected = gc.assess(load_design(SPUR), "786:822", 100)
    assert json.dumps(found.document()) == json.dumps(expected.document())
    assert [(round(w.start), round(w.stop), w.operation) for _, w in found.avoid] == [(791, 808, False)]


@pytest.mark.parametrize(("stiffness", "axis"), [("harmonics", "c1"), ("tooth pairs", "relief")])
def test_a_view_along_a_parameter_of_another_stiffness_is_of_other_gears(stiffness, axis):
    other = PAIR.with_stiffness(stiffness).with_axis("y", axis)
    assert not SpeedLine(PAIR).belongs_to(other) and not SpeedLine(other).belongs_to(PAIR)


def test_the_speeds_are_those_of_the_map_or_of_the_run_up():
    assert LINE.speeds == (786.0, 822.0) and SpeedLine(GEARS).speeds == (300.0, 7500.0)
    assert SpeedLine(VIEW.with_axis("x", "zeta").with_run(start=400.0)).speeds == (400.0, 7500.0)
    swapped = VIEW.with_axis("x", "torque")
    assert (swapped.y.name, SpeedLine(swapped).speeds) == ("speed", (786.0, 822.0))


def test_without_load_it_is_refused_in_words():
    unloaded = SpeedLine(PAIR.with_value("torque", 0.0))
    with pytest.raises(InputError, match="torque must be finite and not 0"):
        list(assessed(unloaded))


@pytest.mark.parametrize(("change", "through", "at"), [
    (lambda view: view.with_value("speed", 3000.0), True, 100.0),
    (lambda view: view.zoomed((400.0, 900.0), (20.0, 250.0)), True, 100.0),
    (lambda view: view.with_other_units(), True, 100.0), (lambda view: view.with_value("torque", 120.0), False, 100.0),
    (lambda view: view.moved(3000.0, 120.0).moved(900.0, 100.0), True, 100.0),
    (lambda view: view.with_axis("x", "torque"), True, 100.0), (lambda view: view.with_axis("x", "zeta"), True, None),
    (lambda view: view.with_axis("y", "zeta"), True, 0.05),
    (lambda view: view.with_axis("y", "zeta").with_value("zeta", 0.08), False, 0.05),
    (lambda view: view.with_axis("y", "zeta").with_value("torque", 120.0), False, None),
    (lambda view: view.with_axis("x", "zeta").with_value("torque", 120.0), False, None),
    (lambda view: view.with_value("zeta", 0.08), False, None), (lambda view: view.with_value("grade", 7), False, None),
    (lambda view: view.with_kind("single"), False, None), (lambda view: PAPER, False, None)])
def test_where_an_assessment_belongs(change, through, at):
    view = change(VIEW)
    place = LINE.across(view)
    assert LINE.goes_through(view) == through and (None if place is None else place[1]) == at
    assert LINE.belongs_to(view) == (through or at is not None)


@pytest.mark.parametrize("view", [PAIR, TRAIN])
def test_pairs_and_trains_come_back_to_their_torque(view):
    line, torque = SpeedLine(view), view.at[1]
    away = view.moved(0.8 * view.at[0], 0.7 * torque)
    assert not line.goes_through(away) and line.across(away) == (view.y, torque)
    back = line.moved(away, 1.1 * view.at[0])
    assert line.goes_through(back) and back.at[1] == torque and back.at[0] == pytest.approx(1.1 * view.at[0], rel=1e-3)


def test_words_and_rows_are_those_of_the_command(found):
    text = assessment_text(found, LINE, VIEW, Units(VIEW.gears, True))
    (at,) = found.at
    *said, at_rest = [sentence.lower() for sentence in text.sentences]
    assert said == [f"{sentence}.".lower() for sentence in (*decision(found), worst(found))]
    assert text.other == "" and found.tried in text.tried and "dynamic factor 1.75" in at_rest
    (row,) = rows(at, found.gears)
    assert text.avoid == [(meaning(at.windows[0])[1], True, list(row[:8]))]  # no room for events at the edges
    assert len(text.headings) == len(text.avoid[0][2])
    assert [words for _, words in text.usable] == usable_in_words(at.usable, found.speeds)
    (window,), middles = at.windows, places(found)
    assert middles[0] == (window.start + window.stop) / 2
    for number, _ in text.usable:
        part = at.usable[number - 1]
        assert part.start < middles[number] < part.stop
    for torque in (120.0, 100.5):  # another one is said
        view = VIEW.with_value("torque", torque)
        other = assessment_text(found, LINE, view, Units(view.gears, True)).other
        assert other.startswith(f"Of the torque 100 N m, not that of the point, {torque:g} N m")


def drawn(found, view):
    """The data of the bars, of the stripes and of the line that are drawn."""
    line = AssessedLine(empty_figure(), put := Put())
    line.show(found, LINE, view)
    return [put[source.id]["data"] for source in (line.avoided, line.striped, line.scanned)]


def test_bars_over_the_map_are_at_the_ranges_and_their_torque(found):
    ((_, window),) = found.avoid
    start, stop = window.start - window.start_resolution, window.stop + window.stop_resolution
    for view in (VIEW, VIEW.with_value("torque", 120.0)):
        bars, stripes, line = drawn(found, view)
        assert (bars["x0"], bars["x1"], bars["y0"], bars["y1"]) == ([start], [stop], [100.0], [100.0])
        assert stripes == bars and bars["colour"] == [meaning(window)[1]]
        assert (line["x0"], line["x1"], line["y0"]) == ([786.0], [822.0], [100.0])
    bars, *_ = drawn(found, VIEW.with_axis("x", "torque"))
    assert (bars["y0"], bars["y1"], bars["x0"]) == ([start], [stop], [100.0])
    for view in (VIEW.with_axis("x", "zeta"), VIEW.with_axis("y", "zeta").with_value("torque", 120.0)):
        assert all(not part["x0"] for part in drawn(found, view))
    (at,) = found.at  # stripes are where a load change alone leads
    one = replace(found, at=(replace(at, windows=tuple(replace(each, operation=True) for each in at.windows)),))
    bars, stripes, _ = drawn(one, VIEW)
    assert len(bars["x0"]) == 1 and stripes["x0"] == []


def test_a_range_that_is_chosen_moves_the_point_to_its_middle(found):
    opened, _ = session(VIEW.with_value("torque", 120.0), GEARS)
    page, act = opened.page, opened.page.messages.act
    act("range", 0)
    assert page.view.at == (788.0, 120.0)  # nothing is listed
    page.show_assessment(LINE, found)
    for number in (-1, 99, "0", None):
        act("range", number)
        assert page.view.at == (788.0, 120.0)
    act("range", 0)
    ((_, window),) = found.avoid
    assert page.view.at == (pytest.approx((window.start + window.stop) / 2, abs=0.06), 100.0)


def test_it_is_saved_as_pictures_and_as_the_json_of_the_command_with_the_study_file(found, tmp_path):
    for suffix, begins in (("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF"), ("html", b"<!doctype html>")):
        (content, _, name), = export.assessment("assessment", suffix, Report(found), LINE)
        assert content.startswith(begins) and name == f"gearchaos-assessment.{suffix}"
    (page, media, _), = export.assessment("assessment", "html", Report(found), LINE)
    assert media == "text/html" and decision(found)[0][1:] in unescape(page.decode())
    (content, media, name), = export.assessment("assessment", "json", Report(found), LINE)
    document = json.loads(content)
    (tmp_path / "study.toml").write_text(document.pop("study_file"))
    assert (media, name) == ("application/json", "gearchaos-assessment.json")
    assert document == json.loads(json.dumps(found.document()))
    assert load_study(tmp_path / "study.toml").model.with_values({"speed": 500.0}) == VIEW.model_at({"speed": 500.0})


def test_a_train_has_no_quasi_static_ratio_and_its_json_is_strict():
    view = TRAIN.zoomed((1400.0, 1500.0), (10.0, 30.0))
    one = gc.assess(view.operating_point, "1400:1500:4", starts=0)
    (content, *_), = export.assessment("assessment", "json", Report(one), SpeedLine(view))
    assert json.loads(content, parse_constant=pytest.fail)["quasi_static_ratio"] == [None]
    text = assessment_text(one, SpeedLine(view), view, Units(view.gears, True))
    assert len(text.sentences) == 3 and not any("speed 0" in sentence for sentence in text.sentences)


def test_what_is_looked_at_beside_operation_is_chosen_and_stands_in_the_address():
    opened, _ = session(VIEW, GEARS)
    opened.page.messages.act("set", ["change", "none"])
    view = opened.page.view
    assert view.change == from_query(to_query(view, GEARS), GEARS).change == "none" and view != VIEW
    opened.page.messages.act("set", ["change", "slowly"])
    assert opened.page.view == view
    assert not LINE.belongs_to(view) and view.map_key == VIEW.map_key  # an assessment of another change goes
    for change, words in (("none", "sweeps at 40 speeds"), ("wide", "random states at"), ("loss", "after a loss of")):
        chosen = VIEW.zoomed((800.0, 802.0), (50.0, 150.0)).moved(801.0, 100.0)
        *_, last = assessed(SpeedLine(replace(chosen, change=change)))
        assert words.partition("40")[0] in last.tried and bool(last.at[0].load_change) == (change != "none")


def test_a_map_of_gears_shows_what_load_changes_reach_and_of_which_change():
    view = replace(VIEW, colour="to_avoid")
    loss = replace(view, change="loss")
    assert view.map_key != loss.map_key and view.map_key != VIEW.map_key
    first = next(successive_maps(loss))
    assert json.loads(first.dataset.attrs["settings"])["load_change"] == 0.0
    figure = MapFigure(put := Put())
    figure.show(first, "to_avoid", Units(view.gears, True))
    names = {words for _, words in figure.legend.entries}
    assert names and names <= set(TO_AVOID.values()) and put[figure.mapper.id]["palette"][0] == AVOID_CLASSES[0].colour
    with pytest.raises(InputError, match="colour needs gears"):
        replace(PAPER, colour="to_avoid")
    menus = {menu.name: dict(menu.options) for menu in plane_menus(view, Units(view.gears, True))}
    assert menus["colour"]["to_avoid"].startswith("to avoid, and reached by load changes")
    assert "to_avoid" not in {n: dict(o) for n, _, o in plane_menus(PAPER, Units())}["colour"]
