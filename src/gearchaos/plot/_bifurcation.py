"""The bifurcation diagram: stroboscopic points over one parameter."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, PowerNorm

from gearchaos.errors import InputError, whole_number
from gearchaos.gears.results import unit_in
from gearchaos.plot._axes import axis_label, cell_extent, new_axes, vertical_limits
from gearchaos.plot._checks import check, check_name
from gearchaos.plot._data import keeps_data
from gearchaos.plot._portrait import first_coordinate
from gearchaos.plot._ribbon import ribbon as draw_ribbon
from gearchaos.plot._theme import adapt_scale

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
