"""A drawing as a form: its inputs are those of the library, what it says of them, and what a page opens with."""

import base64
import math
import re
import tomllib
import zlib
from dataclasses import replace
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.datasheet.quantities import datasheet
from gearchaos.errors import InputError
from gearchaos.explorer.core.drawing import EXAMPLE, Drawing, changes
from gearchaos.explorer.core.form_inputs import GROUPS, inputs
from gearchaos.explorer.core.opened import Opened, opened, redrawn
from gearchaos.explorer.core.text import from_query
from gearchaos.explorer.features.assessment.speed_line import SpeedLine
from gearchaos.explorer.features.drawing.form import form, marks
from gearchaos.explorer.features.drawing.panel import Sheet, sheet_text, teeth
from gearchaos.explorer.features.drawing.relief import best_relief, relief_text
from gearchaos.explorer.features.drawing.speeds import Factors, factors, factors_text
from gearchaos.explorer.features.drawing.turning import gaps, turning_teeth
from gearchaos.explorer.features.motion.point import point_motion
from gearchaos.explorer.web.messages import render
from gearchaos.explorer.web.page import Page
from gearchaos.explorer.web.start import _page
from gearchaos.gears.geometry.backlash import OF
from gearchaos.gears.io import units
from gearchaos.gears.stiffness import methods
from gearchaos.gears.transmission_error import editions
from gearchaos.studies.operation.severities import SEVERITIES
from gearchaos.studyfile import load_study
from tests import EXAMPLES
from tests.contracts.explorer.test_computations import GEARS, PAPER, Put, session

DRAWING = Drawing.of(EXAMPLE.items())
DRAWING_SOFT = Drawing.of({**EXAMPLE, "design.damping_ratio": "0.1", "operation.torque": "20 N*m"}.items())
TOML = re.compile(r"[a-z]_[a-z]|\w = |[{}\[\]]|None|\blist\b|plain number|\*")
FACTORS = "dynamic factor along the speed"
DISTANCE, RELIEF, START = "design.centre_distance", "design.tip_relief.amount", "design.tip_relief.start_diameter"


SPUR = (EXAMPLES / "spur_50_50.toml").read_text()
FAULT = "\n[[design.faults]]\nwheel = 1\ntooth = 2\nstiffness_loss = 0.1\n"


def drawn(**texts):
    """The example with other texts; of a key of `inputs` a dot is written as two underscores."""
    return Drawing.of({**EXAMPLE, **{key.replace("__", "."): text for key, text in texts.items()}}.items())


def window(start, stop, operation):
    return SimpleNamespace(start=start, stop=stop, reach=(start, stop), operation=operation,
                           severity=SEVERITIES[2], words=f"{start:g} to {stop:g} rpm")


def packed(text):
    return base64.urlsafe_b64encode(zlib.compress(text.encode())).decode().rstrip("=")


def test_the_inputs_of_the_form_are_read_named_and_described_by_the_library():
    assert {key.split(".")[1] for key in inputs()} == {name for names in GROUPS.values() for name in names}
    for key, each in inputs().items():
        assert each.words, key
        for unit in each.units:
            assert units.to_si(key, f"2 {unit}", units.DIAMETRAL_PITCH if unit == "1/in" else each.reader.dimension) > 0
    assert inputs()["design.stiffness"].reader.names == tuple(methods())
    assert inputs()["design.quality.standard"].reader.names == tuple(editions())
    assert inputs()["design.backlash.of"].reader.names == OF
    assert inputs()["design.centre_distance"].units == ("mm", "um", "in") and inputs()[RELIEF].units[0] == "um"
    assert inputs()["design.face_width"].reader.both and not inputs()["design.module"].reader.both


def test_a_drawing_is_the_design_of_the_same_study_file(tmp_path):
    reading = DRAWING.reading
    path = tmp_path / "drawing.toml"
    path.write_text(DRAWING.toml(reading.design, reading.view))
    assert gc.open(path) == reading.design == reading.view.gears
    assert tomllib.loads(path.read_text())["design"]["module"] == "2.5 mm"  # in the words of the drawing
    study = load_study(path)
    assert (study.options["x"], study.options["y"]) == (reading.view.x, reading.view.y)
    moved = drawn(operation__torque="500 lbf*in").reading
    assert moved.view.gears.torque == pytest.approx(500 * 4.4482216 * 0.0254)


