"""The dynamic factor along the speed, computed and by the standards, with the speed ranges of ISO 6336-1."""

from __future__ import annotations

import json
from itertools import cycle, pairwise
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from gearchaos.gears.dynamic_factor import standards
from gearchaos.plot._datasets import check, keeps_data
from gearchaos.plot.axes import axis_label, draw_legend, new_axes, second_axis_below
from gearchaos.plot.theme import INK, STROBE, adapt, adapt_style
from gearchaos.studies.operation.factor_context import words_beside

_STANDARD_STYLES: tuple[dict[str, Any], ...] = (
    {"color": "#2f6db5", "linestyle": (0, (5, 2))}, {"color": "#a96a00", "linestyle": (0, (2, 1.5))},
    {"color": "#1b7a4b", "linestyle": (0, (6, 1.5, 1.5, 1.5))}, {"color": "#8a3b62", "linestyle": (0, (8, 2))},
    {"color": "#4f5f6f", "linestyle": (0, (1, 1))}, {"color": "#6b5bb0", "linestyle": (0, (4, 1, 1, 1, 1, 1))},
)
"""Of the lines of the standards in their order, from the first one again after the last."""

_RANGES = {"main resonance": "#f3d3cb", "intermediate": "#f8ebdc", "supercritical": "#eef1f6"}
"""Colours of the speed ranges of ISO 6336-1 above the subcritical one."""

_SWEEPS = {"fixed": "computed", "up": "computed, speed rising", "down": "computed, speed falling"}
_MOTIONS: dict[str, dict[str, Any]] = {
    "rest": {"label": "computed from rest", "color": INK, "linewidth": 1.6},
    "rising": {"label": "speed rising", "color": "#7a3f9d", "linewidth": 1.0},
    "falling": {"label": "speed falling", "color": "#0b7f86", "linewidth": 1.0},
    "changing": {"label": "after other speeds", "color": "#7a3f9d", "linestyle": "none", "marker": "+",
                 "markersize": 4},
    "load change": {"label": "load change", "color": "0.45", "linestyle": "none", "marker": "x", "markersize": 4},
    "other": {"label": "other initial states", "color": "0.45", "linestyle": "none", "marker": "x", "markersize": 4},
}
"""The motions of a result of `gearchaos.speeds_to_avoid`."""

LARGE = 20.0  # A larger factor asks for a logarithmic scale: on another one K_v would be a line at the bottom
_ROUNDING = 1e-9  # A quasi-static ratio that exceeds 1 by less is 1


@keeps_data
def dynamic_factor(ds: xr.Dataset, ax: Axes | None = None, *, legend: bool = True) -> Axes:
    """Draw the dynamic factor of the computed motions along the speed, beside K_v by the standards.

    Dots mark the speeds at which the flanks separate. Where the stiffness jumps, thin lines are the quasi-static ratio,
    which the factor has at no speed, and the largest computed factor over it. This one is comparable with K_v, for
    which the load passes from pair to pair without a jump. The legend says at which speeds a standard gives a value,
    and where the mesh damping acts. The scale is logarithmic where a factor exceeds 20. The ranges of ISO 6336-1 are
    shaded, the subcritical one left white, and a second axis below shows the resonance ratio N.

    Parameters
    ----------
    ds : Dataset
        From `gearchaos.dynamic_factor`, or the ``dataset`` of a result of `gearchaos.speeds_to_avoid`, with a line for
        each of its motions.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    legend : bool
        Add a legend of the lines and ranges.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the Dataset is not such a result.

    Examples
    --------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(
    ...     teeth=(50, 50), module="3 mm", face_width="20 mm", bore="30 mm", damping_ratio=0.05,
    ...     backlash={"value": "0.12 mm", "of": "line of action, total"}, transmission_error="from quality",
    ...     quality={"standard": "ISO 1328-1:1995", "grade": 6})
    >>> ax = gc.plot.dynamic_factor(gc.dynamic_factor(design, "1000:8000:20", "100 N*m"))
    >>> ax.get_ylabel()
    'dynamic factor'
    """
    over_motions = "motion" in getattr(ds, "dims", ())
    motions = {name: ds.sel(motion=name) for name in ds["motion"].values.tolist()} if over_motions else {"": ds}
    by_speed = ("dynamic_factor", "contact", "resonance_ratio", "resonance_ratio_ISO_B", *(s.name for s in standards()))
    for motion in motions.values():
        check(motion, "dynamic_factor", **dict.fromkeys(by_speed, 1), quasi_static_ratio=())
    ax = new_axes(ax)
    speed, computed, by_standards = ds["speed"].values, computed_factors(motions), []
    for standard, style in zip(standards(), cycle(_STANDARD_STYLES), strict=False):
        values = ds[standard.name].values
        valid = np.flatnonzero(np.isfinite(values))
        where = "" if len(valid) == len(values) else ": no value"
        if where and len(valid):
            start = "" if valid[0] == 0 else f"{speed[valid[0]]:.0f} "
            where = f", {start}to {speed[valid[-1]]:.0f} rpm"
        by_standards += ax.plot(
            speed, values, **adapt_style({"label": standard.label + where, "linewidth": 1.3, **style}))
    draw_computed(ax, computed)
    if (ratio := float(next(iter(motions.values()))["quasi_static_ratio"])) > 1 + _ROUNDING:
        largest = np.fmax.reduce([each["dynamic_factor"].values for each in motions.values()])
        thin: dict[str, Any] = {"color": adapt(INK), "linewidth": 0.7, "zorder": 3}
        ax.axhline(ratio, linestyle=(0, (1, 2)), label="quasi-static ratio", **thin)
        ax.annotate("quasi-static ratio", (0.99, ratio), xycoords=ax.get_yaxis_transform(), va="center", ha="right",
                    fontsize="x-small", color=adapt(INK), zorder=5,
                    bbox={"facecolor": ax.get_facecolor(), "edgecolor": "none", "pad": 1})
        computed += ax.plot(speed, largest / ratio, label="largest over quasi-static", **thin)
    shaded = _ranges(ax, ds)
    ax.set(xlabel=axis_label(ds["speed"], "speed"), ylabel="dynamic factor")
    if len(speed) > 1:
        ax.set_xlim(speed[0], speed[-1])
    if legend:
        law, *_ = words_beside(ds, "dynamic_factor")
        draw_legend(ax, [*computed, *by_standards, *shaded], title=law, title_fontsize="x-small")
    return ax


