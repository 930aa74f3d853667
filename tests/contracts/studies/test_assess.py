"""The decision over speed and torque: command, words, JSON, picture and report, all from one assessment."""

import json
import math
import random
import re
from dataclasses import replace
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

import gearchaos as gc
from gearchaos.cli.avoided import print_avoided
from gearchaos.cli.datasheets import print_answers, print_datasheets
from gearchaos.datasheet.answer import DesignAnswer
from gearchaos.datasheet.assessment import (
    avoided,
    beyond_in_words,
    decision,
    edges,
    headings,
    keep_out,
    knocks_in_words,
    rows,
    usable_in_words,
    worst,
)
from gearchaos.datasheet.printed import _lines, report_pdf
from gearchaos.datasheet.report import Report, differing_inputs, inputs_of, report_html
from gearchaos.errors import InputError
from gearchaos.gears.io.units import measured
from gearchaos.gears.operation.operating import as_model
from gearchaos.plot._assessment import draw_factors
from gearchaos.plot.classes import CONTACT_CLASSES, SEVERITY_COLOURS
from gearchaos.plot.theme import EVENT_COLOURS
from gearchaos.studies.operation.beyond_the_teeth import BEYOND
from gearchaos.studies.operation.factor_context import peak_root_stress
from gearchaos.studies.operation.knocks import Knock
from gearchaos.studies.speeds import speed_windows as windows
from gearchaos.studies.speeds.changed_designs import Changed, assess_changes, assumptions, improvements
from gearchaos.studies.speeds.criteria import Criteria
from gearchaos.studies.speeds.speed_search import SpeedSearch
from gearchaos.studies.speeds.speed_windows import RandomStates, Reached, UsableRange, ends_in_words
from gearchaos.studyfile import load_design, load_study
from tests import EXAMPLES, ONE_SPRING
from tests.commands import ask, run_json

SPUR = ONE_SPRING
SCAN = ("--speed", "500:700:8", "--starts", 0)
WIDTH = 80
STATES = RandomStates(0.359, 0.2431, 0.489, 64, 8)
KNOCK = Knock(500.0, 529.6, 512.34, -41.26, -0.01234, 0.3, 7.777, beyond_the_teeth=False)


def assess(*arguments, code=0):
    return ask("assess", *arguments, code=code)


def of_windows(found, *ranges):
    """The assessment of its first torque alone, with these ranges to avoid."""
    return replace(found, at=(replace(found.at[0], windows=ranges),))


def with_change(found, *ranges):
    """The same where the load may be reversed."""
    one = of_windows(found, *ranges)
    return replace(one, at=(replace(one.at[0], load_change="a reversal of the load"),))


def after_load_change(window, **other):
    """A range to avoid to which a load change alone leads."""
    changes = {"operation": False, "random_states": STATES, "reached": (Reached("load change", 1.0, 2.0),)}
    return replace(window, **{**changes, **other})


@pytest.fixture(scope="module")
def found():
    return gc.assess(load_design(SPUR), "500:700:8", [100, 300], starts=0)


@pytest.fixture(scope="module")
def command(found, tmp_path_factory):
    """What the command prints of it, and the folder with all it writes."""
    folder = tmp_path_factory.mktemp("assess")
    files = [part for n in ("out.html", "pdf.pdf", "plot.svg") for part in (f"--{n.partition('.')[0]}", folder / n)]
    with pytest.MonkeyPatch.context() as patched:  # the command that prints JSON computes it
        patched.setattr("gearchaos.studies.speeds.assess.assess", lambda *_, **__: found)
        return assess(SPUR, *SCAN, "--torque", "100,300", *files).stdout, folder


def test_json_has_the_contracted_keys_and_is_what_python_finds(found):
    document = run_json("assess", SPUR, *SCAN, "--torque", "100,300")
    assert {"avoid", "usable", "assumptions", "knocks", "usable_share_in_operation"} <= document.keys()
    assert {"torque", "from", "to", "cause", "begins_with", "dynamic_factor", "depends_on_history", "root_stress",
            "reached_by", "share_of_load_changes", "severity", "beyond_the_teeth"} <= document["avoid"][0].keys()
    assert document["usable"][0].keys() == {"torque", "from", "to", "margin", "after_load_change"}
    assert document == json.loads(json.dumps(found.document())) and len(document["avoid"]) == 4
    first = document["avoid"][0]
    assert first["reached_by"] == ["rest", "rising speed", "falling speed"] and first["share_of_load_changes"] is None


def test_json_tells_what_load_changes_and_knocks_lead_to(found):
    first, second = found.at[0].windows
    at = replace(found.at[0], windows=(after_load_change(first, contact=BEYOND, beyond_the_teeth=True), second),
                 load_change="a reversal of the load", knocks=(KNOCK, replace(KNOCK, beyond_the_teeth=True)))
    document = replace(found, at=(at,)).document()
    one, other = document["avoid"]
    assert (one["reached_by"], one["share_of_load_changes"], one["severity"], one["beyond_the_teeth"]) == (
        ["load change"], 0.359, BEYOND, True)
    assert (other["severity"], other["beyond_the_teeth"]) == ("contact lost, small", False)
    for part in ("usable", "usable_at_all_torques"):
        ends = {after: [each["from"] for each in document[part] if each["after_load_change"] is after]
                for after in (True, False)}
        assert sorted(ends[True]) == [500, first.stop, second.stop] and sorted(ends[False]) == [500, second.stop]
    assert document["usable_share"] == pytest.approx(
        document["usable_share_in_operation"] - (first.stop - first.start) / 200)
    assert document["knocks"] == [
        {"torque": 100, "from": 500, "to": 529.6, "speed": 512.34, "speed_step": -41.26, "impulse": -0.01234,
         "phase": 0.3, "dynamic_factor": factor, "beyond_the_teeth": factor is None} for factor in (7.777, None)]


def test_what_was_not_looked_for_is_not_said_to_be_usable(found):
    """Neither without a load change nor without states after one."""
    assert all(not at.load_change for at in found.at)
    assert len(decision(found)) == 2 and not any("load" in sentence for sentence in decision(found))
    for part in ("usable", "usable_at_all_torques"):
        assert {each["after_load_change"] for each in found.document()[part]} == {False}


