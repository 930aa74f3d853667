"""The zones map: what kind of motion each cell of a parameter plane settles to."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.patches import Patch

from gearchaos.plot._axes import cell_extent, new_axes, plane, trim
from gearchaos.plot._classes import GROUND, LEGEND, MOTION_CLASSES, NOT_COMPUTED, motion_class


def zones(ds: xr.Dataset, ax: Axes | None = None, *, legend: bool = True) -> Axes:
    """Draw the kinds of motion over a plane of two parameters.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.zones`: ``label`` and ``period`` with dims (y, x).
    ax : Axes, optional
        Where to draw; a new figure if left out.
    legend : bool
        Add a legend of the classes that are present, above the map.

    Returns
    -------
    Axes
    """
    ax = new_axes(ax)
    horizontal, vertical = plane(ds, "label")
    classes = motion_class(ds["label"], ds["period"])
    draw_classes(classes, ax, cell_extent(ds[horizontal].values, ds[vertical].values))
    trim(ax, ds, horizontal, vertical)
    if legend:
        class_legend(ax, classes)
    return ax


def draw_classes(classes: np.ndarray, ax: Axes, extent: tuple[float, float, float, float]) -> None:
    """Colour cells (rows, columns) by their class; those not computed show the hatched ground."""
    ax.imshow(
        np.ma.masked_equal(classes, NOT_COMPUTED), origin="lower", aspect="auto", interpolation="nearest",
        cmap=ListedColormap([c.colour for c in MOTION_CLASSES]), vmin=-0.5, vmax=len(MOTION_CLASSES) - 0.5,
        extent=extent, interpolation_stage="rgba",
    )
    if np.any(classes == NOT_COMPUTED):
        ax.patch.set(**GROUND)


def class_legend(host: Axes | Figure, classes: np.ndarray, **options: Any) -> Legend:
    """A legend of only the classes that occur in ``classes``; ``options`` go to the legend of ``host``."""
    present = [MOTION_CLASSES[i] for i in np.unique(classes) if i != NOT_COMPUTED]
    handles = [Patch(facecolor=c.colour, edgecolor="0.35", linewidth=0.5, label=c.name) for c in present]
    if np.any(classes == NOT_COMPUTED):
        handles.append(Patch(**GROUND, linewidth=0.5, label="not computed"))
    return host.legend(handles=handles, **{**LEGEND, "ncols": min(len(handles), 4), **options})
