"""What tolerances do at the point of the explorer, without a browser: numbers, inputs, words, cloud, when it goes."""

from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
import xarray as xr

import gearchaos as gc
from gearchaos.cli.explore import _view
from gearchaos.datasheet.scatter import answer, scatter_document
from gearchaos.errors import InputError
from gearchaos.explorer.core.opened import Opened
from gearchaos.explorer.core.progress import Part, Progress
from gearchaos.explorer.core.text import from_query, to_query
from gearchaos.explorer.features.tolerances import job as jobs
from gearchaos.explorer.features.tolerances.job import tolerances
from gearchaos.explorer.features.tolerances.panel import CloudFigure, cloud_text, most_followed
from gearchaos.explorer.web.page import Page
from gearchaos.plot.classes import CONTACT_CLASSES
from gearchaos.studies.uncertainty.scattered_models import uncertain_inputs
from gearchaos.studyfile import load_design, load_study
from tests import ONE_SPRING
from tests.contracts.explorer.test_computations import GEARS, PAIR, PAPER, TRAIN, Put, session

SPUR = ONE_SPRING
DESIGN = load_design(SPUR)
VIEW = GEARS.moved(3000.0, 100.0)
ASSUMED = ("quality.deviations=within the grade", "damping_ratio=0.035:0.065", "backlash=0.084:0.156 mm")


def computed(view, designs=512):
    with patch.object(jobs, "_DESIGNS", designs):
        *before, last = tolerances(view)
    (part,) = [each for each in before if isinstance(each, Part)]
    assert all(0 <= each.share <= 1 for each in before if isinstance(each, Progress))
    assert part.found.dataset.sizes["sample"] == 64 and last.dataset.sizes["sample"] == designs
    return last


@pytest.fixture(scope="module")
def found():
    return computed(VIEW)


@pytest.fixture(scope="module")
def with_lists():
    """That of a pair whose study file has inputs of its own, of which the grade decides."""
    return computed(replace(VIEW, vary=("stiffness=ISO 6336-1,potential energy", "quality.grade=4,8",
                                        "damping_ratio=0.049:0.051")), 64)


@pytest.mark.slow
def test_the_numbers_are_those_of_scatter(found):
    expected = gc.scatter(DESIGN, ASSUMED, "speed=3000:3000:1", [100], samples=512, indices=False)
    assert found.dataset.equals(expected)
    assert 0.5 < float(expected.anywhere.sel(outcome="contact loss")[0]) < 0.8


def test_the_gears_as_they_are_have_the_motion_of_the_point(found):
    verdict = gc.regime(VIEW.point)
    assert found.contact == verdict.contact == "one-sided"
    assert found.factor == pytest.approx(verdict.dynamic_factor / 1.75, rel=1e-6)
    assert found.values == (None, None, pytest.approx(0.05), pytest.approx(0.12))  # no deviations; ζ; mm


@pytest.mark.parametrize(("gears", "expected"), [
    (DESIGN, ASSUMED), (replace(DESIGN, transmission_error="from quality (typical)"), ASSUMED),
    (replace(DESIGN, transmission_error="none"), ASSUMED[1:]),
    (replace(DESIGN, quality={"standard": "ISO 1328-1:1995", "grade": 6, "deviations": [0.4, 0]}), ASSUMED[1:]),
    (replace(DESIGN, backlash={"value": "10 arcmin", "of": "angle of wheel 1"}),
     (*ASSUMED[:2], "backlash=0.002036:0.003782")),
    (replace(DESIGN, backlash={"tooth_thickness_allowances": ["-60 um", "-80 um"]}), ASSUMED[:2]),
    (PAIR.gears, ("k=371:689 N*s/m", "backlash=0.084:0.156 mm")),
    (VIEW.with_value("zeta", 0.1).with_value("backlash", 200.0).gears,  # inputs follow the page
     (ASSUMED[0], "damping_ratio=0.07:0.13", "backlash=0.14:0.26 mm")),
], ids=range(8))
def test_inputs_are_assumed_that_the_gears_give_and_scatter_takes(gears, expected):
    assert uncertain_inputs(gears) == expected
    at_point = gears.at(speed=3000) if gears is not PAIR.gears else PAIR.operating_point
    gc.Scatter(at_point, expected, "speed=3000:3000:1", [100], samples=32)


@pytest.mark.parametrize(("change", "name"), [
    (lambda view: view.with_value("eps1", 0.2), "eps1"), (lambda view: view.with_value("chi1", 0.2), "chi1"),
    (lambda view: view.with_stiffness("harmonics"), "stiffness"),
    (lambda view: view.with_stiffness("steps"), "stiffness")])
def test_what_was_set_apart_from_the_gears_is_refused_in_words(change, name):
    with pytest.raises(InputError, match=f"^{name} must be that of the gears"):
        list(tolerances(change(VIEW)))


def test_the_inputs_of_a_study_file_come_first(tmp_path):
    path = tmp_path / "study.toml"
    path.write_text(SPUR.read_text().partition("[study]")[0] + """
[study]
kind = "scatter"
vary = ["quality.grade=5:8", { name = "damping_ratio", low = 0.04, high = 0.06 }]
speed = "speed=1500:5500:3"
""")
    view = _view(load_study(path), [], False)
    assert view.vary == ("quality.grade=5:8", "damping_ratio=0.04:0.06") and GEARS.vary == ()
    assert from_query(to_query(view, view), view).vary == view.vary
    assert view.moved(3000.0, 90.0).zoomed((2000.0, 4000.0), (50.0, 150.0)).vary == view.vary
    assert from_query("?kind=single", view).vary == ()