def test_the_first_line_says_what_to_avoid_and_lines_have_80_columns(command, found):
    lines = command[0].splitlines()
    assert lines[0].startswith("at 100 or 300 N m avoid 531 to 587 and 593 to 657 rpm:")
    head = " ".join(" ".join(lines[:6]).split())
    assert ": at worst contact lost, small, largest factor 2.28 at 611 rpm usable at all torques in operation: " in head
    assert ("657 to ≥ 700 rpm (±3.2 %), ≤ 500 to 531 rpm (±3.0 %), 587 to 593 rpm (±0.6 %) and 2 narrower ranges "
            "the largest dynamic factor is 2.28") in head
    assert max(map(len, lines)) <= WIDTH and not any(line.endswith(("≤", "≥")) for line in lines)
    for low, high, margin in re.findall(r"(\d+) to (?:≥ )?(\d+) rpm \(±([\d.]+) %\)", decision(found)[-1]):
        (inside,) = [part for part in found.usable_at_all if part.start <= float(low) < float(high) <= part.stop]
        assert float(margin) == pytest.approx(100 * inside.margin, abs=0.051)


def test_what_a_load_change_adds_has_a_sentence_of_its_own(found):
    first, second = found.at[0].windows
    hard = after_load_change(first, contact="both flanks", hits=True, dynamic_factor=9.0, speed_of_largest=540.0)

    def said(*ranges, change="a reversal of the load", **other):
        return decision(replace(found, at=(replace(found.at[0], windows=ranges, load_change=change, **other),)))

    both = said(hard, second)
    assert both[0] == "at 100 N m avoid 593 to 627 rpm: at worst contact lost, small, largest factor 2.28 at 611 rpm"
    assert both[1] == ("where there may be a reversal of the load, avoid also 531 to 559 rpm: at worst hits both "
                       "flanks, largest factor 9 at 540 rpm")
    assert both[2].startswith("usable in operation: 83.5 % of 500 to 700 rpm: ≤ 500 to 593 rpm (±8.6 %), 627 to ≥ 700")
    assert both[3].startswith("usable also after a load change: 69.8 % of 500 to 700 rpm: 627 to ≥ 700 rpm")
    assert said(hard, second, change="") == [both[0], both[2]]
    *same, usable = said(second)
    assert same[1] == "where there may be a reversal of the load, avoid the same speeds"
    assert usable == both[2].replace("in operation", "in operation and also after a load change")
    worse = replace(second, largest_after_load_change=windows.Peak(600.4, 14.46))
    assert said(worse)[1] == f"{same[1]}; in the ranges before, the factor then reaches 14.5 at 600 rpm"
    assert said(hard, worse)[1] == f"{both[1]}; in the ranges before, the factor then reaches 14.5 at 600 rpm"
    assert of_windows(found, worse).document()["avoid"][0]["largest_after_load_change"] == {
        "speed": 600.4, "dynamic_factor": 14.46}
    inside = after_load_change(hard, start=600.0, stop=620.0)  # of a range at another torque
    assert said(inside, second)[1:2] == same[1:2] != said(replace(inside, stop=630.0), second)[1:2]
    nothing = said(hard)
    assert nothing[0] == ("at 100 N m no speed from 500 to 700 rpm is to be avoided in operation: none was found at "
                          "which the teeth separate")
    wide = found.at[0].dataset.assign_coords(motion=[*found.at[0].dataset.motion.values[:-1], "other"])
    assert said(hard, change="any state of wide ranges is met", dataset=wide)[1].startswith(
        "where any state of wide ranges is met, avoid also 531 to 559 rpm")
    assert said(hard, change="any state of wide ranges is met", dataset=wide)[-1].startswith(
        "usable also from wide states: ")


def test_the_largest_factor_says_where_a_load_change_alone_has_it(found):
    at = found.at[0]
    assert worst(found).startswith("the largest dynamic factor is 2.28 (root")
    factor = at.dataset["dynamic_factor"].copy()
    factor.loc[{"motion": "load change", "speed": at.largest.speed_of_largest}] = 9.0
    one = replace(at, dataset=at.dataset.assign(dynamic_factor=factor))
    assert worst(replace(found, at=(one,))).startswith("the largest dynamic factor (load change) is 9 (root")


def test_many_ranges_are_gathered_in_a_sentence(found):
    """Those that overlap are one, the four widest have names, before rare ones; narrow ones have none."""
    first = found.at[0].windows[0]
    wide = [replace(first, start=start, stop=start + width) for start, width in (
        (500.0, 10.0), (505.0, 10.0), (520.0, 6.0), (530.0, 20.0), (560.0, 20.0), (590.0, 20.0), (620.0, 20.0))]
    narrow = replace(first, start=650.0, stop=656.0)
    rare = after_load_change(first, start=660.0, stop=690.0, random_states=replace(STATES, fraction=0.009))
    assert [w.minor for w in (*wide, narrow, rare)] == [False] * 7 + [True] * 2
    assert not replace(rare, operation=True).minor and not replace(rare, random_states=None).minor
    assert not replace(rare, random_states=replace(STATES, fraction=0.01)).minor

    def named(*ranges):
        return decision(of_windows(found, *ranges))[0].partition(" avoid ")[2].partition(":")[0]

    def met(start, stop):
        return named(replace(wide[0], history=(start, stop)))

    assert met(500.0, 505.0) == "500 to 510 (to 505 by history) rpm"
    assert met(504.0, 510.0) == "500 to 510 (from 504 by history) rpm"
    assert met(502.0, 505.0) == "500 to 510 (502 to 505 by history) rpm"
    assert met(500.0, 510.0) == "500 to 510 (by history) rpm"
    assert named(*wide[:2]) == named(replace(wide[0], history=(500.0, 505.0)), wide[1]) == "500 to 515 rpm"
    assert named(*wide, narrow) == "530 to 550, 560 to 580, 590 to 610 and 620 to 640 rpm and 3 narrower ranges"
    assert named(narrow) == "1 narrow range" and named(*wide[:1], narrow) == "500 to 510 rpm and 1 narrower range"
    alone = decision(with_change(found, replace(rare, from_scan_start=True), narrow))[1]
    assert " avoid also ≤ 660 to 690 (rarely, 0.9 % of load changes) rpm: at worst " in alone
    rarer = replace(rare, start=680.0, stop=695.0, random_states=replace(STATES, fraction=0.002))
    both = decision(with_change(found, *wide[:1], rare, rarer))[1]
    assert " avoid also 660 to 695 (rarely, 0.9 % of load changes) rpm: " in both
    often = after_load_change(rarer)
    assert " avoid also 660 to 695 rpm: " in decision(with_change(found, rare, often))[1]
    many = [after_load_change(each) for each in wide]
    assert decision(with_change(found, *many, rare))[1].partition(" avoid also ")[2].startswith(
        "530 to 550, 560 to 580, 590 to 610 and 620 to 640 rpm and 3 narrower or rarer ranges: ")


