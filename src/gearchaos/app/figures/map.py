"""The map of motions: an image of classes or of levels, and the point with its crosshair."""

from __future__ import annotations

from typing import Any

import numpy as np
from bokeh.models import (
    BasicTicker,
    BoxZoomTool,
    ColorBar,
    ColumnDataSource,
    HSpan,
    Image,
    LinearColorMapper,
    Range1d,
    Scatter,
    VSpan,
)
from bokeh.palettes import Viridis256

from gearchaos.app.bounds import span
from gearchaos.app.figures.style import PALETTE, Put, bare, label, legend
from gearchaos.app.maps import Map
from gearchaos.axis import Axis
from gearchaos.plot._axes import cell_extent
from gearchaos.plot._classes import MOTION_CLASSES, NOT_COMPUTED, motion_class

_SATURATED = 1.0
"""Percent of the cells that may lie beyond the colours, so that a few peaks do not darken the rest."""


class MapFigure:
    """The map on the page; `figure` is the Bokeh model, `legend` what stands below it as HTML."""

    def __init__(self, put: Put) -> None:
        self._put = put
        self.figure = bare(ticks=6, tools="pan,wheel_zoom,reset,save", toolbar_location="right",
                           x_range=Range1d(0, 1), y_range=Range1d(0, 1))
        self.figure.add_tools(BoxZoomTool())
        self.figure.toolbar.active_drag = self.figure.toolbar.tools[0]
        self.figure.toolbar.active_scroll = self.figure.toolbar.tools[1]
        self.figure.grid.visible = False
        self.figure.background_fill_color = "#fafafa"
        self.image = ColumnDataSource({n: [] for n in ("image", "x", "y", "dw", "dh")})
        self.classes = LinearColorMapper(palette=PALETTE, low=-0.5, high=len(PALETTE) - 0.5, nan_color="#ffffff00")
        self.levels = LinearColorMapper(palette=Viridis256, nan_color="#bfbfbf")
        self.glyph = Image(image="image", x="x", y="y", dw="dw", dh="dh", color_mapper=self.classes)
        self.figure.add_glyph(self.image, self.glyph)
        self.bar = ColorBar(color_mapper=self.levels, visible=False, width=10, title_text_font_style="normal",
                            ticker=BasicTicker(desired_num_ticks=6))
        self.figure.add_layout(self.bar, "right")
        self.legend = ""
        self._point()

    def _point(self) -> None:
        self.point = ColumnDataSource({"x": [0.0], "y": [0.0]})
        cross = {"line_color": "black", "line_alpha": 0.55, "line_dash": "dotted"}
        ring = {"x": "x", "y": "y", "size": 13, "marker": "circle", "fill_color": None}
        for glyph in (
            VSpan(x="x", **cross), HSpan(y="y", **cross), Scatter(**ring, line_color="white", line_width=4),
            Scatter(**ring, line_color="black", line_width=2),
        ):
            self.figure.add_glyph(self.point, glyph, level="overlay")  # so that the map is not drawn again with it

    def place(self, x: Axis, y: Axis, words: tuple[str, str]) -> None:
        """Show this part of the plane; the old picture stays until there is a new one."""
        for axis, range_, shown in zip((x, y), (self.figure.x_range, self.figure.y_range), (0, 1), strict=True):
            range_.bounds = (span(axis.name).least, span(axis.name).most)
            range_.update(start=axis.start, end=axis.stop, reset_start=axis.start, reset_end=axis.stop)
            self._put((self.figure.xaxis, self.figure.yaxis)[shown][0], axis_label=words[shown])

    def mark(self, at: tuple[float, float]) -> None:
        """Put the crosshair at the point."""
        self._put(self.point, data={"x": [at[0]], "y": [at[1]]})

    def show(self, found: Map, colour: str) -> None:
        """Draw a map."""
        if colour == "motion":
            self._show_classes(found)
        else:
            self._show_level(found, colour)

    def _show_classes(self, found: Map) -> None:
        classes = motion_class(found.labels(), found.dataset["period"]).ravel()[found.source]
        present = [MOTION_CLASSES[i] for i in np.unique(classes) if i != NOT_COMPUTED]
        self.legend = legend([(c.colour, c.name) for c in present])
        self._colour(self.classes)
        self._draw(found, classes.astype(np.uint8))

    def _show_level(self, found: Map, name: str) -> None:
        values = found.values(name).astype(np.float32)
        known = values[np.isfinite(values)]
        low, high = (float(known.min()), float(np.percentile(known, 100 - _SATURATED))) if known.size else (0.0, 1.0)
        self._put(self.levels, low=low, high=max(high, low + 1e-9))
        self._put(self.bar, title=label(found.dataset[name], name))
        self.legend = ""
        self._colour(self.levels)
        self._draw(found, values)

    def _colour(self, mapper: LinearColorMapper) -> None:
        self.bar.visible, self.glyph.color_mapper = mapper is self.levels, mapper

    def _draw(self, found: Map, image: np.ndarray) -> None:
        vertical, horizontal = found.dataset["label"].dims
        left, right, bottom, top = cell_extent(found.dataset[horizontal].values, found.dataset[vertical].values)
        place: dict[str, Any] = {"x": [left], "y": [bottom], "dw": [right - left], "dh": [top - bottom]}
        self._put(self.image, data={"image": [image], **place})