def test_profile_shifts_that_are_left_open_are_halves_of_the_sum_that_the_centre_distance_needs():
    def involute(angle):
        return math.tan(angle) - angle

    alpha, distance = math.radians(20), 131.5
    working = math.acos(2.5 * (23 + 81) / 2 * math.cos(alpha) / distance)
    needed = (23 + 81) * (involute(working) - involute(alpha)) / (2 * math.tan(alpha))
    reading = DRAWING.reading
    assert reading.design.profile_shift[0] == reading.design.profile_shift[1]
    assert needed - 2e-4 <= sum(reading.design.profile_shift) <= needed
    assert "half of the sum" in reading.because["design.profile_shift"]
    assert reading.assumed["design.profile_shift"] == "{0:g} / {0:g}".format(reading.design.profile_shift[0])
    own = drawn(design__profile_shift="0.35;0.27").reading
    assert own.design.profile_shift == (0.35, 0.27) and not own.because


@pytest.mark.parametrize(("texts", "key", "words"), [
    ({DISTANCE: "120 mm"}, DISTANCE, "greater than 122.16"), ({DISTANCE: "200 mm"}, DISTANCE, "Without profile shift"),
    ({DISTANCE: "131,5 mm"}, DISTANCE, "131.5"), ({"design.teeth": "23"}, "design.teeth", "two numbers"),
    ({"design.module": "2.5"}, "design.module", "followed by a unit"),
    ({"design.module": "x 1/in"}, "design.module", "pitch"),
    ({"design.face_width": "22 m"}, "design.face_width", "4.05 m"),
    ({"design.damping_ratio": "5"}, "design.damping_ratio", "percentage"),
    ({"design.quality.grade": "20"}, "design.quality.grade", "0 to 12"),
    ({"design.quality.standard": ""}, "design.quality.grade", "standard and grade"),
    ({"design.backlash.of": ""}, "design.backlash.of", "must be given"),
    ({"design.bore": "25 mm;500 mm"}, "design.bore", "root"),
    ({"design.profile_shift": "0.9;0.9"}, "design.profile_shift", "sum of at most"),
    ({"range.speed": "10 rpm;4000 rpm"}, "range.speed", "long to compute"),
    ({"range.torque": "10 N*m"}, "range.torque", "from and to"),
    ({RELIEF: "20 mm", START: "62 mm;206 mm"}, RELIEF, "a fifth of a module"),
    ({RELIEF: "20 um", "design.load_sharing": "tooth pairs"}, START, "must be given"),
    ({DISTANCE: "125 mm"}, DISTANCE, "tip clearance"), ({"design.teeth": "5;81"}, "design.teeth", "start of active"),
    ({"operation.speed": "200 rpm"}, "operation.speed", "long to compute")])
def test_the_message_of_the_library_stands_beside_the_input_that_is_wrong(texts, key, words):
    reading = Drawing.of({**EXAMPLE, **texts}.items()).reading
    shown = marks(reading)
    assert [name for name, mark in shown.items() if mark["error"]] == [key]
    assert words in shown[key]["error"] and ("got" in shown[key]["error"] or words == "must be given")
    assert not TOML.search(shown[key]["error"]) and reading.view is None


