"""The assessment in the explorer, without a browser: its numbers, of which torque it is, where it is drawn, files."""

import contextvars
import json
import threading
from types import SimpleNamespace

import pytest

import gearchaos as gc
from gearchaos.datasheet.verdict import rows, usable_in_words, verdict, worst
from gearchaos.errors import InputError
from gearchaos.explorer.jobs import export
from gearchaos.explorer.jobs.assessment import assessed
from gearchaos.explorer.jobs.worker import Workers
from gearchaos.explorer.panels.assessment import AssessedLine, assessment_text, places
from gearchaos.explorer.panels.style import Units, empty_figure
from gearchaos.explorer.view.presets import presets
from gearchaos.explorer.view.speed_line import SpeedLine
from gearchaos.explorer.view.state import view_of
from gearchaos.explorer.web.session import Session
from gearchaos.flow import StoppedError, cancel_event
from gearchaos.plot.classes import CONTACT_CLASSES
from gearchaos.studyfile import load_design, load_study
from tests import EXAMPLES
from tests.contracts.explorer.test_computations import Page as Computed
from tests.contracts.explorer.test_computations import Worker

pytestmark = pytest.mark.slow

SPUR = EXAMPLES / "spur_50_50.toml"
FIRST = view_of(load_study(SPUR).model)
VIEW = FIRST.zoomed((786.0, 822.0), (50.0, 150.0)).moved(788.0, 100.0)
LINE = SpeedLine(VIEW)
PAIR = view_of(load_study(EXAMPLES / "physical_pair.toml").model)
TRAIN = view_of(load_study(EXAMPLES / "train_idler.toml").model)
PAPER = presets()["2"].view


@pytest.fixture(scope="module")
def found():
    """The assessment of `LINE`: a range to avoid, in which the history decides, between two usable ones."""
    *shares, last = assessed(LINE)
    assert all(0 <= share <= 1 for share in shares)
    return last


# --- what is assessed ----------------------------------------------------------------------------------------------


def test_the_numbers_are_those_of_assess(found):
    expected = gc.assess(load_design(SPUR), "786:822", 100)
    assert json.dumps(found.document()) == json.dumps(expected.document())
    assert [(round(w.start), round(w.stop), w.depends_on_history) for _, w in found.avoid] == [(791, 808, True)]


@pytest.mark.parametrize(("stiffness", "axis"), [("harmonics", "c1"), ("tooth pairs", "relief")])
def test_a_view_along_a_parameter_of_another_stiffness_is_of_other_gears(stiffness, axis):
    other = PAIR.with_stiffness(stiffness).with_axis("y", axis)
    assert not SpeedLine(PAIR).belongs_to(other) and not SpeedLine(other).belongs_to(PAIR)


def test_the_speeds_are_those_of_the_map_or_of_the_run_up():
    assert LINE.speeds == (786.0, 822.0) and SpeedLine(FIRST).speeds == (300.0, 7500.0)
    assert SpeedLine(VIEW.with_axis("x", "zeta").with_run(start=400.0)).speeds == (400.0, 7500.0)
    swapped = VIEW.with_axis("x", "torque")
    assert (swapped.y.name, SpeedLine(swapped).speeds) == ("speed", (786.0, 822.0))


def test_an_assessment_can_be_stopped():
    stop = threading.Event()

    def stopped():
        cancel_event.set(stop)
        steps = assessed(SpeedLine(FIRST))
        next(steps)
        stop.set()
        with pytest.raises(StoppedError):
            list(steps)

    contextvars.copy_context().run(stopped)


def test_without_load_it_is_refused_in_words():
    unloaded = SpeedLine(PAIR.with_value("torque", 0.0))
    with pytest.raises(InputError, match="torque must be finite and not 0"):
        list(assessed(unloaded))


