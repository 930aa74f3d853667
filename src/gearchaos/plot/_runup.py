"""A run-up: the dynamic factor over the speed, both ways, and the waterfall of the orders of the mesh force."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from gearchaos.plot._datasets import check, keeps_data
from gearchaos.plot._dynamic_factor import LARGE
from gearchaos.plot.axes import axis_label, draw_legend
from gearchaos.plot.theme import EVENT_COLOURS, INK, STROBE, adapt, event_words
from gearchaos.studies.operation.factor_context import words_beside
from gearchaos.studies.runup.measured_runup import compared_orders, measured_runup, order_cut

WAYS: dict[str, tuple[str, Any, str]] = {"up": (INK, "-", "speed rising"), "down": (STROBE, "--", "speed falling")}
_GREY = "#9a9a9a"  # of a torque
_ROWS = 150  # most rows of a waterfall
_FEW = 12  # most orders of a measured run-up that has no waterfall
WATERFALL_RANGE = 80.0  # dB that a waterfall shows below its largest line
WATERFALL_COLOURS = "magma"


@keeps_data
def runup(ds: xr.Dataset, figure: Figure | None = None, *, against: xr.Dataset | str | Path | None = None) -> Figure:
    """Draw a run-up: the dynamic factor over the speed, and below it the waterfall of the mesh force of each direction.

    Dots mark the motions after a jump, vertical lines the events by which their branches ended, and a grey line
    is a torque that changes. A waterfall has the amplitude at each order of the turn of the first wheel, in
    dB below the largest one of all. A measured run-up has its orders over those computed, and a waterfall of its own.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.runup`.
    figure : Figure, optional
        An empty one in which to draw; a new one if left out.
    against : str, Path or Dataset, optional
        A measured run-up: a table of speed, order and amplitude, or of time, speed and force, or what
        `gearchaos.studies.runup.measured_runup.measured_runup` makes of it. Then ``ds`` must be in physical units.

    Returns
    -------
    Figure

    Raises
    ------
    InputError
        If the Dataset is not a result of `gearchaos.runup`, or what was measured cannot be read.

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

    measured = measured_runup(against, ds) if isinstance(against, (str, Path)) else against
    spectra = {"order, ": ds}
    if measured is not None and measured.sizes["order"] > _FEW:
        spectra["order, measured,\n"] = measured
    panels = (measured is not None) + sum(each.sizes["direction"] for each in spectra.values())
    figure = figure or plt.figure(figsize=(6.4, 3.2 + 3.2 * panels), layout="constrained")
    heights = (1, *[1.2] * panels)
    above, *below = figure.subplots(len(heights), 1, sharex=True, height_ratios=heights)
    shown = "dynamic_factor" if np.isfinite(ds["dynamic_factor"]).any() else "mesh_force_peak"
    speed = ds["speed"].values
    for direction in known:
        colour, style, _ = WAYS[direction]
        above.plot(speed, ds[shown].sel(direction=direction), color=adapt(colour), linestyle=style, linewidth=1.0)
        if shown == "dynamic_factor":
            own = ds.isel(jump=ds["direction_of_jump"].values == direction)
            above.plot(own["speed_of_jump"], own["factor_after_jump"], "o", color=adapt(colour), markersize=4)
    above.set_ylabel(axis_label(ds[shown], shown))
    if np.nanmax(ds["dynamic_factor"].values, initial=0) > LARGE:
        above.set_yscale("log", subs=(2, 5))
    handles = [Line2D([], [], color=adapt(WAYS[w][0]), linestyle=WAYS[w][1], label=WAYS[w][2]) for w in known]
    if ds.sizes["jump"]:
        handles.append(Line2D([], [], marker="o", linestyle="none", color=adapt(INK), label="after a jump"))
    handles += _draw_beside(above, ds)
    handles += [Line2D([], [], linestyle="none", label=words) for words in words_beside(ds, shown)]
    draw_legend(above, handles, ncols=2)
    if measured is not None:
        _order_cuts(below.pop(0), ds, measured)
    _waterfalls(figure, below, spectra)
    below[-1].set(xlabel=axis_label(ds["speed"], "speed"))
    return figure


def _draw_beside(ax: Axes, ds: xr.Dataset) -> list[Line2D]:
    """Draw the events that end branches before jumps as vertical lines, and a torque on an axis of its own.

    Returns the legend handles: one for each kind of event, one for the torque.
    """
    handles = {}
    if "event_speed" in ds:
        located = ds.isel(jump=np.isfinite(ds["event_speed"].values))
        for kind, speed in zip(*(located[name].values.tolist() for name in ("event_kind", "event_speed")), strict=True):
            handles[kind] = ax.axvline(speed, color=adapt(EVENT_COLOURS.get(kind, INK)), linestyle=":", linewidth=1.2,
                                       label=event_words(kind))
    if "torque" in ds:
        beside = ax.twinx()
        for direction, torque in zip(ds["direction"].values.tolist(), ds["torque"].values, strict=True):
            beside.plot(ds["speed"], torque, color=adapt(_GREY), linestyle=WAYS[direction][1], linewidth=0.8)
        beside.set_ylabel(axis_label(ds["torque"], "torque"))
        handles["torque"] = Line2D([], [], color=adapt(_GREY), linewidth=0.8, label="torque")
    return [*handles.values()]


def _order_cuts(ax: Axes, ds: xr.Dataset, measured: xr.Dataset) -> None:
    """Draw the strongest mesh harmonics over the speed, computed as lines and measured as dots, a colour for each."""
    handles = []
    for number, row in enumerate(compared_orders(ds, measured)):
        colour = f"C{number}"
        for direction in measured["direction"].values.tolist():
            computed, found = (order_cut(each.sel(direction=direction), row["order"]) for each in (ds, measured))
            ax.plot(computed["speed"], computed, color=colour, linestyle=WAYS[direction][1], linewidth=1.0)
            ax.plot(found["speed"], found, "o", color=colour, markersize=3,
                    fillstyle="full" if direction == "up" else "none")
        handles.append(Line2D([], [], color=colour, label=f"order {row['order']:g}"))
    handles += [Line2D([], [], color=adapt(INK), marker="o", markersize=3, linestyle="none", label="measured"),
                Line2D([], [], color=adapt(INK), label="computed")]
    draw_legend(ax, handles, ncols=2)
    ax.set_ylabel(axis_label(ds["order_force"], "order_force"))
    ax.set_ylim(bottom=0)


def _waterfalls(figure: Figure, panels: Sequence[Axes], spectra: Mapping[str, xr.Dataset]) -> None:
    """Draw the waterfalls of each direction of run-ups, by their titles, with one scale."""
    largest, below = max(_largest_line(each) for each in spectra.values()), iter(panels)
    for title, each in spectra.items():
        edges, level, words = waterfall(each, largest)
        speed = each["speed"].values
        step = speed[1] - speed[0] if len(speed) > 1 else 1.0
        across = np.append(speed - step / 2, speed[-1] + step / 2)
        for direction, values in zip(each["direction"].values.tolist(), level, strict=True):
            ax = next(below)
            image = ax.pcolormesh(across, edges, values.T, vmin=-WATERFALL_RANGE, vmax=0, cmap=WATERFALL_COLOURS,
                                  rasterized=True)
            ax.set(ylabel=f"{title}{WAYS[direction][2]}")
    figure.colorbar(image, ax=panels, label=words)


def waterfall(ds: xr.Dataset, largest: float | None = None) -> tuple[np.ndarray, np.ndarray, str]:
    """The edges (R + 1,) of rows of orders, their levels (direction, speed, R) in dB, and these in words.

    They are those below the ``largest`` amplitude, by default that of ``ds``.
    """
    force, order = ds["order_force"][:, :, 1:], ds["order"].values[1:]
    group = -(-len(order) // _ROWS)  # orders that share a row, which has the largest of them
    rows = np.fmax.reduceat(force.values, np.arange(0, len(order), group), axis=2)
    largest = _largest_line(ds) if largest is None else largest
    level = 20 * np.log10(np.maximum(rows / largest, 10 ** (-WATERFALL_RANGE / 20)))
    edges = np.append(order[::group], 2 * order[-1] - order[-2]) - order[0] / 2
    return edges, level, f"mesh force [dB re {largest:.4g} {force.attrs['units']}]"


def _largest_line(ds: xr.Dataset) -> float:
    """The largest amplitude of a run-up but the mean; 1 if all are 0."""
    return float(np.nanmax(ds["order_force"].values[:, :, 1:], initial=0.0)) or 1.0
