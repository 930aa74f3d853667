"""The zones map: the kind of motion in each cell of a parameter plane."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.legend import Legend

from gearchaos.plot._axes import cell_extent, label_and_limit, new_axes, plane, wrapped
from gearchaos.plot._checks import check
from gearchaos.plot._classes import MOTION_CLASSES, NO_CLASS, NOT_COMPUTED_STYLE, MotionClass, motion_class
from gearchaos.plot._data import keeps_data
from gearchaos.plot._hatching import draw_hatches, shade
from gearchaos.plot._legends import legend as draw_legend
from gearchaos.plot._legends import patches
from gearchaos.plot._theme import adapt_style

CONTACT_NOTE = "1T may include separation of the teeth: see --colour contact"
"""Title of the legend of a map of given gears over speed and torque with such motions."""


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
    horizontal, vertical = plane(ds, "label")
    classes = motion_class(ds["label"], ds["period"])
    draw_classes(classes, ax, cell_extent(ds[horizontal].values, ds[vertical].values), hatch=hatch)
    label_and_limit(ax, ds, horizontal, vertical)
    if legend:
        figure, note = ax.get_figure(root=True), _contact_note(ds, horizontal, vertical)
        assert figure is not None
        title = None if note is None else wrapped(note, ax.bbox.width / figure.dpi)
        class_legend(ax, classes, hatch=hatch, title=title, title_fontsize="small")
    return ax


def _contact_note(ds: xr.Dataset, horizontal: str, vertical: str) -> str | None:
    """The note that motions of period 1T lose contact somewhere in a map over speed and torque; None otherwise."""
    if {horizontal, vertical} != {"speed", "torque"} or "contact" not in ds:
        return None
    once = motion_class(ds["label"], ds["period"]) == 0
    return CONTACT_NOTE if np.any(once & (ds["contact"].values > 0)) else None


def draw_classes(
    index: np.ndarray, ax: Axes, extent: tuple[float, float, float, float],
    classes: Sequence[MotionClass] = MOTION_CLASSES, *, hatch: bool = False,
) -> None:
    """Colour or hatch cells by their class, ``index`` (rows, columns) into ``classes``; those not computed are striped.
    """
    colours = [shade(i) if hatch else c.colour for i, c in enumerate(classes)]
    ax.imshow(
        np.ma.masked_equal(index, NO_CLASS), origin="lower", aspect="auto", interpolation="nearest",
        cmap=ListedColormap(colours), vmin=-0.5, vmax=len(classes) - 0.5,
        extent=extent, interpolation_stage="rgba",
    )
    if hatch:
        draw_hatches(index, ax, extent)
    if np.any(index == NO_CLASS):
        ax.patch.set(**adapt_style(NOT_COMPUTED_STYLE))


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