@pytest.mark.parametrize(("texts", "key", "words"), [
    ({"design.bore": "25 mm;500 mm"}, "design.bore", "of wheel 2 must lie between 0 and 195.3 mm; got 500 mm."),
    ({"design.module": "2.5"}, "design.module", "by a unit. Write e.g. “35.2 mm”."),
    ({"design.profile_shift": "0.9;0.9"}, "design.profile_shift", "Leave out “centre distance” to have"),
    ({DISTANCE: "125 mm"}, DISTANCE, "tip clearance of wheel 1 must be greater than 0; got -0.2325 mm."),
    ({DISTANCE: "125 mm"}, DISTANCE, "by a negative “tip alteration” or “keep clearance”"),
    ({"design.backlash.value": "-1 mm"}, "design.backlash.value", "With “backlash: of”: “line of action, total” it is"),
    ({"design.lead_slope": "5 um"}, "design.lead_slope", "got 5 µm. It acts on helical pairs, by “load sharing”:"),
    ({"operation.torque": "0 N*m"}, "operation.torque", "got 0 N m. By the rule"),
    ({"operation.torque": "0 N*m"}, "operation.torque", "Write “stiffness”: potential energy."),
    ({"operation.speed": "10 rad/s"}, "operation.speed", "must be at least 95.5348 rad/s here; got 10 rad/s."),
    ({"operation.torque": "1e12 N*m"}, "operation.torque", "must be at most 1e+06 N m here; got 1e+12 N m."),
    ({"range.torque": "0.001 N*m;9 N*m"}, "range.torque", "must be at least 0.06 N m here; got 0.001 N m."),
    ({"design.face_width": "[design] 20 mm"}, "design.face_width", "must be a length; got [design] 20 mm. It"),
    ({"design.face_width": "{y = 'z'}"}, "design.face_width", "got {y = 'z'}. It"),
    ({"design.module": "2 mm;3 mm"}, "design.module", "must be a length; got 2 mm;3 mm."),
    ({"design.damping_ratio": "0.05;0.2"}, "design.damping_ratio", "must be a number; got 0.05;0.2."),
    ({"operation.speed": "10 rpm"}, "operation.speed", "gearchaos regime follows it. As the speed goes to 0 "
     "the dynamic factor goes to 1.07.")])
def test_messages_are_in_the_words_and_units_of_the_form(texts, key, words):
    assert words in Drawing.of({**EXAMPLE, **texts}.items()).reading.errors[key]


def test_what_the_library_says_of_a_drawing_is_in_the_words_of_the_form():
    needed = drawn(design__quality__standard="", design__quality__grade="", design__backlash__value="",
                   design__backlash__of="").reading.needed
    assert set(needed.values()) == {
        "E.g. “quality: standard”: ISO 1328-1:1995, “quality: grade”: 5.",
        "E.g. “backlash: value”: 0.12 mm, “backlash: of”: “line of action, total”."}
    design = drawn(design__transmission_error="", design__tip_relief__amount="5 um").reading.design
    notes = sheet_text(Sheet.of(DRAWING, design)).notes
    assert any("“tip relief” has no effect on the motion: give its “tip relief: start diameter”" in note
               for note in notes)
    assert any("write “transmission error”: from quality, or “none” if" in note for note in notes)


def test_every_input_that_is_wrong_by_itself_has_its_message():
    errors = drawn(design__module="2.5", design__damping_ratio="5", operation__speed="fast").reading.errors
    assert set(errors) == {"design.module", "design.damping_ratio", "operation.speed"}


def test_what_is_needed_is_said_and_numbers_come_before_the_motions():
    empty = Drawing.of({}.items()).reading
    assert set(empty.needed) == {"design.teeth", "design.module", "design.face_width"} and empty.design is None
    assert empty.assumed["design.bore"] == empty.assumed["operation.speed"] == "needed for motions"
    assert empty.assumed["design.pressure_angle"] == "20 deg" and empty.assumed["design.material"] == "steel"
    some = drawn(design__bore="", operation__speed="").reading
    assert set(some.needed) == {"design.bore", "operation.speed"} and "360 rpm" in some.needed["operation.speed"]
    assert some.design is not None and some.view is None
    assert marks(some)["design.bore"]["assumed"] == ["needed"]
    menu_alone = Drawing.of({**EXAMPLE, "design.quality.grade": "", "design.transmission_error": ""}.items())
    assert menu_alone.reading.view and "no effect" in menu_alone.reading.because["design.quality.standard"]


def test_a_diametral_pitch_stands_in_the_place_of_the_module():
    reading = drawn(design__module="10 1/in", design__centre_distance="").reading
    assert reading.design.module == pytest.approx(2.54e-3)
    assert "diametral_pitch" in drawn(design__module="10 1/in").tables()["design"]


