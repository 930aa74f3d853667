"""The level map: a measure of the motion (V_RMS, dynamic factor, ...) over a parameter plane."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from gearchaos.plot._axes import axis_label, cell_extent, new_axes, plane, trim


def level(
    ds: xr.Dataset, name: str = "v_rms", ax: Axes | None = None, *, cmap: str = "viridis", clip: float = 1.0,
    colorbar: bool = True,
) -> Axes:
    """Draw a measure over a plane of two parameters in perceptually uniform colours.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.zones`; NaN cells stay grey.
    name : str
        Variable with dims (y, x).
    cmap : str
        A perceptually uniform matplotlib colormap.
    clip : float
        Percent of the cells at the top end that may saturate, so that a few peaks do not darken the rest.
    colorbar : bool
        Add a colour bar to the right.

    Returns
    -------
    Axes
    """
    ax = new_axes(ax)
    horizontal, vertical = plane(ds, name)
    values = ds[name].values
    low, high = np.nanmin(values), np.nanpercentile(values, 100 - clip)
    ax.set_facecolor("0.75")
    image = ax.imshow(
        values, origin="lower", aspect="auto", interpolation="nearest", cmap=cmap, vmin=low, vmax=high,
        extent=cell_extent(ds[horizontal].values, ds[vertical].values),
    )
    trim(ax, ds, horizontal, vertical)
    if colorbar:
        bar = ax.figure.colorbar(image, ax=ax, extend="max" if np.nanmax(values) > high else "neither", pad=0.02)
        bar.set_label(axis_label(ds[name], name))
    return ax
