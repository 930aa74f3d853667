"""The mesh stiffness of a gear design over the mesh period, by all methods that can be computed."""

from __future__ import annotations

from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.design.gear_pair import comparable_stiffnesses
from gearchaos.gears.stiffness.mesh_stiffness import MeshStiffness
from gearchaos.plot._axes import new_axes, second_axis_below, widened_limits
from gearchaos.plot._checks import check_design
from gearchaos.plot._legends import legend as draw_legend
from gearchaos.plot._theme import INK, STROBE, adapt, adapt_style

_LINES: tuple[dict[str, Any], ...] = (
    {"color": INK, "linewidth": 1.5}, {"color": STROBE, "linewidth": 1.1, "linestyle": (0, (5, 2))},
    {"color": "#2f6db5", "linewidth": 1.1, "linestyle": (0, (1.5, 1.5))},
)
"""Styles of the curve of the design and of those by other methods."""

_PER_UM = 1e-6
_SAMPLES_PER_HARMONIC = 40
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
    found = comparable_stiffnesses(design)[: None if compare else 1]
    ax = new_axes(ax)
    for stiffness, style in zip(found, cycle(_LINES), strict=False):
        _curve(ax, stiffness, adapt_style(style))
        ax.axhline(stiffness.reference * _PER_UM, color=adapt(style["color"]), linewidth=0.6, alpha=0.6, zorder=1)
    levels = np.array([level for stiffness in found for level in stiffness.extremes]) * _PER_UM
    low, high = widened_limits(levels.min(), levels.max(), levels.max())
    margin = _MARGIN * (high - low)
    ax.set(xlim=(0, 1), ylim=(low - margin, high + margin), xlabel="fraction of the mesh period",
           ylabel="mesh stiffness [N/µm]")
    second_axis_below(ax, 360 / design.teeth[0], "roll angle of wheel 1 [deg]")
    if legend:
        draw_legend(ax, [Line2D([], [], label=_described(stiffness), **adapt_style(style))
                         for stiffness, style in zip(found, cycle(_LINES), strict=False)])
    return ax


def _curve(ax: Axes, stiffness: MeshStiffness, style: dict[str, Any]) -> None:
    """Draw a stiffness over the period: steps as steps, a Fourier series as a smooth curve."""
    wave = stiffness.waveform
    if count := len(wave.harmonics()[0]):
        time = np.linspace(0, 1, _SAMPLES_PER_HARMONIC * count + 1)
        ax.plot(time, stiffness(time) * _PER_UM, **style)
        return
    edges = np.unique([0.0, *wave.jumps, 1.0])
    ax.stairs(stiffness((edges[:-1] + edges[1:]) / 2) * _PER_UM, edges, baseline=None, **style)


def _described(stiffness: MeshStiffness) -> str:
    """The entry of a stiffness in the legend: method, mean, form and truncation."""
    error = f"rms error {100 * stiffness.truncation:.2g} %" if stiffness.truncation else "exact"
    return f"{stiffness.method}, mean {stiffness.reference * _PER_UM:.4g} N/µm:\n{stiffness.waveform.outline}, {error}"
