"""Diagrams along one parameter: stroboscopic points, exponents, single variables, branches with events and jumps."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, PowerNorm
from matplotlib.lines import Line2D

from gearchaos.continuation.events import KINDS
from gearchaos.errors import InputError, unknown_name, whole_number
from gearchaos.gears.operation.results import unit_in
from gearchaos.plot._datasets import check, check_name, keeps_data
from gearchaos.plot.axes import axis_label, cell_extent, draw_legend, new_axes, value_label, vertical_limits
from gearchaos.plot.classes import NO_CLASS, continuous_values, named_classes
from gearchaos.plot.maps import motion_strip
from gearchaos.plot.motions import first_coordinate
from gearchaos.plot.theme import BACKGROUND, INK, STROBE, adapt, adapt_scale, adapt_style, event_words
from gearchaos.studies.orbits.branch_lines import axis_of, line_nodes, line_parts, positions, stability_word

DENSITY_COLOURS = LinearSegmentedColormap.from_list("ink", ["#ffffff", "#7f93b8", "#1d2b53", "#060a1c"])
DENSITY_EXPONENT = 0.22  # darkness is the density of points to this power, so that low densities are visible
_MAX_ROWS = 10_000


@keeps_data
def bifurcation(
    ds: xr.Dataset, name: str | None = None, ax: Axes | None = None, *, rows: int = 560, strip: bool = True,
    legend: bool = True,
) -> Axes:
    r"""Draw a bifurcation diagram as an image of point densities.

    Every value of the parameter is one column of pixels. The darkness of a pixel is the fraction of the points of its
    column that lie in it. Thousands of columns stay legible, and the size of the file does not depend on the number of
    points.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.bifurcation`: ``section_<name>`` with dims (axis, point).
    name : str
        Coordinate to show; x1, or z of a single model, if left out.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    rows : int
        Number of pixels over the height.
    strip, legend : bool
        Show the kind of motion of every column by the colours of a strip above, and a legend of them.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.bifurcation`, or has no stroboscopic points of ``name``.

    Examples
    --------
    >>> import gearchaos as gc
    >>> diagram = gc.bifurcation(gc.MeshModel.of(q0=0.1), "eps1=0.15:0.25:40", points=16)
    >>> ax = gc.plot.bifurcation(diagram)
    >>> ax.get_xlabel()
    'error amplitude $\\varepsilon_{1}$'
    """
    check(ds, "bifurcation", label=1, period=1)
    axis, name = str(ds["label"].dims[0]), name or first_coordinate(ds)
    if "point" not in ds.dims:
        raise InputError("dataset", "must have stroboscopic points", "a bifurcation with points=0",
                         "gearchaos.plot.lyapunov draws its exponents.")
    check_name(ds, "name", name, (axis, "point"), "section_")
    rows = whole_number("rows", rows, 1, _MAX_ROWS)
    ax, section = new_axes(ax), ds[f"section_{name}"]
    low, high = vertical_limits(section.values, unit_in(ds, name))
    centres = low + (np.arange(rows) + 0.5) * (high - low) / rows
    ax.imshow(
        density(section.values, low, high, rows).T, origin="lower", aspect="auto", cmap=adapt_scale(DENSITY_COLOURS),
        norm=PowerNorm(DENSITY_EXPONENT, vmin=0, vmax=1), interpolation="antialiased", interpolation_stage="data",
        extent=cell_extent(ds[axis].values, centres),
    )
    ax.set(xlabel=axis_label(ds[axis], axis), ylabel=axis_label(section, name, beside=ds[axis]))
    if ds[axis].size > 1:
        ax.set_xlim(float(ds[axis][0]), float(ds[axis][-1]))
    if strip:
        motion_strip(ds, ax, legend=legend)
    return ax


def density(values: np.ndarray, low: float, high: float, rows: int) -> np.ndarray:
    """Fraction, (columns, rows), of the points of each column in each pixel of an image from ``low`` to ``high``.

    ``values`` is (columns, points), NaN for points that do not exist.
    """
    columns, row = np.nonzero(np.isfinite(values))
    pixel = ((values[columns, row] - low) / (high - low) * rows).astype(int)
    counts = np.bincount(columns * rows + np.clip(pixel, 0, rows - 1), minlength=len(values) * rows)
    counts = counts.reshape(len(values), rows)
    return counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)


@keeps_data
def lyapunov(ds: xr.Dataset, ax: Axes | None = None) -> Axes:
    r"""Draw the largest Lyapunov exponent with its confidence band and the zero line.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.bifurcation`: ``lyapunov``, ``lyapunov_lo`` and ``lyapunov_hi`` over one axis, per unit τ.
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.bifurcation`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> diagram = gc.bifurcation(gc.MeshModel.of(q0=0.1), "eps1=0.15:0.25:40", points=16)
    >>> ax = gc.plot.lyapunov(diagram)
    >>> ax.get_ylabel()
    'largest exponent $\\lambda_1$'
    """
    check(ds, "bifurcation", lyapunov=1, lyapunov_lo=1, lyapunov_hi=1)
    ax = new_axes(ax)
    (axis,) = ds["lyapunov"].dims
    x, value = ds[axis].values, ds["lyapunov"].values
    ax.axhline(0, color=adapt("0.25"), linewidth=0.7)
    low, high = ds["lyapunov_lo"].values, ds["lyapunov_hi"].values
    band = ax.fill_between(x, low, high, color=adapt("#8fa6d3"), linewidth=0, label="99 % confidence interval")
    (line,) = ax.plot(x, value, color=adapt(INK), linewidth=0.4, label="largest exponent")
    ax.fill_between(x, 0, value, where=value > 0, color=adapt(STROBE), alpha=0.25, linewidth=0)
    ax.set(xlabel=axis_label(ds[axis], str(axis)), ylabel=axis_label(ds["lyapunov"], "lyapunov"))
    ax.set_xlim(float(x[0]), float(x[-1]) if len(x) > 1 else None)
    draw_legend(ax, [band, line])
    return ax


@keeps_data
def response(
    ds: xr.Dataset, name: str = "v_rms", ax: Axes | None = None, *, strip: bool = True, legend: bool = True
) -> Axes:
    r"""Draw a variable along one parameter.

    A continuous variable is a line with a gap where it has no value (NaN); codes, such as ``contact``, and small whole
    numbers are dots at the names of their classes.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.bifurcation`, with or without points, or from `gearchaos.dynamic_factor`.
    name : str
        Variable over the parameter alone.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    strip, legend : bool
        Show the kind of motion at every value by the colours of a strip above, and a legend of them.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.bifurcation` or `gearchaos.dynamic_factor`, or has no
        variable ``name``.

    Examples
    --------
    >>> import gearchaos as gc
    >>> diagram = gc.bifurcation(gc.MeshModel.of(q0=0.1), "eps1=0.15:0.25:40", points=16)
    >>> ax = gc.plot.response(diagram, "dynamic_factor")
    >>> ax.get_xlabel()
    'error amplitude $\\varepsilon_{1}$'
    """
    check(ds, "bifurcation", label=1, period=1)
    check_name(ds, "name", name, 1)
    ax = new_axes(ax)
    (axis,) = ds[name].dims
    x, found = ds[axis].values, named_classes(ds, name)
    if found is None:
        y = continuous_values(ds, name)
        ax.plot(x, y, color=adapt(INK), linewidth=1.0, marker="o", markersize=2.0, markeredgewidth=0)
        ax.set_ylim(*vertical_limits(y, unit_in(ds, name)))
    else:  # the ticks are the names from the lowest to the highest class
        index, classes = found
        known = index != NO_CLASS
        ax.plot(x[known], index[known], color=adapt(INK), linestyle="none", marker="o", markersize=2.5,
                markeredgewidth=0)
        low, high = (int(index[known].min()), int(index[known].max())) if known.any() else (0, 0)
        ax.set_yticks(range(low, high + 1), [kind.name for kind in classes[low : high + 1]], fontsize="small")
        ax.set_ylim(low - 0.5, high + 0.5)
    ax.set(xlabel=axis_label(ds[axis], str(axis)), ylabel=value_label(ds, name, ax, beside=ds[axis]))
    if len(x) > 1:
        ax.set_xlim(float(x[0]), float(x[-1]))
    if strip:
        motion_strip(ds, ax, legend=legend)
    return ax


_STABLE: dict[str, Any] = {"linestyle": "-", "linewidth": 1.5}
_UNSTABLE: dict[str, Any] = {"linestyle": (0, (4, 2.5)), "linewidth": 1.0}


def _check_branch(ds: xr.Dataset) -> None:
    """Raise `InputError` unless a Dataset is a result of `gearchaos.branch`."""
    points = dict.fromkeys(("branch", "unstable"), ("point",))
    events = dict.fromkeys(("event_value", "event_kind", "event_point", "event_branch"), ("event",))
    check(ds, "branch", **points, **events)


def _draw_lines(ds: xr.Dataset, ax: Axes, y: np.ndarray, at_events: np.ndarray) -> list[Line2D]:
    """Draw values along all branches, stable parts solid and unstable ones dashed, and return the legend handles.

    ``y`` is (P,) or (P, N), one line or N lines; ``at_events``, (E,) or (E, N), are the values at the events, points of
    the lines, too. Points that are no neighbours on their branch, because others were left out, are not connected.
    """
    nodes = line_nodes(ds)
    x = np.concatenate([ds[axis_of(ds)].values, ds["event_value"].values])[nodes.order]
    values = np.concatenate([y, at_events])[nodes.order]
    for first, end, is_stable in line_parts(nodes):
        if end - first > 1:
            ax.plot(x[first:end], values[first:end],
                    color=adapt(INK), zorder=2, **(_STABLE if is_stable else _UNSTABLE))
    stable = ds["unstable"].values == 0
    lines = [(stable.any(), _STABLE, stability_word(ds)), ((~stable).any(), _UNSTABLE, "unstable")]
    return [Line2D([], [], color=adapt(INK), label=name, **style) for occurs, style, name in lines if occurs]


def _rows(ds: xr.Dataset) -> dict[int, int]:
    """The index in the Dataset of each point, by its position among all points of the branches."""
    return {position: i for i, position in enumerate(positions(ds).tolist())}


@keeps_data
def branch(ds: xr.Dataset, name: str | None = None, ax: Axes | None = None, *, legend: bool = True) -> Axes:
    """Draw the stroboscopic points of a branch: n lines for orbits of period n, solid if stable, dashed if not.

    In an Axes that `bifurcation` has drawn, the lines lie over the diagram, whose limits are kept.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.branch`: ``section_<name>`` with dims (point, cycle).
    name : str
        Coordinate to show; x1, or z of a single model, if left out.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    legend : bool
        Add a legend of the lines, unless the Axes has a diagram.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.branch`, or has no coordinate ``name``.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> ax = gc.plot.branch(gc.branch(model, "omega=0.5:0.9"), "z")
    >>> ax.get_ylabel()
    'displacement $z$'
    """
    _check_branch(ds)
    name = name or first_coordinate(ds)
    check_name(ds, "name", name, ("point", "cycle"), "section_")
    ax, section, axis = new_axes(ax), ds[f"section_{name}"], axis_of(ds)
    over_diagram = bool(ax.images)
    limits = ax.get_xlim(), ax.get_ylim()
    # a result has the first point of the orbit at an event; the others are interpolated between the points before and
    # after the event, at the share of the step at which the first one is
    points, first, row = section.values, ds[f"event_section_{name}"].values, _rows(ds)
    at_events = np.full((len(first), points.shape[1]), np.nan)
    for i, before in enumerate(ds["event_point"].values.tolist()):
        ends = [points[row[position]] for position in (before, before + 1) if position in row]
        if ends:
            a, b = ends[0], ends[-1]
            step = b[0] - a[0]
            at_events[i] = a + (np.clip((first[i] - a[0]) / step, 0, 1) * (b - a) if step else 0)
            at_events[i, 0] = first[i]
    handles = _draw_lines(ds, ax, section.values, at_events)
    if over_diagram:
        ax.set(xlim=limits[0], ylim=limits[1])
        return ax
    ax.set(xlabel=axis_label(ds[axis], axis), ylabel=axis_label(section, name, beside=ds[axis]))
    if legend:
        draw_legend(ax, handles)
    return ax


_STROKE: dict[str, Any] = {"markersize": 8, "markeredgewidth": 1.4}  # marks a graze: in general no bifurcation
_EVENTS: dict[str, dict[str, Any]] = {
    name: {"marker": (mark := kind.marks[0]), "color": kind.colour, **(_STROKE if mark == "|" else {})}
    for name, kind in KINDS.items()}
_OTHER: dict[str, Any] = {"marker": "*", "color": "0.2"}  # how the events of a user's function are marked
_JUMP: dict[str, Any] = {"arrowstyle": "-|>", "color": STROBE, "linewidth": 1.1, "shrinkA": 2, "shrinkB": 1,
                         "mutation_scale": 10}


@keeps_data
def response_curve(ds: xr.Dataset, y: str = "z_peak_to_peak", ax: Axes | None = None, *, legend: bool = True) -> Axes:
    r"""Draw the response along a branch of periodic orbits: stable parts solid, unstable ones dashed.

    Every kind of event has a marker of its own. Where a fold ends a stable part, a slow change of the parameter makes
    the motion jump: an arrow leads to the orbit that the motion reaches, if it is one of the branches. Where
    points have been left out of the Dataset, the lines have gaps.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.branch`.
    y : str
        The variable to show: a response measure, ``z_max`` or ``z_min``.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    legend : bool
        Add a legend of the lines, the events and the jumps.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not a branch, or has no variable of this name along its points and events.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> ax = gc.plot.response_curve(gc.branch(model, "omega=0.5:0.9"))
    >>> ax.get_xlabel()
    'frequency $\\omega$'
    """
    _check_branch(ds)
    names = [str(n)[6:] for n in ds.data_vars if str(n).startswith("event_") and ds[n].dims == ("event",)]
    known = [n for n in names if n in ds and ds[n].dims == ("point",) and ds[n].dtype.kind == "f"]
    if y not in known:
        raise unknown_name("y", str(y), known)
    ax, axis = new_axes(ax), axis_of(ds)
    handles = _draw_lines(ds, ax, ds[y].values, ds[f"event_{y}"].values)
    kinds = ds["event_kind"].values
    for kind in [*(k for k in _EVENTS if k in kinds), *(k for k in dict.fromkeys(kinds) if k not in _EVENTS)]:
        own = kinds == kind
        style = {"markersize": 5, "markeredgewidth": 1.2, "markerfacecolor": BACKGROUND, **_EVENTS.get(kind, _OTHER)}
        handles += ax.plot(ds["event_value"].values[own], ds[f"event_{y}"].values[own], linestyle="none", zorder=4,
                           label=event_words(kind), **adapt_style(style))
    x, row, jumps = ds[axis].values, _rows(ds), False
    reached = [ds[f"jump_{name}"].values.tolist() if "jump_value" in ds else [] for name in ("value", "point")]
    for value, after in zip(*reached, strict=True):
        (events,) = np.nonzero((ds["event_value"].values == value) & (kinds == "fold"))
        if len(events) and after in row and after + 1 in row:  # it leads to an orbit of the branches
            ends, jumps = [row[after], row[after + 1]], True
            share = (value - x[ends[0]]) / (x[ends[1]] - x[ends[0]])
            low, high = ds[y].values[ends]
            ax.annotate("", (value, float(low + share * (high - low))), (value, float(ds[f"event_{y}"][events[0]])),
                        arrowprops=adapt_style(_JUMP), zorder=3)
    if jumps:
        handles.append(Line2D([], [], color=adapt(STROBE), marker=">", markersize=5, linewidth=1.1, label="jump"))
    ax.set(xlabel=axis_label(ds[axis], axis), ylabel=value_label(ds, y, ax, beside=ds[axis]))
    ax.margins(0.03, 0.06)
    if legend:
        draw_legend(ax, handles)
    return ax
