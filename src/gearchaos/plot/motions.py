"""One motion: its phase trajectory, stroboscopic points, time history and spectrum, and all four in a figure.

The spectrum is in orders of the mesh frequency, by FFT over whole periods without window.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from matplotlib import rcParams, rcParamsDefault
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from gearchaos.dynamics import time_series as spectra
from gearchaos.errors import InputError
from gearchaos.gears.operation.results import unit_in
from gearchaos.plot._datasets import check, check_name, check_positive, keeps_data
from gearchaos.plot.axes import axis_label, mesh_period, new_axes, widen_degenerate_axes
from gearchaos.plot.theme import INK, STROBE, adapt


@keeps_data
def phase(
    ds: xr.Dataset, x: str = "z", y: str | None = None, ax: Axes | None = None, *, section: bool = True,
    linewidth: float = 0.8,
) -> Axes:
    r"""Draw a trajectory in a plane of two coordinates, by default a displacement and its velocity.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.simulate` with samples: ``<x>`` and ``<y>`` over ``tau``.
    x, y : str
        Coordinates; ``y`` is ``<x>_dot`` if left out. Along an axis of z the ends of the backlash are marked.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    section : bool
        Mark the stroboscopic points.
    linewidth : float
        In points; long chaotic motions need thin lines.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.simulate` with samples, or of `gearchaos.steady`, or has
        no such coordinate.

    Examples
    --------
    >>> import gearchaos as gc
    >>> motion = gc.simulate(gc.MeshModel.of(q0=0.1, eps1=0.2), periods=8, transient=200, samples=64)
    >>> ax = gc.plot.phase(motion)
    >>> ax.get_xlabel(), ax.get_ylabel()
    ('displacement $z$', 'velocity $\\dot{z}$')
    """
    y = y or f"{x}_dot"
    _check_samples(ds, {"x": x, "y": y})
    if section:
        for field, name in (("x", x), ("y", y)):
            check_name(ds, field, name, ("period",), "section_")
    linewidth = check_positive("linewidth", linewidth)
    ax = new_axes(ax)
    ax.plot(ds[x].values, ds[y].values, color=adapt(INK), linewidth=linewidth, rasterized=ds.sizes["tau"] > 20_000)
    if section:
        ax.plot(ds[f"section_{x}"].values, ds[f"section_{y}"].values, "o", color=adapt(STROBE), markersize=2.6,
                markeredgewidth=0, zorder=3)
    ax.set(xlabel=axis_label(ds[x], x), ylabel=axis_label(ds[y], y))
    widen_degenerate_axes(ax, unit_in(ds, x), unit_in(ds, y))
    for name, line in ((x, ax.axvline), (y, ax.axhline)):
        if name == "z":
            mark_backlash(ax, unit_in(ds, "z"), line)
    return ax


def _check_samples(ds: xr.Dataset, names: dict[str, str]) -> None:
    """Raise `InputError` unless a Dataset has samples over time of these variables; ``names`` by argument name."""
    check(ds, "simulate with samples", tau=("tau",))
    for field, name in names.items():
        check_name(ds, field, name, ("tau",))


def mark_backlash(ax: Axes, half_backlash: float, line: Callable[..., Any]) -> None:
    """Draw both ends of the backlash, by ``line`` (``ax.axvline`` or ``ax.axhline``); the limits of the axes stay."""
    limits = ax.get_xlim(), ax.get_ylim()
    for z in (-half_backlash, half_backlash):
        line(z, color=adapt("0.45"), linewidth=0.7, linestyle=(0, (4, 3)), zorder=0)
    ax.set(xlim=limits[0], ylim=limits[1])


_FEW = 200  # up to this number of points markers have the largest diameter
_LARGEST, _SMALLEST = 3.5, 0.55  # diameter of markers, in typographic points


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
    if size is None:  # the area of all markers together is constant, within limits
        count = distinct(horizontal.values / units[0], vertical.values / units[1])
        size = float(np.clip(_LARGEST * np.sqrt(_FEW / count), _SMALLEST, _LARGEST))
    else:
        size = check_positive("size", size)
    ax.plot(horizontal.values, vertical.values, "o", color=adapt(INK), markersize=size, markeredgewidth=0,
            rasterized=True)
    ax.set(xlabel=axis_label(horizontal, names[0]), ylabel=axis_label(vertical, names[1]))
    widen_degenerate_axes(ax, *units)
    return ax


def first_coordinate(ds: xr.Dataset) -> str:
    """The coordinate that is shown by default: x1, or z for a single model."""
    return "x1" if "section_x1" in ds else "z"


def distinct(x: np.ndarray, y: np.ndarray) -> int:
    """Number of points (N,) that differ by more than 1e-4 of their spread; an orbit repeats its points.

    Coordinates are in half backlashes Δ, velocities in Δ ω0.
    """
    points = np.stack([x, y], axis=1)
    spread = np.maximum(np.ptp(points, axis=0), 1e-9)
    return len(np.unique(np.round((points - points[0]) / spread * 1e4), axis=0))


@keeps_data
def history(ds: xr.Dataset, name: str = "z_dot", ax: Axes | None = None, *, periods: float | None = None) -> Axes:
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
    _check_samples(ds, {"name": name})
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


FLOOR = 1e-7  # smallest amplitude shown, relative to the largest one
_ABSOLUTE_FLOOR = 1e-30  # smallest amplitude shown of a constant variable, in units of that variable
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
    _check_samples(ds, {"name": name})
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

    The result is frequencies in orders of the mesh frequency, and amplitudes in the unit of the variable, both (N,).
    """
    tau, values = ds["tau"].values, ds[name].values
    per_period = round(mesh_period(ds) / (tau[1] - tau[0])) if len(tau) > 1 else 0
    periods = len(values) // per_period if per_period > 1 else 0
    if periods == 0:
        raise InputError("dataset", "must have at least two samples per mesh period, over at least one mesh period",
                         len(tau), "Call simulate with samples=64.")
    return spectra.amplitudes(values[: periods * per_period], periods)


