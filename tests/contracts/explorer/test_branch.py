"""The branch of a motion and the bifurcation curves of the explorer, without a browser."""

import json
import threading
from contextvars import copy_context
from dataclasses import replace

import numpy as np
import pytest

import gearchaos as gc
from gearchaos.continuation.family import ParameterFamily
from gearchaos.errors import InputError
from gearchaos.explorer.core.state import view_of
from gearchaos.explorer.core.style import Units, empty_figure
from gearchaos.explorer.features.assessment.job import assessed
from gearchaos.explorer.features.assessment.speed_line import SpeedLine
from gearchaos.explorer.features.map.panel import SkeletonCurves, skeleton_text
from gearchaos.explorer.features.motion import point as point_studies
from gearchaos.explorer.features.motion.diagram import BifurcationFigure, branch_text
from gearchaos.explorer.features.motion.orbits import PeriodicMotion, branch, obstacle, periodic_motion, skeleton
from gearchaos.explorer.features.motion.panel import verdict_text
from gearchaos.explorer.features.motion.point import point_motion
from gearchaos.flow import StoppedError, cancel_event
from tests.contracts.explorer.test_computations import GEARS, Put

VIEW = view_of(gc.MeshModel.of(omega=2.2, q0=0.1, eps1=0.05), gc.Axis("omega", 2.0, 2.4, 2), gc.Axis("eps1", 0, 0.1, 2))
"""A 1T orbit that loses stability in a flip at ω = 2.145, where motions of 2T begin."""

DESIGN = replace(GEARS, x=replace(GEARS.x, start=2800.0, stop=3200.0))


def first_motion(view):
    return next(iter(point_motion(view.point)))


def branch_of(view):
    (found,) = branch(view, periodic_motion(first_motion(view)))
    return found


@pytest.fixture(scope="module")
def followed():
    return branch_of(VIEW)


def test_a_branch_runs_over_the_whole_line_and_each_of_its_orbits_closes(followed):
    assert json.loads(followed.attrs["range"]) == [2.0, 2.4]
    assert set(followed["unstable"].values) == {0, 1}
    for i in range(0, followed.sizes["point"], 5):
        at = followed.isel(point=i)
        state = {n: float(at[f"section_{n}"][0]) for n in ("x1", "x1_dot", "x2", "x2_dot")}
        motion = gc.simulate(VIEW.point.with_values({"omega": float(at["omega"]), **state}), 1)
        assert motion["section_z"].values == pytest.approx(float(at["section_z"][0]), abs=1e-9)
        assert motion["section_x1"].values == pytest.approx(state["x1"], abs=1e-9)


def test_the_flip_of_a_branch_lies_between_motions_of_one_and_two_periods(followed):
    (flip,) = np.flatnonzero(followed["event_kind"] == "flip")
    value = float(followed["event_value"][flip])
    labels = [gc.regime(VIEW.point.with_values({"omega": value + step})).label for step in (-5e-3, 5e-3)]
    assert labels == ["2T", "1T"]
    text = branch_text(followed, Units())
    assert [words for _, words in text.lines] == ["stable", "unstable"]
    assert ("■", "#2a7fff", "flip (1)") in text.events
    assert text.sentences[0].startswith("Branch of 1T orbits along ω from 2 to 2.4; it ends at 2 (end of the axis)")
    assert text.sentences[1] == f"Stable from {value:.6g} to 2.4."


def test_a_closed_branch_is_called_so_and_its_short_intervals_have_different_ends():
    model = gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.206)
    view = view_of(model, gc.Axis("omega", 0.9, 1.1, 2), gc.Axis("eps1", 0, 0.3, 2))
    found = branch_of(view)
    text = branch_text(found, Units())
    assert found.attrs["period"] == 8 and "closed: it returns to its start (an isola)" in text.sentences[0]
    for part in text.sentences[1].removeprefix("Stable from ").rstrip(".").split(", "):
        low, high = part.split(" to ")
        assert float(low) < float(high)


def test_only_periodic_motions_can_be_followed_and_the_page_says_why():
    found = first_motion(VIEW.moved(2.2, 0.05))
    assert obstacle(found) == "" and verdict_text(found, VIEW, Units()).obstacle == ""
    chaotic = view_of(gc.MeshModel.of(omega=1.0, q0=0.1, eps1=0.23))
    found = first_motion(chaotic)
    assert verdict_text(found, chaotic, Units()).obstacle == (
        "Only a periodic motion can be followed along a parameter; this one is chaotic so far.")
    with pytest.raises(InputError, match="must be periodic"):
        periodic_motion(found)


def test_where_no_orbit_is_found_and_along_initial_values_there_is_a_message():
    motion = PeriodicMotion(VIEW.point, "3T", 3, (("x1", 1.2), ("x1_dot", 0.0), ("x2", 0.0), ("x2_dot", 0.0)))
    with pytest.raises(InputError, match=r"^motion must lie on an orbit of minimal period 3 .* The nearest"):
        next(branch(VIEW, motion))
    view = view_of(VIEW.point, gc.Axis("x1", 0.5, 1.5, 2), gc.Axis("eps1", 0, 0.1, 2))
    with pytest.raises(InputError, match="line must vary a parameter"):
        next(branch(view, periodic_motion(first_motion(VIEW))))
    with pytest.raises(InputError, match="axis must be a parameter for bifurcation curves"):
        list(skeleton(view, 1))


