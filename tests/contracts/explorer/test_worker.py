"""The explorer's worker: whose turn it is, and the process that takes its steps."""

import os
import subprocess
import sys
import threading
import time
from functools import partial

import psutil
import pytest

import gearchaos as gc
from gearchaos.errors import InputError
from gearchaos.explorer.core.worker import Job, Worker, WorkerProcess
from gearchaos.explorer.features.map import job as maps
from gearchaos.explorer.features.motion.point import point_motion
from gearchaos.explorer.web.messages import render
from gearchaos.flow import StoppedError
from tests.contracts.explorer.test_computations import PAPER

MODEL = gc.MeshModel.of(omega=1.0, eps1=0.05)


class Recorder:
    """A job that counts, and what was shown of it."""

    def __init__(self, steps=3, gate=None, fails=None):
        self.shown, self.taken, self.message = [], 0, "not ended"
        self.over = threading.Event()
        self._steps, self._gate, self._fails = steps, gate, fails

    def work(self):
        for i in range(self._steps):
            if self._gate:
                assert self._gate.wait(10)
            if self._fails:
                raise self._fails
            self.taken += 1
            yield i

    def end(self, message):
        self.message = message
        self.over.set()

    def job(self):
        return Job(self.work, self.shown.append, self.end)


def test_a_job_is_shown_step_by_step_and_ends():
    worker, one = Worker("test"), Recorder()
    worker.submit("a", "map", one.job())
    assert one.over.wait(10) and one.shown == [0, 1, 2] and one.message is None


def test_the_newest_request_of_a_task_wins_and_the_older_and_those_of_a_closed_page_are_left_between_steps():
    worker, gate = Worker("test"), threading.Event()
    old, gone, new = Recorder(1000, gate), Recorder(1000, gate), Recorder(2)
    worker.submit("a", "map", old.job())
    worker.submit("b", "map", gone.job())
    worker.submit("a", "map", new.job())
    worker.cancel("b")
    gate.set()
    assert new.over.wait(10) and new.shown == [0, 1]
    assert old.taken <= 1 and gone.taken <= 1 and old.shown == gone.shown == [] and not old.over.is_set()


def test_sessions_take_turns():
    worker, gate, order = Worker("test"), threading.Event(), []
    jobs = {name: Recorder(4, gate) for name in "ab"}
    for name, one in jobs.items():
        worker.submit(name, "map", Job(one.work, lambda _, name=name: order.append(name), one.end))
    gate.set()
    assert all(j.over.wait(10) for j in jobs.values())
    assert max(len(run) for run in "".join(order).replace("ab", "-").split("-")) <= 1


@pytest.mark.parametrize(("error", "message"), [
    (InputError("omega", "must be greater than 0", -1), "omega must be greater than 0"),
    (RuntimeError("secret"), "went wrong")])
def test_what_goes_wrong_becomes_a_message_and_the_worker_goes_on(error, message, caplog):
    worker, bad, good = Worker("test"), Recorder(fails=error), Recorder(1)
    worker.submit("a", "map", bad.job())
    assert bad.over.wait(10) and message in bad.message and "secret" not in bad.message
    worker.submit("a", "other motions", Job(Recorder().work, lambda _: 1 / 0, lambda _: None))  # a page that fails
    worker.submit("a", "map", good.job())
    assert good.over.wait(10) and good.message is None


def test_what_is_left_is_closed_by_the_thread_that_ran_it_and_errors_there_do_not_end_it():
    closed = []

    def work():
        try:
            yield 1
            yield 2
        finally:
            closed.append(threading.current_thread().name)
            raise RuntimeError("on the way out")

    worker, begun, last = Worker("test"), threading.Event(), Recorder(1)
    worker.submit("a", "map", Job(work, lambda _: (begun.set(), worker.cancel("a", "map")), lambda _: None))
    assert begun.wait(10)
    worker.submit("a", "map", last.job())
    assert last.over.wait(10) and closed == ["test"]


@pytest.fixture(scope="module")
def place():
    place = WorkerProcess(low_priority=True)
    yield place
    place.end()


