"""A gear design: its drawing in mesh, and its excitation over the mesh period, stiffness and transmission error."""

from __future__ import annotations

import math
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
from gearchaos.gears.design.transverse_section import TransverseSection, transverse_section
from gearchaos.gears.loaded_error import loaded_error, own_torque
from gearchaos.gears.pair import GearPair
from gearchaos.gears.units import TORQUE, to_si
from gearchaos.plot._datasets import check_design, check_gears, check_positive
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
from gearchaos.plot.theme import BACKGROUND, INK, STROBE, adapt, adapt_style
from gearchaos.quantities import POSITIVE
from gearchaos.validation import to_float

_MM, _UM, _PER_UM = 1e3, 1e6, 1e-6
_FACES = ("#e8ecf4", "#f4f1e8")  # colours of the wheels
_STYLES: dict[str, dict[str, Any]] = {
    "tip circles": {"color": "0.35", "linewidth": 0.6},
    "pitch circles": {"color": "#2f6db5", "linewidth": 0.9, "linestyle": (0, (5, 1.5, 1, 1.5))},
    "reference circles": {"color": "0.45", "linewidth": 0.8, "linestyle": (0, (4, 2))},
    "base circles": {"color": "#1b7a4b", "linewidth": 1.0, "linestyle": (0, (1.2, 1.8))},
    "line of action": {"color": INK, "linewidth": 1.0, "linestyle": (0, (6, 1.5, 1.5, 1.5))},
    "path of contact": {"color": STROBE, "linewidth": 2.4, "solid_capstyle": "butt"},
}
_CENTRE_LINE: dict[str, Any] = {"color": "0.45", "linewidth": 0.6, "linestyle": (0, (10, 3, 2, 3))}
_SAME = 1e-6  # relative difference below which reference circles are drawn as the working pitch circles that they are
_MOST_TEETH = 400  # above this number the whole wheel is drawn without teeth, which would be smaller than a pixel
_SMALL = 0.6  # diameter over that of the larger wheel below which number and arrow are beside a wheel, not within it
_LEAST_TEETH, _LARGEST_VIEW = 0.5, 1000.0
_LEAST_VIEW = 1.25  # least width of the close-up over that of the path of contact


def gear_pair(design: GearDesign, ax: Axes | None = None, *, teeth: float | None = 3.0,
              phase: float | None = None, legend: bool = True) -> Axes:
    """Draw both wheels in mesh in the transverse section, to scale, in mm.

    One panel shows the teeth in contact, another one, beside or below it, the whole pair. Wheel 1, which drives
    clockwise, lies below wheel 2. The flanks are the involutes and trochoids that the basic rack generates. A backlash
    is made by thinner teeth, by the same amount on both wheels; without one the teeth are nominal. Of helical gears it
    is one transverse plane. The pitch circles are the working ones; where the reference circles are the same, they are
    left out. A is the start and E the end of contact, C the pitch point (ISO 21771:2007); dots mark the
    points where flanks touch.

    Parameters
    ----------
    design : GearDesign
        The gear pair.
    ax : Axes, optional
        Where to draw; a new figure if left out.
    teeth : float or None
        Width of the close-up in pitches, at least as wide as the path of contact; None for the whole pair alone.
    phase : float, optional
        The instant, as a fraction of the mesh period since a tooth pair entered contact; by default in the middle of
        the time during which most tooth pairs are in contact.
    legend : bool
        Add a legend of the lines.

    Returns
    -------
    Axes
        With the close-up and the whole pair as its ``child_axes``, or the whole pair itself if ``teeth`` is None.

    Raises
    ------
    InputError
        If ``design`` is not a `gearchaos.GearDesign`.

    Examples
    --------
    >>> import gearchaos as gc
    >>> design = gc.GearDesign(teeth=(17, 103), module="8 mm", face_width="100 mm", profile_shift=(0.145, 0.0))
    >>> close_up = gc.plot.gear_pair(design)
    >>> len(close_up.child_axes)
    2
    """
    check_design(design)
    if teeth is not None and check_positive("teeth", teeth, _LARGEST_VIEW) < _LEAST_TEETH:
        raise InputError("teeth", f"must be at least {_LEAST_TEETH}", teeth)
    section = transverse_section(design, None if phase is None else to_float("phase", phase))
    ax = new_axes(ax)
    if teeth is None:
        _whole_pair(ax, section)
    else:
        close, whole = panels(ax, 0.64, beside=0.2)
        _close_up(close, section, teeth)
        _whole_pair(whole, section)
    if legend:
        draw_legend(ax, [Line2D([], [], label=name, **adapt_style(_STYLES[name])) for name in _shown(section)])
    return ax


