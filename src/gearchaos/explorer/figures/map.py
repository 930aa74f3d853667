"""The map of motions: an image of classes or of levels, and the point with its crosshair."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from bokeh.models import (
    BasicTicker,
    BoxZoomTool,
    ColorBar,
    ColumnDataSource,
    CustomJSHover,
    HoverTool,
    HSpan,
    Image,
    LinearColorMapper,
    Range1d,
    Scatter,
    VSpan,
)
from bokeh.palettes import Viridis256

from gearchaos.explorer.bounds import span
from gearchaos.explorer.figures.style import PALETTE, Put, bare, label, legend, plain
from gearchaos.explorer.maps import Map
from gearchaos.explorer.units import in_units, unit_words
from gearchaos.gears.pair import GearPair
from gearchaos.plot._axes import cell_extent, symbol
from gearchaos.plot._classes import MOTION_CLASSES, NOT_COMPUTED, motion_class
from gearchaos.studies.axis import Axis

_SATURATED = 1.0
"""Percent of the cells that may lie beyond the colours, so that a few peaks do not darken the rest."""

_NONE = "#bfbfbf"
"""The colour of cells whose motion has no level, or that are not computed yet."""

_CLASSES: dict[str, Any] = {
    "palette": PALETTE, "low": -0.5, "high": len(PALETTE) - 0.5, "high_color": "#ffffff00",
    "tags": [[c.name for c in MOTION_CLASSES], ""],
}
"""What the one mapper of the picture takes on for classes; its tags are the names of its colours and the unit of its
values. An image goes on drawing with the palette of a mapper that is replaced: it notices only what changes in the one
that it began with."""

_HOVER = """
const [names, unit] = mapper.tags
if (names.length > 0) return names[value] ?? "not computed"
return isNaN(value) ? "none" : `${Number(value.toPrecision(4))} ${unit}`
"""


class MapFigure:
    """The map on the page; `figure` is the Bokeh model, `legend` what stands below it as HTML."""

    def __init__(self, put: Put) -> None:
        self._put = put
        self.figure = bare(ticks=6, tools="pan,wheel_zoom,reset,save", toolbar_location="above",
                           x_range=Range1d(0, 1), y_range=Range1d(0, 1))
        self.figure.add_tools(BoxZoomTool())
        self.figure.toolbar.active_drag = self.figure.toolbar.tools[0]
        self.figure.toolbar.active_scroll = self.figure.toolbar.tools[1]
        self.figure.grid.visible = False
        self.figure.background_fill_color = "#fafafa"
        self.image = ColumnDataSource({n: [] for n in ("image", "x", "y", "dw", "dh")})
        self.mapper = LinearColorMapper(nan_color=_NONE, **_CLASSES)
        self.bar = ColorBar(
            color_mapper=self.mapper, visible=False, width=10, ticker=BasicTicker(desired_num_ticks=6))
        self.figure.add_layout(self.bar, "right")
        self.legend = ""
        self._picture()
        self._point()

    def _picture(self) -> None:
        """The image, and what it says where the pointer is."""
        drawn = self.figure.add_glyph(
            self.image, Image(image="image", x="x", y="y", dw="dw", dh="dh", color_mapper=self.mapper))
        said = CustomJSHover(args={"mapper": self.mapper}, code=_HOVER)
        self.hover = HoverTool(renderers=[drawn], formatters={"@image": said}, visible=False)
        self.figure.add_tools(self.hover)

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

    def show(self, found: Map, colour: str, pair: GearPair | None) -> None:
        """Draw a map, its levels in the units of the pair if there is one."""
        if colour == "motion":
            self._show_classes(found)
        else:
            self._show_level(found, in_units({colour: found.level(colour)}, pair)[colour], colour)

    def _show_classes(self, found: Map) -> None:
        classes = found.shown(motion_class(found.labels(), found.dataset["period"]), NOT_COMPUTED)
        present = [MOTION_CLASSES[i] for i in np.unique(classes) if i != NOT_COMPUTED]
        self.legend = legend([(c.colour, c.name) for c in present])
        self._put(self.mapper, **_CLASSES)
        self._put(self.bar, visible=False)
        self._draw(found, classes.astype(np.uint8), "motion")

    def _show_level(self, found: Map, level: xr.Variable, name: str) -> None:
        values, whole = level.values.astype(np.float32), found.dataset[name].dtype.kind in "iu"
        known = values[np.isfinite(values)]
        words, unit = label(level, name).partition(" [")[0], unit_words(level)
        missing = [(_NONE, "none" if found.share == 1 else "none yet")] if known.size < values.size else []
        self.legend = legend(missing, f"{words} [{unit}]" if unit else words)
        self._put(self.mapper, tags=[[], unit], **_counted(known) if whole else _graded(known))
        self._put(self.bar.ticker, min_interval=float(whole))
        self._put(self.bar, visible=True)
        self._draw(found, values, words)

    def _draw(self, found: Map, image: np.ndarray, words: str) -> None:
        vertical, horizontal = map(str, found.dataset["label"].dims)
        left, right, bottom, top = cell_extent(found.dataset[horizontal].values, found.dataset[vertical].values)
        place: dict[str, Any] = {"x": [left], "y": [bottom], "dw": [right - left], "dh": [top - bottom]}
        self._put(self.image, data={"image": [image], **place})
        at = (plain(symbol(horizontal)), "$x{0.0000}"), (plain(symbol(vertical)), "$y{0.0000}")
        self._put(self.hover, tooltips=[(words, "@image{custom}"), *at])


def _graded(known: np.ndarray) -> dict[str, Any]:
    """Colours of a level, of its known values."""
    low, high = (float(known.min()), float(np.percentile(known, 100 - _SATURATED))) if known.size else (0.0, 1.0)
    return {"palette": list(Viridis256), "low": low, "high": max(high, low + 1e-9), "high_color": None}


def _counted(known: np.ndarray) -> dict[str, Any]:
    """Colours of a number, one for each that there is room for."""
    low, high = (int(known.min()), int(known.max())) if known.size else (0, 1)
    shades = np.linspace(0, len(Viridis256) - 1, high - low + 1).round().astype(int)
    palette = [Viridis256[i] for i in shades]
    return {"palette": palette, "low": low - 0.5, "high": high + 0.5, "high_color": None}