def test_the_sheet_has_the_numbers_of_the_datasheet_and_the_kept_drawing_at_the_same_point():
    relieved = drawn(**{RELIEF.replace(".", "__"): "8 um", START.replace(".", "__"): "63 mm;207.5 mm"})
    design = relieved.reading.design.at(speed=3000.0, torque=90.0)
    sheet, own = Sheet.of(relieved, design, DRAWING), datasheet(design)
    assert {name: entry for name, entry in own.items() if name in sheet.now.entries} == dict(sheet.now.entries)
    before = DRAWING.reading.design.at(torque=90.0)
    (entry,) = datasheet(before, ["loaded_error_peak_to_peak"]).values()
    assert sheet.before.entries["loaded_error_peak_to_peak"] == entry
    for known in (sheet.now, sheet.before):
        found = known.entries["loaded_error_peak_to_peak"].value
        assert np.ptp(known.curves["deflection"]) == pytest.approx(found, rel=0.02)
    text = sheet_text(sheet)
    (row,) = [row for row in text.rows if row.name.startswith("loaded error")]
    change = 100 * (own["loaded_error_peak_to_peak"].value / entry.value - 1)
    assert float(row.change.removesuffix(" %")) == pytest.approx(change, rel=5e-3)
    assert text.changed == [("tip relief: amount", "not given", "8 µm"),
                            ("tip relief: start diameter", "not given", "63 mm / 207.5 mm")]
    assert "3000 rpm" in text.title and "90 N m" in text.title and changes(DRAWING, DRAWING) == []
    assert changes(DRAWING, drawn(operation__torque="90 N*m")) == []  # both stand at the same point
    assert opened(text.address, Opened(PAPER))[0].drawing == DRAWING


def test_the_sheet_says_what_is_assumed_of_both_drawings_once_where_it_is_the_same():
    def assumed(kept):
        return sheet_text(Sheet.of(DRAWING, DRAWING.reading.design, kept)).assumed

    own = "stiffness by ISO 6336-1, error from quality (typical), ζ 0.05 in contact alone"
    assert assumed(None) == [("", own)] and assumed(drawn(design__bore="30 mm")) == [("of both", own)]
    assert assumed(drawn(design__damping_ratio="0.07")) == [
        ("of this one", own), ("of the kept one", own.replace("0.05", "0.07"))]


def test_dynamic_factors_along_the_speed_are_those_of_the_motions_from_rest_of_both_drawings():
    page = Page(Opened(PAPER).drawn(drawn(range__speed="2000 rpm;4000 rpm"), DRAWING_SOFT), DRAWING.reading.view)
    page.view = page.opened.start.moved(2500.0, 45.0)
    views = page.compared
    assert [view.operating_point.value(name) for view in views for name in ("speed", "torque")] == [2500.0, 45.0] * 2
    models = [view.model_at({"speed": 2000.0}) for view in views]
    found, = factors(models, (2000.0, 4000.0))
    assert found.torque == 45.0 and (found.speeds[0], found.speeds[-1]) == (2000.0, 4000.0)
    for model, curve in zip(models, found.factors, strict=True):
        for number in (0, 71, 199):
            own = gc.regime(model.with_values({"speed": float(found.speeds[number])}))
            assert curve[number] == pytest.approx(own.dynamic_factor, rel=1e-6)
    most = [int(np.argmax(curve)) for curve in found.factors]
    sentence, = factors_text(found, [None, None])
    for curve, number in zip(found.factors, most, strict=True):
        assert f"at most {curve[number]:.2f} at {found.speeds[number]:.0f} rpm" in sentence
    assert "45 N m: this one" in sentence and "; the kept one" in sentence