@pytest.mark.parametrize(("change", "through", "at"), [
    (lambda view: view.with_value("speed", 3000.0), True, 100.0),
    (lambda view: view.zoomed((400.0, 900.0), (20.0, 250.0)), True, 100.0),
    (lambda view: view.with_other_units(), True, 100.0),
    (lambda view: view.with_value("torque", 120.0), False, 100.0),
    (lambda view: view.moved(3000.0, 120.0).moved(900.0, 100.0), True, 100.0),
    (lambda view: view.with_axis("x", "torque"), True, 100.0),
    (lambda view: view.with_axis("x", "zeta"), True, None),
    (lambda view: view.with_axis("y", "zeta"), True, 0.05),
    (lambda view: view.with_axis("y", "zeta").with_value("zeta", 0.08), False, 0.05),
    (lambda view: view.with_axis("y", "zeta").with_value("torque", 120.0), False, None),
    (lambda view: view.with_axis("x", "zeta").with_value("torque", 120.0), False, None),
    (lambda view: view.with_value("zeta", 0.08), False, None), (lambda view: view.with_value("grade", 7), False, None),
    (lambda view: view.with_kind("single"), False, None), (lambda view: PAPER, False, None),
])
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


# --- what a page asks for ------------------------------------------------------------------------------------------


@pytest.fixture
def page():
    """A page that asks for its assessment."""
    one = Computed(VIEW)
    one.computations.ask_assessment()
    return one


def test_it_says_how_far_it_is_and_shows_what_is_found(page, found):
    job, shown = page.branches.jobs["assessment"], page.display.shown
    assert job.function.args == (LINE,) and shown["show_assessment"] == [(LINE, None)]
    assert "assessment" in shown["show_busy"][-1][0]
    job.show(0.42)
    assert "assessment (motions from random states 42 %)" in shown["show_busy"][-1][0]
    job.show(1.0)  # edges are located
    assert "assessment" in shown["show_busy"][-1][0]
    job.show(found)
    job.end(None)
    assert shown["show_assessment"][-1] == (LINE, found) and "clear_assessment" not in shown


def test_a_second_press_cancels_it_and_a_third_asks_anew(page):
    page.computations.ask_assessment()
    assert page.branches.jobs == {} and len(page.display.shown["clear_assessment"]) == 1
    page.computations.ask_assessment()
    assert "assessment" in page.branches.jobs and page.display.shown["show_assessment"][-1] == (LINE, None)


def test_a_refusal_is_a_message_and_ends_the_wait(page):
    page.branches.jobs["assessment"].end("speed must be lower")
    assert page.display.shown["show_message"][-1] == ("assessment: speed must be lower",)
    assert len(page.display.shown["clear_assessment"]) == 1
    one = Computed(PAPER)
    one.computations.ask_assessment()
    assert one.branches.asked == [] and "menu of presets" in one.display.shown["show_message"][-1][0]
    assert len(one.display.shown["clear_assessment"]) == 1


@pytest.mark.parametrize("complete", [False, True])
@pytest.mark.parametrize(("change", "goes"), [
    (lambda view: view.with_value("torque", 120.0), False), (lambda view: view.with_value("speed", 3000.0), False),
    (lambda view: view.with_value("zeta", 0.08), True), (lambda view: PAPER, True),
])
def test_it_stays_with_another_torque_and_goes_with_other_gears(page, found, complete, change, goes):
    if complete:
        page.branches.jobs["assessment"].show(found)
        page.branches.jobs["assessment"].end(None)
    page.move(change(VIEW))
    shown = page.display.shown
    assert ("clear_assessment" in shown) == goes and (page.computations.assessment is found) == (complete and not goes)
    if goes:
        assert "assessment" not in page.branches.jobs
    elif complete:  # for the new point
        assert shown["show_assessment"][-2:] == [(LINE, found)] * 2


def test_of_what_there_is_none_nothing_is_saved(page):
    page.computations.ask_file("assessment", "json")
    assert page.display.shown["show_message"][-1] == ("There is nothing to save yet.",)


# --- shown and saved -----------------------------------------------------------------------------------------------


def test_words_and_rows_are_those_of_the_command(found):
    text = assessment_text(found, LINE, VIEW, Units(VIEW.gears, True))
    (at,) = found.at
    assert [sentence.lower() for sentence in text.sentences[:2]] == [f"{s(found)}.".lower() for s in (verdict, worst)]
    assert text.other == "" and found.tried in text.tried and "dynamic factor 1.75" in text.sentences[2].lower()
    (row,) = rows(at)
    assert text.avoid == [(CONTACT_CLASSES[1].colour, True, [*row[:3], *row[5:]])]  # no room for events at the edges
    assert len(text.headings) == len(text.avoid[0][2])
    assert [words for _, words in text.usable] == usable_in_words(at.usable, found.speeds)
    (window,), middles = at.windows, places(found)
    assert middles[0] == (window.start + window.stop) / 2
    for number, _ in text.usable:
        part = at.usable[number - 1]
        assert part.start < middles[number] < part.stop


