"""The phase trajectory: velocity against displacement."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import xarray as xr
from matplotlib.axes import Axes

from gearchaos.gears.results import unit_in
from gearchaos.plot._axes import axis_label, new_axes, widen_degenerate_axes
from gearchaos.plot._checks import check, check_name, check_positive
from gearchaos.plot._data import keeps_data
from gearchaos.plot._theme import INK, STROBE, adapt


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
    check_samples(ds, {"x": x, "y": y})
    if section:
        for field, name in (("x", x), ("y", y)):
            check_name(ds, field, name, ("period",), "section_")
    linewidth = check_positive("linewidth", linewidth)
    ax = new_axes(ax)
    ax.plot(ds[x].values, ds[y].values, color=adapt(INK), linewidth=linewidth, rasterized=ds.sizes["tau"] > 20_000)
    if section:
        ax.plot(
            ds[f"section_{x}"].values, ds[f"section_{y}"].values, "o", color=adapt(STROBE), markersize=2.6,
            markeredgewidth=0, zorder=3,
        )
    ax.set(xlabel=axis_label(ds[x], x), ylabel=axis_label(ds[y], y))
    widen_degenerate_axes(ax, unit_in(ds, x), unit_in(ds, y))
    for name, line in ((x, ax.axvline), (y, ax.axhline)):
        if name == "z":
            mark_backlash(ax, unit_in(ds, "z"), line)
    return ax


def check_samples(ds: xr.Dataset, names: dict[str, str]) -> None:
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
