"""What the explorer computes for a page, and in which order: without threads, processes or a browser."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from gearchaos.datasheet.report import Report
from gearchaos.explorer.core.opened import Opened
from gearchaos.explorer.core.presets import presets
from gearchaos.explorer.core.progress import Part, Progress
from gearchaos.explorer.core.state import view_of
from gearchaos.explorer.core.worker import Workers
from gearchaos.explorer.features.assessment.speed_line import SpeedLine
from gearchaos.explorer.features.map.job import Map, MapGrid
from gearchaos.explorer.features.motion.point import PointMotion
from gearchaos.explorer.features.runup.job import RunUpResult
from gearchaos.explorer.features.tolerances.job import Cloud
from gearchaos.explorer.web.computations import Computations
from gearchaos.explorer.web.session import Session
from gearchaos.studies.speeds.assess import Assessment
from gearchaos.studyfile import load_study
from tests import EXAMPLES, ONE_SPRING

PAPER = presets()["2"].view
GEARS = view_of(load_study(ONE_SPRING).model)
PAIR = view_of(load_study(EXAMPLES / "physical_pair.toml").model)
TRAIN = view_of(load_study(EXAMPLES / "train_idler.toml").model)
NOTHING = np.zeros(0)


def computed(study, count):
    """A map of which some of the first cells are known."""
    grid, cells = MapGrid(study.x.count, study.y.count), np.arange(count)
    grid.put(study.compute(cells), cells)
    grid.show(cells, 1)
    return grid.map(study, 1)


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


class Put(dict):
    """What is set of each model of Bokeh, by its id."""

    def __call__(self, model, **attributes):
        self.setdefault(model.id, {}).update(attributes)


class Page:
    """The computations of a page, between its workers and a display."""

    def __init__(self, view=PAPER):
        self.quick, self.slow, self.branches, self.curves = (Worker() for _ in range(4))
        self.display, workers = Display(), Workers(self.quick, self.slow, self.branches, self.curves)
        self.computations = Computations("page", view, workers, lambda call: call(), self.display)
        self.view = view
        self.computations.start(self.view)

    def move(self, view):
        """Move to another view, but for the rest of it."""
        before, self.view = self.view, view
        self.computations.update(view)
        return before

    def moved(self, view):
        self.computations.update_rest(self.move(view))

    def map(self, stride, share):
        self.slow.jobs["map"].show(Map(xr.Dataset({"label": ("x", NOTHING)}), NOTHING, NOTHING, NOTHING, stride, share))

    def point_motion(self, final, trajectory=None, period=None):
        section = {n: [0.5] for n in ("x1", "x1_dot", "x2", "x2_dot", "z")}
        label = f"{period}T" if period else "chaotic"
        verdict = SimpleNamespace(section=section, label=label, period=period, periods_spent=1)
        self.quick.jobs["motion"].show(PointMotion(self.view.point, verdict, final, trajectory))


def session(view, start):
    workers = Workers(*(Worker() for _ in range(4)))
    document = SimpleNamespace(add_timeout_callback=lambda *_: None, add_next_tick_callback=lambda call: call())
    return Session(view, workers, document, start if isinstance(start, Opened) else Opened(start)), workers


@pytest.fixture
def page():
    return Page()


@pytest.fixture
def open_page(page):
    """A page with a coarse map, the diagram and all motions asked for."""
    page.map(8, 0.1)
    return page


def test_a_search_of_other_motions_that_fails_is_said_to_have_ended(open_page):
    open_page.computations._ended("other motions", "")
    assert "show_attractors" not in open_page.display.shown
    open_page.computations._ended("other motions", "no")
    ((found,),) = open_page.display.shown["show_attractors"]
    assert not found


def test_after_a_coarse_map_come_a_coarse_diagram_and_other_motions_and_after_the_whole_one_a_fine_diagram(page):
    assert page.quick.asked == ["motion"] and page.slow.asked == ["map"]
    page.map(16, 0.01)
    assert page.slow.asked == ["map"]
    page.map(8, 0.1)
    page.map(1, 0.9)
    assert page.slow.asked == ["map", "diagram", "other motions"]
    assert page.slow.jobs["diagram"].function.args == (PAPER, 4)
    page.map(1, 1.0)
    assert page.slow.asked.count("diagram") == 2 and page.slow.jobs["diagram"].function.args == (PAPER, 1)


def test_only_while_a_slider_is_moved_does_the_map_wait_for_the_next_change(page, monkeypatch):
    now, waited = 1e9, []
    monkeypatch.setattr("gearchaos.explorer.web.computations.time", SimpleNamespace(monotonic=lambda: now))
    for pause, zeta in ((1.0, 0.03), (0.02, 0.04), (0.02, 0.05), (1.0, 0.06)):
        now += pause
        page.move(PAPER.with_value("zeta", zeta))
        waited.append(page.slow.jobs["map"].delay > 0)
    assert waited == [False, True, True, False]


def test_what_waits_for_a_map_comes_without_one_if_it_fails(page):
    page.slow.jobs["map"].end("no memory")
    assert ("map: no memory",) in page.display.shown["show_message"]
    assert "diagram" in page.slow.jobs and "other motions" in page.slow.jobs


def test_basins_wait_for_a_first_map_and_for_the_point(page):
    page.computations.ask_basins()
    assert "basins" not in page.slow.jobs
    page.map(8, 0.1)
    assert page.slow.jobs["basins"].function.args == (PAPER,)
    before = page.move(PAPER.moved(1.0, 0.1))
    page.computations.ask_basins()
    assert page.slow.jobs["basins"].function.args == (PAPER,)  # those of the point before
    page.computations.update_rest(before)
    assert page.slow.jobs["basins"].function.args == (page.view,)


def test_a_point_that_moves_along_the_line_leaves_map_and_diagram_which_another_model_does_not(open_page):
    asked = list(open_page.slow.asked)
    before = open_page.move(PAPER.moved(1.0, PAPER.at[1]))
    assert open_page.quick.asked == ["motion", "motion"] and open_page.slow.asked == asked
    open_page.computations.update_rest(before)
    assert open_page.slow.asked == [*asked, "other motions"]
    assert len(open_page.display.shown["clear_point_studies"]) == 2
    open_page.move(PAPER.with_value("zeta", 0.05))
    assert open_page.slow.asked == [*asked, "other motions", "map"] and open_page.computations.map is None


def test_a_motion_of_a_point_that_was_left_is_not_shown(page):
    page.move(PAPER.moved(1.0, 0.1))
    page.view = PAPER
    page.point_motion(final=True)
    assert "show_point_motion" not in page.display.shown


def test_a_preliminary_verdict_is_followed_until_the_point_moves(page):
    page.point_motion(final=False)
    assert "final verdict" not in page.quick.jobs  # its motion comes first
    page.point_motion(final=False, trajectory=xr.Dataset())
    assert page.quick.jobs["final verdict"].function.args == (PAPER.point, "chaotic")
    page.move(PAPER.moved(1.0, 0.1))
    assert "final verdict" not in page.quick.jobs


def test_a_map_without_the_present_colouring_is_not_shown(page):
    page.move(replace(PAPER, colour="v_rms"))
    page.map(8, 0.1)
    assert "show_map" not in page.display.shown and page.computations.map is not None


def test_there_is_a_message_instead_of_a_file_of_nothing(page):
    for what, suffix in (("motion", "png"), ("map", "nc"), ("runup", "nc"), ("assessment", "json")):
        page.computations.ask_file(what, suffix)
    assert page.display.shown["show_message"] == [("There is nothing to save yet.",)] * 4


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


@pytest.fixture
def periodic_page(open_page):
    open_page.point_motion(final=True, trajectory=xr.Dataset(), period=2)
    return open_page


def test_a_periodic_motion_is_followed_along_the_line_by_a_worker_of_its_own(periodic_page):
    asked = list(periodic_page.slow.asked), list(periodic_page.quick.asked)
    periodic_page.computations.ask_branch()
    view, motion = periodic_page.branches.jobs["branch"].function.args
    assert view == PAPER and motion.period == 2 and dict(motion.state)["x1"] == 0.5
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


@pytest.mark.parametrize(("change", "goes"), [
    (lambda view: view.moved(1.0, view.at[1]), False), (lambda view: view.moved(view.at[0], 0.1), True),
    (lambda view: view.with_value("zeta", 0.05), True), (lambda view: replace(view, line="y"), True),
    (lambda view: view.zoomed((1.0, 2.0), (view.y.start, view.y.stop)), True)])
def test_a_branch_goes_with_its_line_and_its_computation_is_cancelled(periodic_page, change, goes):
    periodic_page.computations.ask_branch()
    cleared = len(periodic_page.display.shown["clear_branch"])
    periodic_page.moved(change(PAPER))
    assert ("branch" not in periodic_page.branches.jobs) == goes
    assert len(periodic_page.display.shown["clear_branch"]) == cleared + goes


def test_a_branch_that_is_asked_for_while_the_point_moves_is_that_of_the_new_point(periodic_page):
    before = periodic_page.move(PAPER.moved(1.0, 0.1))
    periodic_page.computations.ask_branch()
    assert not periodic_page.branches.asked
    periodic_page.point_motion(final=True, trajectory=xr.Dataset(), period=3)
    periodic_page.computations.update_rest(before)
    assert periodic_page.branches.jobs["branch"].function.args[1].period == 3


def test_bifurcation_curves_begin_once_the_map_is_complete_or_failed(open_page):
    jobs, asked = open_page.curves.jobs, open_page.curves.asked
    open_page.computations.ask_skeleton(2)
    open_page.map(1, 0.9)
    assert not asked and open_page.computations.skeleton_period == 2
    assert open_page.display.shown["show_skeleton"] == [(None,)]
    for _ in range(2):
        open_page.map(1, 1.0)
        assert asked == ["bifurcation curves"] and jobs["bifurcation curves"].function.args == (PAPER, 2)
    jobs["bifurcation curves"].show("curves")
    open_page.map(1, 1.0)
    open_page.slow.jobs["map"].end("no memory")
    assert open_page.display.shown["show_skeleton"][-1] == ("curves",) and len(asked) == 1
    open_page.computations.ask_skeleton(4)
    assert len(asked) == 2 and jobs["bifurcation curves"].function.args == (PAPER, 4)


@pytest.mark.parametrize(("change", "goes"), [
    (lambda view: view.with_value("zeta", 0.05), True),
    (lambda view: view.zoomed((1.0, 2.0), (view.y.start, view.y.stop)), True),
    (lambda view: view.moved(1.0, 0.1), False), (lambda view: replace(view, colour="attractors"), False)])
def test_bifurcation_curves_go_with_the_window_and_the_parameters(open_page, change, goes):
    open_page.map(1, 1.0)
    open_page.computations.ask_skeleton(2)
    open_page.moved(change(PAPER))
    assert ("bifurcation curves" not in open_page.curves.jobs) == goes
    assert ("clear_skeleton" in open_page.display.shown) == goes
    assert open_page.computations.skeleton_period == (0 if goes else 2)
    open_page.map(1, 1.0)
    assert open_page.curves.asked == ["bifurcation curves"]


RUN = GEARS.with_run(start=1000.0, stop=2000.0, duration=0.8, way="down", sound=True)
FOUND = {"run-up": RunUpResult(xr.Dataset(), b""), "assessment": Assessment.__new__(Assessment),
         "tolerances": Cloud(xr.Dataset(), 1.0, "separation", ()), "changes": Report(Assessment.__new__(Assessment))}
"""What the tasks that a button begins find; the page only passes it on."""


TASKS = {"changes": "changed designs"}


class Pressed(Page):
    """A page whose button for one of these tasks was pressed."""

    def __init__(self, task, view=RUN):
        super().__init__(view)
        self.task, self._name = task, task.replace("-", "_")
        self.press()

    def press(self):
        getattr(self.computations, f"ask_{self._name}")()

    @property
    def job(self):
        return self.branches.jobs.get(TASKS.get(self.task, self.task))

    @property
    def found(self):
        return getattr(self.computations, {"tolerances": "cloud"}.get(self.task, self._name))

    def says(self):
        """What stands beside the button."""
        return self.display.shown["show_progress"][-1][-1]

    def shows(self):
        return self.display.shown.get(f"show_{self._name}", [])

    def clears(self):
        return len(self.display.shown.get(f"clear_{self._name}", []))


@pytest.fixture(params=FOUND)
def pressed(request):
    return Pressed(request.param)


@pytest.mark.parametrize(("task", "asked", "shown", "share"), [
    ("run-up", (RUN.operating_point, RUN.run, ""), (), "run-up 42 %, about 12 seconds left"),
    ("assessment", (SpeedLine(RUN),), (SpeedLine(RUN),), "assessment 42 %, about 12 seconds left"),
    ("tolerances", (RUN,), (), "tolerances 42 %, about 12 seconds left"),
    ("changes", (SpeedLine(RUN),), (), "changed designs 42 %, about 12 seconds left")])
def test_a_page_says_how_far_its_task_is_and_shows_what_is_found(task, asked, shown, share):
    page = Pressed(task)
    assert page.job.function.args == asked and page.shows() == [(*shown, None)]
    page.job.show(Progress(0.42, 12.0))
    assert share in page.display.shown["show_busy"][-1][0] and page.says() == "42 %, about 12 seconds left"
    page.job.show(Progress(1.0))
    assert page.says() == "100 %"
    page.job.show(FOUND[task])
    page.job.end(None)
    assert page.says() == ""
    assert page.shows()[-1] == (*shown, FOUND[task]) and page.clears() == 0 and page.found is FOUND[task]


def test_a_button_says_what_it_stopped_and_what_is_known_until_then(pressed):
    name = TASKS.get(pressed.task, pressed.task)
    pressed.job.show(Progress(0.42, 12.0))
    pressed.press()
    assert pressed.says() == f"{name} stopped at 42 %: nothing of it is known yet" and pressed.found is None
    pressed.press()
    assert pressed.says() == ""
    if pressed.task == "run-up":  # it is computed as a whole
        return
    part = FOUND[pressed.task]
    pressed.job.show(Part(part, "a reversal of the load"))
    assert pressed.says() == "what stands below lacks a reversal of the load"
    pressed.job.show(Progress(0.5))
    assert pressed.says() == "50 %; what stands below lacks a reversal of the load"
    assert pressed.shows()[-1][-2:] == (part, False)
    clears = pressed.clears()
    pressed.press()
    assert pressed.says() == f"{name} stopped at 50 %: what stands below lacks a reversal of the load"
    assert pressed.shows()[-1][-1] is part is pressed.found and pressed.clears() == clears and pressed.job is None


def test_a_run_that_is_there_is_not_computed_again():
    page = Pressed("run-up")
    page.job.show(FOUND["run-up"])
    page.job.end(None)
    page.press()
    assert page.branches.asked == ["run-up"]


@pytest.mark.parametrize("late", [lambda page, job: job.show(FOUND[page.task]), lambda page, job: job.end(None)])
def test_a_second_press_cancels_a_third_asks_anew_and_what_comes_from_the_first_touches_nothing(pressed, late):
    stopped = pressed.job
    pressed.press()
    assert pressed.job is None and pressed.clears() == 1
    pressed.press()
    shown = len(pressed.shows())
    late(pressed, stopped)
    assert pressed.job is not None and pressed.found is None and (len(pressed.shows()), pressed.clears()) == (shown, 1)
    pressed.press()  # the second is still being computed
    assert pressed.job is None and pressed.clears() == 2


@pytest.mark.parametrize("part", [False, True])
def test_a_refusal_is_a_message_and_ends_the_wait(pressed, part):
    if part:
        pressed.job.show(Part(FOUND[pressed.task], "the rest"))
    pressed.job.end("torque must be positive")
    name = TASKS.get(pressed.task, pressed.task)
    assert pressed.display.shown["show_message"][-1] == (f"{name}: torque must be positive",)
    assert pressed.clears() == 1 and pressed.found is None


@pytest.mark.parametrize(("task", "view", "words"), [
    ("run-up", PAPER, "menu of presets"), ("assessment", PAPER, "menu of presets"),
    ("tolerances", PAPER, "pair of gears"), ("tolerances", TRAIN, "pair of gears"), ("changes", PAIR, "a drawing or"),
    ("changes", RUN.with_value("eps1", 0.3), "set back eps1")])
def test_what_has_no_gears_or_no_pair_of_them_is_refused_in_words(task, view, words):
    page = Pressed(task, view)
    assert not page.branches.asked and words in page.display.shown["show_message"][-1][0] and page.clears() == 1


@pytest.mark.parametrize("complete", [False, True])
@pytest.mark.parametrize(("change", "going"), [
    (lambda view: view.with_value("torque", 120.0), {"run-up", "tolerances", "changes"}),
    (lambda view: replace(view, change="loss"), {"assessment", "changes"}),
    (lambda view: view.with_value("zeta", 0.08), {*FOUND}), (lambda view: PAPER, {*FOUND}),
    (lambda view: view.with_value("speed", 2000.0), {"tolerances"}),
    (lambda view: view.with_axis("x", "zeta"), {"run-up"}), (lambda view: view.with_run(stop=2100.0), {"run-up"}),
    (lambda view: view.zoomed((900.0, 1500.0), (50.0, 150.0)), set()), (lambda view: view.with_other_units(), set()),
    (lambda view: view.with_run(sound=False), set())])
def test_each_goes_with_what_it_depends_on(pressed, complete, change, going):
    goes = pressed.task in going
    if complete:
        pressed.job.show(FOUND[pressed.task])
        pressed.job.end(None)
    pressed.move(change(RUN))
    assert pressed.clears() == goes and (pressed.found is not None) == (complete and not goes)
    assert complete or (pressed.job is None) == goes
    if pressed.task == "assessment" and complete and not goes:  # for the new point
        shown = SpeedLine(RUN), FOUND["assessment"]
        assert pressed.shows()[-2:] == [shown, (*shown, True)]


@pytest.mark.parametrize(("first", "sound", "views", "stays"), [
    (RUN.with_run(sound=False), b"", [RUN], False), (RUN, b"RIFF", [RUN.with_run(sound=False), RUN], True)])
def test_a_run_goes_when_sound_is_asked_for_that_it_does_not_have(first, sound, views, stays):
    page = Pressed("run-up", first)
    page.job.show(RunUpResult(xr.Dataset(), sound))
    for view in views:
        page.move(view)
    assert (page.found is not None) == stays and page.clears() == (not stays)
