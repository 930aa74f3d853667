"""The excitation of a gear design over the mesh period: its stiffness by all methods, and its transmission error."""

from __future__ import annotations

from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.plot._axes import new_axes, panels, second_axis_below, widened_limits, wrapped
from gearchaos.plot._checks import check_design
from gearchaos.plot._legends import legend as draw_legend
from gearchaos.plot._theme import INK, STROBE, adapt, adapt_style

_LINES: tuple[dict[str, Any], ...] = (
    {"color": INK, "linewidth": 1.5}, {"color": STROBE, "linewidth": 1.1, "linestyle": (0, (5, 2))},
    {"color": "#2f6db5", "linewidth": 1.1, "linestyle": (0, (1.5, 1.5))},
)
"""Styles of the curve of the design and of those by other methods."""

_PER_UM = 1e-6
_STIFFNESS_SAMPLES = 40
"""Points of the curve of a stiffness for each of its harmonics."""

_MARGIN = 0.08
"""Margin above and below the curves, relative to their range."""


def mesh_stiffness(design: GearDesign, ax: Axes | None = None, *, compare: bool = True, legend: bool = True) -> Axes:
    """Draw the mesh stiffness over one mesh period, in N/µm along the line of action.

    The period begins when a tooth pair enters contact. A second axis below shows the roll angle of wheel 1. Thin
    horizontal lines are the means over the period. The legend says by what the curve of the method is approximated, and
    the root mean square of the difference relative to the mean.

    Parameters
    ----------
    design : GearDesign
        The gear pair.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    compare : bool
        Show not only the method of the design but also all others that can be computed.
    legend : bool
        Add a legend of the methods.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If the stiffness by the method of the design cannot be computed.

    Examples
    --------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(teeth=(50, 50), module="3 mm", face_width="20 mm", torque="100 N*m")
    >>> ax = gc.plot.mesh_stiffness(design)
    >>> ax.get_ylabel()
    'mesh stiffness [N/µm]'
    """
    check_design(design)
    found = design.comparable_stiffnesses[: None if compare else 1]
    ax = new_axes(ax)
    handles = []
    for stiffness, given in zip(found, cycle(_LINES), strict=False):
        style, wave = adapt_style(given), stiffness.waveform
        if count := len(wave.harmonics()[0]):
            time = np.linspace(0, 1, _STIFFNESS_SAMPLES * count + 1)
            ax.plot(time, stiffness(time) * _PER_UM, **style)
        else:
            edges = np.unique([0.0, *wave.jumps, 1.0])
            ax.stairs(stiffness((edges[:-1] + edges[1:]) / 2) * _PER_UM, edges, baseline=None, **style)
        error = f"rms error {100 * stiffness.truncation:.2g} %" if stiffness.truncation else "exact"
        words = f"{stiffness.method}, mean {stiffness.reference * _PER_UM:.4g} N/µm:\n{wave.outline}, {error}"
        handles.append(Line2D([], [], label=words, **style))
        ax.axhline(stiffness.reference * _PER_UM, color=style["color"], linewidth=0.6, alpha=0.6, zorder=1)
    levels = np.array([level for stiffness in found for level in stiffness.extremes]) * _PER_UM
    low, high = widened_limits(levels.min(), levels.max(), levels.max())
    margin = _MARGIN * (high - low)
    ax.set(xlim=(0, 1), ylim=(low - margin, high + margin), xlabel="fraction of the mesh period",
           ylabel="mesh stiffness [N/µm]")
    second_axis_below(ax, 360 / design.teeth[0], "roll angle of wheel 1 [deg]")
    if legend:
        draw_legend(ax, handles)
    return ax


_UM = 1e6
_ERROR_SAMPLES = 64
"""Points of the curve of an error for each of its harmonics."""

_SMALL_FONT = 0.85
"""Size of a small font over that of labels, for which `wrapped` counts characters."""


def transmission_error(design: GearDesign, ax: Axes | None = None) -> Axes:
    """Draw the transmission error of the unloaded gears in µm along the line of action.

    One panel shows e(t) over one mesh period, which begins when a tooth pair enters contact; e is positive where the
    driven wheel lags behind. The other panel shows the peak amplitudes e_j of the harmonics of the mesh frequency. The
    title says what the error was computed from, and what of it the harmonics leave out.

    Parameters
    ----------
    design : GearDesign
        The gear pair.
    ax : Axes, optional
        Where to draw; a new figure if left out.

    Returns
    -------
    Axes
        With both panels as its ``child_axes``.

    Raises
    ------
    InputError
        If the error by the method of the design cannot be computed.

    Examples
    --------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(
    ...     teeth=(50, 50), module="3 mm", face_width="20 mm", transmission_error="from quality",
    ...     quality={"standard": "ISO 1328-1:1995", "grade": 6})
    >>> ax = gc.plot.transmission_error(design)
    >>> len(ax.child_axes)
    2
    """
    check_design(design)
    error = design.error_harmonics
    ax = new_axes(ax)
    curve, bars = panels(ax, 0.62)
    count = len(error.amplitudes)
    time = np.linspace(0, 1, _ERROR_SAMPLES * max(count, 1) + 1)
    curve.axhline(0, color=adapt("0.7"), linewidth=0.6)
    curve.plot(time, _UM * error.at(time), color=adapt(INK), linewidth=1.4)
    curve.set(xlim=(0, 1), xlabel="fraction of the mesh period", ylabel="error $e$ [µm]")
    bars.bar(np.arange(1, count + 1), _UM * np.array(error.amplitudes), width=0.35, color=adapt(INK))
    bars.set(xlim=(0.5, max(count, 3) + 0.5), xlabel="harmonic $j$", ylabel="amplitude $e_j$ [µm]")
    bars.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=5))
    if not count:
        curve.set_ylim(-1, 1)
        bars.set(xticks=[], yticks=[])
        bars.text(0.5, 0.5, "no harmonics", transform=bars.transAxes, ha="center", va="center", fontsize="small")
    inches = ax.get_window_extent().width / ax.figure.dpi
    source = error.source
    if error.residual_peak:
        source += f"; left out: {_UM * error.residual_rms:.3g} µm rms, {_UM * error.residual_peak:.3g} µm at most"
    ax.set_title(wrapped(source, inches / _SMALL_FONT), loc="left", fontsize="small")
    return ax
