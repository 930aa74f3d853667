"""Diagrams along one parameter: stroboscopic points, the largest Lyapunov exponent, any single variable."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, PowerNorm

from gearchaos.errors import InputError, whole_number
from gearchaos.gears.results import unit_in
from gearchaos.plot._axes import axis_label, cell_extent, new_axes, vertical_limits
from gearchaos.plot._checks import check, check_name
from gearchaos.plot._classes import NO_CLASS, MotionClass, continuous_values, named_classes
from gearchaos.plot._data import keeps_data
from gearchaos.plot._legends import legend as draw_legend
from gearchaos.plot._maps import ribbon as draw_ribbon
from gearchaos.plot._motions import first_coordinate
from gearchaos.plot._theme import INK, STROBE, adapt, adapt_scale

DENSITY_COLOURS = LinearSegmentedColormap.from_list("ink", ["#ffffff", "#7f93b8", "#1d2b53", "#060a1c"])
DENSITY_EXPONENT = 0.22
"""Darkness is the density of points to this power, so that low densities are visible."""

_MAX_ROWS = 10_000


@keeps_data
def bifurcation(
    ds: xr.Dataset, name: str | None = None, ax: Axes | None = None, *, rows: int = 560, ribbon: bool = True,
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
    ribbon, legend : bool
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
    if ribbon:
        draw_ribbon(ds, ax, legend=legend)
    return ax


def density(values: np.ndarray, low: float, high: float, rows: int) -> np.ndarray:
    """Fraction of the points of each column in each pixel.

    Parameters
    ----------
    values : (columns, points)
        NaN for points that do not exist.
    low, high : float
        Lower and upper edge of the image.
    rows : int
        Number of pixels over the height.

    Returns
    -------
    (columns, rows) array of float
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
    ds: xr.Dataset, name: str = "v_rms", ax: Axes | None = None, *, ribbon: bool = True, legend: bool = True
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
    ribbon, legend : bool
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
    x, classes = ds[axis].values, named_classes(ds, name)
    if classes is None:
        y = continuous_values(ds, name)
        ax.plot(x, y, color=adapt(INK), linewidth=1.0, marker="o", markersize=2.0, markeredgewidth=0)
        ax.set_ylim(*vertical_limits(y, unit_in(ds, name)))
    else:
        _draw_classes(ax, x, *classes)
    ax.set(xlabel=axis_label(ds[axis], str(axis)), ylabel=axis_label(ds[name], name, beside=ds[axis]))
    if len(x) > 1:
        ax.set_xlim(float(x[0]), float(x[-1]))
    if ribbon:
        draw_ribbon(ds, ax, legend=legend)
    return ax


def _draw_classes(ax: Axes, x: np.ndarray, index: np.ndarray, classes: Sequence[MotionClass]) -> None:
    """Draw the class of each value (N,) as a dot; the ticks are the names from the lowest to the highest class."""
    known = index != NO_CLASS
    ax.plot(x[known], index[known], color=adapt(INK), linestyle="none", marker="o", markersize=2.5, markeredgewidth=0)
    low, high = (int(index[known].min()), int(index[known].max())) if known.any() else (0, 0)
    ax.set_yticks(range(low, high + 1), [kind.name for kind in classes[low : high + 1]], fontsize="small")
    ax.set_ylim(low - 0.5, high + 0.5)