def test_the_worst_of_a_sentence_is_what_teeth_bear(found):
    first, second = found.at[0].windows
    nothing = replace(first, contact=BEYOND, dynamic_factor=math.nan, speed_of_largest=math.nan, beyond_the_teeth=True)
    one = decision(of_windows(found, nothing, second))[0]
    assert one == ("at 100 N m avoid 531 to 559 and 593 to 627 rpm: at worst contact lost, small, largest factor 2.28 "
                   "at 611 rpm")
    assert decision(of_windows(found, nothing))[0] == "at 100 N m avoid 531 to 559 rpm: beyond the teeth"
    hard = replace(first, contact="both flanks", hits=True, dynamic_factor=2.1)
    assert ": at worst hits both flanks, largest factor 2.28 at 611 rpm" in decision(of_windows(found, hard, second))[0]


@pytest.mark.parametrize(("changes", "severity"), [
    ({"criterion": windows.FORCE_CRITERION, "contact": "permanent contact", "hits": True}, windows.FORCE_CRITERION),
    ({}, "contact lost, small"), ({"contact": "both flanks"}, "contact lost, small"),
    ({"hits": True}, "contact lost, hits"), ({"hits": True, "contact": "both flanks"}, "hits both flanks"),
    ({"contact": BEYOND}, BEYOND), ({"criterion": windows.FORCE_CRITERION, "contact": BEYOND}, BEYOND)])
def test_what_happens_has_five_degrees_each_in_its_colour(found, changes, severity):
    window = replace(found.at[0].windows[0], **changes)
    assert window.severity == severity == window.cause and severity in windows.SEVERITIES
    one = of_windows(found, window)
    assert rows(one.at[0], one.gears)[0].happens == severity == one.document()["avoid"][0]["severity"]
    ax = gc.plot.assessment(one)
    assert to_hex(ax.collections[0].get_facecolor()[0]) == SEVERITY_COLOURS[severity]
    assert ax.get_legend().get_texts()[0].get_text() == severity
    assert replace(window, meshes=("a/b",)).cause == f"{severity} in a/b" and len(set(SEVERITY_COLOURS.values())) == 5


def test_knocks_are_told_in_words_wherever_ranges_are(found, command, capsys):
    hard = replace(KNOCK, start=640.0, stop=640.0, beyond_the_teeth=True, dynamic_factor=math.nan)
    one = replace(found, at=(replace(found.at[0], knocks=(KNOCK, hard)),))
    first, second = knocks_in_words(one.at[0])
    assert first == ("about 500 to 530 rpm: a knock leads to a motion to avoid, the least at 512 rpm is 41 rpm of "
                     "wheel 1 (0.012 N m s), to a factor of 7.78")
    assert second.startswith("about 640 rpm: a knock") and second.endswith(", to what is beyond the teeth")
    print_avoided(avoided(one.at[0], one.gears, every=False))
    for text in (capsys.readouterr().out, report_html(Report(one)), "\n".join(_lines(Report(one)))):
        assert all(words[1:] in " ".join(text.split()) for words in (first, second))
    assert "a knock leads to" not in command[0]


def test_motions_beyond_the_teeth_are_named_below_the_table_without_a_factor(found, capsys):
    first, second = found.at[0].windows
    some = replace(second, beyond_the_teeth=True)
    alone = replace(first, contact=BEYOND, dynamic_factor=math.nan, speed_of_largest=math.nan, beyond_the_teeth=True)
    one = of_windows(found, alone, some)
    (row, other), words = rows(one.at[0], one.gears), beyond_in_words(one.at[0])
    assert (row.happens, row.factor, row.at, row.root) == (BEYOND, "–", "–", "–") and other.factor == "2.28"
    assert words == (f"{BEYOND}, and without a factor, are some motions in 531 to 559, 593 to 627 rpm: "
                     f"{one.at[0].teeth_bear}")
    assert "1500 N/mm², assumed, or a deflection above 0.75 mm" in words and beyond_in_words(found.at[0]) == ""
    print_avoided(avoided(one.at[0], one.gears, every=False))
    for text in (capsys.readouterr().out, report_html(Report(one))):
        assert words[1:] in " ".join(text.split())
    assert one.document()["beyond_the_teeth"] == [one.at[0].teeth_bear]
    none = replace(one.at[0], dataset=one.at[0].dataset.assign(
        dynamic_factor=math.nan * one.at[0].dataset.dynamic_factor))
    assert worst(replace(found, at=(none,))) == "all motions found are beyond the teeth"
    assert worst(replace(found, at=(none, found.at[1]))).startswith("the largest dynamic factor is 2.25")


def test_minor_ranges_have_a_line_and_rows_only_with_all(found, monkeypatch):
    first, second = found.at[0].windows
    rare = after_load_change(second, random_states=replace(STATES, fraction=0.004))
    one = of_windows(found, first, replace(second, start=592.0, stop=593.0), rare)
    monkeypatch.setattr("gearchaos.studies.speeds.assess.assess", lambda *_, **__: one)
    short, full = (" ".join(assess(SPUR, *SCAN, *more).stdout.split()) for more in ((), ("--all",)))
    line = ("and 2 ranges narrower than 1 % or after fewer than 1 % of load changes: 592 to 593, 593 to 627 (rarely, "
            "0.4 % of load changes) rpm")
    assert line in short and "narrower than" not in full
    alone = of_windows(found, rare).at[0]
    assert avoided(alone, SPUR, every=False).words == [
        "1 range after fewer than 1 % of load changes: 593 to 627 (rarely, 0.4 % of load changes) rpm"]
    shown = {row: f" {row.start} {row.stop} {row.happens} {row.reached} " for row in rows(one.at[0], one.gears)}
    assert [words in short for words in shown.values()] == [True, False, False]
    assert all(words in full for words in shown.values())
    assert [*shown] [0:1] == rows(one.at[0], one.gears, every=False)


