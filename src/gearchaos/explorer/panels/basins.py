"""The basins of attraction at a point, and the list of its motions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from bokeh.models import ColumnDataSource, Image, LinearColorMapper, Range1d

from gearchaos.explorer.panels.labels import Units
from gearchaos.explorer.panels.style import Legend, SetAttributes, empty_figure
from gearchaos.plot.axes import cell_extent
from gearchaos.plot.states import UNDECIDED, attractor_colours, attractor_names


@dataclass(frozen=True)
class Choice:
    """One of the motions of a point.

    Attributes
    ----------
    name, colour : str
    share : float
        Share of the initial states that lead to it.
    initial : tuple of (name, value)
        Initial values that lead to it.
    """

    name: str
    colour: str
    share: float
    initial: tuple[tuple[str, float], ...]


def choices(found: xr.Dataset) -> list[Choice]:
    """The motions of a Dataset from `gearchaos.explorer.jobs.point.attractors`."""
    prefix = "attractor_start_"
    variables = [n for n in map(str, found.data_vars) if n.startswith(prefix)]
    return [
        Choice(name, colour, float(found["attractor_fraction"][i]),
               tuple((n.removeprefix(prefix), float(found[n][i])) for n in variables))
        for i, (name, colour) in enumerate(zip(attractor_names(found), attractor_colours(found), strict=True))
    ]


_FIELDS = ("image", "x", "y", "dw", "dh")


class BasinsFigure:
    """A plane of initial values, coloured by the motion that each leads to.

    Attributes
    ----------
    axes : (str, str)
        Names of the two initial values; empty before the first plane is drawn.
    scales : (float, float)
        The units of both axes in dimensionless units: a value shown over its scale is dimensionless.
    legend : Legend
    """

    def __init__(self, set_attributes: SetAttributes) -> None:
        self._set = set_attributes
        self.figure = empty_figure(ticks=6, x_range=Range1d(0, 1), y_range=Range1d(0, 1))
        self.figure.update(visible=False)
        self.figure.grid.visible = False
        self.source = ColumnDataSource({n: [] for n in _FIELDS})
        self.mapper = LinearColorMapper(palette=[UNDECIDED], low=-1.5, high=-0.5)
        self.figure.add_glyph(
            self.source, Image(image="image", x="x", y="y", dw="dw", dh="dh", color_mapper=self.mapper))
        self.axes, self.scales = ("", ""), (1.0, 1.0)
        self.legend = Legend()

    def show(self, dimensionless: xr.Dataset, units: Units) -> None:
        """Draw a Dataset as from `gearchaos.basins` in these units."""
        found = units.scaled(dimensionless)
        vertical, horizontal = map(str, found["attractor"].dims)
        x, y = found[horizontal], found[vertical]
        left, right, bottom, top = cell_extent(x.values, y.values)
        colours = attractor_colours(found)
        self._set(self.mapper, palette=[UNDECIDED, *colours], low=-1.5, high=len(colours) - 0.5)
        self._set(self.source, data={
            "image": [found["attractor"].values.astype(np.float32)], "x": [left], "y": [bottom],
            "dw": [right - left], "dh": [top - bottom],
        })
        for end, axis, along, name in (
            (self.figure.x_range, self.figure.xaxis[0], x, horizontal),
            (self.figure.y_range, self.figure.yaxis[0], y, vertical),
        ):
            self._set(end, start=float(along[0]), end=float(along[-1]))
            self._set(axis, axis_label=units.label(along, name))
        self.axes, self.scales = (horizontal, vertical), (units.one(horizontal), units.one(vertical))
        self._set(self.figure, visible=True)
        shares = found["attractor_fraction"].values
        names = [f"{n} ({100 * s:.0f} %)" for n, s in zip(attractor_names(found), shares, strict=True)]
        self.legend = Legend(entries=tuple(zip(colours, names, strict=True)))

    def clear(self) -> None:
        """Hide the figure."""
        self.legend = Legend()
        self._set(self.source, data={n: [] for n in _FIELDS})
        self._set(self.figure, visible=False)
