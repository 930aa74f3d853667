"""What is computed for one page, and in which order."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from gearchaos.datasheet.report import Report
from gearchaos.errors import InputError
from gearchaos.explorer.core.models import changes
from gearchaos.explorer.core.state import View
from gearchaos.explorer.core.worker import GeneratorFunction, Workers
from gearchaos.explorer.features.assessment.job import assessed
from gearchaos.explorer.features.assessment.speed_line import SpeedLine
from gearchaos.explorer.features.changes.job import changed_designs
from gearchaos.explorer.features.drawing.relief import best_relief
from gearchaos.explorer.features.drawing.speeds import factors
from gearchaos.explorer.features.knock.job import KnockedMotion, knocked_motion, motion_to_knock
from gearchaos.explorer.features.map.job import COARSE, Map, successive_maps
from gearchaos.explorer.features.motion import point
from gearchaos.explorer.features.motion.orbits import PeriodicMotion, Skeleton, branch, periodic_motion, skeleton
from gearchaos.explorer.features.motion.point import PointMotion, final_verdict, point_motion
from gearchaos.explorer.features.runup.job import RunUpResult, run_up
from gearchaos.explorer.features.tolerances.job import Cloud, tolerances
from gearchaos.explorer.web import export
from gearchaos.explorer.web.tasks import (
    ASSESSMENT,
    CHANGES,
    FACTORS,
    KNOCK,
    RELIEF,
    RESULTS,
    RUN_UP,
    SKELETON,
    TOLERANCES,
    Tasks,
)
from gearchaos.gears.operation.operating import OperatingModel, is_design
from gearchaos.studies.speeds.assess import Assessment

if TYPE_CHECKING:
    from gearchaos.explorer.web.page import Page

_DELAY = 0.05  # seconds between the last change of a slider and the start of a long computation
_MAP_DELAY = 0.02  # the same for a map: longer than between two frames of the browser, which may send a change each
_MOVING = 0.2  # seconds between two changes up to which a slider is being moved; the first has no delay
_NO_SPEED = "choose the gears in the menu of presets; a dimensionless model has no speed"
_NO_PAIR = "choose a pair of gears; a dimensionless model and a train have none"
_NO_DESIGN = "choose a drawing or a [design]; other gears have no inputs that can be changed"
_COARSE_DIAGRAM = 4  # the first bifurcation diagram has every 4th column


class Computations(Tasks):
    """The computations of one page (``owner``), at most one per task ("map", "diagram", ...).

    The motion at the point is computed first, by its own worker. A second worker computes the map, coarse first. Once a
    coarse map is shown it also computes a coarse bifurcation diagram and the other motions of the point; the fine
    diagram follows when the map is complete. Basins and files are computed on request. So are, by workers of their own,
    the branch of the motion at the point and what a knock does to it, the run-up, the assessment of the speeds, what
    tolerances do, and the bifurcation curves over the map, which begin once the map is complete.

    Results are shown by the methods of the page, ``display``, in its thread: ``call_soon`` takes a function and calls
    it there, later. ``skeleton_period`` is the largest
    period of the orbits whose bifurcation curves are shown or asked for, 0 without curves.
    """

    def __init__(
        self, owner: str, view: View, workers: Workers, call_soon: Callable[[Callable[[], None]], None],
        display: Page,
    ) -> None:
        super().__init__(owner, workers, call_soon, display)
        self._view = view
        self._map_asked = 0.0  # when one was asked for last
        self.point_motion: PointMotion | None = None  # the newest one
        self._awaits_map = False  # the diagram and the other motions wait for a coarse map
        self._awaits_update = False  # the point has moved, and `update_rest` comes later
        self._fine_diagram_waits = self._basins_wait = self._branch_waits = False
        self._followed: PeriodicMotion | None = None  # the motion whose branch is shown or being computed
        self._skeleton: Skeleton | None = None  # the newest one
        self.skeleton_period = 0
        self.run_up: RunUpResult | None = None  # that of the present view
        self.assessment: Assessment | None = None  # that of the present map
        self._line: SpeedLine | None = None  # what is assessed, or being assessed
        self.cloud: Cloud | None = None  # the designs at the present point
        self.knocked: KnockedMotion | None = None  # what a knock does to the motion at the present point
        self.changes: Report | None = None  # of the design at the present torque
        self._changed: SpeedLine | None = None  # the speeds over which its changes are assessed
        self._along: tuple[Any, ...] = ()  # the models and speeds whose dynamic factors are shown, or on their way
        self._clear_display = {RUN_UP: display.clear_run_up, ASSESSMENT: display.clear_assessment,
                               TOLERANCES: display.clear_tolerances, KNOCK: display.clear_knock,
                               CHANGES: display.clear_changes}

    # --- the view changes ------------------------------------------------------------------------------------------

    def start(self, view: View) -> None:
        """Compute what a new page shows."""
        self._view = view
        self._ask_point_motion()
        self._ask_map()
        self._awaits_map = True

    def update(self, view: View) -> None:
        """Show another view: compute the motion at its point and its map, unless they are those of the view before."""
        before, self._view = self._view, view
        self._awaits_update = True
        if before.point != view.point:
            self._ask_point_motion()
            self._clear(KNOCK)
        if before.plane_key != view.plane_key:
            self.clear_skeleton()
        if before.map_key != view.map_key:
            self._ask_map()
        silent = self.run_up is None or not self.run_up.sound
        if before.run_key != view.run_key or (view.sounds and not before.sounds and silent):
            self._clear(RUN_UP)
        if self._line is not None and not self._line.belongs_to(view):
            self._clear(ASSESSMENT)
        elif self._line is not None and self.assessment is not None:  # in its place on the present map
            self._display.show_assessment(self._line, self.assessment, ASSESSMENT not in self._pending)
        if self._changed is not None and (not self._changed.goes_through(view) or before.change != view.change):
            self._clear(CHANGES)
        if before.operating_point != view.operating_point:
            self._clear(TOLERANCES)

    def update_rest(self, before: View) -> None:
        """Compute what else differs between an earlier view and the present one."""
        self._awaits_update = False
        if before.line_key != self._view.line_key:
            self._ask_diagram()
            if self._followed is not None and before.branch_key == self._view.branch_key:
                self._follow(self._followed)  # in other units
            elif self._followed is not None:
                self.clear_branch()
        if before.operating_point != self._view.operating_point:
            self._ask_attractors()
        if self._basins_wait:
            self.ask_basins()
        if self._branch_waits:
            self.ask_branch()

    def close(self) -> None:
        """Cancel everything."""
        for worker in (self._quick, self._slow, self._branches, self._curves):
            worker.cancel(self._owner)

    # --- requests --------------------------------------------------------------------------------------------------

    def _ask_point_motion(self) -> None:
        self._quick.cancel(self._owner, "final verdict")
        self._pending.pop("final verdict", None)
        self._ask(self._quick, "motion", partial(point_motion, self._view.point), self._show_point_motion)

    def _ask_map(self) -> None:
        self.map, before, self._map_asked = None, self._map_asked, time.monotonic()
        delay = _MAP_DELAY if self._map_asked - before < _MOVING else 0.0
        self._ask(self._slow, "map", partial(successive_maps, self._view), self.show_map, delay, True)

    def _ask_diagram(self, *strides: int) -> None:
        """Compute the bifurcation diagram; the fine one waits until the map is complete."""
        self._fine_diagram_waits = not strides and "map" in self._pending
        strides = strides or ((_COARSE_DIAGRAM,) if self._fine_diagram_waits else (_COARSE_DIAGRAM, 1))
        function = partial(point.bifurcation, self._view, *strides)
        self._ask(self._slow, "diagram", function, self._display.show_diagram, 2 * _DELAY)

    def _ask_attractors(self) -> None:
        """Compute the other motions of the point; remove the basins and motions of the previous point."""
        self._drop(self._slow, "basins")
        self._display.clear_point_studies()
        function = partial(point.attractors, self._view)
        self._ask(self._slow, "other motions", function, self._display.show_attractors, 3 * _DELAY)

    def ask_basins(self) -> None:
        """Compute the basins of the point, as soon as the page shows that point and a first map."""
        self._basins_wait = self._awaits_map or self._awaits_update
        if not self._basins_wait:
            view = self._view
            self._ask(self._slow, "basins", partial(point.basins, view), partial(self._display.show_basins, view))

    def ask_branch(self) -> None:
        """Follow the motion at the point along the line of the diagram; there is a message if it is not periodic."""
        self._branch_waits = self._awaits_update
        if self._branch_waits:
            return
        found = self.point_motion
        if found is None or found.model != self._view.point:
            self._display.show_message("The motion at the point is still being computed.")
            return
        try:
            self._followed = periodic_motion(found)
        except InputError as error:
            self._display.show_message(error.advice)
        else:
            self._follow(self._followed)

    def _follow(self, motion: PeriodicMotion) -> None:
        """Compute the branch of a motion."""
        self._display.clear_branch()
        self._ask(self._branches, "branch", partial(branch, self._view, motion), self._display.show_branch)

    def clear_branch(self) -> None:
        """Remove the branch; cancel its computation."""
        self._followed, self._branch_waits = None, False
        self._drop(self._branches, "branch")
        self._display.clear_branch()

    def ask_skeleton(self, period: int) -> None:
        """Compute the bifurcation curves of orbits up to a period over the map, as soon as the map is complete."""
        self.clear_skeleton()
        self.skeleton_period = period
        self._display.show_skeleton(None)
        if "map" not in self._pending or (self.map is not None and self.map.share == 1):
            self._ask_waiting_skeleton()

    def _ask_waiting_skeleton(self) -> None:
        """Compute the bifurcation curves that were asked for, unless that has begun."""
        if self.skeleton_period and self._skeleton is None and SKELETON not in self._pending:
            function = partial(skeleton, self._view, self.skeleton_period)
            self._ask(self._curves, SKELETON, function, partial(self._keep, SKELETON, self._display.show_skeleton))

    def clear_skeleton(self) -> None:
        """Remove the bifurcation curves; cancel their computation."""
        if self.skeleton_period:
            self._skeleton, self.skeleton_period = None, 0
            self._drop(self._curves, SKELETON)
            self._display.clear_skeleton()

    def ask_run_up(self) -> None:
        """Compute the run-up of the view, or stop that; there is a message if the view has no gears."""
        if self.run_up is None:
            run: Any = self._view.run
            function = partial(run_up, self._view.operating_point, run, self._view.mesh)
            self._press(RUN_UP, "" if run else _NO_SPEED, function, self._display.show_run_up)

    def ask_assessment(self) -> None:
        """Assess the speeds at the point, or stop that; there is a message if the view has no gears."""
        if ASSESSMENT not in self._pending:
            self._clear(ASSESSMENT)
            self._line = SpeedLine(self._view)
        assert self._line is not None
        self._press(ASSESSMENT, "" if self._view.run else _NO_SPEED, partial(assessed, self._line),
                    partial(self._display.show_assessment, self._line))

    def ask_tolerances(self) -> None:
        """Compute what tolerances do at the point, or stop that; there is a message if the view has no pair."""
        is_pair = isinstance(self._view.operating_point, OperatingModel)
        self._press(TOLERANCES, "" if is_pair else _NO_PAIR, partial(tolerances, self._view),
                    self._display.show_tolerances)

    def ask_changes(self) -> None:
        """Assess changed designs at the torque of the point, or stop that; a message says why there are none."""
        obstacle, model = "" if is_design(self._view.gears) else _NO_DESIGN, self._view.operating_point
        if isinstance(model, OperatingModel) and (apart := changes(model)):
            obstacle = f"set back {', '.join(apart)}, which a design does not have"
        if CHANGES not in self._pending:
            self._clear(CHANGES)
            self._changed = SpeedLine(self._view)
        assert self._changed is not None
        self._press(CHANGES, obstacle, partial(changed_designs, self._changed), self._display.show_changes)

    def ask_relief(self) -> None:
        """Find the best tip relief of the design at the point; there is a message if the view has none."""
        if not is_design(self._view.gears):
            self._display.show_message(_NO_PAIR)
            return
        self._ask(self._quick, RELIEF, partial(best_relief, self._view.gears), self._display.show_relief)

    def ask_factors(self, views: list[View]) -> None:
        """Compute the dynamic factors of drawings along the speeds of their first view, unless they are known."""
        ends = SpeedLine(views[0]).speeds if views else (0.0, 0.0)
        asked = tuple(view.model_at({"speed": ends[0]}) for view in views), ends
        if views and asked != self._along:
            self._along = asked
            self._ask(self._quick, FACTORS, partial(factors, *asked), self._display.show_factors, 3 * _DELAY)

    def ask_knock(self) -> None:
        """Find what a knock does to the motion at the point, or cancel that; a message says why it cannot be found."""
        motion, obstacle = self.point_motion, ""
        function: Any = None
        if not isinstance(self._view.operating_point, OperatingModel):
            obstacle = _NO_PAIR
        elif motion is None or motion.model != self._view.point:
            obstacle = "the motion at the point is still being computed"
        elif KNOCK not in self._pending:
            function = partial(knocked_motion, motion_to_knock(motion), motion.verdict.dynamic_factor or np.nan)
        self._press(KNOCK, obstacle, function, self._display.show_knock)

    def ask_file(self, kind: str, suffix: str) -> None:
        """Make a file of the map, the motion or the run-up in the units that the view shows, or of the assessment."""
        motion, dataset, title = self.point_motion, None, ""
        if kind == "map" and self.map is not None:
            dataset = (self.map if suffix == "nc" else self.map.of_mesh(self._view.mesh)).dataset
        elif kind == "motion" and motion is not None:
            dataset, title = motion.trajectory, motion.verdict.label
        elif kind == "runup" and self.run_up is not None:
            dataset = self.run_up.dataset
        elif kind == "assessment" and self.assessment is not None and self._line is not None:
            self._save(kind, suffix, partial(export.assessment, kind, suffix, Report(self.assessment), self._line))
            return
        elif kind == "changes" and self.changes is not None and self._changed is not None:
            self._save(kind, suffix, partial(export.assessment, kind, suffix, self.changes, self._changed))
            return
        elif kind == "tolerances" and self.cloud is not None:
            self._save(kind, suffix, partial(export.scatter, suffix, self.cloud.dataset))
            return
        if dataset is None:
            self._display.show_message("There is nothing to save yet.")
            return
        gears = self._view.gears if self._view.physical else None
        self._save(kind, suffix, partial(export.exported, kind, suffix, dataset, self._view.colour, title, gears))

    def _save(self, kind: str, suffix: str, function: GeneratorFunction) -> None:
        """Make a file and have the browser save it."""
        self._ask(self._quick, f"{kind}.{suffix}", function, lambda found: self._display.save_file(*found))

    # --- results ---------------------------------------------------------------------------------------------------

    def _ended(self, task: str, message: str | None) -> None:
        super()._ended(task, message)
        if task in self._clear_display and getattr(self, RESULTS[task]) is None:
            self._line = None if task == ASSESSMENT else self._line
            self._clear_display[task]()
        if task == "other motions" and message:
            self._display.show_attractors(xr.Dataset())
        if task == "map":
            self._continue_after_first_map()
            self._continue_after_last_map()

    def show_map(self, found: Map) -> None:
        """Show a map, unless it does not have the variable of the present colouring."""
        self.map = found
        if self._view.colour not in found.dataset and self._view.colour != "motion":
            return
        self._display.show_map(found)
        if found.stride <= COARSE[-1]:
            self._continue_after_first_map()
        if found.share == 1:
            self._continue_after_last_map()

    def _continue_after_first_map(self) -> None:
        if self._awaits_map:
            self._awaits_map = False
            self._ask_diagram()
            self._ask_attractors()
            if self._basins_wait:
                self.ask_basins()

    def _continue_after_last_map(self) -> None:
        if self._fine_diagram_waits:
            self._ask_diagram(1)
        self._ask_waiting_skeleton()

    def _show_point_motion(self, found: PointMotion) -> None:
        """Show a motion, unless the point has moved since; compute the final verdict if this one is preliminary."""
        if found.model != self._view.point:
            return
        self.point_motion = found = found.with_trajectory_of(self.point_motion)
        self._display.show_point_motion(found)
        if found.stage == "preliminary":
            function = partial(final_verdict, found.model, found.verdict.label)
            self._ask(self._quick, "final verdict", function, self._show_point_motion)
