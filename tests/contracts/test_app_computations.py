"""What the explorer computes for a page, and in which order: without threads, processes or a browser."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from gearchaos.explorer.jobs.computations import Computations
from gearchaos.explorer.jobs.map_grid import Map
from gearchaos.explorer.jobs.point_motion import PointMotion
from gearchaos.explorer.view.presets import presets

VIEW = presets()["2"].view
NOTHING = np.zeros(0)


class Worker:
    """Keeps jobs instead of running them; ``asked`` has their tasks in order."""

    def __init__(self):
        self.jobs, self.asked = {}, []

    def submit(self, owner, task, job):
        self.jobs[task] = job
        self.asked.append(task)

    def cancel(self, owner, task=None):
        for name in [task] if task else list(self.jobs):
            self.jobs.pop(name, None)


class Display:
    """Keeps what is shown, by the name of the method."""

    def __init__(self):
        self.shown = {}

    def __getattr__(self, name):
        return lambda *values: self.shown.setdefault(name, []).append(values)


class Page:
    """The computations of a page, between two workers and a display."""

    def __init__(self, view=VIEW):
        self.quick, self.slow, self.display = Worker(), Worker(), Display()
        self.computations = Computations("page", view, (self.quick, self.slow), lambda call: call(), self.display)
        self.view = view
        self.computations.start()

    def move(self, view):
        before, self.view = self.view, view
        self.computations.update(view)
        return before

    def map(self, stride, share):
        self.slow.jobs["map"].show(Map(xr.Dataset({"label": ("x", NOTHING)}), NOTHING, NOTHING, NOTHING, stride, share))

    def point_motion(self, final, trajectory=None):
        verdict = SimpleNamespace(section={"z": [0.0]}, label="chaotic", periods_spent=1)
        self.quick.jobs["motion"].show(PointMotion(self.view.point, verdict, final, trajectory))


@pytest.fixture
def page():
    return Page()


@pytest.fixture
def open_page(page):
    """A page with a coarse map, the diagram and all motions asked for."""
    page.map(8, 0.1)
    return page


def test_a_new_page_asks_for_its_motion_and_its_map_only(page):
    assert page.quick.asked == ["motion"] and page.slow.asked == ["map"]
    page.map(16, 0.01)
    assert page.slow.asked == ["map"]


def test_the_coarse_diagram_and_the_other_motions_follow_a_coarse_map(open_page):
    assert open_page.slow.asked == ["map", "diagram", "other motions"]
    assert open_page.slow.jobs["diagram"].function.args == (VIEW, 4)


def test_the_fine_diagram_follows_the_complete_map(open_page):
    open_page.map(1, 0.9)
    assert open_page.slow.asked.count("diagram") == 1
    open_page.map(1, 1.0)
    assert open_page.slow.asked.count("diagram") == 2 and open_page.slow.jobs["diagram"].function.args == (VIEW, 1)


def test_what_waits_for_a_map_comes_without_one_if_it_fails(page):
    page.slow.jobs["map"].end("no memory")
    assert ("map: no memory",) in page.display.shown["show_message"]
    assert "diagram" in page.slow.jobs and "other motions" in page.slow.jobs


def test_basins_wait_for_a_first_map_and_for_the_point(page):
    page.computations.ask_basins()
    assert "basins" not in page.slow.jobs
    page.map(8, 0.1)
    assert page.slow.jobs["basins"].function.args == (VIEW,)
    before = page.move(VIEW.moved(1.0, 0.1))
    page.computations.ask_basins()
    assert page.slow.jobs["basins"].function.args == (VIEW,)  # those of the point before
    page.computations.update_rest(before)
    assert page.slow.jobs["basins"].function.args == (page.view,)


def test_a_point_that_moves_along_the_line_leaves_map_and_diagram(open_page):
    asked = list(open_page.slow.asked)
    before = open_page.move(VIEW.moved(1.0, VIEW.at[1]))
    assert open_page.quick.asked == ["motion", "motion"] and open_page.slow.asked == asked
    open_page.computations.update_rest(before)
    assert open_page.slow.asked == [*asked, "other motions"]
    assert len(open_page.display.shown["clear_point_studies"]) == 2


def test_another_model_has_another_map(open_page):
    asked = list(open_page.slow.asked)
    open_page.move(VIEW.with_value("zeta", 0.05))
    assert open_page.slow.asked == [*asked, "map"] and open_page.computations.map is None


def test_a_motion_of_a_point_that_was_left_is_not_shown(page):
    page.move(VIEW.moved(1.0, 0.1))
    page.view = VIEW
    page.point_motion(final=True)
    assert "show_point_motion" not in page.display.shown


def test_a_preliminary_verdict_is_followed_until_the_point_moves(page):
    page.point_motion(final=False)
    assert "final verdict" not in page.quick.jobs  # its motion comes first
    page.point_motion(final=False, trajectory=xr.Dataset())
    assert page.quick.jobs["final verdict"].function.args == (VIEW.point, "chaotic")
    page.move(VIEW.moved(1.0, 0.1))
    assert "final verdict" not in page.quick.jobs


def test_a_map_without_the_present_colouring_is_not_shown(page):
    page.move(replace(VIEW, colour="v_rms"))
    page.map(8, 0.1)
    assert "show_map" not in page.display.shown and page.computations.map is not None


def test_there_is_a_message_instead_of_a_file_of_nothing(page):
    page.computations.ask_file("motion", "png")
    assert page.display.shown["show_message"] == [("There is nothing to save yet.",)]


def test_the_page_says_what_is_computed_and_how_much_of_the_map_is_known(page):
    assert page.display.shown["show_busy"][-1] == (["map 0 %", "motion"], False)
    page.slow.jobs["map"].compiling()
    assert page.display.shown["show_busy"][-1] == (["map 0 %", "motion"], True)
    page.map(16, 0.25)
    page.quick.jobs["motion"].end(None)
    assert page.display.shown["show_busy"][-1] == (["map 25 %"], False)


def test_a_page_that_closes_leaves_no_work(open_page):
    open_page.computations.close()
    assert not open_page.quick.jobs and not open_page.slow.jobs
