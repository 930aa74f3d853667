"""The time history of one variable."""

from __future__ import annotations

import xarray as xr
from matplotlib.axes import Axes

from gearchaos.errors import InputError
from gearchaos.gears.results import unit_in
from gearchaos.plot._axes import axis_label, mesh_period, new_axes, widen_degenerate_axes
from gearchaos.plot._checks import check_positive
from gearchaos.plot._data import keeps_data
from gearchaos.plot._phase import check_samples
from gearchaos.plot._theme import INK, adapt


@keeps_data
def history(
    ds: xr.Dataset, name: str = "z_dot", ax: Axes | None = None, *, periods: float | None = None
) -> Axes:
    """Draw a variable over time, counted in mesh periods from the first sample.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.simulate` with samples: ``<name>`` over ``tau``.
    name : str
        Variable to show.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    periods : float, optional
        Show only this many mesh periods.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.simulate` with samples, or of `gearchaos.steady`, or has
        no variable ``name``.

    Examples
    --------
    >>> import gearchaos as gc
    >>> motion = gc.simulate(gc.MeshModel.of(q0=0.1, eps1=0.2), periods=8, transient=200, samples=64)
    >>> ax = gc.plot.history(motion, "z", periods=4)
    >>> ax.get_ylabel()
    'displacement $z$'
    """
    check_samples(ds, {"name": name})
    shown = None if periods is None else check_positive("periods", periods)
    if ds.sizes["tau"] < 2:
        raise InputError("dataset", "must have at least two samples", ds.sizes["tau"], "Call simulate with samples=64.")
    ax = new_axes(ax)
    time = (ds["tau"].values - float(ds["tau"][0])) / mesh_period(ds)
    ax.plot(time, ds[name].values, color=adapt(INK), linewidth=0.8)
    ax.set(xlabel=r"time $\tau/T$ (mesh periods)", ylabel=axis_label(ds[name], name))
    ax.set_xlim(0, shown or float(time[-1]))
    widen_degenerate_axes(ax, y=unit_in(ds, name))
    return ax
