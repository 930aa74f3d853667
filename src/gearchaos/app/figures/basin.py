"""The basin plane of a point: which start leads to which of its motions."""

from __future__ import annotations

import numpy as np
import xarray as xr
from bokeh.models import ColumnDataSource, LinearColorMapper, Range1d

from gearchaos.app.figures.style import bare, label, legend
from gearchaos.plot._axes import cell_extent
from gearchaos.plot._basins import UNDECIDED, attractor_colours, attractor_names

_FIELDS = ("image", "x", "y", "dw", "dh")


class BasinFigure:
    """A plane of starts coloured by the motion each leads to; a click chooses a start."""

    def __init__(self) -> None:
        self.figure = bare(x_range=Range1d(0, 1), y_range=Range1d(0, 1), tools="", toolbar_location=None)
        self.figure.update(visible=False)
        self.figure.grid.visible = False
        self.source = ColumnDataSource({n: [] for n in _FIELDS})
        self.mapper = LinearColorMapper(palette=[UNDECIDED], low=-1.5, high=-0.5)
        self.figure.image(image="image", x="x", y="y", dw="dw", dh="dh", source=self.source, color_mapper=self.mapper)
        self.axes = ("", "")
        self.legend = ""

    def show(self, found: xr.Dataset) -> None:
        """Draw a plane of basins."""
        vertical, horizontal = map(str, found["attractor"].dims)
        x, y = found[horizontal], found[vertical]
        left, right, bottom, top = cell_extent(x.values, y.values)
        colours = attractor_colours(found)
        self.mapper.update(palette=[UNDECIDED, *colours], low=-1.5, high=len(colours) - 0.5)
        self.source.data = {
            "image": [found["attractor"].values.astype(np.float32)], "x": [left], "y": [bottom],
            "dw": [right - left], "dh": [top - bottom],
        }
        self.figure.x_range.update(start=float(x[0]), end=float(x[-1]))
        self.figure.y_range.update(start=float(y[0]), end=float(y[-1]))
        self.figure.xaxis.axis_label, self.figure.yaxis.axis_label = label(x, horizontal), label(y, vertical)
        self.axes, self.figure.visible = (horizontal, vertical), True
        shares = found["attractor_fraction"].values
        names = [f"{n} ({100 * s:.0f} %)" for n, s in zip(attractor_names(found), shares, strict=True)]
        self.legend = legend(list(zip(colours, names, strict=True)))

    def clear(self) -> None:
        """Show nothing."""
        self.source.data, self.legend = {n: [] for n in _FIELDS}, ""
        self.figure.visible = False