def test_another_torque_is_said(found):
    for torque in (120.0, 100.5):
        view = VIEW.with_value("torque", torque)
        other = assessment_text(found, LINE, view, Units(view.gears, True)).other
        assert other.startswith(f"Of the torque 100 N m, not that of the point, {torque:g} N m")


def drawn(found, view):
    """The data of the bars, of the stripes and of the line that are drawn."""
    put = {}
    line = AssessedLine(empty_figure(), lambda model, **attributes: put.setdefault(model.id, {}).update(attributes))
    line.show(found, LINE, view)
    return [put[source.id]["data"] for source in (line.avoided, line.striped, line.scanned)]


def test_bars_over_the_map_are_at_the_ranges_and_their_torque(found):
    ((_, window),) = found.avoid
    start, stop = window.start - window.start_resolution, window.stop + window.stop_resolution
    for view in (VIEW, VIEW.with_value("torque", 120.0)):
        bars, stripes, line = drawn(found, view)
        assert (bars["x0"], bars["x1"], bars["y0"], bars["y1"]) == ([start], [stop], [100.0], [100.0])
        assert stripes == bars and bars["colour"] == [CONTACT_CLASSES[1].colour]
        assert (line["x0"], line["x1"], line["y0"]) == ([786.0], [822.0], [100.0])
    bars, *_ = drawn(found, VIEW.with_axis("x", "torque"))
    assert (bars["y0"], bars["y1"], bars["x0"]) == ([start], [stop], [100.0])
    for view in (VIEW.with_axis("x", "zeta"), VIEW.with_axis("y", "zeta").with_value("torque", 120.0)):
        assert all(not part["x0"] for part in drawn(found, view))


def test_where_the_history_does_not_decide_there_are_no_stripes():
    one = gc.assess(load_design(SPUR), "540:570:8", 100, starts=0)
    assert [window.depends_on_history for _, window in one.avoid] == [False]
    bars, stripes, _ = drawn(one, VIEW)
    assert len(bars["x0"]) == 1 and stripes["x0"] == []


def test_a_range_that_is_chosen_moves_the_point_to_its_middle(found):
    document = SimpleNamespace(add_timeout_callback=lambda *_: None, add_next_tick_callback=lambda call: call())
    session = Session(VIEW.with_value("torque", 120.0), Workers(*(Worker() for _ in range(4))), document, FIRST)
    act = session.page.messages.act
    act("range", 0)
    assert session.page.view.at == (788.0, 120.0)  # nothing is listed
    session.page.show_assessment(LINE, found)
    for number in (-1, 99, "0", None):
        act("range", number)
        assert session.page.view.at == (788.0, 120.0)
    act("range", 0)
    ((_, window),) = found.avoid
    assert session.page.view.at == (pytest.approx((window.start + window.stop) / 2, abs=0.06), 100.0)


def test_the_json_is_that_of_the_command_and_has_the_study_file(found, tmp_path):
    (content, media, name), = export.assessment("json", found, LINE)
    document = json.loads(content)
    (tmp_path / "study.toml").write_text(document.pop("study_file"))
    assert (media, name) == ("application/json", "gearchaos-assessment.json")
    assert document == json.loads(json.dumps(found.document()))
    assert load_study(tmp_path / "study.toml").model.with_values({"speed": 500.0}) == VIEW.model_at({"speed": 500.0})


def test_a_train_has_no_quasi_static_ratio_and_its_json_is_strict():
    view = TRAIN.zoomed((1400.0, 1500.0), (10.0, 30.0))
    one = gc.assess(view.operating_point, "1400:1500:4", starts=0)
    (content, *_), = export.assessment("json", one, SpeedLine(view))
    assert json.loads(content, parse_constant=pytest.fail)["quasi_static_ratio"] == [None]
    text = assessment_text(one, SpeedLine(view), view, Units(view.gears, True))
    assert len(text.sentences) == 2


@pytest.mark.parametrize(("suffix", "first"), [("png", b"\x89PNG"), ("svg", b"<?xml")])
def test_it_is_saved_as_a_picture(found, suffix, first):
    (content, _, name), = export.assessment(suffix, found, LINE)
    assert content.startswith(first) and name == f"gearchaos-assessment.{suffix}"
