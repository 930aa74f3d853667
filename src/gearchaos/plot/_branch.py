"""The stroboscopic points of a branch of periodic orbits over its parameter, alone or over a bifurcation diagram."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from gearchaos.plot._axes import axis_label, new_axes
from gearchaos.plot._branch_lines import check_branch, draw_lines, stability_handles
from gearchaos.plot._checks import check_name
from gearchaos.plot._data import keeps_data
from gearchaos.plot._legends import legend as draw_legend
from gearchaos.plot._portrait import first_coordinate
from gearchaos.studies.branch_lines import axis_of, positions


@keeps_data
def branch(ds: xr.Dataset, name: str | None = None, ax: Axes | None = None, *, legend: bool = True) -> Axes:
    """Draw the stroboscopic points of a branch: n lines for orbits of period n, solid if stable, dashed if not.

    In an Axes that `bifurcation` has drawn, the lines lie over the diagram, whose limits are kept.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.branch`: ``section_<name>`` with dims (point, cycle).
    name : str
        Coordinate to show; x1, or z of a single model, if left out.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    legend : bool
        Add a legend of the lines, unless the Axes has a diagram.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.branch`, or has no coordinate ``name``.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> ax = gc.plot.branch(gc.branch(model, "omega=0.5:0.9"), "z")
    >>> ax.get_ylabel()
    'displacement $z$'
    """
    check_branch(ds)
    name = name or first_coordinate(ds)
    check_name(ds, "name", name, ("point", "cycle"), "section_")
    ax, section, axis = new_axes(ax), ds[f"section_{name}"], axis_of(ds)
    over_diagram = bool(ax.images)
    limits = ax.get_xlim(), ax.get_ylim()
    draw_lines(ds, ax, section.values, _at_events(ds, name))
    if over_diagram:
        ax.set(xlim=limits[0], ylim=limits[1])
        return ax
    ax.set(xlabel=axis_label(ds[axis], axis), ylabel=axis_label(section, name, beside=ds[axis]))
    if legend:
        draw_legend(ax, stability_handles(ds))
    return ax


def _at_events(ds: xr.Dataset, name: str) -> np.ndarray:
    """The stroboscopic points of the orbits at events, (E, n).

    A result has the first one of each; the others are interpolated between the points before and after the event, at
    the share of the step at which the first one is.
    """
    section, first = ds[f"section_{name}"].values, ds[f"event_section_{name}"].values
    row = {position: i for i, position in enumerate(positions(ds).tolist())}
    out = np.full((len(first), section.shape[1]), np.nan)
    for i, before in enumerate(ds["event_point"].values.tolist()):
        ends = [section[row[position]] for position in (before, before + 1) if position in row]
        if ends:
            a, b = ends[0], ends[-1]
            step = b[0] - a[0]
            out[i] = a + (np.clip((first[i] - a[0]) / step, 0, 1) * (b - a) if step else 0)
            out[i, 0] = first[i]
    return out
