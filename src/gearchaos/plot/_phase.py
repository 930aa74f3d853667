"""The phase trajectory: velocity over displacement."""

from __future__ import annotations

import xarray as xr
from matplotlib.axes import Axes

from gearchaos.plot._axes import axis_label, new_axes

INK = "#1d2b53"
STROBE = "#c03a1e"


def phase(
    ds: xr.Dataset, x: str = "z", y: str | None = None, ax: Axes | None = None, *, section: bool = True,
    linewidth: float = 0.8,
) -> Axes:
    """Draw a trajectory in a plane of two coordinates, by default one and its velocity.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.simulate` with samples: ``<x>`` and ``<y>`` over ``tau``.
    x, y : str
        Coordinates; ``y`` is ``<x>_dot`` if left out. The contact boundaries z = ±1 are drawn where z is.
    section : bool
        Mark the stroboscopic points.
    linewidth : float
        In points; thinner suits long chaotic motions.

    Returns
    -------
    Axes
    """
    ax, y = new_axes(ax), y or f"{x}_dot"
    ax.plot(ds[x].values, ds[y].values, color=INK, linewidth=linewidth, rasterized=ds.sizes["tau"] > 20_000)
    if section:
        ax.plot(
            ds[f"section_{x}"].values, ds[f"section_{y}"].values, "o", color=STROBE, markersize=2.6,
            markeredgewidth=0, zorder=3,
        )
    ax.set(xlabel=axis_label(ds[x], x), ylabel=axis_label(ds[y], y))
    _boundaries(ax, x, ax.axvline)
    _boundaries(ax, y, ax.axhline)
    return ax


def _boundaries(ax: Axes, name: str, line) -> None:
    """The two contact boundaries, without stretching the axes to them."""
    if name == "z":
        limits = ax.get_xlim(), ax.get_ylim()
        for z in (-1.0, 1.0):
            line(z, color="0.45", linewidth=0.7, linestyle=(0, (4, 3)), zorder=0)
        ax.set(xlim=limits[0], ylim=limits[1])
