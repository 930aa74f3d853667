"""Work is divided among the threads and cores of this machine, and its progress shown."""

from contextvars import copy_context

import numpy as np
import pytest

from gearchaos.errors import InputError
from gearchaos.execute import machine, tiles
from gearchaos.execute.progress import NotebookBar, bar, on_progress


def test_few_pieces_are_divided_evenly_among_threads():
    assert [t.stop - t.start for t in tiles.split(1000, threads=2)] == [500, 500]
    assert [t.stop - t.start for t in tiles.split(32, threads=2)] == [16, 16]
    assert [t.stop - t.start for t in tiles.split(31, threads=2)] == [31]
    assert [t.stop - t.start for t in tiles.split(10_240, threads=2)] == [5120, 5120]
    assert [t.stop - t.start for t in tiles.split(1000, largest=100, threads=2)] == [100] * 10
    assert len(tiles.split(10_241, threads=2)) > 2


@pytest.mark.parametrize("threads", [2, 5])
@pytest.mark.parametrize("count", [60_000, 100_000])
def test_tiles_shrink_to_a_sixteenth_of_a_threads_share(count, threads):
    sizes = [t.stop - t.start for t in tiles.split(count, threads=threads)]
    least = count // (16 * threads)
    assert sizes[0] == min(tiles.TILE, count // (2 * threads))
    assert min(sizes[:-1]) == least and sizes[-1] <= least
    assert sizes[:-1] == sorted(sizes[:-1], reverse=True)


def test_cores_are_those_of_this_process(monkeypatch):
    monkeypatch.setattr(machine.os, "sched_getaffinity", lambda process: {0: {2, 5, 7}}[process])
    assert machine.cores() == 3
    monkeypatch.delattr(machine.os, "sched_getaffinity")
    monkeypatch.setattr(machine.os, "cpu_count", lambda: None)
    assert machine.cores() == 1


def test_a_bar_begins_where_the_work_does(monkeypatch):
    from rich.progress import Progress

    begun, true = [], Progress.add_task

    def add_task(*arguments, **options):
        begun.append((options["total"], options["completed"]))
        return true(*arguments, **options)

    monkeypatch.setattr(Progress, "add_task", add_task)
    for done in ({}, {"done": 3}):
        with bar("work", 10, **done) as advance:
            advance(2)
    assert begun == [(10, 0), (10, 3)]


def test_what_does_not_fit_the_memory_is_refused_with_how_much_would():
    memory = machine.os.sysconf("SC_PAGE_SIZE") * machine.os.sysconf("SC_PHYS_PAGES")
    most = memory // 400
    machine.check_memory("cells", most)
    with pytest.raises(InputError, match=f"cells must be at most {most:,} on this machine"):
        machine.check_memory("cells", most + 1)


def test_the_bar_of_a_notebook_says_how_much_is_done_and_left(monkeypatch):
    shown = []
    monkeypatch.setattr(NotebookBar, "show", lambda self: shown.append(self.text))
    now = iter(np.arange(0.0, 100.0, 0.5))
    monkeypatch.setattr("gearchaos.execute.progress.time.monotonic", lambda: next(now))
    progress = NotebookBar("zo<nes", 1000, 400)
    progress.advance(100)
    assert shown[0] == "zo<nes 400/1,000"
    assert shown[1].startswith("zo<nes 500/1,000 · ") and shown[1].endswith(" s left")
    assert 'value="500" max="1000"' in progress.html and "zo&lt;nes" in progress.html


def test_updates_of_the_bar_of_a_notebook_are_not_more_frequent_than_a_reader_sees(monkeypatch):
    shown = []
    monkeypatch.setattr(NotebookBar, "show", lambda self: shown.append(self.done))
    monkeypatch.setattr("gearchaos.execute.progress.time.monotonic", lambda: 7.0)
    progress = NotebookBar("zones", 1000, 0)
    for _ in range(1000):
        progress.advance(1)
    assert shown == [0] and progress.done == 1000


def test_a_function_is_told_of_bars_with_a_name_and_of_what_was_done_before():
    told = []

    def work():
        on_progress.set(told.append)
        for name, total, done in (("zones", 100, 50), (None, 0, 0), ("edges", 10, 0)):
            with bar(name, total, done) as advance:
                advance(5)
                advance(5)

    copy_context().run(work)
    assert told == [0.55, 0.6, 0.5, 1.0]
