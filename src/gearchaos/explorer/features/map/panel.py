"""The two planes: the map with its bifurcation curves and the point, and the basins of attraction at the point."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from bokeh.models import (
    BasicTicker,
    BoxZoomTool,
    ColorBar,
    ColumnDataSource,
    CustomJSHover,
    HoverTool,
    LinearColorMapper,
    MultiLine,
    Range1d,
    Scatter,
)
from bokeh.palettes import Viridis256

from gearchaos.continuation.events import KINDS
from gearchaos.explorer.core.models import limits
from gearchaos.explorer.core.state import View
from gearchaos.explorer.core.style import (
    NO_IMAGE,
    NONE,
    Legend,
    Panel,
    SetAttributes,
    Units,
    image_data,
    label,
    symbol,
    unit,
)
from gearchaos.explorer.features.assessment.panel import AssessedLine
from gearchaos.explorer.features.map.job import Map
from gearchaos.explorer.features.motion.orbits import EventCurve, Skeleton
from gearchaos.plot.axes import cell_extent
from gearchaos.plot.classes import MOTION_CLASSES, NO_CLASS, MotionClass, motion_class, named_classes
from gearchaos.plot.maps import colour_limits
from gearchaos.plot.states import UNDECIDED, attractor_colours, attractor_names
from gearchaos.plot.theme import event_words

_CURVE_WIDTH = 2.0  # width of the curves of orbits of period 1, in pixels; it decreases with the period


class SkeletonCurves:
    """Curves over a map: solid with a white outline, which shows them on every colour; those of grazes are dotted."""

    def __init__(self, figure: Any, set_attributes: SetAttributes) -> None:
        self._set = set_attributes
        self.solid, self.dotted = (ColumnDataSource(self._data(())) for _ in range(2))
        place = {"xs": "xs", "ys": "ys", "line_join": "round"}
        for source, dash in ((self.dotted, [2, 3]), (self.solid, [])):
            outline = MultiLine(**place, line_color="white", line_width="outline", line_alpha=0.7)
            line = MultiLine(**place, line_color="colour", line_width="width", line_dash=dash)
            for glyph in (outline, line):
                figure.add_glyph(source, glyph, level="overlay")  # can be redrawn without redrawing the map

    def show(self, curves: Sequence[EventCurve]) -> None:
        """Draw these curves instead of those before."""
        for source, dotted in ((self.solid, False), (self.dotted, True)):
            self._set(source, data=self._data([c for c in curves if (not KINDS[c.kind].changes) == dotted]))

    @staticmethod
    def _data(curves: Sequence[EventCurve]) -> dict[str, list[Any]]:
        widths = [max(1.0, _CURVE_WIDTH / c.period**0.5) for c in curves]
        return {
            "xs": [c.x.tolist() for c in curves], "ys": [c.y.tolist() for c in curves],
            "colour": [KINDS[c.kind].colour for c in curves], "width": widths,
            "outline": [w + 1.6 for w in widths],
        }


class SkeletonText(NamedTuple):
    """What stands beside the button for bifurcation curves."""

    legend: list[tuple[str, bool, str]]  # colour, whether dotted, and words of the kinds that occur
    curves: int
    status: str
    complete: bool  # whether all lines have been searched


def skeleton_text(found: Skeleton | None) -> SkeletonText:
    """The legend of curves and how far the search is; None stands for a search that waits for the map."""
    if found is None:
        return SkeletonText([], 0, "follow when the map is complete …", False)
    kinds = {c.kind for c in found.curves}
    legend = [(kind.colour, not kind.changes, event_words(name)) for name, kind in KINDS.items() if name in kinds]
    count, complete = len(found.curves), found.searched == found.lines
    words = f"{count or 'no'} curve{'' if count == 1 else 's'}"
    status = f"{words} of orbits up to {found.period}T" if complete else (
        f"{words} so far: line {found.searched + 1} of {found.lines} …")
    if found.failed:
        status += f"; {found.failed} could not be followed"
    return SkeletonText(legend, count, status, complete)


_SATURATED = 1.0
"""Percentage of the cells whose values lie above the colour scale: otherwise a few peaks would determine the scale."""

_NO_VALUE = "#bfbfbf"  # colour of cells whose motion does not have the response measure, or that are not computed yet


def _scale_of(classes: Sequence[MotionClass]) -> dict[str, Any]:
    """Attributes of the colour mapper for classes. Its tags are read by `_HOVER`: names of classes, unit of values.

    The figure changes the attributes of one mapper, since Bokeh ignores the palette of a mapper that replaces another.
    """
    return {"palette": [c.colour for c in classes], "low": -0.5, "high": len(classes) - 0.5, "high_color": "#ffffff00",
            "tags": [[c.name for c in classes], ""]}


_FORMATS, _USUAL, _PARTS = {"speed": "0.0", "torque": "0.00"}, "0.0000", "0.000e+0"
"""Formats of the numbers beside the pointer: of some parameters, of others, and of those of the parts of a train."""

_HOVER = """
const [names, unit] = mapper.tags
if (names.length > 0) return names[value] ?? "not computed"
return isNaN(value) ? "none" : `${Number(value.toPrecision(4))} ${unit}`
"""


def _crosshair(x: float, y: float) -> dict[str, list[Any]]:
    """The data of a crosshair with a ring, above the map: one glyph, since each takes the browser a millisecond."""
    longest = 10_000  # pixels, so that the lines cross every figure
    return {"x": [x, x, x], "y": [y, y, y], "marker": ["cross", "circle", "circle"], "size": [longest, 13, 13],
            "line_color": ["black", "white", "black"], "line_width": [1, 4, 2], "line_alpha": [0.55, 1.0, 1.0],
            "line_dash": ["dotted", "solid", "solid"]}


class MapFigure(Panel):
    """The map: an image of kinds of motion or of response measures, bifurcation curves, an assessment along the speed,
    a crosshair at the point.

    ``legend`` is that of the map drawn last.
    """

    def __init__(self, set_attributes: SetAttributes) -> None:
        super().__init__(set_attributes, ticks=6, tools="pan,wheel_zoom,reset,save", toolbar_location="above",
                         x_range=Range1d(0, 1), y_range=Range1d(0, 1))
        self.figure.add_tools(BoxZoomTool())
        self.figure.toolbar.active_drag = self.figure.toolbar.tools[0]
        self.figure.toolbar.active_scroll = self.figure.toolbar.tools[1]
        self.figure.background_fill_color = "#fafafa"
        self.mapper = LinearColorMapper(nan_color=_NO_VALUE, **_scale_of(MOTION_CLASSES))
        self.bar = ColorBar(color_mapper=self.mapper, visible=False, width=10, ticker=BasicTicker(desired_num_ticks=6))
        self.figure.add_layout(self.bar, "right")
        self.legend = Legend()
        self.image, drawn = self._image(self.mapper)
        text = CustomJSHover(args={"mapper": self.mapper}, code=_HOVER)
        self.hover = HoverTool(renderers=[drawn], formatters={"@image": text}, visible=False)
        self.figure.add_tools(self.hover)
        self.skeleton = SkeletonCurves(self.figure, set_attributes)
        self.assessed = AssessedLine(self.figure, set_attributes)
        self.point = ColumnDataSource(_crosshair(0.0, 0.0))
        look = {name: name for name in ("marker", "size", "line_color", "line_width", "line_alpha", "line_dash")}
        self.figure.add_glyph(self.point, Scatter(x="x", y="y", fill_color=None, **look), level="overlay")
        self.runner = ColumnDataSource({"x": [], "y": []})  # where a run-up is, set by the page's script
        self.figure.add_glyph(self.runner, Scatter(x="x", y="y", size=14, fill_color="#c03a1e", line_color="white",
                                                   line_width=2), level="overlay")

    def set_plane(self, view: View, units: Units) -> None:
        """Show the part of the plane in view; the old image stays until there is a new one."""
        for axis, shown in ((view.x, self.figure.x_range), (view.y, self.figure.y_range)):
            shown.bounds = limits(view.model, axis.name)
            shown.update(start=axis.start, end=axis.stop, reset_start=axis.start, reset_end=axis.stop)
        self._label(units.parameter(view.x.name), units.parameter(view.y.name))

    def mark(self, at: tuple[float, float]) -> None:
        """Move the crosshair to the point."""
        self._set(self.point, data=_crosshair(*at))

    def show(self, found: Map, colour: str, units: Units) -> None:
        """Draw a map coloured by a variable in these units."""
        if colour in ("motion", "contact", "to_avoid"):
            classes: Sequence[MotionClass] = MOTION_CLASSES
            if colour == "motion":
                index = found.shown(motion_class(found.labels(), found.dataset["period"]), NO_CLASS)
            else:
                kinds, classes = named_classes(found.dataset, colour) or (np.zeros(0), ())
                index = np.where(found.measure_source >= 0, kinds.ravel()[found.measure_source], NO_CLASS)
            present = [shown for i, shown in enumerate(classes) if (index == i).any()]
            self.legend = Legend(entries=tuple((c.colour, c.name) for c in present))
            self._set(self.mapper, **_scale_of(classes))
            self._set(self.bar, visible=False)
            self._draw(found, index.astype(np.uint8), colour, units)
            return
        measure = found.measure(colour, units.gears is not None)
        values, whole = measure.values.astype(np.float32), found.dataset[colour].dtype.kind in "iu"
        known = values[np.isfinite(values)]
        words, symbols = label(measure, colour).partition(" [")[0], unit(measure)
        mark = symbols or (NONE if units.marked else "")
        missing = ((_NO_VALUE, "none" if found.share == 1 else "none yet"),) if known.size < values.size else ()
        self.legend = Legend(f"{words} [{mark}]" if mark else words, missing)
        tags = [[], symbols or (mark and f"[{mark}]")]
        if whole:  # one colour per number
            least, most = (int(known.min()), int(known.max())) if known.size else (0, 1)
            shades = np.linspace(0, len(Viridis256) - 1, most - least + 1).round().astype(int)
            palette, low, high = [Viridis256[i] for i in shades], least - 0.5, most + 0.5
        else:
            palette, (low, high) = list(Viridis256), colour_limits(colour, known, _SATURATED, 1.0)
        self._set(self.mapper, tags=tags, palette=palette, low=low, high=high, high_color=None)
        self._set(self.bar.ticker, min_interval=float(whole))
        self._set(self.bar, visible=True)
        self._draw(found, values, words, units)

    def _draw(self, found: Map, image: np.ndarray, words: str, units: Units) -> None:
        vertical, horizontal = map(str, found.dataset["label"].dims)
        extent = cell_extent(found.dataset[horizontal].values, found.dataset[vertical].values)
        self._set(self.image, data=image_data(image, *extent))
        at = (
            (symbol(name), f"${way}{{{_FORMATS.get(name, _PARTS if '.' in name else _USUAL)}}}{units.after(name)}")
            for way, name in (("x", horizontal), ("y", vertical))
        )
        self._set(self.hover, tooltips=[(words, "@image{custom}"), *at])


class Choice(NamedTuple):
    """One of the motions of a point."""

    name: str
    colour: str
    share: float  # of the initial states that lead to it
    initial: tuple[tuple[str, float], ...]  # initial values that lead to it


def choices(found: xr.Dataset) -> list[Choice]:
    """The motions of a Dataset from `gearchaos.explorer.features.motion.point.attractors`."""
    prefix = "attractor_start_"
    variables = [n for n in map(str, found.data_vars) if n.startswith(prefix)]
    return [
        Choice(name, colour, float(found["attractor_fraction"][i]),
               tuple((n.removeprefix(prefix), float(found[n][i])) for n in variables))
        for i, (name, colour) in enumerate(zip(attractor_names(found), attractor_colours(found), strict=True))
    ]


class BasinsFigure(Panel):
    """A plane of initial values, coloured by the motion that each leads to.

    ``axes`` are the names of the two initial values, empty before the first plane is drawn. ``scales`` are the units
    of both axes in dimensionless units: a value shown over its scale is dimensionless.
    """

    def __init__(self, set_attributes: SetAttributes) -> None:
        super().__init__(set_attributes, ticks=6, x_range=Range1d(0, 1), y_range=Range1d(0, 1))
        self.figure.update(visible=False)
        self.mapper = LinearColorMapper(palette=[UNDECIDED], low=-1.5, high=-0.5)
        self.source, _ = self._image(self.mapper)
        self.axes, self.scales = ("", ""), (1.0, 1.0)
        self.legend = Legend()

    def show(self, dimensionless: xr.Dataset, units: Units) -> None:
        """Draw a Dataset as from `gearchaos.basins` in these units."""
        found = units.scaled(dimensionless)
        vertical, horizontal = map(str, found["attractor"].dims)
        x, y = found[horizontal], found[vertical]
        colours = attractor_colours(found)
        self._set(self.mapper, palette=[UNDECIDED, *colours], low=-1.5, high=len(colours) - 0.5)
        image = found["attractor"].values.astype(np.float32)
        self._set(self.source, data=image_data(image, *cell_extent(x.values, y.values)))
        self._limit((float(x[0]), float(x[-1])), (float(y[0]), float(y[-1])))
        self._label(units.label(x, horizontal), units.label(y, vertical))
        self.axes, self.scales = (horizontal, vertical), (units.one(horizontal), units.one(vertical))
        self._set(self.figure, visible=True)
        shares = found["attractor_fraction"].values
        names = [f"{n} ({100 * s:.0f} %)" for n, s in zip(attractor_names(found), shares, strict=True)]
        self.legend = Legend(entries=tuple(zip(colours, names, strict=True)))

    def clear(self) -> None:
        """Hide the figure."""
        self.legend = Legend()
        self._set(self.source, data=NO_IMAGE)
        self._set(self.figure, visible=False)
