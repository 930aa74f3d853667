"""All attractors of one operating point: their stroboscopic points and shares of the initial states."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from gearchaos.gears.results import unit_in
from gearchaos.plot._axes import axis_label, new_axes, widen_degenerate_axes
from gearchaos.plot._basins import ATTRACTOR_VARIABLES, attractor_colours, attractor_legend, mark_orbit
from gearchaos.plot._checks import check
from gearchaos.plot._data import keeps_data
from gearchaos.plot._phase import mark_backlash

_PLANE = ("z", "z_dot")


@keeps_data
def attractors(ds: xr.Dataset, ax: Axes | None = None, *, legend: bool = True) -> Axes:
    """Draw the stroboscopic points of every attractor in the plane of z and z'.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.attractors`.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    legend : bool
        Add a legend of the attractors with their shares of the initial states, above the axes.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.attractors`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> ax = gc.plot.attractors(gc.attractors(model, starts=16))
    >>> ax.get_xlabel()
    'displacement $z$'
    """
    sections = dict.fromkeys((f"attractor_section_{n}" for n in _PLANE), ("number", "point"))
    check(ds, "attractors", attractor=("start",), **ATTRACTOR_VARIABLES, **sections)
    ax = new_axes(ax)
    order = np.argsort(ds["attractor_period"].values == 0, kind="stable")[::-1]  # periodic orbits last, on top
    colours, x, y = attractor_colours(ds), *(ds[n].values for n in sections)
    for i in order:
        _draw(ax, x[i], y[i], colours[i], bool(ds["attractor_period"][i] > 0))
    horizontal, vertical = (axis_label(ds[f"attractor_section_{n}"], n) for n in _PLANE)
    ax.set(xlabel=horizontal, ylabel=vertical)
    widen_degenerate_axes(ax, *(unit_in(ds, n) for n in _PLANE))
    mark_backlash(ax, unit_in(ds, "z"), ax.axvline)
    if legend:
        attractor_legend(ax, ds)
    return ax


def _draw(ax: Axes, x: np.ndarray, y: np.ndarray, colour: str, periodic: bool) -> None:
    """Draw the stroboscopic points ``x``, ``y`` (points,) of one attractor."""
    if periodic:
        mark_orbit(ax, x, y, colour)
    else:
        ax.plot(x, y, "o", color=colour, markersize=1.2, markeredgewidth=0, zorder=1)
