"""A gear design: its excitation over the mesh period, stiffness and transmission error."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import cycle
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, to_hex
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from gearchaos.errors import InputError
from gearchaos.gears.design.gear_design import GearDesign
from gearchaos.gears.io.units import TORQUE, to_si
from gearchaos.gears.mesh.pair import GearPair
from gearchaos.gears.operation.loaded_error import loaded_error, own_torque
from gearchaos.plot._datasets import check_design, check_gears
from gearchaos.plot.axes import (
    draw_legend,
    new_axes,
    panels,
    second_axis_below,
    vertical_limits,
    widened_limits,
    width_in_inches,
    wrapped,
)
from gearchaos.plot.theme import INK, STROBE, adapt, adapt_style
from gearchaos.quantities import POSITIVE

_UM, _PER_UM = 1e6, 1e-6


_LINES: tuple[dict[str, Any], ...] = (
    {"color": INK, "linewidth": 1.5}, {"color": STROBE, "linewidth": 1.1, "linestyle": (0, (5, 2))},
    {"color": "#2f6db5", "linewidth": 1.1, "linestyle": (0, (1.5, 1.5))},
)
"""Styles of the curve of the design and of those by other methods."""

_STIFFNESS_SAMPLES, _ERROR_SAMPLES = 40, 64  # points of a curve for each of its harmonics
_MARGIN = 0.08  # above and below the curves, relative to their range
_SMALL_FONT = 0.85  # size of a small font over that of labels, for which `wrapped` counts characters


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


_SHARES = (0.25, 0.5, 0.75, 1.0, 1.5)  # torques of a Harris map over that of the gears
_POSITIONS = 1000  # points of a curve of a Harris map
_TORQUES = LinearSegmentedColormap.from_list("torques", ["#a9bbdc", INK])  # from the least to the greatest


def harris_map(gears: GearPair | GearDesign, torques: Sequence[float | str] | None = None,
               ax: Axes | None = None, *, legend: bool = True) -> Axes:
    """Draw the mesh deflection over one mesh period for several torques, in µm along the line of action.

    It is the loaded transmission error at rest of teeth that are exact but for their relief and crowning: the
    transmission error of the unloaded gears is left out. The period begins when a tooth pair enters contact. The curve
    of the torque of the gears is red. The map is that of S. L. Harris (Proc. Inst. Mech. Eng. 172, 1958).

    Parameters
    ----------
    gears : GearPair or GearDesign
        The gear pair.
    torques : list of float or str, optional
        Torques at wheel 1, in N m or with a unit; by default 25, 50, 75, 100 and 150 % of that of the gears.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    legend : bool
        Add a legend with each torque and the peak-to-peak value of its curve.

    Returns
    -------
    Axes

    Raises
    ------
    InputError
        If there is no torque, or one is not positive, or the stiffness cannot be computed.

    Examples
    --------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(teeth=(50, 50), module="3 mm", face_width="20 mm",
    ...                        tip_relief={"amount": "15 um", "start_diameter": "153.5 mm"})
    >>> ax = gc.plot.harris_map(design, [100, 200, 300])
    >>> len(ax.lines)
    3
    """
    check_gears(gears)
    given = [share * own_torque(gears) for share in _SHARES] if torques is None else torques
    if isinstance(given, (str, bytes)) or not isinstance(given, Iterable) or not (listed := list(given)):
        raise InputError("torques", "must be a list of torques at wheel 1", given, "E.g. [100, 200, '300 N*m'].")
    moments = [to_si(f"torques[{i}]", torque, TORQUE, POSITIVE) for i, torque in enumerate(listed)]
    position = np.arange(_POSITIONS) / _POSITIONS  # without the end, where the stiffness may jump
    curves = [_UM * loaded_error(gears, torque, position) for torque in moments]
    ax, own, handles = new_axes(ax), gears.M10 if isinstance(gears, GearPair) else gears.torque, []
    for n, (torque, curve) in enumerate(zip(moments, curves, strict=True)):
        colour = STROBE if torque == own else to_hex(_TORQUES(n / max(len(curves) - 1, 1)))
        style: dict[str, Any] = {"color": adapt(colour), "linewidth": 1.4}
        ax.plot(position, curve, **style)
        label = f"{torque:.4g} N m: {np.ptp(curve):.3g} µm"
        handles.append(Line2D([], [], label=label, **style))
    ax.set(xlim=(0, 1), ylim=vertical_limits(np.array([0.0, *np.ravel(curves)]), 1.0),
           xlabel="fraction of the mesh period", ylabel="mesh deflection [µm]")
    second_axis_below(ax, 360 / (gears.n1 if isinstance(gears, GearPair) else gears.teeth[0]),
                      "roll angle of wheel 1 [deg]")
    if legend:
        draw_legend(ax, handles, title="torque at wheel 1, and the variation from peak to peak")
    return ax


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
    source = error.source
    if error.residual_peak:
        source += f"; left out: {_UM * error.residual_rms:.3g} µm rms, {_UM * error.residual_peak:.3g} µm at most"
    ax.set_title(wrapped(source, width_in_inches(ax) / _SMALL_FONT), loc="left", fontsize="small")
    return ax
