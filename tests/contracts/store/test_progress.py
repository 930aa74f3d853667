"""Work is divided among the threads and cores of this machine, and its progress shown."""

from contextvars import copy_context
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from gearchaos.errors import InputError
from gearchaos.execute import machine, tiles
from gearchaos.execute.progress import NotebookBar, bar, on_progress


@pytest.mark.parametrize(("count", "options", "sizes"), [
    (1000, {}, [500, 500]), (32, {}, [16, 16]), (31, {}, [31]), (10_240, {}, [5120, 5120]), (0, {}, []),
    (1000, {"largest": 100}, [100] * 10), (20_000, {"threads": 1}, [8192, 8192, 3616])])
def test_few_pieces_are_divided_evenly_among_threads(count, options, sizes):
    ends = np.cumsum([0, *sizes]).tolist()
    assert tiles.split(count, **{"threads": 2, **options}) == [slice(*part) for part in pairwise(ends)]


@pytest.mark.parametrize(("count", "threads"), [(10_241, 2), (60_000, 2), (60_000, 5), (100_000, 5), (123_457, 7)])
def test_tiles_cover_all_work_once_and_shrink_to_a_sixteenth_of_a_threads_share(count, threads):
    order, parts = tiles.interleaved(count, threads), tiles.split(count, threads=threads)
    assert sorted(order) == list(range(count)) and np.all(np.diff(order[: count // threads]) == threads)
    assert [part.stop for part in parts] == [*(part.start for part in parts[1:]), count] and parts[0].start == 0
    sizes = [t.stop - t.start for t in parts]
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


@pytest.mark.parametrize(("seconds", "said"), [(4.0, ""), (6.0, "work: 10 in 6 s\n")])
def test_in_a_pipe_only_what_takes_long_leaves_a_line(monkeypatch, capsys, seconds, said):
    now = [0.0]
    monkeypatch.setattr("gearchaos.execute.progress.time.monotonic", lambda: now[0])
    with bar("work", 10) as advance:
        now[0] = seconds
        advance(10)
    assert capsys.readouterr() == ("", said)


def test_what_does_not_fit_the_memory_is_refused_with_how_much_would():
    memory = machine.os.sysconf("SC_PAGE_SIZE") * machine.os.sysconf("SC_PHYS_PAGES")
    most = memory // 400
    machine.check_memory("cells", most)
    with pytest.raises(InputError, match=f"cells must be at most {most:,} on this machine"):
        machine.check_memory("cells", most + 1)


def test_the_bar_of_a_notebook_says_how_much_is_done_and_left_no_more_often_than_a_reader_sees(monkeypatch):
    shown, now = [], [0.0]
    show = SimpleNamespace(update=lambda bundle, raw: shown.append(bundle["text/plain"]))
    monkeypatch.setattr("IPython.display.display", lambda bundle, **_: show.update(bundle, True) or show)
    monkeypatch.setattr("gearchaos.execute.progress.time.monotonic", lambda: now[0])
    progress, now[0] = NotebookBar("zo<nes", 1000, 400), 2.0
    progress.advance(100)
    assert shown == ["zo<nes 400/1,000", "zo<nes 500/1,000 · 50/s · 10 s left"]
    assert 'value="500" max="1000"' in progress.html and "zo&lt;nes" in progress.html
    for _ in range(300):
        progress.advance(1)
    assert len(shown) == 2 and progress.done == 800


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