def test_pairs_have_the_figure_and_a_button_that_asks():
    for view, has in ((VIEW, True), (PAIR, True), (PAPER, False), (TRAIN, False)):
        assert ("cloud" in Page(Opened(view), view).roots()) == has
    opened, workers = session(VIEW, GEARS)
    opened.page.messages.act("press", "tolerances")
    assert workers.branches.asked == ["tolerances"]


def test_words_are_those_of_the_command(found):
    text, content = cloud_text(found, VIEW), scatter_document(found.dataset)
    expected = answer(content, content["torques"][0])
    assert [each.lower() for each in text.sentences[:-1]] == [f"{each}.".lower() for each in expected]
    value, low, high = (float(found.dataset[f"anywhere{end}"].sel(outcome="contact loss")[0])
                        for end in ("", "_lo", "_hi"))
    assert text.sentences[0] == (f"100 N m: contact is lost in operation with probability {value:.2f} ({low:.2f} to "
                                 f"{high:.2f}) at 3000 rpm.")
    assert text.sentences[-1] == ("The gears as they are, at the limit of the grade: separation, dynamic factor "
                                  "2.89 times the quasi-static ratio.")
    assert "backlash 0.084:0.156 mm" in text.tried[0] and "assumed: 30 %" in text.tried[-1]
    assert [name for _, name in text.legend.entries] == ["in contact", "separation", "both flanks",
                                                         "the gears as they are"]


@pytest.mark.slow
def test_words_say_whose_inputs_they_are(with_lists):
    text = cloud_text(with_lists, replace(VIEW, vary=("quality.grade=4,8",)))
    assert "of the study file" in text.tried[-1] and "at the limit" not in text.sentences[-1]


def drawn(found):
    """What is set of the designs, the gears as they are, their level, and the axes."""
    figure = CloudFigure(put := Put())
    figure.show(found)
    parts = (figure.designs, figure.own, figure.level, figure.figure.xaxis[0], figure.figure.x_range)
    return [put[part.id] for part in parts]


def test_each_design_is_a_point_in_the_colour_of_its_contact(found):
    designs, own, level, _, ends = drawn(found)
    ds, number = found.dataset, most_followed(found.dataset)
    np.testing.assert_array_equal(designs["data"]["y"], ds.sample_factor[0])
    np.testing.assert_array_equal(designs["data"]["x"], ds.sample_value[number])
    lost = [colour != CONTACT_CLASSES[0].colour for colour in designs["data"]["colour"]]
    np.testing.assert_array_equal(lost, ds.sample_share_lost[0] == 1)
    both = designs["data"]["colour"].count(CONTACT_CLASSES[2].colour) / 512
    assert both == pytest.approx(float(ds.anywhere.sel(outcome="both flanks hit")[0]), abs=1e-12) and both > 0
    assert own["data"]["x"] == [] and level["location"] == found.factor  # they have no deviation of their own
    assert ends["start"] < min(designs["data"]["x"]) and ends["end"] > max(designs["data"]["x"])


@pytest.mark.slow
def test_the_gears_as_they_are_are_marked_at_their_value():
    one = computed(replace(VIEW.moved(700.0, 100.0), vary=("damping_ratio=0.03:0.1",)), 64)
    _, own, _, axis, _ = drawn(one)
    assert own["data"] == {"x": [pytest.approx(0.05)], "y": [one.factor]} and axis["axis_label"] == "damping_ratio"


def test_lists_are_drawn_at_their_numbers(with_lists):
    designs, own, *_, axis, _ = drawn(with_lists)
    assert axis["axis_label"] == "quality.grade" and set(designs["data"]["x"]) == {4.0, 8.0} and own["data"]["x"] == []
    ds = with_lists.dataset
    of_stiffness = replace(with_lists, dataset=ds.isel(varied=[0]), values=(None,))
    designs, *_, axis, _ = drawn(of_stiffness)
    assert axis["axis_label"] == "stiffness: 1 ISO 6336-1, 2 potential energy"
    known = np.isfinite(ds.sample_factor.values[0])  # the others are beyond the teeth
    np.testing.assert_array_equal(designs["data"]["x"], ds.sample_value.values[0, known] + 1)
    assert 0 < known.sum() < known.size


def test_the_axis_is_the_input_that_the_factor_follows_most():
    values = np.random.default_rng(0).random((3, 512))
    factor = (values[1] - 0.5) ** 2 + 0.01 * values[0]  # not monotonous
    factor[:5], factor[5:9] = np.nan, np.inf  # not possible, diverged
    ds = xr.Dataset({"sample_factor": (("torque", "sample"), factor[None]),
                     "sample_value": (("varied", "sample"), values)})
    assert most_followed(ds) == 1
    assert most_followed(ds.assign(sample_factor=ds.sample_factor * np.nan)) == 0


def test_what_diverges_is_not_drawn(found):
    factor = found.dataset.sample_factor.values.copy()
    factor[0, :3], factor[0, 3] = np.inf, np.nan
    one = replace(found, dataset=found.dataset.assign(sample_factor=(("torque", "sample"), factor)), factor=np.nan)
    designs, own, level, *_ = drawn(one)
    assert len(designs["data"]["x"]) == 508 and own["data"]["x"] == [] and level["location"] is None
    assert "dynamic factor" not in cloud_text(one, VIEW).sentences[-1]
