"""The amplitude spectrum in orders of the mesh frequency, by FFT over whole periods without window."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from gearchaos.dynamics import spectrum as spectra
from gearchaos.errors import InputError
from gearchaos.gears.results import unit_in
from gearchaos.plot._axes import axis_label, mesh_period, new_axes
from gearchaos.plot._checks import check_positive
from gearchaos.plot._data import keeps_data
from gearchaos.plot._phase import check_samples
from gearchaos.plot._theme import INK, adapt

FLOOR = 1e-7
"""Smallest amplitude shown, relative to the largest one."""

_ABSOLUTE_FLOOR = 1e-30
"""Smallest amplitude shown of a constant variable, in units of that variable."""

_MAX_ORDERS = 1000


@keeps_data
def spectrum(ds: xr.Dataset, name: str = "z_dot", ax: Axes | None = None, *, orders: float = 6.0) -> Axes:
    """Draw the amplitude spectrum of a variable on a logarithmic scale.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.simulate` with samples: ``<name>`` over ``tau``.
    name : str
        Variable to show.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    orders : float
        Show orders of the mesh frequency up to this one.

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
    >>> ax = gc.plot.spectrum(motion)
    >>> ax.get_xlabel()
    'frequency in mesh orders $f/f_z$'
    """
    check_samples(ds, {"name": name})
    orders = check_positive("orders", orders, _MAX_ORDERS)
    order, amplitude = amplitudes(ds, name)
    ax, shown = new_axes(ax), order <= orders
    floor = max(float(amplitude[shown].max()) * FLOOR, _ABSOLUTE_FLOOR * unit_in(ds, name))
    ax.semilogy(order[shown], np.maximum(amplitude[shown], floor), color=adapt(INK), linewidth=0.7)
    ax.set(xlabel="frequency in mesh orders $f/f_z$", ylabel=f"amplitude of {axis_label(ds[name], name)}")
    ax.set_xlim(0, orders)
    ax.xaxis.set_major_locator(MaxNLocator(nbins=12, integer=True))
    ax.grid(axis="x", color=adapt("0.9"), linewidth=0.6)
    return ax


def amplitudes(ds: xr.Dataset, name: str) -> tuple[np.ndarray, np.ndarray]:
    """One-sided amplitude spectrum of a variable, over the largest whole number of mesh periods.

    Returns
    -------
    orders, amplitudes : (N,) arrays of float
        Frequencies in orders of the mesh frequency; amplitudes in the unit of the variable.
    """
    tau, values = ds["tau"].values, ds[name].values
    per_period = round(mesh_period(ds) / (tau[1] - tau[0])) if len(tau) > 1 else 0
    periods = len(values) // per_period if per_period > 1 else 0
    if periods == 0:
        raise InputError("dataset", "must have at least two samples per mesh period, over at least one mesh period",
                         len(tau), "Call simulate with samples=64.")
    return spectra.amplitudes(values[: periods * per_period], periods)