HISTORY_PERIODS = 12  # most mesh periods in the time history
_HEIGHT = 0.75  # height of a new figure over its width
_FULL_SIZE = np.array([6.4, 4.8])
"""Width and height in inches of the smallest figure with a font of full size, where that is matplotlib's default."""

_SMALLEST_SCALE = 0.5  # of the font, in smaller figures
_LONG = 64  # trajectories of more mesh periods than this are drawn with thin lines
_LINE_WIDTH, _THIN_LINE_WIDTH = 0.8, 0.25  # in points


@keeps_data
def motion(ds: xr.Dataset, *, title: str = "", figure: Figure | None = None) -> Figure:
    """Draw four views of the relative motion z; the ends of the backlash are marked in the phase plane.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.simulate` with samples, or `gearchaos.steady`.
    title : str
        Title of the figure.
    figure : Figure, optional
        Where to draw; a new pyplot figure if left out.

    Returns
    -------
    Figure

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.simulate` with samples, or of `gearchaos.steady`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> motion = gc.simulate(gc.MeshModel.of(q0=0.1, eps1=0.2), periods=8, transient=200, samples=64)
    >>> figure = gc.plot.motion(motion, title="ε₁ = 0.2")
    >>> len(figure.axes)
    4
    """
    _check_samples(ds, {})
    default = rcParamsDefault["figure.figsize"]
    if figure is None:
        wide, high = rcParams["figure.figsize"]
        # without a style larger than a single Axes
        size = (9.6, 7.2) if [wide, high] == list(default) else (wide, _HEIGHT * wide)
        figure = plt.figure(figsize=size, layout="constrained")
    full = _FULL_SIZE * rcParams["font.size"] / rcParamsDefault["font.size"]
    scale = float(np.clip(min(figure.get_size_inches() / full), _SMALLEST_SCALE, 1))
    count = ds.sizes["period"]
    with matplotlib.rc_context({"font.size": rcParams["font.size"] * scale}):
        axes = figure.subplots(2, 2).ravel()
        history(ds, "z", axes[0], periods=min(HISTORY_PERIODS, count))
        phase(ds, "z", ax=axes[1], linewidth=_LINE_WIDTH if count <= _LONG else _THIN_LINE_WIDTH)
        portrait(ds, "z", ax=axes[2])
        spectrum(ds, "z_dot", axes[3])
        views = ("Time history", "Phase trajectory", "Stroboscopic portrait", "Spectrum")
        for ax, name in zip(axes, views, strict=True):
            ax.set_title(name, fontsize="medium")
        figure.suptitle(title)
    return figure
