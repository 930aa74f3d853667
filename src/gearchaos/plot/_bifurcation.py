"""The bifurcation diagram: where the stroboscopic points lie as one parameter changes."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, PowerNorm

from gearchaos.plot._axes import axis_label, cell_extent, new_axes
from gearchaos.plot._ribbon import ribbon as draw_ribbon

INK_SCALE = LinearSegmentedColormap.from_list("ink", ["#ffffff", "#7f93b8", "#1d2b53", "#060a1c"])
_MARGIN = 0.03


def bifurcation(
    ds: xr.Dataset, name: str = "x1", ax: Axes | None = None, *, rows: int = 560, ribbon: bool = True,
    legend: bool = True,
) -> Axes:
    """Draw a bifurcation diagram as a picture of point densities.

    Every column of the study is one column of pixels and the ink is the share of its points in a pixel, so the
    detail of thousands of columns shows and the file stays small however many points there are.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.bifurcation`: ``section_<name>`` with dims (axis, point).
    name : str
        Coordinate to show.
    rows : int
        Pixels over the height.
    ribbon, legend : bool
        Colour the verdicts of the columns on a strip above, with a legend.

    Returns
    -------
    Axes
    """
    ax = new_axes(ax)
    section = ds[f"section_{name}"].transpose(..., "point")
    axis = str(section.dims[0])
    low, high = _span(section.values)
    centres = low + (np.arange(rows) + 0.5) * (high - low) / rows
    ax.imshow(
        density(section.values, low, high, rows).T, origin="lower", aspect="auto", cmap=INK_SCALE,
        norm=PowerNorm(0.22, vmin=0, vmax=1), interpolation="antialiased", interpolation_stage="data",
        extent=cell_extent(ds[axis].values, centres),
    )
    ax.set(xlabel=axis_label(ds[axis], axis), ylabel=axis_label(section, name))
    if ds[axis].size > 1:
        ax.set_xlim(float(ds[axis][0]), float(ds[axis][-1]))
    if ribbon:
        draw_ribbon(ds, ax, legend=legend)
    return ax


def _span(values: np.ndarray) -> tuple[float, float]:
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    margin = _MARGIN * (high - low) or 0.5
    return low - margin, high + margin


def density(values: np.ndarray, low: float, high: float, rows: int) -> np.ndarray:
    """Share (columns, rows) of the points (columns, points) of each column in each pixel; NaN points are left out."""
    columns, row = np.nonzero(np.isfinite(values))
    pixel = ((values[columns, row] - low) / (high - low) * rows).astype(int)
    counts = np.bincount(columns * rows + np.clip(pixel, 0, rows - 1), minlength=len(values) * rows)
    counts = counts.reshape(len(values), rows)
    return counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
