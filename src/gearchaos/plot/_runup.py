"""A run-up: the dynamic factor over the speed, both ways, and the waterfall of the orders of the mesh force."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from gearchaos.plot._datasets import check, keeps_data
from gearchaos.plot._dynamic_factor import LARGE
from gearchaos.plot.axes import axis_label, draw_legend
from gearchaos.plot.theme import INK, STROBE, adapt
from gearchaos.studies.beside_factors import words_beside

WAYS: dict[str, tuple[str, Any, str]] = {"up": (INK, "-", "speed rising"), "down": (STROBE, "--", "speed falling")}
_ROWS = 150  # most rows of a waterfall
WATERFALL_RANGE = 80.0  # dB that a waterfall shows below its largest line
WATERFALL_COLOURS = "magma"


@keeps_data
def runup(ds: xr.Dataset, figure: Figure | None = None) -> Figure:
    """Draw a run-up: the dynamic factor over the speed, and below it the waterfall of the mesh force of each direction.

    Dots mark the motions after a jump. A waterfall has the amplitude at each order of the turn of the first wheel, in
    dB below the largest one of all.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.runup`.
    figure : Figure, optional
        An empty one in which to draw; a new one if left out.

    Returns
    -------
    Figure

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.runup`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(
    ...     teeth=(50, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05, torque="150 N*m",
    ...     backlash={"value": "0.12 mm", "of": "line of action, total"}, transmission_error="from quality",
    ...     quality={"standard": "ISO 1328-1:1995", "grade": 6})
    >>> figure = gc.plot.runup(gc.runup(design.at(speed=500), "speed=500:900", 1.0))
    """
    check(ds, "runup", dynamic_factor=("direction", "speed"), order_force=("direction", "speed", "order"))
    known = ds["direction"].values.tolist()
    import matplotlib.pyplot as plt

    figure = figure or plt.figure(figsize=(6.4, 3.2 + 3.2 * len(known)), layout="constrained")
    above, *waterfalls = figure.subplots(1 + len(known), 1, sharex=True, height_ratios=(1, *[1.2] * len(known)))
    shown = "dynamic_factor" if np.isfinite(ds["dynamic_factor"]).any() else "mesh_force_peak"
    speed = ds["speed"].values
    for way in known:
        colour, style, _ = WAYS[way]
        above.plot(speed, ds[shown].sel(direction=way), color=adapt(colour), linestyle=style, linewidth=1.0)
        if shown == "dynamic_factor":
            own = ds.isel(jump=ds["direction_of_jump"].values == way)
            above.plot(own["speed_of_jump"], own["factor_after_jump"], "o", color=adapt(colour), markersize=4)
    above.set_ylabel(axis_label(ds[shown], shown))
    if np.nanmax(ds["dynamic_factor"].values, initial=0) > LARGE:
        above.set_yscale("log", subs=(2, 5))
    handles = [Line2D([], [], color=adapt(WAYS[w][0]), linestyle=WAYS[w][1], label=WAYS[w][2]) for w in known]
    if ds.sizes["jump"]:
        handles.append(Line2D([], [], marker="o", linestyle="none", color=adapt(INK), label="after a jump"))
    handles += [Line2D([], [], linestyle="none", label=words) for words in words_beside(ds, shown)]
    draw_legend(above, handles, ncols=2)
    edges, level, words = waterfall(ds)
    step = speed[1] - speed[0] if len(speed) > 1 else 1.0
    across = np.append(speed - step / 2, speed[-1] + step / 2)
    for below, way, values in zip(waterfalls, known, level, strict=True):
        image = below.pcolormesh(across, edges, values.T, vmin=-WATERFALL_RANGE, vmax=0, cmap=WATERFALL_COLOURS,
                                 rasterized=True)
        below.set(ylabel=f"order, {WAYS[way][2]}")
    figure.colorbar(image, ax=waterfalls, label=words)
    waterfalls[-1].set(xlabel=axis_label(ds["speed"], "speed"))
    return figure


def waterfall(ds: xr.Dataset) -> tuple[np.ndarray, np.ndarray, str]:
    """The edges (R + 1,) of rows of orders, their levels (direction, speed, R) in dB, and these in words."""
    force, order = ds["order_force"][:, :, 1:], ds["order"].values[1:]
    group = -(-len(order) // _ROWS)  # orders that share a row, which has the largest of them
    rows = np.fmax.reduceat(force.values, np.arange(0, len(order), group), axis=2)
    largest = np.nanmax(rows, initial=0.0) or 1.0
    level = 20 * np.log10(np.maximum(rows / largest, 10 ** (-WATERFALL_RANGE / 20)))
    edges = np.append(order[::group], 2 * order[-1] - order[-2]) - order[0] / 2
    return edges, level, f"mesh force [dB re {largest:.4g} {force.attrs['units']}]"
