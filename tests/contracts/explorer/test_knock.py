"""What a knock does to the motion of the explorer, without a browser: numbers of an assessment, lines, words, when it
goes."""

from dataclasses import replace

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.errors import InputError
from gearchaos.explorer.core.opened import Opened
from gearchaos.explorer.core.state import view_of
from gearchaos.explorer.core.style import Units
from gearchaos.explorer.features.knock.job import AFTER, BEFORE, knocked_motion, motion_to_knock
from gearchaos.explorer.features.knock.panel import KnockFigure, knock_text
from gearchaos.explorer.features.motion.point import point_motion
from gearchaos.explorer.web.page import Page
from gearchaos.studyfile import load_study
from tests import EXAMPLES
from tests.contracts.explorer.test_computations import GEARS, PAIR, PAPER, TRAIN, Put, session

VIEW = GEARS.moved(1300.0, 250.0)
SAMPLES = 48  # in a mesh period


def motion(view):
    *_, found = point_motion(view.point)
    return found


def knocked(view):
    found = motion(view)
    (last,) = knocked_motion(motion_to_knock(found), found.verdict.dynamic_factor)
    return last


@pytest.fixture(scope="module")
def found():
    return knocked(VIEW)


@pytest.mark.slow
def test_the_least_knock_is_that_of_an_assessment_of_this_speed(found):
    at = gc.assess(VIEW.operating_point.gears, "1300:1300.1:2", 250, starts=0, spacing=0.5).at[0]
    (knock,) = at.knocks
    assert found.knock.speed_step == pytest.approx(knock.speed_step, rel=0.1)
    assert found.knock.dynamic_factor == pytest.approx(knock.dynamic_factor, rel=1e-3)
    assert f"{found.largest:.3g}" in at.tried


@pytest.mark.parametrize("view", [VIEW, view_of(load_study(EXAMPLES / "spur_50_50.toml").model).moved(3000.0, 300.0)],
                         ids=["one spring", "tooth pairs"])
def test_half_of_the_least_knock_comes_back_and_the_whole_does_not(view):
    found, own = knocked(view), motion(view)
    without, half, whole = found.z
    first = BEFORE * SAMPLES
    assert len(found.time) == len(without) == (BEFORE + AFTER) * SAMPLES and found.time[first] == 0.0
    np.testing.assert_array_equal(half[:first], without[:first])
    np.testing.assert_allclose(without[SAMPLES:], without[:-SAMPLES], atol=1e-9)  # the orbit goes on through the knock
    assert without.max() - without.min() == pytest.approx(own.verdict.z_peak_to_peak, rel=0.02)
    slopes = [np.diff(line[first:first + 2])[0] for line in (without, half, whole)]
    assert slopes[2] - slopes[0] == pytest.approx(2 * (slopes[1] - slopes[0]), rel=0.05)  # half of the step
    np.testing.assert_allclose(half[-2 * SAMPLES:], without[-2 * SAMPLES:], atol=1e-3)
    assert np.abs(whole - without)[-2 * SAMPLES:].max() > 0.1 and whole.min() < 1
    assert found.back and not found.beyond and found.half.dynamic_factor == own.verdict.dynamic_factor


def test_a_motion_of_period_two_goes_on_through_the_knock():
    own = motion_to_knock(motion(VIEW))
    (twice,) = knocked_motion(replace(own, period=2), 1.5)
    np.testing.assert_allclose(twice.z[0, SAMPLES:], twice.z[0, :-SAMPLES], atol=1e-9)


def test_words_and_lines(found):
    text, figure = knock_text(found), KnockFigure(put := Put())
    step, impulse = found.knock.speed_step, found.knock.impulse
    assert text.sentences[0].startswith(
        f"The least knock that leads to a motion to avoid is {abs(step):.2g} rpm of wheel 1 ({abs(impulse):.2g} N m s)")
    assert f"the teeth separate, with a dynamic factor of {found.knock.dynamic_factor:.3g}" in text.sentences[0]
    assert text.sentences[1] == f"Half of it leads back to this motion, with a dynamic factor of {1.57}."
    units = Units(VIEW.gears, True)
    figure.show(found, units)
    for source, line in zip(figure.lines, found.z, strict=True):
        np.testing.assert_allclose(put[source.id]["data"]["y"], line * units.one("z"), rtol=1e-6)
    assert put[figure.figure.yaxis[0].id]["axis_label"].endswith("[µm]")
    beyond = replace(found, knock=replace(found.knock, beyond_the_teeth=True), back=False, half=replace(
        found.half, contact=1))
    sentences = knock_text(beyond).sentences
    assert "which is beyond the teeth" in sentences[0] and "to a motion to avoid, in which the teeth" in sentences[1]
    none = knock_text(replace(found, knock=None, half=None))
    assert none.sentences == ["No knock up to 584 rpm of wheel 1 leads from this motion to one to avoid."]
    assert not none.legend.entries


@pytest.mark.parametrize(("view", "words"), [
    (GEARS.moved(3000.0, 100.0), "motion must keep contact"), (PAIR.with_value("torque", 0.0), "torque must not be 0")])
def test_motions_to_avoid_and_without_load_are_refused_in_words(view, words):
    with pytest.raises(InputError, match=words):
        motion_to_knock(motion(view))


def test_pairs_have_the_button_and_it_goes_with_the_point(found):
    for view, has in ((VIEW, True), (PAIR, True), (PAPER, False), (TRAIN, False)):
        assert ("knock" in Page(Opened(view), view).roots()) == has
    opened, workers = session(VIEW, GEARS)
    page, computed = opened.page, opened.computations
    page.messages.act("press", "knock")
    assert workers.branches.asked == []  # the motion is not known yet
    computed.point_motion = motion(VIEW)
    page.messages.act("press", "knock")
    assert workers.branches.asked == ["knock"]
    workers.branches.jobs["knock"].show(found)
    assert page.messages._html["knock-text"] and computed.knocked is found
    opened.change(lambda view: view.with_value("torque", 240.0))
    assert computed.knocked is None and page.messages._html["knock-text"] == ""


def test_a_train_and_a_dimensionless_model_have_none():
    for view in (TRAIN, PAPER):
        opened, workers = session(view, view)
        opened.page.messages.act("press", "knock")
        assert workers.branches.asked == [] and "choose a pair" in opened.page.messages._html["message"]
