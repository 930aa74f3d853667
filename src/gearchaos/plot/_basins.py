"""Basins of attraction over a plane of initial conditions, and the attractors of one operating point."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap, to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.legend import Legend

from gearchaos.gears.results import unit_in
from gearchaos.plot._axes import axis_label, cell_extent, label_and_limit, new_axes, plane, widen_degenerate_axes
from gearchaos.plot._checks import Dims, check
from gearchaos.plot._classes import MOTION_CLASSES, NOT_COMPUTED_STYLE, motion_class
from gearchaos.plot._data import keeps_data
from gearchaos.plot._legends import draw_hatches, patches, shade
from gearchaos.plot._legends import legend as draw_legend
from gearchaos.plot._motions import mark_backlash
from gearchaos.plot._theme import adapt_style

_SUBHARMONIC = [c.name for c in MOTION_CLASSES].index("other sub-harmonic")
_SUBHARMONIC_COLOURS = ("#f28cc0", "#a971e5", "#b8860b", "#7aa81e", "#00a7b5", "#8c564b")
"""Colours of the orbits of the class "other sub-harmonic", one for each period."""

ATTRACTOR_VARIABLES: dict[str, Dims] = dict.fromkeys(
    ("attractor_label", "attractor_period", "attractor_fraction"), ("number",))
"""Variables that hold one value for each attractor, with their dimensions."""

UNDECIDED = "#4d4d4d"
"""Colour of initial states whose motion is undecided."""

_UNDECIDED_INDEX = -1
"""Value of ``attractor`` for an undecided motion; smaller values are cells that are not computed."""


@keeps_data
def basins(
    ds: xr.Dataset, ax: Axes | None = None, *, legend: bool = True, points: bool = True, hatch: bool = False
) -> Axes:
    """Draw the basins of attraction over a plane of initial conditions.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.basins`: ``attractor`` with dims (y, x) and the variables of its attractors.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    legend : bool
        Add a legend of the attractors with their shares of the plane, above the map.
    points : bool
        Mark the stroboscopic points of periodic attractors.
    hatch : bool
        Tell basins apart by hatching instead of colours, for print in black and white.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.basins`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> ax = gc.plot.basins(gc.basins(model, "z=-2:2:20", "z_dot=-1:1:20"))
    >>> ax.get_xlabel()
    'displacement $z$'
    """
    check(ds, "basins", attractor=2, **ATTRACTOR_VARIABLES)
    ax = new_axes(ax)
    horizontal, vertical = plane(ds, "attractor")
    colours = [shade(i) if hatch else colour for i, colour in enumerate(attractor_colours(ds))]
    index, extent = ds["attractor"].values, cell_extent(ds[horizontal].values, ds[vertical].values)
    if np.any(index < _UNDECIDED_INDEX):
        ax.patch.set(**adapt_style(NOT_COMPUTED_STYLE))
    ax.imshow(
        np.ma.masked_less(index, _UNDECIDED_INDEX), origin="lower", aspect="auto", interpolation="nearest",
        interpolation_stage="rgba", cmap=ListedColormap([UNDECIDED, *colours]), vmin=-1.5, vmax=len(colours) - 0.5,
        extent=extent,
    )
    if hatch:
        draw_hatches(index, ax, extent)
    if points:
        _mark_orbits(ds, ax, horizontal, vertical, colours)
    label_and_limit(ax, ds, horizontal, vertical)
    if legend:
        attractor_legend(ax, ds, hatch=hatch)
    return ax


def attractor_names(ds: xr.Dataset) -> list[str]:
    """A name for every attractor: its kind of motion, with primes to tell apart those of the same kind.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.basins` or `gearchaos.attractors`, with N attractors.

    Returns
    -------
    list of str
        N names.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> gc.plot.attractor_names(gc.attractors(model, starts=16))
    ['1T', '1T′']
    """
    kinds = motion_class(ds["attractor_label"], ds["attractor_period"])
    periods = ds["attractor_period"].values
    plain = [f"{n}T" if k <= _SUBHARMONIC else MOTION_CLASSES[k].name for k, n in zip(kinds, periods, strict=True)]
    return [name + "′" * plain[:i].count(name) for i, name in enumerate(plain)]


def attractor_colours(ds: xr.Dataset) -> list[str]:
    """A colour for every attractor: that of its kind of motion, in other shades if several are of the same kind."""
    kinds = motion_class(ds["attractor_label"], ds["attractor_period"])
    periods = ds["attractor_period"].values
    others = sorted({int(n) for k, n in zip(kinds, periods, strict=True) if k == _SUBHARMONIC})
    colours: list[str] = []
    for i, (kind, n) in enumerate(zip(kinds, periods, strict=True)):
        base = MOTION_CLASSES[kind].colour
        if kind == _SUBHARMONIC:
            base = _SUBHARMONIC_COLOURS[others.index(int(n)) % len(_SUBHARMONIC_COLOURS)]
        earlier = sum(kinds[j] == kind and periods[j] == n for j in range(i))
        colours.append(_shade(base, earlier))
    return colours


def _shade(colour: str, step: int) -> str:
    """A shade of a colour: the colour at step 0, then darker for light colours and lighter for dark ones."""
    target = 0.0 if sum(to_rgb(colour)) > 1.8 else 1.0
    red, green, blue = (c + (target - c) * (1 - 0.55**step) for c in to_rgb(colour))
    return to_hex((red, green, blue))


def _mark_orbits(ds: xr.Dataset, ax: Axes, horizontal: str, vertical: str, colours: list[str]) -> None:
    """Mark the points of every periodic attractor."""
    names = [f"attractor_section_{n}" for n in (horizontal, vertical)]
    if not all(n in ds for n in names):
        return
    for x, y, colour, period in zip(*(ds[n].values for n in names), colours, ds["attractor_period"], strict=True):
        if period > 0:
            mark_orbit(ax, x, y, colour)


def mark_orbit(ax: Axes, x: np.ndarray, y: np.ndarray, colour: str) -> None:
    """Mark the points ``x``, ``y`` (points,) of one orbit in its colour, with a visible outline."""
    ax.plot(x, y, "o", markersize=4.6, markerfacecolor="white", markeredgewidth=0)
    ax.plot(x, y, "o", markersize=3.4, markerfacecolor=colour, markeredgecolor="black", markeredgewidth=0.7)


def attractor_legend(host: Axes | Figure, ds: xr.Dataset, *, hatch: bool = False, **options: Any) -> Legend:
    """Add a legend of the attractors with their shares of the initial states.

    Parameters
    ----------
    host : Axes or Figure
        Where the legend is drawn.
    ds : Dataset
        From `gearchaos.basins` or `gearchaos.attractors`.
    hatch : bool
        Whether the basins are hatched instead of coloured.
    options
        Passed to ``host.legend``.

    Returns
    -------
    Legend

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> basins = gc.basins(model, "z=-2:2:20", "z_dot=-1:1:20")
    >>> ax = gc.plot.basins(basins, legend=False)
    >>> legend = gc.plot.attractor_legend(ax, basins, loc="upper right")
    >>> len(legend.get_texts())
    2
    """
    names, shares = attractor_names(ds), ds["attractor_fraction"].values
    entries = {i: (c, f"{n} ({_percent(s)})")
               for i, (c, n, s) in enumerate(zip(attractor_colours(ds), names, shares, strict=True))}
    index = ds["attractor"].values
    share = float((index[index >= _UNDECIDED_INDEX] < 0).mean())
    undecided = patches({0: (UNDECIDED, f"undecided ({_percent(share)})")}, not_computed=False) if share > 0 else []
    not_computed = bool(np.any(index < _UNDECIDED_INDEX))
    return draw_legend(host, [*patches(entries, False, hatch), *undecided, *patches({}, not_computed)], **options)


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if share >= 0.0995 else f"{100 * share:.1f} %" if share >= 0.001 else "< 0.1 %"


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
