"""Progress bars: on stderr, or below the cell of a notebook."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from html import escape
from typing import Any

on_progress: ContextVar[Callable[[float], None] | None] = ContextVar("on_progress", default=None)
"""A function that is told at each advance which share of the whole is done, in place of a bar with a name."""

told_end: ContextVar[float | None] = ContextVar("told_end", default=None)
"""When, by the monotonic clock, the whole work is to end, of which a bar may show only a stage; None if not told."""

_INTERVAL = 0.2
"""Shortest time between two updates of the bar in a notebook, in seconds."""

_LOGGED = 5.0
"""Least time of a work, in seconds, that leaves a line where stderr is no terminal: a file, or a pipe."""


@contextmanager
def bar(name: str | None, total: int, done: int = 0) -> Iterator[Callable[[int], None]]:
    """A progress bar that shows the rate and the remaining time; no bar if the name is None or `on_progress` is set.

    It is on stderr, and in a notebook in the output of the cell. Yields the function that advances it by a number of
    items.
    """
    if name is None:
        yield lambda n: None
    elif (tell := on_progress.get()) is not None:
        def report(n: int) -> None:
            nonlocal done
            done += n
            tell(done / total)

        yield report
    elif in_notebook():
        shown = NotebookBar(name, total, done)
        try:
            yield shown.advance
        finally:
            shown.show()
    else:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn

        columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(),
                   TextColumn("{task.fields[rate]}"))
        console, begun = Console(stderr=True), time.monotonic()
        # it vanishes from a terminal when all is done: the answer stands alone there
        with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
            task = progress.add_task(name, total=total, completed=done, rate="")

            def advance(n: int) -> None:
                progress.advance(task, n)
                shown = progress.tasks[0]
                speed = shown.finished_speed or shown.speed
                left = f" · {left_text(shown.remaining / speed)}" if speed and shown.remaining else ""
                progress.update(task, rate=rate_text(speed) + left if speed else "")

            yield advance
            if not console.is_terminal and (seconds := time.monotonic() - begun) >= _LOGGED:
                print(f"{name}: {total:,} in {seconds:,.0f} s", file=sys.stderr, flush=True)


def in_notebook() -> bool:
    """Whether this is the kernel of a notebook, whose shell has a connection to a page."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return getattr(shell, "kernel", None) is not None


class NotebookBar:
    """A progress bar as HTML, which needs no widgets: a notebook shows it again when it is reopened."""

    def __init__(self, name: str, total: int, done: int) -> None:
        self.name, self.total, self.done = name, total, done
        self._before, self._start, self._shown = done, time.monotonic(), time.monotonic()
        self._handle: Any = None
        self.show()

    def advance(self, n: int) -> None:
        """Count ``n`` more items as done."""
        self.done += n
        if time.monotonic() - self._shown >= _INTERVAL:
            self.show()

    def show(self) -> None:
        """Show how much is done now."""
        from IPython.display import display

        self._shown = time.monotonic()
        bundle = {"text/plain": self.text, "text/html": self.html}
        if self._handle is None:
            self._handle = display(bundle, raw=True, display_id=True)
        else:
            self._handle.update(bundle, raw=True)

    @property
    def text(self) -> str:
        """Name, items done, rate and remaining time."""
        parts = [f"{self.name} {self.done:,}/{self.total:,}"]
        seconds = time.monotonic() - self._start
        if (computed := self.done - self._before) > 0 and seconds > 0:
            rate = computed / seconds
            parts.append(rate_text(rate))
            left = left_text((self.total - self.done) / rate)
            parts.append(left if self.done < self.total else f"{seconds:,.0f} s")
        return " · ".join(parts)

    @property
    def html(self) -> str:
        """The same text beside a bar."""
        return (f'<div style="font:13px/1.6 system-ui,sans-serif"><progress value="{self.done}" max="{self.total}" '
                f'style="width:16em;max-width:100%;vertical-align:middle"></progress> {escape(self.text)}</div>')


def left_text(seconds: float) -> str:
    """How long the work goes on: the time told for the whole of it, but no less than the seconds of a bar."""
    end = told_end.get()
    return f"{max(seconds, 0.0 if end is None else end - time.monotonic()):,.0f} s left"


def rate_text(rate: float) -> str:
    """A rate, in items per second, as text."""
    return f"{rate:,.0f}/s" if rate >= 1 else f"{1 / rate:,.0f} s each"