def draw_computed(ax: Axes, lines: list[Line2D]) -> None:
    """Draw the lines of `computed_factors`, on a logarithmic scale if a factor is large."""
    for line in lines:
        ax.add_line(line)
    if max((np.nanmax(line.get_ydata(), initial=0) for line in lines), default=0) > LARGE:
        ax.set_yscale("log", subs=(2, 5))
        ax.yaxis.set(major_formatter="{x:g}", minor_formatter="{x:g}")
    ax.autoscale_view()


def computed_factors(motions: dict[str, xr.Dataset]) -> list[Line2D]:
    """The lines of the computed factors, and dots where the flanks separate."""
    lines, dots = [], []
    for name, ds in motions.items():
        speed, values, separated = ds["speed"].values, ds["dynamic_factor"].values, ds["contact"].values > 0
        sweep = _SWEEPS.get(json.loads(ds.attrs.get("settings", "{}")).get("mode"), "computed")
        style = _MOTIONS.get(name, {"label": sweep, "color": INK, "linewidth": 1.6})
        if not name or np.isfinite(values).any():
            lines.append(Line2D(speed, values, zorder=3, **adapt_style(style)))
        dots.append((speed[separated], values[separated]))
    x, y = (np.concatenate(each) for each in zip(*dots, strict=True))
    if len(x):
        lines.append(Line2D(x, y, color=adapt(STROBE), linestyle="none", marker="o", markersize=3.5, markeredgewidth=0,
                            zorder=4, label="flanks separate"))
    return lines


def _ranges(ax: Axes, ds: xr.Dataset) -> list[Patch]:
    """Shade the speed ranges of ISO 6336-1, add the axis of N, and return the handles of the ranges that occur."""
    ratio = ds["resonance_ratio_ISO_B"]
    if not np.isfinite(ratio.values).all():
        return []
    per_ratio = float(ds["speed"][0] / ratio[0])
    second_axis_below(ax, 1 / per_ratio, "resonance ratio $N$")
    limits = [*(float(ratio.attrs[n]) for n in ("main_start", "main_end", "supercritical_start")), np.inf]
    handles = []
    for (name, colour), (low, high) in zip(_RANGES.items(), pairwise(limits), strict=True):
        if low < ratio.values.max() and high > ratio.values.min():
            face = adapt(colour)
            ax.axvspan(low * per_ratio, min(high, 2 * ratio.values.max()) * per_ratio, facecolor=face, zorder=0)
            handles.append(Patch(facecolor=face, edgecolor=adapt("0.6"), linewidth=0.5, label=name))
    return handles