@pytest.mark.parametrize(("options", "given"), [
    ((), {"load_change": 1.0, "wide": False, "root_stress": None}), (("--load-change", "none"), {"load_change": None}),
    (("--load-change", "-0.5"), {"load_change": -0.5}), (("--wide",), {"wide": True}),
    (("--root-stress", "400"), {"root_stress": "400 N/mm^2"}), (("--root-stress", "4 MPa"), {"root_stress": "4 MPa"}),
    (("--factor", "2"), {"factor": 2.0})])
def test_the_options_say_what_counts_and_from_where_motions_come(found, monkeypatch, options, given):
    asked = {}
    monkeypatch.setattr("gearchaos.studies.speeds.assess.assess", lambda *_, **options: asked.update(options) or found)
    assess(SPUR, *SCAN, *options)
    assert given.items() <= asked.items()


def test_ranges_to_avoid_are_rounded_outwards_with_their_events(command, found):
    shown = [line.split() for line in command[0].splitlines() if re.match(r" *\d+ +\d+ ", line)]
    assert len(shown) == len(found.avoid) == 4
    for row, (torque, window) in zip(shown, found.avoid, strict=True):
        assert float(row[0]) <= window.start < float(row[0]) + 1 and float(row[1]) - 1 < window.stop <= float(row[1])
        at, root = f"{window.speed_of_largest:.0f}", measured(
            max(peak_root_stress(found.gears, torque, window.dynamic_factor)), 3)
        assert row[2:] == ["contact", "lost,", "small", "always", f"{window.dynamic_factor:.3g}", at, root, "–"]


def test_an_edge_without_an_event_is_a_dash_with_its_resolution(found):
    (window, *_) = found.at[0].windows
    open_ = replace(window, begins_with="", start_resolution=0.25, to_scan_end=True)
    one = of_windows(found, open_)
    (row,) = rows(one.at[0], one.gears)
    assert row.begins_with == "– ±0.25" and row.ends_with == "end of scan" and row.stop.startswith("≥ ")
    meaning = "N m, where the teeth hit both flanks"
    hard = one.at[0].dataset.assign(contact=2 * xr.ones_like(one.at[0].dataset.contact))
    assert meaning not in worst(one) and meaning in worst(replace(one, at=(replace(one.at[0], dataset=hard),)))


def test_how_operation_comes_to_a_range_is_said(found):
    first, states = found.at[0].windows[0], STATES

    def met(window):
        one = of_windows(found, window)
        return rows(one.at[0], one.gears)[0].reached

    always = tuple(Reached(motion, 1.0, 2.0) for motion in ("from rest", "speed rising", "speed falling"))
    decides = replace(first, reached=always, history=(first.start, 545.2), random_states=states)
    assert met(replace(decides, history=None)) == "always" and met(decides) == "by history"
    assert met(replace(decides, reached=always[1:])) == "rising, falling"
    assert met(replace(decides, reached=always[2:])) == "falling"
    assert met(after_load_change(first)) == "load change"
    elsewhere = (Reached("after other speeds", 1.0, 2.0),)
    assert met(replace(decides, reached=elsewhere)) == "by history"


def test_usable_ranges_that_are_next_to_nothing_of_the_speeds_are_not_named():
    parts = [UsableRange(626.73, 626.91), UsableRange(656.9, 1124.4), UsableRange(12.345, 12.987)]
    assert usable_in_words(parts, (500.0, 1124.4)) == ["657 to ≥ 1124 rpm (±26.2 %)", "12.4 to 12.9 rpm (±2.5 %)"]
    assert usable_in_words(parts[:1], (626.7, 626.91)) == ["626.73 to ≥ 626.91 rpm (±0.01 %)"]


def test_both_ends_of_a_printed_range_differ_however_narrow_it_is():
    draw = random.Random(3)
    for _ in range(1000):
        start = 10 ** draw.uniform(-3, 5)
        stop = start * (1 + 10 ** draw.uniform(-9, 1))
        outwards, inwards, nearest = ([Fraction(end) for end in ends_in_words(start, stop, way)] for way in (
            windows.OUTWARDS, windows.INWARDS, windows.NEAREST))
        assert outwards[0] <= Fraction(repr(start)) <= inwards[0] < inwards[1] <= Fraction(repr(stop)) <= outwards[1]
        assert nearest[0] < nearest[1]
    assert [ends_in_words(*ends) for ends in ((559.2, 586.4), (12.345, 98.76), (500.0, 500.1))] == [
        ("559", "587"), ("12.3", "98.8"), ("500", "500.1")]


def test_a_narrow_range_of_speeds_is_printed_with_its_digits(capsys):
    design = load_design(SPUR)
    answers = [DesignAnswer.of(design, gc.speeds_to_avoid(design, "643:643.1:2", starts=0))]
    print_answers(answers, every=True, warn=False)
    print_datasheets(answers)
    sheet = capsys.readouterr().out
    for text in (sheet, assess(SPUR, "--speed", "643:643.1:2", "--starts", 0).stdout):
        assert "643 to 643.1 rpm" in text and "643 to 643 " not in text
    assert re.findall(r"^ *(643\S*) ", sheet.partition("K_v by the standards")[2], re.MULTILINE) == ["643", "643.1"]


def test_warnings_are_those_of_the_torques_asked_for_not_of_the_file():
    said = assess(SPUR, "--speed", "643:644:2", "--starts", 0, "--torque", "100,1e9").stderr
    assert "unusually high: is the torque in N*m?" in " ".join(said.split())
    assert all(len(line) <= WIDTH for line in said.splitlines())
    assert "unusually high" not in assess(SPUR, "--speed", "643:644:2", "--starts", 0, "--torque", "100").stderr


def made_up(found, *usable):
    """The assessment of one torque with ranges to avoid around these usable ones."""
    edges = [500.0, *(edge for part in usable for edge in part), 700.0]
    return of_windows(found, *(
        replace(found.at[0].windows[0], start=a, stop=b) for a, b in zip(edges[::2], edges[1::2], strict=True)))


def test_without_a_usable_speed_this_is_said_plainly(found):
    assert decision(made_up(found))[-1] == "usable in operation: 0.0 % of 500 to 700 rpm"
    one, other = made_up(found, (510, 540)).at[0], made_up(found, (600, 640)).at[0]
    both = decision(replace(found, at=(one, replace(other, torque=300.0))))
    assert both[-1].startswith("usable at all torques in operation: 0.0 %")
    many = [(500 + 20 * k, 505 + 20 * k) for k in range(1, 6)]
    assert decision(made_up(found, *many))[-1].endswith(" and 2 narrower ranges")


