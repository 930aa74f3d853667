"""A run-up: the dynamic factor over the speed, both ways, and the waterfall of the orders of the mesh force."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from gearchaos.errors import unknown_name
from gearchaos.plot._datasets import check, keeps_data
from gearchaos.plot.axes import axis_label, draw_legend
from gearchaos.plot.theme import INK, STROBE, adapt
from gearchaos.studies.beside_factors import words_beside

_WAYS: dict[str, tuple[str, Any, str]] = {"up": (INK, "-", "speed rising"), "down": (STROBE, "--", "speed falling")}
_ROWS = 150  # most rows of a waterfall
_RANGE = 60.0  # dB that a waterfall shows below its largest line


@keeps_data
def runup(ds: xr.Dataset, figure: Figure | None = None, *, direction: str = "up") -> Figure:
    """Draw a run-up: the dynamic factor over the speed, and below it the waterfall of the mesh force.

    Dots mark where the motion jumps. The waterfall has the amplitude at each order of the turn of the first wheel, in
    dB below the largest one.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.runup`.
    figure : Figure, optional
        An empty one in which to draw; a new one if left out.
    direction : {"up", "down"}
        Whose waterfall is drawn.

    Returns
    -------
    Figure

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.runup`, or has no run in this direction.

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
    if direction not in known:
        raise unknown_name("direction", direction, known)
    import matplotlib.pyplot as plt

    figure = figure or plt.figure(figsize=(6.4, 6.4), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(1, 1.4))
    shown = "dynamic_factor" if np.isfinite(ds["dynamic_factor"]).any() else "mesh_force_peak"
    speed = ds["speed"].values
    for way in known:
        colour, style, _ = _WAYS[way]
        above.plot(speed, ds[shown].sel(direction=way), color=adapt(colour), linestyle=style, linewidth=1.0)
        if shown == "dynamic_factor":
            own = ds.isel(jump=ds["direction_of_jump"].values == way)
            above.plot(own["speed_of_jump"], own["factor_after_jump"], "o", color=adapt(colour), markersize=4)
    above.set(yscale="log", ylabel=axis_label(ds[shown], shown))
    handles = [Line2D([], [], color=adapt(_WAYS[w][0]), linestyle=_WAYS[w][1], label=_WAYS[w][2]) for w in known]
    handles += [Line2D([], [], marker="o", linestyle="none", color=adapt(INK), label="after a jump")]
    handles += [Line2D([], [], linestyle="none", label=words) for words in words_beside(ds, shown)]
    draw_legend(above, handles, ncols=2)
    force = ds["order_force"].sel(direction=direction)[:, 1:]
    step = speed[1] - speed[0] if len(speed) > 1 else 1.0
    group = -(-force.sizes["order"] // _ROWS)  # orders that share a row, which has the largest of them
    order = ds["order"].values[1:]
    rows = np.fmax.reduceat(force.values, np.arange(0, len(order), group), axis=1)
    level = 20 * np.log10(np.maximum(rows / np.nanmax(rows), 10 ** (-_RANGE / 20)))
    edges = np.append(order[::group], 2 * order[-1] - order[-2]) - order[0] / 2
    across = np.append(speed - step / 2, speed[-1] + step / 2)
    image = below.pcolormesh(across, edges, level.T, vmin=-_RANGE, vmax=0, cmap="magma", rasterized=True)
    figure.colorbar(image, ax=below, label=f"mesh force [dB re {np.nanmax(force.values):.4g} {force.attrs['units']}]")
    below.set(xlabel=axis_label(ds["speed"], "speed"), ylabel=f"order of the first wheel, {_WAYS[direction][2]}")
    return figure
