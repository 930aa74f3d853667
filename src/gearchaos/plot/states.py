"""In the plane of initial states: basins of attraction, attractors, and the manifolds of saddles."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D

from gearchaos.datasets import with_primes
from gearchaos.errors import InputError
from gearchaos.gears.operation.results import unit_in
from gearchaos.plot._datasets import Dims, check, keeps_data
from gearchaos.plot.axes import (
    Overlay,
    axis_label,
    draw_legend,
    label_and_limit,
    new_axes,
    plane,
    side_legend,
    widen_degenerate_axes,
)
from gearchaos.plot.classes import (
    MOTION_CLASSES,
    NO_CLASS,
    MotionClass,
    draw_classes,
    draw_hatches,
    look,
    motion_class,
    patches,
)
from gearchaos.plot.motions import mark_backlash
from gearchaos.plot.theme import EVENT_COLOURS

UNDECIDED = "#4d4d4d"  # colour of initial states whose motion is undecided
_UNDECIDED_INDEX = -1  # ``attractor`` of an undecided motion; smaller values are cells that are not computed
_PLANE = ("z", "z_dot")
_ATTRACTOR_VARIABLES: dict[str, Dims] = dict.fromkeys(
    ("attractor_label", "attractor_period", "attractor_fraction"), ("number",))
_SUBHARMONIC = [c.name for c in MOTION_CLASSES].index("other sub-harmonic")
_SUBHARMONIC_COLOURS = ("#f28cc0", "#a971e5", "#b8860b", "#7aa81e", "#00a7b5", "#8c564b")
"""Colours of the orbits of the class "other sub-harmonic", one for each period."""


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
    check(ds, "basins", attractor=2, **_ATTRACTOR_VARIABLES)
    ax = new_axes(ax)
    horizontal, vertical, extent = plane(ds, "attractor")
    colours, index = attractor_colours(ds), ds["attractor"].values
    if hatch:
        colours = [look(i)[0] for i in range(len(colours))]
    cells = np.where(index < _UNDECIDED_INDEX, NO_CLASS, np.where(index < 0, len(colours), index))
    draw_classes(cells, ax, extent, [MotionClass("", colour) for colour in (*colours, UNDECIDED)])
    if hatch:
        draw_hatches(index, ax, extent)  # undecided motions are grey without a hatch
    sections = [f"attractor_section_{n}" for n in (horizontal, vertical)]
    if points and all(n in ds for n in sections):
        for x, y, colour, period in zip(
                *(ds[n].values for n in sections), colours, ds["attractor_period"], strict=True):
            if period > 0:
                _mark_orbit(ax, x, y, colour)
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
    return with_primes(plain)


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
        target = 0.0 if sum(to_rgb(base)) > 1.8 else 1.0  # light colours become darker, dark ones lighter
        red, green, blue = (c + (target - c) * (1 - 0.55**earlier) for c in to_rgb(base))
        colours.append(to_hex((red, green, blue)))
    return colours


def _mark_orbit(ax: Axes, x: np.ndarray, y: np.ndarray, colour: str) -> None:
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
    check(ds, "attractors", attractor=("start",), **_ATTRACTOR_VARIABLES, **sections)
    ax = new_axes(ax)
    order = np.argsort(ds["attractor_period"].values == 0, kind="stable")[::-1]  # periodic orbits last, on top
    colours, x, y = attractor_colours(ds), *(ds[n].values for n in sections)
    for i in order:
        if ds["attractor_period"][i] > 0:
            _mark_orbit(ax, x[i], y[i], colours[i])
        else:
            ax.plot(x[i], y[i], "o", color=colours[i], markersize=1.2, markeredgewidth=0, zorder=1)
    horizontal, vertical = (axis_label(ds[f"attractor_section_{n}"], n) for n in _PLANE)
    ax.set(xlabel=horizontal, ylabel=vertical)
    widen_degenerate_axes(ax, *(unit_in(ds, n) for n in _PLANE))
    mark_backlash(ax, unit_in(ds, "z"), ax.axvline)
    if legend:
        attractor_legend(ax, ds)
    return ax


_SINGLE = {True: {"color": "black", "linewidth": 0.5}, False: {"color": "#c8102e", "linewidth": 0.5}}
"""How the stable and unstable manifolds of a single saddle are drawn."""

_SEVERAL = {True: {"linewidth": 0.8, "linestyle": "-"}, False: {"linewidth": 0.7, "linestyle": (0, (3, 1.5))}}
"""How they are drawn where there are several saddles."""

_COLOURS = tuple(dict.fromkeys(EVENT_COLOURS.values()))  # of several saddles, from the first one again after the last
_SADDLE: dict[str, Any] = {
    "linestyle": "none", "marker": "X", "markersize": 6, "color": "#ffd21f", "markeredgecolor": "black",
    "markeredgewidth": 0.7,
}


@keeps_data
def manifolds(
    ds: xr.Dataset, ax: Axes | None = None, *, stable: bool = True, unstable: bool = True,
    saddles: Sequence[int] | None = None, legend: bool = True,
) -> Axes:
    """Draw the manifolds of saddles in the plane of z and z_dot.

    The stable manifold of a single saddle is black, the unstable one red. Several saddles have a colour each; their
    stable manifolds are solid, the unstable ones dashed.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.manifolds`.
    ax : Axes, optional
        Where to draw, e.g. over the `basins` of the same model; a new figure if left out. In an Axes that has a map,
        the limits are kept.
    stable, unstable : bool
        Draw these manifolds.
    saddles : sequence of int, optional
        Numbers of the saddles to show, indices of ``saddle_period``; all if left out.
    legend : bool
        Add a legend to the right of the Axes.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not one of manifolds, or has no saddle of a number.

    Examples
    --------
    >>> import gearchaos as gc
    >>> model = gc.MeshModel.of(kind="single", omega=0.7, q0=0.1, eps1=0.05)
    >>> ax = gc.plot.manifolds(gc.manifolds(model, period=1, length=5.0))
    >>> ax.get_xlabel()
    'displacement $z$'
    """
    check(ds, "manifolds", z=("point",), z_dot=("point",), manifold=("point",), manifold_stable=("number",),
          manifold_saddle=("number",))
    count = ds.sizes["saddle_number"]
    numbers = np.arange(count) if saddles is None else np.asarray(saddles)
    known = saddles is None or (numbers.ndim == 1 and numbers.size > 0 and numbers.dtype.kind in "iu")
    if not known or not np.all((numbers >= 0) & (numbers < count)):
        raise InputError("saddles", f"must be numbers of saddles from 0 to {count - 1}", saddles,
                         f"Their periods are {', '.join(map(str, ds['saddle_period'].values.tolist()))}.")
    shown, over, handles = list(dict.fromkeys(numbers.tolist())), Overlay(ax), []
    single, kinds = len(shown) == 1, [kind for wanted, kind in ((stable, True), (unstable, False)) if wanted]
    points = np.column_stack([ds[name].values for name in _PLANE])
    branches = np.split(points, np.flatnonzero(np.diff(ds["manifold"].values)) + 1)
    for order, saddle in enumerate(shown):
        colour = _COLOURS[order % len(_COLOURS)]
        for kind in kinds:
            style = over.style(_SINGLE[kind] if single else {"color": colour, **_SEVERAL[kind]})
            chosen = (ds["manifold_stable"].values == kind) & (ds["manifold_saddle"].values == saddle)
            lines = [branches[i] for i in np.flatnonzero(chosen)] if len(points) else []
            over.ax.add_collection(LineCollection(lines, zorder=3, **style), autolim=not over.over_map)
        mark = over.style(_SADDLE if single else {**_SADDLE, "color": colour, "markeredgecolor": "white"})
        over.ax.plot(*(ds[f"saddle_section_{name}"].values[saddle] for name in _PLANE), zorder=6, **mark)
        label = f"saddle{'' if single else f' {saddle}'}, {ds['saddle_period'].values[saddle]}T"
        handles.append(Line2D([], [], label=label, **mark))
    region = json.loads(ds.attrs["settings"])["region"]
    over.frame({name: ds[name] for name in _PLANE},
               [[end * unit_in(ds, name) for end in ends] for name, ends in zip(_PLANE, region, strict=True)])
    if legend:
        of_kinds = {kind: _SINGLE[kind] if single else {"color": "0.35", **_SEVERAL[kind]} for kind in kinds}
        entries = [over.handle(f"{'' if kind else 'un'}stable manifold", {**style, "linewidth": 1.2}, outlined=single)
                   for kind, style in of_kinds.items()]
        side_legend(over.ax, [*entries, *handles])
    return over.ax
