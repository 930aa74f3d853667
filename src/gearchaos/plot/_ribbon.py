"""A strip of colours above a diagram: the kind of motion at each value of the parameter."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from gearchaos.plot._axes import cell_extent
from gearchaos.plot._checks import check
from gearchaos.plot._classes import motion_class
from gearchaos.plot._data import keeps_data
from gearchaos.plot._zones import class_legend, draw_classes


@keeps_data
def ribbon(ds: xr.Dataset, ax: Axes, *, legend: bool = True) -> Axes:
    """Draw the kinds of motion of a bifurcation diagram as a thin strip above an Axes.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.bifurcation`.
    ax : Axes
        The diagram; the strip shares its horizontal axis.
    legend : bool
        Add a legend of the classes that occur.

    Returns
    -------
    Axes
        The strip.

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.bifurcation`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> diagram = gc.bifurcation(gc.MeshModel.of(q0=0.1), "eps1=0.15:0.25:40", points=16)
    >>> ax = gc.plot.response(diagram, "v_rms", ribbon=False)
    >>> strip = gc.plot.ribbon(diagram, ax)
    >>> strip.get_position().y0 > ax.get_position().y0
    np.True_
    """
    check(ds, "bifurcation", label=1, period=1)
    strip = ax.inset_axes((0.0, 1.012, 1.0, 0.035), sharex=ax)
    (axis,) = ds["label"].dims
    classes = motion_class(ds["label"], ds["period"])
    draw_classes(classes[None, :], strip, cell_extent(ds[axis].values, np.zeros(1)))
    strip.tick_params(left=False, bottom=False, labelleft=False, labelbottom=False)
    if legend:
        class_legend(strip, classes, fit_to=ax, bbox_to_anchor=(0, 1.1, 1, 0))
    return strip
