"""The bifurcation diagram along the line through the point."""

from __future__ import annotations

import numpy as np
import xarray as xr
from bokeh.models import ColumnDataSource, Image, LinearColorMapper, Range1d, Span
from matplotlib.colors import to_hex

from gearchaos.explorer.panels.branch import BranchLines
from gearchaos.explorer.panels.style import PALETTE, SetAttributes, empty_figure
from gearchaos.explorer.panels.units import Units
from gearchaos.plot._axes import cell_extent
from gearchaos.plot._bifurcation import DENSITY_COLOURS, DENSITY_EXPONENT, density
from gearchaos.plot._classes import motion_class

_ROWS = 240
"""Rows of the image."""

_RIBBON = 0.05
"""Height of the strip with the kinds of motion, relative to the range of displacements."""


class BifurcationFigure:
    """Density of stroboscopic displacements against one parameter, and a strip above it with the kinds of motion."""

    def __init__(self, set_attributes: SetAttributes) -> None:
        self._set = set_attributes
        self.figure = empty_figure(ticks=6, x_range=Range1d(0, 1), y_range=Range1d(0, 1))
        self.figure.grid.visible = False
        ink = LinearColorMapper(palette=[to_hex(DENSITY_COLOURS(i / 255)) for i in range(256)], low=0, high=1)
        classes = LinearColorMapper(palette=PALETTE, low=-0.5, high=len(PALETTE) - 0.5)
        self.ink, self.ribbon = (ColumnDataSource({n: [] for n in ("image", "x", "y", "dw", "dh")}) for _ in range(2))
        for source, mapper in ((self.ink, ink), (self.ribbon, classes)):
            self.figure.add_glyph(source, Image(image="image", x="x", y="y", dw="dw", dh="dh", color_mapper=mapper))
        self.branch = BranchLines(self.figure, set_attributes)
        self._diagram: xr.Dataset | None = None
        self._branch: xr.Dataset | None = None
        self._units = Units()
        self.marker = Span(dimension="height", location=0.0, line_color="#c03a1e", line_width=1.5, line_alpha=0.8)
        self.figure.add_layout(self.marker)

    def mark(self, at: float) -> None:
        """Draw a vertical line at the point."""
        self._set(self.marker, location=at)

    def show(self, found: xr.Dataset, units: Units) -> None:
        """Draw a diagram, which is in these units."""
        self._diagram, self._units = found, units
        self._draw()

    def show_branch(self, found: xr.Dataset, units: Units) -> None:
        """Draw a branch, which is in these units, over the diagram."""
        self._branch = found
        self.branch.show(found, units)
        self._draw()

    def clear_branch(self) -> None:
        """Remove the branch."""
        if self._branch is not None:
            self._branch = None
            self.branch.clear()
            self._draw()

    def _draw(self) -> None:
        """Draw the diagram, if there is one, with a vertical axis on which the branch has room too."""
        if self._diagram is None:
            return
        found, units, name = self._diagram, self._units, "section_z"
        axis = str(found[name].dims[0])
        values = found[name].transpose(..., "point").values
        low, high = _limits(values, self._branch)
        shades = density(values, low, high, _ROWS).T ** DENSITY_EXPONENT
        left, right, _, _ = cell_extent(found[axis].values, np.arange(2.0))
        top = high + _RIBBON * (high - low)
        place = {"x": [left], "dw": [right - left]}
        self._set(self.ink, data={"image": [shades.astype(np.float32)], "y": [low], "dh": [high - low], **place})
        strip = motion_class(found["label"], found["period"])[None].astype(np.uint8)
        self._set(self.ribbon, data={"image": [strip], "y": [high], "dh": [top - high], **place})
        self._set(self.figure.x_range, start=float(found[axis][0]), end=float(found[axis][-1]))
        self._set(self.figure.y_range, start=low, end=top)
        self._set(self.figure.xaxis[0], axis_label=units.parameter(axis))
        self._set(self.figure.yaxis[0], axis_label=units.label(found[name], "z"))


def _limits(values: np.ndarray, branch: xr.Dataset | None) -> tuple[float, float]:
    """Limits of the vertical axis, with a margin.

    A branch widens the range of the diagram at most threefold, since unstable orbits may be very large.
    """
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    if branch is not None:
        z, height = branch["section_z"].values, max(high - low, 1e-6)
        low, high = max(min(low, float(z.min())), low - height), min(max(high, float(z.max())), high + height)
    margin = 0.03 * (high - low) or 0.5
    return low - margin, high + margin
