"""The phase trajectory, with the ends of the backlash."""

from __future__ import annotations

import numpy as np
import xarray as xr
from bokeh.models import ColumnDataSource, DataRange1d, Line, Scatter, Span

from gearchaos.explorer.panels.style import BOUNDARY, FIRST_DATA, INK, STROBE, SetAttributes, empty_figure
from gearchaos.explorer.panels.units import Units

_SAMPLES = 3072
"""Largest number of samples of the trajectory drawn."""

_POINTS = 96
"""Largest number of stroboscopic points drawn."""


class PhaseFigure:
    """Velocity against displacement, the ends of the backlash and the stroboscopic points."""

    def __init__(self, set_attributes: SetAttributes) -> None:
        self._set = set_attributes
        ranges = {"x_range": DataRange1d(), "y_range": DataRange1d()}
        self.figure = empty_figure("Phase (dashed: backlash)", **ranges)
        self.line = ColumnDataSource(FIRST_DATA)
        self.points = ColumnDataSource({"x": [], "y": []})
        self.ends = [Span(dimension="height", location=z, line_color=BOUNDARY, line_dash="dashed") for z in (-1, 1)]
        drawn = self.figure.add_glyph(self.line, Line(x="x", y="y", line_color=INK, line_width=1))
        dots = self.figure.add_glyph(
            self.points, Scatter(x="x", y="y", size=5, fill_color=STROBE, line_color=None))
        self.figure.x_range.renderers = self.figure.y_range.renderers = [drawn, dots]
        for end in self.ends:
            self.figure.add_layout(end)

    def show(self, motion: xr.Dataset, units: Units) -> None:
        """Draw a motion, which is in these units."""
        values = (motion["z"].values, motion["z_dot"].values)
        self._set(self.line, data={n: v[:_SAMPLES].astype(np.float32) for n, v in zip("xy", values, strict=True)})
        sections = (motion[f"section_{n}"].values[:_POINTS] for n in ("z", "z_dot"))
        self._set(self.points, data=dict(zip("xy", map(np.asarray, sections), strict=True)))
        for sign, end in zip((-1, 1), self.ends, strict=True):
            self._set(end, location=sign * units.one("z"))
        self._set(self.figure.xaxis[0], axis_label=units.label(motion["z"], "z"))
        self._set(self.figure.yaxis[0], axis_label=units.label(motion["z_dot"], "z_dot"))

    def clear(self) -> None:
        """Draw nothing."""
        self._set(self.line, data=FIRST_DATA)
        self._set(self.points, data={"x": [], "y": []})
