"""Helpers that all pictures share: new Axes and panels, axis labels, axis limits, edges of cells."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib import rcParams
from matplotlib.axes import Axes
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from gearchaos.datasets import model_from_json
from gearchaos.errors import InputError
from gearchaos.gears.results import unit_in
from gearchaos.plot._theme import adapt_style, is_dark
from gearchaos.quantities import Quantity, find

_SCALES = {"1", "delta", "omega0", "c0", "T"}
"""Reference quantities of the dimensionless units, (2.8)-(2.11). A unit made of these alone is not shown on an axis."""

_CHARACTER_WIDTH = 0.078
"""Mean width of a character of an axis label in a font of 10 points, in inches."""

_FONT_SIZE = 10.0
"""Size of the font for which widths and distances are given, in points."""

_SHORTEST_LINE = 12
"""Smallest number of characters in a line of a wrapped label."""

_ROUNDING = 1e-9
"""Relative difference below which two values are treated as equal."""

_DEGENERATE_HALF_WIDTH = 0.05
"""Half width of an axis along which all values are equal, relative to their magnitude."""

_MARGIN = 0.03
"""Margin above and below the values that are shown, relative to their range."""

_SECOND_AXIS = 38
"""Distance of a second horizontal axis below the first one, in points, for a font of 10 points."""


def new_axes(ax: Axes | None) -> Axes:
    """``ax`` itself, or the Axes of a new pyplot figure."""
    if ax is not None:
        return ax
    import matplotlib.pyplot as plt

    return plt.subplots(layout="constrained")[1]


_OUTLINE = 2.0
"""Width of the outline of a legend handle, on both sides together, in points."""


class Overlay:
    """An Axes for curves in a plane: one of their own, or that of a map, whose limits and labels are kept."""

    def __init__(self, ax: Axes | None) -> None:
        self.over_map = ax is not None and bool(ax.images)
        self.ax = new_axes(ax)

    def style(self, style: Mapping[str, Any]) -> dict[str, Any]:
        """Properties of an artist as they are over a map, whose colours are the same in all styles; else adapted."""
        return dict(style) if self.over_map else adapt_style(style)

    def colour(self, colour: str) -> str:
        """A colour, as of `style`."""
        return str(self.style({"color": colour})["color"])

    def handle(self, label: str, style: Mapping[str, Any], outlined: bool = True) -> Line2D:
        """The legend handle of a line; one as over a map has a white outline on a dark background."""
        if not (self.over_map and outlined):
            style = adapt_style(style)
        elif is_dark():
            stroke = withStroke(linewidth=style.get("linewidth", 1.0) + _OUTLINE, foreground="white")
            style = {**style, "path_effects": [stroke]}
        return Line2D([], [], label=label, **style)

    def frame(self, parameters: Mapping[str, xr.DataArray], window: Sequence[Sequence[float]]) -> None:
        """Label the horizontal and the vertical axis, and limit them to a window; not over a map."""
        if self.over_map:
            return
        (x, y), (across, up) = parameters.items(), window
        self.ax.set(xlabel=axis_label(x[1], x[0]), ylabel=axis_label(y[1], y[0]), xlim=tuple(across), ylim=tuple(up))


def symbol(name: str) -> str:
    """The symbol of a variable or parameter in mathtext, or its name in words if it has none."""
    found = _quantity(name)
    return f"${found.tex}$" if found is not None and found.tex else name.replace("_", " ")


def axis_label(array: xr.DataArray | xr.Variable, name: str, beside: xr.DataArray | None = None) -> str:
    """Description, symbol and unit of a variable, e.g. ``frequency $\\omega$``.

    Dimensionless units are left out; but where the variable on the other axis, ``beside``, has a physical unit, "[–]"
    says that this one has none.
    """
    unit, found = str(array.attrs.get("units", "1")), _quantity(name)
    dimensional = _is_dimensional(array)
    words = (found and found.axis_name) or str(array.attrs.get("long_name", ""))
    tex = symbol(name)
    if found is not None and words == name:  # a parameter without a long name
        words = found.title
    if dimensional and found is not None and found.physical is not None and found.physical.tex:
        words, tex = found.physical.long_name or words, f"${found.physical.tex}$"
    text = f"{words} {tex}" if words and tex.startswith("$") and words != name else words or tex
    if dimensional:
        return f"{text} [{unit.replace('*', ' ')}]"
    return f"{text} [–]" if beside is not None and _is_dimensional(beside) else text


def _is_dimensional(array: xr.DataArray | xr.Variable) -> bool:
    """Whether a variable has a physical unit."""
    return not set(str(array.attrs.get("units", "1")).replace("/", "*").split("*")) <= _SCALES


def _quantity(name: str) -> Quantity | None:
    """The quantity with exactly this name; `find` also returns that of ``x1`` for ``section_x1``."""
    found = find(name)
    return found if found is not None and found.name == name else None


def wrapped(text: str, inches: float) -> str:
    """A label broken into lines of at most about ``inches``, for the current font size of labels."""
    characters = max(_SHORTEST_LINE, int(inches / (_CHARACTER_WIDTH * _font_scale())))
    if len(re.sub(r"\$[^$]*\$", "xxx", text)) <= characters:
        return text
    return textwrap.fill(text, characters, break_long_words=False, break_on_hyphens=False)


def _font_scale() -> float:
    """Size of the font of axis labels relative to `_FONT_SIZE`."""
    return float(FontProperties(size=rcParams["axes.labelsize"]).get_size_in_points()) / _FONT_SIZE


def cell_extent(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float, float]:
    """Outer edges (left, right, bottom, top) of cells with equidistant centres ``x`` (columns,) and ``y`` (rows,)."""
    return (*_edges(np.asarray(x, float)), *_edges(np.asarray(y, float)))


def _edges(centres: np.ndarray) -> tuple[float, float]:
    half = (centres[-1] - centres[0]) / (2 * (len(centres) - 1)) if len(centres) > 1 else 0.5
    return float(centres[0] - half), float(centres[-1] + half)


def mesh_period(ds: xr.Dataset) -> float:
    """The mesh period in the unit of time of a Dataset: T = 2π/ω in units of τ, or its value in ms."""
    if "model" not in ds.attrs:
        raise InputError("dataset", "must carry the attributes of its study", sorted(map(str, ds.attrs)),
                         "xarray drops them in arithmetic, unless xarray.set_options(keep_attrs=True) is set.")
    return 2 * np.pi / model_from_json(ds.attrs["model"]).omega * unit_in(ds, "tau")


def plane(ds: xr.Dataset, name: str) -> tuple[str, str]:
    """Names of the horizontal and the vertical axis of a two-dimensional variable."""
    vertical, horizontal = ds[name].dims
    return str(horizontal), str(vertical)


def label_and_limit(ax: Axes, ds: xr.Dataset, horizontal: str, vertical: str) -> None:
    """Label both axes of a plane, and limit them to the outermost cell centres: the ranges that the study was given."""
    x, y = ds[horizontal], ds[vertical]
    ax.set(xlabel=axis_label(x, horizontal), ylabel=axis_label(y, vertical))
    if x.size > 1:
        ax.set_xlim(float(x[0]), float(x[-1]))
    if y.size > 1:
        ax.set_ylim(float(y[0]), float(y[-1]))


def widened_limits(low: float, high: float, unit: float) -> tuple[float, float]:
    """Limits of an axis: ``low`` and ``high``, or wider ones if these are equal up to rounding errors.

    Parameters
    ----------
    low, high : float
        Smallest and largest value shown.
    unit : float
        A typical magnitude along the axis, e.g. half the backlash: the scale of the limits if all values are near 0.
    """
    middle, size = (low + high) / 2, max(abs(low), abs(high), unit)
    if high - low > _ROUNDING * size:
        return low, high
    return middle - _DEGENERATE_HALF_WIDTH * size, middle + _DEGENERATE_HALF_WIDTH * size


def vertical_limits(values: np.ndarray, unit: float) -> tuple[float, float]:
    """Limits of the vertical axis for all values that are finite, with a margin; ``unit`` as of `widened_limits`."""
    known = values[np.isfinite(values)]
    low, high = widened_limits(*((float(known.min()), float(known.max())) if known.size else (-unit, unit)), unit)
    margin = _MARGIN * (high - low)
    return low - margin, high + margin


def second_axis_below(ax: Axes, factor: float, label: str) -> None:
    """Add a second horizontal axis below that of an Axes, with ``factor`` times its values."""
    second = ax.secondary_xaxis(
        "bottom", functions=(lambda x: np.asarray(x, float) * factor, lambda x: np.asarray(x, float) / factor))
    second.spines["bottom"].set_position(("outward", _SECOND_AXIS * _font_scale()))
    second.set_xlabel(label)


def widen_degenerate_axes(ax: Axes, x: float | None = None, y: float | None = None) -> None:
    """Widen the axes along which all values are equal up to rounding errors.

    ``x`` and ``y`` are typical magnitudes, as ``unit`` of `widened_limits`; an axis with None is not changed.
    """
    for unit, (low, high), limit in ((x, ax.dataLim.intervalx, ax.set_xlim), (y, ax.dataLim.intervaly, ax.set_ylim)):
        if unit is not None and (wide := widened_limits(low, high, unit)) != (low, high):
            limit(wide)


WIDE = 1.15
"""Ratio of width to height of an Axes from which on its panels lie side by side, and not one above the other."""

_BESIDE, _BELOW = 0.62, 0.55
"""Space between two panels for the labels of an axis, in inches: beside each other, and one below the other."""

_WIDEST_GAP = 0.3
"""Largest share of the width or height that the space between two panels takes."""


def panels(ax: Axes, share: float, beside: float = _BESIDE) -> tuple[Axes, Axes]:
    """Replace an Axes by two panels: side by side in a wide one, else one above the other.

    Parameters
    ----------
    ax : Axes
        Its own frame and axes are hidden; the panels are its ``child_axes``.
    share : float
        Share of the width or height that the first panel, left or above, takes.
    beside : float
        Space between panels that lie side by side, in inches.
    """
    ax.set_axis_off()
    box, wide = ax.get_window_extent(), is_wide(ax)
    length, gap = (box.width, beside) if wide else (box.height, _BELOW)
    between = min(gap * ax.figure.dpi / length, _WIDEST_GAP)
    first, second = share * (1 - between), (1 - share) * (1 - between)
    if wide:
        return ax.inset_axes((0, 0, first, 1)), ax.inset_axes((1 - second, 0, second, 1))
    return ax.inset_axes((0, 1 - first, 1, first)), ax.inset_axes((0, 0, 1, second))


def is_wide(ax: Axes) -> bool:
    """Whether the panels of an Axes lie side by side."""
    box = ax.get_window_extent()
    return box.width >= WIDE * box.height
