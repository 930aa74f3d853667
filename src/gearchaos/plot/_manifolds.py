"""Stable and unstable manifolds of saddles, alone or over basins of attraction."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D

from gearchaos.errors import InputError
from gearchaos.gears.results import unit_in
from gearchaos.plot._axes import axis_label, new_axes
from gearchaos.plot._checks import check
from gearchaos.plot._data import keeps_data
from gearchaos.plot._legends import side_legend
from gearchaos.plot._theme import EVENT_COLOURS, legend_style, style_on

_STABLE: dict[str, Any] = {"color": "black", "linewidth": 0.5}
_UNSTABLE: dict[str, Any] = {"color": "#c8102e", "linewidth": 0.5}
_COLOURS = tuple(EVENT_COLOURS.values())
"""Colours of saddles where there are several; they are used again after the last one."""

_SEVERAL = {True: {"linewidth": 0.8, "linestyle": "-"}, False: {"linewidth": 0.7, "linestyle": (0, (3, 1.5))}}
"""How stable and unstable manifolds are drawn where there are several saddles."""

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
    shown = _checked(ds, saddles)
    over_map = ax is not None and bool(ax.images)
    ax = new_axes(ax)
    kinds = [is_stable for wanted, is_stable in ((stable, True), (unstable, False)) if wanted]
    for order, saddle in enumerate(shown):
        for is_stable in kinds:
            style = style_on(over_map, _style(order, len(shown), is_stable))
            ax.add_collection(LineCollection(_lines(ds, saddle, is_stable), zorder=3, **style), autolim=not over_map)
        points = (ds[f"saddle_section_{name}"].values[saddle] for name in ("z", "z_dot"))
        ax.plot(*points, zorder=6, **style_on(over_map, {**_SADDLE, **_fill(order, len(shown))}))
    handles = _handles(ds, shown, kinds, over_map)
    if not over_map:
        ax.set(xlabel=axis_label(ds["z"], "z"), ylabel=axis_label(ds["z_dot"], "z_dot"))
        _limit(ds, ax)
    if legend:
        side_legend(ax, handles)
    return ax


def _checked(ds: xr.Dataset, saddles: Any) -> list[int]:
    """The numbers of the saddles to show; raises `InputError` for one that does not exist."""
    count = ds.sizes["saddle_number"]
    if saddles is None:
        return list(range(count))
    numbers = np.asarray(saddles)
    if numbers.ndim != 1 or numbers.size == 0 or numbers.dtype.kind not in "iu" or not np.all(
            (numbers >= 0) & (numbers < count)):
        raise InputError("saddles", f"must be numbers of saddles from 0 to {count - 1}", saddles,
                         f"Their periods are {', '.join(map(str, ds['saddle_period'].values.tolist()))}.")
    return list(dict.fromkeys(numbers.tolist()))


def _style(order: int, count: int, stable: bool) -> dict[str, Any]:
    """How the stable or the unstable manifolds of one of several saddles are drawn."""
    if count == 1:
        return _STABLE if stable else _UNSTABLE
    return {"color": _COLOURS[order % len(_COLOURS)], **_SEVERAL[stable]}


def _fill(order: int, count: int) -> dict[str, Any]:
    """The colour of the points of one of several saddles, where it differs from that of a single one."""
    return {} if count == 1 else {"color": _COLOURS[order % len(_COLOURS)], "markeredgecolor": "white"}


def _handles(ds: xr.Dataset, shown: list[int], kinds: list[bool], over_map: bool) -> list[Line2D]:
    """Legend handles of the manifolds and the saddles."""
    single, several = len(shown) == 1, []
    styles = {stable: _style(0, 1, stable) if single else {"color": "0.35", **_SEVERAL[stable]} for stable in kinds}
    lines = [Line2D([], [], label=f"{'' if stable else 'un'}stable manifold",
                    **legend_style(over_map and single, {**style, "linewidth": 1.2}))
             for stable, style in styles.items()]
    for order, saddle in enumerate(shown):
        label = f"saddle{'' if single else f' {saddle}'}, {ds['saddle_period'].values[saddle]}T"
        several.append(Line2D([], [], label=label, **style_on(over_map, {**_SADDLE, **_fill(order, len(shown))})))
    return [*lines, *several]


def _lines(ds: xr.Dataset, saddle: int, stable: bool) -> list[np.ndarray]:
    """The branches of the stable or the unstable manifolds of a saddle, each (P, 2)."""
    points = np.column_stack([ds["z"].values, ds["z_dot"].values])
    ends = np.flatnonzero(np.diff(ds["manifold"].values)) + 1
    chosen = (ds["manifold_stable"].values == stable) & (ds["manifold_saddle"].values == saddle)
    return [part for part, kept in zip(np.split(points, ends), chosen, strict=True) if kept] if len(points) else []


def _limit(ds: xr.Dataset, ax: Axes) -> None:
    """Limit the Axes to the region in which the manifolds were followed."""
    region = json.loads(ds.attrs["settings"])["region"]
    for name, ends, limit in (("z", region[0], ax.set_xlim), ("z_dot", region[1], ax.set_ylim)):
        limit(*(end * unit_in(ds, name) for end in ends))
