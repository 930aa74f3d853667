"""The page: its figures and its texts, and how results are shown on them."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import xarray as xr

from gearchaos.datasheet.report import Report
from gearchaos.errors import InputError
from gearchaos.explorer.core.drawing import Drawing
from gearchaos.explorer.core.models import are_alike, equal
from gearchaos.explorer.core.opened import Opened
from gearchaos.explorer.core.presets import preset_of
from gearchaos.explorer.core.state import LINES, View
from gearchaos.explorer.core.style import Panel, Units
from gearchaos.explorer.core.text import as_python, to_query
from gearchaos.explorer.core.trains import shown_mesh
from gearchaos.explorer.features.assessment.panel import assessment_text, places
from gearchaos.explorer.features.assessment.speed_line import SpeedLine
from gearchaos.explorer.features.changes.panel import changes_text
from gearchaos.explorer.features.drawing.form import marks
from gearchaos.explorer.features.drawing.panel import CYCLES, CycleFigure, Sheet, sheet_text
from gearchaos.explorer.features.drawing.relief import Best, relief_text
from gearchaos.explorer.features.drawing.speeds import Factors, FactorsFigure, factors_text
from gearchaos.explorer.features.drawing.turning import gaps, turning_teeth
from gearchaos.explorer.features.knock.job import KnockedMotion
from gearchaos.explorer.features.knock.panel import KnockFigure, knock_text
from gearchaos.explorer.features.map.job import Map
from gearchaos.explorer.features.map.panel import BasinsFigure, Choice, MapFigure, choices, skeleton_text
from gearchaos.explorer.features.motion import panel as motion
from gearchaos.explorer.features.motion.diagram import BifurcationFigure, branch_text
from gearchaos.explorer.features.motion.orbits import Skeleton
from gearchaos.explorer.features.motion.point import PointMotion
from gearchaos.explorer.features.runup.job import RunUpResult
from gearchaos.explorer.features.runup.panel import RunFigure, WaterfallFigure, played, run_up_text
from gearchaos.explorer.features.tolerances.job import Cloud
from gearchaos.explorer.features.tolerances.panel import CloudFigure, cloud_text
from gearchaos.explorer.features.train.scheme import mesh_verdicts
from gearchaos.explorer.web.form import GEARS, NUMBER, Menu, field_values, parameter_form, plane_menus, whose
from gearchaos.explorer.web.messages import Messages
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.operation.operating import pair_of
from gearchaos.gears.train.model import TrainModel
from gearchaos.model import PARAMETER_PAIRS
from gearchaos.studies.speeds.assess import Assessment

_KEPT_ASSESSMENTS = 8  # whose ranges are drawn again where their gears are


class Page:
    """One page, which shows the results of its `Computations`.

    ``opened`` has the gears of the page, and ``view`` is the present view, in whose units results are shown.
    ``preset`` is the key of the preset that it shows, or "", ``basins_view`` the view whose basins are shown,
    ``merge_wheels`` whether the form has common fields for both wheels where they are alike,
    ``choices`` the motions that the page offers as buttons, ``ranges`` the middles of the ranges of speed that it
    lists, on the ``line`` that was assessed.
    """

    def __init__(self, opened: Opened, view: View) -> None:
        self.view = self.basins_view = view
        self.opened, self._has_gears = opened, opened.start.gears is not None
        self._sheet: Sheet | None = None
        self.merge_wheels, self.preset = True, ""
        self._layout: tuple[Any, ...] = ()
        self._plane: tuple[Any, ...] = ()
        self.messages = Messages()
        self.save_file, self._write = self.messages.save_file, self.messages.write
        set_attributes = self.messages.set_attributes
        self.map = MapFigure(set_attributes)
        self.diagram = BifurcationFigure(set_attributes)
        self.basins = BasinsFigure(set_attributes)
        self.history = motion.HistoryFigure(set_attributes)
        self.phase = motion.PhaseFigure(set_attributes)
        self.portrait = motion.PortraitFigure(set_attributes)
        self.spectrum = motion.SpectrumFigure(set_attributes)
        self.force = motion.ForceFigure(set_attributes) if self._has_gears else None
        self.run, self.waterfall = RunFigure(set_attributes), WaterfallFigure(set_attributes)
        self.cloud, self.knock = CloudFigure(set_attributes), KnockFigure(set_attributes)
        self.cycles = [CycleFigure(set_attributes, *each) for each in CYCLES]
        self.along = FactorsFigure(set_attributes)
        self._factors: Factors | None = None
        self._assessed: deque[tuple[SpeedLine, Assessment]] = deque(maxlen=_KEPT_ASSESSMENTS)
        self._write_choices([])
        self.line: SpeedLine | None = None
        self.ranges: list[float] = []
        self._trajectory_key: tuple[Any, ...] | None = None
        self._portrait_key: tuple[Any, ...] | None = None

    def roots(self) -> dict[str, Any]:
        """The figures by their names in the template."""
        panels: dict[str, Panel] = {
            "map": self.map, "history": self.history, "phase": self.phase, "portrait": self.portrait,
            "spectrum": self.spectrum, "line": self.diagram, "basin": self.basins}
        if self.force is not None:
            panels |= {"force": self.force, "run": self.run, "waterfall": self.waterfall}
        if self.opened.has_gears[1]:
            panels |= {"cloud": self.cloud, "knock": self.knock}
        if self.opened.drawing is not None:
            panels |= {each.name: each for each in self.cycles} | {"factors": self.along}
        return {name: panel.figure for name, panel in panels.items()}

    def units(self, view: View) -> Units:
        """The units in which a view shows results."""
        return Units(view.gears if view.physical else None, self._has_gears)

    def show_view(self) -> None:
        """Show the form, the axes of the map, the point, and the address of the view."""
        view = self.view
        self.show_form()
        self.map.mark(view.at)
        self.diagram.mark(view.at["xy".index(view.line)])
        if self._plane != (view.x, view.y):
            self._plane = (view.x, view.y)
            self.map.set_plane(view, self.units(view))
        opened, is_complete = self.opened, self.opened.is_complete
        self.messages.set_page_state(opened.query + (to_query(view, opened.start) if is_complete else ""),
                                     as_python(view) if is_complete else "", opened.toml(view))
        if opened.drawing is not None:
            self.show_drawing(opened.drawing)
            self.along.mark(view.operating_point.value("speed") or 0.0)

    def show_drawing(self, drawing: Drawing) -> None:
        """Show what follows from the drawing at the point, and what is wrong or missing beside its inputs."""
        reading, kept, gears = drawing.reading, self.opened.kept, self.view.gears
        self.messages.set_values({"drawing": json.dumps(marks(reading))})
        design = gears if reading.view is not None and isinstance(gears, GearDesign) else reading.design
        before = self._sheet
        if design is not None and (before is None or (before.drawing, before.kept, before.design) != (
                drawing, kept, design)):
            self._sheet = Sheet.of(drawing, design, kept)
            for each in self.cycles:
                each.show(self._sheet)
            self._write("relief")
            with suppress(InputError):  # without a backlash
                self.messages.set_values({"teeth": json.dumps(turning_teeth(design))})
        self._write("sheet", "features/drawing/sheet", text=self._sheet and sheet_text(self._sheet),
                    needed=reading.needed, errors=reading.errors)

    @property
    def compared(self) -> list[View]:
        """The view of a drawing, and that of the kept one at the same speed and torque; none of one that cannot run.
        """
        view, kept = self.view, self.opened.kept and self.opened.kept.reading.view
        if self.opened.drawing is None or view.gears is None or not self.opened.is_complete:
            return []
        with suppress(InputError):  # out of its range
            if kept:
                for name in ("speed", "torque"):
                    kept = kept.with_value(name, view.operating_point.value(name))
                return [view, replace(kept, change=view.change)]
        return [view]

    def show_factors(self, found: Factors | None) -> None:
        """Draw and describe the dynamic factors along the speed, and the ranges to avoid of what was assessed."""
        self._factors = found
        if found is not None:
            assessed = [next((each for line, each in self._assessed if line.goes_through(view)
                              and line.view.change == view.change), None) for view in self.compared]
            self.along.show(found, assessed)
            self._write("speeds-text", "features/drawing/speeds", sentences=factors_text(found, assessed))

    def show_relief(self, found: Best) -> None:
        """Write which tip relief is best, unless the drawing has changed since."""
        if self._sheet is not None and self._sheet.design == found.design:
            text, address = relief_text(found, self._sheet.drawing)
            self._write("relief", "features/drawing/relief", text=text, address=address)

    def draw(self, opened: Opened) -> None:
        """Take another drawing, or another one to keep."""
        self.opened, self._layout = opened, ()

    def show_form(self) -> None:
        """Show the values of the view in the form, which is replaced only if it has other fields."""
        view, point = self.view, self.view.operating_point
        self.preset, alike = preset_of(view, self.preset), self.merge_wheels and are_alike(point)
        merged = {pair for pair in PARAMETER_PAIRS if alike and equal(point, pair)}
        values = field_values(view)
        layout = view.model.kind, tuple(values), view.x.name, view.y.name, merged, view.physical and self._has_gears
        if layout != self._layout:
            self._layout = layout
            self._write("parameters", "web/templates/parameters", form=parameter_form(
                view, merged, self.opened.start, self.opened.drawing is not None))
            self._write("axes", "web/templates/menus", menus=plane_menus(view, self.units(view)))
            lines = Menu("line", "Diagram along the", tuple((k, f"{v} line") for k, v in LINES.items()))
            self._write("line-choose", "web/templates/menus", menus=[lines])
        stiffness = {} if isinstance(view.model, TrainModel) else {"stiffness": view.model.stiffness.kind}
        self.messages.set_values({
            **{name: f"{value:{NUMBER}}" for name, value in values.items()}, **stiffness,
            "preset": self.preset if view.gears is None else GEARS, "kind": view.model.kind,
            "damping_law": view.model.law.name, "x": view.x.name, "y": view.y.name, "colour": view.colour,
            "line": view.line, "alike": alike, "units": view.physical, "mesh": view.mesh,
            "change": view.change,
            **{f"run-{name}": value for name, value in (view.run.values() if view.run else {}).items()},
        })

    def show_map(self, found: Map) -> None:
        """Draw the map and its legend."""
        self.map.show(found.of_mesh(self.view.mesh), self.view.colour, self.units(self.view))
        legend = self.map.legend
        legend = legend._replace(title=f"{legend.title} {whose(self.view)}".strip())
        self._write("legend", "features/map/legend", legend=legend, map=found, colour=self.view.colour)

    def show_point_motion(self, found: PointMotion) -> None:
        """Draw the motion of a point and write its verdict."""
        view, units, wheels = self.view, self.units(self.view), motion.wheels_of(self.view)
        drawn = found
        if isinstance(view.point, TrainModel):
            drawn = found.of_mesh(shown_mesh(view.point, view.mesh).name, wheels.half_backlash)
        key = found.model, found.verdict.periods_spent, drawn.portrait is None, units, view.mesh
        if found.verdict.section and found.stage != "verdict" and key != self._portrait_key:  # words come first
            self._portrait_key = key
            self.portrait.show(drawn, units)
        if (trajectory := drawn.trajectory) is not None:
            trajectory_key = float(trajectory["z"].values[0]), trajectory.sizes["tau"], units, view.mesh
            if trajectory_key != self._trajectory_key:  # it is not drawn already
                self._trajectory_key = trajectory_key
                tau, period = motion.times(trajectory)
                shown = units.scaled(trajectory)
                self.spectrum.show(trajectory, shown["z_dot"], units, wheels)
                self.history.show(shown, tau, period, units)
                self.phase.show(shown, units, wheels)
                self._show_turning(found)
                if self.force is not None and view.gears is not None:
                    self.force.show(shown, tau, period, units, wheels)
                elif self.force is not None:
                    self.force.clear()
        elif not found.verdict.section:  # it diverged
            for figure in (self.history, self.phase, self.portrait, self.spectrum, self.force):
                if figure is not None:
                    figure.clear()
            self._trajectory_key = self._portrait_key = None
            self.messages.set_values({"gaps": "null"})
        text = motion.verdict_text(found, view, units)
        self.messages.set_values({"verdicts": json.dumps(mesh_verdicts(text.meshes, text.force_unit))})
        self._write("verdict", "features/motion/verdict", found=found, v=found.verdict, text=text, hints=motion.HINTS)

    def _show_turning(self, found: PointMotion) -> None:
        """Have the teeth of a drawing turn with a motion, which has a trajectory."""
        if self.opened.drawing is not None and self.view.gears is not None and found.trajectory is not None:
            turned = gaps(found.trajectory, found.verdict.period, pair_of(self.view.gears).half_backlash)
            self.messages.set_values({"gaps": json.dumps(turned)})

    def show_diagram(self, found: xr.Dataset) -> None:
        """Draw the bifurcation diagram."""
        self.diagram.show(found, self.units(self.view))

    def show_branch(self, found: xr.Dataset) -> None:
        """Draw the branch of a motion over the diagram, and describe it below."""
        units = self.units(self.view)
        self.diagram.show_branch(found, units)
        self._write("branch", "features/motion/branch", branch=branch_text(found, units))

    def clear_branch(self) -> None:
        """Remove the branch."""
        self.diagram.clear_branch()
        self._write("branch")

    def show_skeleton(self, found: Skeleton | None) -> None:
        """Draw bifurcation curves over the map, and their legend; None if they wait for the map."""
        if found is not None:
            self.map.skeleton.show(found.curves)
        self._write("skeleton-legend", "features/map/skeleton", text=skeleton_text(found))
        self.messages.set_values({"skeleton": True})

    def clear_skeleton(self) -> None:
        """Remove the bifurcation curves."""
        self.map.skeleton.show(())
        self._write("skeleton-legend")
        self.messages.set_values({"skeleton": False})

    def show_basins(self, view: View, found: xr.Dataset) -> None:
        """Draw the basins of attraction of a view and their legend."""
        self.basins_view = view
        self.basins.show(found, self.units(view))
        self._write("basin-legend", "features/map/legend", legend=self.basins.legend)

    def show_attractors(self, found: xr.Dataset) -> None:
        """Show a button for every motion of the point, or that none was found, as by an empty Dataset."""
        self._write_choices(choices(found) if found else [], sought=False)

    def clear_point_studies(self) -> None:
        """Hide the basins and the motions of the previous point."""
        self.basins.clear()
        self._write("basin-legend")
        self._write_choices([])

    def _write_choices(self, found: list[Choice], sought: bool = True) -> None:
        """Write the buttons of motions, or whether they are still being looked for."""
        self.choices = found
        self._write("others", "features/motion/attractors", choices=found, sought=sought)

    def show_run_up(self, found: RunUpResult | None) -> None:
        """Set up the figures of a run-up, describe it, and have the browser play it; None while it is computed."""
        if found is None:
            return
        units = self.units(self.view)
        dataset = units.scaled(found.dataset)
        name, images = self.run.show(dataset, units), self.waterfall.show(dataset, units)
        self._write("run-text", "features/runup/runup", text=run_up_text(dataset, name))
        self.messages.set_run_up(played(found, dataset, self.view, name, images, {
            "line_ids": [source.id for source in self.run.lines], "jump_id": self.run.jumps.id,
            "image_id": self.waterfall.image.id, "now_ids": [self.run.now.id, self.waterfall.now.id],
            "runner_id": self.map.runner.id}))

    def clear_run_up(self) -> None:
        """Remove the run-up, and end its playing."""
        self._write("run-text")
        self.messages.set_run_up({})

    def show_progress(self, button: str, words: str) -> None:
        """Write beside a button how far it is what it began, or where that was stopped."""
        self.messages.set_values({f"{button}-progress": words})

    def show_assessment(self, line: SpeedLine, found: Assessment | None, whole: bool = True) -> None:
        """Draw an assessment over the map and write what to avoid and to use; None or a part while it is computed."""
        self.messages.set_values({"assess": found is None or not whole})
        if found is not None:
            self.line, self.ranges = line, places(found)
            self._assessed.appendleft((line, found))
            self.show_factors(self._factors)
            self.map.assessed.show(found, line, self.view)
            text = assessment_text(found, line, self.view, self.units(self.view))
            self._write("assessment-text", "features/assessment/assessment", text=text)

    def clear_assessment(self) -> None:
        """Remove the assessment."""
        self.messages.set_values({"assess": False})
        self.line, self.ranges = None, []
        self.map.assessed.clear()
        self.show_factors(self._factors)
        self._write("assessment-text")

    def show_tolerances(self, found: Cloud | None, whole: bool = True) -> None:
        """Draw the designs at the point and write how likely contact is lost; None or a part while it is computed."""
        self.messages.set_values({"tolerances": found is None or not whole})
        if found is not None:
            self.cloud.show(found)
            self._write("tolerances-text", "features/tolerances/tolerances", text=cloud_text(found, self.view))

    def clear_tolerances(self) -> None:
        """Remove the designs at the point."""
        self.messages.set_values({"tolerances": False})
        self._write("tolerances-text")

    def show_changes(self, found: Report | None, whole: bool = True) -> None:
        """Write which change of the design widens the usable speeds; None or a part while it is computed."""
        self.messages.set_values({"changes": found is None or not whole})
        if found is not None:
            text = changes_text(found, self.opened.drawing)
            self._write("changes-text", "features/changes/changes", text=text)

    def clear_changes(self) -> None:
        """Remove what changes of the design do."""
        self.messages.set_values({"changes": False})
        self._write("changes-text")

    def show_knock(self, found: KnockedMotion | None) -> None:
        """Draw what a knock does to the motion at the point, and write it; None while it is computed."""
        self.messages.set_values({"knock": found is None})
        if found is not None:
            if found.knock is not None:
                self.knock.show(found, self.units(self.view))
            self._write("knock-text", "features/knock/knock", text=knock_text(found), drawn=found.knock is not None)

    def clear_knock(self) -> None:
        """Remove what a knock does."""
        self.messages.set_values({"knock": False})
        self._write("knock-text")

    def show_busy(self, tasks: Sequence[str], compiling: bool) -> None:
        """Say what is being computed, and whether kernels are compiled for it first."""
        self._write("busy", "web/templates/busy", tasks=tasks, compiling=compiling)

    def show_message(self, message: str) -> None:
        """Show an error message; an empty one removes the last."""
        self._write("message", "web/templates/message", message=message)
