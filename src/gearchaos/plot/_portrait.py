"""The stroboscopic portrait: the state once per mesh period."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from gearchaos.plot._axes import axis_label, new_axes
from gearchaos.plot._phase import INK

_FEW = 200


def portrait(
    ds: xr.Dataset, x: str = "x1", y: str | None = None, ax: Axes | None = None, *, size: float | None = None
) -> Axes:
    """Draw the stroboscopic points in a plane of two coordinates, by default one and its velocity.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.simulate`: ``section_<x>`` and ``section_<y>`` over ``period``.
    x, y : str
        Coordinates; ``y`` is ``<x>_dot`` if left out.
    size : float, optional
        Diameter of the markers in points; by default large for few distinct points, a pixel for many.

    Returns
    -------
    Axes
    """
    ax, y = new_axes(ax), y or f"{x}_dot"
    across, up = ds[f"section_{x}"], ds[f"section_{y}"]
    size = size or (3.5 if distinct(across.values, up.values) <= _FEW else 0.55)
    ax.plot(across.values, up.values, "o", color=INK, markersize=size, markeredgewidth=0, rasterized=True)
    ax.set(xlabel=axis_label(across, x), ylabel=axis_label(up, y))
    return ax


def distinct(x: np.ndarray, y: np.ndarray) -> int:
    """How many points can be told apart at a ten-thousandth of their spread; those of an orbit repeat."""
    points = np.stack([x, y], axis=1)
    spread = np.maximum(np.ptp(points, axis=0), 1e-9)
    return len(np.unique(np.round((points - points[0]) / spread * 1e4), axis=0))
