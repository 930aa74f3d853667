"""Legends above and beside an Axes, and the hatching of classes, by which they are told apart without colour."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal

import numpy as np
from matplotlib import rcParams
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path

from gearchaos.plot._classes import NOT_COMPUTED_STYLE
from gearchaos.plot._theme import adapt, adapt_style

_LOOKS: tuple[tuple[str, str], ...] = (
    ("#ffffff", ""), ("#ffffff", "////"), ("#ffffff", "\\\\\\\\"), ("#ffffff", "----"), ("#ffffff", "xxxx"),
    ("#ffffff", "...."), ("#8c8c8c", ""), ("#d0d0d0", "||||"), ("#000000", ""),
)
"""Shade and hatch of each class of a map, in the order of the classes; used again after the last one."""

_INK = "black"


def shade(index: int) -> str:
    """The shade, without colour, of the class with this index."""
    return _LOOKS[index % len(_LOOKS)][0]


def draw_hatches(index: np.ndarray, ax: Axes, extent: tuple[float, float, float, float]) -> None:
    """Hatch the cells of a map, ``index`` (rows, columns) of their classes; negative ones stay as they are."""
    rows, columns = index.shape
    x, y = np.linspace(*extent[:2], columns + 1), np.linspace(*extent[2:], rows + 1)
    for kind in np.unique(index[index >= 0]).tolist():
        if hatch := _LOOKS[kind % len(_LOOKS)][1]:
            area = Path.make_compound_path(*(
                Path([(x[a], y[r]), (x[b], y[r]), (x[b], y[r + 1]), (x[a], y[r + 1]), (x[a], y[r])], closed=True)
                for r, a, b in _runs(index == kind)))
            ax.add_patch(PathPatch(area, hatch=hatch, facecolor="none", edgecolor=_INK, linewidth=0))


def hatched_patch(kind: int, name: str) -> Patch:
    """The legend handle of the class with index ``kind``."""
    colour, hatch = _LOOKS[kind % len(_LOOKS)]
    return Patch(facecolor=colour, edgecolor=_INK, linewidth=0.5, hatch=hatch, label=name)


def _runs(mask: np.ndarray) -> Iterator[tuple[int, int, int]]:
    """The row, first column and end column of each run of True cells in the rows of ``mask``."""
    padded = np.pad(mask, ((0, 0), (1, 1))).astype(np.int8)
    change = np.diff(padded, axis=1)
    rows, first = np.nonzero(change == 1)
    end = np.nonzero(change == -1)[1]
    return zip(rows.tolist(), first.tolist(), end.tolist(), strict=True)


_STYLE: dict[str, Any] = {
    "loc": "lower left", "bbox_to_anchor": (0, 1.01, 1, 0), "borderaxespad": 0, "frameon": False,
    "handlelength": 1.1, "columnspacing": 1.0, "handletextpad": 0.5, "alignment": "left",
}
_COLUMNS = 4
"""Largest number of columns of a legend that belongs to a Figure."""

_SIDE_SIZES = (None, "small", "x-small", "xx-small")
"""Font sizes of a legend beside an Axes in order of preference; None for that of all legends."""

_SIDE_SHARE = 0.35
"""Largest width of a legend beside an Axes, relative to the figure, for which no smaller font is used."""

_PAD = 0.09
"""Upper bound of the padding, in inches, that a layout engine leaves left and right of an Axes together."""


def patches(entries: Mapping[int, tuple[str, str]], not_computed: bool, hatch: bool = False) -> list[Patch]:
    """Legend handles: a square for every class, and a striped one if some cells are not computed.

    Parameters
    ----------
    entries : dict of int to (str, str)
        Colour and name of each class, by its index.
    not_computed : bool
        Whether some cells are not computed.
    hatch : bool
        Whether classes are hatched instead of coloured.
    """
    edge = adapt("0.35")
    squares = [hatched_patch(i, name) if hatch else Patch(facecolor=colour, edgecolor=edge, linewidth=0.5, label=name)
               for i, (colour, name) in entries.items()]
    if not_computed:
        squares.append(Patch(**adapt_style(NOT_COMPUTED_STYLE), linewidth=0.5, label="not computed"))
    return squares


def legend(host: Axes | Figure, handles: Sequence[Artist], fit_to: Axes | None = None, **options: Any) -> Legend:
    """A legend above ``host``, in as many columns as fit.

    Parameters
    ----------
    host : Axes or Figure
        Where the legend is drawn.
    handles : sequence of Artist
        The entries.
    fit_to : Axes, optional
        The Axes whose width limits that of the legend, if ``host`` is a strip above it.
    options
        Passed to ``host.legend``. With ``ncols``, or on a Figure, the number of columns is not fitted to the width.
    """
    options = {**_STYLE, **options}
    if isinstance(host, Figure) or "ncols" in options:
        columns = options.pop("ncols", min(len(handles), _COLUMNS))
        return host.legend(handles=_by_rows(handles, columns), ncols=columns, **options)
    width = _available_width(fit_to or host)
    sizes = rcParams["legend.fontsize"], "small", "x-small"  # a smaller font is preferred to a single column
    layouts = [(size, columns) for size in sizes for columns in range(len(handles), 1, -1)]
    for size, columns in [*layouts, ("small", 1)]:
        made = host.legend(handles=_by_rows(handles, columns), ncols=columns, fontsize=size, **options)
        if made.get_window_extent().width <= width:
            break
    _make_space(fit_to or host, made, "top")
    return made


def _by_rows(handles: Sequence[Artist], columns: int) -> list[Artist]:
    """The entries in the order in which matplotlib, which fills columns, shows them row by row."""
    return [handle for column in range(columns) for handle in handles[column::columns]]


def _available_width(ax: Axes) -> float:
    """Width in pixels from the left edge of an Axes, after layout, to the right edge of its grid cell."""
    figure, spec = ax.get_figure(root=False), ax.get_subplotspec()
    assert figure is not None
    columns = (spec.colspan.start, spec.colspan.stop, spec.get_gridspec().ncols) if spec else (0, 1, 1)
    left, right = (figure.bbox.x0 + figure.bbox.width * end / columns[2] for end in columns[:2])
    if figure.get_layout_engine() is None:
        return right - ax.bbox.x0
    drawn = ax.get_tightbbox()
    labels = 0.0 if drawn is None else ax.bbox.x0 - drawn.x0
    return right - left - labels - _PAD * figure.dpi


def _make_space(ax: Axes, made: Legend, side: Literal["top", "right"]) -> None:
    """Shrink the Axes of a figure without layout engine if a legend would be cut off on a side."""
    figure = ax.get_figure(root=True)
    assert figure is not None
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
    figure = ax.get_figure(root=True)
    assert figure is not None
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