def test_a_branch_of_gears_is_in_their_units_and_its_parameter_in_that_of_the_axis():
    found = branch_of(DESIGN)
    scale = DESIGN.gears.to_pair().scales.length * 1e6
    value = float(found["speed"][0])
    plain = branch_of(replace(DESIGN, physical=False))
    assert found["section_z"].attrs["units"] == "µm"
    assert found["section_z"].values == pytest.approx(plain["section_z"].values * scale, rel=1e-12)
    assert value == 2800.0 and json.loads(found.attrs["range"]) == [2800.0, 3200.0]
    text = branch_text(found, Units(DESIGN.gears, marked=True))
    assert "along n₁ from 2800 to 3200 rpm" in text.sentences[0]


def test_along_the_frequency_of_gears_diagram_and_branch_stay_on_the_axis_of_the_page():
    view = DESIGN.with_axis("x", "omega")
    view = replace(view, x=replace(view.x, start=0.65, stop=0.75))
    found = branch_of(view)
    assert found["omega"].values.min() == 0.65 and json.loads(found.attrs["range"]) == [0.65, 0.75]
    assert found["section_z"].attrs["units"] == "µm"
    (diagram,) = (d for d in point_studies.bifurcation(view, 40) if d)
    assert diagram["omega"].values[[0, -1]].tolist() == [0.65, 0.75]
    assert diagram["section_z"].attrs["units"] == "µm"


def test_the_diagram_makes_room_for_a_branch_and_takes_it_back(followed):
    figure = BifurcationFigure(sent := Put())
    (diagram,) = (d for d in point_studies.bifurcation(VIEW, 20) if d)
    figure.show(diagram, Units())
    limits = dict(sent[figure.figure.y_range.id])
    high = limits["end"] + 0.1
    figure.show_branch(followed.assign(section_z=followed["section_z"] + high - followed["section_z"].max()), Units())
    assert sent[figure.figure.y_range.id]["end"] > high
    assert sent[figure.branch.stable.id]["data"]["xs"] and sent[figure.branch.unstable.id]["data"]["xs"]
    far = followed.assign(section_z=1000 * followed["section_z"])
    figure.show_branch(far, Units())
    assert sent[figure.figure.y_range.id]["end"] < 10
    figure.clear_branch()
    assert sent[figure.figure.y_range.id] == limits
    assert sent[figure.branch.stable.id]["data"]["xs"] == sent[figure.branch.events.id]["data"]["x"] == []


def test_events_have_a_marker_on_every_point_of_their_orbit_and_say_what_they_are(followed):
    figure = BifurcationFigure(sent := Put())
    figure.show_branch(followed, Units())
    data = sent[figure.branch.events.id]["data"]
    assert len(data["x"]) == followed["event_section_z"].size
    flip = data["kind"].index("flip of 1T")
    assert data["at"][flip] == f"ω = {data['x'][flip]:.6g}" and data["multipliers"][flip].startswith("−1, ")
    assert data["marker"][flip] == "square"


@pytest.fixture(scope="module")
def curves_found():
    return list(skeleton(VIEW, 1))


def test_a_flip_curve_separates_motions_of_one_and_two_periods(curves_found):
    first, *_, last = curves_found
    assert first.curves == () and first.searched == 0 and last.searched == last.lines
    assert [s.searched for s in curves_found] == sorted(s.searched for s in curves_found)
    curve = next(c for c in last.curves if c.kind == "flip" and c.x.max() > 2.1)
    i = int(np.argmin(abs(curve.y - 0.02)))
    labels = [gc.regime(VIEW.point.with_values({"omega": curve.x[i] + step, "eps1": curve.y[i]})).label
              for step in (-5e-3, 5e-3)]
    assert labels == ["2T", "1T"]
    text = skeleton_text(last)
    assert text.complete and text.curves == len(last.curves)
    assert ("#2a7fff", False, "flip") in text.legend
    assert not skeleton_text(first).complete and "line 1 of" in skeleton_text(first).status
    assert not skeleton_text(None).complete


def test_curves_are_drawn_by_their_kind_and_grazes_dotted(curves_found):
    drawn = SkeletonCurves(empty_figure(), sent := Put())
    curves = curves_found[-1].curves
    drawn.show(curves)
    solid, dotted = sent[drawn.solid.id]["data"], sent[drawn.dotted.id]["data"]
    assert len(dotted["xs"]) == sum(c.kind == "graze" for c in curves) > 0
    assert len(solid["xs"]) == len(curves) - len(dotted["xs"]) > 0
    drawn.show(())
    assert sent[drawn.solid.id]["data"]["xs"] == sent[drawn.dotted.id]["data"]["xs"] == []


@pytest.mark.parametrize(("work", "steps"), [
    (lambda: branch(VIEW, periodic_motion(first_motion(VIEW))), 0), (lambda: skeleton(VIEW, 1), 1),
    pytest.param(lambda: assessed(SpeedLine(GEARS)), 1, marks=pytest.mark.slow)])
def test_each_can_be_cancelled(work, steps):
    cancelled, context = threading.Event(), copy_context()
    context.run(cancel_event.set, cancelled)
    generator = work()
    for _ in range(steps):
        context.run(next, generator)
    cancelled.set()
    with pytest.raises(StoppedError):
        context.run(list, generator)
    family = ParameterFamily(VIEW.point, ("omega",))
    with pytest.raises(StoppedError):
        context.run(family.flow(family.start[None]).advance, family.initial_states(family.start[None]))
