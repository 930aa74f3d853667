"""The page: its figures, its form and its texts, and how results are shown on them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import xarray as xr

from gearchaos.explorer.jobs.map import Map
from gearchaos.explorer.jobs.orbits import Skeleton
from gearchaos.explorer.jobs.point import PointMotion
from gearchaos.explorer.panels.basins import BasinsFigure, Choice, choices
from gearchaos.explorer.panels.diagram import BifurcationFigure, branch_text
from gearchaos.explorer.panels.labels import Units
from gearchaos.explorer.panels.map import MapFigure, skeleton_text
from gearchaos.explorer.panels.motion import (
    ForceFigure,
    HistoryFigure,
    PhaseFigure,
    PortraitFigure,
    SpectrumFigure,
    times,
)
from gearchaos.explorer.panels.verdict import HINTS, verdict_text
from gearchaos.explorer.view.address import to_query
from gearchaos.explorer.view.models import are_alike, equal
from gearchaos.explorer.view.presets import preset_of
from gearchaos.explorer.view.state import View, stiffness_name
from gearchaos.explorer.view.study_text import as_python, as_toml
from gearchaos.explorer.web.form import GEARS, field_values, line_menu, parameter_form, plane_menus
from gearchaos.explorer.web.messages import Messages, render
from gearchaos.model import PARAMETER_PAIRS

_NUMBER = ".8g"
"""Format of a number in a field, which is short enough to be visible as a whole; the address has all digits."""


class Page:
    """One page; the `Display` of its computations.

    Parameters
    ----------
    start : View
        What the server shows first; its gears are those of the page.
    view : View
        What the page shows first.

    Attributes
    ----------
    view, basins_view : View
        The present view, in whose units results are shown; the view whose basins are shown.
    messages : Messages
    merge_wheels : bool
        Whether the form has common fields for both wheels where they are alike.
    preset : str
        Key of the preset that the view shows, or "".
    map, diagram, basins, history, phase, portrait, spectrum, force
        The figures; that of the mesh force is None without gears.
    choices : list of Choice
        The motions that the page offers as buttons.
    """

    def __init__(self, start: View, view: View) -> None:
        self.view = self.basins_view = view
        self._start, self._has_gears = start, start.gears is not None
        self.merge_wheels, self.preset = True, ""
        self._layout: tuple[Any, ...] = ()
        self.messages = Messages()
        self.save_file = self.messages.save_file
        set_attributes = self.messages.set_attributes
        self.map = MapFigure(set_attributes)
        self.diagram = BifurcationFigure(set_attributes)
        self.basins = BasinsFigure(set_attributes)
        self.history = HistoryFigure(set_attributes)
        self.phase = PhaseFigure(set_attributes)
        self.portrait = PortraitFigure(set_attributes)
        self.spectrum = SpectrumFigure(set_attributes)
        self.force = ForceFigure(set_attributes) if self._has_gears else None
        self._write_choices([])
        self._plane: tuple[Any, ...] = ()
        self._trajectory_key: tuple[Any, ...] | None = None
        self._portrait_key: tuple[Any, ...] | None = None

    def roots(self) -> dict[str, Any]:
        """The figures by their names in the template."""
        return {
            "map": self.map.figure, "history": self.history.figure, "phase": self.phase.figure,
            "portrait": self.portrait.figure, "spectrum": self.spectrum.figure, "line": self.diagram.figure,
            "basin": self.basins.figure, **({} if self.force is None else {"force": self.force.figure}),
        }

    def units(self, view: View) -> Units:
        """The units in which a view shows results."""
        return Units(view.gears if view.physical else None, self._has_gears)

    def show_view(self, view: View) -> None:
        """Show the form, the axes of the map, the point, and the address of a view."""
        self.show_form(view)
        self.map.mark(view.at)
        self.diagram.mark(view.at["xy".index(view.line)])
        if self._plane != (view.x, view.y):
            self._plane = (view.x, view.y)
            self.map.set_plane(view, self.units(view))
        self.messages.set_page_state(to_query(view), as_python(view), as_toml(view))

    def show_form(self, view: View) -> None:
        """Show the values of a view in the form, which is replaced only if it has other fields."""
        point = view.operating_point
        self.preset, alike = preset_of(view, self.preset), self.merge_wheels and are_alike(point)
        merged = {pair for pair in PARAMETER_PAIRS if alike and equal(point, pair)}
        values, units = field_values(view), self.units(view)
        layout = view.model.kind, tuple(values), view.x.name, view.y.name, merged, view.physical and self._has_gears
        if layout != self._layout:
            self._layout = layout
            form = parameter_form(view, merged, self._start)
            self.messages.write("parameters", render("parameters.html.j2", form=form))
            self.messages.write("axes", render("menus.html.j2", menus=plane_menus(view, units)))
            self.messages.write("line-choose", render("menus.html.j2", menus=[line_menu()]))
        self.messages.set_values({
            **{name: f"{value:{_NUMBER}}" for name, value in values.items()},
            "preset": self.preset if view.gears is None else GEARS, "kind": view.model.kind,
            "stiffness": stiffness_name(view.model), "x": view.x.name,
            "y": view.y.name, "colour": view.colour, "line": view.line, "alike": alike, "units": view.physical,
        })

    def show_map(self, found: Map) -> None:
        """Draw the map and its legend."""
        self.map.show(found, self.view.colour, self.units(self.view))
        self.messages.write(
            "legend", render("legend.html.j2", legend=self.map.legend, map=found, colour=self.view.colour))

    def show_point_motion(self, found: PointMotion) -> None:
        """Draw the motion of a point and write its verdict."""
        view, units = self.view, self.units(self.view)
        key = found.model, found.verdict.periods_spent, found.portrait is None, units
        if found.verdict.section and key != self._portrait_key:
            self._portrait_key = key
            self.portrait.show(found, units)
        if found.trajectory is not None:
            self._show_trajectory(found.trajectory, units, view)
        elif not found.verdict.section:  # it diverged
            for figure in (self.history, self.phase, self.portrait, self.spectrum, self.force):
                if figure is not None:
                    figure.clear()
            self._trajectory_key = self._portrait_key = None
        self.messages.write("verdict", render("verdict.html.j2", v=verdict_text(found, view, units), hints=HINTS))

    def _show_trajectory(self, trajectory: xr.Dataset, units: Units, view: View) -> None:
        """Draw the motion in time, unless it is drawn already."""
        key = float(trajectory["z"].values[0]), trajectory.sizes["tau"], units
        if key == self._trajectory_key:
            return
        self._trajectory_key = key
        tau, period = times(trajectory)
        shown = units.scaled(trajectory)
        self.spectrum.show(trajectory, shown["z_dot"], units)
        self.history.show(shown, tau, period, units)
        self.phase.show(shown, units)
        if self.force is not None and view.gears is not None:
            self.force.show(shown, tau, period, units, view.gears)
        elif self.force is not None:
            self.force.clear()

    def show_diagram(self, found: xr.Dataset) -> None:
        """Draw the bifurcation diagram."""
        self.diagram.show(found, self.units(self.view))

    def show_branch(self, found: xr.Dataset) -> None:
        """Draw the branch of a motion over the diagram, and describe it below."""
        units = self.units(self.view)
        self.diagram.show_branch(found, units)
        self.messages.write("branch", render("branch.html.j2", branch=branch_text(found, units)))

    def clear_branch(self) -> None:
        """Remove the branch."""
        self.diagram.clear_branch()
        self.messages.write("branch", "")

    def show_skeleton(self, found: Skeleton | None) -> None:
        """Draw bifurcation curves over the map, and their legend; None if they wait for the map."""
        if found is not None:
            self.map.skeleton.show(found.curves)
        self.messages.write("skeleton-legend", render("skeleton.html.j2", text=skeleton_text(found)))
        self.messages.set_values({"skeleton": True})

    def clear_skeleton(self) -> None:
        """Remove the bifurcation curves."""
        self.map.skeleton.show(())
        self.messages.write("skeleton-legend", "")
        self.messages.set_values({"skeleton": False})

    def show_basins(self, view: View, found: xr.Dataset) -> None:
        """Draw the basins of attraction of a view and their legend."""
        self.basins_view = view
        self.basins.show(found, self.units(view))
        self.messages.write("basin-legend", render("legend.html.j2", legend=self.basins.legend))

    def show_attractors(self, found: xr.Dataset) -> None:
        """Show a button for every motion of the point."""
        self._write_choices(choices(found))

    def clear_point_studies(self) -> None:
        """Hide the basins and the motions of the previous point."""
        self.basins.clear()
        self.messages.write("basin-legend", "")
        self._write_choices([])

    def _write_choices(self, found: list[Choice]) -> None:
        """Write the buttons of motions; an empty list stands for a search under way."""
        self.choices = found
        self.messages.write("others", render("attractors.html.j2", choices=found))

    def show_busy(self, tasks: Sequence[str], compiling: bool) -> None:
        """Say what is being computed, and whether kernels are compiled for it first."""
        self.messages.write("busy", render("busy.html.j2", tasks=tasks, compiling=compiling))

    def show_message(self, message: str) -> None:
        """Show an error message; an empty one removes the last."""
        self.messages.write("message", render("message.html.j2", message=message))
