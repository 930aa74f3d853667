"""How far a study of a page is, and how long its rest takes, by a clock of the test."""

import math
import threading
from types import SimpleNamespace

import pytest

from gearchaos.execute.progress import bar, told_end
from gearchaos.explorer.core import progress
from gearchaos.explorer.core.progress import Progress, with_progress


@pytest.mark.parametrize(("done", "told", "number", "count", "share", "left"), [
    (0, None, 0, 1, 0.0, math.nan), (1, None, 0, 1, 0.25, 30.0), (1, 47.0, 0, 1, 0.25, 37.0),
    (3, 5.0, 0, 1, 0.75, 10 / 3),
    (1, None, 1, 4, 1.25 / 4, 30.0 + 2 * 40.0), (0, None, 1, 4, 0.25, math.nan)])
def test_the_rest_takes_as_long_as_was_told_or_as_what_is_done(monkeypatch, done, told, number, count, share, left):
    """Of a bar with 4 items ``done`` are, 10 s after the beginning; the end was told, s after it."""
    clock = iter([0.0, *[10.0] * 100])
    monkeypatch.setattr(progress, "time", SimpleNamespace(monotonic=lambda: next(clock)))
    monkeypatch.setattr(progress, "_INTERVAL", 0.01)
    reported, seen = threading.Event(), threading.Event()

    def study():
        told_end.set(told)
        with bar("items", 4) as advance:
            if done:
                advance(done)
            reported.set()
            seen.wait(60)
        return "found"

    steps = with_progress(study, number, count)
    monkeypatch.setattr(progress, "wait", lambda futures, _: (reported.wait(60), SimpleNamespace(done=set()))[1])
    found = next(steps)
    assert found == pytest.approx(Progress(share, left), nan_ok=True)
    monkeypatch.undo()
    seen.set()
    with pytest.raises(StopIteration) as end:
        while True:
            next(steps)
    assert end.value.value == "found"


def test_progress_in_words():
    assert [Progress(0.42, left).words for left in (math.nan, 12.3, 600.0)] == [
        "42 %", "42 %, about 12 seconds left", "42 %, about 10 minutes left"]