def test_none_found_says_what_was_tried():
    options = ("--speed", "5500:6000:2", "--torque", 1200, "--starts", 1, "--set", "design.transmission_error=none")
    text = " ".join(assess(SPUR, *options).stdout.split())
    assert text.startswith("at 1200 N m no speed from 5500 to 6000 rpm is to be avoided in operation: none was found "
                           "at which the teeth separate where there may be a reversal of the load, nothing is to be "
                           "avoided, either")
    assert "Tried: from rest, sweeps at " in text and "1 state after a reversal of the load" in text
    assert "At 1200 N m, dynamic factor 1.75 at speed 0, avoid nothing" in text


def test_of_many_torques_the_merged_answer_is_printed_alone():
    text = assess(SPUR, "--speed", "500:520:2", "--starts", 0, "--torque", "100:160:7").stdout
    assert text.startswith("at any of 7 torques from 100 to 160 N m no speed from 500 to 520 rpm is to be\n  avoided")
    assert "At 1" not in text and "0 ranges to avoid at 7 torques: --json or --out has all" in text


def test_the_report_has_the_numbers_of_json_and_loads_nothing(command, found):
    assert (command[1] / "pdf.pdf").read_bytes().startswith(b"%PDF-")
    assert "</svg>" in (command[1] / "plot.svg").read_text(encoding="utf-8")
    page = (command[1] / "out.html").read_text()
    assert page.index(found.at[1].tried) < page.index("Evidence"), "what was tried stands on the first page"
    assert all(f"at {each.torque:g} N m {each.tried}" in found.assumptions[-1] for each in found.at)
    for each in found.document()["usable"]:
        words = f"{math.ceil(each['from'])} to (≥ )?{math.floor(each['to'])} rpm .±{100 * each['margin']:.1f} %."
        assert re.search(f"<td[^>]*>{each['torque']:g}</td><td[^>]*>(≤ )?{words}</td>", page)
    for at in found.at:
        for row in rows(at, found.gears):
            assert re.search(r"\s*".join(f"<td [^>]*>{re.escape(value)}</td>" for value in row), page)
    for sentence in (*decision(found), worst(found)):
        assert f"{sentence[0].upper()}{sentence[1:]}." in page
    assert "Not computed: the command does so with --sensitivity." in page and "What to change" not in page
    assert not re.search(r"<script|<link|<img|(?:src|href)=\"(?!#)", page)
    assert all(name in page and value.split("_")[0] in page for name, value in inputs_of(found.gears).items())


def test_a_picture_has_the_ranges_in_the_colours_of_what_happens_and_marks_of_events(found):
    ax = gc.plot.assessment(found)
    spans = sorted(tuple(path.get_extents().intervalx) for bars in ax.collections for path in bars.get_paths())
    expected = [(w.start, w.stop) for _, w in found.avoid] + [(p.start, p.stop) for p in found.usable_at_all]
    assert np.allclose(spans, sorted(expected), rtol=1e-12)
    marks = [line for line in ax.lines if line.get_color() == EVENT_COLOURS["graze"]]
    assert sorted(line.get_xdata()[0] for line in marks) == sorted(e for _, w in found.avoid for e in (w.start, w.stop))
    labels = {text.get_text() for text in ax.get_legend().get_texts()}
    assert labels == {"contact lost, small", "usable at all torques", "to avoid at some torque", "graze"}
    (behind,) = [patch for patch in ax.patches if to_hex(patch.get_facecolor()) == "#d9d9d9"]
    assert behind.get_y() > 1 and behind.get_zorder() < min(bars.get_zorder() for bars in ax.collections)
    assert SEVERITY_COLOURS["contact lost, small"] in {to_hex(bars.get_facecolor()[0]) for bars in ax.collections}
    assert "±5.6 %" in [text.get_text() for text in ax.texts]


def test_where_a_load_change_alone_leads_there_bars_are_pale_and_hatched(found):
    ax = gc.plot.assessment(of_windows(found, *(after_load_change(w, contact="both flanks", hits=True, begins_with="")
                                                for w in found.at[0].windows)))
    assert {(bars.get_hatch(), bars.get_alpha()) for bars in ax.collections} == {("////", 0.45)}
    assert {to_hex(bars.get_facecolor()[0]) for bars in ax.collections} == {CONTACT_CLASSES[2].colour}
    assert [text.get_text() for text in ax.get_legend().get_texts()] == [
        "hits both flanks", "after a load change alone", "no event", "graze"]


def test_many_torques_are_areas_that_touch(found):
    many = replace(found, at=tuple(replace(found.at[0], torque=float(t)) for t in (10, 20, *range(40, 400, 30))))
    ax = gc.plot.assessment(many)
    heights = sorted({tuple(path.get_extents().intervaly) for bars in ax.collections for path in bars.get_paths()})
    assert [a[1] for a in heights[:-2]] == [b[0] for b in heights[1:-1]] and heights[0] == (5.0, 15.0)
    with pytest.raises(gc.InputError, match=re.escape("found must be the result of gearchaos.assess")):
        gc.plot.assessment(found.at[0].dataset)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "options"), [
    ("physical_pair.toml", ("--speed", "10300:10400:2", "--torque", "50,80", "--starts", 0)),
    ("train_idler.toml", ("--speed", "3000:3060:2", "--torque", "15", "--starts", 2)),
])
def test_pairs_in_si_and_trains_have_a_report_too(tmp_path, name, options):
    path = tmp_path / "report.html"
    document = run_json("assess", EXAMPLES / name, *options, "--out", path, "--pdf", tmp_path / "report.pdf")
    page = path.read_text()
    assert document["avoid"] and "Not drawn" not in page
    assert ("motor: 0.002 kg m²" if "train" in name else "c0") in page
    assert ("at speed 0" in page) == ("train" not in name)  # not known of a train
    assert "--sensitivity needs a [design]" in assess(EXAMPLES / name, *options, "--sensitivity", code=2).stderr