def _shown(section: TransverseSection) -> list[str]:
    """Names of the lines; reference circles are left out if they are the working pitch circles."""
    geometry = section.geometry
    same = abs(geometry.working_diameter[0] / geometry.reference_diameter[0] - 1) <= _SAME
    return [name for name in _STYLES if not (same and name == "reference circles")]


def _ends(section: TransverseSection, *along: float) -> np.ndarray:
    """Points (N, 2) on the line of action in mm."""
    return _MM * np.array([section.on_line(position) for position in along])


def _close_up(ax: Axes, section: TransverseSection, teeth: float) -> None:
    """Draw the teeth in contact, about the middle of the path of contact."""
    path = _ends(section, section.start, section.end)
    pitch = _MM * math.pi * section.geometry.working_diameter[0] / section.geometry.teeth[0]
    box = ax.get_window_extent()
    half = max(teeth * pitch, _LEAST_VIEW * np.ptp(path[:, 0])) / 2
    size = np.array([half, half * box.height / box.width])
    middle = path.mean(axis=0)
    for wheel in (0, 1):  # the part of each wheel in the view
        z, centre = section.geometry.teeth[wheel], _MM * section.centres[wheel]
        depth = abs(middle[1] - centre[1]) - size[1]
        count = math.ceil(math.atan2(abs(middle[0]) + size[0], depth) / (2 * math.pi) * z) + 3 if depth > 0 else z
        near = count <= z / 2
        outline = _MM * (section.outline(wheel, range(-count, count + 1)) if near else section.outline(wheel))
        _fill(ax, np.vstack([outline, centre]) if near else outline, wheel)
    _circles(ax, section, middle, size)
    _line_of_action(ax, section, path)
    ax.set(xlim=(middle[0] - size[0], middle[0] + size[0]), ylim=(middle[1] - size[1], middle[1] + size[1]),
           xlabel="mm", ylabel="mm")
    ax.set_aspect("equal")


def _fill(ax: Axes, outline: np.ndarray, wheel: int, linewidth: float = 1.0) -> None:
    """Fill a closed outline (points, 2) in the colour of a wheel."""
    ax.fill(*outline.T, facecolor=adapt(_FACES[wheel]), edgecolor=adapt(INK), linewidth=linewidth, joinstyle="round",
            zorder=1)


def _circles(ax: Axes, section: TransverseSection, middle: np.ndarray, size: np.ndarray) -> None:
    """Draw the circles of both wheels, and the line of centres, in a view: its middle and half its size in mm."""
    geometry = section.geometry
    diameters = {"tip circles": geometry.tip_diameter, "pitch circles": geometry.working_diameter,
                 "reference circles": geometry.reference_diameter, "base circles": geometry.base_diameter}
    for name in (n for n in _shown(section) if n in diameters):
        style = adapt_style(_STYLES[name])
        for wheel, diameter in enumerate(diameters[name]):
            centre, radius = _MM * section.centres[wheel], _MM * diameter / 2
            # the part nearest to the view, longer than the view is wide and high
            half = min(2 * math.asin(min(1.0, math.hypot(*size) / radius)), math.pi)
            towards = math.atan2(*(middle - centre)[::-1])
            angle = np.linspace(towards - half, towards + half, 361)
            ax.plot(*(centre[:, None] + radius * np.array([np.cos(angle), np.sin(angle)])), zorder=2, **style)
    ax.axvline(0, zorder=1.5, **adapt_style(_CENTRE_LINE))


