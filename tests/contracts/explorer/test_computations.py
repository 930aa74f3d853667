"""What the explorer computes for a page, and in which order: without threads, processes or a browser."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from gearchaos.explorer.jobs.computations import Computations
from gearchaos.explorer.jobs.map import Map
from gearchaos.explorer.jobs.point import PointMotion
from gearchaos.explorer.jobs.worker import Workers
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
    """The computations of a page, between its workers and a display."""

    def __init__(self, view=VIEW):
        self.quick, self.slow, self.branches, self.curves = (Worker() for _ in range(4))
        self.display, workers = Display(), Workers(self.quick, self.slow, self.branches, self.curves)
        self.computations = Computations("page", view, workers, lambda call: call(), self.display)
        self.view = view
        self.computations.start()

    def move(self, view):
        before, self.view = self.view, view
        self.computations.update(view)
        return before

    def map(self, stride, share):
        self.slow.jobs["map"].show(Map(xr.Dataset({"label": ("x", NOTHING)}), NOTHING, NOTHING, NOTHING, stride, share))

    def point_motion(self, final, trajectory=None, period=None):
        section = {n: [0.5] for n in ("x1", "x1_dot", "x2", "x2_dot", "z")}
        label = f"{period}T" if period else "chaotic"
        verdict = SimpleNamespace(section=section, label=label, period=period, periods_spent=1)
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


def test_only_while_a_slider_is_moved_does_the_map_wait_for_the_next_change(page, monkeypatch):
    now, waited = 1e9, []
    monkeypatch.setattr("gearchaos.explorer.jobs.computations.time", SimpleNamespace(monotonic=lambda: now))
    for pause, zeta in ((1.0, 0.03), (0.02, 0.04), (0.02, 0.05), (1.0, 0.06)):
        now += pause
        page.move(VIEW.with_value("zeta", zeta))
        waited.append(page.slow.jobs["map"].delay > 0)
    assert waited == [False, True, True, False]


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
    open_page.map(1, 1.0)
    open_page.computations.ask_skeleton(2)
    open_page.point_motion(final=True, trajectory=xr.Dataset(), period=2)
    open_page.computations.ask_branch()
    assert open_page.curves.jobs and open_page.branches.jobs
    open_page.computations.close()
    assert not any(w.jobs for w in (open_page.quick, open_page.slow, open_page.branches, open_page.curves))


# --- branches and bifurcation curves -------------------------------------------------------------------------------


@pytest.fixture
def periodic_page(open_page):
    """An open page whose point has a motion of period 2."""
    open_page.point_motion(final=True, trajectory=xr.Dataset(), period=2)
    return open_page


def test_a_periodic_motion_is_followed_along_the_line_by_a_worker_of_its_own(periodic_page):
    asked = list(periodic_page.slow.asked), list(periodic_page.quick.asked)
    periodic_page.computations.ask_branch()
    view, motion = periodic_page.branches.jobs["branch"].function.args
    assert view == VIEW and motion.period == 2 and dict(motion.state)["x1"] == 0.5
    assert (periodic_page.slow.asked, periodic_page.quick.asked) == asked
    periodic_page.branches.jobs["branch"].show("a branch")
    assert periodic_page.display.shown["show_branch"] == [("a branch",)]


def test_any_other_motion_is_not_followed_and_there_is_a_message(open_page):
    open_page.computations.ask_branch()
    assert "still being computed" in open_page.display.shown["show_message"][-1][0]
    open_page.point_motion(final=True, trajectory=xr.Dataset())
    open_page.computations.ask_branch()
    assert "Only a periodic motion" in open_page.display.shown["show_message"][-1][0]
    assert not open_page.branches.asked


def moved(page, view):
    before = page.move(view)
    page.computations.update_rest(before)


def test_a_branch_stays_while_the_point_moves_along_its_line(periodic_page):
    periodic_page.computations.ask_branch()
    cleared = len(periodic_page.display.shown["clear_branch"])
    moved(periodic_page, VIEW.moved(1.0, VIEW.at[1]))
    assert "branch" in periodic_page.branches.jobs
    assert len(periodic_page.display.shown["clear_branch"]) == cleared


@pytest.mark.parametrize("change", [
    lambda view: view.moved(view.at[0], 0.1), lambda view: view.with_value("zeta", 0.05),
    lambda view: replace(view, line="y"), lambda view: view.zoomed((1.0, 2.0), (view.y.start, view.y.stop)),
])
def test_a_branch_goes_with_its_line_and_its_computation_is_cancelled(periodic_page, change):
    periodic_page.computations.ask_branch()
    cleared = len(periodic_page.display.shown["clear_branch"])
    moved(periodic_page, change(VIEW))
    assert "branch" not in periodic_page.branches.jobs
    assert len(periodic_page.display.shown["clear_branch"]) == cleared + 1


def test_a_branch_that_is_asked_for_while_the_point_moves_is_that_of_the_new_point(periodic_page):
    before = periodic_page.move(VIEW.moved(1.0, 0.1))
    periodic_page.computations.ask_branch()
    assert not periodic_page.branches.asked
    periodic_page.point_motion(final=True, trajectory=xr.Dataset(), period=3)
    periodic_page.computations.update_rest(before)
    assert periodic_page.branches.jobs["branch"].function.args[1].period == 3


def test_bifurcation_curves_begin_when_the_map_is_complete(open_page):
    open_page.computations.ask_skeleton(2)
    assert not open_page.curves.asked and open_page.computations.skeleton_period == 2
    assert open_page.display.shown["show_skeleton"] == [(None,)]
    open_page.map(1, 0.9)
    assert not open_page.curves.asked
    open_page.map(1, 1.0)
    assert open_page.curves.jobs["bifurcation curves"].function.args == (VIEW, 2)
    open_page.map(1, 1.0)
    assert open_page.curves.asked == ["bifurcation curves"]
    open_page.curves.jobs["bifurcation curves"].show("curves")
    open_page.map(1, 1.0)
    open_page.slow.jobs["map"].end(None)
    assert open_page.display.shown["show_skeleton"][-1] == ("curves",)
    assert open_page.curves.asked == ["bifurcation curves"]


def test_bifurcation_curves_come_at_once_over_a_map_that_is_complete_or_failed(open_page):
    open_page.map(1, 1.0)
    open_page.computations.ask_skeleton(1)
    assert open_page.curves.asked == ["bifurcation curves"]
    open_page.slow.jobs["map"].end("no memory")
    open_page.computations.ask_skeleton(4)
    assert open_page.curves.jobs["bifurcation curves"].function.args == (VIEW, 4)


@pytest.mark.parametrize(("change", "goes"), [
    (lambda view: view.with_value("zeta", 0.05), True),
    (lambda view: view.zoomed((1.0, 2.0), (view.y.start, view.y.stop)), True),
    (lambda view: view.moved(1.0, 0.1), False), (lambda view: replace(view, colour="attractors"), False),
])
def test_bifurcation_curves_go_with_the_window_and_the_parameters(open_page, change, goes):
    open_page.map(1, 1.0)
    open_page.computations.ask_skeleton(2)
    moved(open_page, change(VIEW))
    assert ("bifurcation curves" not in open_page.curves.jobs) == goes
    assert ("clear_skeleton" in open_page.display.shown) == goes
    assert open_page.computations.skeleton_period == (0 if goes else 2)
    open_page.map(1, 1.0)
    assert open_page.curves.asked == ["bifurcation curves"]