@pytest.mark.slow
def test_another_process_finds_the_same(place):
    here, there = list(point_motion(MODEL)), list(place.run(partial(point_motion, MODEL)))
    assert [d.verdict for d in here] == [d.verdict for d in there] and len(here) == len(there)
    assert here[1].trajectory.identical(there[1].trajectory)


def test_works_there_take_turns_and_the_one_closed_is_forgotten(place):
    first, second = (place.run(partial(point_motion, MODEL)) for _ in range(2))
    assert next(first).trajectory is None and next(second).trajectory is None
    first.close()
    assert next(first, None) is None and next(second).trajectory is not None


def test_a_step_under_way_there_is_left_at_once(place):
    work = place.run(partial(maps.successive_maps, PAPER))
    next(work)
    threading.Timer(0.1, work.cancel).start()
    began = time.monotonic()
    with pytest.raises(StoppedError):
        for _ in work:
            pass
    assert time.monotonic() - began < 5  # all of it takes twenty seconds or more
    work.close()
    unborn = place.run(partial(maps.successive_maps, PAPER))
    unborn.cancel()
    with pytest.raises(StoppedError):  # left before it begins, it does nothing
        next(unborn)


def test_what_is_wrong_there_is_told_here(place):
    with pytest.raises(InputError, match="omega"):
        list(place.run(partial(gc.MeshModel.of, omega=-1.0)))


def test_compiling_there_is_told_before_the_answer(place):
    told = []
    answers = "(f(2) for f in [__import__('numba').njit(lambda x: 2 * x)])"
    assert list(place.run(partial(eval, answers), lambda: told.append(True))) == [4]
    assert told
    assert list(place.run(partial(iter, [4]), lambda: told.clear())) == [4] and told


def test_the_page_says_that_kernels_are_compiled_first():
    busy = partial(render, "web/templates/busy.html.j2")
    assert "once after an install" in busy(tasks=["motion"], compiling=True)
    assert "once" not in busy(tasks=["motion"], compiling=False) and "ready" in busy(tasks=[], compiling=True)


@pytest.mark.slow
def test_a_process_that_dies_costs_the_visitor_one_message(caplog):
    place = WorkerProcess()
    worker, hurt, well = Worker("test", place), Recorder(), Recorder()
    worker.submit("a", "map", Job(partial(maps.successive_maps, PAPER), lambda _: place._process.kill(), hurt.end))
    assert hurt.over.wait(60) and "went wrong" in hurt.message
    worker.submit("a", "motion", Job(partial(point_motion, MODEL), well.shown.append, well.end))
    assert well.over.wait(60) and well.message is None and well.shown[-1].verdict.label == "1T"
    worker.stop()
    place._process.wait(10)


@pytest.mark.slow
def test_a_process_ends_with_the_one_that_began_it(tmp_path):
    code = """
from gearchaos.explorer.core.worker import WorkerProcess
print(WorkerProcess()._process.pid, flush=True)
input()
"""
    parent = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    child = psutil.Process(int(parent.stdout.readline()))
    parent.kill()
    parent.wait()
    for pipe in (parent.stdin, parent.stdout):
        pipe.close()
    gone, _ = psutil.wait_procs([child], timeout=20)
    assert gone


@pytest.mark.slow
def test_a_process_on_demand_starts_with_its_first_step():
    place = WorkerProcess(low_priority=True, on_demand=True)
    assert place._process is None
    work = place.run(partial(point_motion, MODEL))
    next(work)
    assert place._process is not None
    place.end()
    assert place._process.poll() is not None
    never = WorkerProcess(on_demand=True)
    Worker("curves", never).stop()
    assert never._process is None


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the threads of a process have the same priority")
def test_the_first_step_of_an_urgent_job_alone_has_full_priority(place):
    niceness = partial(eval, "(__import__('os').nice(0) for _ in range(3))")
    full = os.nice(0)  # of these tests
    low = min(full + 15, 19)
    for urgent, expected in ((False, [low, low, low]), (True, [full, low, low]), (False, [low, low, low])):
        assert list(place.run(niceness, urgent=urgent)) == expected