def test_the_inputs_that_matter_most_are_those_with_the_largest_effect(found):
    def share(value):
        return made_up(found, *[(500, 500 + 200 * value)] * (value > 0))

    base = share(0.5)
    changes = [Changed(name, "1", value, share(usable)) for name, value, usable in (
        ("a", "2", 0.6), ("b", "2", 0.2), ("a", "0", 0.05), ("d", "2", 0.5), ("e", "2", 0.9))]
    changes.insert(3, Changed("c", "1", "2", reason="no"))
    report = Report(base, sensitivity=changes, improvements=changes)
    assert [(each.name, each.value) for each in report.matters_most] == [("a", "0"), ("e", "2"), ("b", "2")]
    assert [each.name for each in report.helps_most] == ["e", "a"], "that alone which widens what is usable"
    document = report.document()["improvements"]
    assert document[0]["usable_share"] == pytest.approx([0.5, 0.6])
    assert document[3]["usable_share"][1] is None and document[3]["reason"] == "no"
    page = report_html(report)
    assert "<li>e 1 to 2: usable 90.0 % of the speeds" in page and "c 1 to 2: not possible, no" in page
    assert "None of the 1 changes" in report_html(Report(base, improvements=changes[4:5]))
    assert report_pdf(report).startswith(b"%PDF")


def test_each_assumed_input_is_varied_alone():
    design = load_design(SPUR)
    changes = list(assumptions(design))
    assert [(each.name, each.value) for each in changes] == [
        ("damping ratio", "0.03"), ("damping ratio", "0.08"), ("accuracy grade", "5"), ("accuracy grade", "7"),
        ("transmission error", "from quality (typical)"), ("mesh stiffness", "potential energy"),
        ("load sharing", "tooth pairs with corner contact"),
        ("load sharing", "tooth pairs on their nominal path alone"), ("backlash", "0.084 mm"), ("backlash", "0.156 mm")]
    typical = list(assumptions(replace(design, transmission_error="from quality (typical)")))
    assert [(each.name, each.value) for each in typical if each.name in ("accuracy grade", "transmission error")] == [
        ("accuracy grade", "5"), ("accuracy grade", "7"), ("transmission error", "from quality")]
    known = replace(design, quality=replace(design.quality, deviations=(0.5, -0.2)))
    of_known = [each for each in assumptions(known) if each.name in ("accuracy grade", "transmission error")]
    assert [each.value for each in of_known] == ["5", "7"]  # their error is not assumed
    assert all(replace(known, **each.fields).quality.deviations == (0.5, -0.2) for each in of_known)
    for each in changes:
        other = replace(design, **each.fields)
        assert other != design and replace(other, **{name: getattr(design, name) for name in each.fields}) == design
    assert replace(design, **changes[-1].fields).backlash_line_of_action == pytest.approx(1.3 * 0.12e-3)
    assert {each.name for each in improvements(design)} == {
        "tip relief", "backlash", "profile shift", "addendum in modules"}
    for each in improvements(design):
        assert replace(design, **each.fields).geometry.centre_distance == design.geometry.centre_distance
    shared = replace(design, load_sharing=None)
    of_shared = [(each.given, each.value) for each in assumptions(shared) if each.name == "load sharing"]
    assert of_shared == [("tooth pairs with corner contact", value) for value in (
        "tooth pairs on their nominal path alone", "prescribed, one spring")]
    relieved = replace(shared, tip_relief={"amount": "10 um", "start_diameter": "152.3 mm"})
    assert [each.value for each in assumptions(relieved) if each.name == "load sharing"] == [
        "tooth pairs on their nominal path alone"]  # one spring has no relief
    helical = replace(shared, helix_angle=0.2, centre_distance=None)
    assert [each.value for each in assumptions(helical) if each.name == "load sharing"] == [
        "under load, in strips across the width on their nominal path alone", "prescribed, one spring"]
    for given, words in ((design, ", tooth pairs sharing the load"), (shared, "")):
        new = [each for each in improvements(given) if each.name == "tip relief"]
        assert len(new) == 2 and all(each.value.endswith(f"single contact{words}") for each in new)
        assert all(replace(given, **each.fields).shares_load for each in new)
    relieved = replace(shared, tip_relief="10 um")
    assert [each.value for each in improvements(relieved)][:3] == ["0 µm", "7 µm", "13 µm"]


def test_a_change_that_is_not_possible_is_a_reason():
    best = replace(load_design(SPUR), quality=replace(load_design(SPUR).quality, grade=0))
    (worse, *_) = (each for each in assumptions(best) if each.name == "accuracy grade")
    (changed,) = assess_changes(best, [worse], "500:520:2", 100, starts=0)
    assert changed.assessment is None and "grade" in changed.reason


@pytest.mark.slow
def test_two_designs_are_beside_each_other(tmp_path):
    other, page = tmp_path / "other.toml", tmp_path / "report.html"
    other.write_text(SPUR.read_text().replace("damping_ratio = 0.05", "damping_ratio = 0.08"))
    document = run_json("assess", SPUR, *SCAN, "--torque", 100, "--against", other, "--out", page, "--pdf",
                        tmp_path / "report.pdf")
    assert document["avoid"] and not document["against"]["avoid"]
    text = page.read_text()
    for part in ("spur_50_50.toml: Spur gear pair", "other.toml: Spur gear pair", "What differs in the inputs",
                 "0.05, in contact alone", "0.08, in contact alone"):
        assert part in text
    assert [name for name, *_ in differing_inputs(load_design(SPUR), load_design(other)).table[1:]] == [
        "damping ratio of the mesh"]
    ids = re.findall(r'\bid="([^"]+)"', text)
    assert len(ids) == len(set(ids))


@pytest.mark.slow
def test_the_command_assesses_again_with_inputs_varied(monkeypatch):
    design = load_design(SPUR).at(torque=100.0)
    for changes, name in ((assumptions, "damping ratio"), (improvements, "addendum in modules")):
        few = [each for each in changes(design) if each.name == name]
        monkeypatch.setattr(f"gearchaos.studies.speeds.changed_designs.{changes.__name__}", lambda _, few=few: few)
    result = assess(SPUR, "--speed", "530:560:2", "--torque", 100, "--starts", 0, "--sensitivity", "--improve")
    assert re.search(r"^[3-6] more assessments, about", result.stderr, re.MULTILINE)
    text = " ".join(result.stdout.split())
    assert "Input: damping ratio 0.05 to 0.08: usable 100.0 % of the speeds" in text and "Change: addendum" in text
    assert max(map(len, result.stdout.splitlines())) <= WIDTH


