"""The datasheet as a page: complete, self-contained, with pictures of the design and reasons for what is missing."""

from __future__ import annotations

import re
from html.parser import HTMLParser
from xml.etree import ElementTree

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.datasheet.answer import DesignAnswer
from gearchaos.datasheet.page import sheet_html
from gearchaos.datasheet.quantities import Entry, datasheet
from gearchaos.studies.speeds.speeds_to_avoid import speeds_to_avoid

pytestmark = pytest.mark.slow

BARE = {"teeth": (12, 40), "module": "3 mm", "face_width": "20 mm", "profile_shift": (0.4, -0.1)}
FULL = {
    "teeth": (17, 103), "module": "8 mm", "helix_angle": "15.8 deg", "face_width": ["100 mm", "98 mm"],
    "centre_distance": "500 mm", "profile_shift": (0.145, 0.0), "tip_diameter": ("159.66 mm", "872.35 mm"),
    "rack": {"addendum": 1.0, "dedendum": 1.4, "root_radius": 0.39}, "bore": ["30 mm", "60 mm"],
    "quality": {"standard": "ISO 1328-1:1995", "grade": [5, 6]}, "transmission_error": "from quality",
    "backlash": {"value": "0.3 mm", "of": "line of action, total"}, "damping_ratio": 0.05, "speed": "360 rpm",
    "torque": "9000 N*m",
}


def page_of(design, speeds=None):
    return sheet_html([DesignAnswer.of(design, speeds)])


