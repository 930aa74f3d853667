"""The stroboscopic portrait: the state once per mesh period."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from gearchaos.gears.results import unit_in
from gearchaos.plot._axes import axis_label, new_axes, widen_degenerate_axes
from gearchaos.plot._checks import check, check_name, check_positive
from gearchaos.plot._data import keeps_data
from gearchaos.plot._theme import INK, adapt

_FEW = 200
"""Up to this number of points markers have the largest diameter."""

_LARGEST, _SMALLEST = 3.5, 0.55
"""Largest and smallest diameter of markers, in typographic points."""


@keeps_data
def portrait(
    ds: xr.Dataset, x: str | None = None, y: str | None = None, ax: Axes | None = None, *, size: float | None = None
) -> Axes:
    r"""Draw the stroboscopic points in a plane of two coordinates, by default a displacement and its velocity.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.simulate`: ``section_<x>`` and ``section_<y>`` over ``period``.
    x, y : str
        Coordinates; ``x`` is x1, or z of a single model, if left out, and ``y`` is ``<x>_dot``.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    size : float, optional
        Diameter of the markers in points; by default it decreases with the number of distinct points.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.simulate`, or has no such coordinate.

    Examples
    --------
    >>> import gearchaos as gc
    >>> motion = gc.simulate(gc.MeshModel.of(q0=0.1, eps1=0.2), periods=8, transient=200, samples=64)
    >>> ax = gc.plot.portrait(motion, "z")
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('displacement $z$', 'velocity $\\dot{z}$')
    """
    check(ds, "simulate", period=("period",))
    x = x or first_coordinate(ds)
    names = (x, y or f"{x}_dot")
    for field, name in zip("xy", names, strict=True):
        check_name(ds, field, name, ("period",), "section_")
    ax, units = new_axes(ax), [unit_in(ds, n) for n in names]
    horizontal, vertical = (ds[f"section_{n}"] for n in names)
    default = _size(distinct(horizontal.values / units[0], vertical.values / units[1]))
    size = default if size is None else check_positive("size", size)
    ax.plot(horizontal.values, vertical.values, "o", color=adapt(INK), markersize=size, markeredgewidth=0,
            rasterized=True)
    ax.set(xlabel=axis_label(horizontal, names[0]), ylabel=axis_label(vertical, names[1]))
    widen_degenerate_axes(ax, *units)
    return ax


def _size(count: int) -> float:
    """Diameter of markers such that all of them together have a constant area; within limits."""
    return float(np.clip(_LARGEST * np.sqrt(_FEW / count), _SMALLEST, _LARGEST))


def first_coordinate(ds: xr.Dataset) -> str:
    """The coordinate that is shown by default: x1, or z for a single model."""
    return "x1" if "section_x1" in ds else "z"


def distinct(x: np.ndarray, y: np.ndarray) -> int:
    """Number of points that differ by more than 1e-4 of their spread; an orbit repeats its points.

    Parameters
    ----------
    x, y : (points,)
        Coordinates in half backlashes Δ, velocities in Δ ω0.
    """
    points = np.stack([x, y], axis=1)
    spread = np.maximum(np.ptp(points, axis=0), 1e-9)
    return len(np.unique(np.round((points - points[0]) / spread * 1e4), axis=0))
