"""A map of a response measure (V_RMS, dynamic factor, contact, ...) over a plane of two parameters.

The function is called `level` after the level of vibration, as the paper calls V_RMS.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import Colormap
from matplotlib.image import AxesImage

from gearchaos.errors import InputError
from gearchaos.gears.results import unit_in
from gearchaos.plot._axes import axis_label, cell_extent, label_and_limit, new_axes, plane, widened_limits, wrapped
from gearchaos.plot._checks import check, check_name
from gearchaos.plot._classes import continuous_values, named_classes
from gearchaos.plot._data import keeps_data
from gearchaos.plot._theme import adapt
from gearchaos.plot._zones import class_legend, draw_classes
from gearchaos.quantities import Rule
from gearchaos.validation import check_rule, to_float

_NO_VALUE = "0.75"
"""Colour of cells without a value."""

_BOUNDS = {"contact_fraction": (0.0, 1.0)}
"""Variables that have a least and a greatest possible value."""


@keeps_data
def level(
    ds: xr.Dataset, name: str = "v_rms", ax: Axes | None = None, *, cmap: str = "viridis", clip: float = 1.0,
    colorbar: bool = True, hatch: bool = False,
) -> Axes:
    r"""Draw a variable over a plane of two parameters: a continuous one by a colour scale, codes and counts as classes.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.zones`; cells without a value (NaN) are grey.
    name : str
        Variable with dims (y, x). Codes, such as ``contact``, and small whole numbers are classes with a legend.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    cmap : str
        A perceptually uniform matplotlib colormap.
    clip : float
        Percentage of the cells, those with the largest values, that lie above the colour scale: otherwise a few peaks
        would determine the scale.
    colorbar : bool
        Add a colour bar to the right, or the legend of the classes above.
    hatch : bool
        Tell classes apart by hatching instead of colours, for print in black and white.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.zones`, or has no variable ``name`` over its plane; for
        hatching of a variable without classes.

    Examples
    --------
    >>> import gearchaos as gc
    >>> zones = gc.zones(gc.MeshModel.of(q0=0.1), "omega=0.5:1.5:24", "eps1=0:0.3:16")
    >>> ax = gc.plot.level(zones, "dynamic_factor")
    >>> ax.get_xlabel()
    'frequency $\\omega$'
    """
    check(ds, "zones", label=2, period=2)
    check_name(ds, "name", name, 2)
    clip, classes = _checked_clip(cmap, clip), named_classes(ds, name)
    if hatch and not classes:
        raise InputError("hatch", "must be left out for a variable without classes", name)
    ax = new_axes(ax)
    horizontal, vertical = plane(ds, name)
    extent, title = cell_extent(ds[horizontal].values, ds[vertical].values), axis_label(ds[name], name)
    if classes:
        draw_classes(classes[0], ax, extent, classes[1], hatch=hatch)
    else:
        values = continuous_values(ds, name)
        limits = colour_limits(name, values[np.isfinite(values)], clip, unit_in(ds, name))
        image = _draw_continuous(ax, values, extent, cmap, limits)
    label_and_limit(ax, ds, horizontal, vertical)
    inches = ax.get_window_extent().transformed(ax.figure.dpi_scale_trans.inverted())
    if colorbar and classes:
        class_legend(ax, *classes, hatch=hatch, title=wrapped(title, inches.width))
    elif colorbar:
        clipped = bool(np.any(values > image.norm.vmax))
        label = wrapped(title, inches.height)
        ax.figure.colorbar(image, ax=ax, extend="max" if clipped else "neither", pad=0.02, label=label)
    return ax


def _checked_clip(cmap: Any, clip: Any) -> float:
    """``clip`` as a float; raises `InputError` unless it is a percentage and the colormap exists."""
    if not isinstance(cmap, Colormap) and cmap not in list(colormaps):
        raise InputError("cmap", "must be a colormap of matplotlib", cmap, "E.g. 'viridis' or 'magma'.")
    percent = to_float("clip", clip)
    check_rule("clip", percent, Rule(lambda v: 0 <= v <= 100, "must be a percentage, from 0 to 100"), clip)
    return percent


def colour_limits(name: str, known: np.ndarray, clip: float, unit: float) -> tuple[float, float]:
    """Limits of the colour scale of a variable with the finite values ``known`` (N,); ``clip`` percent lie above it.

    If all values are equal the scale extends to both sides of them, by a share of them or of ``unit``; that of a share
    of the time not beyond 0 and 1.
    """
    low, high = (np.min(known), np.percentile(known, 100 - clip)) if known.size else (0.0, unit)
    low, high = widened_limits(float(low), float(high), unit)
    least, most = _BOUNDS.get(name, (-np.inf, np.inf))
    return max(low, least), min(high, most)


def _draw_continuous(
    ax: Axes, values: np.ndarray, extent: tuple[float, float, float, float], cmap: str, limits: tuple[float, float]
) -> AxesImage:
    """The image of a continuous variable (rows, columns) on a colour scale between these limits."""
    ax.set_facecolor(adapt(_NO_VALUE))
    return ax.imshow(values, origin="lower", aspect="auto", interpolation="nearest", cmap=cmap, vmin=limits[0],
                     vmax=limits[1], extent=extent)
