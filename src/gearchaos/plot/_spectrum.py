"""The amplitude spectrum in orders of the mesh frequency, by FFT over whole periods: no leakage, no window."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from gearchaos.plot._axes import axis_label, mesh_period, new_axes
from gearchaos.plot._phase import INK


def spectrum(ds: xr.Dataset, name: str = "z_dot", ax: Axes | None = None, *, orders: float = 6.0) -> Axes:
    """Draw the amplitude spectrum of a variable on a logarithmic scale.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.simulate` with samples: ``<name>`` over ``tau``.
    name : str
        Variable to show.
    orders : float
        Show orders of the mesh frequency up to this one.

    Returns
    -------
    Axes
    """
    ax = new_axes(ax)
    order, amplitude = amplitudes(ds, name)
    shown = order <= orders
    floor = max(float(amplitude[shown].max()) * 1e-7, 1e-300)
    ax.semilogy(order[shown], np.maximum(amplitude[shown], floor), color=INK, linewidth=0.7)
    ax.set(xlabel="frequency in mesh orders $f/f_z$", ylabel=f"amplitude of {axis_label(ds[name], name)}")
    ax.set_xlim(0, orders)
    ax.set_xticks(np.arange(int(orders) + 1))
    ax.grid(axis="x", color="0.9", linewidth=0.6)
    return ax


def amplitudes(ds: xr.Dataset, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Orders of the mesh frequency and one-sided amplitudes of a variable, from its whole mesh periods."""
    tau, values = ds["tau"].values, ds[name].values
    per_period = round(mesh_period(ds) / (tau[1] - tau[0]))
    periods = len(values) // per_period
    spectrum_ = np.fft.rfft(values[: periods * per_period]) / (periods * per_period)
    size = np.abs(spectrum_)
    size[1:] *= 2
    return np.arange(len(size)) / periods, size