class Page(HTMLParser):
    """Elements that stay open, identifiers, the texts of table rows by identifier, and all text."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.open, self.ids, self.rows, self.tags, self.text, self.row = [], [], {}, set(), "", None
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        found = dict(attrs).get("id")
        self.tags.add(tag)
        self.open += [tag] * (tag not in ("meta", "br", "img", "link", "hr"))
        self.ids += [found] * (found is not None)
        if tag == "tr":
            self.row = found
            self.rows.setdefault(found, "")

    def handle_endtag(self, tag):
        assert self.open.pop() == tag
        self.row = None if tag == "tr" else self.row

    def handle_data(self, data):
        self.text += data
        if self.row:
            self.rows[self.row] += data


@pytest.fixture(scope="module", params=[BARE, FULL], ids=["bare", "full"])
def sheet(request):
    """A design, its datasheet and its page, as HTML and read."""
    design = gc.GearDesign(**request.param)
    html = page_of(design)
    return design, datasheet(design), html, Page(html)


def test_every_quantity_has_a_row_with_its_value_or_its_reason(sheet):
    _, entries, _, page = sheet
    assert [key.removeprefix("q-") for key in page.rows if key] == list(entries)
    for name, entry in entries.items():
        text = " ".join(page.rows[f"q-{name}"].split())
        if entry.value is None:
            assert (entry.reason if entry.expected else "see Not computed") in text
            continue
        for value in (entry.shown if isinstance(entry.shown, tuple) else (entry.shown,))[:6]:
            assert f"{value:.6g}".replace("-", "−") in text, name
        plain = re.sub(r"_", "", f"{entry.symbol} {entry.source}")
        assert all(word in text for word in plain.split()), (name, text)


def test_the_page_is_well_formed_and_refers_to_nothing_outside(sheet):
    _, _, html, page = sheet
    assert page.open == [] and len(page.ids) == len(set(page.ids))
    assert not page.tags & {"script", "link", "img", "iframe"}
    outside = set(re.findall(r"https?://[^\s\"'<)]+", html))
    assert outside <= {"http://www.w3.org/2000/svg", "http://www.w3.org/1999/xlink"}
    for target in re.findall(r'href="#([^"]+)"|url\(#([^)]+)\)', html):
        assert "".join(target) in page.ids


def test_the_pictures_are_svg_of_this_design(sheet):
    design, _, html, _ = sheet
    found = re.findall(r"<svg .*?</svg>", html, re.DOTALL)
    assert len(found) == (5 if design.under_load else 3) and f"{design.teeth[0]}/{design.teeth[1]}" in html
    for svg in found:
        root = ElementTree.fromstring(svg)
        assert root.get("viewBox") and root.get("width") is None and root.get("role") == "img"


def test_missing_inputs_are_named_with_the_quantities_that_need_them(sheet):
    design, entries, html, _ = sheet
    if design.bore is not None:  # nothing is missing; what has no value left out
        values = {n: e for n, e in entries.items() if e.value is not None}
        assert 'id="missing"' not in sheet_html([DesignAnswer(design, values)])
        assert "is an assumption, both wheels at the limit of the grade" in html
        return
    missing = html[html.index('id="missing"'):]
    for field in ("backlash", "bore", "speed", "quality", "damping_ratio"):
        assert f"{field} must be given" in missing
    assert "dynamic factor by ISO 6336-1, method B" in missing and "got None" not in html
    assert page_of(design) == html, "the same design makes the same page"


def test_a_picture_that_cannot_be_drawn_and_what_has_no_value_have_their_reasons():
    html = page_of(gc.GearDesign(**BARE, stiffness="potential energy",
                                 quality={"standard": "ISO 1328-1:2013", "grade": 6}))
    assert html.count("<svg ") == 2 and "Not drawn: bore must be given" in html
    assert "no formula for f<sub>i</sub>′ in terms of f<sub>pt</sub> and F<sub>α</sub>" in html
    assert "damping_ratio must be given" in html


def test_text_from_a_design_is_escaped_and_long_lists_are_cut_short():
    design = gc.GearDesign(**BARE)
    entry = Entry(value=1.0, unit="<b>", symbol="<i>", formula="a < b", source="<script>", group="<u>")
    many = Entry(value=tuple(np.arange(20.0).tolist()), unit="µm", symbol="e_j", formula="", source="", group="g")
    html = sheet_html([DesignAnswer(design, {**datasheet(design), "x": entry, "e": many})])
    assert "<script>" not in html and "a &lt; b" in html and "<u>" not in html
    assert "5 and 14 more" in Page(html).rows["q-e"]


def test_warnings_of_the_design_are_shown():
    thin = gc.GearDesign(**{**BARE, "profile_shift": (0.75, 0.0)})
    shown = Page(page_of(thin)).text
    assert thin.warnings and all(re.sub("_", "", warning) in shown for warning in thin.warnings)  # of thin tips


def test_what_is_expected_to_lack_a_value_is_no_alert():
    design = gc.GearDesign(**{**BARE, "bore": "10 mm", "torque": "50 N*m", "damping_ratio": 0.05,
                              "backlash": {"value": "0.05 mm", "of": "line of action"},
                              "quality": {"standard": "ISO 1328-1:2013", "grade": 6}, "transmission_error": "none"})
    alone = page_of(design)
    assert '<tr id="q-support_frequency">' in alone and '<tr id="q-Kv_AGMA" class="missing">' in alone
    along = page_of(design, speeds_to_avoid(design, "1000:2000:2", starts=0))
    assert along.count("<svg ") == 5 and "Dynamic factor along the speed" in along and "Mesh deflection" in along
    assert '<tr id="q-Kv_AGMA">' in along and "speed must be given" not in along
    row = " ".join(Page(along).rows["q-Kv_AGMA"].split())
    assert row.startswith("dynamic factor by AGMA 2001-D04 Kv – depends on speed: see the curve")
    missing = along[along.index('id="missing"'):]
    assert "rigid" not in missing and "depends on" not in missing


def test_the_page_begins_with_the_answer_at_each_torque():
    design = gc.GearDesign(**BARE, damping_ratio=0.05, quality={"standard": "ISO 1328-1:1995", "grade": 9},
                           backlash={"value": "0.05 mm", "of": "line of action, total"}, bore="10 mm",
                           transmission_error="from quality")
    answers = [DesignAnswer.of(at, speeds_to_avoid(at, "12000:16000:2", starts=0))
               for at in (design.at(torque=20.0), design.at(torque=60.0))]
    html = sheet_html(answers)
    page = Page(html)
    assert len(page.ids) == len(set(page.ids)) and page.open == []
    assert html.index("Speeds to avoid at 20 N m") < html.index("Speeds to avoid at 60 N m") < html.index("The pair")
    for answer in answers:
        assert answer.speeds.windows and all(f"{text[1:]}." in page.text for text in answer.decision)
        assert all(re.sub("_", "", text) in page.text for text in (*answer.basis, *answer.notes))
    assert page.text.count(answers[0].notes[0]) == 1
    differing = page.text[page.text.index("What differs at 60 N m"):]
    assert "line load" in differing and "gear ratio" not in differing


@pytest.mark.parametrize(("given", "words"), [
    ({}, "stiffness by ISO 6336-1, no transmission error:"),
    ({"quality": {"standard": "ISO 1328-1:1995", "grade": 6}}, "no transmission error in spite of the grade"),
    ({"material": ["POM", "steel"]}, "stiffness by ISO 6336-1 (found for metals), no")])
def test_what_is_assumed_says_what_was_left_out(given, words):
    design = gc.GearDesign(teeth=(20, 40), module="3 mm", face_width="20 mm", **given)
    assert words in dict(DesignAnswer.of(design).facts)["assumed"]