def _line_of_action(ax: Axes, section: TransverseSection, path: np.ndarray) -> None:
    """Draw the line of action between the base circles and, with its ends, (2, 2) in mm, the path of contact."""
    ends = _ends(section, 0.0, section.geometry.tangent_length)
    ax.plot(*ends.T, zorder=3, **adapt_style(_STYLES["line of action"]))
    ax.plot(*path.T, zorder=4, **adapt_style(_STYLES["path of contact"]))
    ax.plot(*_ends(section, *section.contacts).T, "o", color=adapt(STROBE), markeredgecolor=adapt(BACKGROUND),
            markeredgewidth=0.8, markersize=6, zorder=6)
    pitch_point = _MM * section.pitch_point
    ax.plot(*pitch_point, "o", color=adapt(BACKGROUND), markeredgecolor=adapt(INK), markersize=4, zorder=5)
    for name, point, offset in (("A", path[0], (-9, -4)), ("E", path[1], (9, 4)), ("C", pitch_point, (4, -11))):
        ax.annotate(name, tuple(point), offset, textcoords="offset points", ha="center", va="center", fontsize="small",
                    zorder=7, bbox={"boxstyle": "round,pad=0.12", "facecolor": adapt(BACKGROUND), "edgecolor": "none",
                                    "alpha": 0.85})


def _whole_pair(ax: Axes, section: TransverseSection) -> None:
    """Draw both wheels with their centres, sense of rotation and line of action."""
    geometry = section.geometry
    for wheel in (0, 1):
        _wheel(ax, section, wheel)
    ends, path = _ends(section, 0.0, geometry.tangent_length), _ends(section, section.start, section.end)
    ax.plot(*ends.T, **adapt_style({**_STYLES["line of action"], "linestyle": "-"}))
    ax.plot(*path.T, **adapt_style(_STYLES["path of contact"]))
    centres = _MM * section.centres
    ax.plot(*centres.T, zorder=3, **adapt_style(_CENTRE_LINE))
    ax.plot(*centres.T, "+", color=adapt(INK), markersize=6, zorder=4)
    width, (low, high) = max(geometry.tip_diameter) / 2, (-geometry.tip_diameter[0] / 2, geometry.tip_diameter[1] / 2)
    ax.set(xlim=(-1.03 * _MM * width, 1.03 * _MM * width),
           ylim=(_MM * (low - 0.03 * width), centres[1, 1] + _MM * (high + 0.03 * width)))
    ax.set_aspect("equal")
    ax.set_axis_off()
    teeth = " and ".join(map(str, geometry.teeth))
    ax.text(0.5, -0.02, f"{teeth} teeth\n$a$ = {_MM * geometry.centre_distance:.6g} mm", transform=ax.transAxes,
            ha="center", va="top", fontsize="small")


def _wheel(ax: Axes, section: TransverseSection, wheel: int) -> None:
    """Draw a whole wheel, as a disc if it has more teeth than can be seen, with an arrow for its rotation."""
    geometry, centre = section.geometry, _MM * section.centres[wheel]
    radius = _MM * geometry.working_diameter[wheel] / 2
    circle = np.linspace(0, 2 * math.pi, 361)
    disc = centre + radius * np.column_stack([np.cos(circle), np.sin(circle)])
    fine = geometry.teeth[wheel] > _MOST_TEETH
    _fill(ax, disc if fine else _MM * section.outline(wheel, detail=0.5), wheel, linewidth=0.6)
    small = geometry.tip_diameter[wheel] < _SMALL * max(geometry.tip_diameter)
    distance, start, end = (1.6, -40, 15) if small else (0.62, -25, 25)  # the arrow of a small wheel is outside it
    turn = np.radians(180 + (-1, 1)[wheel] * np.linspace(start, end, 30))
    x, y = centre[:, None] + distance * radius * np.array([np.cos(turn), np.sin(turn)])
    ax.plot(x[:-1], y[:-1], color=adapt(INK), linewidth=0.8)
    ax.annotate("", (x[-1], y[-1]), (x[-3], y[-3]),
                arrowprops={"arrowstyle": "-|>", "color": adapt(INK), "lw": 0.8, "shrinkA": 0, "shrinkB": 0})
    beside = centre[0] + small * _MM * geometry.tip_diameter[wheel] / 2
    ax.annotate(str(wheel + 1), (beside, centre[1]), (7, 0), textcoords="offset points", ha="left", va="center",
                fontsize="small")


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
    given = [share * own_torque(gears) for share in _SHARES] if torques is None else _listed(torques)
    moments = [to_si(f"torques[{i}]", torque, TORQUE, POSITIVE) for i, torque in enumerate(given)]
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


def _listed(torques: Any) -> list[Any]:
    """Torques as a list; raises `InputError` for anything else, or an empty one."""
    if isinstance(torques, (str, bytes)) or not isinstance(torques, Iterable) or not (found := list(torques)):
        raise InputError("torques", "must be a list of torques at wheel 1", torques, "E.g. [100, 200, '300 N*m'].")
    return found


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
