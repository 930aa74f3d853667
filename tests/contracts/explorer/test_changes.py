"""Changed designs in the explorer, without a browser: their numbers, words, the drawings that have them, files."""

import json
from dataclasses import replace

import pytest

import gearchaos as gc
from gearchaos.datasheet.report import changed_in_words
from gearchaos.explorer.core.drawing import EXAMPLE, Drawing
from gearchaos.explorer.core.opened import Opened, opened
from gearchaos.explorer.core.progress import Part
from gearchaos.explorer.features.assessment.speed_line import SpeedLine
from gearchaos.explorer.features.changes.job import changed_designs
from gearchaos.explorer.features.changes.panel import changes_text
from gearchaos.explorer.web import export
from gearchaos.studies.speeds.changed_designs import assumptions, improvements
from tests.contracts.explorer.test_computations import PAPER

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore::gearchaos.errors.DesignWarning")]

DRAWING = Drawing.of({**EXAMPLE, "range.speed": "2700 rpm;2900 rpm", "operation.torque": "20 N*m"}.items())
LINE = SpeedLine(replace(DRAWING.reading.view, change="none"))


@pytest.fixture(scope="module")
def steps():
    return list(changed_designs(LINE))


def test_each_change_is_assessed_as_the_design_itself_and_parts_come_first(steps):
    *before, report = steps
    design = DRAWING.reading.design
    changes = list(improvements(design))
    parts = [each for each in before if isinstance(each, Part)]
    assert [len(each.found.improvements) for each in parts] == list(range(len(changes)))
    assert parts[3].lacks == f"{len(changes) - 3} of {len(changes)} changes"
    done = 0
    for each in before:
        done += isinstance(each, Part)
        assert isinstance(each, Part) or done <= each.share * (len(changes) + 1) <= done + 1
    options = {"speed": "2700.0:2900.0", "load_change": None}
    assert json.dumps(report.found.document()) == json.dumps(gc.assess(design, **options).document())
    relieved = gc.assess(replace(design, **changes[0].fields), **options)
    assert json.dumps(report.improvements[0].assessment.document()) == json.dumps(relieved.document())


def test_what_helps_stands_first_and_a_change_is_taken_as_a_drawing_beside_the_present_one(steps):
    report = steps[-1]
    text = changes_text(report, DRAWING)
    assert report.helps_most and report.as_given[1:] in text.sentences[0]
    assert changed_in_words(report.helps_most[0], report.found)[1:] in text.rows[0][0]
    assert len(text.rows) == len(report.improvements)
    ordered = [*report.helps_most, *(each for each in report.improvements if each not in report.helps_most)]
    for (words, address), each in zip(text.rows, ordered, strict=True):
        assert each.value in words and bool(address) == (each.assessment is not None)
        if not address:
            continue
        found, _ = opened(address, Opened(PAPER))
        assert found.kept == DRAWING
        (change,) = [c for c in improvements(DRAWING.reading.design) if (c.name, c.value) == (each.name, each.value)]
        expected = replace(DRAWING.reading.design, **change.fields)
        own = found.drawing.reading.design
        assert own.profile_shift == pytest.approx(expected.profile_shift, abs=1e-4)
        assert (own.rack, own.tip_relief is None) == (expected.rack, expected.tip_relief is None)
        assert own.backlash_line_of_action == pytest.approx(expected.backlash_line_of_action, rel=1e-5)
        if own.tip_relief:
            assert own.tip_relief.amount == pytest.approx(expected.tip_relief.amount, rel=1e-5)
    assert all(not address for _, address in changes_text(report, None).rows)


def test_what_a_change_leaves_out_is_left_out_of_the_drawing():
    relief = {"design.tip_relief.amount": "8 um", "design.tip_relief.start_diameter": "63 mm;207.5 mm"}
    relieved = Drawing.of({**EXAMPLE, **relief}.items())
    for change in (*improvements(relieved.reading.design), *assumptions(relieved.reading.design)):
        if change.name == "tip relief" and change.fields["tip_relief"] is None:
            assert relieved.changed(change.fields) == Drawing.of(EXAMPLE.items())
            return
    pytest.fail("no change takes the relief away")


def test_it_is_saved_as_a_page_with_all_changes(steps):
    (page, media, name), = export.assessment("changes", "html", steps[-1], LINE)
    assert (media, name) == ("text/html", "gearchaos-changes.html") and "What to change" in page.decode()
    (content, *_), = export.assessment("changes", "json", steps[-1], LINE)
    assert len(json.loads(content)["improvements"]) == len(steps[-1].improvements)