def test_ranges_to_avoid_of_both_drawings_lie_one_above_the_other_once_each_was_assessed():
    first = Opened(PAPER).drawn(drawn(range__speed="1000 rpm;4000 rpm"), DRAWING_SOFT)
    page, put = Page(first, first.start), Put()
    page.along._set = put
    found = Factors(60.0, np.array([1000.0, 4000.0]), [np.array([1.0, 2.0]), np.array([1.0, np.nan])])
    page.show_factors(found)
    assert "To avoid" not in page.messages._html["speeds-text"]
    kept = page.compared[1]
    for view, ranges, change in ((first.start, [(1200.0, 1300.0, True)], ""),
                                 (kept, [(1500.0, 1600.0, False)], "a reversal")):
        windows = [window(start, stop, operation) for start, stop, operation in ranges]
        page._assessed.append((SpeedLine(view), SimpleNamespace(
            avoid=[(60.0, each) for each in windows], at=[SimpleNamespace(load_change=change)])))
        page.show_factors(found)
    bars, striped = put[page.along.avoided.id]["data"], put[page.along.striped.id]["data"]
    assert (bars["x0"], bars["x1"]) == ([1200.0, 1500.0], [1300.0, 1600.0]) and bars["y"][0] > bars["y"][1]
    assert striped["x0"] == [1500.0] and max(bars["y"]) < 1.0  # below the curves
    words = page.messages._html["speeds-text"]
    assert "one 1200 to 1300 rpm in operation, load changes left out; the kept one 1500 to 1600 rpm." in words
    for other in (page.view.moved(2000.0, 45.0), replace(page.view, change="none")):  # also without load changes
        page.view = other
        page.show_factors(found)
        assert "To avoid" not in page.messages._html["speeds-text"]


def test_the_best_relief_is_that_of_the_datasheet_and_is_taken_beside_the_present_drawing():
    design = DRAWING.reading.design
    found, = best_relief(design)
    sentence, address = relief_text(found, DRAWING)
    least = datasheet(design)["best_loaded_error_peak_to_peak"].value
    taken, _ = opened(address, Opened(PAPER))
    assert taken.kept == DRAWING and f"{least:.3g} µm peak to peak" in sentence
    (own,) = datasheet(taken.start.gears, ["loaded_error_peak_to_peak"]).values()
    (before,) = datasheet(design, ["loaded_error_peak_to_peak"]).values()
    assert own.value == pytest.approx(least, rel=0.02) and own.value < 0.9 * before.value
    there, = best_relief(design.at(torque=30.0))
    assert opened(relief_text(there, DRAWING)[1], Opened(PAPER))[0].start.gears.torque == 30.0
    helical, = best_relief(drawn(design__helix_angle="15 deg", design__centre_distance="").reading.design)
    assert relief_text(helical, DRAWING) == ("The best relief is sought for spur gears alone.", "")


def test_the_teeth_are_drawn_to_scale_and_the_path_of_contact_has_its_length():
    design = DRAWING.reading.design
    picture, geometry = teeth(design), design.geometry
    for wheel, text in enumerate(picture.outlines):
        *outline, centre = (np.array([float(v) for v in pair.split(",")]) for pair in text.split())
        radii = np.linalg.norm(np.array(outline) - centre, axis=1) / 1e3
        assert max(radii) == pytest.approx(geometry.tip_diameter[wheel] / 2, rel=1e-4)
        assert min(radii) == pytest.approx(geometry.root_diameter[wheel] / 2, rel=1e-4)
        assert centre == pytest.approx([0, -131.5 * wheel], abs=1e-3)
    length = math.dist(picture.path[:2], picture.path[2:])
    assert length == pytest.approx(1e3 * geometry.contact_ratio * geometry.base_pitch, rel=1e-3)
    for point in picture.contacts:
        ends = math.dist(point, picture.path[:2]), math.dist(point, picture.path[2:])
        assert sum(ends) == pytest.approx(length, abs=2e-3)
    assert len(picture.contacts) == 2  # amid the time in which two pairs are in contact


def test_teeth_turn_with_the_gap_of_the_motion_and_as_much_backlash_as_there_is_room_for():
    design = DRAWING.reading.design
    found = turning_teeth(design)
    assert found["enlarged"] == 5 and 5 * 0.15 <= 0.2 * found["pitch"] < 10 * 0.15
    assert found["bases"] == [500 * diameter for diameter in design.geometry.base_diameter]
    *_, motion = point_motion(DRAWING.reading.view.moved(3136.0, 60.0).point)  # separates
    sent, count = gaps(motion.trajectory, motion.verdict.period, 75e-6), 64 * 6  # natural vibrations in a mesh period
    contact = motion.trajectory["contact"].values[:count]
    assert sent["samples"] == len(sent["gaps"]) == count and 0 < max(sent["gaps"]) < 75
    assert [gap > 0 for gap in sent["gaps"]] == (contact == 0).tolist() and not contact.all()
    assert len(gaps(motion.trajectory, None, 75e-6)["gaps"]) == 8 * count


