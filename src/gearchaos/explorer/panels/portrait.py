"""The stroboscopic portrait: the state once per mesh period."""

from __future__ import annotations

import numpy as np
import xarray as xr
from bokeh.models import ColumnDataSource, DataRange1d, Scatter

from gearchaos.datasets import variable
from gearchaos.explorer.jobs.point_motion import PointMotion
from gearchaos.explorer.panels.style import FIRST_DATA, INK, SetAttributes, empty_figure
from gearchaos.explorer.panels.units import Units

_FEW = 64
"""Up to this number of points, markers are large."""

_PADDING = 0.3
"""Room around the points, relative to the range of their values, so that few of them do not lie in the corners."""


class PortraitFigure:
    """Stroboscopic points in the plane of displacement and velocity."""

    def __init__(self, set_attributes: SetAttributes) -> None:
        self._set = set_attributes
        ranges = {"x_range": DataRange1d(range_padding=_PADDING), "y_range": DataRange1d(range_padding=_PADDING)}
        self.figure = empty_figure("Stroboscopic portrait", **ranges)
        self.source = ColumnDataSource(FIRST_DATA)
        self.glyph = Scatter(x="x", y="y", size=0, fill_color=INK, line_color=None)
        self.figure.add_glyph(self.source, self.glyph)

    def show(self, found: PointMotion, units: Units) -> None:
        """Draw the points of a motion in these units."""
        x, y = _section(found, units)
        self._set(self.glyph, size=6 if len(x) <= _FEW else 2)
        self._set(self.source, data={"x": x.values, "y": y.values})
        self._set(self.figure.xaxis[0], axis_label=units.label(x, "z"))
        self._set(self.figure.yaxis[0], axis_label=units.label(y, "z_dot"))

    def clear(self) -> None:
        """Draw nothing."""
        self._set(self.glyph, size=0)
        self._set(self.source, data=FIRST_DATA)


def _section(found: PointMotion, units: Units) -> tuple[xr.Variable, xr.Variable]:
    """Displacement and velocity (N,) of the stroboscopic points; those of the portrait if there is one."""
    names = ("section_z", "section_z_dot")
    section = found.verdict.section if found.portrait is None else {
        n: found.portrait[f"section_{n}"].values for n in ("z", "z_dot")}
    points = {n: variable(n, ("period",), np.asarray(section[n.removeprefix("section_")])) for n in names}
    scaled = units.variables(points)
    return scaled[names[0]], scaled[names[1]]
