"""Maps over a plane of two parameters: kinds of motion, response measures; and the strip of kinds over a diagram.

The function `level` is called after the level of vibration, as the paper calls V_RMS.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import Colormap
from matplotlib.figure import Figure
from matplotlib.legend import Legend

from gearchaos.errors import InputError
from gearchaos.gears.operation.results import unit_in
from gearchaos.plot._datasets import check, check_name, keeps_data
from gearchaos.plot.axes import (
    axis_label,
    cell_extent,
    draw_legend,
    label_and_limit,
    new_axes,
    plane,
    value_label,
    widened_limits,
    width_in_inches,
    wrapped,
)
from gearchaos.plot.classes import (
    MOTION_CLASSES,
    NO_CLASS,
    MotionClass,
    continuous_values,
    draw_classes,
    motion_class,
    named_classes,
    patches,
)
from gearchaos.plot.theme import adapt
from gearchaos.quantities import Rule
from gearchaos.studies.operation.factor_context import words_beside
from gearchaos.validation import check_rule, to_float

_CONTACT_NOTE = "1T may include separation of the teeth: see --colour contact"


@keeps_data
def zones(ds: xr.Dataset, ax: Axes | None = None, *, legend: bool = True, hatch: bool = False) -> Axes:
    r"""Draw the kinds of motion over a plane of two parameters.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.zones`: ``label`` and ``period`` with dims (y, x).
    ax : Axes, optional
        Where to draw; a new figure if left out.
    legend : bool
        Add a legend of the classes that occur, above the map. Over speed and torque its title says where motions of
        period 1T include separation of the teeth, which `level` shows for ``contact``.
    hatch : bool
        Tell classes apart by hatching instead of colours, for print in black and white.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.zones`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> zones = gc.zones(gc.MeshModel.of(q0=0.1), "omega=0.5:1.5:24", "eps1=0:0.3:16")
    >>> ax = gc.plot.zones(zones)
    >>> ax.get_xlabel()
    'frequency $\\omega$'
    """
    check(ds, "zones", label=2, period=2)
    ax = new_axes(ax)
    horizontal, vertical, extent = plane(ds, "label")
    classes = motion_class(ds["label"], ds["period"])
    draw_classes(classes, ax, extent, hatch=hatch)
    label_and_limit(ax, ds, horizontal, vertical)
    if legend:
        over_speed = {horizontal, vertical} == {"speed", "torque"} and "contact" in ds
        separated = over_speed and np.any((classes == 0) & (ds["contact"].values > 0))
        title = wrapped(_CONTACT_NOTE, width_in_inches(ax)) if separated else None
        class_legend(ax, classes, hatch=hatch, title=title, title_fontsize="small")
    return ax


def class_legend(
    host: Axes | Figure, index: np.ndarray, classes: Sequence[MotionClass] = MOTION_CLASSES, *,
    fit_to: Axes | None = None, hatch: bool = False, **options: Any,
) -> Legend:
    """A legend of the classes that occur in ``index``.

    Parameters
    ----------
    host : Axes or Figure
        Where the legend is drawn.
    index : array of int
        Class of each cell, an index into ``classes``.
    classes : sequence of MotionClass
        All classes.
    fit_to : Axes, optional
        The Axes whose width limits that of the legend, if ``host`` is a strip above it.
    hatch : bool
        Whether the cells are hatched instead of coloured.
    options
        Passed to ``host.legend``.

    Returns
    -------
    Legend

    Examples
    --------
    >>> import gearchaos as gc
    >>> zones = gc.zones(gc.MeshModel.of(q0=0.1), "omega=0.5:1.5:24", "eps1=0:0.3:16")
    >>> ax = gc.plot.zones(zones, legend=False)
    >>> legend = gc.plot.class_legend(ax, gc.plot.motion_class(zones.label, zones.period), loc="upper right")
    >>> legend.get_texts()[0].get_text()
    '1T'
    """
    present = {int(i): (classes[i].colour, classes[i].name) for i in np.unique(index) if i != NO_CLASS}
    return draw_legend(host, patches(present, bool(np.any(index == NO_CLASS)), hatch), fit_to, **options)


@keeps_data
def motion_strip(ds: xr.Dataset, ax: Axes, *, legend: bool = True) -> Axes:
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
    >>> ax = gc.plot.response(diagram, "v_rms", strip=False)
    >>> strip = gc.plot.motion_strip(diagram, ax)
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


_NO_VALUE = "0.75"  # colour of cells without a value
_BOUNDS = {"contact_fraction": (0.0, 1.0)}  # variables that have a least and a greatest possible value


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
    if not isinstance(cmap, Colormap) and cmap not in list(colormaps):
        raise InputError("cmap", "must be a colormap of matplotlib", cmap, "E.g. 'viridis' or 'magma'.")
    percent, classes = to_float("clip", clip), named_classes(ds, name)
    check_rule("clip", percent, Rule(lambda v: 0 <= v <= 100, "must be a percentage, from 0 to 100"), clip)
    if hatch and not classes:
        raise InputError("hatch", "must be left out for a variable without classes", name)
    ax = new_axes(ax)
    horizontal, vertical, extent = plane(ds, name)
    if classes:
        draw_classes(classes[0], ax, extent, classes[1], hatch=hatch)
    else:
        values = continuous_values(ds, name)
        low, high = colour_limits(name, values[np.isfinite(values)], percent, unit_in(ds, name))
        ax.set_facecolor(adapt(_NO_VALUE))
        image = ax.imshow(values, origin="lower", aspect="auto", interpolation="nearest", cmap=cmap, vmin=low,
                          vmax=high, extent=extent)
    label_and_limit(ax, ds, horizontal, vertical)
    if colorbar and classes:
        one = " of one motion per cell" if name == "contact" else ""  # in another one the teeth may separate
        title = ", ".join([axis_label(ds[name], name) + one, *words_beside(ds, name)])
        class_legend(ax, *classes, hatch=hatch, title=wrapped(title, width_in_inches(ax)))
    elif colorbar:
        clipped = bool(np.any(values > image.norm.vmax))
        label = value_label(ds, name, ax)
        ax.figure.colorbar(image, ax=ax, extend="max" if clipped else "neither", pad=0.02, label=label)
    return ax


def colour_limits(name: str, known: np.ndarray, clip: float, unit: float) -> tuple[float, float]:
    """Limits of the colour scale of a variable with the finite values ``known`` (N,); ``clip`` percent lie above it.

    If all values are equal the scale extends to both sides of them, by a share of them or of ``unit``; that of a share
    of the time not beyond 0 and 1.
    """
    low, high = (np.min(known), np.percentile(known, 100 - clip)) if known.size else (0.0, unit)
    low, high = widened_limits(float(low), float(high), unit)
    least, most = _BOUNDS.get(name, (-np.inf, np.inf))
    return max(low, least), min(high, most)