def test_another_drawing_keeps_the_point_and_the_map_but_not_another_torque_or_range():
    def page(drawing):
        return Opened(PAPER).drawn(drawing)

    first = page(DRAWING)
    there = replace(first.start.moved(1500.0, 40.0), colour="v_rms")
    view = there.zoomed((1000.0, 2000.0), (20.0, 80.0))
    wider = page(drawn(design__bore="30 mm;60 mm"))
    again = redrawn(view, first, wider)
    assert again.at == view.at and (again.x, again.y) == (view.x, view.y) and again.gears.bore[0] == 0.03
    assert again.colour == "v_rms"
    whole = redrawn(there, first, wider)
    assert (whole.x, whole.at) == (wider.start.x, there.at) and whole.x != there.x
    louder = page(drawn(operation__torque="120 N*m"))
    assert redrawn(there, first, louder).at == (2000.0, 120.0) and redrawn(there, first, louder).y.stop == 300.0
    ranged = redrawn(view, first, page(drawn(range__speed="1000 rpm;3000 rpm")))
    assert (ranged.x.start, ranged.x.stop) == (1000.0, 3000.0) and ranged.y == view.y and ranged.at == view.at


@pytest.mark.parametrize("change", [{}, {"design__module": "8 1/in", "design__centre_distance": "165.1 mm"}])
def test_a_study_file_of_a_drawing_opens_as_it(change):
    page = Opened(PAPER).drawn(drawn(range__speed="1000 rpm;3000 rpm", **change))
    again, _ = opened(f"study={packed(page.toml(page.start))}", Opened(PAPER))
    assert again.start.gears == page.start.gears and (again.start.x, again.start.y) == (page.start.x, page.start.y)
    assert again.drawing["design.module"] == page.drawing["design.module"]
    assert again.named == again.drawn(again.drawing).named


def test_plain_numbers_of_a_study_file_keep_their_units_in_the_form():
    """In a file they are in SI, speeds in rpm; a form offers mm first."""
    text = SPUR.replace('module = "3 mm"', "module = 0.003").replace('speed = "3000 rpm"', "speed = 3000")
    found, _ = opened(f"study={packed(text)}", Opened(PAPER))
    assert (found.drawing["design.module"], found.drawing["operation.speed"]) == ("0.003 m", "3000 rpm")
    assert found.start.gears == load_study(EXAMPLES / "spur_50_50.toml").gears


def test_an_address_opens_a_drawing_the_kept_one_an_example_a_file_or_what_the_server_has():
    own = Opened(PAPER)
    page = own.drawn(drawn(design__bore="30 mm"), DRAWING)
    found, rest = opened(f"?{page.query}speed=1500&torque=40&at=1500.0,40.0", own)
    assert (found.drawing, found.kept, found.named) == (page.drawing, DRAWING, page.named)
    assert from_query(rest, found.start).at == (1500.0, 40.0)
    train, _ = opened("example=train_idler", own)
    assert train.start.gears.meshes == load_study(EXAMPLES / "train_idler.toml").gears.meshes
    assert train.query == "example=train_idler&"
    file, _ = opened(f"study={packed((EXAMPLES / 'spur_50_50.toml').read_text())}", own)
    assert file.start.gears == load_study(EXAMPLES / "spur_50_50.toml").gears
    assert file.drawing["design.teeth"] == "50;50" and not file.drawing["range.speed"]  # a design opens as a drawing
    other, _ = opened(f"study={packed(SPUR + FAULT)}", own)
    assert other.drawing is None and other.named[0][0] == "study"  # the form has no faults
    assert opened("omega=1.5", own) == (own, "omega=1.5")
    assert opened("speed=3000", Opened(GEARS))[0].start is GEARS


@pytest.mark.parametrize(("query", "words"), [
    ("drawing=&design.bore=" + "1" * 300, "200 characters"), ("example=passwd", "one of"), ("study=????", "TOML"),
    (f"study={packed('a = 1')}", "a"), (f"study={packed('[design]' + ' ' * 200_000)}", "30,000 bytes"),
    (f"study={packed('x = 1' + chr(10) + 'y = [')}", "valid TOML"),
    *((f"study={packed(f'[design]{chr(10)}stiffness = {{ table = {path!r} }}')}", "no other file") for path in (
        "/etc/passwd", "../x.csv", "C:\\x.csv"))])