@pytest.mark.parametrize(("options", "message"), [
    (("--speed", "500:700", "--torque", "100,100"), "--torque must rise from one to the next"),
    (("--speed", "500:700", "--torque", "100", "--torque", "100"), "torque must be given once"),
    (("--speed", "500:700", "--torque", "300:100:3"), "must run from a smaller to a larger value"),
    (("--speed", "500:700", "--torque", "100:300"), "--torque must read start:stop:count"),
    (("--speed", "643:644:2", "--starts", "0", "--torque", "1e11"),
     "torque must deflect the teeth at rest by at most 1e+06 half backlashes; got '1e+11 N m'"),
    (("--speed", "0.001:0.1:10"), "error: speed must be at least about 0.066 rpm; got '0.001:0.1'"),
    (("--speed", "500:700", "--torque", "x"), "torque must be a torque"),
    (("--speed", "500:500:1"), "--speed must be a range of speeds"),
    (("--speed", "500"), "--speed must read start:stop or start:stop:count"),
    (("--speed", "500:60000"), "must keep the pitch line velocity below 300 m/s"),
    (("--speed", "500:700", "--out", "x.pdf"), "--out must end in .html"),
    (("--speed", "500:700", "--pdf", "x.html"), "--pdf must end in .pdf"),
    (("--speed", "500:700", "--plot", "x.html"), "--plot must end in"),
    (("--speed", "500:700", "--set", "operation.speed=500"), "--set must leave out speed"),
    (("--speed", "500:700", "--torque", "50", "--set", "torque=60"), "--set must leave out torque"),
])
def test_bad_input_is_one_message_and_exit_code_2(options, message):
    result = assess(SPUR, *options, code=2)
    assert message in result.stderr and result.stdout == ""


def test_a_file_without_gears_and_the_model_of_gears_without_load_are_refused():
    said = assess(EXAMPLES / "fig02.toml", "--speed", "500:510", code=2).stderr
    assert "study file must have a table [design], [gearpair] or [train]" in said
    model = load_study(EXAMPLES / "physical_pair.toml").model.with_values({"torque": 0.0})
    with pytest.raises(InputError, match="torque must be finite and not 0"):
        gc.assess(model, "500:600:4", starts=0)


def test_teeth_that_differ_are_said_to_be_left_out():
    result = assess(SPUR, "--speed", "500:510:2", "--torque", 100, "--starts", 0, "--set", "design.eccentricity=20 um")
    text = " ".join(result.stdout.split())
    assert "Assumed: all teeth are taken to be alike: faults, pitch errors and eccentricity are left out" in text
    assert "train" not in result.stderr and "eccentricity" not in result.stderr


def test_factors_are_drawn_where_all_motions_grow_without_bound(found):
    nothing = found.at[0].dataset.copy()
    nothing["dynamic_factor"] = np.nan * nothing.dynamic_factor
    nothing["contact"] = -1 + 0 * nothing.contact
    ax = draw_factors(replace(found.at[0], dataset=nothing), Figure().subplots())
    assert ax.get_xlim() == (500, 700) and len(ax.lines) == 0


def test_a_change_within_what_the_search_leaves_open_is_not_told_apart(found):
    """The first range, 27.4 of 200 rpm, is not certain in the one, and 3 rpm of its edge in the other."""
    few = RandomStates(0.02, 0.001, 0.09, 64, 8)
    first, *others = found.at[0].windows
    rare = after_load_change(first, random_states=few)
    usual = replace(rare, random_states=replace(few, fraction=0.1))
    base, rest, with_rare, with_usual, with_loose = (of_windows(found, *ranges, *others) for ranges in (
        (first,), (), (rare,), (usual,), (replace(first, stop_resolution=3.0),)))
    for one, other, told in ((rest, base, True), (with_usual, rest, True), (with_loose, rest, True),
                             (rest, with_rare, False), (with_rare, rest, False), (with_loose, base, False)):
        assert Changed("a", "1", "2", one).told_apart(other) is told
    report = Report(base, sensitivity=[Changed("a", "1", "2", with_loose)])
    page = report_html(report)
    assert report.matters_most == [] and "which the search does not tell apart" in page
    assert "None of the 1 changes alters it by more than the search leaves open." in page
    assert report.document()["sensitivity"][0]["told_apart"] is False


def test_how_likely_a_range_is_stands_in_every_form(found):
    first, second = found.at[0].windows
    one = of_windows(found, after_load_change(first), replace(second, random_states=replace(
        STATES, fraction=1.0, fraction_lo=0.9439, fraction_hi=1.0)))
    words = ["531 to 559 rpm at 100 N m: contact lost, small, met: load change; after 36 % of load changes (95 %: "
             "24–49 %), 64 at 8 speeds",
             "593 to 627 rpm at 100 N m: contact lost, small, met: always; after all load changes tried, 64 at 8 "
             "speeds"]
    assert keep_out(one) == words
    assert [row.share for row in rows(one.at[0], one.gears)] == ["36 (24–49)", "100 (94–100)"]
    page = report_html(Report(one))
    assert page.index("Keep out of") < page.index(words[0]) < page.index("<figure") and words[1] in page
    assert one.document()["avoid"][0]["random_states"] == {
        "fraction": 0.359, "fraction_lo": 0.2431, "fraction_hi": 0.489, "states": 64, "speeds": 8,
        "motion": "load change"}
    none, rare = (replace(first, random_states=replace(STATES, fraction=f)) for f in (0.0, 0.996))
    both = of_windows(found, none, rare)
    assert [row.share.split()[0] for row in rows(both.at[0], both.gears)] == ["0", "99"]
    assert keep_out(found)[0].endswith("met: always")


def test_ranges_at_many_torques_are_merged_where_they_overlap_and_the_widest_are_listed(found):
    states = RandomStates(0.25, 0.1, 0.4, 64, 8)
    first, second = (replace(each, random_states=states) for each in found.at[0].windows)
    above = replace(first, start=550.0, stop=580.0, contact="both flanks", hits=True,
                    random_states=replace(states, fraction=1.0))
    same = (replace(found.at[0], torque=torque, windows=(first, second)) for torque in (1.0, 2.0, 3.0))
    many = replace(found, at=(*same, replace(found.at[0], torque=4.0, windows=(above, second))))
    merged = "4 ranges at 4 torques from 1 to 4 N m merged: at worst"
    assert keep_out(many, 2) == [
        f"531 to 580 rpm, {merged} hits both flanks at 4 N m; from 25 to 100 % of load changes, by range and torque",
        f"593 to 627 rpm, {merged} contact lost, small at 1 N m; from 25 % of load changes, by range and torque"]
    assert keep_out(many, 1)[0].startswith("531 to 580 rpm") and keep_out(many, 1)[1:] == [
        "1 narrower range, in the tables"]
    assert len(keep_out(many)) == 8 and keep_out(replace(found, at=())) == []


