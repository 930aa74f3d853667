"""Helpers that all pictures share: new Axes and panels, labels, limits, edges of cells, legends above and beside."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np
import xarray as xr
from matplotlib import rcParams
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from gearchaos.datasets import model_from_json
from gearchaos.errors import InputError
from gearchaos.gears.operation.results import unit_in
from gearchaos.plot._datasets import figure_of
from gearchaos.plot.theme import BACKGROUND, adapt_style, is_dark
from gearchaos.quantities import Quantity, find
from gearchaos.studies.operation.factor_context import words_beside

_SCALES = {"1", "delta", "omega0", "c0", "T"}  # (2.8)-(2.11); a unit made of these alone is not shown on an axis
_FONT_SIZE = 10.0  # of the font for which widths and distances are given, in points
_CHARACTER_WIDTH = 0.078  # mean width of a character of an axis label in that font, in inches
_SHORTEST_LINE = 12  # least number of characters in a line of a wrapped label
_ROUNDING = 1e-9  # relative difference below which two values are treated as equal
_DEGENERATE_HALF_WIDTH = 0.05  # of an axis along which all values are equal, relative to their magnitude
_MARGIN = 0.03  # above and below the values that are shown, relative to their range
_SECOND_AXIS = 38  # distance of a second horizontal axis below the first one, in points
_OUTLINE = 2.0  # width of the outline of a legend handle, on both sides together, in points


def new_axes(ax: Axes | None) -> Axes:
    """``ax`` itself, or the Axes of a new pyplot figure."""
    if ax is not None:
        return ax
    import matplotlib.pyplot as plt

    return plt.subplots(layout="constrained")[1]


class Overlay:
    """An Axes for curves in a plane: one of their own, or that of a map, whose limits and labels are kept."""

    def __init__(self, ax: Axes | None) -> None:
        self.over_map = ax is not None and bool(ax.images)
        self.ax = new_axes(ax)

    def style(self, style: Mapping[str, Any]) -> dict[str, Any]:
        """Properties of an artist as they are over a map, whose colours are the same in all styles; else adapted."""
        return dict(style) if self.over_map else adapt_style(style)

    def outline(self, width: float, **options: Any) -> withStroke:
        """An outline in the colour of the background, by which a line can be seen on every colour."""
        return withStroke(linewidth=width, foreground=self.style({"color": BACKGROUND})["color"], **options)

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
        if not self.over_map:
            (x, y), (across, up) = parameters.items(), window
            labels = {"xlabel": axis_label(x[1], x[0]), "ylabel": axis_label(y[1], y[0])}
            self.ax.set(xlim=tuple(across), ylim=tuple(up), **labels)


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


def value_label(ds: xr.Dataset, name: str, ax: Axes, beside: xr.DataArray | None = None) -> str:
    """`axis_label` of a variable of a result, wrapped; that of a dynamic factor says what it is read with."""
    text = ", ".join([axis_label(ds[name], name, beside), *words_beside(ds, name)])
    return wrapped(text, ax.get_window_extent().height / ax.figure.dpi)


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


def width_in_inches(ax: Axes) -> float:
    return float(ax.get_window_extent().width / ax.figure.dpi)


def cell_extent(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float, float]:
    """Outer edges (left, right, bottom, top) of cells with equidistant centres ``x`` (columns,) and ``y`` (rows,)."""
    edges = []
    for centres in (np.asarray(x, float), np.asarray(y, float)):
        half = (centres[-1] - centres[0]) / (2 * (len(centres) - 1)) if len(centres) > 1 else 0.5
        edges += [float(centres[0] - half), float(centres[-1] + half)]
    left, right, bottom, top = edges
    return left, right, bottom, top


def mesh_period(ds: xr.Dataset) -> float:
    """The mesh period in the unit of time of a Dataset: T = 2π/ω in units of τ, or its value in ms."""
    if "model" not in ds.attrs:
        raise InputError("dataset", "must carry the attributes of its study", sorted(map(str, ds.attrs)),
                         "xarray drops them in arithmetic, unless xarray.set_options(keep_attrs=True) is set.")
    return 2 * np.pi / model_from_json(ds.attrs["model"]).omega * unit_in(ds, "tau")


def plane(ds: xr.Dataset, name: str) -> tuple[str, str, tuple[float, float, float, float]]:
    """Names of the horizontal and the vertical axis of a two-dimensional variable, and the extent of its cells."""
    vertical, horizontal = map(str, ds[name].dims)
    return horizontal, vertical, cell_extent(ds[horizontal].values, ds[vertical].values)


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

    ``unit`` is a typical magnitude along it, e.g. half the backlash: the scale of the limits if all values are near 0.
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


_WIDE = 1.15  # ratio of width to height of an Axes from which on its panels lie side by side, not one above the other
_BESIDE, _BELOW = 0.62, 0.55  # space between two panels for the labels of an axis, in inches
_WIDEST_GAP = 0.3  # largest share of the width or height taken by this space


def panels(ax: Axes, share: float, beside: float = _BESIDE) -> tuple[Axes, Axes]:
    """Replace an Axes by two panels, its ``child_axes``: side by side in a wide one, else one above the other.

    The first one, left or above, takes this ``share`` of the length; ``beside`` is the space between panels that lie
    side by side, in inches.
    """
    ax.set_axis_off()
    box = ax.get_window_extent()
    wide = box.width >= _WIDE * box.height
    length, gap = (box.width, beside) if wide else (box.height, _BELOW)
    between = min(gap * ax.figure.dpi / length, _WIDEST_GAP)
    first, second = share * (1 - between), (1 - share) * (1 - between)
    if wide:
        return ax.inset_axes((0, 0, first, 1)), ax.inset_axes((1 - second, 0, second, 1))
    return ax.inset_axes((0, 1 - first, 1, first)), ax.inset_axes((0, 0, 1, second))


_LEGEND: dict[str, Any] = {
    "loc": "lower left", "bbox_to_anchor": (0, 1.01, 1, 0), "borderaxespad": 0, "frameon": False,
    "handlelength": 1.1, "columnspacing": 1.0, "handletextpad": 0.5, "alignment": "left",
}
_TALLEST = 0.65  # greatest height of a legend above an Axes, relative to the figure, before its font is made tiny
_COLUMNS = 4  # most columns of a legend that belongs to a Figure
_SIDE_SIZES = (None, "small", "x-small", "xx-small")  # of a legend beside an Axes, in order of preference
_SIDE_SHARE = 0.35  # largest width of it, relative to the figure, for which no smaller font is used
_PAD = 0.09  # upper bound of the padding, in inches, that a layout engine leaves left and right of an Axes together


def draw_legend(host: Axes | Figure, handles: Sequence[Artist], fit_to: Axes | None = None, **options: Any) -> Legend:
    """A legend above ``host``, in as many columns as fit its width, or that of ``fit_to`` if it is a strip above it.

    The ``options`` are those of ``host.legend``. With ``ncols``, or on a Figure, the number of columns is not fitted.
    """
    def by_rows(columns: int) -> list[Artist]:  # matplotlib fills columns
        return [handle for column in range(columns) for handle in handles[column::columns]]

    options = {**_LEGEND, **options}
    if isinstance(host, Figure) or "ncols" in options:
        columns = options.pop("ncols", min(len(handles), _COLUMNS))
        return host.legend(handles=by_rows(columns), ncols=columns, **options)
    # the width is that from the left edge of the Axes, after layout, to the right edge of its grid cell, in pixels
    ax = fit_to or host
    figure, spec = ax.get_figure(root=False), ax.get_subplotspec()
    assert figure is not None
    start, end, count = (spec.colspan.start, spec.colspan.stop, spec.get_gridspec().ncols) if spec else (0, 1, 1)
    left, right = (figure.bbox.x0 + figure.bbox.width * edge / count for edge in (start, end))
    width = right - ax.bbox.x0
    if figure.get_layout_engine() is not None:
        drawn = ax.get_tightbbox()
        width = right - left - (0.0 if drawn is None else ax.bbox.x0 - drawn.x0) - _PAD * figure.dpi
    sizes = rcParams["legend.fontsize"], "small", "x-small"  # a smaller font is preferred to a single column
    layouts = [(size, columns) for size in sizes for columns in range(len(handles), 1, -1)]
    for size, columns in [*layouts, ("small", 1), ("xx-small", 1)]:
        made = host.legend(handles=by_rows(columns), ncols=columns, fontsize=size, **options)
        drawn = made.get_window_extent()
        if drawn.width <= width and drawn.height <= _TALLEST * made.figure.bbox.height:
            break
    _make_space(ax, made, "top")
    return made


def _make_space(ax: Axes, made: Legend, side: Literal["top", "right"]) -> None:
    """Shrink the Axes of a figure without layout engine if a legend would be cut off on a side."""
    figure = figure_of(ax)
    end, size, opposite = ("y1", "height", "bottom") if side == "top" else ("x1", "width", "left")
    over = getattr(made.get_window_extent(), end) - getattr(figure.bbox, end)
    if over > 0 and figure.get_layout_engine() is None and ax.get_subplotspec() is not None:
        length, margins = getattr(figure.bbox, size), figure.subplotpars
        edge = getattr(margins, side) - over / length - _PAD * figure.dpi / length
        figure.subplots_adjust(**{side: max(edge, getattr(margins, opposite) + 0.1)})


def side_legend(ax: Axes, handles: Sequence[Artist]) -> Legend:
    """A legend to the right of an Axes, beside which an earlier legend remains; in a small Axes with a small font.

    In a figure without layout engine, beside another Axes, it is inside the Axes.
    """
    earlier = ax.get_legend()
    figure = figure_of(ax)
    for size in _SIDE_SIZES:
        made = ax.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0, frameon=False,
                         handlelength=1.8, handletextpad=0.6, alignment="left", fontsize=size)
        drawn = made.get_window_extent()
        if drawn.height <= ax.bbox.height and drawn.width <= _SIDE_SHARE * figure.bbox.width:
            break
    if earlier is not None:
        ax.add_artist(earlier)
        earlier.set_clip_on(False)  # `add_artist` would cut off what lies outside the Axes
    spec = ax.get_subplotspec()
    if figure.get_layout_engine() is None and spec is not None and not spec.is_last_col():
        made.set(loc="best", bbox_to_anchor=None)
        made.set_frame_on(True)
    else:
        _make_space(ax, made, "right")
    return made