def test_an_address_that_no_page_has_is_refused_and_names_no_file(query, words):
    with pytest.raises(InputError, match=re.escape(words)):
        opened(query, Opened(PAPER))


def test_texts_of_an_address_are_escaped_on_the_page():
    evil = Drawing.of({"design.module": '"><script>alert(1)</script> mm'}.items())
    html = render("features/drawing/form.html.j2", form=form(evil))
    assert "<script>" not in html and "&lt;script&gt;" in html


def test_labels_belong_to_boxes_and_each_box_has_a_name_of_its_own():
    class Form(HTMLParser):
        def __init__(self):
            super().__init__()
            self.labels, self.boxes = set(), []

        def handle_starttag(self, tag, attributes):
            given = dict(attributes)
            if tag == "label":
                self.labels.add(given["for"])
            elif tag in ("input", "select"):
                self.boxes.append(given)

    parsed = Form()
    parsed.feed(render("features/drawing/form.html.j2", form=form(DRAWING)))
    ids = {box["id"] for box in parsed.boxes if "id" in box}
    names = [box["aria-label"] for box in parsed.boxes if "id" not in box]
    assert ids == parsed.labels and len(ids) == len(inputs()) and len(set(names)) == len(names)


def test_a_session_takes_a_drawing_keeps_the_last_right_one_and_compares_it_with_a_kept_one():
    first = Opened(DRAWING.reading.view).drawn(DRAWING)
    one, _ = session(first.start, first)
    page = one.page
    page.messages.act("draw", list(drawn(design__bore="30 mm").texts))
    assert page.view.gears.bore == (0.03, 0.03) and "23/81" in page.messages._html["sheet"]
    page.messages.act("draw", list(drawn(design__bore="300 mm").texts))
    assert page.view.gears.bore == (0.03, 0.03) and 'data-state="wrong"' in page.messages._html["sheet"]
    assert "design.bore=300+mm" in page.messages._page_state.data["address"][0]
    page.messages.act("draw", list(DRAWING.texts))
    page.messages.act("press", "keep")
    assert page.opened.kept == DRAWING and "kept.design.bore" in page.opened.query
    page.messages.act("draw", list(drawn(design__damping_ratio="0.07").texts))
    assert "damping ratio 0.05 → 0.07" in page.messages._html["sheet"]
    page.messages.act("press", "keep")
    assert page.opened.kept is None
    for absurd in (["design.nonsense", "1"], [["design.bore"], "1"], ["design.bore", 1], 3, None, ["design.bore"]):
        page.messages.act("draw", [absurd])
        assert "must be" in page.messages._html["message"] and page.opened.drawing["design.damping_ratio"] == "0.07"
    assert "module = \"2.5 mm\"" in page.opened.toml(page.view)
    own = Opened(PAPER).drawn(DRAWING)
    assert "[gearpair]" in own.toml(own.start.with_value("eps1", 0.3))
    assert 'torque = "45 N*m"' in own.toml(own.start.moved(2000.0, 45.0))


def test_nothing_is_computed_before_a_drawing_is_complete():
    draft = drawn(operation__speed="")
    first = Opened(DRAWING.reading.view).drawn(draft)
    one, workers = session(first.start, first)
    one.start()
    assert not any(worker.jobs for worker in workers)
    assert "torque=60" in one.page.messages._page_state.data["address"][0]
    page = one.page
    page.messages.act("draw", list(DRAWING.texts))
    assert [sorted(worker.jobs) for worker in workers[:2]] == [[FACTORS, "motion"], ["map"]]
    assert workers.quick.asked == ["motion", FACTORS] and page.view.gears == DRAWING.reading.design


def test_all_that_the_start_page_offers_can_be_opened():
    addresses = [each.replace("&amp;", "&") for each in re.findall(r'href="\./\??([^"]*)"', _page())]
    assert len(addresses) > 30
    for address in addresses:
        found, rest = opened(address, Opened(PAPER))
        view = from_query(rest, found.start)
        assert (view.gears is not None) == ("example" in address or "drawing" in address)
    assert opened(addresses[1], Opened(PAPER))[0].drawing == DRAWING