@pytest.mark.parametrize(("start", "words"), [(983.2, "925 to 1100 rpm"), (984.2, "925 to 1100 rpm"),
                                              (986.2, "925 to 984 and 986 to 1100 rpm")])
def test_ranges_that_meet_as_they_are_printed_are_one(found, start, words):
    window = replace(found.at[0].windows[0], start_resolution=0.0, stop_resolution=0.0)
    first, second = (replace(window, start=low, stop=high) for low, high in ((925.1, 983.4), (start, 1099.5)))
    assert f"avoid {words}: " in decision(of_windows(found, first, second))[0]


def test_edges_are_rounded_outwards_alike_in_the_commands_and_in_words(found):
    window = replace(found.at[0].windows[0], start=6411.2, stop=6889.4, start_resolution=0.5, to_scan_end=True)
    assert window.words == "6410 to 6890 rpm" and edges(window) == ("6410", "≥ 6890")
    assert rows(replace(found.at[0], windows=(window,)), found.gears)[0][:2] == edges(window)
    assert replace(window, start=12.345, stop=12.341, start_resolution=0.0).ends == ("12.3", "12.4")


def test_the_price_is_said_before_the_work(monkeypatch):
    few = ("--speed", "643:644:2", "--starts", 0, "--torque")
    assert "this takes" not in assess(SPUR, *few, 100).stderr
    monkeypatch.setattr("gearchaos.studies.core.price.TOLD_SECONDS", 0.0)
    alone, both = (" ".join(assess(SPUR, *few, torques).stderr.split()) for torques in (100, "100,300"))
    assert re.match(r"this takes about \d+ seconds\. One motion is followed", alone)
    assert "2 motions are followed" in both


def _search(torques, **criteria):
    model = as_model(load_study(SPUR, {"torque": 100.0, "speed": 500.0}).gears)
    return SpeedSearch(model, gc.Axis("speed", 500, 4000, 40), torques, Criteria(**criteria))


def test_a_trial_of_a_search_is_spread_over_speeds_and_torques():
    whole = _search([100.0, 150.0, 200.0, 250.0, 300.0, 350.0], starts=2)
    assert [whole.thinned(share).torques for share in (0.0, 1e-3, 2e-3)] == [[200.0], [200.0], [150.0, 300.0]]
    trial = whole.thinned(0.05)
    assert trial.torques == whole.torques
    assert trial.cost.motions == pytest.approx(0.05 * whole.cost.motions, rel=0.05)
    (found,) = replace(whole.thinned(1e-3), trial=4).run()
    even = 500 * 8 ** ((np.arange(4) + 0.5) / 4)  # as the speeds of the search, which are a share of the speed apart
    assert found.motions.speeds == pytest.approx(even, rel=0.01) and found.motions.drawn


def _found(*speeds):
    """Of a trial: whether the motions of each speed are to be avoided, their period, and the number of states drawn."""
    at = {i: [SimpleNamespace(avoided=avoided, period=period)] for i, (avoided, period, _) in enumerate(speeds)}
    drawn = {i: [None] * number for i, (_, _, number) in enumerate(speeds)}
    return [SimpleNamespace(criterion=lambda m: m.avoided, motions=SimpleNamespace(at=at, drawn=drawn))]


def test_a_trial_says_how_close_speeds_stand_in_the_whole_search():
    search, free, regular, irregular = _search([100.0]), (0, 1, 127), (2, 2, 15), (2, 0, 2)
    amid = search.needed(_found(regular))
    assert amid == search.needed(_found(irregular)) == pytest.approx(0.0025 / 0.01, rel=0.1)
    assert search.needed(_found(free)) == 1
    assert search.needed(_found(free, regular, irregular)) == pytest.approx((128 + 119 * amid) / (128 + 119))


def test_a_trial_of_unlike_speeds_needs_a_dozen_of_them():
    search, free, avoided = _search([100.0]), (0, 1, 128), (2, 1, 16)
    assert search.tells(_found(*4 * [free])) and search.tells(_found(*4 * [avoided]))
    assert not search.tells(_found(*3 * [free], avoided)) and not search.tells(_found(avoided, (2, 0, 2)))
    assert search.tells(_found(*11 * [free], avoided))


def test_a_search_proposes_fewer_torques_or_states():
    words, less = _search([100.0, 150.0, 200.0, 250.0, 300.0, 350.0]).smaller(0.25)
    assert words == "2 of the torques" and less.torques == [100.0, 250.0]
    words, less = _search([100.0]).smaller(0.25)
    assert words == "32 states at each speed (assess --starts 32)" and less.criteria.starts == 32
    assert replace(less, criteria=replace(less.criteria, starts=0)).smaller(0.25) is None
    assert less.cost.motions == pytest.approx(_search([100.0]).cost.motions / 4, rel=0.1)


def test_the_tables_of_the_print_have_every_word(found):
    first, criterion = found.at[0].windows[0], windows.FORCE_CRITERION
    one = of_windows(found, replace(first, criterion=criterion, begins_with="neimark-sacker"))
    words = set(" ".join(_lines(Report(one))).split())
    cells = [cell for row in (headings(one.at[0]), *rows(one.at[0], one.gears)) for cell in row]
    assert {word for cell in cells for word in cell.split()} <= words


def test_a_torque_is_given_once_and_holds_for_both_gears():
    pair = EXAMPLES / "physical_pair.toml"
    refused = assess(pair, "--speed", "3000:3010:2", "--torque", 50, "--set", "gearpair.M10=60", code=2).stderr
    assert "--set must leave out torque" in refused
    document = run_json("assess", pair, "--speed", "3000:3010:2", "--starts", 0, "--against", pair, "--set",
                        "gearpair.M10=60")
    assert document["torques"] == document["against"]["torques"] == [60]


def test_a_changed_input_names_the_range_with_the_largest_margin(found):
    widest = found.usable_at_all[0]
    document = Changed("damping ratio", "0.05", "0.08", found).document(found)
    assert document["largest_margin"] == [[widest.start, widest.stop]] * 2 and widest.start < widest.stop
