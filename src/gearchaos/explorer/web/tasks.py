"""The tasks of one page: begun, shown while they are computed, stopped, and dropped."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import xarray as xr

from gearchaos.explorer.core.progress import Part, Progress
from gearchaos.explorer.core.worker import GeneratorFunction, Job, Worker, Workers
from gearchaos.explorer.features.map.job import Map

if TYPE_CHECKING:
    from gearchaos.explorer.web.page import Page

SKELETON = "bifurcation curves"  # the task of the curves over the map
RUN_UP = "run-up"  # the task of the run-up
ASSESSMENT = "assessment"  # the task of the speeds to avoid
TOLERANCES = "tolerances"  # the task of what they do at the point
KNOCK = "knock"  # the task of what a knock does to the motion at the point
RELIEF = "best tip relief"  # the task of the relief of a drawing
FACTORS = "dynamic factor along the speed"  # the task of the factors of drawings
CHANGES = "changed designs"  # the task of which change of a design helps
RESULTS = {SKELETON: "_skeleton", RUN_UP: "run_up", ASSESSMENT: "assessment", TOLERANCES: "cloud",
           KNOCK: "knocked", CHANGES: "changes"}  # the attribute that keeps the result of a task
BUTTONS = {RUN_UP: "run", ASSESSMENT: "assess", TOLERANCES: "tolerances", KNOCK: "knock", CHANGES: "changes"}
"""The button that begins a task and stops it."""


class Tasks:
    """The tasks of a page (``owner``) and their workers, at most one of each name ("map", "diagram", ...).

    Their results are shown by the methods of the page, ``display``, in its thread: ``call_soon`` takes a function and
    calls it there, later.
    """

    def __init__(
        self, owner: str, workers: Workers, call_soon: Callable[[Callable[[], None]], None], display: Page
    ) -> None:
        self._owner, self._call_soon, self._display = owner, call_soon, display
        self._quick, self._slow, self._branches, self._curves = workers
        self._pending: dict[str, object] = {}  # the tasks, each with what tells its request from later ones
        self._progress: dict[str, Progress] = {}  # of the tasks of `BUTTONS` that are computed
        self._lacks: dict[str, str] = {}  # what the results of such tasks lack that is still computed
        self.map: Map | None = None  # the newest one

    def _ask(
        self, worker: Worker, task: str, function: GeneratorFunction, show: Callable[[Any], None], delay: float = 0.0,
        urgent: bool = False,
    ) -> None:
        """Have a worker compute a task; ``show`` gets its results, but no empty Dataset, which is progress only.

        A result, or an end, that was on its way when the task was dropped or asked for again is ignored.
        """
        def deliver(found: Any) -> None:
            if self._pending.get(task) is not request:
                return
            if not isinstance(found, xr.Dataset) or found:
                show(found)
            self._show_busy()

        def end(message: str | None) -> None:
            if self._pending.get(task) is request:
                self._ended(task, message)

        self._pending[task] = request = object()
        self._show_busy()
        worker.submit(self._owner, task, Job(function, lambda found: self._call_soon(partial(deliver, found)),
                                             lambda message: self._call_soon(partial(end, message)), delay,
                                             lambda: self._call_soon(partial(self._show_busy, compiling=True)), urgent))

    def _drop(self, worker: Worker, task: str) -> None:
        """Cancel a task that need not be computed again."""
        worker.cancel(self._owner, task)
        self._ended(task, None)

    def _clear(self, task: str) -> None:
        """Remove the result of one of `RESULTS`, and cancel its computation."""
        if task in self._pending or getattr(self, RESULTS[task]) is not None:
            setattr(self, RESULTS[task], None)
            self._drop(self._branches, task)

    def _keep(self, task: str, show: Callable[..., None], found: Any) -> None:
        """Show the result of one of `RESULTS`, or what is known of it; or how far it is."""
        if isinstance(found, Progress):
            self._progress[task] = found
        elif isinstance(found, Part):
            self._lacks[task] = found.lacks
            self._progress.pop(task, None)
            setattr(self, RESULTS[task], found.found)
            show(found.found, False)
        else:
            self._lacks.pop(task, None)
            setattr(self, RESULTS[task], found)
            show(found)

    def _press(self, task: str, obstacle: str, function: GeneratorFunction, show: Callable[..., None]) -> None:
        """Begin one of `BUTTONS`, or stop it; a message says what hinders it, if anything does."""
        if task in self._pending:
            self._stop(task, show)
            return
        self._clear(task)
        if obstacle:
            self._ended(task, obstacle)
            return
        self._display.show_message("")
        self._display.show_progress(BUTTONS[task], "")
        show(None)
        self._ask(self._branches, task, function, partial(self._keep, task, show))

    def _stop(self, task: str, show: Callable[..., None]) -> None:
        """Stop one of `BUTTONS`, and say what is known by now."""
        share, lacks = self._progress.get(task, Progress(0.0)).share, self._lacks.get(task)
        known = f"what stands below lacks {lacks}" if lacks else "nothing of it is known yet"
        self._drop(self._branches, task)
        if lacks:
            show(getattr(self, RESULTS[task]))
        self._display.show_progress(BUTTONS[task], f"{task} stopped at {100 * share:.0f} %: {known}")

    def _show_busy(self, compiling: bool = False) -> None:
        share = 0.0 if self.map is None else self.map.share
        progress = f"map {100 * share:.0f} %" if share < 1 else "map (final verdicts of chaotic cells)"
        words = {"map": progress} | {task: f"{task} {done.words}" for task, done in self._progress.items()}
        for task in self._pending.keys() & (self._progress.keys() | self._lacks.keys()):
            done = [self._progress[task].words] if task in self._progress else []
            lacks = [f"what stands below lacks {self._lacks[task]}"] if task in self._lacks else []
            self._display.show_progress(BUTTONS[task], "; ".join(done + lacks))
        self._display.show_busy([words.get(p, p) for p in sorted(self._pending)], compiling)

    def _ended(self, task: str, message: str | None) -> None:
        """The job of a task has ended, after its last result or with an error message."""
        self._pending.pop(task, None)
        self._show_busy()
        if message:
            self._display.show_message(f"{task}: {message}")
        self._progress.pop(task, None)
        if self._lacks.pop(task, None) and message:
            setattr(self, RESULTS[task], None)
        if task in BUTTONS:
            self._display.show_progress(BUTTONS[task], "")
